"""What the orbit does to the robot."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from bayesid.effects.base import Effect, Moment, Wrench, register

__all__ = ["GravityGradient"]


@register
class GravityGradient(Effect):
    """Gravity gradient on every body, the paper's (12)-(16), for any Kepler orbit; no free parameter.

    Summed over the bodies, the forces of (14) and the torques of (16) are a pure torque about the common centre of mass
    that depends on the composite second moment alone.
    """

    name = "gravity-gradient"
    summary = (
        "Gravity pulls harder on what is nearer the Earth. The difference over the robot's extent turns it, "
        "and an accelerometer away from the centre of mass feels it."
    )
    needs_orbit = True

    def wrench(self, values: Array, moment: Moment, inner: Array) -> Wrench:
        """Return the torque 3 mu/r^3 (Xi u) x u."""
        up = moment.to_base(moment.environment.zenith)
        return Wrench(jnp.zeros(3), 3.0 * moment.environment.gradient * jnp.cross(moment.body.second_moment @ up, up))

    def field(self, values: Array, moment: Moment, lever: Array) -> Array:
        """Return less the tidal acceleration at the accelerometer."""
        up = moment.to_base(moment.environment.zenith)
        return -moment.environment.gradient * (3.0 * up * (up @ lever) - lever)
