"""What the extended model leaves of the samples, and whether the raw counts beneath them shake with the wheel.

Samples tell when, on which axis and at which frequency below 100 Hz the residual sits. Whether it follows the wheel is
asked of the raw counts, whose 4 kHz hold every turn: while the wheel coasts at speed they are projected on harmonics of
its angle, the integral of its recorded speed (order tracking). An unbalanced wheel gives a peak at the order of its
turns, a force that grows with the square of the speed and a rate that grows with the speed itself.

The recorded speed counts electrical periods and takes the number of pole pairs from the source of the data. The order
of the turns says how many there are: where the loudest line of the calibration throws is at 6/7 of the recorded speed,
a motor that was taken to have six pairs of poles has seven.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from bayesid import Recording, SensorKind
from bayesid._math.arrays import Floats
from studies.throws.data import CALIBRATION, INTERVAL, POLE_PAIRS, SMOOTH, WHEEL_INERTIA, Timing, read_raw
from studies.throws.joint import Throw

CHANNELS = ("gyro x", "gyro y", "gyro z", "accel. x", "accel. y", "accel. z")

ORDERS = np.arange(0.4, 3.601, 0.02)  # frequencies relative to the wheel's as it is recorded
TURN = 1.5  # order below which the wheel's own turn is looked for

# phases of a flight, by the wheel's speed and its slope
PHASES = ("idle before", "running up", "fast", "running down", "idle after")

FAST, IDLE = 0.8, 0.3  # share of a throw's highest wheel speed above which it is fast, and below which it idles

# relative change of the wheel's speed in a second, up to which it coasts [1/s]: an eighth in the whole of it
STEADY = 1.5

BINS = np.fft.rfftfreq(96, INTERVAL)


@dataclass(frozen=True)
class Residual:
    """What is left of all throws of one body."""

    names: tuple[str, ...]
    # (frequencies, 6): amplitude of the residual of the samples at `BINS`, root mean square over throws [rad/s, m/s2]
    spectrum: Floats
    phase: Floats  # (5, 6): root mean square in the phases of `PHASES` [rad/s, m/s2]; NaN without a sample
    # (6,): over the flight, and the noise of quiet stretches
    rms: Floats
    quiet: Floats
    # (3,): frequency of the wheel where it idles before, at its highest, and where it idles after: means over throws
    # [Hz]
    wheel: Floats
    # (throws, orders, 6): amplitude of the raw readings at `ORDERS` times the wheel's frequency while it is fast
    # [rad/s, m/s2]
    orders: Floats
    # (5, 6): root mean square that an imbalance of this amplitude leaves in the samples, by phase [rad/s, m/s2]
    shaken: Floats

    @property
    def frequencies(self) -> Floats:
        """Frequencies of the spectrum [Hz]."""
        return BINS

    def loudest(self, channel: int) -> float:
        """Return the frequency above 10 Hz at which the residual of a channel is largest [Hz]."""
        high = BINS > 10.0
        return float(BINS[high][np.argmax(self.spectrum[high, channel])])

    def peaks(self, channel: int) -> Floats:
        """Return the order below 1.5 at which each throw's raw readings are loudest, shape (throws,)."""
        return ORDERS[ORDERS < TURN][np.argmax(self.orders[:, ORDERS < TURN, channel], axis=1)]

    @property
    def turn(self) -> tuple[float, Floats, Floats]:
        """Order of the loudest line, its amplitudes over throws, (6,), and those half an order beside it, (6,).

        Amplitudes are in the unit of the channel.
        """
        return _turn(self.orders)


def _turn(orders: Floats) -> tuple[float, Floats, Floats]:
    mean = np.sqrt((orders**2).mean(axis=0))
    place = int(np.argmax(mean[ORDERS < TURN, 3:].max(axis=1)))
    beside = np.argmin(np.abs(ORDERS - ORDERS[place] - 0.5))
    return float(ORDERS[place]), mean[place], mean[beside]


