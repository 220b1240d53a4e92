"""Information of one manoeuvre about the base, for any sensors, any knowledge of the arm and any repetitions."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.optimize import brentq

from bayesid import Sensor, SensorKind, White
from bayesid._math.arrays import Floats
from bayesid.design import planned_manoeuvre, planned_posterior
from bayesid.design.designed import sample_times
from bayesid.identifiability.local_knowledge import Knowledge, marginalised, triangular
from bayesid.inference.body_quantities import linearise
from bayesid.inference.noise_changes import with_sensors
from bayesid.inference.posterior import Posterior
from bayesid.recording.joint_motion import Motion
from bayesid.simulation.sensors import Noise
from studies.common import mission
from studies.common.ets7 import ACCELEROMETER, INTERVAL
from studies.common.quantities import JUDGED

__all__ = ["LONGEST", "Grade", "ManoeuvreInformation", "Repeated", "wide_posterior"]

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
