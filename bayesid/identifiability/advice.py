"""Advice on what to measure, know or move in addition; each candidate turns one experiment into another.

Candidates are ranked by what they would tell of the directions that are known worst.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from bayesid._io.errors import InputError
from bayesid._io.progress import Progress
from bayesid._math.arrays import Floats
from bayesid.identifiability.directions import Direction
from bayesid.identifiability.hypothetical_experiment import (
    FINEST,
    TYPICAL,
    Experiment,
    InformationPredictor,
    rescaled,
    scaled,
    typical_torque,
)
from bayesid.identifiability.local_knowledge import Knowledge
from bayesid.recording.actions import Actions
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.recording import Recording
from bayesid.recording.wheel_motion import WheelMotion
from bayesid.robot.composite_tables import composite_rows
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.robot import Robot
from bayesid.simulation.joint_torques import TorqueSensor
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Sensor, SensorKind

__all__ = ["WORST", "AddedMeasurement", "Advice", "NotEvaluated", "Swung", "advise", "candidates"]

WORST = 3
"""Number of directions, from the worst known, that the advice evaluates."""

KNOWN_MASS = 0.01  # relative standard deviation of a mass that counts as known
# acceleration [m/s2] and angular acceleration [rad/s2] of the whole robot by a pulse of thrust and of torque
THRUST, TURN = 1e-3, 1e-4
SPIN = 2e-3  # change of the robot's angular velocity by a pulse of the wheels [rad/s]
SWING = {"rad": 0.5, "m": 0.2}  # amplitude of an added swing of a revolute joint [rad] and of a prismatic one [m]
SHARE = 0.9  # largest fraction of a joint's speed limit that an added swing may reach, so that it keeps a margin
# bounds of the three parts of a pulse, one part for each axis, as fractions of the manoeuvre's duration
PARTS = (0.35, 0.45, 0.55, 0.65)


@dataclass(frozen=True)
class Advice:
    """Predicted effect of one candidate."""

    #: name and description of the candidate
    name: str
    text: str
    #: ratios of posterior to prior standard deviation in the presently worst directions
    directions: tuple[float, ...] = ()
    parameter: str = ""  #: name of the presently worst known quantity
    sd: float = np.nan  #: standard deviation that the quantity would have, in its unit
    #: shrinkage that the quantity would have, one minus the ratio of posterior to prior standard deviation
    shrinkage: float = np.nan
    information: float = np.nan  #: information gained on all quantities beyond what is known now [nats]
    reason: str = ""  #: reason why the candidate was not evaluated; empty if it was

    def to_dict(self) -> dict[str, Any]:
        """Return the advice as it stands in identifiability.json."""
        if self.reason:
            return {"name": self.name, "text": self.text, "evaluated": False, "reason": self.reason}
        return {
            "name": self.name,
            "text": self.text,
            "evaluated": True,
            "worst_directions": list(self.directions),
            "worst_parameter": {"name": self.parameter, "sd": self.sd, "shrinkage": self.shrinkage},
            "information": self.information,
        }


def advise(
    predictor: InformationPredictor,
    candidates: Sequence[AddedMeasurement],
    worst: Sequence[Direction],
    now: Knowledge,
    progress: Progress,
) -> list[Advice]:
    """Evaluate candidates at the predictor's linearisation point, and return the most informative first.

    Candidates are ranked by the predicted width of the presently worst direction, then by the information gained.

    Parameters
    ----------
    predictor : InformationPredictor
        Predictor of what an experiment tells.
    candidates : sequence of AddedMeasurement
        Candidates to evaluate, each alone.
    worst : sequence of Direction
        Directions as known now, the worst first.
    now : Knowledge
        Present knowledge of the bodies' quantities.
    progress : Progress
        Receiver of the fraction done.
    """
    advice = []
    for number, candidate in enumerate(candidates):
        progress(number / len(candidates), candidate.text)
        try:
            known = predictor.knowledge(candidate.change(predictor.flown))
        except (NotEvaluated, InputError) as error:
            advice.append(Advice(candidate.name, candidate.text, reason=str(error)))
            continue
        advice.append(_of(candidate, known, worst, now))
    return sorted(advice, key=lambda one: (bool(one.reason), one.directions[:1], -one.information))


def _of(candidate: AddedMeasurement, known: Knowledge, worst: Sequence[Direction], now: Knowledge) -> Advice:
    index = int(np.argmin(now.shrinkage))
    ratios = tuple(float(np.linalg.norm(one.weights @ known.factor)) / one.prior_sd for one in worst[:WORST])
    return Advice(
        name=candidate.name,
        text=candidate.text,
        directions=ratios,
        parameter=known.names[index],
        sd=float(known.sd[index]),
        shrinkage=float(known.shrinkage[index]),
        information=_half_log_det(now) - _half_log_det(known),
    )


def _half_log_det(knowledge: Knowledge) -> float:
    """Return half the logarithm of the determinant of the covariance relative to that of the prior."""
    relative = np.linalg.solve(knowledge.prior_factor, knowledge.factor)
    return float(np.log(np.linalg.svd(relative, compute_uv=False)).sum())


class NotEvaluated(Exception):  # noqa: N818 - a verdict, not an error
    """Verdict that a candidate does not apply; the message says why."""


@dataclass(frozen=True)
class AddedMeasurement:
    """One candidate for a measurement, a motion or knowledge to add to an experiment."""

    name: str  #: short, unique name
    text: str  #: description with the candidate's figures
    #: function that returns the changed experiment; it raises `NotEvaluated` where the candidate does not apply
    change: Callable[[Experiment], Experiment]


def candidates(model: Model) -> list[AddedMeasurement]:
    """Return all candidates for a model."""
    mass, inertia = _whole(model.robot)
    force, torque, spin = _round(THRUST * mass), _round(TURN * inertia), _round(SPIN * inertia)
    declared = {sensor.kind: sensor for sensor in model.sensors}
    each = "x, y and z in turn, each for a tenth of the manoeuvre"
    additions = [
        AddedMeasurement(
            f"better-{kind.value}", f"{kind.value} sensor with a tenth of its noise", partial(_better, kind)
        )
        for kind in declared
    ]
    additions += [
        AddedMeasurement(
            f"add-{kind.value}",
            f"added {kind.value} sensor of {float(sensor.noise.sigma(1.0)[0]):g} {kind.unit} per sample"
            + (" at the base origin" if kind is SensorKind.ACCEL else ""),
            partial(_added, sensor),
        )
        for kind, sensor in TYPICAL.items()
        if kind not in declared
    ]
    if model.torque is not None:
        text = "torque sensors with a tenth of their noise"
        additions.append(AddedMeasurement("better-torque", text, partial(_torqued, rescaled(model.torque, FINEST))))
    elif (torques := typical_torque(model)) is not None:
        text = f"added torque sensors of {torques.sigma[0]:g} N m per sample in all joints, with known friction"
        additions.append(AddedMeasurement("add-torque", text, partial(_torqued, torques)))
    additions += [
        AddedMeasurement(
            f"known-mass:{body.name}", f"mass of {body.name} known with 1 % uncertainty", partial(_weighed, body.name)
        )
        for body in model.bodies
    ]
    return [
        *additions,
        AddedMeasurement(
            "thrust", f"known thrust of {force:g} N along {each}", partial(_with_pulses, np.array([force, 0.0]))
        ),
        AddedMeasurement(
            "torque", f"known torque of {torque:g} N m about {each}", partial(_with_pulses, np.array([0.0, torque]))
        ),
        AddedMeasurement(
            "wheels", f"known wheel momentum up to {spin:g} N m s about {each}", partial(_spun_up, model.robot, spin)
        ),
        AddedMeasurement("twice", "every manoeuvre flown twice", lambda experiment: replace(experiment, times=2)),
        *(
            AddedMeasurement(
                f"swing:{joint.name}",
                f"added swing of {joint.name} by {SWING[joint.unit]:g} {joint.unit} and back",
                partial(_swung, model.robot, index),
            )
            for index, joint in enumerate(model.robot.joints)
        ),
    ]


# ---- sensors and knowledge ----


def _better(kind: SensorKind, experiment: Experiment) -> Experiment:
    changed = (scaled(sensor, FINEST) if sensor.kind is kind else sensor for sensor in experiment.sensors)
    return replace(experiment, sensors=tuple(changed))


def _added(sensor: Sensor, experiment: Experiment) -> Experiment:
    return replace(experiment, sensors=(*experiment.sensors, sensor))


def _torqued(sensor: TorqueSensor, experiment: Experiment) -> Experiment:
    return replace(experiment, torque=sensor)


def _weighed(body: str, experiment: Experiment) -> Experiment:
    return replace(experiment, weighed=(*experiment.weighed, (body, KNOWN_MASS)))


# ---- actions on the base ----


def _with_pulses(size: Floats, experiment: Experiment) -> Experiment:
    """Return the experiment with pulses of force and torque of the two sizes [N, N m] in every manoeuvre."""
    return replace(experiment, manoeuvres=tuple(_with_wrench(flown, size) for flown in experiment.manoeuvres))


def _with_wrench(manoeuvre: Manoeuvre, size: Floats) -> Manoeuvre:
    recording = manoeuvre.recording
    part = np.searchsorted(np.array(PARTS) * recording.time[-1], recording.time, side="right")
    pulse = np.stack([part == number for number in (1, 2, 3)], axis=1).astype(float)
    wrench = Actions.from_recording(recording).zero_order_hold(recording.time)
    wrench = wrench + np.concatenate([size[0] * pulse, size[1] * pulse], axis=1)
    # a value holds until the next one, so only changes are recorded; each of them ends an integration step
    changes = np.concatenate([[True], np.any(np.diff(wrench, axis=0) != 0.0, axis=1)])
    rows = np.where(changes[:, None], wrench, np.nan)
    return _with_channels(manoeuvre, {"base_force": rows[:, :3], "base_torque": rows[:, 3:]})


def _spun_up(robot: Robot, size: float, experiment: Experiment) -> Experiment:
    return replace(experiment, manoeuvres=tuple(_with_wheels(robot, flown, size) for flown in experiment.manoeuvres))


def _with_wheels(robot: Robot, manoeuvre: Manoeuvre, size: float) -> Manoeuvre:
    """Return the manoeuvre with pulses of the wheels, of the robot's own one after the other where it has some."""
    recording = manoeuvre.recording
    ends = np.array(PARTS) * recording.time[-1]
    phase = (recording.time[:, None] - ends[:3]) / np.diff(ends)
    bump = size * np.sin(np.pi * np.clip(phase, 0.0, 1.0)) ** 2
    if robot.wheels:
        speeds = WheelMotion.from_recording(recording, robot.wheels).speed_channels(recording.time)
        for index, (wheel, column) in enumerate(zip(robot.wheels, speeds, strict=True)):
            speeds[column] = speeds[column] + bump[:, index % 3] / wheel.inertia
        spun = Recording(recording.name, recording.file, recording.time, {**recording.channels, **speeds})
        return replace(manoeuvre, recording=spun)
    momentum = Actions.from_recording(recording).wheels(recording.time)[0] + bump
    return _with_channels(manoeuvre, {"wheel_momentum": momentum})


