"""Planned manoeuvres: a family of joint motions for the robot of a model, and the times at which it is simulated."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.design.trajectories import TrajectoryFamily
from bayesid.inference.unknowns import Unknowns
from bayesid.recording.sampled_curve import SampledCurve
from bayesid.recording.wheel_motion import WheelMotion
from bayesid.robot.kinematics import Tip
from bayesid.simulation.effects.effect_parameters import PhysicalBound
from bayesid.simulation.model import Model
from bayesid.simulation.simulator import ModelConstants, Simulator

__all__ = ["Plan"]


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
    wheel_speeds : mapping of str to SampledCurve
        Planned speeds (n, 1) of the wheels [rad/s]; omitted wheels are at rest.
    bounds : mapping of str to sequence of PhysicalBound
        Largest sizes of effects that the user states, by label; others follow from the effect and the robot.
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
    wheel_speeds: Mapping[str, SampledCurve] = field(default_factory=dict)
    bounds: Mapping[str, Sequence[PhysicalBound]] = field(default_factory=dict)

    def __getstate__(self) -> dict[str, Any]:
        """Return what the plan is made of, without anything derived."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

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
            rigid=not self.model.robot.joints,
        )

    @cached_property
    def wheels(self) -> WheelMotion:
        """Planned motion of the wheels."""
        return WheelMotion.planned(self.model.robot.wheels, self.wheel_speeds)

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

    @property
    def gyration(self) -> float:
        """Mean radius of gyration of the bodies to identify [m]."""
        moments = [prior.centre.inertia.trace() / prior.centre.mass for prior in self.model.bodies]
        return float(np.sqrt(0.5 * np.mean(moments))) if moments else 1.0
