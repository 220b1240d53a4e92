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
from bayesid.diagnosis.evidence.gram import GaussianBlock, Gram
from bayesid.diagnosis.evidence.scales import (
    AmplitudeGroup,
    LogNodes,
    ScaleRange,
    log_nodes,
    log_nodes_of_many,
    range_of,
    thinning,
)

__all__ = [
    "GroupSpectrum",
    "ScaleAverage",
    "average_over_scales",
    "log_evidences",
    "log_evidences_beside",
    "log_evidences_of_scores",
]

MOST_NODES = 2000  # in the product of all groups but the last, above which the grid is thinned and then narrowed
COARSE_NODES = 40  # the same for the first grid of large groups, which only finds where the integrand matters
LARGE = 1e7  # nodes times the cube of the columns of large groups: some ten milliseconds of eigendecompositions
NEGLIGIBLE = 9.0  # nats below the largest of the integrand at which a coarse grid is cut off
ROUNDS = 4  # grids, one within another

BLOCK = 4_000_000  # numbers in one intermediate array where many scores are evaluated at once
CHEAPER = 4.0  # nodes times squared columns taken over squared size below which new eigenvectors cost more


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
    grid : LogNodes
        Nodes over the whole range of the scale.
    """

    columns: Integers
    root: Floats
    range: ScaleRange
    values: Floats
    vectors: Floats
    score: Floats
    grid: LogNodes

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
            largest = values.max(axis=1, initial=0.0).tolist()
            ranges = [range_of(groups[place], value) for place, value in zip(places, largest, strict=True)]
            grids = log_nodes_of_many(ranges, values)
            for row, place in enumerate(places):
                spectra[place] = GroupSpectrum(
                    block[row], root[row], ranges[row], values[row], vectors[row], score[row], grids[row]
                )
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
        whole = (self.range.low, self.range.high)
        if thinned == 1.0 and part in (None, whole):
            return self.grid
        return log_nodes(self.range, whole if part is None else part, self.values, thinned)


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
    for places in _by_size(groups):
        values = np.stack([groups[place].values for place in places])
        scores = np.stack([groups[place].score for place in places])
        log_evidence[places] = _averages(_grids([groups[place] for place in places]), values, scores)
    return log_evidence


def log_evidences_beside(groups: Sequence[GroupSpectrum], columns: Integers, deviations: Floats, gram: Gram) -> Floats:
    """Return the same on what other columns leave, whose amplitudes are integrated out at given scales.

    What those take from the information on a group is a matrix of their number as rank. Where that is small beside the
    size of the group, the determinant and the inverse follow from the group's own eigenvectors (Sylvester and Woodbury:
    W. W. Hager, Updating the inverse of a matrix, SIAM Review 31, 1989), without new ones.

    Parameters
    ----------
    groups : sequence of GroupSpectrum
    columns : (k,) array of int
        Columns that are integrated out.
    deviations : (k,) array
        Prior standard deviations of their amplitudes.
    gram : Gram
    """
    block = GaussianBlock.of(gram.matrix[np.ix_(columns, columns)], deviations)
    used = np.unique(np.concatenate([group.columns for group in groups]))
    place_of = np.zeros(len(gram.score), dtype=int)
    place_of[used] = np.arange(len(used))
    share = block.share(gram.matrix[np.ix_(columns, used)])
    score = gram.score[used] - share.T @ block.share(gram.score[columns])
    log_evidence = np.zeros(len(groups))
    for places in _by_size(groups):
        some = [groups[place] for place in places]
        within = place_of[np.stack([group.columns for group in some])]  # (b, m)
        root = np.stack([group.root for group in some])
        vectors = np.stack([group.vectors for group in some])
        values = np.stack([group.values for group in some])
        taken = (np.moveaxis(share[:, within], 0, 1) * root[:, None]) @ vectors  # (b, k, m)
        along = ((root * score[within])[:, None] @ vectors)[:, 0]
        grids = _grids(some)
        if len(grids.scales[0]) * len(columns) ** 2 < CHEAPER * values.shape[1] ** 2:
            log_evidence[places] = [_beside_few(*each) for each in zip(*grids, values, taken, along, strict=True)]
        else:
            left = np.swapaxes(taken, 1, 2) @ taken
            left *= -1.0
            left[:, np.arange(values.shape[1]), np.arange(values.shape[1])] += values
            remaining, turned = np.linalg.eigh(left)
            log_evidence[places] = _averages(grids, np.maximum(remaining, 0.0), (along[:, None] @ turned)[:, 0])
    return log_evidence


def _by_size(groups: Sequence[GroupSpectrum]) -> list[list[int]]:
    """Return the places of groups of one size, for each size."""
    sizes: dict[int, list[int]] = {}
    for place, group in enumerate(groups):
        sizes.setdefault(len(group.columns), []).append(place)
    return list(sizes.values())


def _grids(groups: Sequence[GroupSpectrum]) -> LogNodes:
    """Return the nodes of several groups as rows, (n, t); shorter ones end with some of no weight."""
    longest = max(len(group.grid.scales) for group in groups)
    scales, log_weights = np.ones((len(groups), longest)), np.full((len(groups), longest), -np.inf)
    for row, group in enumerate(groups):
        scales[row, : len(group.grid.scales)], log_weights[row, : len(group.grid.scales)] = group.grid
    return LogNodes(scales, log_weights)


def _averages(grids: LogNodes, values: Floats, scores: Floats) -> Floats:
    """Return the log evidence of groups of one size, (n,), from eigenvalues and scores along eigenvectors, (n, k)."""
    squared = grids.scales[:, :, None] ** 2
    visible = 1.0 + squared * values[:, None, :]
    gain = np.einsum("ntk,nk->nt", squared / visible, scores**2) - np.log(visible).sum(axis=-1)
    return log_sums(0.5 * gain + grids.log_weights)


def _beside_few(scales: Floats, log_weights: Floats, values: Floats, taken: Floats, along: Floats) -> float:
    """Return the log evidence of a group of which a few others have taken their share.

    Parameters
    ----------
    scales, log_weights : (t,) arrays
    values : (m,) array
        Eigenvalues of the information before.
    taken : (k, m) array
        Matrix ``U``, where ``U'U`` is what was taken, along the eigenvectors.
    along : (m,) array
        Score after it was taken.
    """
    squared = scales[:, None] ** 2
    visible = squared * values
    share = squared / (1.0 + visible)  # (t, m)
    lower = np.linalg.cholesky(np.eye(len(taken)) - (taken * share[:, None]) @ taken.T)
    pull = np.linalg.solve(lower, ((share * along) @ taken.T)[..., None])[..., 0]
    log_det = np.log1p(visible).sum(axis=1) + 2.0 * np.log(np.diagonal(lower, axis1=1, axis2=2)).sum(axis=1)
    gain = share @ along**2 + (pull**2).sum(axis=1) - log_det
    return log_sum((0.5 * gain + log_weights).tolist())


def log_evidences_of_scores(groups: Sequence[GroupSpectrum], gram: Gram, scores: Floats) -> Floats:
    """Return the log evidence of some groups together for many scores, shape (d,).

    The nodes are those of `average_over_scales`, unless there are so many groups that their product is thinned.

    Parameters
    ----------
    groups : sequence of GroupSpectrum
    gram : Gram
    scores : (d, m) array
        Scores of all columns.
    """
    if not groups:
        return np.zeros(len(scores))
    thinned = thinning([len(group.grid.scales) for group in groups], MOST_NODES)
    nodes = [group.nodes(thinned) for group in groups]
    log_weights = reduce(np.add.outer, (grid.log_weights for grid in nodes)).ravel()
    step = max(BLOCK // len(log_weights), 1)
    parts = [scores[start : start + step] for start in range(0, len(scores), step)]
    return np.concatenate([log_sums(_log_ratios(groups, gram, nodes, part).T + log_weights) for part in parts])


def _log_ratios(groups: Sequence[GroupSpectrum], gram: Gram, nodes: Sequence[LogNodes], scores: Floats) -> Floats:
    """Return the logarithm of the evidence relative to nothing, (t1 ... tk, d), for all combinations of scales.

    Parameters
    ----------
    groups : sequence of GroupSpectrum
        At least one.
    gram : Gram
    nodes : sequence of LogNodes
        Of each group.
    scores : (d, m) array
        Scores of all columns.
    """
    first, rest = groups[0], groups[1:]
    columns = np.concatenate([np.zeros(0, dtype=int), *(group.columns for group in rest)])
    root = np.concatenate([np.zeros(0), *(group.root for group in rest)])
    matrix = (root[:, None] * gram.matrix[np.ix_(columns, columns)] * root)[None]  # (b, m, m), b scales so far
    score = (root * scores[:, columns]).T[None]  # (b, m, d)
    gain = np.zeros((1, len(scores)))
    shared = first.root[:, None] * gram.matrix[np.ix_(first.columns, columns)] * root
    values, cross = first.values[None], (first.vectors.T @ shared)[None]
    along = (first.vectors.T @ (first.root * scores[:, first.columns]).T)[None]
    for index, grid in enumerate(nodes):
        if index:
            size = len(groups[index].columns)
            values, vectors = np.linalg.eigh(matrix[:, :size, :size])
            values = np.maximum(values, 0.0)
            turned = np.swapaxes(vectors, 1, 2)
            along = turned @ score[:, :size]
            cross = turned @ matrix[:, :size, size:]
            matrix, score = matrix[:, size:, size:], score[:, size:]
        squared = grid.scales[:, None] ** 2
        visible = squared * values[:, None, :]  # (b, t, k)
        share = squared / (1.0 + visible)
        now = 0.5 * (share @ along**2 - np.log1p(visible).sum(axis=-1, keepdims=True))
        gain = (gain[:, None] + now).reshape(-1, len(scores))
        if index + 1 < len(nodes):
            left = cross.shape[-1]
            weighted = np.swapaxes(cross, 1, 2)[:, None] * share[:, :, None, :]  # (b, t, m, k)
            matrix = (matrix[:, None] - weighted @ cross[:, None]).reshape(-1, left, left)
            score = (score[:, None] - weighted @ along[:, None]).reshape(-1, left, len(scores))
    return gain


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
    if not groups:
        return ScaleAverage(0.0, (), np.zeros(()))
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
        log_terms = _log_ratios(groups, gram, nodes, gram.score[None]).reshape([len(grid.scales) for grid in nodes])
        log_terms = log_terms + reduce(np.add.outer, (grid.log_weights for grid in nodes))
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
