"""Effects that displace the links against the recorded motion."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, cast

import jax.numpy as jnp
from jax import Array

from bayesid._math.arrays import Floats, namespace
from bayesid.recording.joint_motion import Motion
from bayesid.robot.composite_tables import composite_rows, link_table
from bayesid.robot.kinematics import Kinematics
from bayesid.robot.robot import Robot
from bayesid.simulation.effects.effect import Effect, Situation

__all__ = ["Displaced", "DisplacedMotion"]


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
        """Return the change of the links' motion at T instants."""
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
