"""Fifth page of a diagnosis report: what to fly next, what could not be seen or told apart, and what was assumed."""

from __future__ import annotations

from bayesid.diagnosis import Diagnosis, Status
from bayesid.inference.predicted_readings import integration_error_at
from bayesid.report.document import Document
from bayesid.report.identification_report import add_joints
from bayesid.report.sentences.diagnosis_method import computation_sentence, method_sentences
from bayesid.report.sentences.model_assumptions import model_sentences
from bayesid.report.sentences.next_steps import action_sentence, advice_sentences
from bayesid.report.tables import diagnosis_tables, probability_tables

__all__ = ["NEXT", "add_assumptions", "add_limits"]

NEXT = "Next experiment and limits"
"""Title of the section that says what to fly next."""

PAIRS = 10
"""Largest number of pairs in the table of causes that imitate each other."""


def add_limits(document: Document, result: Diagnosis, advice: str | None = None) -> None:
    """Add the manoeuvres to fly, the candidates out of reach, the pairs that imitate each other, and the method."""
    document.section(NEXT)
    document.paragraph(action_sentence(result))
    document.items([*advice_sentences(result), *([advice] if advice else [])])
    _add_unseen(document, result)
    if pairs := result.inseparable_pairs[:PAIRS]:
        document.table(
            ["cause", "other", "largest cosine", "smallest cosine", ""],
            probability_tables.pair_rows(pairs),
            ("Named causes" if result.verdict.causes else "The most probable causes")
            + " and those that imitate them best, apart from what the model's unknowns explain. Where the largest "
            "cosine is near one, some change by the one can be taken for some change by the other; where the smallest "
            "is, too, these manoeuvres cannot tell them apart at all.",
            ["left", "left", "right", "right", "left"],
        )
    document.paragraph("How the verdict was reached:")
    document.items([*method_sentences(result), computation_sentence(result)])


def _add_unseen(document: Document, result: Diagnosis) -> None:
    if hidden := result.unseen_candidates:
        document.paragraph(
            "The following candidates could not have been seen: drawn from their priors, these manoeuvres would have "
            "raised no alarm in more than half of all cases. Their absence from the verdict says little about them."
        )
        document.table(
            ["candidate", "power", "95 % limits on its magnitude"],
            diagnosis_tables.unseen_rows(hidden),
            "Candidates out of reach of these manoeuvres.",
            ["left", "right", "left"],
        )
    elif result.verdict.status in (Status.ADEQUATE, Status.EXPLAINED):
        document.paragraph(
            "Every candidate whose power is known, drawn from its prior, would have raised the alarm in at least half "
            "of all cases: these manoeuvres are enough."
        )


def add_assumptions(document: Document, result: Diagnosis) -> None:
    """Add what the model with the named causes assumes."""
    posterior = result.posterior
    document.section("Assumptions")
    document.items(list(model_sentences(posterior, integration_error_at(posterior, result.start))))
    add_joints(document, posterior)
