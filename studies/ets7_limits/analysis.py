"""Evaluation of the designed manoeuvre and of the flown one with many sensors."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bayesid import White
from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.design.trajectories import ParameterisedMotion
from bayesid.recording.joint_motion import Motion
from bayesid.simulation.sensors import Noise, StarTracker
from studies.common import mission
from studies.common.ets7 import ACCEL, RATE
from studies.common.quantities import JUDGED
from studies.ets7_limits.information import LONGEST, Grade, ManoeuvreInformation, wide_posterior

__all__ = ["ACCELS", "DESIGN", "RATES", "USUAL", "Answer", "Widths", "answers", "designed_motion", "information_of"]
__all__ += ["read_rows", "widths"]

# noise of the rate sensors by label
RATES: dict[str, Noise] = {
    "star sensor 2″": StarTracker(2.0),
    "10⁻⁵ rad/s": White(1e-5),
    "10⁻⁶ rad/s": White(1e-6),
}

# noise per sample of the accelerometers by label [m/s2]
ACCELS = {"none": None, "10⁻⁴": 1e-4, "10⁻⁵": 1e-5, "10⁻⁷": 1e-7, "10⁻⁹": 1e-9}

USUAL = Grade(White(RATE), ACCEL)  # sensors of the mission, for which the manoeuvre was designed
DESIGN = "d-optimal"  # manoeuvre of `studies.excitation` that is taken


@dataclass(frozen=True)
class Answer:
    """Time that an accuracy takes with some sensors."""

    once: float  # largest relative standard deviation of mass and moments of inertia after one manoeuvre
    repetitions: float  # number of repetitions until 1 %; infinite where the longest time is not enough
    floor: float  # largest relative standard deviation after the longest time
    floored: bool  # whether no time is enough


@dataclass(frozen=True)
class Widths:
    """Standard deviations of the base's ten quantities from one manoeuvre with the mission's sensors."""

    truth: Floats  # (10,): true quantities
    prior: Floats  # (10,): standard deviations before the manoeuvre
    # (10,): standard deviations after it with the arm known exactly, and with the arm known to 5 %
    exact: Floats
    uncertain: Floats

    def worst(self, known: bool) -> float:
        """Return the largest relative standard deviation of mass and moments."""
        return float(((self.exact if known else self.uncertain)[JUDGED] / self.truth[JUDGED]).max())


def read_rows(file: Path) -> list[dict[str, str]]:
    """Return the rows of a table that another study has written beside its report.

    Raises
    ------
    InputError
        If there is no such file.
    """
    if not file.is_file():
        raise InputError("the table is missing", file=file, remedy="Run python -m studies.excitation first")
    with file.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def designed_motion(file: Path) -> ParameterisedMotion:
    """Return the d-optimal manoeuvre that `studies.excitation` has found, from the table that it wrote."""
    row = next(row for row in read_rows(file) if row["manoeuvre"] == DESIGN)
    names = [name for name in row if name != "manoeuvre"]
    family = mission.splines(len(names) // 6)
    return family.motion(np.array([float(row[name]) for name in family.names]))


def information_of(motion: Motion) -> dict[str, ManoeuvreInformation]:
    """Return the information of the designed manoeuvre and of the flight's, by name."""
    posteriors = {"designed": wide_posterior(motion), "flight": wide_posterior(mission.flight_manoeuvre())}
    return {name: ManoeuvreInformation(posterior) for name, posterior in posteriors.items()}


def widths(information: ManoeuvreInformation) -> Widths:
    """Return the standard deviations from one manoeuvre."""
    exact, uncertain = (information.repeated(USUAL, known) for known in (True, False))
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
