"""What the extended model leaves of the samples, and whether the raw counts beneath them shake with the wheel.

Samples tell when, on which axis and at which frequency below 50 Hz the residual sits. Whether it follows the wheel is
asked of the raw counts, whose 4 kHz hold every turn (`studies.throws.rotor`). An unbalanced wheel gives a peak at the
order of its turns, a force that grows with the square of the speed and a rate that grows with the speed itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bayesid import SensorKind
from bayesid._math.arrays import Floats
from studies.throws.data import INTERVAL, SMOOTH, WHEEL_INERTIA
from studies.throws.joint import Throw
from studies.throws.raw import RawThrow, Timing
from studies.throws.rotor import FAST, ORDERS, TURN, lines_of, loudest_orders, near

CHANNELS = ("gyro x", "gyro y", "gyro z", "accel. x", "accel. y", "accel. z")

# phases of a flight, by the wheel's speed and its slope
PHASES = ("idle before", "running up", "fast", "running down", "idle after")

IDLE = 0.3  # share of a throw's highest wheel speed below which it idles

BINS = np.fft.rfftfreq(45, INTERVAL)


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
        raw = RawThrow.read(folder / "throws" / f"{recording.name}.csv")
        orders.append(np.abs(lines_of(raw, Timing(), ORDERS)))
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
    """Root mean square of what the turn leaves in the samples by phase, (5, 6), with its fast amplitude."""
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


def shaken_axis(left: Residual) -> int:
    """Return the channel of the accelerometer that the wheel shakes most."""
    return 3 + int(np.argmax(left.turn[1][3:]))


def following(left: Residual) -> int:
    """Return in how many throws the loudest line below order 1.5 is the turn of the wheel."""
    return near(loudest_orders(left.orders), 1.0)


def shaking_words(left: Mapping[str, Residual]) -> list[str]:
    """Return sentences on what shakes the device and when."""
    axes = {body: shaken_axis(residual) for body, residual in left.items()}
    count, total = sum(map(following, left.values())), sum(len(residual.names) for residual in left.values())
    running = [residual.shaken[1, axes[body]] / residual.phase[1, axes[body]] for body, residual in left.items()]
    loudest = [PHASES[int(np.nanargmax(residual.phase[:, axes[body]]))] for body, residual in left.items()]
    most = max(set(loudest), key=loudest.count)
    return [
        "The wheel shakes the device: the strongest line of the raw accelerometer is at the frequency of the wheel in "
        f"{count} of {total} throws.",
        f"The residual is largest in the wheel's phase “{most}” on {loudest.count(most)} of {len(left)} bodies. An "
        f"imbalance of the observed size would give {min(running):.1f} to {max(running):.1f} times the residual of the "
        "samples while the wheel is running up.",
    ]
