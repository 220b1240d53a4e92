"""Known actions on the base: force, torque, and the momentum of wheels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import Akima1DInterpolator

from bayesid._math.arrays import Floats
from bayesid.recording.recording import Recording

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
    """

    time: Floats
    wrench: Floats
    wheel_time: Floats
    wheel_momentum: Floats

    @classmethod
    def none(cls) -> Actions:
        """Return no actions."""
        return cls(np.zeros(0), np.zeros((0, 6)), np.zeros(0), np.zeros((0, 3)))

    @classmethod
    def from_recording(cls, recording: Recording) -> Actions:
        """Return the actions that a recording holds; those that it lacks are zero."""
        series = [_vector(recording, family) for family in ("base_force", "base_torque")]
        time = np.unique(np.concatenate([t for t, _ in series]))
        wrench = np.concatenate([_zero_order_hold(t, values, time) for t, values in series], axis=1)
        return cls(time, wrench, *_vector(recording, "wheel_momentum"))

    def zero_order_hold(self, time: Floats) -> Floats:
        """Return the wrench that is held at the times (T,), shape (T, 6); it is zero before the first sample."""
        return _zero_order_hold(self.time, self.wrench, time)

    def wheels(self, time: Floats) -> tuple[Floats, Floats]:
        """Return the momentum of the wheels and its derivative at the times (T,), each of shape (T, 3).

        The momentum follows a modified Akima spline, a line between two samples, and a single sample is held.
        """
        if len(self.wheel_time) == 0:
            return np.zeros((len(time), 3)), np.zeros((len(time), 3))
        if len(self.wheel_time) == 1:
            return np.broadcast_to(self.wheel_momentum[0], (len(time), 3)), np.zeros((len(time), 3))
        if len(self.wheel_time) == 2:
            (begin, end), (first, second) = self.wheel_time, self.wheel_momentum
            share, between = np.clip((time - begin) / (end - begin), 0.0, 1.0), (time >= begin) & (time <= end)
            slope = (second - first) / (end - begin)
            return first + share[:, None] * (second - first), between[:, None] * slope
        curve = Akima1DInterpolator(self.wheel_time, self.wheel_momentum, method="makima")
        inside = np.clip(time, self.wheel_time[0], self.wheel_time[-1])
        return curve(inside), curve.derivative()(inside)


def _vector(recording: Recording, family: str) -> tuple[Floats, Floats]:
    if f"{family}.x" not in recording.channels:
        return np.zeros(0), np.zeros((0, 3))
    return recording.vector(family, ("x", "y", "z"))


def _zero_order_hold(times: Floats, values: Floats, at: Floats) -> Floats:
    if len(times) == 0:
        return np.zeros((len(at), values.shape[1]))
    index = np.searchsorted(times, at, side="right") - 1
    return np.where((index >= 0)[:, None], values[np.maximum(index, 0)], 0.0)
