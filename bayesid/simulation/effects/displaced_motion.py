"""Links displaced against the recorded motion of their joints, and the deflection of a joint under its torque."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, cast

import jax.numpy as jnp
import numpy as np
import pinocchio as pin
from jax import Array
from scipy.interpolate import make_interp_spline

from bayesid._math.arrays import Floats, namespace
from bayesid.recording.joint_motion import Motion
from bayesid.robot.composite_tables import composite_rows, link_table
from bayesid.robot.kinematics import Kinematics, configuration
from bayesid.robot.robot import Robot
from bayesid.simulation.effects.effect import Effect, Situation

__all__ = ["KNOTS", "Deflection", "Displaced", "DisplacedMotion"]

KNOTS = 0.5
"""Interval between the instants at which a joint's torque is computed [s]."""

DEGREE = 5
"""Of the spline through the torques, whose derivatives up to the fourth are taken."""


class DisplacedMotion(Effect):
    """Effect that displaces links against the recorded motion.

    It changes the tables of all bodies that the links carry. The tables of bodies with unknown parameters change in
    proportion to those parameters and are therefore kept apart from those of the known bodies. The effect on joint
    torques is left out.
    """

    @classmethod
    def instances(cls, model: Situation) -> Sequence[Effect]:
        """Return the effect wherever it can occur, and nowhere in a model with torque sensors."""
        return [] if model.torque is not None else super().instances(model)

    def displaced(self, robot: Robot, motion: Motion, time: Floats) -> Displaced:
        """Return the change of the links' motion at T instants, with the parameters of `table`."""
        raise NotImplementedError

    def table(self, robot: Robot, motion: Motion, time: Floats) -> Floats:
        """Return the change of the tables of all bodies with the robot's parameters, (T, 28, m)."""
        change = self.displaced(robot, motion, time)
        return change.weighted([composite_rows(robot, moved) for moved in change.motions])

    def body_tables(
        self, robot: Robot, unknown: Sequence[str], motion: Motion, time: Floats
    ) -> list[tuple[str | None, Floats]]:
        """Return the changes of the known bodies' table, (T, 28, m), and of each unknown body's, (T, 28, 10 m)."""
        change = self.displaced(robot, motion, time)
        known = change.weighted([composite_rows(robot, moved, leave_out=unknown) for moved in change.motions])
        tables: list[tuple[str | None, Floats]] = [(None, known)]
        for name in unknown:
            table = change.weighted([link_table(robot, name, moved) for moved in change.motions])
            tables.append((None, table.reshape(*table.shape[:2], -1)))
        return tables

    def body_loads(self, values: Array, inertial: Array) -> Array:
        """Return the coefficients, then for each unknown body their products with its ten parameters."""
        coefficients = self.loads(values)
        products = coefficients[None, :, None] * inertial.reshape(-1, 1, 10)
        return jnp.concatenate([coefficients, products.ravel()])


class Deflection:
    """Negative torque through a joint divided by the inertia beyond it at zero [1/s2], as a function of time."""

    def __init__(self, robot: Robot, motion: Motion, index: int, end: float) -> None:
        knots = np.linspace(0.0, end, max(int(np.ceil(end / KNOTS)), DEGREE) + 1)
        model = _loaded(robot)
        data = model.createData()
        state = motion.evaluate(knots)
        beyond = pin.crba(model, data, configuration(robot, np.zeros(len(robot.joints))))[6 + index, 6 + index]
        places = [configuration(robot, position) for position in state.position]
        upper = np.triu(np.stack([np.array(pin.crba(model, data, q)) for q in places]))
        mass = upper + np.swapaxes(np.triu(upper, 1), 1, 2)
        # the base floats with zero momentum and without an external wrench
        speed, acceleration = state.velocity[..., None], state.acceleration[..., None]
        base_speed = -np.linalg.solve(mass[:, :6, :6], mass[:, :6, 6:] @ speed)
        speeds = np.concatenate([base_speed, speed], axis=1)[..., 0]
        drift = np.stack([pin.nonLinearEffects(model, data, q, v).copy() for q, v in zip(places, speeds, strict=True)])
        base = -np.linalg.solve(mass[:, :6, :6], mass[:, :6, 6:] @ acceleration + drift[:, :6, None])
        torque = mass[:, 6 + index, None] @ np.concatenate([base, acceleration], axis=1)
        ratio = -(torque[:, 0, 0] + drift[:, 6 + index]) / beyond
        self.spline = make_interp_spline(knots, ratio, k=DEGREE)
        # inertia beyond the joint over that which resists the joint's torque, with the base free and others driven
        free = np.ix_(range(len(knots)), [*range(6), 6 + index], [*range(6), 6 + index])
        self.mobility = knots, beyond * np.linalg.inv(mass[free])[:, 6, 6]
        self.span = (knots[0], knots[-1])

    def derivative(self, time: Floats, order: int) -> Floats:
        """Return the derivative of an order at the times (T,)."""
        return np.asarray(self.spline(np.clip(time, *self.span), nu=order))


def _loaded(robot: Robot) -> pin.Model:
    """Return Pinocchio's model with the links and loads that the robot has now."""
    model = robot.model.copy()
    for joint in range(1, model.njoints):
        model.inertias[joint] = pin.Inertia.Zero()
    for link in robot.links.values():
        if link.inertial.mass > 0.0:
            model.inertias[link.joint + 2] += pin.SE3(link.placement).act(
                pin.Inertia.FromDynamicParameters(link.inertial.vector)
            )
    return model


class Displaced(NamedTuple):
    """Change of the motion of all links, as a weighted sum over motions with m coefficients.

    The change of any body's kinematic table is ``sum_k c_k sum_s weights[k, s] table(motions[s])``, where the c_k are
    the effect's coefficients (`Effect.loads`).

    Attributes
    ----------
    motions : (S,) sequence of Kinematics
        Motions of the joint frames.
    weights : (m, S) array
        Weights of the motions for each coefficient.
    """

    motions: Sequence[Kinematics]
    weights: Floats

    def weighted(self, tables: Sequence[Floats]) -> Floats:
        """Return the weighted sums (T, 28, m, ...) of tables along the motions, each (T, 28, ...)."""
        xp = namespace(tables[0])
        return cast("Floats", xp.einsum("ks,std...->tdk...", self.weights, xp.stack(list(tables))))