def pole_pairs(left: Sequence[Residual]) -> int:
    """Return the number of pole pairs that the loudest line of some bodies says, were it the wheel's own turn."""
    peaks = [residual.peaks(3 + int(np.argmax(residual.turn[1][3:]))) for residual in left]
    return round(POLE_PAIRS / float(np.median(np.concatenate(peaks))))


def residual_of(throws: Sequence[Throw], folder: Path) -> Residual:
    """Describe what the fitted throws of one body leave."""
    spectra, phases, squares, wheels, orders, runs = [], [], [], [], [], []
    for throw in throws:
        time, residual = _residual(throw)
        recording = throw.posterior.manoeuvres[0].recording
        wheel_time, momentum = recording.vector("wheel_momentum")
        speed = np.abs(np.interp(time, wheel_time, momentum[:, 2])) / WHEEL_INERTIA
        top = float(np.abs(momentum[:, 2]).max()) / WHEEL_INERTIA
        where = _phase(speed / top, np.argmax(np.abs(momentum[:, 2])) * wheel_time[1] > time)
        runs.append((speed, where))
        phases.append([(residual[where == k] ** 2).sum(axis=0) for k in range(len(PHASES))])
        squares.append([(where == k).sum() for k in range(len(PHASES))])
        spectra.append(_amplitudes(time, residual))
        wheels.append([speed[where == 0].mean(), top, speed[where == 4].mean()])
        orders.append(orders_of(recording, folder))
    total, count = np.sum(phases, axis=0), np.sum(squares, axis=0)[:, None]
    quiet = np.concatenate(
        [sensor.noise.sigma(INTERVAL) for sensor in throws[0].posterior.model.sensors if sensor.kind.mounted]
    )
    return Residual(
        names=tuple(throw.name for throw in throws),
        spectrum=np.sqrt(np.mean(np.square(spectra), axis=0)),
        phase=np.sqrt(np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0)),
        rms=np.sqrt(total.sum(axis=0) / count.sum()),
        quiet=quiet,
        wheel=np.nanmean(wheels, axis=0) / (2.0 * np.pi),
        orders=np.stack(orders),
        shaken=_shaken(np.stack(orders), runs),
    )


def _shaken(orders: Floats, runs: Sequence[tuple[Floats, NDArray[np.intp]]]) -> Floats:
    """Root mean square of what the turn leaves in the samples by phase, (5, 6), its amplitude that of fast stretches.

    The filter of the samples passes a part of what turns at a speed; faster turns alias, and count all the same.
    """
    order, amplitude, _ = _turn(orders)
    power = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])
    square, count = np.zeros((len(PHASES), 6)), np.zeros((len(PHASES), 1))
    for speed, where in runs:
        u = (order * speed * SMOOTH)[:, None]
        gain = (1.0 + 0.5 * u**2) * np.exp(-0.5 * u**2)
        wave = amplitude * (speed[:, None] / speed[where == PHASES.index("fast")].mean()) ** power * gain
        for k in range(len(PHASES)):
            square[k] += 0.5 * (wave[where == k] ** 2).sum(axis=0)
            count[k] += (where == k).sum()
    return np.sqrt(np.divide(square, count, out=np.full(square.shape, np.nan), where=count > 0))


def _residual(throw: Throw) -> tuple[Floats, Floats]:
    """Return times (n,) [s] and residual (n, 6) of the samples in physical units."""
    posterior = throw.posterior
    there = posterior.whitenings[0].outputs.all(axis=1)
    sigma = np.concatenate([posterior.data.sigma(0, kind) * np.ones(3) for kind in (SensorKind.RATE, SensorKind.ACCEL)])
    time, _ = posterior.data.measured(0, SensorKind.RATE)
    return time, (throw.residuals(throw.z) * throw.noise * sigma)[there]