def _with_channels(manoeuvre: Manoeuvre, families: dict[str, Floats]) -> Manoeuvre:
    recording = manoeuvre.recording
    added = {
        f"{family}.{axis}": values[:, column]
        for family, values in families.items()
        for column, axis in enumerate("xyz")
    }
    channels = {**recording.channels, **added}
    return replace(manoeuvre, recording=Recording(recording.name, recording.file, recording.time, channels))


# ---- joint motion ----


@dataclass(frozen=True)
class Swung(MeasuredMotion):
    """Measured motion with an added swing ``amplitude sin^4(pi t / duration)`` of one joint.

    Parameters
    ----------
    index : int
        Index of the joint that swings.
    amplitude : float
        Amplitude of the swing [rad, m].
    duration : float
        Duration of the swing [s].
    """

    index: int = 0
    amplitude: float = 0.0
    duration: float = 1.0

    def evaluate(self, time: Floats) -> JointState:
        """Return the joint state at the times, shape (T,)."""
        state = super().evaluate(time)
        rate = np.pi / self.duration
        s, c = np.sin(rate * np.asarray(time)), np.cos(rate * np.asarray(time))
        added = (s**4, 4.0 * rate * s**3 * c, 4.0 * rate**2 * (3.0 * s**2 * c**2 - s**4))
        for part, more in zip(state, added, strict=True):
            part[:, self.index] += self.amplitude * more
        return state


