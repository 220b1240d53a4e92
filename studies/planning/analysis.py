"""Plan, predict, fly; identify; predict, plan again and fly."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from bayesid import Identification, InertialParameters, Manoeuvre, Model, Posterior, Recording, identify
from bayesid.design.base_prediction import BasePredictor, Prediction
from bayesid.design.pose_region import Pose
from bayesid.inference.posterior_as_prior import InertialDraws, joint_prior
from studies.common.ets7 import BASE, START, TIP, ets7
from studies.planning.world import ATTITUDE, Flown, Guess, Swing, fly, measure, model_of

__all__ = ["Case", "Flight", "Trial", "analyse", "flight_of", "identified", "plan", "predictor_of"]

Floats = NDArray[np.floating]

REACHED = np.array([0.9, -1.5, 0.3, 0.5, -0.7, 0.6])
"""Joint positions whose final pose in a true flight is the target, so that it can be reached; no planner sees them."""

ARM = 2.0
"""Length that makes a rotation error comparable with a position error [m/rad]."""


@dataclass(frozen=True)
class Flight:
    """A planned path, what was predicted of it and where it truly ended."""

    goal: Floats
    flown: Flown
    miss: float
    """Of the end-effector, from the target [m]."""
    turned: float
    """Likewise its attitude [degrees]."""


@dataclass(frozen=True)
class Trial:
    """A prediction of a flight beside the truth: errors of the mean, and whether the 95 % regions hold the truth."""

    title: str
    prediction: Prediction
    errors: Mapping[str, tuple[float, float]]
    """base, tip: position [mm], rotation [degrees]."""
    inside: Mapping[str, tuple[bool, bool]]

    def pose(self, body: str) -> Pose:
        """Predicted final pose of ``base`` or ``tip``."""
        return (self.prediction.base if body == "base" else self.prediction.tip).pose()


@dataclass(frozen=True)
class Case:
    """One guess of the base and what follows from it."""

    guess: Guess
    target: tuple[Floats, Floats]
    truth: InertialParameters
    identification: Identification
    first: Flight
    again: Flight
    trials: tuple[Trial, ...]
    """The first path with the guess and as identified, and the second path as identified."""


def analyse(
    guess: Guess,
    seed: int,
    draws: int,
    effective_samples: float,
    duration: float,
    progress: Callable[[str], None],
) -> Case:
    """Plan with a guess, fly, identify, and plan again."""
    rng = np.random.default_rng(seed)
    before = model_of(guess)
    target = fly(Swing(START, REACHED, duration), duration).tip
    progress(f"{guess.title}: planning")
    predictor = predictor_of(before, Swing(START, START, duration))
    first = flight_of(plan(predictor, before, target, duration), target, duration)
    progress("identifying")
    result = identify(Posterior.of(before, [measure(seed)]), seed, effective_samples=effective_samples)
    after = identified(before, result)
    progress("planning again")
    again_predictor = predictor_of(after, Swing(START, START, duration))
    again = flight_of(plan(again_predictor, after, target, duration), target, duration)
    trials = []
    for title, model, like, flight in (
        ("first path, guessed base", before, predictor, first),
        ("first path, identified base", after, again_predictor, first),
        ("second path, identified base", after, again_predictor, again),
    ):
        swing = Swing(START, flight.goal, duration)
        trials.append(_trial(title, predictor_of(model, swing, like).predict(draws, rng), flight.flown))
    truth = ets7().link(BASE).inertial
    return Case(guess, target, truth, result, first, again, tuple(trials))


def identified(model: Model, result: Identification) -> Model:
    """Return the model whose prior is the posterior of a result."""
    prior = joint_prior(InertialDraws.of(result))
    robot = model.robot
    for name, centre in zip(prior.names, prior.centres, strict=True):
        robot = robot.with_inertial(name, centre)
    return replace(model, robot=robot, priors=prior.bodies(), mixing=prior.mixing())


def plan(predictor: BasePredictor, model: Model, target: tuple[Floats, Floats], duration: float) -> Floats:
    """Return the joint positions that bring the end-effector to a pose, with the model's base at its prior's centre."""

    def miss(goal: Floats) -> Floats:
        _, tip = predictor_of(model, Swing(START, goal, duration), predictor).courses(predictor.centre[None])
        turn = Rotation.from_quat(tip.attitude[0, -1]) * Rotation.from_quat(target[1]).inv()
        return np.concatenate([tip.position[0, -1] - target[0], ARM * turn.as_rotvec()])

    found = least_squares(miss, START, xtol=1e-10, ftol=1e-12, gtol=1e-12, max_nfev=60)
    return np.asarray(found.x)


def predictor_of(model: Model, swing: Swing, like: BasePredictor | None = None) -> BasePredictor:
    """Return the predictor of a path; ``like`` is one of the same model."""
    time = np.linspace(0.0, swing.duration, 9)
    return BasePredictor(model, Manoeuvre(Recording("path", None, time, {}), swing, ATTITUDE), TIP, like)


def flight_of(goal: Floats, target: tuple[Floats, Floats], duration: float) -> Flight:
    """Fly to a goal and measure how far from the target it ends."""
    flown = fly(Swing(START, goal, duration), duration)
    miss = float(np.linalg.norm(flown.tip[0] - target[0]))
    return Flight(goal, flown, miss, _angle(flown.tip[1], target[1]))


def _trial(title: str, prediction: Prediction, flown: Flown) -> Trial:
    poses = {"base": (prediction.base.pose(), flown.base), "tip": (prediction.tip.pose(), flown.tip)}
    errors = {
        body: (
            float(np.linalg.norm(pose.millimetres.mean - 1e3 * place)),
            _angle(pose.mean_attitude, attitude),
        )
        for body, (pose, (place, attitude)) in poses.items()
    }
    return Trial(title, prediction, errors, {body: pose.holds(*real) for body, (pose, real) in poses.items()})


def _angle(one: Floats, other: Floats) -> float:
    return float(np.degrees((Rotation.from_quat(one) * Rotation.from_quat(other).inv()).magnitude()))