def _phase(share: Floats, before: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the place among `PHASES` of samples, given the wheel's speed relative to its highest."""
    slow = np.where(share < IDLE, np.where(before, 0, 4), np.where(before, 1, 3))
    return np.where(share > FAST, 2, slow)


def _amplitudes(time: Floats, residual: Floats) -> Floats:
    """Amplitudes at `BINS` by least squares on a sine of each frequency, since samples are missing: shape (f, 6)."""
    amplitudes = []
    for frequency in BINS:
        angle = 2.0 * np.pi * frequency * time
        waves = np.column_stack([np.cos(angle), np.sin(angle)])
        share = np.linalg.lstsq(waves, residual, rcond=None)[0]
        amplitudes.append(np.sqrt((share**2).sum(axis=0)))
    return np.array(amplitudes)


def orders_of(recording: Recording, folder: Path) -> Floats:
    """Return amplitudes of the raw readings of a throw at `ORDERS` while the wheel coasts at speed: (orders, 6)."""
    wheel_time, momentum = recording.vector("wheel_momentum")
    clock, readings, _ = read_raw(folder / "throws" / f"{recording.name}.csv")
    turning = np.abs(momentum[:, 2]) / WHEEL_INERTIA
    angle = cumulative_trapezoid(turning, wheel_time, initial=0)
    slope = np.abs(np.gradient(turning, wheel_time))
    coasting = wheel_time[(turning > FAST * turning.max()) & (slope < STEADY * turning)] + Timing().start
    rows = (clock > coasting[0]) & (clock < coasting[-1])
    smooth = np.vander(np.linspace(-1.0, 1.0, rows.sum()), 4)
    left = readings[rows] - smooth @ np.linalg.lstsq(smooth, readings[rows], rcond=None)[0]
    weight = np.hanning(rows.sum())
    turn = np.interp(clock[rows] - Timing().start, wheel_time, angle)
    return np.abs(np.exp(-1j * ORDERS[:, None] * turn) * (2.0 * weight / weight.sum()) @ left)


# distance from the expected order within which a throw's loudest line counts as the wheel's turn; the wheel coasts for
# some 0.09 s, which tells orders 0.05 apart
NEAR = 0.03


def shaken_axis(left: Residual) -> int:
    """Return the channel of the accelerometer that the wheel shakes most."""
    return 3 + int(np.argmax(left.turn[1][3:]))


def following(left: Residual, pairs: int) -> int:
    """Return in how many throws the loudest line below order 1.5 is the turn of a wheel with some pairs of poles."""
    return int((np.abs(left.peaks(shaken_axis(left)) - POLE_PAIRS / pairs) < NEAR).sum())


def shaking_words(left: Mapping[str, Residual], pairs: int) -> list[str]:
    """Return sentences on what shakes the device and when, for bodies of the calibration and others."""
    axes = {body: shaken_axis(residual) for body, residual in left.items()}
    known = [residual for body, residual in left.items() if body in CALIBRATION]
    others = [residual for body, residual in left.items() if body not in CALIBRATION]
    counts = [
        f"{sum(following(residual, pairs) for residual in of)} of {sum(len(residual.names) for residual in of)}"
        for of in (known, others)
    ]
    running = [residual.shaken[1, axes[body]] / residual.phase[1, axes[body]] for body, residual in left.items()]
    loudest = [PHASES[int(np.nanargmax(residual.phase[:, axes[body]]))] for body, residual in left.items()]
    most = max(set(loudest), key=loudest.count)
    shaken = (
        f"The wheel shakes the device: the strongest line of the raw accelerometer is at {POLE_PAIRS}/{pairs} of the "
        f"recorded wheel's frequency, a ratio from the calibration throws ({counts[0]}) that is confirmed by "
        f"{counts[1]} throws of the bodies"
    )
    if pairs != POLE_PAIRS:
        shaken += (
            f". The motor appears to have {pairs} pole pairs instead of the {POLE_PAIRS} stated by the source of the "
            "data; the wheel would then turn more slowly than recorded. The inertias of the bodies do not change, "
            "since the known box calibrates the wheel's momentum; its inertia would be larger by the same factor"
        )
    return [
        f"{shaken}.",
        f"The residual is largest while the wheel is {most} on {loudest.count(most)} of {len(left)} bodies, where it "
        "passes through the frequencies that samples every 5 ms transmit. An imbalance of the observed size would give "
        f"{min(running):.1f} to {max(running):.1f} times that residual. Its force differs between bodies, unlike that "
        "of a single static imbalance.",
    ]
