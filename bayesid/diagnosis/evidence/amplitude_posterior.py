"""Posterior of the amplitudes of a set of causes: a mixture of normal distributions over the scales.

Given the scales it is the normal posterior of a linear model with a normal prior (A. Gelman et al., Bayesian Data
Analysis, 3rd ed. 2013, chapter 14); the weights of the mixture are the posterior probabilities of the nodes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from bayesid._math.arrays import Floats, Integers
from bayesid.diagnosis.evidence.gram import covariance_roots
from bayesid.diagnosis.evidence.set_evidence import SetEvidence

__all__ = ["AmplitudePosterior"]

MOST_TERMS = 2000  # normal distributions in the mixture; the most probable are kept
KEPT = 1.0 - 1e-6  # probability of the scales that are kept, unless `MOST_TERMS` have less
BISECTIONS = 60  # halvings of the interval that contains a quantile


@dataclass(frozen=True)
class AmplitudePosterior:
    """Posterior of amplitudes, given that a set of causes is at work.

    Attributes
    ----------
    amplitudes : mapping of (str, str) to (k,) arrays of int
        Places of the amplitudes of each cause and group, by the names of both.
    weights : (t,) array
        Probabilities of the scales.
    means : (t, m) array
        Means of the amplitudes given the scales, in the amplitudes' units.
    roots : (t, m, m) array
        Matrices whose transposes times themselves are the covariances given the scales.
    """

    amplitudes: Mapping[tuple[str, str], Integers]
    weights: Floats
    means: Floats
    roots: Floats

    @staticmethod
    def of(evidence: SetEvidence, names: Iterable[str]) -> AmplitudePosterior:
        """Return the posterior of the amplitudes of a set.

        Parameters
        ----------
        evidence : SetEvidence
        names : iterable of str
            At least one cause.
        """
        names = tuple(names)
        if not names:
            raise ValueError("a posterior of amplitudes needs at least one cause, received none")
        forms = evidence.forms(names)
        average, spectra = evidence.average(names), evidence.spectra(names, forms)
        weights = np.exp(average.log_posterior.ravel())
        order = np.argsort(-weights, kind="stable")
        kept = order[: min(int(np.searchsorted(np.cumsum(weights[order]), KEPT)) + 1, MOST_TERMS)]
        where = np.unravel_index(kept, average.log_posterior.shape)
        parts = zip(average.nodes, where, spectra, strict=True)
        deviations = np.concatenate(
            [nodes.scales[index, None] * spectrum.root for nodes, index, spectrum in parts], axis=1
        )
        columns = np.concatenate([spectrum.columns for spectrum in spectra])
        roots, _ = covariance_roots(evidence.gram.matrix[np.ix_(columns, columns)], deviations)
        means = -(np.swapaxes(roots, 1, 2) @ (roots @ evidence.gram.score[columns])[..., None])[..., 0]
        amplitudes, first = {}, 0
        for (name, place), spectrum in zip(evidence.places(names, forms), spectra, strict=True):
            key = (name, evidence.causes[name].variants[forms[name]].groups[place].name)
            amplitudes[key] = np.arange(first, first + len(spectrum.columns))
            first += len(spectrum.columns)
        return AmplitudePosterior(amplitudes, weights[kept] / weights[kept].sum(), means, roots)

    @property
    def mean(self) -> Floats:
        """Mean of the amplitudes, shape (m,)."""
        return self.weights @ self.means

    @property
    def covariance(self) -> Floats:
        """Covariance of the amplitudes, shape (m, m), with the spread of the means over the scales."""
        size = self.means.shape[1]
        within = (np.sqrt(self.weights)[:, None, None] * self.roots).reshape(-1, size)
        between = np.sqrt(self.weights)[:, None] * (self.means - self.mean)
        return within.T @ within + between.T @ between

    def upper_limits(self, probability: float = 0.95) -> Floats:
        """Return the values below which the magnitudes of the amplitudes lie with a probability, shape (m,)."""
        if not 0.0 < probability < 1.0:
            raise ValueError(f"the probability of an upper limit must lie in (0, 1), received {probability}")
        deviations = np.maximum(np.sqrt((self.roots**2).sum(axis=1)), np.finfo(float).tiny)
        high = (np.abs(self.means) + 40.0 * deviations).max(axis=0)  # holds all but nothing, however small the rest
        low = np.zeros_like(high)
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            above = (middle - self.means) / deviations
            below = (-middle - self.means) / deviations
            enough = self.weights @ (ndtr(above) - ndtr(below)) > probability
            low, high = np.where(enough, low, middle), np.where(enough, middle, high)
        return 0.5 * (low + high)
