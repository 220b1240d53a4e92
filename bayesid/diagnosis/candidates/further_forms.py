"""Forms of smooth disturbances that are made beside the causes with which they are weighed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.candidates.linear_model import Linearisation
from bayesid.diagnosis.evidence.cause_sets import NEAR, SetProbabilities
from bayesid.diagnosis.evidence.gram import Gram
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause, Variant
from bayesid.diagnosis.evidence.set_evidence import SetEvidence

__all__ = ["Chosen", "choices_beside", "with_forms", "with_further_forms"]

SHARE = 0.5
"""Prior probability of further forms of one kind."""

LEAST = -200.0
"""Least logarithm of a share, which must be positive."""


class Chosen(NamedTuple):
    """Spread of a further form, (m,), and the logarithm of the share of the prior that its choice leaves it."""

    spread: Floats
    log_share: float


Chooser = Callable[[Variant, Gram], Chosen]
"""Chooses a further form by the most probable form of a disturbance beside some causes and the Gram of what these
leave."""


def choices_beside(probabilities: SetProbabilities) -> list[tuple[str, ...]]:
    """Return every choice among the causes of the most probable set that has any, none of them included."""
    best = next((one.causes for one in probabilities.sets if one.causes), ())
    return [names for size in range(len(best) + 1) for names in combinations(best, size)]


def with_further_forms(
    point: Linearisation, probabilities: SetProbabilities, choose: Chooser, suffix: str = ""
) -> Linearisation:
    """Return the linear model in which smooth disturbances have further forms, or the same if none could matter.

    One form is made beside every choice among the causes of the most probable set that has any.

    Parameters
    ----------
    point : Linearisation
    probabilities : SetProbabilities
    choose : callable
        Chooses the spread of a further form (`Chooser`).
    suffix : str
        What follows the name of a disturbance's group in that of the further form.
    """
    sets, evidence, beside = probabilities.sets, point.evidence, choices_beside(probabilities)
    counts = len(probabilities.causes), True, len(probabilities.generics)
    log_weights = [max(one.log_evidence + one.log_prior for one in sets) - NEAR]  # that a form has to reach, and all
    causes = []
    for cause in point.bank.causes:
        forms: list[tuple[AmplitudeGroup, float]] = []
        for names in beside if cause.generic else ():
            chosen = evidence.forms((*names, cause.name))
            variant = cause.variants[chosen[cause.name]]
            (group,) = variant.groups
            if group.spread is None:
                break
            further = f"{group.name}{suffix}"
            gram = evidence.beside(names, {name: chosen[name] for name in names}, [further])
            form = choose(variant, gram)
            group = replace(group, name=further, spread=form.spread)
            forms.append((group, form.log_share))
            gain = SetEvidence(gram, [CandidateCause(cause.name, (group,))]).of_forms(cause.name)[0]
            total = (evidence.log_evidence(names) if names else 0.0) + float(gain)
            log_weights.append(
                total + probabilities.prior.log_probability(len(names), *counts) + float(np.log(SHARE)) + form.log_share
            )
        causes.append(with_forms(cause, forms))
    if max(log_weights[1:], default=-np.inf) < log_weights[0]:
        return point
    return point.with_bank(replace(point.bank, causes=tuple(causes)))


def with_forms(cause: CandidateCause, forms: Sequence[tuple[AmplitudeGroup, float]]) -> CandidateCause:
    """Return a cause with further forms, which have half of the prior together.

    Parameters
    ----------
    cause : CandidateCause
    forms : sequence of (AmplitudeGroup, float)
        Amplitudes of each, and the logarithm of its share among the further forms.
    """
    if not forms:
        return cause
    shares = [(1.0 - SHARE) * float(np.exp(variant.log_weight)) for variant in cause.variants]
    shares += [SHARE * float(np.exp(max(log_share, LEAST))) / len(forms) for _, log_share in forms]
    return replace(cause, others=(*cause.others, *((group,) for group, _ in forms)), shares=tuple(shares))
