"""ETS-VII within its flight rules: the robot, its unknowns, and the family of manoeuvres."""

from __future__ import annotations

from typing import Any

from bayesid import Kind, Model
from bayesid.design import BSplines, DOptimal, Plan, Problem, Tip
from studies.common.ets7 import ACCEL, INTERVAL, LIMITS, RATE, START, TIP
from studies.common.models import BASE_SPREAD, base_model

__all__ = ["DURATION", "INTERVAL", "POINTS", "limits_problem", "model_of"]

DURATION = 240.0
"""Length of a manoeuvre [s]."""

POINTS = 6
"""Number of free control points of every joint."""


def model_of(arm_spread: float = 0.0, spread: float = BASE_SPREAD) -> Model:
    """Return the model: base, initial rate and accelerometer bias unknown, and the arm where it has a spread.

    Parameters
    ----------
    arm_spread, spread : float
        Relative widths of the priors of the links and of the base.
    """
    return base_model({Kind.RATE: RATE, Kind.ACCEL: ACCEL}, arm_spread=arm_spread, base_spread=spread)


def limits_problem(duration: float = DURATION, points: int = POINTS, thinning: int = 4) -> Problem:
    """Return the problem: six joints on B-splines, the flight rules, the posterior's volume.

    Parameters
    ----------
    duration : float
        Length of the manoeuvre [s].
    points : int
        Number of free control points of every joint.
    thinning : int
        Number of samples of which the search simulates one.
    """
    model = model_of()
    family = BSplines(START, range(len(START)), duration, points)
    tip = Tip.of(model.robot, TIP)
    criteria: Any = (DOptimal(),)  # frozen, which the protocol's attributes are not
    return Problem(Plan(model, family, INTERVAL, tip, thinning=thinning), LIMITS, criteria)
