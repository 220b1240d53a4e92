"""What linear theory expects of the Bayes factor between two rivals, before anything is flown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesid import Manoeuvre, Model, Recording
from bayesid.design import planned_posterior
from bayesid.design.designed import sample_times
from bayesid.inference.noise_changes import relinearised
from bayesid.inference.posterior import Posterior
from bayesid.inference.simulated_recordings import blank_channels
from bayesid.recording.joint_motion import Motion
from studies.ets7_limits.setting import INTERVAL
from studies.separating.setting import RIVALS, drifting

__all__ = ["Expected", "Linearised"]

Floats = NDArray[np.floating]


@dataclass(frozen=True)
class Expected:
    """Of one truth and a set of manoeuvres.

    Attributes
    ----------
    alone : float
        Noncentrality lambda of the effect against a model without it, everything else marginalised.
    apart : float
        lambda (1 - rho^2): likewise against a model with the rival in its place.
    log_factor : float
        Mean of the log Bayes factor of the truth against the rival, what each prior costs included.
    """

    alone: float
    apart: float
    log_factor: float

    @property
    def sd(self) -> float:
        """Spread of the log Bayes factor, from noise alone."""
        return float(np.sqrt(self.apart))

    @property
    def energy(self) -> float:
        """Half of `apart`."""
        return 0.5 * self.apart


@dataclass(frozen=True)
class Linearised:
    """Information of manoeuvres about everything unknown, both rivals in the model.

    Attributes
    ----------
    information : (n, n) array
        In coordinates whose prior is standard normal, without that prior.
    names : tuple of str
    """

    information: Floats
    names: tuple[str, ...]

    @classmethod
    def of(
        cls, model: Model, motion: Motion, duration: float, like: Posterior | None = None
    ) -> tuple[Linearised, Posterior]:
        """Linearise one manoeuvre at the drifting base; the posterior is returned to share what is compiled."""
        time = sample_times(duration, INTERVAL)
        blank = Recording("manoeuvre", None, time, blank_channels(model.sensors, len(time)))
        posterior = planned_posterior(model, [Manoeuvre(blank, motion)], like)
        z = drifting(model, posterior.unknowns.names)
        jacobian = relinearised(posterior, z).jacobian(z)[: -posterior.size]
        return cls(jacobian.T @ jacobian, posterior.unknowns.names), posterior

    def with_another(self, other: Linearised) -> Linearised:
        """Join two manoeuvres: all is shared but the initial rates."""
        count = len(self.names)
        fresh = [index for index, name in enumerate(other.names) if name.startswith("initial-rate")]
        place = [count + fresh.index(index) if index in fresh else index for index in range(len(other.names))]
        total = np.zeros((count + len(fresh), count + len(fresh)))
        total[:count, :count] = self.information
        total[np.ix_(place, place)] += other.information
        return Linearised(total, (*self.names, *(f"second {other.names[index]}" for index in fresh)))

    def energies(self, truth: str, amplitudes: Floats) -> Floats:
        """Return lambda (1 - rho^2) / 2 of one truth for many amplitudes, shape (k, n) -> (k,)."""
        return np.array([self.expect(truth, amplitude).energy for amplitude in amplitudes])

    def expect(self, truth: str, amplitude: Floats) -> Expected:
        """Expect what follows where one of the rivals acts with an amplitude, in prior standard deviations."""
        rival = next(label for label in RIVALS if label != truth)
        own, other = self._rows(truth), self._rows(rival)
        rest = [index for index in range(len(self.names)) if index not in (*own, *other)]
        mean = [self._log_evidence([*rest, *rows], own, amplitude) for rows in (own, other)]
        alone, apart = (self._noncentrality(own, keep, amplitude) for keep in (rest, [*rest, *other]))
        return Expected(alone, apart, mean[0] - mean[1])

    def _rows(self, label: str) -> list[int]:
        return [index for index, name in enumerate(self.names) if name.startswith(f"{label}.")]

    def _noncentrality(self, own: list[int], rest: list[int], amplitude: Floats) -> float:
        inner = self.information[np.ix_(rest, rest)] + np.eye(len(rest))
        cross = self.information[np.ix_(rest, own)] @ amplitude
        return float(amplitude @ self.information[np.ix_(own, own)] @ amplitude - cross @ np.linalg.solve(inner, cross))

    def _log_evidence(self, rows: list[int], own: list[int], amplitude: Floats) -> float:
        """Mean log evidence of the model with these unknowns, up to what all models share."""
        within = self.information[np.ix_(rows, rows)]
        total, signal = within + np.eye(len(rows)), self.information[np.ix_(rows, own)] @ amplitude
        fitted = signal @ np.linalg.solve(total, signal) + np.trace(np.linalg.solve(total, within))
        return float(0.5 * fitted - 0.5 * np.linalg.slogdet(total)[1])
