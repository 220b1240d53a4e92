"""Sentences on what an identification did not learn, so that the prior does not pass for knowledge."""

from __future__ import annotations

from bayesid._io.words import abridged
from bayesid.identifiability.direction_words import subject
from bayesid.identifiability.directions import directions
from bayesid.identifiability.local_knowledge import Knowledge
from bayesid.identifiability.practical_identifiability import covers_all
from bayesid.inference.contraction import ContractionVerdict
from bayesid.inference.identification import Identification

__all__ = ["unidentifiable_sentences"]


def unidentifiable_sentences(result: Identification) -> list[str]:
    """Return sentences that name the quantities and directions in which the posterior is nearly the prior.

    The list is empty where there are none.
    """
    if not result.bodies:
        return []
    sentences = []
    for verdict, text in (
        (ContractionVerdict.NOT, "is the prior"),
        (ContractionVerdict.WEAKLY, "owes more to the prior than to the data"),
    ):
        names = [name for name, item in result.contraction.items() if item.verdict is verdict]
        if names:
            sentences.append(f"What is said of {abridged(names)} {text}.")
    knowledge = Knowledge.at(result.posterior, result.optimum.z)
    subjects = [
        subject(item, knowledge.values, knowledge.prior_sd, covers_all(result.posterior))
        for item in directions(knowledge)
        if item.verdict is ContractionVerdict.NOT
    ]
    if subjects:
        sentences.append(f"The data do not tell of these directions: {abridged(subjects, separator='; ')}.")
    return sentences
