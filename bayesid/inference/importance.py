"""Evidence by importance sampling from a Student-t about the mode, trusted only where Pareto k-hat allows."""

from __future__ import annotations

from dataclasses import dataclass

import arviz as az
import numpy as np

from bayesid.arrays import Floats
from bayesid.inference.charts import Chart, LinearChart, LogCholeskyChart
from bayesid.inference.optimum import Optimum
from bayesid.posterior import Posterior

__all__ = ["Evidence", "choose_chart", "importance_sample"]


TRUSTED = 0.7
"""Pareto k-hat above which importance sampling may not be trusted (Vehtari et al., JMLR 2024)."""

TRIAL = 512
"""Draws that decide between coordinates."""


@dataclass(frozen=True)
class Evidence:
    """Log evidence with its Monte Carlo error, and weighted moments of the coordinates.

    ``effective_samples`` is Kish's; ``mean`` and ``sd`` have shape (n,).
    """

    value: float
    error: float
    pareto_k: float
    effective_samples: float
    evaluations: int
    mean: Floats
    sd: Floats

    @property
    def trusted(self) -> bool:
        """Whether the estimate may be used."""
        return bool(self.pareto_k < TRUSTED)


def importance_sample(chart: Chart, optimum: Optimum, rng: np.random.Generator, draws: int = 4000) -> Evidence:
    """Estimate the evidence.

    Parameters
    ----------
    chart : Chart
        Coordinates to propose in.
    draws : int
        Evaluations of the posterior density.
    """
    proposal = chart.proposal(optimum)
    y = proposal.draw(draws, rng)
    log_weights = chart.log_density(y) - proposal.log_density(y)
    top = log_weights.max()
    if not np.isfinite(top):
        return Evidence(-np.inf, np.inf, np.inf, 0.0, draws, optimum.z, np.zeros_like(optimum.z))
    log_weights = np.maximum(log_weights, top - 700.0)
    smoothed, pareto_k = az.psislw(log_weights)
    raw = np.exp(log_weights - top)
    weights = np.exp(np.asarray(smoothed))
    weights /= weights.sum()
    z = np.nan_to_num(chart.to_z(y))
    mean = weights @ z
    return Evidence(
        value=float(top + np.log(raw.mean())),
        error=float(raw.std() / raw.mean() / np.sqrt(draws)),
        pareto_k=float(pareto_k),
        effective_samples=float(1.0 / (weights**2).sum()),
        evaluations=draws,
        mean=mean,
        sd=np.sqrt(weights @ (z - mean) ** 2),
    )


def choose_chart(posterior: Posterior, optimum: Optimum, rng: np.random.Generator) -> Chart:
    """Return the coordinates in which the Student-t about the mode is the better proposal."""
    charts: list[Chart] = [LogCholeskyChart(posterior), LinearChart(posterior)]
    return max(charts, key=lambda chart: importance_sample(chart, optimum, rng, draws=TRIAL).effective_samples)
