"""Where a planned joint motion takes the base and the end-effector, given what is known of the robot.

Without external force the centre of mass stays at rest: with k(t) its place in base axes and R(t) the attitude of the
base (base to orbit axes), the base moves by ``R(0) k(0) - R(t) k(t)``. The initial linear velocity is zero; another
only adds to it. Every draw of the prior, or of a posterior that is the prior, gives one course of both.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.design.pose_trajectory import PoseTrajectory
from bayesid.inference.noise_changes import with_manoeuvres
from bayesid.inference.perturbed_posterior import trace
from bayesid.inference.posterior import Posterior
from bayesid.inference.recorded_samples import first_rate
from bayesid.inference.simulated_recordings import blank_channels
from bayesid.recording.recording import Recording
from bayesid.robot.end_effector import Tip
from bayesid.robot.robot import Robot
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Kind, Sensor, White

__all__ = ["BasePredictor", "Prediction", "last_link", "predict"]

ATTITUDE = Sensor(Kind.ATTITUDE, White(1e-6))
"""Fixes the integration step: its error is below a hundredth of this angle [rad]."""

INSTANTS = 121
"""At which the course is given."""


FEWEST = 16
"""Draws."""


@dataclass(frozen=True)
class Prediction:
    """Posterior predictive of one manoeuvre.

    Parameters
    ----------
    name : str
        Of the manoeuvre.
    tip_frame : str
    rate : (3,) array
        Initial rate, base axes [rad/s].
    base, tip : Course
    """

    name: str
    tip_frame: str
    rate: Floats
    base: PoseTrajectory
    tip: PoseTrajectory

    def to_dict(self) -> dict[str, Any]:
        """Content of one recording in prediction.json."""
        return {
            "name": self.name,
            "duration": float(self.base.time[-1]),
            "draws": len(self.base.position),
            "tip_frame": self.tip_frame,
            "initial_rate": {"value": self.rate.tolist(), "unit": "rad/s"},
            "base": self.base.to_dict(),
            "tip": self.tip.to_dict(),
        }


class BasePredictor:
    """Base and end-effector of one manoeuvre as functions of the unknowns.

    Parameters
    ----------
    model : Model
        Its sensors play no part.
    manoeuvre : Manoeuvre
        Joint motion, taken as exact, and initial attitude. The initial rate is that of the first samples of the rate
        sensor if there are any and the model has it unknown, and zero otherwise. Known torques and momenta of the
        wheels act; a known force would move the centre of mass and is refused.
    tip_frame : str, optional
        Frame of the URDF; the last link where left out.
    like : Predictor, optional
        Of the same model; its compiled functions and integration step are shared.
    """

    def __init__(
        self, model: Model, manoeuvre: Manoeuvre, tip_frame: str | None = None, like: BasePredictor | None = None
    ) -> None:
        self.name, self.tip_frame = manoeuvre.recording.name, tip_frame or last_link(model.robot)
        planned = replace(manoeuvre, recording=_planned(manoeuvre.recording), motion=_Exact(manoeuvre.motion))
        if like is None:
            self.posterior = Posterior.of(replace(model.without_torque, sensors=(ATTITUDE,)), [planned])
        else:
            self.posterior = with_manoeuvres(like.posterior, [planned])
        self.rate = _first_rate(model, manoeuvre.recording)
        self.time = planned.recording.time
        self._tip = Tip.of(model.robot, self.tip_frame).motion(model.robot, manoeuvre.motion.evaluate(self.time))[0]

    def draw(self, count: int, rng: np.random.Generator) -> Floats:
        """Draw from the prior; the initial rate is the known one, shape (count, size)."""
        z = rng.normal(size=(count, self.posterior.size))
        rates = self.posterior.unknowns.layout.all_rates
        z[:, rates] = self.centre[rates]
        return z

    def predict(self, draws: int, rng: np.random.Generator) -> Prediction:
        """Predict with so many draws of the prior."""
        if draws < FEWEST:
            raise InputError(f"{draws} draws give no region", remedy=f"Ask for {FEWEST} or more; hundreds are usual")
        return Prediction(self.name, self.tip_frame, self.rate, *self.courses(self.draw(draws, rng)))

    @property
    def centre(self) -> Floats:
        """The prior's centre, with the known initial rate, shape (size,)."""
        unknowns = self.posterior.unknowns
        z = unknowns.coordinates([body.centre for body in unknowns.bodies], self.rate[None])
        z[unknowns.layout.all_bodies] = 0.0
        return z

    def courses(self, z: Floats) -> tuple[PoseTrajectory, PoseTrajectory]:
        """Return the courses of base and end-effector at many points, shape (n, size)."""
        moments = [trace(self.posterior, point, self.posterior.data.arrays).sample for point in z]
        count = len(self.time)
        com = np.stack([np.asarray(instant.body.com)[0, :count] for instant in moments])
        turn = np.stack([np.asarray(instant.attitude)[0, :count] for instant in moments])
        place = np.einsum("ntij,ntj->nti", turn, com)
        base = place[:, :1] - place
        tip = base + np.einsum("ntij,tj->nti", turn, self._tip[:, :3, 3])
        return (
            PoseTrajectory(self.time, base, _quaternions(turn)),
            PoseTrajectory(self.time, tip, _quaternions(turn @ self._tip[:, :3, :3])),
        )


def predict(
    model: Model,
    manoeuvre: Manoeuvre,
    rng: np.random.Generator,
    *,
    draws: int = 500,
    tip_frame: str | None = None,
) -> Prediction:
    """Predict where a manoeuvre takes base and end-effector under the prior of a model.

    Parameters
    ----------
    model, manoeuvre, tip_frame
        See `BasePredictor`.
    draws : int
        Of the prior.
    """
    return BasePredictor(model, manoeuvre, tip_frame).predict(draws, rng)


def last_link(robot: Robot) -> str:
    """Return the last link of the robot's chain, loads not counted."""
    return [name for name in robot.links if name not in robot.loads][-1]


class _Exact:
    """A joint motion without its uncertainty."""

    def __init__(self, motion: Any) -> None:
        self.evaluate = motion.evaluate


def _planned(recording: Recording) -> Recording:
    """Return the known actions of a recording, on its times or fewer, with a blank attitude."""
    if any(np.nan_to_num(recording.channels.get(f"base_force.{axis}", np.zeros(1))).any() for axis in "xyz"):
        raise InputError(
            "a known force acts on the base, and moves the centre of mass",
            file=recording.file or recording.name,
            place="column base_force.x|y|z",
            remedy="Predict manoeuvres without thrust",
        )
    known = {key: recording.channels[key] for key in recording.channels if key.startswith(("base_t", "wheel_m"))}
    time = recording.time if known else np.linspace(0.0, recording.time[-1], INSTANTS)
    if time[0] > 0.0:
        time = np.concatenate([[0.0], time])
        known = {key: np.concatenate([[np.nan], values]) for key, values in known.items()}
    return Recording(recording.name, None, time, {**known, **blank_channels((ATTITUDE,), len(time))})


def _first_rate(model: Model, recording: Recording) -> Floats:
    sensor = model.sensor(Kind.RATE)
    if model.rate_sigma == 0.0 or sensor is None or "rate.x" not in recording.channels:
        return np.zeros(3)
    return first_rate(sensor, recording.vector("rate")[1])


def _quaternions(turn: Floats) -> Floats:
    return Rotation.from_matrix(turn.reshape(-1, 3, 3)).as_quat().reshape(*turn.shape[:2], 4)
