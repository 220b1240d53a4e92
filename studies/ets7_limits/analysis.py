"""Every question asked of the designed manoeuvre and of the flown one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesid import White
from bayesid.design import Found, Problem, Search, Store, optimise
from bayesid.design.design_problem import Reached
from bayesid.design.plan import Trajectory
from bayesid.design.trajectories import ParameterisedMotion
from bayesid.simulation.sensors import Noise, StarTracker
from studies.common.ets7 import ACCEL, RATE, START, FlightManoeuvre
from studies.ets7_limits.information import LONGEST, Asked, Grade, wide_posterior
from studies.ets7_limits.setting import ARM_SPREAD

__all__ = [
    "ACCELS",
    "CHECKED",
    "RATES",
    "Answer",
    "Designed",
    "Telling",
    "answers",
    "design_manoeuvre",
    "knowledge_of",
    "tell",
]

Floats = NDArray[np.floating]

RATES: dict[str, Noise] = {
    "star sensor 2″": StarTracker(2.0),
    "10⁻⁵ rad/s": White(1e-5),
    "10⁻⁶ rad/s": White(1e-6),
}

ACCELS = {"none": None, "10⁻⁴": 1e-4, "10⁻⁵": 1e-5, "10⁻⁷": 1e-7, "10⁻⁹": 1e-9}
"""Noise per sample [m/s2]."""

CHECKED = Grade(White(RATE), ACCEL)
"""Sensors of the flights in the independent simulator, and those that the manoeuvre is designed for."""


@dataclass(frozen=True)
class Designed:
    """The designed manoeuvre."""

    found: Found
    reached: list[Reached]
    trajectory: Trajectory
    motion: ParameterisedMotion


@dataclass(frozen=True)
class Answer:
    """How long it takes with some sensors, by whether the arm is known exactly and whether the bias is known.

    Attributes
    ----------
    once : float
        Largest relative standard deviation of mass and moments of inertia after one manoeuvre.
    repetitions : float
        Until 1 %; infinite where the longest time is not enough.
    floor : float
        What is left after the longest time.
    floored : bool
        Whether more time no longer helps then.
    """

    once: float
    repetitions: float
    floor: float
    floored: bool


@dataclass(frozen=True)
class Telling:
    """What one manoeuvre tells with the sensors of `CHECKED`: standard deviations of the base's ten quantities.

    prior, exact (arm known exactly) and uncertain (arm known to 5 %), each (10,).

    """

    truth: Floats
    prior: Floats
    exact: Floats
    uncertain: Floats


def design_manoeuvre(
    problem: Problem, seed: int, search: Search, store: Store, progress: Callable[[str], None]
) -> Designed:
    """Design the manoeuvre that leaves the posterior of the base the smallest volume."""
    kept = store.of("d-optimal")
    found = optimise(
        problem,
        problem.criteria[0],
        np.random.default_rng(seed),
        search,
        known=kept.known,
        keep=kept.keep,
        progress=lambda fraction, text: progress(text),
    )
    trajectory = problem.trajectory(found.parameters)
    return Designed(found, problem.reached(found.parameters), trajectory, problem.plan.family.motion(found.parameters))


def knowledge_of(designed: Designed, arm_spread: float = ARM_SPREAD) -> tuple[Asked, Asked]:
    """Return what can be asked of the designed manoeuvre and of the flight's."""
    duration = designed.motion.family.duration
    wide = wide_posterior(designed.motion, None, duration, arm_spread)
    return Asked(wide, duration), Asked(wide_posterior(FlightManoeuvre(START), wide, duration), duration)


def tell(knowledge: Asked) -> Telling:
    """Return what one manoeuvre tells."""
    exact, uncertain = (knowledge.repeated(CHECKED, known) for known in (True, False))
    return Telling(knowledge.prior.values, exact.sd(0.0), exact.sd(1.0), uncertain.sd(1.0))


def answers(
    knowledge: Asked, rates: Sequence[str], accels: Mapping[str, float | None], progress: Callable[[str], None]
) -> dict[tuple[str, str], dict[tuple[bool, bool], Answer]]:
    """Return the answers by labels of rate and accelerometer, then by (arm known, bias known)."""
    table: dict[tuple[str, str], dict[tuple[bool, bool], Answer]] = {}
    for rate in rates:
        for accel, sigma in accels.items():
            progress(f"sensors: {rate}, {accel}")
            row = {}
            for arm_known in (True, False):
                for bias_known in (False, True):
                    own = knowledge.repeated(Grade(RATES[rate], sigma, bias_known), arm_known)
                    row[arm_known, bias_known] = Answer(own.worst(1.0), own.needed(), own.worst(LONGEST), own.floored)
            table[rate, accel] = row
    return table
