"""Fit of the present model, with its bodies held where it uses them up for what the model lacks, and along the data.

Where much is lacking, such as a wheel that turns a body by radians, no value of the unknowns follows the data, and the
fit drives the bodies to where no prior has them: nothing can be linearised there. A fit that misses the data is made
again from the balance of momentum. One that still strays is followed to its end, as one that has not converged, since
a load of many times its first guess needs more steps than others. If it ends astray it is started again from where the
bodies have their prior's centre; where it strays from there as well, they stay at that centre.

A fit may also follow the data with unknowns that its prior all but excludes: a body of a thirtieth of its inertia lets
a small torque do what a wheel does. About such a fit the causes are as good as invisible, so that they are weighed
along the data as well (`diagnosis.diagnose`), and the evidence decides.

The change by a cause is linear only about a motion that is nearly the true one. Where the present model does not come
near it, a free torque in every recording, piecewise linear in time, brings the model to the motion that the sensors
saw, its bodies held at their prior; there, a cause that takes the place of the torque changes the motion little,
however large both are. The torque is no explanation: the linear model says what each set of causes leaves where the
torque is zero again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jax import Array
from scipy.stats import chi2

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid._math.least_squares import levenberg_marquardt
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.diagnosis.settings import DEFAULT_SETTINGS, DiagnosisSettings
from bayesid.inference.balanced_start import balanced_start
from bayesid.inference.posterior import Posterior
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import Parameter
from bayesid.simulation.instant import Instant, Wrench

__all__ = [
    "PresentFit",
    "fit_present_model",
    "follow",
    "improbable",
    "step_along_data",
    "strayed",
    "with_bodies_held",
    "without_torque",
]

TOLERANCE = 1e-6
"""Relative tolerance with which a fit is followed; the last steps are those of `PerturbedModel.fit`."""

EVALUATIONS = 300
"""Largest number of evaluations for that; a load of 37 times its guess takes 80."""

KNOTS = 32
"""Instants per recording and axis at which the torque along the data is free."""


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


def improbable(fit: Fit, settings: DiagnosisSettings = DEFAULT_SETTINGS) -> bool:
    """Return whether the bodies of a fit, or all its other unknowns, are where their prior all but excludes them."""
    bodies = fit.posterior.unknowns.layout.all_bodies
    return any(
        len(z) > 0 and chi2.sf(float(z @ z), len(z)) < settings.bodies_improbable
        for z in (fit.z[bodies], np.delete(fit.z, bodies))
    )


def strayed(fit: Fit, settings: DiagnosisSettings = DEFAULT_SETTINGS) -> bool:
    """Return whether a fit has driven unknowns to where their prior all but excludes them, and fits badly there.

    Bodies may be far from a poor guess where they follow the data. All other unknowns have physical sizes, so that
    their distance from the prior counts as misfit: a small unexplained torque that follows a wheel does not explain it.
    """
    if not np.isfinite(fit.cost):
        return True
    others = np.delete(fit.z, fit.posterior.unknowns.layout.all_bodies)
    misfit = fit.chi2 + float(others @ others)
    return improbable(fit, settings) and misfit > settings.misfit * fit.posterior.samples


def fit_present_model(
    perturbed: PerturbedModel,
    z: Floats | None = None,
    settings: DiagnosisSettings = DEFAULT_SETTINGS,
    *,
    hold: bool = False,
) -> PresentFit:
    """Fit the present model and hold its bodies where every fit strays.

    Parameters
    ----------
    perturbed : PerturbedModel
    z : (size,) array, optional
        Point from which the fit starts.
    settings : DiagnosisSettings, optional
    hold : bool
        Whether to hold the bodies in any case.
    """
    if not hold:
        first = perturbed.fit(z=z)
        astray = not first.chi2 <= settings.misfit * first.posterior.samples
        if z is None and astray and (balanced := balanced_start(perturbed.posterior)) is not None:
            first = min(first, perturbed.fit(z=balanced), key=lambda fit: fit.cost)
        if strayed(first, settings) or not first.converged:
            first = min(first, _followed(perturbed, perturbed.start() if z is None else z), key=lambda fit: fit.cost)
        if not strayed(first, settings):
            return PresentFit(first, held=False)
    held = _fit_beside_bodies(perturbed)
    again = perturbed.fit(z=held.z)
    return PresentFit(held, held=True) if hold or strayed(again, settings) else PresentFit(again, held=False)


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
    if not np.isfinite(held.cost):
        raise InputError(
            "the motion of the model has no finite derivatives, even with all bodies at their prior's centre",
            remedy="Check the units of joint motion and of the robot's inertial parameters",
        )
    return replace(perturbed.fit(z=held.z, operating=held.operating, iterations=0), converged=held.converged)


class FollowingTorque(Effect):
    """Torque in base axes that makes a model follow its data, piecewise linear in time and free in every recording.

    Parameters
    ----------
    end : float
        Time of the last knot [s].
    sigma : float
        Standard deviation of the values at the knots [N m], so large that it does not matter.
    """

    name = "following torque"
    per_recording: ClassVar[bool] = True
    constant_names = ("end",)

    def __init__(self, end: float, sigma: float) -> None:
        self.end = end
        self.parameters = tuple(Parameter(f"{axis}{knot}", "N m", sigma) for knot in range(KNOTS) for axis in "xyz")

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the torque of the instant."""
        place = instant.environment.time * ((KNOTS - 1) / self.end)
        weight = jnp.maximum(0.0, 1.0 - jnp.abs(place - jnp.arange(KNOTS)))
        return Wrench(jnp.zeros(3), weight @ values.reshape(KNOTS, 3))


def follow(perturbed: PerturbedModel) -> Fit:
    """Fit the present model with a following torque and its bodies at their prior's centre.

    The prior of the torque is as wide as the data ask for: one standard deviation at one knot would change the residual
    by as much as all that the present model leaves.
    """
    frozen = bodies_frozen(perturbed)
    z = frozen.start()
    operating = frozen.operating(z, ())
    end = float(np.asarray(operating.node.environment.time).max())
    size = 3 * KNOTS * len(perturbed.posterior.manoeuvres)
    data = perturbed.posterior.data.arrays
    unit = frozen.columns([(FollowingTorque(end, 1.0), np.zeros(size))], operating, z, data)[0]
    length = np.linalg.norm(unit, axis=0)
    sigma = float(np.linalg.norm(frozen.residual(z, data)) / np.median(length[length > 0.0]))
    torque = FollowingTorque(end, sigma)
    found = frozen.fit([torque])
    whole = perturbed.fit([torque], found.coordinates, z=found.z, operating=found.operating, iterations=0)
    return replace(whole, converged=found.converged)


def step_along_data(posterior: Posterior) -> float:
    """Return an integration step [s] that suits the motion of the data: the shortest interval of a sensor's samples.

    The step of the present model suits its own motion, which may be that of a body at rest.
    """
    kinds = posterior.model.channels.kinds
    times = [posterior.data.measured(r, kind)[0] for r in range(len(posterior.manoeuvres)) for kind in kinds]
    return float(min(np.median(np.diff(time)) for time in times))


def without_torque(fit: Fit) -> Fit:
    """Return a fit along the data without its following torque, by the linear model: what the present model leaves."""
    residual = fit.residual - fit.added[0] @ fit.coordinates[0]
    cost = 0.5 * float(residual @ residual + fit.z @ fit.z)
    return replace(fit, effects=(), coordinates=(), added=(), residual=residual, cost=cost)
