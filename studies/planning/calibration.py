"""How often the 95 % regions of a prediction hold the truth, over many guesses of the base."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesid.design.pose_region import Pose
from bayesid.robot.body_prior import coordinates_of, draw_inertial
from studies.common.ets7 import BASE, START, ets7
from studies.planning.analysis import predictor_of
from studies.planning.world import Flown, Guess, Swing, guess_about, model_of

__all__ = ["Calibration", "calibrate"]


@dataclass(frozen=True)
class Calibration:
    """How many regions held the truth: of position and of rotation, of base and of end-effector.

    Parameters
    ----------
    spread : float
        Relative width of the priors.
    guesses, draws : int
        Priors tried, and draws of each.
    base, tip : (2,) tuple
        Regions of position and rotation that held the truth.
    """

    spread: float
    guesses: int
    draws: int
    base: tuple[int, int]
    tip: tuple[int, int]


def calibrate(
    goal: NDArray[np.floating], flown: Flown, duration: float, spread: float, *, guesses: int, draws: int, seed: int
) -> Calibration:
    """Predict one path under many priors, of each of which the truth is a draw.

    Parameters
    ----------
    goal : (6,) array
        Joint positions at the path's end [rad].
    flown : Flown
        Where the path truly ended.
    duration : float
        Of the path [s].
    spread : float
        Relative width of the priors.
    guesses, draws : int
        Priors, and draws of each.
    """
    rng, truth = np.random.default_rng(seed), ets7().link(BASE).inertial
    model = model_of(Guess("truth", truth, spread))
    predictor = predictor_of(model, Swing(START, goal, duration))
    held = np.zeros((2, 2), dtype=int)
    for _ in range(guesses):
        guess = guess_about(truth, spread, rng)
        z = np.tile(predictor.centre, (draws, 1))
        # one compiled simulation serves all guesses: their draws, in coordinates about the truth
        z[:, :10] = [coordinates_of(model.priors[0], draw_inertial(guess, spread, rng)) for _ in range(draws)]
        courses = predictor.courses(z)
        for row, (trajectory, pose) in enumerate(zip(courses, (flown.base, flown.tip), strict=True)):
            held[row] += _holds(trajectory.pose(), pose)
    (base_place, base_turn), (tip_place, tip_turn) = held.tolist()
    return Calibration(spread, guesses, draws, (base_place, base_turn), (tip_place, tip_turn))


def _holds(predicted: Pose, real: tuple[NDArray[np.floating], NDArray[np.floating]]) -> NDArray[np.int_]:
    return np.array(predicted.holds(*real), dtype=int)
