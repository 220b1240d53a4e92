"""Prediction of the trajectories of base and end-effector under a planned joint motion, given what is known.

Without external force the centre of mass stays at rest. With its position k(t) in base axes and the attitude R(t) of
the base (base to orbit axes), the base moves by ``R(0) k(0) - R(t) k(t)``. The initial linear velocity is zero; any
other one adds a uniform motion. Every draw of the prior, or of a posterior used as prior, gives one trajectory of the
base and one of the end-effector.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.design.pose_trajectory import PoseTrajectory
from bayesid.inference.data import first_rate
from bayesid.inference.noise_changes import with_manoeuvres
from bayesid.inference.perturbed_posterior import trace
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import blank_channels
from bayesid.recording.recording import Recording
from bayesid.robot.kinematics import Tip
from bayesid.robot.robot import Robot
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Sensor, SensorKind, White

__all__ = ["BasePredictor", "Prediction", "base_and_tip", "predict"]

# sensor that sets the integration step, whose error stays below a hundredth of the sensor's noise [rad]
ATTITUDE = Sensor(SensorKind.ATTITUDE, White(1e-6))
INSTANTS = 121  # number of instants of a predicted trajectory, enough for a smooth curve in a figure
FEWEST = 16  # smallest number of draws from which the covariance of a region is computed


@dataclass(frozen=True)
class Prediction:
    """Posterior predictive of one manoeuvre.

    Parameters
    ----------
    name : str
        Name of the manoeuvre.
    tip_frame : str
        Name of the end-effector's frame in the URDF.
    rate : (3,) array
        Initial angular velocity of the base, base axes [rad/s].
    base, tip : PoseTrajectory
        Trajectories of the base and of the end-effector.
    """

    name: str
    tip_frame: str
    rate: Floats
    base: PoseTrajectory
    tip: PoseTrajectory

    def to_dict(self) -> dict[str, Any]:
        """Return the entry of the manoeuvre in prediction.json."""
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
    """Predictor of the poses of base and end-effector in one manoeuvre as functions of the unknowns.

    Parameters
    ----------
    model : Model
        Model whose priors are propagated; its sensors are ignored.
    manoeuvre : Manoeuvre
        Joint motion, which is taken as exact, and initial attitude. The initial rate is that of the first samples of
        the rate sensor if they exist and the model's initial rate is unknown, and zero otherwise. Known torques and
        momenta of the wheels act; a known force would move the centre of mass and is refused.
    tip_frame : str, optional
        Frame of the end-effector in the URDF, by default the last link.
    like : BasePredictor, optional
        Predictor of the same model whose compiled functions and integration step are shared.
    """

    def __init__(
        self, model: Model, manoeuvre: Manoeuvre, tip_frame: str | None = None, like: BasePredictor | None = None
    ) -> None:
        self.name, self.tip_frame = manoeuvre.recording.name, tip_frame or _last_link(model.robot)
        planned = replace(manoeuvre, recording=_planned(manoeuvre.recording), motion=_Exact(manoeuvre.motion))
        if like is None:
            self.posterior = Posterior.of(_moved_alone(model), [planned])
        else:
            self.posterior = with_manoeuvres(like.posterior, [planned])
        self.rate = _first_rate(model, manoeuvre.recording)
        self.time = planned.recording.time
        self._tip = Tip.of(model.robot, self.tip_frame).motion(model.robot, manoeuvre.motion.evaluate(self.time))[0]

    def draw(self, count: int, rng: np.random.Generator) -> Floats:
        """Return draws of the prior in which the initial rate is the known one, shape (count, size).

        Parameters
        ----------
        count : int
            Number of draws.
        rng : numpy.random.Generator
            Source of the draws.
        """
        z = rng.normal(size=(count, self.posterior.size))
        rates = self.posterior.unknowns.layout.all_rates
        z[:, rates] = self.centre[rates]
        return z

    def predict(self, draws: int, rng: np.random.Generator) -> Prediction:
        """Return the prediction from a number of draws of the prior.

        Parameters
        ----------
        draws : int
            Number of draws, at least 16.
        rng : numpy.random.Generator
            Source of the draws.
        """
        if draws < FEWEST:
            raise InputError(
                f"{draws} draws are too few for a region", remedy=f"Use {FEWEST} or more; several hundred are typical"
            )
        return Prediction(self.name, self.tip_frame, self.rate, *self.courses(self.draw(draws, rng)))

    @property
    def centre(self) -> Floats:
        """The prior's centre, with the known initial rate, shape (size,)."""
        unknowns = self.posterior.unknowns
        z = unknowns.coordinates([body.centre for body in unknowns.bodies], self.rate[None])
        z[unknowns.layout.all_bodies] = 0.0
        return z

    def courses(self, z: Floats) -> tuple[PoseTrajectory, PoseTrajectory]:
        """Return the trajectories of base and end-effector at many points of the unknowns, shape (n, size)."""
        instants = [trace(self.posterior, point, self.posterior.data.arrays).sample for point in z]
        count = len(self.time)
        com = np.stack([np.asarray(instant.body.com)[0, :count] for instant in instants])
        turn = np.stack([np.asarray(instant.attitude)[0, :count] for instant in instants])
        base, tip = base_and_tip(turn, com, self._tip[:, :3, 3])
        return (
            PoseTrajectory(self.time, base, _quaternions(turn)),
            PoseTrajectory(self.time, tip, _quaternions(turn @ self._tip[:, :3, :3])),
        )


