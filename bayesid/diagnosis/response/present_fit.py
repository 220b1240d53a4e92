"""Fit of the present model, with its bodies held where it uses them up for what the model lacks.

Where much is lacking, such as a wheel that turns a body by radians, no value of the unknowns follows the data, and the
fit drives the bodies to where no prior has them: nothing can be linearised there. Such a fit is followed to its end,
as one that has not converged, since a load of many times its first guess needs more steps than others. If it ends
astray it is started again from where the bodies have their prior's centre; where it strays from there as well, they
stay at that centre.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from bayesid._math.arrays import Floats
from bayesid._math.least_squares import levenberg_marquardt
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.diagnosis.settings import DEFAULT_SETTINGS, DiagnosisSettings

__all__ = ["PresentFit", "fit_present_model", "strayed", "with_bodies_held"]

TOLERANCE = 1e-6
"""Relative tolerance with which a fit is followed; the last steps are those of `PerturbedModel.fit`."""

EVALUATIONS = 300
"""Largest number of evaluations for that; a load of 37 times its guess takes 80."""


@dataclass(frozen=True)
class PresentFit:
    """Fit of the present model.

    Attributes
    ----------
    fit : Fit
    held : bool
        Whether the bodies are held at their prior's centre, since every fit of them diverged.
    """

    fit: Fit
    held: bool


def strayed(fit: Fit, settings: DiagnosisSettings = DEFAULT_SETTINGS) -> bool:
    """Return whether a fit has driven its bodies to where their prior all but excludes them, and fits badly there."""
    bodies = fit.z[fit.posterior.unknowns.layout.all_bodies]
    if not np.isfinite(fit.cost):
        return True
    far = len(bodies) > 0 and chi2.sf(float(bodies @ bodies), len(bodies)) < settings.bodies_improbable
    return bool(far and fit.chi2 > settings.misfit * fit.posterior.samples)


def fit_present_model(
    perturbed: PerturbedModel, z: Floats | None = None, settings: DiagnosisSettings = DEFAULT_SETTINGS
) -> PresentFit:
    """Fit the present model, from the start or from a point (size,), and hold its bodies where every fit strays."""
    first = perturbed.fit(z=z)
    if strayed(first, settings) or not first.converged:
        first = min(first, _followed(perturbed, perturbed.start() if z is None else z), key=lambda fit: fit.cost)
    if not strayed(first, settings):
        return PresentFit(first, held=False)
    held = _fit_beside_bodies(perturbed)
    again = perturbed.fit(z=held.z)
    return PresentFit(held, held=True) if strayed(again, settings) else PresentFit(again, held=False)


def bodies_frozen(perturbed: PerturbedModel) -> PerturbedModel:
    """Return the model with all bodies at their prior's centre."""
    layout = perturbed.posterior.unknowns.layout
    bodies = range(layout.all_bodies.start, layout.all_bodies.stop)
    return PerturbedModel(perturbed.posterior, {*perturbed.frozen.tolist(), *bodies})


def with_bodies_held(fit: Fit) -> Fit:
    """Return a fit about which no linear step moves the bodies: they stay where the fit has them."""
    free = np.setdiff1d(np.arange(len(fit.z)), fit.frozen)
    bodies = fit.posterior.unknowns.layout.all_bodies
    own = fit.own.copy()
    own[:, (free >= bodies.start) & (free < bodies.stop)] = 0.0
    return replace(fit, own=own)


def _followed(perturbed: PerturbedModel, start: Floats) -> Fit:
    """Return the fit that Levenberg-Marquardt with a trust region reaches from a point (size,)."""
    posterior, free = perturbed.posterior, perturbed.free

    def at(values: Floats) -> Floats:
        z = np.array(start)
        z[free] = values
        return z

    with np.errstate(all="ignore"):  # on the way bodies may be anything
        solution = levenberg_marquardt(
            lambda values: posterior.least_squares(at(values)),
            lambda values: posterior.jacobian(at(values))[:, free],
            start[free],
            TOLERANCE,
            EVALUATIONS,
        )
    return perturbed.fit(z=at(solution.x))


def _fit_beside_bodies(perturbed: PerturbedModel) -> Fit:
    """Return the fit of everything but the bodies, with the derivatives in the bodies, too."""
    held = bodies_frozen(perturbed).fit()
    return replace(perturbed.fit(z=held.z, operating=held.operating, iterations=0), converged=held.converged)
