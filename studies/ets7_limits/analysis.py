"""Evaluation of the designed manoeuvre and of the flown one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayesid import White
from bayesid._math.arrays import Floats
from bayesid.design import Found, Problem, Search, Store, optimise
from bayesid.design.design_problem import Reached
from bayesid.design.plan import Trajectory
from bayesid.design.trajectories import ParameterisedMotion
from bayesid.simulation.sensors import Noise, StarTracker
from studies.common.ets7 import ACCEL, RATE, START, FlightManoeuvre
from studies.common.models import ARM_SPREAD
from studies.common.quantities import JUDGED
from studies.ets7_limits.information import LONGEST, Grade, ManoeuvreInformation, wide_posterior

__all__ = ["ACCELS", "CHECKED", "RATES", "Answer", "Designed", "Widths", "answers", "design_manoeuvre"]
__all__ += ["information_of", "widths"]

RATES: dict[str, Noise] = {
    "star sensor 2″": StarTracker(2.0),
    "10⁻⁵ rad/s": White(1e-5),
    "10⁻⁶ rad/s": White(1e-6),
}
"""Noise of the rate sensors by label."""

ACCELS = {"none": None, "10⁻⁴": 1e-4, "10⁻⁵": 1e-5, "10⁻⁷": 1e-7, "10⁻⁹": 1e-9}
"""Noise per sample of the accelerometers by label [m/s2]."""

CHECKED = Grade(White(RATE), ACCEL)
"""Sensors of the flights in the independent simulator, and those that the manoeuvre is designed for."""


@dataclass(frozen=True)
class Designed:
    """The designed manoeuvre.

    Attributes
    ----------
    optimum : Found
        Outcome of the search.
    reached : list of Reached
        Limits and the largest values along the manoeuvre.
    trajectory : Trajectory
        Motion of joints, tip and base.
    motion : ParameterisedMotion
        Motion of the joints.
    """

    optimum: Found
    reached: list[Reached]
    trajectory: Trajectory
    motion: ParameterisedMotion


@dataclass(frozen=True)
class Answer:
    """Time that an accuracy takes with some sensors.

    Attributes
    ----------
    once : float
        Largest relative standard deviation of mass and moments of inertia after one manoeuvre.
    repetitions : float
        Number of repetitions until 1 %; infinite where the longest time is not enough.
    floor : float
        Largest relative standard deviation after the longest time.
    floored : bool
        Whether more time no longer helps then.
    """

    once: float
    repetitions: float
    floor: float
    floored: bool


@dataclass(frozen=True)
class Widths:
    """Standard deviations of the base's ten quantities from one manoeuvre with the sensors of `CHECKED`.

    Attributes
    ----------
    truth : (10,) array
        True quantities.
    prior : (10,) array
        Standard deviations before the manoeuvre.
    exact, uncertain : (10,) array
        Standard deviations after it with the arm known exactly, and with the arm known to 5 %.
    """

    truth: Floats
    prior: Floats
    exact: Floats
    uncertain: Floats

    @property
    def worst(self) -> float:
        """Largest relative standard deviation of mass and moments with the arm known exactly."""
        return float((self.exact[JUDGED] / self.truth[JUDGED]).max())


def design_manoeuvre(
    problem: Problem, seed: int, search: Search, store: Store, progress: Callable[[str], None]
) -> Designed:
    """Design the manoeuvre that leaves the posterior of the base the smallest volume."""
    kept = store.of("d-optimal")
    optimum = optimise(
        problem,
        problem.criteria[0],
        np.random.default_rng(seed),
        search,
        known=kept.known,
        keep=kept.keep,
        progress=lambda fraction, text: progress(text),
    )
    parameters = optimum.parameters
    motion = problem.plan.family.motion(parameters)
    return Designed(optimum, problem.reached(parameters), problem.trajectory(parameters), motion)


def information_of(
    designed: Designed, arm_spread: float = ARM_SPREAD
) -> tuple[ManoeuvreInformation, ManoeuvreInformation]:
    """Return the information of the designed manoeuvre and of the flight's."""
    duration = designed.motion.family.duration
    wide = wide_posterior(designed.motion, None, duration, arm_spread)
    flown = wide_posterior(FlightManoeuvre(START), wide, duration)
    return ManoeuvreInformation(wide), ManoeuvreInformation(flown)


def widths(information: ManoeuvreInformation) -> Widths:
    """Return the standard deviations from one manoeuvre."""
    exact, uncertain = (information.repeated(CHECKED, known) for known in (True, False))
    return Widths(information.prior.values, exact.sd(0.0), exact.sd(1.0), uncertain.sd(1.0))


def answers(
    information: ManoeuvreInformation,
    rates: Sequence[str],
    accels: Mapping[str, float | None],
    progress: Callable[[str], None],
) -> dict[tuple[str, str], dict[tuple[bool, bool], Answer]]:
    """Return the answers by labels of rate and accelerometer, then by (arm known, bias known)."""
    table: dict[tuple[str, str], dict[tuple[bool, bool], Answer]] = {}
    for rate in rates:
        for accel, sigma in accels.items():
            progress(f"sensors: {rate}, {accel}")
            row = {}
            for arm_known in (True, False):
                for bias_known in (False, True):
                    case = information.repeated(Grade(RATES[rate], sigma, bias_known), arm_known)
                    row[arm_known, bias_known] = Answer(
                        case.worst(1.0), case.needed(), case.worst(LONGEST), case.floored
                    )
            table[rate, accel] = row
    return table
