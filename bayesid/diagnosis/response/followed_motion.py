"""Linearisation along the motion that the sensors saw, where the present model does not come near it.

The change by a cause is linear only about a motion that is nearly the true one. A free torque in every recording,
piecewise linear in time, brings the present model to that motion, its bodies held at their prior; there, a cause that
takes the place of the torque changes the motion little, however large both are. The torque is no explanation: the
linear model says what each set of causes leaves where the torque is zero again.
"""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.diagnosis.response.present_fit import bodies_frozen
from bayesid.inference.posterior import Posterior
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import Parameter
from bayesid.simulation.instant import Instant, Wrench

__all__ = ["FollowingTorque", "follow", "step_along_data", "without_torque"]

KNOTS = 32
"""Instants per recording and axis at which the torque is free."""


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
