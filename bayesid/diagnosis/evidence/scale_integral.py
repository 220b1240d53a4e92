"""Evidence of groups of amplitudes, averaged over their scales.

Given the scales, amplitudes with prior precision ``P`` raise the evidence by the factor

    exp(1/2 g'(A + P)^-1 g) / det(1 + P^-1 A)^1/2.

The groups are integrated out one after another. The eigenvectors of a group's information decouple its amplitudes at
every scale at once, ``A + P`` is never inverted, and neither a singular ``A`` nor scales of any size do harm. What
remains for the next group is its information and score after those before have taken their share. The last group
costs one eigendecomposition for all its scales. The largest group comes first; its eigenvectors are found once and
serve all sets that it belongs to.

The factor is the evidence of a linear model, and its determinant the Occam factor, of D. J. C. MacKay, Bayesian
interpolation, Neural Computation 4, 1992. Why few nodes are enough: L. N. Trefethen and J. A. C. Weideman, The
exponentially convergent trapezoidal rule, SIAM Review 56, 2014.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import NamedTuple

import numpy as np

from bayesid._math.arrays import Floats, Integers, log_sum, log_sums
from bayesid.diagnosis.evidence.gram import Gram
from bayesid.diagnosis.evidence.scales import (
    AmplitudeGroup,
    LogNodes,
    ScaleRange,
    log_nodes,
    log_nodes_of_many,
    range_of,
    thinning,
)

__all__ = ["GroupSpectrum", "ScaleAverage", "average_over_scales", "log_evidences"]

MOST_NODES = 2000  # in the product of all groups but the last, above which the grid is thinned and then narrowed
COARSE_NODES = 40  # the same for the first grid of large groups, which only finds where the integrand matters
LARGE = 1e7  # nodes times the cube of the columns of large groups: some ten milliseconds of eigendecompositions
NEGLIGIBLE = 9.0  # nats below the largest of the integrand at which a coarse grid is cut off
ROUNDS = 4  # grids, one within another


@dataclass(frozen=True)
class GroupSpectrum:
    """One group with its information in its own eigenvectors.

    Attributes
    ----------
    columns : (k,) array of int
        Indices in the Gram.
    root : (k,) array
        Standard deviations of the amplitudes relative to the scale.
    range : ScaleRange
    values : (k,) array
        Eigenvalues of the information on the amplitudes in units of ``root``, at least zero.
    vectors : (k, k) array
    score : (k,) array
        Score along the eigenvectors.
    """

    columns: Integers
    root: Floats
    range: ScaleRange
    values: Floats
    vectors: Floats
    score: Floats

    @staticmethod
    def of(groups: Sequence[AmplitudeGroup], gram: Gram) -> list[GroupSpectrum]:
        """Return the spectra of groups; those of one size are decomposed together.

        Parameters
        ----------
        groups : sequence of AmplitudeGroup
        gram : Gram
        """
        columns = [group.columns(gram) for group in groups]
        sizes: dict[int, list[int]] = {}
        for place, part in enumerate(columns):
            sizes.setdefault(len(part), []).append(place)
        spectra: dict[int, GroupSpectrum] = {}
        for places in sizes.values():
            block = np.stack([columns[place] for place in places])
            root = np.stack([groups[place].roots(gram) for place in places])
            information = root[:, :, None] * gram.matrix[block[:, :, None], block[:, None, :]] * root[:, None, :]
            values, vectors = np.linalg.eigh(information)
            score = (np.swapaxes(vectors, 1, 2) @ (root * gram.score[block])[:, :, None])[..., 0]
            values = np.maximum(values, 0.0)
            for row, place in enumerate(places):
                scales = range_of(groups[place], float(values[row].max(initial=0.0)))
                spectra[place] = GroupSpectrum(block[row], root[row], scales, values[row], vectors[row], score[row])
        return [spectra[place] for place in range(len(groups))]

    def nodes(self, thinned: float = 1.0, part: tuple[float, float] | None = None) -> LogNodes:
        """Return nodes of the scale.

        Parameters
        ----------
        thinned : float
            Factor on their number, at most 1.
        part : pair of float, optional
            Ends of a part of the range, in the unit of the amplitudes; by default all of it.
        """
        part = (self.range.low, self.range.high) if part is None else part
        return log_nodes(self.range, part, self.values, thinned)


class ScaleAverage(NamedTuple):
    """Evidence of some groups, and what the data say about their scales.

    Attributes
    ----------
    log_evidence : float
        Logarithm of the average over the scales, relative to the model without the groups.
    nodes : tuple of LogNodes
        Nodes of each group.
    log_posterior : (t1, ..., tk) array
        Logarithms of the posterior probabilities of the nodes.
    """

    log_evidence: float
    nodes: tuple[LogNodes, ...]
    log_posterior: Floats


def log_evidences(groups: Sequence[GroupSpectrum]) -> Floats:
    """Return the logarithm of the evidence of each group by itself, averaged over its scale, shape (n,).

    Groups of one size are averaged together.
    """
    log_evidence = np.zeros(len(groups))
    sizes: dict[tuple[int, bool], list[int]] = {}
    for place, group in enumerate(groups):
        sizes.setdefault((len(group.columns), group.range.low == group.range.high), []).append(place)
    for (_, single), places in sizes.items():
        values = np.stack([groups[place].values for place in places])
        scores = np.stack([groups[place].score for place in places])
        ranges = [groups[place].range for place in places]
        if single:
            scales = np.array([[scale_range.high] for scale_range in ranges])
            log_weights = np.zeros_like(scales)
        else:
            scales, log_weights = log_nodes_of_many(ranges, values)
        squared = scales[:, :, None] ** 2
        visible = 1.0 + squared * values[:, None, :]
        gain = np.einsum("ntk,nk->nt", squared / visible, scores**2) - np.log(visible).sum(axis=-1)
        terms = 0.5 * gain + log_weights
        log_evidence[places] = log_sums(terms)
    return log_evidence


def _log_ratios(groups: Sequence[GroupSpectrum], gram: Gram, nodes: Sequence[LogNodes]) -> Floats:
    """Return the logarithm of the evidence relative to nothing at every combination of scales, shape (t1, ..., tk)."""
    if not groups:
        return np.zeros(())
    first, rest = groups[0], groups[1:]
    columns = np.concatenate([np.zeros(0, dtype=int), *(group.columns for group in rest)])
    root = np.concatenate([np.zeros(0), *(group.root for group in rest)])
    matrix = (root[:, None] * gram.matrix[np.ix_(columns, columns)] * root)[None]  # (b, m, m), b scales so far
    score = (root * gram.score[columns])[None]
    gain = np.zeros(1)
    shared = first.root[:, None] * gram.matrix[np.ix_(first.columns, columns)] * root
    values, along, cross = first.values[None], first.score[None], (first.vectors.T @ shared)[None]
    for index, grid in enumerate(nodes):
        if index:
            size = len(groups[index].columns)
            values, vectors = np.linalg.eigh(matrix[:, :size, :size])
            values = np.maximum(values, 0.0)
            turned = np.swapaxes(vectors, 1, 2)
            along = (turned @ score[:, :size, None])[..., 0]
            cross = turned @ matrix[:, :size, size:]
            matrix, score = matrix[:, size:, size:], score[:, size:]
        squared = grid.scales[:, None] ** 2
        visible = squared * values[:, None, :]  # (b, t, k)
        share = squared / (1.0 + visible)
        now = 0.5 * ((share @ along[..., None] ** 2)[..., 0] - np.log1p(visible).sum(axis=-1))
        gain = (gain[:, None] + now).ravel()
        if index + 1 < len(nodes):
            left = cross.shape[-1]
            weighted = np.swapaxes(cross, 1, 2)[:, None] * share[:, :, None, :]  # (b, t, m, k)
            matrix = (matrix[:, None] - weighted @ cross[:, None]).reshape(-1, left, left)
            score = (score[:, None] - (weighted @ along[:, None, :, None])[..., 0]).reshape(-1, left)
    return gain.reshape([len(grid.scales) for grid in nodes])


def average_over_scales(groups: Sequence[GroupSpectrum], gram: Gram) -> ScaleAverage:
    """Average the evidence of some groups over their scales.

    The grid is the product of the groups' nodes. Where it would be too large, a thinned one finds where the integrand
    is not negligible, and a finer one covers that. The trapezoidal rule of a smooth integrand converges so fast that
    even the thinned grid does better than as many quasi-random points. With scales of five decades the error of the
    logarithm is about 0.01 (rms) for up to five groups, one of them of 180 amplitudes, and 0.1 at most.

    Parameters
    ----------
    groups : sequence of GroupSpectrum
        The largest first.
    gram : Gram
    """
    parts = [(group.range.low, group.range.high) for group in groups]
    cube = float(sum(len(group.columns) for group in groups[1:])) ** 3
    for turn in range(ROUNDS):
        counts = [len(group.nodes(part=part).scales) for group, part in zip(groups, parts, strict=True)]
        coarse = turn == 0 and cube * float(np.prod(counts[:-1], dtype=float)) > LARGE
        thinned = thinning(counts[:-1], COARSE_NODES if coarse else MOST_NODES)
        nodes = tuple(
            group.nodes(thinned if place + 1 < len(groups) else 1.0, part)
            for place, (group, part) in enumerate(zip(groups, parts, strict=True))
        )
        log_terms = _log_ratios(groups, gram, nodes)
        log_terms = log_terms + reduce(np.add.outer, [np.zeros(()), *(grid.log_weights for grid in nodes)])
        narrower = [_narrowed(grid, axis, log_terms) for axis, grid in enumerate(nodes)]
        if thinned == 1.0 or (narrower == parts and not coarse):
            break
        parts = narrower
    log_evidence = log_sum(log_terms)
    return ScaleAverage(log_evidence, nodes, log_terms - log_evidence)


def _narrowed(nodes: LogNodes, axis: int, log_terms: Floats) -> tuple[float, float]:
    """Return the ends of the scales that matter along an axis, one node further on either side."""
    others = tuple(other for other in range(log_terms.ndim) if other != axis)
    matters = np.flatnonzero(log_terms.max(axis=others) > log_terms.max() - NEGLIGIBLE)
    last = len(nodes.scales) - 1
    return float(nodes.scales[max(matters[0] - 1, 0)]), float(nodes.scales[min(matters[-1] + 1, last)])
