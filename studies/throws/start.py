"""A first guess of a thrown body by linear regression, so that the fit starts near its optimum."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bayesid import InertialParameters, InputError, Recording

__all__ = ["guess"]

Floats = NDArray[np.floating]


def guess(recordings: Sequence[Recording], rough: InertialParameters) -> InertialParameters:
    """Regress Euler's equation with the wheel on differenced rates; mass and centre of mass are those of ``rough``."""
    rows = [_equations(recording) for recording in recordings]
    left, right = (np.concatenate(parts) for parts in zip(*rows, strict=True))
    xx, xy, xz, yy, yz, zz = np.linalg.lstsq(left, right, rcond=None)[0]
    try:
        return InertialParameters(rough.mass, rough.com, [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    except InputError:  # differenced noise can give what no body has
        return rough


def _equations(recording: Recording) -> tuple[Floats, Floats]:
    """Return I dw/dt + w x I w = -(dh/dt + w x h) as rows over xx, xy, xz, yy, yz, zz."""
    time, rate = recording.vector("rate")
    wheel_time, wheel = recording.vector("wheel_momentum")
    at = np.searchsorted(wheel_time, time)
    torque = np.gradient(wheel, wheel_time, axis=0)[at]
    slope = np.gradient(rate, time, axis=0)
    gap = np.diff(time) > 1.5 * recording.interval("rate.x")
    good = ~(np.concatenate([[True], gap]) | np.concatenate([gap, [True]]))
    turned = np.cross(rate[:, None, :], _times_inertia(rate).transpose(0, 2, 1)).transpose(0, 2, 1)
    left, right = _times_inertia(slope) + turned, -(torque + np.cross(rate, wheel[at]))
    return left[good].reshape(-1, 6), right[good].ravel()


def _times_inertia(vector: Floats) -> Floats:
    """Matrices (T, 3, 6) that give inertia times vector (T, 3)."""
    x, y, z = vector.T
    o = np.zeros_like(x)
    return np.array([[x, y, z, o, o, o], [o, x, o, y, z, o], [o, o, x, o, y, z]]).transpose(2, 0, 1)
