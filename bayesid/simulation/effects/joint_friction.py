"""What a joint's torque sensor reads beyond the torque that moves the bodies."""

from __future__ import annotations

from typing import Self

import jax.numpy as jnp
from jax import Array

from bayesid.robot.robot import Robot
from bayesid.simulation.effects.effect import Parameter, register
from bayesid.simulation.effects.placed import OnJoint

__all__ = ["STANDSTILL", "JointFriction", "TorqueBias"]

STANDSTILL = 5e-4
"""Joint speed below which dry friction can be anything between its two values [rad/s, m/s]: no torque is read there."""

REVERSAL = 1e-4
"""Joint speed within which the formula passes from one to the other; well below, so that it never shows."""


class _OnTorque(OnJoint):
    """An effect on what the torque sensor of one joint reads."""

    def attach(self, robot: Robot) -> Self:
        """Take the joint's index from the robot."""
        changed = self.copied()
        changed.index = self.index_in(robot)
        return changed

    index: int = -1

    def friction(self, values: Array, velocity: Array) -> Array:
        """Add the joint's own."""
        return jnp.zeros_like(velocity).at[:, self.index].set(self.extra(values, velocity[:, self.index]))

    def extra(self, values: Array, velocity: Array) -> Array:
        """Return what the sensor reads beyond, shape (T,), at joint speeds (T,)."""
        raise NotImplementedError


@register
class JointFriction(_OnTorque):
    """Dry and viscous friction between motor and link: ``coulomb sign(v) + viscous v``.

    Samples of a joint that stands nearly still are not used. The priors, 5 N m and 50 N m s/rad, hold the gears of
    large manipulators. Friction does not change how the joints move, which is measured: it shows in torques only.
    """

    name = "joint-friction"
    summary = "The motor works against friction in the joint, which its torque sensor reads with the rest."

    def __init__(self, place: str = "", coulomb: float = 5.0, viscous: float = 50.0) -> None:
        super().__init__(place)
        self.parameters = (Parameter("coulomb", "N m", coulomb), Parameter("viscous", "N m s", viscous))

    def extra(self, values: Array, velocity: Array) -> Array:
        """Return the torque that overcomes friction."""
        return values[0] * jnp.tanh(velocity / REVERSAL) + values[1] * velocity


@register
class TorqueBias(_OnTorque):
    """Constant error of a joint's torque sensor; the prior is 2 N m."""

    name = "torque-bias"
    summary = "The torque sensor of the joint reads a constant without load."

    def __init__(self, place: str = "", sigma: float = 2.0) -> None:
        super().__init__(place)
        self.parameters = (Parameter("offset", "N m", sigma),)

    def extra(self, values: Array, velocity: Array) -> Array:
        """Return the constant."""
        return jnp.broadcast_to(values[0], velocity.shape)
