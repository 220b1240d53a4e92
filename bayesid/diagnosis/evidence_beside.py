"""Evidence of one more cause beside a set whose scales are known: a screening of larger sets."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from bayesid.diagnosis.scale_prior import CandidateCause
from bayesid.diagnosis.set_evidence import SetEvidence

__all__ = ["evidence_beside"]


MOST_FORMS = 12
"""Most forms of one cause that are weighed beside a set: those that do best by themselves."""


def evidence_beside(
    evidence: SetEvidence, names: Iterable[str], forms: Mapping[str, int], others: Iterable[str]
) -> dict[str, dict[int, float]]:
    """Return what each other cause adds to the log evidence of a set, by the cause's forms.

    The set's scales are held at their most probable values, at which its amplitudes take their share of the Gram; what
    remains is a Gram of single causes. One such Gram serves all other causes. Scales that the addition moves make the
    true gain larger.

    Parameters
    ----------
    evidence : SetEvidence
    names : iterable of str
        The set.
    forms : mapping of str to int
        Form of each of its causes.
    others : iterable of str
        Causes to add, each by itself.
    """
    kept = {name: evidence.ranked[name][:MOST_FORMS] for name in others}
    causes = [_with_forms(evidence.causes[name], places) for name, places in kept.items()]
    rest = SetEvidence(evidence.beside(names, forms, kept), causes)
    return {name: dict(zip(places, rest.of_forms(name).tolist(), strict=True)) for name, places in kept.items()}


def _with_forms(cause: CandidateCause, places: Sequence[int]) -> CandidateCause:
    """Return a cause with some of its forms, each with the share of the prior that it has among all."""
    chosen = [cause.variants[place] for place in places]
    shares = tuple(float(np.exp(variant.log_weight)) for variant in chosen)
    return replace(cause, groups=chosen[0].groups, others=tuple(own.groups for own in chosen[1:]), shares=shares)
