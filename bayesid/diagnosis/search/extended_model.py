"""The extended model with its effects in the simulation itself, and its exact mode.

The fits of a diagnosis push one compiled simulation along the motion of the last fit. What an unknown of the model
changes in a push through the motion is left out of their derivatives, which moves their end where a cause is as large
as a wheel that turns the base by radians. The extended model's own simulation has all derivatives.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.diagnosis.response.perturbed_model import CLOSE
from bayesid.diagnosis.search.fitted_set import Hypothesis
from bayesid.inference.mode import fit
from bayesid.inference.noise_changes import without_left_out
from bayesid.inference.posterior import Posterior
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.joint_torques import TorqueSensor

__all__ = ["exactly_fitted", "extended_posterior", "extended_start"]

ROUNDS = 6
"""Simulations after which motion and pushes agree at given unknowns."""


def extended_posterior(
    hypothesis: Hypothesis, *, torque: TorqueSensor | None = None, added: Sequence[Effect] = ()
) -> Posterior:
    """Build the posterior of a hypothesis, its effects in the simulation itself.

    Parameters
    ----------
    hypothesis : Hypothesis
    torque : TorqueSensor, optional
        Sensors of the joints' torques, which a hypothesis of a diagnosis has not.
    added : sequence of Effect
        Further effects, whose coordinates are the last.

    Raises
    ------
    InputError
        If one of its effects is not carried into the torques.
    """
    fit = hypothesis.fit
    model = replace(fit.posterior.model, torque=torque)
    for effect in (*(effect.tuned(fit.values(index)) for index, effect in enumerate(fit.effects)), *added):
        model = model.extend(effect)
    if hypothesis.perturbed.frozen.size:
        model = replace(model, rate_sigma=0.0)
    return Posterior.of(model, without_left_out(fit.posterior))


def extended_start(hypothesis: Hypothesis, posterior: Posterior) -> Floats:
    """Mode of a hypothesis in the coordinates of its own posterior."""
    fit = hypothesis.fit
    z = np.delete(fit.z, hypothesis.perturbed.frozen)
    return np.concatenate([z, *fit.coordinates]) if posterior.size else np.zeros(0)


def exactly_fitted(hypothesis: Hypothesis) -> Hypothesis:
    """Return a hypothesis at the mode of its own simulation, or as it is where that is worse or does not exist."""
    found = hypothesis.fit
    try:
        posterior = extended_posterior(hypothesis)
    except InputError:  # no motion at the prior's centre of the extended model
        return hypothesis
    if posterior.residual_shape != found.posterior.residual_shape:  # outliers left out: derivatives have other rows
        return hypothesis
    mode = fit(posterior, extended_start(hypothesis, posterior)).z
    free = len(found.own_coordinates)
    ends = np.cumsum([free, *(own.size for own in found.coordinates)])
    coordinates = [mode[first:last] for first, last in pairwise(ends)]
    z = found.z.copy()
    z[np.setdiff1d(np.arange(len(z)), found.frozen)] = mode[:free]
    perturbed, operating = hypothesis.perturbed, found.operating
    for _ in range(ROUNDS):
        exact = perturbed.fit(found.effects, coordinates, z=z, operating=operating, iterations=0)
        operating = perturbed.operating(z, perturbed.pushes(found.effects, coordinates, operating, vibrations=False))
    if exact.cost > found.cost + CLOSE:
        return hypothesis
    columns = posterior.jacobian(mode)[: exact.residual.size]
    own, *added = np.split(columns, ends[:-1], axis=1)
    return replace(hypothesis, fit=replace(exact, own=own, added=tuple(added)))
