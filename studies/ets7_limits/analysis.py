"""Information of the designed and of the flown manoeuvre, for any sensors, knowledge of the arm and repetitions."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

from bayesid import Sensor, SensorKind, White
from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.design import planned_manoeuvre, planned_posterior
from bayesid.design.design_result import sample_times
from bayesid.design.trajectories import ParameterisedMotion
from bayesid.identifiability.local_knowledge import Knowledge, marginalised, triangular
from bayesid.inference.body_quantities import linearise
from bayesid.inference.noise_changes import with_sensors
from bayesid.inference.posterior import Posterior
from bayesid.recording.joint_motion import Motion
from bayesid.simulation.sensors import Noise, StarTracker
from studies.common import mission
from studies.common.ets7 import ACCEL, ACCELEROMETER, INTERVAL, RATE
from studies.common.quantities import HEADINGS, JUDGED

ABSENT = 1e3  # noise that stands for an accelerometer that is not there [m/s2]
LONGEST = 1e6  # largest number of repetitions, which take years of moving without a pause
TARGET = 0.01  # relative standard deviation to reach


@dataclass(frozen=True)
class Grade:
    """Grade of the sensors."""

    rate: Noise  # noise of the rate sensor
    accel: float | None  # noise per sample of the accelerometer [m/s2]; None where there is none
    bias_known: bool = False  # whether the accelerometer's bias is known exactly


@dataclass(frozen=True)
class Repeated:
    """Information of n repetitions of a manoeuvre."""

    # knowledge of the base's quantities before any manoeuvre, by the c unknowns that all repetitions share
    prior: Knowledge
    rows: Floats  # (c, c): rows equivalent to the whitened Jacobian of one repetition, its initial rate marginalised

    def sd(self, repetitions: float) -> Floats:
        """Return the posterior standard deviations of the base's ten quantities, in their units."""
        return self.prior.having(np.sqrt(repetitions) * self.rows).sd

    def worst(self, repetitions: float) -> float:
        """Return the largest relative standard deviation of the base's mass and three moments of inertia."""
        return float((self.sd(repetitions)[JUDGED] / self.prior.values[JUDGED]).max())

    def needed(self, target: float = TARGET) -> float:
        """Return how many repetitions, at least one, reach the target; infinite where `LONGEST` is not enough."""
        if self.worst(1.0) <= target:
            return 1.0
        if self.worst(LONGEST) > target:
            return float("inf")
        return float(np.exp(brentq(lambda n: self.worst(float(np.exp(n))) - target, 0.0, np.log(LONGEST))))

    @property
    def floored(self) -> bool:
        """Whether no number of repetitions reaches `TARGET`.

        In the end the variance is v + c / n after n repetitions; v is extrapolated from far more than `LONGEST`.
        """
        first, last = LONGEST, 100.0 * LONGEST
        limit = (last * self.worst(last) ** 2 - first * self.worst(first) ** 2) / (last - first)
        return limit > TARGET**2


@dataclass
class ManoeuvreInformation:
    """Information of a manoeuvre for any sensors."""

    posterior: Posterior  # posterior with everything unknown that a question may take as known; see `wide_posterior`
    _kept: dict[tuple[Noise, float], Floats] = field(default_factory=dict)

    def repeated(self, grade: Grade, arm_known: bool) -> Repeated:
        """Return the information of repetitions with some sensors."""
        size, names = self.posterior.size, self.posterior.unknowns.names
        rates = list(range(size))[self.posterior.unknowns.layout.all_rates]
        known = ("link",) * arm_known + ("accel-bias",) * grade.bias_known
        exact = [index for index, name in enumerate(names) if name.startswith(known)]
        once = np.concatenate([self.rows(grade), np.eye(size)[rates]])
        shared = np.delete(np.arange(size), rates)
        rows = np.delete(marginalised(once, rates), np.flatnonzero(np.isin(shared, exact)), axis=1)
        return Repeated(self.prior.fixing([*rates, *exact]), rows)

    def rows(self, grade: Grade) -> Floats:
        """Return rows equivalent to the whitened Jacobian of one manoeuvre, without prior; they are kept.

        The noise of the encoders is carried into that of the sensors.
        """
        accel = ABSENT if grade.accel is None else grade.accel
        if (grade.rate, accel) not in self._kept:
            sensors = (
                Sensor(SensorKind.RATE, grade.rate),
                Sensor(SensorKind.ACCEL, White(accel), position=ACCELEROMETER),
            )
            z = np.zeros(self.posterior.size)
            jacobian = with_sensors(self.posterior, sensors, z).jacobian(z)[: -self.posterior.size]
            self._kept[grade.rate, accel] = triangular(jacobian)
        return self._kept[grade.rate, accel]

    @cached_property
    def prior(self) -> Knowledge:
        """Knowledge of the base's quantities before any manoeuvre."""
        size = self.posterior.size
        return Knowledge(*linearise(self.posterior, np.zeros(size)), np.eye(size))


