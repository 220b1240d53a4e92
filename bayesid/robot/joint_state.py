"""State of all joints at given times."""

from __future__ import annotations

from typing import NamedTuple

from bayesid._math.arrays import Floats

__all__ = ["JointState"]


class JointState(NamedTuple):
    """Positions, velocities and accelerations of all joints, each of shape (T, joints)."""

    position: Floats
    velocity: Floats
    acceleration: Floats
