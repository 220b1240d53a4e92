"""Motion of the wheels whose speed is recorded, smoothed like that of joints (`bayesid.recording.smoothing`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType

import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.recording.jumps import smooth_joints
from bayesid.recording.recording import WHEEL_SPEED, Recording
from bayesid.recording.sampled_curve import SampledCurve
from bayesid.recording.smoothing import JointSamples, SmoothedJoint
from bayesid.robot.wheel import Wheel

__all__ = ["COURSE", "WheelMotion", "check_wheels"]

COURSE = ("angle", "speed", "acceleration", "jerk", "snap")
"""What is known of a wheel at an instant: the integral of its speed [rad], the speed [rad/s] and its derivatives."""

FEWEST = 8  # samples of a speed from which on it is smoothed


@dataclass(frozen=True)
class WheelMotion:
    """Motion of W wheels relative to the base.

    Parameters
    ----------
    rotors : (W,) sequence of Wheel
    curves : (W,) sequence
        Smoothed motion of each, or an exact curve (n, 1) of its speed.
    """

    rotors: Sequence[Wheel] = ()
    curves: Sequence[SmoothedJoint | SampledCurve] = ()

    @classmethod
    def planned(cls, rotors: Sequence[Wheel], speeds: Mapping[str, SampledCurve] = MappingProxyType({})) -> WheelMotion:
        """Return the motion of wheels with stated speeds (n, 1) by their names [rad/s]; the others are at rest.

        Parameters
        ----------
        rotors : sequence of Wheel
        speeds : mapping of str to SampledCurve, optional
        """
        rest = SampledCurve(np.zeros(1), np.zeros((1, 1)))
        return cls(tuple(rotors), tuple(speeds.get(wheel.name, rest) for wheel in rotors))

    @classmethod
    def from_recording(cls, recording: Recording, rotors: Sequence[Wheel], per_second: float = 0.0) -> WheelMotion:
        """Return the motion of wheels that are all recorded; a speed that never changes is exact.

        Parameters
        ----------
        recording : Recording
        rotors : sequence of Wheel
        per_second : float
            Rate above which speeds are averaged over blocks [1/s]; 0 keeps every sample.
        """
        samples = [recording.series(f"{WHEEL_SPEED}.{wheel.name}") for wheel in rotors]
        curves: list[SmoothedJoint | SampledCurve] = [SampledCurve(t, speed[:, None]) for t, speed in samples]
        uneven = [k for k, (t, speed) in enumerate(samples) if len(t) >= FEWEST and np.ptp(speed) > 0.0]
        smoothed = _smoothed(tuple((samples[k][0].tobytes(), samples[k][1].tobytes()) for k in uneven), per_second)
        for k, joint in zip(uneven, smoothed, strict=True):
            curves[k] = joint
        return cls(tuple(rotors), tuple(curves))

    @property
    def is_uncertain(self) -> bool:
        """Whether the motion of any wheel is smoothed from samples with errors."""
        return any(isinstance(curve, SmoothedJoint) for curve in self.curves)

    def momentum(self, time: Floats) -> tuple[Floats, Floats]:
        """Return the momentum of the wheels and its derivative at the times (T,), base axes, each of shape (T, 3)."""
        along = np.array([wheel.inertia * np.asarray(wheel.axis) for wheel in self.rotors]).reshape(-1, 3)
        courses = self.courses(time)
        return courses[:, :, 1] @ along, courses[:, :, 2] @ along

    def courses(self, time: Floats) -> Floats:
        """Return what `COURSE` lists of each wheel at the times (T,): shape (T, W, 5)."""
        columns = np.zeros((len(self.rotors), len(COURSE), len(time)))
        for k, curve in enumerate(self.curves):
            if isinstance(curve, SampledCurve):
                columns[k] = [curve.at(time, order)[:, 0] for order in range(-1, len(COURSE) - 1)]
            else:
                columns[k] = curve.derivatives(time, len(COURSE))
        return np.moveaxis(columns, -1, 0)

    def speed_channels(self, time: Floats) -> dict[str, Floats]:
        """Return the speeds of the wheels at the times (T,) as columns of a recording."""
        speeds = self.courses(time)[:, :, 1].T
        return {f"{WHEEL_SPEED}.{wheel.name}": speed for wheel, speed in zip(self.rotors, speeds, strict=True)}

    def lag_covariance(self, time: Floats, lags: int) -> Floats:
        """Return the covariances of the errors of angle, speed and acceleration, (W, lags + 1, T, 3, 3).

        Parameters
        ----------
        time : (T,) array
            Times [s].
        lags : int
            As of `SmoothedJoint.lag_covariance`.
        """
        covariance = np.zeros((len(self.rotors), lags + 1, len(time), 3, 3))
        for k, curve in enumerate(self.curves):
            if isinstance(curve, SmoothedJoint):
                covariance[k] = curve.lag_covariance(time, lags)
        return covariance


@lru_cache(maxsize=64)  # the same recordings are asked for whenever a posterior is made of them
def _smoothed(samples: tuple[tuple[bytes, bytes], ...], per_second: float) -> tuple[SmoothedJoint, ...]:
    series = [
        [JointSamples(1, np.frombuffer(time), np.frombuffer(speed), None).reduced(per_second)]
        for time, speed in samples
    ]
    return smooth_joints(series, [0.0] * len(series))


def check_wheels(recording: Recording, rotors: Sequence[Wheel]) -> None:
    """Refuse a recording that lacks the speed of a wheel, or holds that of one that the robot lacks.

    Parameters
    ----------
    recording : Recording
    rotors : sequence of Wheel
        Wheels of the robot.
    """
    known, recorded = [wheel.name for wheel in rotors], recording.wheels
    missing = [name for name in known if name not in recorded]
    strangers = [name for name in recorded if name not in known]
    if not missing and not strangers:
        return
    parts = [f"no column {WHEEL_SPEED}.{name}" for name in missing]
    parts += [f"wheel '{name}' is not one of [[robot.wheels]]" for name in strangers]
    remedy = "Record the speed of every wheel of the robot, and describe each that is recorded under [[robot.wheels]]"
    raise InputError("; ".join(parts), file=recording.file or recording.name, remedy=remedy)
