"""Guesses of a body about which a prior is centred."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from bayesid import InertialParameters
from bayesid.robot.inertial_parameters import parameters_from_pseudo_inertia
from bayesid.robot.log_cholesky import log_cholesky_factor, upper_cholesky

__all__ = ["guess_about"]


def guess_about(truth: InertialParameters, spread: float, rng: np.random.Generator) -> InertialParameters:
    """Draw a guess such that the truth is a draw of the prior about it.

    The prior multiplies the Cholesky factor of the guess's pseudo-inertia by a random factor; the guess is the truth
    with the inverse of such a factor.

    Parameters
    ----------
    truth : InertialParameters
    spread : float
        Relative width of the prior in log-Cholesky coordinates.
    rng : numpy.random.Generator
    """
    factor = np.asarray(log_cholesky_factor(jnp.asarray(spread * rng.normal(size=10))))
    guess = upper_cholesky(truth.pseudo_inertia) @ np.linalg.inv(factor)
    return InertialParameters.from_vector(np.asarray(parameters_from_pseudo_inertia(jnp.asarray(guess @ guess.T))))
