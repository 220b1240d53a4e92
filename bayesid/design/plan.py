"""Planned manoeuvres: motion of the robot and information of its sensors, as functions that JAX differentiates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Floats
from bayesid.design.flight import Flight
from bayesid.design.trajectories import TrajectoryFamily
from bayesid.design.trajectory import Trajectory
from bayesid.inference.unknowns import Unknowns
from bayesid.robot.end_effector import Tip
from bayesid.robot.regressors import balance_regressor
from bayesid.simulation.model import Model
from bayesid.simulation.simulator import ModelConstants, Simulator

__all__ = ["FlightOutcome", "Outcome", "Plan", "PlannedOutcome", "Trajectory"]


class Outcome(Protocol):
    """Interface of what the criteria evaluate, with the attributes of `PlannedOutcome`."""

    @property
    def trajectory(self) -> Trajectory: ...  # noqa: D102

    @property
    def information(self) -> Array: ...  # noqa: D102

    @property
    def regressor(self) -> Array: ...  # noqa: D102

    @property
    def prior(self) -> Array | None: ...  # noqa: D102


class PlannedOutcome(NamedTuple):
    """Predicted outcome of a plan.

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
class FlightOutcome:
    """Predicted outcome of which only what a criterion asks for is computed, and so differentiated.

    Parameters
    ----------
    plan : Plan
    flight : Flight
        The manoeuvre.
    information : (n, n) array
        Fisher information of the unknowns' coordinates, without their prior.
    prior : (n, n) array, optional
        Precision of the unknowns' coordinates before the manoeuvre, by default the identity.
    """

    plan: Plan
    flight: Flight
    information: Array
    prior: Array | None

    @property
    def trajectory(self) -> Trajectory:
        """Motion of the robot."""
        return self.flight.trajectory()

    @property
    def regressor(self) -> Array:
        """Derivative of the base's balance with respect to the coordinates of the bodies to identify [N]."""
        own, unknowns, trajectory = self.plan, self.plan.unknowns, self.trajectory
        bodies = jnp.asarray(own.bodies(), dtype=int)
        per_coordinate = jax.jacfwd(lambda z: unknowns.values(z).inertial)(self.flight.z)[:, bodies]
        motion = (trajectory.rate, trajectory.rate_change, trajectory.acceleration)
        wrench = balance_regressor(self.flight.tables, *motion)
        wrench = wrench * jnp.concatenate([jnp.ones(3), jnp.full(3, 1.0 / own.gyration)])[:, None]
        return (wrench @ per_coordinate).reshape(6 * len(wrench), len(bodies))


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
    encoder_sigma : tuple of float
        Standard deviation of the position samples of each joint [rad or m]; zero or none for exact joints.
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
    encoder_sigma: tuple[float, ...] = ()

    def __getstate__(self) -> dict[str, Any]:
        """Return what the plan is made of, without anything derived."""
        return {item.name: getattr(self, item.name) for item in fields(self)}

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

    @cached_property
    def instants(self) -> Floats:
        """Nodes and midpoints of the integration steps [s], some of which are the samples."""
        count = len(self.samples) - 1
        parts = int(np.ceil(self.family.duration / count / (0.5 * self.step) - 1e-9))
        parts += (count * parts) % 2
        return np.linspace(0.0, self.family.duration, count * parts + 1)

    def bodies(self) -> Sequence[int]:
        """Return the indices of the coordinates of the bodies to identify."""
        return self.unknowns.body_indices()

    def effect(self, label: str) -> Sequence[int]:
        """Return the indices of an effect's coordinates."""
        return self.unknowns.effect_indices(label)

    # ---- functions of the motion's parameters and of the unknowns, both of which JAX may trace ----

    def trajectory(self, parameters: Array, z: Array) -> Trajectory:
        """Return the motion of the robot, for parameters of the family and coordinates ``z`` of the unknowns."""
        return Flight(self, parameters, z).trajectory()

    def slopes(self, parameters: Array, z: Array) -> Array:
        """Return derivatives of the readings, in standard deviations of a sample, shape (T, 3 sensors, n)."""
        return Flight(self, parameters, z).reading_slopes()

    def outcome(self, parameters: Array, z: Array, prior: Array | None = None) -> PlannedOutcome:
        """Return the predicted outcome; ``prior`` is the coordinates' precision (n, n), by default the identity."""
        flight = Flight(self, parameters, z)
        lazy = FlightOutcome(self, flight, flight.information(), prior)
        return PlannedOutcome(lazy.trajectory, lazy.information, lazy.regressor, prior)

    @property
    def gyration(self) -> float:
        """Mean radius of gyration of the bodies to identify [m]."""
        moments = [prior.centre.inertia.trace() / prior.centre.mass for prior in self.model.bodies]
        return float(np.sqrt(0.5 * np.mean(moments))) if moments else 1.0
