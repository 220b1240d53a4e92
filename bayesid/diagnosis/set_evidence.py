"""Evidence of any set of causes relative to nothing, from the Gram alone."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property

import numpy as np
from scipy.special import logsumexp

from bayesid._math.arrays import Floats
from bayesid.diagnosis.gram import Gram
from bayesid.diagnosis.scale_integral import MOST_NODES, GroupSpectrum, ScaleAverage, average_over_scales
from bayesid.diagnosis.scale_nodes import LogNodes, thinning
from bayesid.diagnosis.scale_prior import CandidateCause

__all__ = ["SetEvidence", "precision_roots"]

BLOCK = 4_000_000
"""Most numbers in one intermediate array where many scores are evaluated at once."""


def precision_roots(matrix: Floats, deviations: Floats) -> tuple[Floats, Floats]:
    """Return roots of the posterior covariance of amplitudes with known prior deviations.

    With ``D`` the diagonal of the deviations, ``1 + D A D`` has eigenvalues of at least one whatever ``A`` is, and a
    Cholesky factor ``L``; the posterior covariance is ``D (1 + D A D)^-1 D``.

    Parameters
    ----------
    matrix : (m, m) array
        Information ``A``.
    deviations : (t, m) array
        Prior standard deviations, one row for each combination of scales.

    Returns
    -------
    roots : (t, m, m) array
        ``L^-1 D``, of which the covariance is the transpose times the matrix itself.
    half_log_det : (t,) array
        Half of the logarithm of the determinant of ``1 + D A D``.
    """
    scaled = deviations[:, :, None] * matrix * deviations[:, None, :] + np.eye(len(matrix))
    lower = np.linalg.cholesky(scaled)
    roots = np.linalg.solve(lower, np.eye(len(matrix)) * deviations[:, None, :])
    return roots, np.log(np.diagonal(lower, axis1=1, axis2=2)).sum(axis=1)


class SetEvidence:
    """Evidence of sets of causes.

    Parameters
    ----------
    gram : Gram
    causes : iterable of CandidateCause
        Candidates, generic ones included, whose groups are in the Gram.

    Raises
    ------
    ValueError
        If two candidates have one name, or a candidate has no group, one that is not in the Gram, or one twice.
    """

    def __init__(self, gram: Gram, causes: Iterable[CandidateCause]) -> None:
        self.gram = gram
        self.causes: dict[str, CandidateCause] = {}
        for cause in causes:
            if cause.name in self.causes:
                raise ValueError(f"two causes have the name {cause.name!r}; names must differ")
            absent = [group.name for group in cause.groups if group.name not in gram.groups]
            if absent or not cause.groups:
                raise ValueError(f"{cause.name!r} needs groups of columns of the Gram, received {absent or 'none'}")
            if len({group.name for group in cause.groups}) < len(cause.groups):
                raise ValueError(f"{cause.name!r} names one group of columns twice; each has one scale")
            self.causes[cause.name] = cause
        self._spectra = {name: tuple(GroupSpectrum.of(g, gram) for g in c.groups) for name, c in self.causes.items()}

    @cached_property
    def catalogue(self) -> tuple[str, ...]:
        """Names of the causes of the catalogue, sorted."""
        return tuple(sorted(name for name, cause in self.causes.items() if not cause.generic))

    @cached_property
    def generics(self) -> tuple[str, ...]:
        """Names of the generic causes, sorted."""
        return tuple(sorted(name for name, cause in self.causes.items() if cause.generic))

    @property
    def invisible(self) -> tuple[str, ...]:
        """Names of the candidates that the data cannot see within their physical bounds, sorted."""
        return tuple(sorted(name for name, own in self._spectra.items() if not any(s.range.visible for s in own)))

    def places(self, names: Iterable[str]) -> list[tuple[str, int]]:
        """Return the groups of a set, each by its cause and its place in that, in the order of the integration.

        The order, and so the last digit of the result, depends neither on the order of the names nor on that of the
        candidates: the group with most columns comes first.
        """
        found = [(name, place) for name in sorted(names) for place in range(len(self._spectra[name]))]
        return sorted(found, key=lambda item: -len(self._spectra[item[0]][item[1]].columns))

    def spectra(self, names: Iterable[str]) -> list[GroupSpectrum]:
        """Return the spectra of the groups of a set, in the order of `places`."""
        return [self._spectra[name][place] for name, place in self.places(names)]

    def average(self, names: Iterable[str]) -> ScaleAverage:
        """Return the evidence of a set and the posterior of its scales."""
        return average_over_scales(self.spectra(names), self.gram)

    def log_evidence(self, names: Iterable[str]) -> float:
        """Return the logarithm of the evidence of a set, relative to nothing."""
        return self.average(names).log_evidence

    def log_evidences(self, names: Iterable[str], scores: Floats) -> Floats:
        """Return the logarithm of the evidence of one set for many scores, shape (d,).

        The nodes are those of `log_evidence`, unless the set has so many groups that their product is thinned.

        Parameters
        ----------
        names : iterable of str
        scores : (d, m) array
            Scores of all columns of the Gram.
        """
        spectra = self.spectra(names)
        if not spectra:
            return np.zeros(len(scores))
        if len(spectra) > 1:
            return self._several(spectra, scores)
        (own,) = spectra
        nodes = own.nodes()
        visible = nodes.scales[:, None] ** 2 * own.values
        squares = ((scores[:, own.columns] * own.root) @ own.vectors) ** 2
        share = nodes.scales[:, None] ** 2 / (1.0 + visible)
        offset = nodes.log_weights - 0.5 * np.log1p(visible).sum(axis=1)
        return np.asarray(logsumexp(0.5 * squares @ share.T + offset, axis=1))

    def _several(self, spectra: Sequence[GroupSpectrum], scores: Floats) -> Floats:
        """Return the same for several groups, on the product of their nodes."""
        thinned = thinning([len(own.nodes().scales) for own in spectra], MOST_NODES)
        nodes = _product([own.nodes(thinned) for own in spectra])
        columns = np.concatenate([own.columns for own in spectra])
        deviations = np.concatenate(
            [nodes.scales[:, place, None] * own.root for place, own in enumerate(spectra)], axis=1
        )
        roots, half_log_det = precision_roots(self.gram.matrix[np.ix_(columns, columns)], deviations)
        covariance = np.swapaxes(roots, 1, 2) @ roots
        upper = np.triu_indices(len(columns))
        weights = 0.5 * covariance[:, upper[0], upper[1]] * np.where(upper[0] == upper[1], 1.0, 2.0)
        found = np.empty(len(scores))
        step = max(BLOCK // max(len(half_log_det), len(upper[0])), 1)
        for start in range(0, len(scores), step):
            part = scores[start : start + step][:, columns]
            products = part[:, upper[0]] * part[:, upper[1]]
            terms = products @ weights.T + nodes.log_weights - half_log_det
            found[start : start + step] = logsumexp(terms, axis=1)
        return found


def _product(nodes: Sequence[LogNodes]) -> LogNodes:
    """Return the product of the nodes of several groups: scales (t, k) and logarithms of weights (t,)."""
    scales = np.stack([axis.ravel() for axis in np.meshgrid(*(own.scales for own in nodes), indexing="ij")], axis=1)
    weights = np.meshgrid(*(own.log_weights for own in nodes), indexing="ij")
    return LogNodes(scales, np.sum([axis.ravel() for axis in weights], axis=0))
