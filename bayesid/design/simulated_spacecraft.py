"""Spacecraft that execute planned manoeuvres: the interface to the loop, and a simulated implementation.

A plan is a recording with position, velocity and acceleration of every joint and the speed of every wheel at the
samples' times, and nothing else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.inference.predicted_readings import simulate_manoeuvre
from bayesid.recording.joint_motion import Motion
from bayesid.recording.recording import Recording
from bayesid.recording.wheel_motion import WheelMotion
from bayesid.robot.joint_state import JointState
from bayesid.robot.robot import Robot
from bayesid.simulation.model import Model

__all__ = ["PlannedMotion", "SimulatedSpacecraft", "Spacecraft", "plan_recording"]

FAMILIES = ("position", "velocity", "acceleration")  # families of columns in a plan, in the order of `JointState`


class Spacecraft(Protocol):
    """Interface of a robot, or of a simulator of one, to the loop."""

    def execute(self, plan: Recording) -> Recording:
        """Move the joints as planned, and return the recording.

        Parameters
        ----------
        plan : Recording
            Columns ``position.``, ``velocity.`` and ``acceleration.<joint>`` of every joint at the samples' times. The
            plan is named after the step; simulated noise must follow from that name, so that a repeated step gives the
            same recording.

        Returns
        -------
        Recording
            Recording with the channels of the model's sensors and of all joints.
        """
        ...


@dataclass(frozen=True)
class PlannedMotion:
    """Motion between the samples of a plan, a quintic spline through the positions.

    Its third and fourth derivatives are continuous, so that samples of it can be smoothed well. At its ends the spline
    meets velocity and acceleration of the plan exactly.

    Parameters
    ----------
    plan : Recording
        Plan of the loop.
    joints : sequence of str
        Names of the joints in the order in which `evaluate` returns them.
    """

    plan: Recording
    joints: Sequence[str]

    def __post_init__(self) -> None:
        for joint in self.joints:
            for name in (f"{family}.{joint}" for family in FAMILIES):
                if name not in self.plan.channels:
                    raise InputError(f"a plan has no {name}", file=self.plan.file, remedy="Give what the loop planned")
        position, velocity, acceleration = (
            np.stack([self.plan.channels[f"{family}.{joint}"] for joint in self.joints], axis=1) for family in FAMILIES
        )
        ends: Any = tuple([(1, velocity[at]), (2, acceleration[at])] for at in (0, -1))
        spline = make_interp_spline(self.plan.time, position, k=5, bc_type=ends)
        object.__setattr__(self, "_splines", [spline, spline.derivative(1), spline.derivative(2)])

    def evaluate(self, time: Floats) -> JointState:
        """Return the joint state at the times, shape (T,); before and after the plan it is that at its ends."""
        splines: Sequence[BSpline] = self._splines  # type: ignore[attr-defined]
        inside = np.clip(time, self.plan.time[0], self.plan.time[-1])
        return JointState(*(np.asarray(spline(inside)) for spline in splines))


def plan_recording(
    motion: Motion, robot: Robot, time: Floats, name: str, wheels: WheelMotion | None = None
) -> Recording:
    """Return a motion as the plan that a spacecraft executes.

    Parameters
    ----------
    motion : Motion
        Motion of all joints.
    robot : Robot
    time : (T,) array
        Times of the samples [s].
    name : str
        Name of the recording.
    wheels : WheelMotion, optional
        Motion of the wheels, by default at rest.
    """
    spun = wheels or WheelMotion.planned(robot.wheels)
    state = motion.evaluate(time)
    channels = {
        f"{family}.{joint.name}": values[:, index]
        for family, values in zip(FAMILIES, state, strict=True)
        for index, joint in enumerate(robot.joints)
    }
    return Recording(name, None, time, {**channels, **spun.speed_channels(time)})


@dataclass(frozen=True)
class SimulatedSpacecraft:
    """Spacecraft simulated by the package, at rest before every manoeuvre.

    Parameters
    ----------
    truth : Model
        Model of the true robot with its effects and sensors; bodies under ``priors`` are at their prior's centre.
    encoder_sigma : float
        Standard deviation of the noise of the recorded joint positions [rad or m].
    seed : int
        Seed of all noise, together with the name of the plan.
    noise : bool
        True if sensors and encoders have noise.
    attitude : (4,) array
        Initial attitude, a quaternion x, y, z, w from base to orbit axes.
    argument_of_latitude : float
        Argument of latitude at time 0 [rad].
    """

    truth: Model
    encoder_sigma: float = 0.0
    seed: int = 0
    noise: bool = True
    attitude: Floats = field(default_factory=lambda: np.array([0.0, 0.0, 0.0, 1.0]))
    argument_of_latitude: float = 0.0

    def execute(self, plan: Recording) -> Recording:
        """Return the recording of a simulated plan."""
        joints = [joint.name for joint in self.truth.robot.joints]
        return simulate_manoeuvre(
            self.truth,
            PlannedMotion(plan, joints),
            plan.time,
            name=plan.name,
            attitude=self.attitude,
            argument_of_latitude=self.argument_of_latitude,
            rng=np.random.default_rng([self.seed, *plan.name.encode()]) if self.noise else None,
            encoder_sigma=self.encoder_sigma if self.noise else 0.0,
            wheels=WheelMotion.from_recording(plan, self.truth.robot.wheels),
        )
