"""A manoeuvre as planned: what the robot does, and what its sensors would tell, as functions JAX differentiates."""

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
    """What the robot does, at T instants.

    position, velocity (T, joints); tip_speed [m/s] and tip_rate [rad/s] (T,), each the larger of those relative to the
    base and to inertial space; rotation (T,) of the base since the start [rad]; excursion (T, 6): displacement of the
    base origin [m] and Cardan angles x, y, z [rad] of the base, in the axes of the start; rate, rate_change and
    acceleration (T, 3) of the base origin in base axes.
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
    """What criteria judge.

    Attributes
    ----------
    trajectory : Trajectory
    information : (n, n) array
        Fisher information of the unknowns' coordinates, without their prior.
    regressor : (6 T, b) array
        Force balance of the base against the bodies' coordinates; torques are over the radius of gyration [N].
    prior : (n, n) array, optional
        Precision of the unknowns' coordinates before the manoeuvre; one where left out.
    """

    trajectory: Trajectory
    information: Array
    regressor: Array
    prior: Array | None = None


@dataclass(frozen=True)
class Plan:
    """A family of manoeuvres of a model's robot.

    Parameters
    ----------
    model : Model
    family : Parameterisation
    interval : float
        Between samples of all sensors [s].
    tip : Tip
    attitude : (4,) array
        Base to orbit axes at time 0.
    attitude_sigma : float
        Its standard deviation per axis [rad].
    latitude : float
        Argument of latitude at time 0 [rad].
    step : float
        Of the integration [s]; limits are looked at every half step.
    thinning : int
        Only every n-th sample is simulated, and counts as n.
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
        """The unknowns of an identification from this one manoeuvre."""
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
        """Return the forward model."""
        return Simulator.of(self.model)

    @cached_property
    def constants(self) -> ModelConstants:
        """Numbers of the model."""
        return ModelConstants.of(self.model)

    @cached_property
    def samples(self) -> Floats:
        """Times of the samples [s], the last one at the end."""
        count = max(4, int(np.floor(self.family.duration / (self.interval * self.thinning) + 1e-9)))
        return np.linspace(0.0, self.family.duration, count + 1)

    @cached_property
    def sigma(self) -> Floats:
        """Noise of each sensor's axes, one after the other, shape (3 sensors,)."""
        weight = np.sqrt((self.family.duration / self.interval + 1.0) / len(self.samples))
        return np.concatenate([sensor.noise.sigma(self.interval) for sensor in self.model.sensors]) / weight

    def bodies(self) -> Sequence[int]:
        """Return the indices of the coordinates of the bodies to identify."""
        return self.unknowns.body_indices()

    def effect(self, label: str) -> Sequence[int]:
        """Return the indices of an effect's coordinates."""
        return self.unknowns.effect_indices(label)

    # ---- functions of the parameters of the motion and of the unknowns, both traced ----

    def trajectory(self, parameters: Array, z: Array) -> Trajectory:
        """Return what the robot does."""
        node, _, _ = self._traced(z, self._grid(parameters))
        return self._trajectory(parameters, node)

    def slopes(self, parameters: Array, z: Array) -> Array:
        """Return derivatives of what the sensors read in sigmas of a sample, (T, 3 sensors, n)."""
        return self._judged(parameters, z)[1]

    def outcome(self, parameters: Array, z: Array, prior: Array | None = None) -> PlannedOutcome:
        """Return what criteria judge; ``prior`` is the precision (n, n) of the coordinates, one where left out."""
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
        """Return the grid, the whitened derivatives of what the sensors read and the motion, from one simulation."""
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
        """Return the trajectory at the stages of the integration."""
        instant = jax.tree.map(lambda x: x[0], node)
        # the instants, known beforehand: half steps
        times = np.linspace(0.0, self.family.duration, instant.rate.shape[0])
        motion = self.family.motion(parameters)
        state = motion.evaluate(times)
        pose, flow = self.tip.motion(self.model.robot, state)
        turning = jnp.asarray(flow[:, :3, :3] @ jnp.swapaxes(pose[:, :3, :3], 1, 2))
        own_rate = jnp.stack([turning[:, 2, 1], turning[:, 0, 2], turning[:, 1, 0]], axis=1)
        body = instant.body
        drift = -body.com_rate - jnp.cross(instant.rate, body.com)  # of the base origin, the centre of mass resting
        speed = drift + jnp.cross(instant.rate, pose[:, :3, 3]) + flow[:, :3, 3]
        turned = jnp.einsum("ji,tjk->tik", instant.attitude[0], instant.attitude)
        displaced = body.com[0] - jnp.einsum("tij,tj->ti", turned, body.com)
        return Trajectory(
            time=times,
            position=jnp.asarray(state.position),
            velocity=jnp.asarray(state.velocity),
            tip_speed=jnp.maximum(_norm(speed), _norm(flow[:, :3, 3])),
            tip_rate=jnp.maximum(_norm(own_rate + instant.rate), _norm(own_rate)),
            rotation=_angle(turned),
            excursion=jnp.concatenate([displaced, _cardan(turned)], axis=1),
            rate=instant.rate,
            rate_change=instant.rate_change,
            acceleration=instant.acceleration,
        )


def _norm(vectors: Array | Floats) -> Array:
    """Length of vectors (T, 3); smooth at zero."""
    return jnp.sqrt(jnp.sum(jnp.asarray(vectors) ** 2, axis=1) + 1e-24)


def _angle(turned: Array) -> Array:
    """Angle of rotation matrices (T, 3, 3); smooth at zero."""
    vector = jnp.stack(
        [turned[:, 2, 1] - turned[:, 1, 2], turned[:, 0, 2] - turned[:, 2, 0], turned[:, 1, 0] - turned[:, 0, 1]],
        axis=1,
    )
    return jnp.arctan2(_norm(vector), jnp.trace(turned, axis1=1, axis2=2) - 1.0)


def _cardan(turned: Array) -> Array:
    """Angles x, y, z of rotation matrices Rx Ry Rz (T, 3, 3)."""
    y = jnp.arcsin(jnp.clip(turned[:, 0, 2], -1.0 + 1e-12, 1.0 - 1e-12))
    x = jnp.arctan2(-turned[:, 1, 2], turned[:, 2, 2])
    z = jnp.arctan2(-turned[:, 0, 1], turned[:, 0, 0])
    return jnp.stack([x, y, z], axis=1)
