"""Faults of sensors: constant errors, encoder offsets, clocks, coloured noise, outliers, quantisation, and others.

A sensor with constant errors sees

    measured = (1 + scale) * (rotation(misalignment) * true(t - latency)) + bias + drift * t

and a joint's encoder records true + offset.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from studies.truth.numerics import Array
from studies.truth.readings import Truth
from studies.truth.recordings import Table, by_axis

__all__ = [
    "Backlash",
    "BiasJump",
    "ColouredNoise",
    "CurvedGyro",
    "EncoderOffset",
    "Outliers",
    "Quantisation",
    "TurnedStarSensor",
    "VectorFault",
    "WrongClock",
]

Generator = np.random.Generator
Vector = Sequence[float] | Array


@dataclass(frozen=True)
class VectorFault:
    """Constant errors of the rate sensor or the accelerometer, one number per axis, in the sensor's units.

    Each is (3,): bias, drift [1/s], scale [1], and the rotation vector `misalignment` [rad].
    """

    sensor: str
    bias: Vector = (0.0, 0.0, 0.0)
    drift: Vector = (0.0, 0.0, 0.0)
    scale: Vector = (0.0, 0.0, 0.0)
    misalignment: Vector = (0.0, 0.0, 0.0)

    def __call__(self, table: Table, truth: Truth) -> None:
        """Change the noise-free columns in place."""
        names = [f"{self.sensor}.{axis}" for axis in "xyz"]
        turned = (
            np.stack([table[name] for name in names], axis=1) @ Rotation.from_rotvec(self.misalignment).as_matrix().T
        )
        measured = (1.0 + np.asarray(self.scale)) * turned + np.asarray(self.bias) + np.outer(truth.times, self.drift)
        table |= by_axis(self.sensor, "xyz", measured)


@dataclass(frozen=True)
class EncoderOffset:
    """The encoder of a joint records true + offset [rad]."""

    joint: str
    offset: float

    def __call__(self, table: Table, truth: Truth) -> None:
        """Change the noise-free columns in place."""
        table[f"position.{self.joint}"] += self.offset


@dataclass(frozen=True)
class WrongClock:
    """The samples of a sensor are stamped with the true time times (1 + rate)."""

    sensor: str
    rate: float

    def __call__(self, table: Table, truth: Truth) -> None:
        """Change the noise-free columns in place."""
        for axis in "xyz":
            name = f"{self.sensor}.{axis}"
            there = np.isfinite(table[name])
            spline = CubicSpline(truth.times[there], table[name][there])
            table[name] = np.where(there, spline(truth.times / (1.0 + self.rate)), np.nan)


@dataclass(frozen=True)
class TurnedStarSensor:
    """The measured attitudes are the true ones times the rotation by a vector (3,) in base axes [rad]."""

    vector: Vector

    def __call__(self, table: Table, truth: Truth) -> None:
        """Change the noise-free columns in place."""
        values = np.stack([table[f"attitude.{axis}"] for axis in "xyzw"], axis=1)
        there = np.isfinite(values[:, 0])
        values[there] = (Rotation.from_quat(values[there]) * Rotation.from_rotvec(self.vector)).as_quat()
        table |= by_axis("attitude", "xyzw", values)


@dataclass(frozen=True)
class BiasJump:
    """The bias of a sensor jumps once by a vector (3,), in the sensor's units; outside the catalogue."""

    sensor: str
    jump: Vector
    at: float

    def __call__(self, table: Table, truth: Truth) -> None:
        """Change the noise-free columns in place."""
        for axis, size in zip("xyz", self.jump, strict=True):
            table[f"{self.sensor}.{axis}"] += np.where(truth.times >= self.at, size, 0.0)


@dataclass(frozen=True)
class CurvedGyro:
    """The rate sensor errs by a multiple of the rate's square along each axis [s/rad]; outside the catalogue."""

    curvature: Vector

    def __call__(self, table: Table, truth: Truth) -> None:
        """Change the noise-free columns in place."""
        for axis, size in zip("xyz", self.curvature, strict=True):
            table[f"rate.{axis}"] += size * table[f"rate.{axis}"] ** 2


@dataclass(frozen=True)
class Backlash:
    """The encoder of a joint leads or trails by half of a gap [rad], by the sense of its motion; outside the catalogue.

    The change of sense takes about the time in which the joint moves at ``slow`` [rad/s].
    """

    joint: str
    gap: float
    slow: float = 5e-4

    def __call__(self, table: Table, truth: Truth) -> None:
        """Change the noise-free columns in place."""
        name = f"position.{self.joint}"
        there = np.isfinite(table[name])
        speed = CubicSpline(truth.times[there], table[name][there])(truth.times, 1)
        table[name] = table[name] + 0.5 * self.gap * np.tanh(speed / self.slow)


@dataclass(frozen=True)
class ColouredNoise:
    """An Ornstein-Uhlenbeck process on each axis, beside the white noise."""

    sensor: str
    sigma: float
    correlation_time: float

    def __call__(self, table: Table, times: Array, generator: Generator) -> None:
        """Change the noisy columns in place."""
        decay = np.exp(-np.diff(times) / self.correlation_time)
        for axis in "xyz":
            kicks = self.sigma * generator.standard_normal(len(times))
            error = kicks.copy()
            for k, a in enumerate(decay):
                error[k + 1] = a * error[k] + np.sqrt(1.0 - a**2) * kicks[k + 1]
            table[f"{self.sensor}.{axis}"] += error


@dataclass(frozen=True)
class Outliers:
    """A fraction of the scalar samples is wrong by 10 to 20 sigma, either way."""

    sensor: str
    fraction: float
    sigma: float

    def __call__(self, table: Table, times: Array, generator: Generator) -> None:
        """Change the noisy columns in place."""
        for axis in "xyz":
            hit = generator.random(len(times)) < self.fraction
            error = generator.choice([-1.0, 1.0], len(times)) * generator.uniform(10.0, 20.0, len(times))
            table[f"{self.sensor}.{axis}"] += np.where(hit, self.sigma * error, 0.0)


@dataclass(frozen=True)
class Quantisation:
    """Samples are rounded to multiples of the step."""

    sensor: str
    step: float

    def __call__(self, table: Table, times: Array, generator: Generator) -> None:
        """Change the noisy columns in place."""
        for axis in "xyz":
            name = f"{self.sensor}.{axis}"
            table[name] = self.step * np.round(table[name] / self.step)
