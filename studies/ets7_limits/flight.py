"""The manoeuvre that ETS-VII flew: joints 2 to 4 out and back, piecewise linear, with rounded corners."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bayesid.robot.joint_state import JointState

__all__ = ["EXCURSION", "Flight"]

Floats = NDArray[np.floating]

EXCURSION = np.array([0.0, 0.264, -0.321, 0.057, 0.0, 0.0])
"""Of the six joints between the two ramps [rad]."""

RAMPS = ((60.0, 82.6), (122.0, 144.6))
"""When the arm goes out and comes back [s]: the flight's 682.5 to 705.1 s and 744.5 to 767.1 s, a minute before it."""

ROUNDING = 4.0
"""Within which a joint reaches its speed [s]; assumed, since a corner would take an infinite torque."""


@dataclass(frozen=True)
class Flight:
    """The motion of the flight; a `bayesid.recording.joint_motion.Motion`.

    Parameters
    ----------
    start : (6,) array
        Joint positions before and after [rad].
    excursion : (6,) array
        [rad]
    """

    start: Floats
    excursion: Floats = field(default_factory=lambda: EXCURSION)

    def evaluate(self, time: Floats) -> JointState:
        """Return the joint state at the times, shape (T,)."""
        share = np.zeros((3, len(time)))
        for sign, (begin, end) in zip((1.0, -1.0), RAMPS, strict=True):
            share += sign / (end - begin) * (_bend(np.asarray(time) - begin) - _bend(np.asarray(time) - end))
        position, velocity, acceleration = share[:, :, None] * self.excursion
        return JointState(self.start + position, velocity, acceleration)


def _bend(time: Floats) -> Floats:
    """Zero, then a line of unit slope from time 0 on, the corner rounded by a sextic; and two derivatives (3, T)."""
    x = np.clip(time / ROUNDING + 0.5, 0.0, 1.0)
    beyond = np.maximum(time - 0.5 * ROUNDING, 0.0)
    return np.stack(
        [
            ROUNDING * x**4 * (2.5 - 3.0 * x + x**2) + beyond,
            x**3 * (10.0 - 15.0 * x + 6.0 * x**2),
            30.0 * x**2 * (1.0 - x) ** 2 / ROUNDING,
        ]
    )
