"""What one manoeuvre tells of the base, for any sensors, any knowledge of the arm and any number of repetitions."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from bayesid import Kind, Sensor, White
from bayesid.design import planned_manoeuvre, planned_posterior
from bayesid.design.designed import sample_times
from bayesid.identifiability.local_knowledge import Knowledge, marginalised, triangular
from bayesid.inference.body_quantities import linearise
from bayesid.inference.noise_changes import with_sensors
from bayesid.inference.posterior import Posterior
from bayesid.recording.joint_motion import Motion
from bayesid.simulation.sensors import Noise
from studies.common.ets7 import ACCELEROMETER, ENCODER
from studies.ets7_limits.setting import ARM_SPREAD, DURATION, INTERVAL, model_of

__all__ = ["LONGEST", "Asked", "Grade", "Repeated", "wide_posterior"]

Floats = NDArray[np.floating]

ABSENT = 1e3
"""Noise of an accelerometer that is not there [m/s2]."""

LONGEST = 1e6
"""Repetitions beyond which nobody waits: years of moving without a pause."""

JUDGED = (0, 4, 5, 6)
"""Of the ten quantities, those that are to be known: mass and the three moments of inertia."""


@dataclass(frozen=True)
class Grade:
    """Sensors: noise of the rate, noise of the accelerometer per sample [m/s2], None where there is none."""

    rate: Noise
    accel: float | None
    bias_known: bool = False


@dataclass(frozen=True)
class Repeated:
    """What n repetitions of a manoeuvre tell.

    Attributes
    ----------
    prior : Knowledge
        The base's quantities before any manoeuvre, by the c unknowns that all repetitions share.
    rows : (c, c) array
        Rows equivalent to the whitened Jacobian of one repetition, its initial rate marginalised.
    duration : float
        Duration of one repetition [s].
    """

    prior: Knowledge
    rows: Floats
    duration: float

    def sd(self, repetitions: float) -> Floats:
        """Posterior standard deviation of the base's ten quantities, in their units."""
        return self.prior.having(np.sqrt(repetitions) * self.rows).sd

    def relative(self, repetitions: float) -> Floats:
        """Relative standard deviation of the base's mass and three moments of inertia, shape (4,)."""
        judged = list(JUDGED)
        return self.sd(repetitions)[judged] / self.prior.values[judged]

    def worst(self, repetitions: float) -> float:
        """Return the largest of `relative`."""
        return float(self.relative(repetitions).max())

    def needed(self, target: float = 0.01) -> float:
        """Repetitions until the worst is down to the target, at least one; infinite where `LONGEST` is not enough."""
        if self.worst(1.0) <= target:
            return 1.0
        if self.worst(LONGEST) > target:
            return float("inf")
        return float(np.exp(brentq(lambda n: self.worst(float(np.exp(n))) - target, 0.0, np.log(LONGEST))))

    @property
    def floored(self) -> bool:
        """Whether more repetitions no longer help at the end."""
        return self.worst(LONGEST) > 0.9 * self.worst(0.01 * LONGEST)


@dataclass
class Asked:
    """A manoeuvre's posterior with everything unknown that a question may fix; see `wide_posterior`."""

    posterior: Posterior
    duration: float = DURATION
    _kept: dict[tuple[Noise, float], Floats] = field(default_factory=dict)

    def repeated(self, grade: Grade, arm_known: bool) -> Repeated:
        """Return what repetitions tell with some sensors; without an accelerometer its bias does not matter."""
        size, names = self.posterior.size, self.posterior.unknowns.names
        rates = list(range(size))[self.posterior.unknowns.layout.all_rates]
        exact = [index for index, name in enumerate(names) if _exact(name, grade, arm_known)]
        once = np.concatenate([self.rows(grade), np.eye(size)[rates]])
        shared = np.delete(np.arange(size), rates)
        rows = np.delete(marginalised(once, rates), np.flatnonzero(np.isin(shared, exact)), axis=1)
        return Repeated(self.prior.fixing([*rates, *exact]), rows, self.duration)

    def rows(self, grade: Grade) -> Floats:
        """Whitened Jacobian of one manoeuvre, without prior, the encoders' noise carried into the sensors; kept."""
        accel = ABSENT if grade.accel is None else grade.accel
        if (grade.rate, accel) not in self._kept:
            sensors = (Sensor(Kind.RATE, grade.rate), Sensor(Kind.ACCEL, White(accel), position=ACCELEROMETER))
            z = np.zeros(self.posterior.size)
            jacobian = with_sensors(self.posterior, sensors, z).jacobian(z)[: -self.posterior.size]
            self._kept[grade.rate, accel] = triangular(jacobian)
        return self._kept[grade.rate, accel]

    @cached_property
    def prior(self) -> Knowledge:
        """The base's quantities before any manoeuvre."""
        size = self.posterior.size
        return Knowledge(*linearise(self.posterior, np.zeros(size)), np.eye(size))


def _exact(name: str, grade: Grade, arm_known: bool) -> bool:
    """Whether an unknown that all repetitions share is taken for known exactly."""
    return (arm_known and name.startswith("link")) or (grade.bias_known and name.startswith("accel-bias"))


def wide_posterior(
    motion: Motion, like: Posterior | None = None, duration: float = DURATION, arm_spread: float = ARM_SPREAD
) -> Posterior:
    """Return the posterior of a planned manoeuvre with the arm unknown too."""
    model = model_of(arm_spread) if like is None else like.model
    time = sample_times(duration, INTERVAL)
    manoeuvre = planned_manoeuvre(model, motion, time, "manoeuvre", {0: ENCODER})
    return planned_posterior(model, [manoeuvre], like)
