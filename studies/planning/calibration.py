"""How often the 95 % regions of a prediction hold the truth, over many guesses of the base."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from bayesid.design.base_prediction import BasePredictor
from bayesid.robot.body_prior import BodyPrior, coordinates_of, draw_inertial
from studies.common.ets7 import BASE, START, ets7
from studies.common.guesses import guess_about
from studies.common.monte_carlo import Workers, run_trials
from studies.planning.analysis import Flight, predictor_of
from studies.planning.world import Flown, Guess, Swing, model_of

__all__ = ["Calibration", "calibrate"]


@dataclass(frozen=True)
class Calibration:
    """Number of regions that held the truth under priors of one width.

    Parameters
    ----------
    spread : float
        Relative width of the priors.
    guesses, draws : int
        Number of priors, and of draws of each.
    held : dict of str to (2,) tuple
        Number of regions of position and of rotation that held the truth, for ``base`` and ``tip``.
    """

    spread: float
    guesses: int
    draws: int
    held: dict[str, tuple[int, int]]


@dataclass(frozen=True)
class _Task:
    """One prediction of a path that was flown, under a prior of which the truth is a draw."""

    spread: float
    draws: int
    goal: tuple[float, ...]
    duration: float
    flown: Flown


def calibrate(
    flight: Flight,
    duration: float,
    spreads: Sequence[float],
    *,
    guesses: int,
    draws: int,
    seed: int,
    store: Path | None = None,
    workers: Workers = 1,
    progress: Callable[[str], None] = lambda text: None,
) -> tuple[Calibration, ...]:
    """Predict one path under many priors, of each of which the truth is a draw.

    Parameters
    ----------
    flight : Flight
        Path, and where it truly ended.
    duration : float
        Duration of the path [s].
    spreads : sequence of float
        Relative widths of the priors.
    guesses, draws : int
        Number of priors of each width, and of draws of each prior.
    seed, store, workers, progress
        See `studies.common.monte_carlo.run_trials`.
    """
    goal = tuple(flight.goal.tolist())
    tasks = [_Task(spread, draws, goal, duration, flight.flown) for spread in spreads for _ in range(guesses)]
    outcomes = run_trials(
        _held, tasks, store, seed=seed, workers=workers, progress=lambda text: progress(f"calibration: {text}")
    ).complete()
    rows = []
    for index, spread in enumerate(spreads):
        part = outcomes[index * guesses : (index + 1) * guesses]
        held = {body: tuple(np.sum([outcome[body] for outcome in part], axis=0).tolist()) for body in ("base", "tip")}
        rows.append(Calibration(spread, guesses, draws, held))
    return tuple(rows)


def _held(task: _Task, rng: np.random.Generator) -> dict[str, tuple[bool, bool]]:
    """Return whether the regions of position and of rotation hold the truth, for ``base`` and ``tip``."""
    truth = ets7().link(BASE).inertial
    predictor, prior = _predictor(task.spread, task.goal, task.duration)
    guess = guess_about(truth, task.spread, rng)
    z = np.tile(predictor.centre, (task.draws, 1))
    z[:, :10] = [coordinates_of(prior, draw_inertial(guess, task.spread, rng)) for _ in range(task.draws)]
    base, tip = predictor.courses(z)
    return {"base": base.pose().holds(*task.flown.base), "tip": tip.pose().holds(*task.flown.tip)}


@cache
def _predictor(spread: float, goal: tuple[float, ...], duration: float) -> tuple[BasePredictor, BodyPrior]:
    """Return a predictor about the truth, whose compiled simulation serves all guesses of a process, and its prior."""
    model = model_of(Guess("truth", ets7().link(BASE).inertial, spread))
    return predictor_of(model, Swing(START, np.array(goal), duration)), model.priors[0]