def wide_posterior(motion: Motion) -> Posterior:
    """Return the posterior of a planned manoeuvre with the arm unknown too."""
    model, times = mission.base_unknown(), sample_times(mission.DURATION, INTERVAL)
    return planned_posterior(model, [planned_manoeuvre(model, motion, times, "plan", mission.ENCODERS)])


# noise of the rate sensors by label
RATES: dict[str, Noise] = {"star tracker 2″": StarTracker(2.0), "10⁻⁵ rad/s": White(1e-5), "10⁻⁶ rad/s": White(1e-6)}

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


# numbers of repetitions at which the accuracy is drawn
REPETITIONS = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1e3, 3e3, 1e4, 1e5)


@dataclass(frozen=True)
class Result:
    """Content of the report."""

    motion: Motion  # the designed manoeuvre
    # answers by labels of rate and accelerometer, then by whether the arm and the bias are known
    answers: Mapping[tuple[str, str], Mapping[tuple[bool, bool], Answer]]
    after: Mapping[str, Widths]  # standard deviations from the ``designed`` manoeuvre and from that of the ``flight``
    repetitions: Sequence[float]  # numbers of repetitions of the curves
    # largest relative standard deviations by manoeuvre and whether the arm is known
    curves: Mapping[tuple[str, bool], Sequence[float]]
    # largest relative difference of the standard deviations from those that `studies.excitation` states
    difference: float


def run(
    tables: Path,
    *,
    rates: Sequence[str] = tuple(RATES),
    accels: Sequence[str] = tuple(ACCELS),
    progress: Callable[[str], None] = lambda text: None,
) -> Result:
    """Run the study; arguments that are not described are options of the command.

    Parameters
    ----------
    rates, accels : sequence of str; labels of the sensors
    """
    motion = designed_motion(tables / "excitation-manoeuvres.csv")
    information = information_of(motion)
    table = answers(information["designed"], rates, {label: ACCELS[label] for label in accels}, progress)
    curves = {
        (name, known): [of_manoeuvre.repeated(USUAL, known).worst(count) for count in REPETITIONS]
        for name, of_manoeuvre in information.items()
        for known in (True, False)
    }
    after = {name: widths(of_manoeuvre) for name, of_manoeuvre in information.items()}
    return Result(motion, table, after, REPETITIONS, curves, _difference(after["designed"], tables))


def _difference(after: Widths, folder: Path) -> float:
    """Return the largest relative difference from the standard deviations in the table of `studies.excitation`."""
    stated = {row["arm"]: row for row in read_rows(folder / "excitation-predicted.csv") if row["manoeuvre"] == DESIGN}
    computed = dict(zip(mission.ROWS, (after.uncertain, after.exact), strict=True))
    values = {arm: np.array([float(row[f"sd {heading}"]) for heading in HEADINGS]) for arm, row in stated.items()}
    return float(max(np.abs(computed[arm] / values[arm] - 1.0).max() for arm in mission.ROWS))
