"""One planned manoeuvre as flown at given values of the unknowns: its motion, and the derivatives that a design needs.

All methods are traced by JAX. There are T instants, of which the samples are some, n unknowns and p parameters of the
manoeuvre.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.small_matrices import rotation, tilted
from bayesid.design.plan import Plan
from bayesid.design.trajectory import BaseAtStart, Trajectory, base_quantities, trajectory_of
from bayesid.recording.actions import Actions
from bayesid.robot.composite_tables import ENTRIES, Screws, beyond, row_sensitivity, screws
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import Kinematics, joint_motion, kinematics
from bayesid.robot.regressors import balance_regressor
from bayesid.simulation.dynamics import Grid, Samples, Start, TimeTables, UnitSpeed
from bayesid.simulation.instant import Readings
from bayesid.simulation.simulator import Values
from bayesid.simulation.time_grid import time_tables
from bayesid.simulation.variation import Equations, propagate

__all__ = ["Flight", "Outcome"]


@dataclass(frozen=True)
class Flight:
    """Planned manoeuvre.

    Parameters
    ----------
    plan : Plan
        Family of the manoeuvre, model and times.
    parameters : (p,) array
        Parameters of the motion.
    z : (n,) array
        Coordinates of the unknowns.
    """

    plan: Plan
    parameters: Array
    z: Array

    def trajectory(self) -> Trajectory:
        """Return the motion of the robot at all instants."""
        samples = self._equations.samples(self._states, self._rows, self._tables, self._effects)
        base = jax.vmap(base_quantities, (0, None, 0))(samples.instant, self._start, self._tip)
        return trajectory_of(self.plan.instants, self._joints, base)

    def trajectory_and_slopes(self) -> tuple[Trajectory, Trajectory]:
        """Return the motion of the robot, and its derivatives by the parameters with a last axis p."""
        by_joint = self.plan.family.slopes(self.parameters, self.plan.instants)
        rows = self._row_slopes(by_joint)

        def quantity(sample: Samples, tip: Array) -> Array:
            return base_quantities(sample.instant, self._start, tip)

        base, slope, seen = self._equations.slopes(
            self._states, self._rows, self._tables, self._effects, quantity, self._tip
        )
        begin = jax.jacrev(self._initial)(self._rows[0], self.z) @ rows[0]
        states = propagate(slope.state, slope.row @ rows, begin, self._steps)
        change = seen.along(states, rows) + seen.given @ self._tip_slopes(by_joint)
        time = self.plan.instants
        return trajectory_of(time, self._joints, base), trajectory_of(time, JointState(*by_joint), change)

    def information(self, explained: Array | None = None) -> Array:
        """Return the Fisher information of z, (n, n), given the sensors' white noise and the `encoder_directions`."""
        slopes = self._reading_slopes()
        flat = slopes.reshape(-1, slopes.shape[-1])
        information = flat.T @ flat
        if explained is None or not explained.shape[1]:
            return information
        hidden = explained.T @ flat
        return information - hidden.T @ hidden

    def _reading_slopes(self) -> Array:
        """Return the derivatives of the readings by z, in standard deviations of a sample, (samples, 3 sensors, n)."""
        plan, unknowns = self.plan, self.plan.unknowns
        simulator = plan.simulator
        none = jnp.zeros((len(plan.instants), 0))

        def quantity(sample: Samples, given: Array) -> Array:
            return simulator.reading(plan.constants, sample)

        plain, slope, seen = self._equations.slopes(
            self._states, self._rows, self._tables, self._effects, quantity, none
        )

        def numbers(z: Array) -> tuple[Array, Array]:
            values = unknowns.values(z)
            effects = self._alone(values.effects)
            return self._equations.loads(values.inertial, effects), _joined(effects)

        loads, changes = jax.jacfwd(numbers)(self.z)
        rows = self._tables.unknown @ loads
        begin = jax.jacfwd(lambda z: self._initial(self._tables.known[0] + self._tables.unknown[0] @ numbers(z)[0], z))
        forcing = slope.row @ rows + slope.values @ changes
        states = propagate(slope.state, forcing, begin(self.z), self._steps)
        every = (len(plan.instants) - 1) // (len(plan.samples) - 1)
        raw = seen.along(states, rows) + seen.values @ changes
        return self._faulty(plain[::every], raw[::every], changes) / jnp.asarray(plan.sigma)[:, None]

    def prepare(self) -> None:
        """Compute what all functions of the flight share, where one of them is traced inside of other code."""
        _ = self._states, self._kinematics

    # ---- parts ----

    @cached_property
    def _joints(self) -> JointState:
        return self.plan.family.state(self.parameters, self.plan.instants)

    @cached_property
    def _kinematics(self) -> Kinematics:
        return kinematics(self.plan.model.robot, self._joints)

    @cached_property
    def _tables(self) -> TimeTables:
        plan = self.plan
        return time_tables(
            plan.model.robot,
            tuple(prior.name for prior in plan.model.priors),
            plan.model.effects,
            plan.family.motion(self.parameters),
            plan.instants,
            plan.model.orbit,
            plan.argument_of_latitude,
            Actions.none(plan.wheels),
        )

    @property
    def tables(self) -> Array:
        """Tables of the unknown bodies at all instants, shape (T, 28, 10 bodies)."""
        return self._tables.unknown[:, :, self.plan.unknowns.layout.all_bodies]

    @cached_property
    def _values(self) -> Values:
        return self.plan.unknowns.values(self.z)

    @cached_property
    def _equations(self) -> Equations:
        constants = self.plan.constants
        return Equations(self.plan.simulator.effects(constants), jnp.asarray(constants.point))

    @cached_property
    def _effects(self) -> tuple[Array, ...]:
        """Parameters of each effect in this recording."""
        return self._alone(self._values.effects)

    def _alone(self, values: Sequence[Array]) -> tuple[Array, ...]:
        pairs = zip(self._equations.effects, values, strict=True)
        return tuple(value[0] if effect.per_recording else value for effect, value in pairs)

    @cached_property
    def _rows(self) -> Array:
        loads = self._equations.loads(self._values.inertial, self._effects)
        return self._tables.known + self._tables.unknown @ loads

    @property
    def _steps(self) -> Array:
        return jnp.diff(jnp.asarray(self.plan.instants[::2]))

    @cached_property
    def _states(self) -> Array:
        begin = self._initial(self._rows[0], self.z)
        return self._equations.states(self._steps, self._rows, self._tables, begin, self._effects)

    def _initial(self, row: Array, z: Array) -> Array:
        values = self.plan.unknowns.values(z)
        start = Start(tilted(jnp.asarray(self.plan.attitude), values.tilt[0]), values.rate[0])
        return self._equations.initial(row, self._tables, start, self._alone(values.effects))

    @property
    def _start(self) -> BaseAtStart:
        """Base at the start, which is the same for all motions of a family."""
        row = jax.lax.stop_gradient(self._rows[0])
        values = self.plan.unknowns.values(self.z)
        return BaseAtStart(
            rotation(tilted(jnp.asarray(self.plan.attitude), values.tilt[0])), row[ENTRIES["first"]] / row[0]
        )

    @property
    def _tip_motion(self) -> tuple[Array, Array]:
        """Pose of the tip in the base and its derivative, each (T, 4, 4)."""
        pose, rate, _ = joint_motion(self._kinematics, self.plan.tip.joint)
        return jnp.asarray(pose @ self.plan.tip.placement), jnp.asarray(rate @ self.plan.tip.placement)

    @property
    def _tip(self) -> Array:
        """Upper three rows of both, shape (T, 24)."""
        return jnp.concatenate([part[:, :3].reshape(-1, 12) for part in self._tip_motion], axis=1)

    @cached_property
    def _screws(self) -> Screws:
        return screws(self.plan.model.robot, self._kinematics)

    def _row_slopes(self, by_joint: Array) -> Array:
        """Return the derivatives (T, 28, p) of the rows by the parameters, given those of the joints' states."""
        model = self.plan.model
        if any(effect.uses("table") for effect in model.effects):
            return jax.jacfwd(lambda parameters: Flight(self.plan, parameters, self.z)._rows)(self.parameters)
        vectors = self._values.inertial.reshape(-1, 10)
        bodies = {prior.name: vectors[index] for index, prior in enumerate(model.priors)}
        by_state = row_sensitivity(model.robot, self._kinematics, self._screws, bodies)
        return jnp.einsum("dtjr,dtjp->trp", by_state, by_joint)

    def _tip_slopes(self, by_joint: Array) -> Array:
        """Return the derivatives (T, 24, p) of the tip's pose and its rate by the parameters."""
        robot, (pose, flow) = self.plan.model.robot, self._tip_motion
        moving = beyond(robot)[:, self.plan.tip.joint] if self.plan.tip.joint >= 0 else np.zeros(len(robot.joints))
        screw, screw_rate, _ = self._screws
        pose_slope = screw @ pose[:, None]
        flow_slope = screw_rate @ pose[:, None] + screw @ flow[:, None]
        by_position, by_velocity = by_joint[0] * moving[:, None], by_joint[1] * moving[:, None]
        parts = (
            jnp.einsum("tjab,tjp->tabp", pose_slope, by_position),
            jnp.einsum("tjab,tjp->tabp", flow_slope, by_position)
            + jnp.einsum("tjab,tjp->tabp", pose_slope, by_velocity),
        )
        return jnp.concatenate([part[:, :3].reshape(len(pose), 12, -1) for part in parts], axis=1)

    def _faulty(self, plain: Array, raw: Array, changes: Array) -> Array:
        """Return the derivatives of the readings with the faults that effects add, from those of the raw readings."""
        plan = self.plan
        every = (len(plan.instants) - 1) // (len(plan.samples) - 1)
        at = jax.tree.map(lambda x: jnp.asarray(x)[::every][None], self._tables)
        nothing = jnp.zeros((1, 0))
        grid = Grid(nothing, at, nothing, at, nothing, nothing, UnitSpeed(nothing, nothing))
        splits = np.cumsum([len(value) for value in self._effects])[:-1]

        def read(raw: Array, effects: Array) -> Readings:
            parts = jnp.split(effects, splits)[: len(self._effects)]  # one empty part where there are no effects
            pairs = zip(self._equations.effects, parts, strict=True)
            recorded = tuple(part[None] if effect.per_recording else part for effect, part in pairs)
            values = self._values._replace(effects=recorded)
            return plan.simulator.faulty(plan.constants, values, grid, raw[None])

        joined = _joined(self._effects)
        measured = jax.lax.stop_gradient(read(plain, joined))

        def residual(raw: Array, effects: Array) -> Array:
            return -plan.simulator.residual(read(raw, effects), measured)[0]

        along = jax.vmap(lambda *one: jax.jvp(residual, (plain, joined), one)[1], (2, 1), 2)
        return along(raw, changes)


