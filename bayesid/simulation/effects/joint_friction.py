"""Effects on the reading of a joint's torque sensor: friction and a constant error."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Self

import jax.numpy as jnp
from jax import Array

from bayesid.robot.robot import Robot
from bayesid.robot.robot_size import beyond_joint
from bayesid.simulation.effects.effect import Effect, Situation
from bayesid.simulation.effects.effect_parameters import Parameter, PhysicalBound, three_digits
from bayesid.simulation.effects.placed import OnJoint
from bayesid.simulation.effects.register import register

__all__ = ["STANDSTILL", "JointFriction", "TorqueBias"]

STANDSTILL = 5e-4
"""Joint speed below which samples are left out, since dry friction at rest is undetermined [rad/s, m/s]."""

REVERSAL = 1e-4
"""Joint speed over which the formula reverses dry friction [rad/s, m/s], well below `STANDSTILL`."""

DRIVE = 1.0
"""Acceleration that the strongest drives give to what a joint carries, stretched out [rad/s2, m/s2]; assumed."""

SPEED = 0.1
"""Joint speed at which viscous friction may take all of the drive's torque [rad/s, m/s]; assumed."""

SENSOR_ERROR = 0.1
"""Largest constant error of a torque sensor, relative to the drive's torque; assumed."""


OF_SLIDES = {"N m": "N", "N m s": "N s/m"}
"""What slides have in place of units of torques."""


class _OnTorque(OnJoint):
    """Effect on the reading of the torque sensor of one joint."""

    @classmethod
    def instances(cls, model: Situation) -> Sequence[Effect]:
        """Return the effect at every joint whose torque is measured."""
        return [] if model.torque is None else [cls(joint).attach(model.robot) for joint in model.torque.joints]

    def attach(self, robot: Robot) -> Self:
        """Return the effect with the index of its joint in the robot."""
        changed = copy.copy(self)
        changed.index = self.index_in(robot)
        if robot.joints[changed.index].kind == "prismatic":
            changed.parameters = tuple(
                parameter._replace(unit=OF_SLIDES.get(parameter.unit, parameter.unit)) for parameter in self.parameters
            )
        return changed

    index: int = -1

    def friction(self, values: Array, velocity: Array) -> Array:
        """Return the torque of the effect in the column of its joint, and zero in all others."""
        return jnp.zeros_like(velocity).at[:, self.index].set(self._extra(values, velocity[:, self.index]))

    def drive(self, robot: Robot) -> tuple[float, str]:
        """Return the largest torque [N m], or force [N], of the joint's drive, and words that say where it is from."""
        index = self.index_in(robot)
        mass, inertia = beyond_joint(robot, index)
        if robot.joints[index].kind == "prismatic":
            force = three_digits(DRIVE * mass)
            return (
                DRIVE * mass,
                f"the {force} N that accelerate the {three_digits(mass)} kg beyond it by {DRIVE:g} m/s2",
            )
        torque, load = three_digits(DRIVE * inertia), three_digits(inertia)
        return DRIVE * inertia, f"the {torque} N m that accelerate the {load} kg m2 beyond it by {DRIVE:g} rad/s2"

    def _extra(self, values: Array, velocity: Array) -> Array:
        """Return the additional reading of the sensor at joint speeds (T,), shape (T,)."""
        raise NotImplementedError


@register
class JointFriction(_OnTorque):
    """Dry and viscous friction between motor and link: ``coulomb sign(v) + viscous v``.

    Samples of a nearly stationary joint are omitted. The priors of 5 N m and 50 N m s include the gears of
    large manipulators. Friction appears in torques only, since the motion of the joints is measured.
    """

    name = "joint-friction"
    summary = "The motor works against friction in the joint, which the torque sensor also measures."
    separated_by = (
        "Friction changes sign with the joint's speed, not with its acceleration: run that joint at two constant "
        "speeds in both directions, with the others still."
    )

    def __init__(self, place: str = "", coulomb: float = 5.0, viscous: float = 50.0) -> None:
        super().__init__(place)
        self.parameters = (Parameter("coulomb", "N m", coulomb), Parameter("viscous", "N m s", viscous))

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the torque of the joint's drive, which could move nothing against more friction."""
        torque, drive = self.drive(model.robot)
        moves = f"A joint moves only if its friction is less than {drive}"
        speed = "m/s" if model.robot.joints[self.index_in(model.robot)].kind == "prismatic" else "rad/s"
        return (
            PhysicalBound(self.parameters[0].unit, torque, f"{moves}."),
            PhysicalBound(self.parameters[1].unit, torque / SPEED, f"{moves}, at a speed of {SPEED:g} {speed}."),
        )

    def _extra(self, values: Array, velocity: Array) -> Array:
        """Return the motor torque that overcomes friction."""
        return values[0] * jnp.tanh(velocity / REVERSAL) + values[1] * velocity


@register
class TorqueBias(_OnTorque):
    """Constant error of a joint's torque sensor; the prior is 2 N m."""

    name = "torque-bias"
    summary = "The torque sensor of the joint reads a constant value without load."
    separated_by = (
        "The error is present when the joint carries no load: read the torques at rest, before and after the motion."
    )

    def __init__(self, place: str = "", sigma: float = 2.0) -> None:
        super().__init__(place)
        self.parameters = (Parameter("offset", "N m", sigma),)

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return a tenth of the torque of the joint's drive."""
        torque, drive = self.drive(model.robot)
        reason = f"The zero of a torque sensor is wrong by at most {100.0 * SENSOR_ERROR:g} % of {drive}."
        return (PhysicalBound(self.parameters[0].unit, SENSOR_ERROR * torque, reason),)

    def _extra(self, values: Array, velocity: Array) -> Array:
        """Return the constant error."""
        return jnp.broadcast_to(values[0], velocity.shape)
