"""From the posterior's coordinates to mass, centre of mass and inertia, to first order."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesid.inference.posterior import Posterior
from bayesid.robot.inertial_parameters import mass_com_inertia

__all__ = ["physical_sd", "physical_slope"]

Floats = NDArray[np.floating]

DIFFERENCE = 1e-5
"""Of a coordinate; its error is a millionth of the slope."""


def physical_slope(posterior: Posterior, z: Floats) -> Floats:
    """Return the derivative of the first body's quantities, in the order of `BODY_QUANTITIES`, shape (10, size)."""
    shifts = DIFFERENCE * np.eye(posterior.size)
    inertial = posterior.unknowns.values_of(np.concatenate([z + shifts, z - shifts])).inertial[:, :10]
    ahead, behind = np.split(mass_com_inertia(np.asarray(inertial)), 2)
    return (ahead - behind).T / (2.0 * DIFFERENCE)


def physical_sd(slope: Floats, covariance: Floats) -> Floats:
    """Return the standard deviation of the quantities, to first order, shape (10,)."""
    return np.sqrt(np.einsum("ij,jk,ik->i", slope, covariance, slope))