@dataclass(frozen=True)
class Outcome:
    """Predicted outcome of a manoeuvre, of which only what a criterion asks for is computed, and so differentiated.

    Parameters
    ----------
    flight : Flight
        The manoeuvre.
    information : (n, n) array
        Fisher information of the unknowns' coordinates, without their prior.
    prior : (n, n) array, optional
        Precision of the unknowns' coordinates before the manoeuvre, by default the identity.
    """

    flight: Flight
    information: Array
    prior: Array | None = None

    @property
    def trajectory(self) -> Trajectory:
        """Motion of the robot."""
        return self.flight.trajectory()

    @property
    def regressor(self) -> Array:
        """Derivative (6 T, b) of the base's balance with respect to the b coordinates of the bodies to identify [N].

        Torques are divided by the radius of gyration.
        """
        plan, trajectory = self.flight.plan, self.trajectory
        bodies = jnp.asarray(plan.bodies(), dtype=int)
        per_coordinate = jax.jacfwd(lambda z: plan.unknowns.values(z).inertial)(self.flight.z)[:, bodies]
        motion = (trajectory.rate, trajectory.rate_change, trajectory.acceleration)
        wrench = balance_regressor(self.flight.tables, *motion)
        wrench = wrench * jnp.concatenate([jnp.ones(3), jnp.full(3, 1.0 / plan.gyration)])[:, None]
        return (wrench @ per_coordinate).reshape(6 * len(wrench), len(bodies))


def _joined(values: Sequence[Array]) -> Array:
    return jnp.concatenate([jnp.zeros(0), *values])
