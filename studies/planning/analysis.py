"""Plan, predict and fly; identify; predict, plan again and fly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from bayesid import Identification, InertialParameters, Manoeuvre, Model, Posterior, Recording, identify
from bayesid._math.arrays import Floats
from bayesid.design.base_prediction import BasePredictor, Prediction
from bayesid.design.knowledge_update import updated_model
from bayesid.design.pose_region import Pose
from bayesid.inference.posterior_as_prior import InertialDraws
from studies.common.ets7 import BASE, START, TIP, ets7
from studies.planning.world import ATTITUDE, Flown, FlownPose, Guess, Swing, fly, measure, model_of

__all__ = ["Case", "Flight", "Trial", "analyse", "flight_of", "plan", "predictor_of"]

REACHED = np.array([0.9, -1.5, 0.3, 0.5, -0.7, 0.6])
"""Joint positions [rad] whose final pose in a true flight is the target, so that it can be reached; no planner sees
them."""

ARM = 2.0
"""Length that makes a rotation error comparable with a position error [m/rad]."""


@dataclass(frozen=True)
class Flight:
    """A planned path and where it truly ended.

    Attributes
    ----------
    goal : (6,) array
        Joint positions at the end of the path [rad].
    flown : Flown
        Final poses of base and end-effector.
    miss : float
        Distance of the end-effector from its target [m].
    turned : float
        Angle between the attitude of the end-effector and that of its target [degrees].
    """

    goal: Floats
    flown: Flown
    miss: float
    turned: float


@dataclass(frozen=True)
class Trial:
    """A prediction beside the flight that it predicts."""

    title: str
    prediction: Prediction
    flown: Flown

    def compared(self, body: str) -> tuple[Pose, FlownPose]:
        """Return the final pose of ``base`` or ``tip``, predicted and flown."""
        return getattr(self.prediction, body).pose(), getattr(self.flown, body)

    def errors(self, body: str) -> tuple[float, float]:
        """Return the errors of the mean of the predicted pose, position [mm] and rotation [degrees]."""
        pose, (position, attitude) = self.compared(body)
        distance = np.linalg.norm(pose.millimetres.mean - 1e3 * position)
        return float(distance), float(np.linalg.norm(pose.turns(attitude)))


@dataclass(frozen=True)
class Case:
    """One guess of the base and what follows from it.

    Attributes
    ----------
    guess : Guess
        Base as the planner takes it at first.
    target : (position, attitude)
        Target of the end-effector, in orbit axes from where the base started.
    truth : InertialParameters
        True base.
    identification : Identification
        Identification of the base from one recorded manoeuvre.
    first, again : Flight
        Flights planned with the guessed and with the identified base.
    trials : tuple of Trial
        Predictions of the first path with the guess and as identified, and of the second path as identified.
    """

    guess: Guess
    target: FlownPose
    truth: InertialParameters
    identification: Identification
    first: Flight
    again: Flight
    trials: tuple[Trial, ...]


def analyse(
    guess: Guess,
    seed: int,
    draws: int,
    effective_samples: float,
    duration: float,
    progress: Callable[[str], None],
) -> Case:
    """Plan with a guess, fly, identify, and plan again; parameters as in `studies.planning.run`."""
    rng = np.random.default_rng(seed)
    before = model_of(guess)
    target = fly(Swing(START, REACHED, duration)).tip
    progress(f"{guess.title}: planning")
    predictor = predictor_of(before, Swing(START, START, duration))
    first = flight_of(plan(predictor, before, target, duration), target, duration)
    progress("identifying")
    result = identify(Posterior.of(before, [measure(seed)]), seed, effective_samples=effective_samples)
    after = updated_model(before, InertialDraws.of(result))
    progress("planning again")
    identified = predictor_of(after, Swing(START, START, duration))
    again = flight_of(plan(identified, after, target, duration), target, duration)
    trials = []
    for title, model, like, flight in (
        ("first path, guessed base", before, predictor, first),
        ("first path, identified base", after, identified, first),
        ("second path, identified base", after, identified, again),
    ):
        prediction = predictor_of(model, Swing(START, flight.goal, duration), like).predict(draws, rng)
        trials.append(Trial(title, prediction, flight.flown))
    return Case(guess, target, ets7().link(BASE).inertial, result, first, again, tuple(trials))


def plan(predictor: BasePredictor, model: Model, target: FlownPose, duration: float) -> Floats:
    """Return the joint positions that bring the end-effector to a pose, with the model's base at its prior's centre."""

    def miss(goal: Floats) -> Floats:
        _, tip = predictor_of(model, Swing(START, goal, duration), predictor).courses(predictor.centre[None])
        turn = Rotation.from_quat(tip.attitude[0, -1]) * Rotation.from_quat(target[1]).inv()
        return np.concatenate([tip.position[0, -1] - target[0], ARM * turn.as_rotvec()])

    return np.asarray(least_squares(miss, START, xtol=1e-10, ftol=1e-12, gtol=1e-12, max_nfev=60).x)


def predictor_of(model: Model, swing: Swing, like: BasePredictor | None = None) -> BasePredictor:
    """Return the predictor of a path; ``like`` is one of the same model."""
    time = np.linspace(0.0, swing.duration, 9)
    return BasePredictor(model, Manoeuvre(Recording("path", None, time, {}), swing, ATTITUDE), TIP, like)


def flight_of(goal: Floats, target: FlownPose, duration: float) -> Flight:
    """Fly to a goal and measure how far from the target the end-effector ends."""
    flown = fly(Swing(START, goal, duration))
    turn = Rotation.from_quat(flown.tip[1]) * Rotation.from_quat(target[1]).inv()
    miss = float(np.linalg.norm(flown.tip[0] - target[0]))
    return Flight(goal, flown, miss, float(np.degrees(turn.magnitude())))
