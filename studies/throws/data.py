"""The measured throws, read from raw counts into recordings of independent samples, and what is known of the bodies.

Source of the data: Blaha, Kuijper, Pop, Smeur, "Rapid and Inexpensive Inertia Tensor Estimation from a Single Object
Throw", arXiv:2503.13137. They are not part of the project; `DEFAULT_FOLDER` says where they are expected.

A sample is the value of a local parabola with Gaussian weights (Fan and Gijbels, Local polynomial modelling, 1996):
it passes polynomials of degree three unchanged. Samples that are 2.149 weight widths apart are uncorrelated where the
raw noise is white, and those twice as far have a correlation of -0.006. Their noise is measured where the wheel hardly
accelerates: there the motion follows a polynomial of degree five over a few hundredths of a second, and what samples
leave about it is noise of the sensors and vibration of the wheel's bearings.

A fit starts from a linear regression. Euler's equation with the wheel is linear in the inertia, and the accelerometer's
reading in free fall is linear in its place relative to the centre of mass. Only the mass has to be known.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from bayesid import InertialParameters, InputError, Recording
from bayesid._math.arrays import Floats
from studies.throws.raw import IDLE_TURN, RawThrow, Timing
from studies.throws.rotor import rotor_phases

DEFAULT_FOLDER = Path(__file__).resolve().parents[3] / "shared" / "data" / "throws"  # beside the checkout

# the device alone and the device on a box of known inertia, which every comparison needs
CALIBRATION = ("cal_device", "cal_proof")

# throws that are not used, with the reason
EXCLUDED = {"Empty_LOG00188": "its gyro is saturated; the data folder does not contain it"}

# nominal inertia of the wheel [kg m2]; every inertia scales with it, and the known box gives its true value
WHEEL_INERTIA = 1.69e-6

INTERVAL = 0.010  # between samples [s], so long that their filter passes nothing of the wheel at speed, 200 Hz

# width of the weights [s], at which the correlation of neighbouring samples is zero
SMOOTH = INTERVAL / np.sqrt(14.0 - np.sqrt(88.0))

WHEEL_STEPS = 4  # values of the wheel's momentum per sample


@dataclass(frozen=True)
class Truth:
    """What the authors state of the bodies: masses [kg] and principal moments about the own centre of mass [kg m2].

    ``moments`` holds the box and every body but the device; ``mass`` the same.
    """

    device_mass: float
    mass: dict[str, float]
    moments: dict[str, Floats]

    @property
    def objects(self) -> tuple[str, ...]:
        """Bodies that are compared with their geometry."""
        return tuple(name for name in self.mass if name not in CALIBRATION)

    @property
    def bodies(self) -> tuple[str, ...]:
        """All bodies that are thrown, calibration first."""
        return (*CALIBRATION, *self.objects)

    def thrown_mass(self, body: str) -> float:
        """Mass of a body with the device on it [kg]."""
        return self.device_mass + self.mass.get(body, 0.0)


def read_truth(folder: Path) -> Truth:
    """Read the authors' masses and geometry.

    Raises
    ------
    InputError
        If the folder lacks the file.
    """
    file = folder / "truth.json"
    if not file.is_file():
        raise InputError("the measured throws are missing: no truth.json", file=folder, remedy=_REMEDY)
    content = json.loads(file.read_text(encoding="utf-8"))
    proof, bodies = content["proof_body"], content["bodies"]
    tensors = {"cal_proof": proof["I_com"], **{name: body["I_com_grid"] for name, body in bodies.items()}}
    return Truth(
        device_mass=content["device"]["mass"],
        mass={"cal_proof": proof["mass"], **{name: body["mass"] for name, body in bodies.items()}},
        moments={name: np.linalg.eigvalsh(np.array(tensor)) for name, tensor in tensors.items()},
    )


def raw_throws(folder: Path, body: str, count: int | None = None) -> list[RawThrow]:
    """Read the raw throws of one body, the first ``count`` of them.

    Raises
    ------
    InputError
        If there are none.
    """
    logs = sorted((folder / "throws").glob(f"{body}_LOG*.csv"))
    files = [file for file in logs if file.stem not in EXCLUDED]
    if not files:
        raise InputError(f"no throws of {body!r}", file=folder / "throws", remedy=_REMEDY)
    return [RawThrow.read(file) for file in files[:count]]


def read_throws(folder: Path, body: str, timing: Timing, count: int | None = None) -> list[Recording]:
    """Return the samples of the throws of one body, the first ``count`` of them."""
    raws = raw_throws(folder, body, count)
    return [_recording(raw, timing, phase) for raw, phase in zip(raws, rotor_phases(raws, timing), strict=True)]


_REMEDY = "Give the folder of the thrown-body measurements (SOURCE.txt, truth.json, throws/*.csv)"


def _recording(raw: RawThrow, timing: Timing, phase: float) -> Recording:
    """Return samples that begin where the wheel's angle, ``phase`` at the start of the flight, is zero."""
    idle = np.abs(raw.wheel_speed(timing.start + np.linspace(0.0, IDLE_TURN), timing)).mean()
    start = timing.start + (-phase % (2.0 * np.pi)) / idle
    step = INTERVAL / WHEEL_STEPS
    grid = start + step * np.arange(WHEEL_STEPS * round(timing.duration / INTERVAL) + 1)
    fine = np.arange(grid[0] - 5.0 * SMOOTH, grid[-1] + 5.0 * SMOOTH, 0.25e-3)
    speed = _weights(grid, fine) @ raw.wheel_speed(fine, timing)
    acceleration = np.abs(np.gradient(speed, grid))
    fast = maximum_filter1d(acceleration, 2 * round(timing.margin / step) + 1) > timing.fast
    skip = np.arange(len(grid)) % WHEEL_STEPS != 0
    channels: dict[str, Floats] = {"wheel_momentum.x": np.zeros(len(grid)), "wheel_momentum.y": np.zeros(len(grid))}
    channels["wheel_momentum.z"] = WHEEL_INERTIA * speed
    for index, values in enumerate((_weights(grid, raw.clock) @ raw.readings).T):
        family = "rate" if index < 3 else "accel"
        channels[f"{family}.{'xyz'[index % 3]}"] = np.where(skip | fast, np.nan, values)
    return Recording(raw.name, None, grid - start, channels)