def base_and_tip(turn: Floats, com: Floats, tip: Floats) -> tuple[Floats, Floats]:
    """Return the positions of base and end-effector from the start of the base, orbit axes, without external force.

    Parameters
    ----------
    turn : (..., T, 3, 3) array
        Attitude of the base, base to orbit axes.
    com : (..., T, 3) array
        Centre of mass of the robot, base axes [m].
    tip : (T, 3) array
        End-effector, base axes [m].
    """
    place = np.einsum("...ij,...j->...i", turn, com)
    base = place[..., :1, :] - place
    return base, base + np.einsum("...ij,...j->...i", turn, tip)


def predict(
    model: Model, manoeuvre: Manoeuvre, rng: np.random.Generator, *, draws: int = 500, tip_frame: str | None = None
) -> Prediction:
    """Predict the trajectories of base and end-effector in a manoeuvre under the prior of a model.

    Parameters
    ----------
    model, manoeuvre, tip_frame
        Parameters of `BasePredictor`.
    rng : numpy.random.Generator
        Source of the draws.
    draws : int
        Number of draws of the prior.
    """
    return BasePredictor(model, manoeuvre, tip_frame).predict(draws, rng)


def _last_link(robot: Robot) -> str:
    """Return the name of the last link of the robot, without loads."""
    return [name for name in robot.links if name not in robot.loads][-1]


class _Exact:
    """Joint motion without its uncertainty."""

    def __init__(self, motion: Any) -> None:
        self.evaluate = motion.evaluate


def _moved_alone(model: Model) -> Model:
    """Return the model with the sensor of a prediction, without effects on the readings of others alone."""
    moving = [
        effect
        for effect in model.without_torque.effects
        if not effect.uses("read") or effect.uses("wrench") or effect.uses("momentum")
    ]
    return replace(model.without_torque, sensors=(ATTITUDE,), effects=tuple(moving))


def _planned(recording: Recording) -> Recording:
    """Return a recording of the known actions alone, with placeholder samples of the attitude.

    It has the times of the given recording, or `INSTANTS` even ones where there are no actions.
    """
    if any(np.nan_to_num(recording.channels.get(f"base_force.{axis}", np.zeros(1))).any() for axis in "xyz"):
        problem = "a known force acts on the base and moves the centre of mass"
        remedy = "Predict manoeuvres without thrust"
        raise InputError(problem, file=recording.file or recording.name, place="column base_force.x|y|z", remedy=remedy)
    known = {key: recording.channels[key] for key in recording.channels if key.startswith(("base_t", "wheel_"))}
    time = recording.time if known else np.linspace(0.0, recording.time[-1], INSTANTS)
    if time[0] > 0.0:
        time = np.concatenate([[0.0], time])
        known = {key: np.concatenate([[np.nan], values]) for key, values in known.items()}
    return Recording(recording.name, None, time, {**known, **blank_channels((ATTITUDE,), len(time))})


def _first_rate(model: Model, recording: Recording) -> Floats:
    sensor = model.sensor(SensorKind.RATE)
    if model.rate_sigma == 0.0 or sensor is None or "rate.x" not in recording.channels:
        return np.zeros(3)
    return first_rate(sensor, recording.vector("rate")[1])


def _quaternions(turn: Floats) -> Floats:
    if not np.isfinite(turn).all():
        problem = "some draws of the prior give no finite motion: it contains bodies that would spin extremely fast"
        remedy = "Take the posterior of an identification as prior (unknowns.posterior), or a narrower spread"
        raise InputError(problem, place="unknowns.spread", remedy=remedy)
    return Rotation.from_matrix(turn.reshape(-1, 3, 3)).as_quat().reshape(*turn.shape[:2], 4)
