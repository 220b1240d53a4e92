"""Evidence of one more cause beside a set whose scales are known: a screening of larger sets."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from bayesid._math.arrays import Floats
from bayesid.diagnosis.set_evidence import SetEvidence

__all__ = ["evidence_beside"]


def evidence_beside(
    evidence: SetEvidence, names: Iterable[str], forms: Mapping[str, int], others: Iterable[str]
) -> dict[str, Floats]:
    """Return what each other cause adds to the log evidence of a set, by the cause's forms, weighed with their shares.

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
    others = list(others)
    rest = SetEvidence(evidence.beside(names, forms, others), [evidence.causes[name] for name in others])
    return {name: rest.of_forms(name) for name in others}
