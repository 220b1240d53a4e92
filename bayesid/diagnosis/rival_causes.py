"""Rivals of the named causes: other sets of causes that leave nothing but noise, and how alike their signals look."""

from __future__ import annotations

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.cause_search import Hypothesis
from bayesid.diagnosis.diagnosis_run import Diagnosis
from bayesid.diagnosis.verdict import fit_without

__all__ = ["differing", "improbable_rivals", "signal_cosine"]

VISIBLE = 1.0
"""Information, at the prior's scale, from which on a direction of a cause can be seen."""


def differing(first: Hypothesis, second: Hypothesis) -> tuple[list[str], list[str]]:
    """Return the causes that only the first of two hypotheses has, and those that only the second has."""
    mine = [label for label in first.labels if label not in second.labels]
    theirs = [label for label in second.labels if label not in first.labels]
    return mine, theirs


def improbable_rivals(result: Diagnosis) -> list[Hypothesis]:
    """Return hypotheses of as many causes that leave nothing but noise either, but are too improbable to be rivals.

    Other names for the same change of the model are left out.
    """
    verdict = result.verdict
    best = verdict.best
    same = [{*best.labels} - {cause} | {name} for cause, names in verdict.equivalents.items() for name in names]
    return [
        other
        for other in result.search.tried
        if verdict.causes
        and other.adequate
        and len(other.labels) == len(best.labels)
        and {*other.labels} not in [{*best.labels}, *same, *({*rival.labels} for rival in verdict.rivals)]
    ]


def signal_cosine(best: Hypothesis, rival: Hypothesis, result: Diagnosis) -> float | None:
    """Return the cosine between the signal of one hypothesis and the nearest signal that a rival can make.

    Of both signals only the part counts that the model's unknowns cannot take. The cosine is one if the manoeuvres
    cannot tell the two apart.

    Returns
    -------
    float or None
        None where the hypotheses do not differ, or where a cause has no columns, as faults of noise have none.
    """
    mine, theirs = differing(best, rival)
    columns = result.search.suite.effects
    if not mine or not theirs or not {*mine, *theirs} <= columns.keys():
        return None
    base = result.before
    a = np.concatenate([columns[label] for label in mine], axis=1)
    b = np.concatenate([columns[label] for label in theirs], axis=1)
    return _cosine(fit_without(base, np.concatenate([a, b], axis=1)), a.shape[1], -a.T @ base.fit.residual)


def _cosine(gram: Floats, count: int, pull: Floats) -> float | None:
    first, cross, rest = gram[:count, :count], gram[:count, count:], gram[count:, count:]
    amplitude = np.linalg.solve(first + np.eye(count), pull)
    energy = float(amplitude @ first @ amplitude)
    if energy <= 0.0:
        return None
    values, vectors = np.linalg.eigh(rest)
    seen = values > VISIBLE
    along = (vectors[:, seen].T @ (cross.T @ amplitude)) / np.sqrt(values[seen])
    return float(np.sqrt(min(1.0, float(along @ along) / energy)))
