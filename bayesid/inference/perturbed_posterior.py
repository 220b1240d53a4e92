"""Simulation, residual and derivatives of a posterior whose data may be perturbed from outside its model."""

from __future__ import annotations

import numpy as np

from bayesid._math.arrays import Floats
from bayesid._math.on_device import on_device
from bayesid.inference import compiled
from bayesid.inference.compiled import Arrays, Perturbation, Traced, perturbed
from bayesid.inference.posterior import Posterior

__all__ = ["Arrays", "Perturbation", "Traced", "jacobian_of", "perturbed", "residual_of", "trace"]


def trace(posterior: Posterior, z: Floats, arrays: Arrays) -> Traced:
    """Return the simulated motion, readings and residual at ``z`` for arrays that may be `perturbed`."""
    return compiled.traced(posterior.structure, posterior.numbers, on_device(z), arrays)


def residual_of(posterior: Posterior, z: Floats, arrays: Arrays) -> Floats:
    """Return the whitened residual (R, O, C) at ``z`` for arrays that may be `perturbed`."""
    return np.asarray(compiled.residuals(posterior.structure, posterior.numbers, on_device(z), arrays))


def jacobian_of(posterior: Posterior, z: Floats, arrays: Arrays) -> Floats:
    """Return the derivatives of the whitened residual in ``z``, (R, O, C, size), for arrays that may be `perturbed`."""
    slopes = compiled.jacobian(posterior.structure, posterior.numbers, on_device(z), arrays)
    return np.moveaxis(np.asarray(slopes), 0, -1)
