"""Planned manoeuvres: motion of the robot and information of its sensors, as functions that JAX differentiates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Floats
from bayesid.design.trajectories import TrajectoryFamily
from bayesid.inference.unknowns import Unknowns
from bayesid.robot.end_effector import Tip
from bayesid.robot.regressors import balance_regressor
from bayesid.simulation.dynamics import Grid
from bayesid.simulation.effects.instant import Instant, Readings
from bayesid.simulation.model import Model
from bayesid.simulation.simulator import ModelConstants, Simulator
from bayesid.simulation.time_grid import build_grid

__all__ = ["Plan", "PlannedOutcome", "Trajectory"]


class Trajectory(NamedTuple):
    """Motion of the robot at T instants.

    Attributes
    ----------
    time : (T,) array
        Instants [s].
    position, velocity : (T, joints) array
        Positions [rad, m] and speeds [rad/s, m/s] of the joints.
    tip_speed, tip_rate : (T,) array
        Speed [m/s] and angular rate [rad/s] of the tip, the larger of those relative to base and inertial space.
    rotation : (T,) array
        Angle of the base's rotation since the start [rad].
    excursion : (T, 6) array
        Displacement of the base origin [m] and Cardan angles x, y, z of the base [rad], in the axes of the start.
    rate, rate_change, acceleration : (T, 3) array
        Angular velocity [rad/s] and acceleration [rad/s2] of the base, and acceleration of its origin [m/s2], base
        axes.
    """

    time: Floats
    position: Array
    velocity: Array
    tip_speed: Array
    tip_rate: Array
    rotation: Array
    excursion: Array
    rate: Array
    rate_change: Array
    acceleration: Array


class PlannedOutcome(NamedTuple):
    """Predicted outcome of a plan, which the criteria evaluate.

    Attributes
    ----------
    trajectory : Trajectory
        Motion of the robot.
    information : (n, n) array
        Fisher information of the unknowns' coordinates, without their prior.
    regressor : (6 T, b) array
        Derivative of the base's balance with respect to the coordinates of the bodies to identify; torques are divided
        by the radius of gyration [N].
    prior : (n, n) array, optional
        Precision of the unknowns' coordinates before the manoeuvre, by default the identity.
    """

    trajectory: Trajectory
    information: Array
    regressor: Array
    prior: Array | None = None


@dataclass(frozen=True)
class Plan:
    """Family of manoeuvres for the robot of a model.

    Parameters
    ----------
    model : Model
        Robot, sensors, effects and priors.
    family : TrajectoryFamily
        Family of joint motions.
    interval : float
        Interval between samples of all sensors [s].
    tip : Tip
        End-effector whose motion is limited.
    attitude : (4,) array
        Initial attitude, a quaternion x, y, z, w from base to orbit axes.
    attitude_sigma : float
        Standard deviation of the initial attitude per axis [rad].
    argument_of_latitude : float
        Argument of latitude at time 0 [rad].
    step : float
        Step of the integration [s]; limits are evaluated every half step.
    thinning : int
        Number of samples that one simulated sample stands for.
    """

    model: Model
    family: TrajectoryFamily
    interval: float
    tip: Tip
    attitude: Floats = field(default_factory=lambda: np.array([0.0, 0.0, 0.0, 1.0]))
    attitude_sigma: float = 0.0
    argument_of_latitude: float = 0.0
    step: float = 2.0
    thinning: int = 1

    @cached_property
    def unknowns(self) -> Unknowns:
        """Unknowns of an identification from this one manoeuvre."""
        return Unknowns(
            bodies=self.model.priors,
            effects=self.model.effects,
            recordings=1,
            rate_sigma=self.model.rate_sigma,
            tilt_sigma=(self.attitude_sigma,),
            mixing=self.model.mixing,
        )

    @cached_property
    def simulator(self) -> Simulator:
        """Simulator of the model."""
        return Simulator.of(self.model)

    @cached_property
    def constants(self) -> ModelConstants:
        """Numerical constants of the model."""
        return ModelConstants.of(self.model)

    @cached_property
    def samples(self) -> Floats:
        """Times of the samples [s], the last one at the end."""
        count = max(4, int(np.floor(self.family.duration / (self.interval * self.thinning) + 1e-9)))
        return np.linspace(0.0, self.family.duration, count + 1)

    @cached_property
    def sigma(self) -> Floats:
        """Standard deviations of a simulated sample, axis by axis of each sensor, shape (3 sensors,)."""
        weight = np.sqrt((self.family.duration / self.interval + 1.0) / len(self.samples))
        return np.concatenate([sensor.noise.sigma(self.interval) for sensor in self.model.sensors]) / weight

    def bodies(self) -> Sequence[int]:
        """Return the indices of the coordinates of the bodies to identify."""
        return self.unknowns.body_indices()

    def effect(self, label: str) -> Sequence[int]:
        """Return the indices of an effect's coordinates."""
        return self.unknowns.effect_indices(label)

    # ---- functions of the motion's parameters and of the unknowns, both of which JAX may trace ----

    def trajectory(self, parameters: Array, z: Array) -> Trajectory:
        """Return the motion of the robot, for parameters of the family and coordinates ``z`` of the unknowns."""
        node, _, _ = self._traced(z, self._grid(parameters))
        return self._trajectory(parameters, node)

    def slopes(self, parameters: Array, z: Array) -> Array:
        """Return derivatives of the readings, in standard deviations of a sample, shape (T, 3 sensors, n)."""
        return self._judged(parameters, z)[1]

    def outcome(self, parameters: Array, z: Array, prior: Array | None = None) -> PlannedOutcome:
        """Return the predicted outcome; ``prior`` is the coordinates' precision (n, n), by default the identity."""
        grid, slope, node = self._judged(parameters, z)
        flat = slope.reshape(-1, slope.shape[-1])
        trajectory = self._trajectory(parameters, node)
        bodies = jnp.asarray(self.bodies(), dtype=int)
        per_coordinate = jax.jacfwd(lambda z: self.unknowns.values(z).inertial)(z)[:, bodies]
        tables = grid.node.unknown[0, :, :, self.unknowns.layout.all_bodies]
        wrench = balance_regressor(tables, trajectory.rate, trajectory.rate_change, trajectory.acceleration)
        wrench = wrench * jnp.concatenate([jnp.ones(3), jnp.full(3, 1.0 / self._gyration)])[:, None]
        regressor = (wrench @ per_coordinate).reshape(6 * len(wrench), len(bodies))
        return PlannedOutcome(trajectory, flat.T @ flat, regressor, prior)

    def _judged(self, parameters: Array, z: Array) -> tuple[Grid, Array, Instant]:
        """Return the grid, the whitened derivatives of the readings and the motion, all from one simulation."""
        grid = self._grid(parameters)

        def read(z: Array) -> tuple[Array, Instant]:
            node, _, readings = self._traced(z, grid)
            return self.simulator.residual(readings, jax.lax.stop_gradient(readings))[0], node

        slopes, node = jax.jacfwd(read, has_aux=True)(z)
        return grid, -slopes / jnp.asarray(self.sigma)[:, None], node

    def _traced(self, z: Array, grid: Grid) -> tuple[Instant, Instant, Readings]:
        values, attitude = self.unknowns.values(z), jnp.asarray(self.attitude)[None]
        return self.simulator.trace(self.constants, values, grid, attitude)

    @property
    def _gyration(self) -> float:
        """Mean radius of gyration of the bodies to identify [m]."""
        moments = [prior.centre.inertia.trace() / prior.centre.mass for prior in self.model.bodies]
        return float(np.sqrt(0.5 * np.mean(moments))) if moments else 1.0

    def _grid(self, parameters: Array) -> Grid:
        grid = build_grid(
            self.model.robot,
            tuple(prior.name for prior in self.model.priors),
            self.family.motion(parameters),
            self.samples,
            self.step,
            orbit=self.model.orbit,
            argument_of_latitude=self.argument_of_latitude,
            effects=self.model.effects,
        )
        return jax.tree.map(lambda x: x[None], grid)

    def _trajectory(self, parameters: Array, node: Instant) -> Trajectory:
        """Return the trajectory at the integration nodes."""
        instant = jax.tree.map(lambda x: x[0], node)
        # the nodes are the half steps, so their times need not be traced
        times = np.linspace(0.0, self.family.duration, instant.rate.shape[0])
        motion = self.family.motion(parameters)
        state = motion.evaluate(times)
        pose, flow = self.tip.motion(self.model.robot, state)
        turning = jnp.asarray(flow[:, :3, :3] @ jnp.swapaxes(pose[:, :3, :3], 1, 2))
        relative_rate = jnp.stack([turning[:, 2, 1], turning[:, 0, 2], turning[:, 1, 0]], axis=1)
        body = instant.body
        drift = -body.com_rate - jnp.cross(instant.rate, body.com)  # velocity of the base origin
        speed = drift + jnp.cross(instant.rate, pose[:, :3, 3]) + flow[:, :3, 3]
        turned = jnp.einsum("ji,tjk->tik", instant.attitude[0], instant.attitude)
        displaced = body.com[0] - jnp.einsum("tij,tj->ti", turned, body.com)
        return Trajectory(
            time=times,
            position=jnp.asarray(state.position),
            velocity=jnp.asarray(state.velocity),
            tip_speed=jnp.maximum(_norm(speed), _norm(flow[:, :3, 3])),
            tip_rate=jnp.maximum(_norm(relative_rate + instant.rate), _norm(relative_rate)),
            rotation=_angle(turned),
            excursion=jnp.concatenate([displaced, _cardan(turned)], axis=1),
            rate=instant.rate,
            rate_change=instant.rate_change,
            acceleration=instant.acceleration,
        )


def _norm(vectors: Array | Floats) -> Array:
    """Return the lengths of vectors (T, 3), smooth at zero."""
    return jnp.sqrt(jnp.sum(jnp.asarray(vectors) ** 2, axis=1) + 1e-24)


def _angle(turned: Array) -> Array:
    """Return the angles of rotation matrices (T, 3, 3), smooth at zero."""
    vector = jnp.stack(
        [turned[:, 2, 1] - turned[:, 1, 2], turned[:, 0, 2] - turned[:, 2, 0], turned[:, 1, 0] - turned[:, 0, 1]],
        axis=1,
    )
    return jnp.arctan2(_norm(vector), jnp.trace(turned, axis1=1, axis2=2) - 1.0)


def _cardan(turned: Array) -> Array:
    """Return the Cardan angles x, y, z, shape (T, 3), of rotation matrices Rx Ry Rz, shape (T, 3, 3)."""
    y = jnp.arcsin(jnp.clip(turned[:, 0, 2], -1.0 + 1e-12, 1.0 - 1e-12))
    x = jnp.arctan2(-turned[:, 1, 2], turned[:, 2, 2])
    z = jnp.arctan2(-turned[:, 0, 1], turned[:, 0, 0])
    return jnp.stack([x, y, z], axis=1)
