"""From bodies with the device on them to the bodies alone, and the wheel's inertia from the known one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesid import Posterior
from bayesid.inference.body_quantities import bodies_of
from studies.throws.data import WHEEL_INERTIA, Truth

__all__ = ["Tensor", "object_moments", "tensors", "truth_sd", "wheel_inertia"]

Floats = NDArray[np.floating]

PLATE_SD = 0.03
"""Relative uncertainty of the plate's moments, which are from the authors' CAD: "a few percent"."""

BLOCK_SD = 0.005
"""Relative uncertainty of what the blocks add: 0.1 to 0.2 mm in their place on levers of 63 mm, and their mass."""


@dataclass(frozen=True)
class Tensor:
    """Inertia about the centre of mass (..., 3, 3) [kg m2] and the centre of mass from the sensor (..., 3) [m]."""

    inertia: Floats
    com: Floats


def tensors(posterior: Posterior, coordinates: Floats) -> Tensor:
    """Turn log-Cholesky coordinates of many points, shape (n, 10), into inertias."""
    z = np.zeros((len(coordinates), posterior.size))
    z[:, :10] = coordinates
    values = bodies_of(posterior, z)["base_link"].values
    xx, yy, zz, xy, xz, yz = values[:, 4:].T
    return Tensor(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).transpose(2, 0, 1), values[:, 1:4])


def steiner(mass: float, offset: Floats) -> Floats:
    """Inertia of a point mass at offsets (..., 3): shape (..., 3, 3)."""
    square = (offset**2).sum(axis=-1)[..., None, None]
    return mass * (square * np.eye(3) - offset[..., :, None] * offset[..., None, :])


def shift(device: Tensor, test: Tensor, device_mass: float, mass: float) -> Floats:
    """Return what the displacement of both parts from the common centre of mass adds to the inertia."""
    offset = test.com - device.com
    return steiner(device_mass, offset) + steiner(mass, device_mass / mass * offset)


def wheel_inertia(device: Tensor, proof: Tensor, truth: Truth) -> Floats:
    """Inertia of the wheel, shape (n,) [kg m2], that gives the known box its known moments, by least squares.

    The fits use a nominal wheel; all their inertias scale with it, the shift of the masses does not.
    """
    added = shift(device, proof, truth.device_mass, truth.mass["cal_proof"])
    # the box's edges lie along the sensor's axes: its smallest moment about x, its largest about z
    known = np.linalg.eigvalsh(np.diag(truth.moments["cal_proof"]) + added)
    seen = np.linalg.eigvalsh(proof.inertia - device.inertia)
    return WHEEL_INERTIA * (known * seen).sum(axis=-1) / (seen**2).sum(axis=-1)


def object_moments(device: Tensor, test: Tensor, wheel: Floats | float, device_mass: float, mass: float) -> Floats:
    """Principal moments of the body without the device, shape (n, 3) [kg m2], ascending."""
    scale = np.asarray(wheel)[..., None, None] / WHEEL_INERTIA
    alone = scale * (test.inertia - device.inertia) - shift(device, test, device_mass, mass)
    return np.linalg.eigvalsh(alone)


def truth_sd(truth: Truth, body: str) -> Floats:
    """Return the standard deviation of a body's stated moments, shape (3,) [kg m2], under the assumptions above."""
    plate = truth.moments.get("Empty", truth.moments[body])
    return np.hypot(PLATE_SD * plate, BLOCK_SD * (truth.moments[body] - plate))