def _swung(robot: Robot, index: int, experiment: Experiment) -> Experiment:
    return replace(experiment, manoeuvres=tuple(_with_swing(robot, index, flown) for flown in experiment.manoeuvres))


def _with_swing(robot: Robot, index: int, manoeuvre: Manoeuvre) -> Manoeuvre:
    """Return the manoeuvre with an added swing of a joint, to whichever side the joint's range allows."""
    motion, joint, time = manoeuvre.motion, robot.joints[index], manoeuvre.recording.time
    if not isinstance(motion, MeasuredMotion):
        raise NotEvaluated("the joint motion does not come from a recording")
    for side in (1.0, -1.0):
        changed = Swung(motion.joints, motion.names, index, side * SWING[joint.unit], float(time[-1]))
        state = changed.evaluate(time)
        position, speed = state.position[:, index], np.abs(state.velocity[:, index])
        if joint.lower <= position.min() and position.max() <= joint.upper and speed.max() <= SHARE * joint.velocity:
            return replace(manoeuvre, motion=changed)
    raise NotEvaluated(f"it would exceed the range or the speed limit of {joint.name}")


# ---- sizes ----


def _whole(robot: Robot) -> tuple[float, float]:
    """Return the robot's mass [kg] and mean moment of inertia about its centre of mass [kg m2], joints at zero."""
    still = JointState(*np.zeros((3, 1, len(robot.joints))))
    row = composite_rows(robot, kinematics(robot, still))[0]
    mass, first, second = float(row[0]), row[1:4], row[10:13]
    return mass, float(2.0 / 3.0 * (second.sum() - first @ first / mass))


def _round(value: float) -> float:
    if not value > 0.0:
        raise InputError(f"mass or inertia of the robot is {value:g}", remedy="Give the links their <inertial>")
    return float(f"{value:.0e}")
