"""Score tests of what a fit leaves: does any effect, or anything at all, explain more of it than noise can.

With ``X`` the columns of all that is fitted (unit priors) and ``S`` those of a candidate, the marginal score
``g = S' r`` at the fit has covariance ``A = S' S - S' X (X' X + 1)^-1 X' S``; ``g' A^+ g`` is chi-square over the
directions in which a candidate of its prior's size could be seen at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.special import gammaln

from bayesid._math.arrays import Floats
from bayesid.diagnosis.perturbed_fit import Fit

__all__ = ["Calibration", "Score", "chi2_log_sf", "score"]

VISIBLE = 1.0
"""Information at the prior's scale from which on a direction counts."""

DRAWS = 4000
"""Simulated residuals for the distribution of the smallest p-value."""

REACH = 40
"""Rank of the draw from which smaller p-values are extrapolated."""


@dataclass(frozen=True)
class Score:
    """One score test.

    Attributes
    ----------
    name : str
    basis : (N, d) array
        Columns orthonormal after all that is fitted has taken its share.
    statistic : float
        Chi-square with ``d`` degrees of freedom if there is only noise.
    response : (d, p) array
        Mean of the columns' part along the basis for unit amplitudes of the p columns: the noncentrality of amplitudes
        ``a`` is the square of ``response @ a``.
    """

    name: str
    basis: Floats
    statistic: float
    response: Floats

    @property
    def degrees(self) -> int:
        """Degrees of freedom."""
        return self.basis.shape[1]

    @property
    def log_p(self) -> float:
        """Logarithm of the p-value."""
        return chi2_log_sf(self.statistic, self.degrees) if self.degrees else 0.0

    @property
    def signal_to_noise(self) -> float:
        """Root of the statistic less its degrees of freedom."""
        return float(np.sqrt(max(self.statistic - self.degrees, 0.0)))


def score(name: str, columns: Floats, fit: Fit, most: int | None = None) -> Score:
    """Test columns, (N, p), against the residual of a fit.

    Parameters
    ----------
    most : int, optional
        Directions to keep: those most visible.
    """
    values, vectors = np.linalg.eigh(fit.project(columns))
    order = np.argsort(values)[::-1][:most]
    kept = order[values[order] > VISIBLE]
    basis = columns @ (vectors[:, kept] / np.sqrt(values[kept]))
    found = basis.T @ fit.residual
    return Score(name, basis, float(found @ found), (vectors[:, kept] * np.sqrt(values[kept])).T)


def chi2_log_sf(statistic: float, degrees: float) -> float:
    """Logarithm of the upper tail of chi-square; far out by a continued fraction, where it underflows."""
    value = float(stats.chi2.logsf(statistic, degrees))
    if np.isfinite(value):
        return value
    a, x = 0.5 * degrees, 0.5 * statistic
    return float(a * np.log(x) - x - np.log(x - a + 1.0) - gammaln(a))  # the first term of the continued fraction


class Calibration:
    """How small the smallest of a family's p-values is expected to be by chance (parametric bootstrap).

    Parameters
    ----------
    scores : sequence of Score
    fit : Fit
        That the scores were made on.
    others : int
        Further tests, independent of the scores.
    seed : int
    """

    def __init__(self, scores: Sequence[Score], fit: Fit, others: int, seed: int) -> None:
        rng = np.random.default_rng(seed)
        basis = np.concatenate([item.basis for item in scores], axis=1)
        values, vectors = np.linalg.eigh(fit.project(basis))
        kept = values > 1e-9
        root = vectors[:, kept] * np.sqrt(values[kept])
        draws = rng.normal(size=(DRAWS, int(kept.sum()))) @ root.T
        smallest = np.log(rng.uniform(size=(DRAWS, max(others, 1)))).min(axis=1) if others else np.zeros(DRAWS)
        first = 0
        for item in scores:
            own = draws[:, first : first + item.degrees]
            first += item.degrees
            if item.degrees:
                smallest = np.minimum(smallest, stats.chi2.logsf((own**2).sum(axis=1), item.degrees))
        self.smallest = np.sort(smallest)

    def adjusted(self, log_p: float) -> float:
        """Family-wise p-value of a local one; below the bootstrap's reach scaled from its hundredth."""
        below = int(np.searchsorted(self.smallest, log_p, side="right"))
        if below >= REACH:
            return (below + 1.0) / (DRAWS + 1.0)
        tests = (REACH + 1.0) / (DRAWS + 1.0) / np.exp(self.smallest[REACH])
        return float(min(1.0, tests * np.exp(log_p)))
