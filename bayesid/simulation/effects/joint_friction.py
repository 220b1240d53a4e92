"""What a joint's torque sensor reads beyond the torque that moves the bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Self

import jax.numpy as jnp
from jax import Array

from bayesid.robot.robot import Robot
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import Parameter
from bayesid.simulation.effects.placed import OnJoint
from bayesid.simulation.effects.register import register

if TYPE_CHECKING:
    from bayesid.simulation.model import Model

__all__ = ["STANDSTILL", "JointFriction", "TorqueBias"]

STANDSTILL = 5e-4
"""Joint speed below which dry friction can be anything between its two values [rad/s, m/s]: no torque is read there."""

REVERSAL = 1e-4
"""Joint speed within which the formula passes from one to the other; well below, so that it never shows."""


class _OnTorque(OnJoint):
    """An effect on what the torque sensor of one joint reads."""

    @classmethod
    def instances(cls, model: Model) -> Sequence[Effect]:
        """Return the effect at every joint whose torque is measured."""
        return [] if model.torque is None else [cls(joint) for joint in model.torque.joints]

    def attach(self, robot: Robot) -> Self:
        """Take the joint's index from the robot."""
        changed = self.copied()
        changed.index = self.index_in(robot)
        return changed

    index: int = -1

    def friction(self, values: Array, velocity: Array) -> Array:
        """Return the torque of the effect in the column of its joint, zero in the others."""
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
    separated_by = (
        "It changes sign with the joint's speed, not with its acceleration: run that joint at two constant speeds, "
        "forwards and back, with the others still."
    )

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
    separated_by = (
        "It is there when the joint stands free of load: read the torques at rest, before and after the motion."
    )

    def __init__(self, place: str = "", sigma: float = 2.0) -> None:
        super().__init__(place)
        self.parameters = (Parameter("offset", "N m", sigma),)

    def extra(self, values: Array, velocity: Array) -> Array:
        """Return the constant."""
        return jnp.broadcast_to(values[0], velocity.shape)
