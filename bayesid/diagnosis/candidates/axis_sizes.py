"""Sizes of the axes of what nobody listed, learnt from what causes leave.

A smooth disturbance of equal variance about all axes pays for every axis on which it is absent: an error of one
gyro axis, or a torque about two axes, loses dozens of nats to causes that act on these alone and imitate it. It may
therefore also have a size of its own about each axis. Beside some causes, the sizes of most evidence are found by
the update of D. J. C. MacKay, Bayesian interpolation, Neural Computation 4, 1992. Their evidence is charged for the
choice, so that it is that of an average over the ratio of each axis' standard deviation to the largest. The ratio is
uniform: a torque that points anywhere is seldom about one base axis alone, and what is is rather a wheel.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesid._math.arrays import Floats, Integers, log_sum
from bayesid.diagnosis.candidates.linear_model import Linearisation, SignatureBank
from bayesid.diagnosis.evidence.cause_sets import NEAR, SetProbabilities
from bayesid.diagnosis.evidence.gram import GaussianBlock
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.evidence.set_evidence import SetEvidence

__all__ = ["axis_sizes", "with_axis_sizes"]

SMALLEST = 1e-4
"""Smallest variance of an axis relative to the largest: below, it is as good as absent."""

POINTS = 40
"""Sizes of one axis over which the evidence is averaged."""

UPDATES = 8
"""Updates of the sizes, after which they hardly change."""

SHARE = 0.5
"""Prior probability that the axes have sizes of their own."""


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


class _Form(NamedTuple):
    """Form of a disturbance with axes of sizes of their own: its share, and the weight of a set with it [nats]."""

    group: AmplitudeGroup
    share: float
    log_weight: float


def with_axis_sizes(point: Linearisation, probabilities: SetProbabilities) -> Linearisation:
    """Return the linear model in which smooth disturbances also have axes of different sizes, where that matters.

    The sizes are those of most evidence beside every choice among the causes of the most probable set that has any.

    Parameters
    ----------
    point : Linearisation
    probabilities : SetProbabilities
    """
    best = next((one.causes for one in probabilities.sets if one.causes), ())
    chosen = [names for size in range(len(best) + 1) for names in combinations(best, size)]
    forms = {
        cause.name: [form for names in chosen for form in _beside(point, cause, names, probabilities)]
        for cause in point.bank.causes
        if cause.generic
    }
    least = max(one.log_evidence + one.log_prior for one in probabilities.sets) - NEAR
    if max((form.log_weight for each in forms.values() for form in each), default=-np.inf) < least:
        return point
    causes = tuple(_with_forms(cause, forms.get(cause.name, [])) for cause in point.bank.causes)
    return point.with_bank(SignatureBank(point.bank.signatures, causes))


def _with_forms(cause: CandidateCause, forms: Sequence[_Form]) -> CandidateCause:
    if not forms:
        return cause
    shares = [(1.0 - SHARE) * float(np.exp(variant.log_weight)) for variant in cause.variants]
    shares += [SHARE * form.share / len(forms) for form in forms]
    return replace(cause, others=(*cause.others, *((form.group,) for form in forms)), shares=tuple(shares))


def _beside(
    point: Linearisation, cause: CandidateCause, names: tuple[str, ...], probabilities: SetProbabilities
) -> Iterator[_Form]:
    """Yield the most probable form of a disturbance beside some causes, with the sizes of its axes."""
    evidence = point.evidence
    forms = evidence.forms((*names, cause.name))
    variant = cause.variants[forms[cause.name]]
    (group,) = variant.groups
    if group.spread is None:
        return
    kept = np.flatnonzero(group.spread)
    axes = _axes(point.bank, group.name)[kept]
    gram = evidence.beside(names, {name: forms[name] for name in names}, [group.name])
    sizes = axis_sizes(gram.matrix[np.ix_(kept, kept)], gram.score[kept], group.spread[kept], axes)
    spread = np.zeros(len(group.spread))
    spread[kept] = group.spread[kept] * sizes.ratios[axes]
    group, share = replace(group, spread=spread), float(np.exp(variant.log_weight - sizes.charge))
    gain = SetEvidence(gram, [CandidateCause(cause.name, (group,))]).of_forms(cause.name)[0] + np.log(SHARE * share)
    counts = len(probabilities.causes), True, len(probabilities.generics)
    log_prior = probabilities.prior.log_probability(len(names), *counts)
    yield _Form(group, share, float(gain) + log_prior + (evidence.log_evidence(names) if names else 0.0))


def _axes(bank: SignatureBank, group: str) -> Integers:
    """Return the axis of each column of a group: of torques and forces they alternate, errors have one each."""
    waves = [wave for wave in bank.signatures if wave.name == group]
    each = len(waves) // len({wave.recording for wave in waves})
    counts = [wave.columns.shape[1] for wave in waves]
    parts = [np.arange(n) % 3 if each == 1 else np.full(n, k % each) for k, n in enumerate(counts)]
    return np.concatenate(parts)
