"""Noise-free readings of a flight, as a simulator returns them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from studies.truth.numerics import Array

__all__ = ["Truth"]


class Truth(NamedTuple):
    """Noise-free motion at n times; base axes unless said otherwise.

    Fields
    ------
    times : (n,) array [s]
    position, speed, acceleration, torque : (n, joints) array
        Motion and torque of the driven joints, in the order of the URDF.
    rate : (n, 3) array [rad/s]
    attitude : (n, 4) array
        Quaternion x, y, z, w, base axes to orbit axes.
    accel : (n, 3) array [m/s2]
    force, external_torque : (n, 3) array
        Thrust at the base origin [N, N m].
    """

    times: Array
    position: Array
    speed: Array
    acceleration: Array
    torque: Array
    rate: Array
    attitude: Array
    accel: Array
    force: Array
    external_torque: Array

    def at(self, times: Array) -> Truth:
        """Rows at some of the times."""
        rows = np.searchsorted(self.times, times)
        return Truth(*(values[rows] for values in self))
