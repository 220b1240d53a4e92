"""Known actions on the base: force, torque, and the momentum of wheels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.recording.blocks import Blocks
from bayesid.recording.recording import Recording
from bayesid.recording.sampled_curve import SampledCurve
from bayesid.recording.wheel_motion import WheelMotion
from bayesid.robot.wheel import Wheel

__all__ = ["Actions"]


@dataclass(frozen=True)
class Actions:
    """Known actions on the base: a wrench held from each time to the next, and the momentum of the wheels.

    Parameters
    ----------
    time : (n,) array
        Times at which the wrench changes [s].
    wrench : (n, 6) array
        Force and torque at the base origin, base axes [N, N m].
    wheel_time : (m,) array
        Times of the samples of the momentum [s].
    wheel_momentum : (m, 3) array
        Momentum of the wheels, base axes [N m s].
    spun : WheelMotion, optional
        Wheels whose speed is known, and whose momentum is added to the other.
    """

    time: Floats
    wrench: Floats
    wheel_time: Floats
    wheel_momentum: Floats
    spun: WheelMotion = field(default_factory=WheelMotion)

    @classmethod
    def none(cls, spun: WheelMotion | None = None) -> Actions:
        """Return no actions but the motion of wheels, if that is given."""
        return cls(np.zeros(0), np.zeros((0, 6)), np.zeros(0), np.zeros((0, 3)), spun or WheelMotion())

    @classmethod
    def from_recording(cls, recording: Recording, rotors: Sequence[Wheel] = (), per_second: float = 0.0) -> Actions:
        """Return the actions that a recording holds; those that it lacks are zero.

        Parameters
        ----------
        recording : Recording
        rotors : sequence of Wheel, optional
            Wheels of the robot, all of which are recorded.
        per_second : float
            Rate above which samples are averaged over blocks [1/s]; 0 keeps every sample. A wrench that changes more
            rarely keeps every change.
        """
        series = [_held_series(*_vector(recording, family), per_second) for family in ("base_force", "base_torque")]
        time = np.unique(np.concatenate([t for t, _ in series]))
        wrench = np.concatenate([_zero_order_hold(t, values, time) for t, values in series], axis=1)
        spun = WheelMotion.from_recording(recording, rotors, per_second)
        return cls(time, wrench, *_averaged(*_vector(recording, "wheel_momentum"), per_second), spun)

    @property
    def changes(self) -> Floats:
        """Times at which the wrench becomes another [s]."""
        before = np.concatenate([np.zeros((1, 6)), self.wrench[:-1]])[: len(self.time)]
        return self.time[(self.wrench != before).any(axis=1)]

    def zero_order_hold(self, time: Floats) -> Floats:
        """Return the wrench that is held at the times (T,), shape (T, 6); it is zero before the first sample."""
        return _zero_order_hold(self.time, self.wrench, time)

    def wheels(self, time: Floats) -> tuple[Floats, Floats]:
        """Return the momentum of the wheels and its derivative at the times (T,), each of shape (T, 3).

        A recorded momentum follows a curve through its samples (`SampledCurve`).
        """
        curve, (momentum, torque) = SampledCurve(self.wheel_time, self.wheel_momentum), self.spun.momentum(time)
        return momentum + curve.at(time), torque + curve.at(time, 1)


def _vector(recording: Recording, family: str) -> tuple[Floats, Floats]:
    if f"{family}.x" not in recording.channels:
        return np.zeros(0), np.zeros((0, 3))
    return recording.vector(family, ("x", "y", "z"))


def _held_series(time: Floats, values: Floats, per_second: float) -> tuple[Floats, Floats]:
    """Return a held wrench with the changes alone, or as means over blocks where it changes more often than these."""
    blocks = Blocks.of(time, per_second)
    if not blocks.reduced:
        return time, values
    changed = np.concatenate([[True], (np.diff(values, axis=0) != 0.0).any(axis=1)])
    if changed.sum() <= len(blocks.first):
        return time[changed], values[changed]
    return time[blocks.first], blocks.mean(values)


def _averaged(time: Floats, values: Floats, per_second: float) -> tuple[Floats, Floats]:
    """Return means over blocks between the first and the last sample."""
    blocks = Blocks.of(time, per_second)
    if not blocks.reduced:
        return time, values
    inner = (blocks.time > time[0]) & (blocks.time < time[-1])
    means = blocks.mean(values)[inner]
    return np.concatenate([time[:1], blocks.time[inner], time[-1:]]), np.concatenate([values[:1], means, values[-1:]])


def _zero_order_hold(times: Floats, values: Floats, at: Floats) -> Floats:
    if len(times) == 0:
        return np.zeros((len(at), values.shape[1]))
    index = np.searchsorted(times, at, side="right") - 1
    return np.where((index >= 0)[:, None], values[np.maximum(index, 0)], 0.0)
