"""Expectation of the Bayes factor between two rivals by linear theory, before anything is flown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesid import Manoeuvre, Model, Recording
from bayesid.design import planned_posterior
from bayesid.design.designed import sample_times
from bayesid.inference.noise_changes import relinearised
from bayesid.inference.simulated_recordings import blank_channels
from bayesid.recording.joint_motion import Motion
from studies.ets7_limits.setting import INTERVAL
from studies.separating.setting import drifting, rival_of

__all__ = ["Expected", "Linearised", "unexplained_information"]

Floats = NDArray[np.floating]


@dataclass(frozen=True)
class Expected:
    """Expectations for one truth and a set of manoeuvres.

    Attributes
    ----------
    alone : float
        Noncentrality lambda of the effect against a model without it, everything else marginalised.
    apart : float
        Noncentrality lambda (1 - rho^2) against a model with the rival in its place.
    log_factor : float
        Mean log Bayes factor of the truth against the rival, what each prior costs included.
    """

    alone: float
    apart: float
    log_factor: float

    @property
    def sd(self) -> float:
        """Standard deviation of the log Bayes factor, from noise alone."""
        return float(np.sqrt(self.apart))

    @property
    def energy(self) -> float:
        """Half of `apart`."""
        return 0.5 * self.apart


def unexplained_information(information: Floats, group: Sequence[int], rest: Sequence[int]) -> Floats:
    """Return the information about a group of unknowns that the rest cannot imitate, shape (group, group).

    Parameters
    ----------
    information : (n, n) array
        Information about all unknowns, without their prior.
    group, rest : sequences of int
        Unknowns of interest, and those to be marginalised with a standard normal prior.
    """
    inner = information[np.ix_(rest, rest)] + np.eye(len(rest))
    cross = information[np.ix_(rest, group)]
    return np.asarray(information[np.ix_(group, group)] - cross.T @ np.linalg.solve(inner, cross))


@dataclass(frozen=True)
class Linearised:
    """Information of manoeuvres about all unknowns of a model with both rivals.

    Attributes
    ----------
    information : (n, n) array
        Information in coordinates whose prior is standard normal, without that prior.
    names : tuple of str
        Names of the unknowns.
    """

    information: Floats
    names: tuple[str, ...]

    @classmethod
    def of(cls, model: Model, motion: Motion, duration: float) -> Linearised:
        """Linearise one manoeuvre about the drifting base."""
        time = sample_times(duration, INTERVAL)
        blank = Recording("manoeuvre", None, time, blank_channels(model.sensors, len(time)))
        posterior = planned_posterior(model, [Manoeuvre(blank, motion)])
        z = drifting(posterior.unknowns)
        jacobian = relinearised(posterior, z).jacobian(z)[: -posterior.size]
        return cls(jacobian.T @ jacobian, posterior.unknowns.names)

    def with_another(self, other: Linearised) -> Linearised:
        """Join two manoeuvres, which share all unknowns but the initial rates."""
        count = len(self.names)
        fresh = [index for index, name in enumerate(other.names) if name.startswith("initial-rate")]
        place = [count + fresh.index(index) if index in fresh else index for index in range(len(other.names))]
        total = np.pad(self.information, (0, len(fresh)))
        total[np.ix_(place, place)] += other.information
        return Linearised(total, (*self.names, *(f"second {other.names[index]}" for index in fresh)))

    def expect(self, truth: str, amplitude: Floats) -> Expected:
        """Return the expectations where one of the rivals acts with an amplitude, in prior standard deviations."""
        hidden, rival = (
            [i for i, name in enumerate(self.names) if name.startswith(f"{label}.")]
            for label in (truth, rival_of(truth))
        )
        rest = [index for index in range(len(self.names)) if index not in (*hidden, *rival)]
        mean = [self._log_evidence([*rest, *rows], hidden, amplitude) for rows in (hidden, rival)]
        alone, apart = (
            float(amplitude @ unexplained_information(self.information, hidden, others) @ amplitude)
            for others in (rest, [*rest, *rival])
        )
        return Expected(alone, apart, mean[0] - mean[1])

    def _log_evidence(self, rows: list[int], hidden: list[int], amplitude: Floats) -> float:
        """Return the mean log evidence of the model with some unknowns, up to what all models share."""
        within = self.information[np.ix_(rows, rows)]
        total, signal = within + np.eye(len(rows)), self.information[np.ix_(rows, hidden)] @ amplitude
        fitted = signal @ np.linalg.solve(total, signal) + np.trace(np.linalg.solve(total, within))
        return float(0.5 * fitted - 0.5 * np.linalg.slogdet(total)[1])
