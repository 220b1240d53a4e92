"""Sizes of the axes of what nobody listed, learnt from what causes leave.

A smooth disturbance of equal variance about all axes pays for every axis on which it is absent: an error of one
gyro axis, or a torque about two axes, loses dozens of nats to causes that act on these alone and imitate it. It may
therefore also have a size of its own about each axis. Beside some causes, the sizes of most evidence are found by
the update of D. J. C. MacKay, Bayesian interpolation, Neural Computation 4, 1992. Their evidence is charged for the
choice, so that it is that of an average over the ratio of each axis' standard deviation to the largest. The ratio is
uniform: a torque that points anywhere is seldom about one base axis alone, and what is is rather a wheel.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesid._math.arrays import Floats, Integers, log_sum
from bayesid.diagnosis.candidates.further_forms import Chosen, with_further_forms
from bayesid.diagnosis.candidates.linear_model import Linearisation, SignatureBank
from bayesid.diagnosis.evidence.cause_sets import SetProbabilities
from bayesid.diagnosis.evidence.gram import GaussianBlock, Gram
from bayesid.diagnosis.evidence.scales import Variant

__all__ = ["axis_sizes", "with_axis_sizes"]

SMALLEST = 1e-4
"""Smallest variance of an axis relative to the largest: below, it is as good as absent."""

POINTS = 40
"""Sizes of one axis over which the evidence is averaged."""

UPDATES = 8
"""Updates of the sizes, after which they hardly change."""


class AxisSizes(NamedTuple):
    """Variances of the axes relative to the largest, (axes,), and what the evidence is charged for them [nats]."""

    ratios: Floats
    charge: float


def axis_sizes(information: Floats, score: Floats, spread: Floats, axes: Integers) -> AxisSizes:
    """Return the sizes of the axes that have most evidence.

    Parameters
    ----------
    information : (m, m) array
        On the amplitudes.
    score : (m,) array
    spread : (m,) array
        Positive variances of the amplitudes of one axis relative to each other.
    axes : (m,) array of int
        Axis of each amplitude, from zero on.
    """
    count = int(axes.max()) + 1
    root = np.sqrt(spread)
    scaled, pull = root[:, None] * information * root, root * score
    trace = float(np.trace(scaled))
    # of a score with the covariance A + A A v on average over the axes
    variance = np.full(count, max(float(pull @ pull) - trace, 1e-3 * trace) / float((scaled**2).sum()))
    for _ in range(UPDATES):
        deviations = np.sqrt(variance)[axes]
        covariance = np.linalg.inv(np.eye(len(axes)) + deviations[:, None] * scaled * deviations)
        amplitudes = -covariance @ (deviations * pull)
        determined = np.bincount(axes, 1.0 - np.diag(covariance), count)
        size = np.bincount(axes, amplitudes**2, count) / np.maximum(determined, 1e-3)
        variance = np.maximum(variance * size, SMALLEST * (variance * size).max())
    charges = [
        _charge(scaled, pull, np.sqrt(variance)[axes], axes == axis, variance.max())
        for axis in range(count)
        if axis != np.argmax(variance)
    ]
    return AxisSizes(variance / variance.max(), sum(charges))


def _charge(information: Floats, score: Floats, deviations: Floats, here: NDArray[np.bool_], largest: float) -> float:
    """Return by how much the evidence at the size of one axis exceeds its average over all sizes, the others fixed."""
    others = GaussianBlock.of(information[np.ix_(~here, ~here)], deviations[~here])
    share = others.share(information[np.ix_(~here, here)])
    values, vectors = np.linalg.eigh(information[np.ix_(here, here)] - share.T @ share)
    squares = (vectors.T @ (score[here] - share.T @ others.share(score[~here]))) ** 2
    chosen = deviations[here][0] ** 2
    ratios = np.exp(np.linspace(0.5 * np.log(SMALLEST), 0.0, POINTS))  # of deviations, with weights for a uniform prior
    variances = np.append(largest * ratios**2, chosen)[:, None]
    visible = 1.0 + variances * np.maximum(values, 0.0)
    each = 0.5 * (variances / visible * squares - np.log(visible)).sum(axis=1)
    return max(float(each[-1] - log_sum(each[:-1] + np.log(ratios / ratios.sum()))), 0.0)


def with_axis_sizes(point: Linearisation, probabilities: SetProbabilities) -> Linearisation:
    """Return the linear model in which smooth disturbances also have axes of different sizes, where that matters.

    The sizes are those of most evidence beside every choice among the causes of the most probable set that has any.

    Parameters
    ----------
    point : Linearisation
    probabilities : SetProbabilities
    """

    def choose(variant: Variant, gram: Gram) -> Chosen:
        (group,) = variant.groups
        spread = np.ones(len(gram.groups[group.name])) if group.spread is None else group.spread
        present = np.flatnonzero(spread)
        axes = _axes(point.bank, group.name)[present]
        sizes = axis_sizes(gram.matrix[np.ix_(present, present)], gram.score[present], spread[present], axes)
        sized = np.zeros(len(spread))
        sized[present] = spread[present] * sizes.ratios[axes]
        return Chosen(sized, variant.log_weight - sizes.charge)

    return with_further_forms(point, probabilities, choose)


def _axes(bank: SignatureBank, group: str) -> Integers:
    """Return the axis of each column of a group: of torques and forces they alternate, errors have one each."""
    waves = [wave for wave in bank.signatures if wave.name == group]
    each = len(waves) // len({wave.recording for wave in waves})
    counts = [wave.columns.shape[1] for wave in waves]
    parts = [np.arange(n) % 3 if each == 1 else np.full(n, k % each) for k, n in enumerate(counts)]
    return np.concatenate(parts)