def _weights(grid: Floats, clock: Floats) -> Floats:
    """Weights of raw values at instants ``clock`` in the samples at ``grid``, shape (grid, clock)."""
    distance = (grid[:, None] - clock) / SMOOTH
    kernel = (1.5 - 0.5 * distance**2) * np.exp(-0.5 * distance**2)
    return np.asarray(kernel / kernel.sum(axis=1, keepdims=True))


SPAN, DEGREE = 7, 5  # samples of one polynomial and its degree
QUIET = 2000.0  # wheel acceleration up to which the polynomial follows the motion [rad/s2], a tenth of the largest


def quiet_noise(recordings: Sequence[Recording], sensor: str) -> Floats:
    """Return the standard deviation of one sample of a sensor, shape (3,), from all quiet stretches of some recordings.

    Every stretch of seven samples gives one residual, that of its middle; its variance is that of a sample times one
    less the weight that the middle has in its own polynomial.
    """
    place = np.vander(np.linspace(-1.0, 1.0, SPAN), DEGREE + 1)
    leave = (np.eye(SPAN) - place @ np.linalg.pinv(place))[SPAN // 2]
    square: list[Floats] = []
    for recording in recordings:
        time, values = recording.vector(sensor)
        if sensor == "wheel_momentum":
            time, values = time[::WHEEL_STEPS], values[::WHEEL_STEPS]
        wheel_time, wheel = recording.vector("wheel_momentum")
        slope = np.abs(np.gradient(wheel[:, 2], wheel_time)) / WHEEL_INERTIA
        for first in range(len(time) - SPAN + 1):
            stretch = slice(first, first + SPAN)
            inside = (wheel_time >= time[stretch][0]) & (wheel_time <= time[stretch][-1])
            if time[stretch][-1] - time[stretch][0] < (SPAN - 0.5) * INTERVAL and slope[inside].max() < QUIET:
                square.append((leave @ values[stretch]) ** 2 / leave[SPAN // 2])
    return np.sqrt(np.mean(square, axis=0))


# least principal moment of the second moments of mass relative to their trace, where noise gives what no body has
SHARE = 0.05


def regress(recordings: Sequence[Recording], mass: float) -> InertialParameters:
    """Return the body of a mass that explains differenced rates and accelerations best.

    Raises
    ------
    InputError
        If the recordings do not hold the wheel's momentum.
    """
    if any("wheel_momentum.z" not in recording.channels for recording in recordings):
        raise InputError("the wheel is not recorded", remedy="Record it: its inertia sets the scale of the regression")
    left, right = (np.concatenate(parts) for parts in zip(*map(_euler, recordings), strict=True))
    xx, xy, xz, yy, yz, zz = np.linalg.lstsq(left, right, rcond=None)[0]
    place, reading = (np.concatenate(parts) for parts in zip(*map(_accelerometer, recordings), strict=True))
    com = -np.linalg.lstsq(place, reading, rcond=None)[0]
    return InertialParameters(mass, com, _possible(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])))


def _possible(inertia: Floats) -> Floats:
    """Return the nearest inertia whose second moments of mass are those of a body with volume."""
    second = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    size, axes = np.linalg.eigh(second)
    second = axes @ np.diag(np.maximum(size, SHARE * np.abs(size).sum())) @ axes.T
    return np.asarray(np.trace(second) * np.eye(3) - second)


def _euler(recording: Recording) -> tuple[Floats, Floats]:
    """Return I dw/dt + w x I w = -(dh/dt + w x h) as rows over xx, xy, xz, yy, yz, zz."""
    time, rate, slope, good = _differenced(recording)
    wheel_time, wheel = recording.vector("wheel_momentum")
    at = np.searchsorted(wheel_time, time)
    torque = np.gradient(wheel, wheel_time, axis=0)[at]
    turned = np.cross(rate[:, None, :], _times_inertia(rate).transpose(0, 2, 1)).transpose(0, 2, 1)
    left, right = _times_inertia(slope) + turned, -(torque + np.cross(rate, wheel[at]))
    return left[good].reshape(-1, 6), right[good].ravel()


def _accelerometer(recording: Recording) -> tuple[Floats, Floats]:
    """Return a = dw/dt x r + w x (w x r) with the throw's mean taken off, as rows over r."""
    _, rate, slope, good = _differenced(recording)
    _, reading = recording.vector("accel")
    turn = _cross(slope) + _cross(rate) @ _cross(rate)
    left, right = turn[good], reading[good]
    return (left - left.mean(axis=0)).reshape(-1, 3), (right - right.mean(axis=0)).ravel()


def _differenced(recording: Recording) -> tuple[Floats, Floats, Floats, NDArray[np.bool_]]:
    """Return times, rates and their derivatives, and where both neighbours are there."""
    time, rate = recording.vector("rate")
    gap = np.diff(time) > 1.5 * recording.interval("rate.x")
    good = ~(np.concatenate([[True], gap]) | np.concatenate([gap, [True]]))
    return time, rate, np.gradient(rate, time, axis=0), good


def _cross(vector: Floats) -> Floats:
    return np.cross(vector[:, None, :], np.eye(3)).transpose(0, 2, 1)


def _times_inertia(vector: Floats) -> Floats:
    """Matrices (T, 3, 6) that give inertia times vector (T, 3)."""
    x, y, z = vector.T
    o = np.zeros_like(x)
    return np.array([[x, y, z, o, o, o], [o, x, o, y, z, o], [o, o, x, o, y, z]]).transpose(2, 0, 1)
