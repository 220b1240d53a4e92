"""Rough inertial parameters of a thrown body by linear regression on its recordings, from which a fit starts.

Euler's equation with the wheel is linear in the inertia, and the accelerometer's reading in free fall is linear in its
place relative to the centre of mass. Only the mass has to be known.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bayesid import InertialParameters, InputError, Recording

__all__ = ["regress"]

Floats = NDArray[np.floating]

SHARE = 0.05
"""Least principal moment of the second moments of mass relative to their trace, where noise gives what no body has."""


def regress(recordings: Sequence[Recording], mass: float) -> InertialParameters:
    """Return the body of a mass that explains differenced rates and accelerations best.

    Raises
    ------
    InputError
        If the recordings do not hold the wheel's momentum.
    """
    if any("wheel_momentum.z" not in recording.channels for recording in recordings):
        raise InputError("the wheel is not recorded", remedy="Its inertia sets the scale of the regression: record it")
    left, right = (np.concatenate(parts) for parts in zip(*map(_euler, recordings), strict=True))
    xx, xy, xz, yy, yz, zz = np.linalg.lstsq(left, right, rcond=None)[0]
    place, reading = (np.concatenate(parts) for parts in zip(*map(_accelerometer, recordings), strict=True))
    com = -np.linalg.lstsq(place, reading, rcond=None)[0]
    return InertialParameters(mass, com, _possible(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])))


def _possible(inertia: Floats) -> Floats:
    """Return the nearest inertia whose second moments of mass are those of a body with volume."""
    second = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    size, axes = np.linalg.eigh(second)
    second = axes @ np.diag(np.maximum(size, SHARE * np.abs(size).sum())) @ axes.T
    return np.asarray(np.trace(second) * np.eye(3) - second)


def _euler(recording: Recording) -> tuple[Floats, Floats]:
    """Return I dw/dt + w x I w = -(dh/dt + w x h) as rows over xx, xy, xz, yy, yz, zz."""
    time, rate, slope, good = _differenced(recording)
    wheel_time, wheel = recording.vector("wheel_momentum")
    at = np.searchsorted(wheel_time, time)
    torque = np.gradient(wheel, wheel_time, axis=0)[at]
    turned = np.cross(rate[:, None, :], _times_inertia(rate).transpose(0, 2, 1)).transpose(0, 2, 1)
    left, right = _times_inertia(slope) + turned, -(torque + np.cross(rate, wheel[at]))
    return left[good].reshape(-1, 6), right[good].ravel()


def _accelerometer(recording: Recording) -> tuple[Floats, Floats]:
    """Return a = dw/dt x r + w x (w x r) with the throw's mean taken off, as rows over r."""
    _, rate, slope, good = _differenced(recording)
    _, reading = recording.vector("accel")
    turn = _cross(slope) + _cross(rate) @ _cross(rate)
    left, right = turn[good], reading[good]
    return (left - left.mean(axis=0)).reshape(-1, 3), (right - right.mean(axis=0)).ravel()


def _differenced(recording: Recording) -> tuple[Floats, Floats, Floats, NDArray[np.bool_]]:
    """Return times, rates and their derivatives, and where both neighbours are there."""
    time, rate = recording.vector("rate")
    gap = np.diff(time) > 1.5 * recording.interval("rate.x")
    good = ~(np.concatenate([[True], gap]) | np.concatenate([gap, [True]]))
    return time, rate, np.gradient(rate, time, axis=0), good


def _cross(vector: Floats) -> Floats:
    """Matrices (T, 3, 3) of the cross product with vectors (T, 3) on the left."""
    return np.cross(vector[:, None, :], np.eye(3)).transpose(0, 2, 1)


def _times_inertia(vector: Floats) -> Floats:
    """Matrices (T, 3, 6) that give inertia times vector (T, 3)."""
    x, y, z = vector.T
    o = np.zeros_like(x)
    return np.array([[x, y, z, o, o, o], [o, x, o, y, z, o], [o, o, x, o, y, z]]).transpose(2, 0, 1)
