"""Limits in a diagnosis report: what to fly next, what could not be seen, the method, and the assumptions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from bayesid._io.words import joined
from bayesid.diagnosis import Candidate, Diagnosis, Status
from bayesid.diagnosis.outcome.inseparable_causes import CausePair
from bayesid.inference.posterior import Posterior
from bayesid.report.diagnosis.cause_words import limit_text
from bayesid.report.diagnosis.diagnosis_sentences import action_sentence, advice_sentences
from bayesid.report.document import Document, Rows
from bayesid.report.model_assumptions import add_joints, model_sentences
from bayesid.report.numbers import format_fixed, format_number

__all__ = [
    "NEXT",
    "add_assumptions",
    "add_limits",
    "computation_sentence",
    "method_sentences",
    "pair_rows",
    "unseen_rows",
]

NEXT = "Next experiment and limits"  # title of the section that says what to fly next
PAIRS = 6  # largest number of pairs in the table of causes that imitate each other
LIMITS = 6  # largest number of limits in a cell of the table of candidates out of reach


def add_limits(document: Document, result: Diagnosis, advice: str | None = None) -> None:
    """Add the manoeuvres to fly, the candidates out of reach, the pairs that imitate each other, and the method."""
    document.section(NEXT)
    stated = action_sentence(result)  # on the first page
    document.items([*(text for text in advice_sentences(result) if text not in stated), *([advice] if advice else [])])
    _add_unseen(document, result)
    if pairs := result.inseparable_pairs[:PAIRS]:
        document.table(
            ["cause", "other", "largest cosine:", "smallest cosine:", "separable at SNR:", ""],
            pair_rows(pairs),
            ("Named causes" if result.named else "The most probable causes")
            + " and those that imitate them best, apart from what the model's unknowns explain. If the largest "
            "cosine is near one, some effect of one cause can be mistaken for some effect of the other; if the "
            "smallest is also near one, these manoeuvres cannot separate the two at all. At the given "
            "signal-to-noise ratio and above, the two are distinguished in 95 % of all cases.",
        )
    document.paragraph("How the verdict was reached:")
    document.items([*method_sentences(result), computation_sentence(result)])


def _add_unseen(document: Document, result: Diagnosis) -> None:
    if hidden := result.unseen_candidates:
        document.paragraph(
            "With a size drawn from its prior, each of the following candidates would have raised no alarm in more "
            "than half of all cases, so its absence from the verdict is only weak evidence against it."
        )
        document.table(
            ["candidate", "power:", "95 % limits, if the only cause"],
            unseen_rows(hidden),
            "Candidates whose typical size these manoeuvres would often have missed.",
        )
    elif result.verdict.status in (Status.ADEQUATE, Status.EXPLAINED):
        document.paragraph(
            "Every candidate whose power is known, with its size drawn from its prior, would have raised the alarm in "
            "at least half of all cases: these manoeuvres are sufficient."
        )


def add_assumptions(document: Document, posterior: Posterior, integration_error: float) -> None:
    """Add what a model assumes.

    Parameters
    ----------
    document : Document
    posterior : Posterior
        Model with the named causes.
    integration_error : float
        Largest error of the integration in standard deviations of a sample.
    """
    document.section("Assumptions")
    document.items(list(model_sentences(posterior, integration_error)))
    add_joints(document, posterior)


def method_sentences(result: Diagnosis) -> Iterator[str]:
    """Return how the verdict was reached."""
    prior, probabilities, settings = result.probabilities.prior, result.probabilities, result.settings
    yield (
        f"An alarm is raised if noise alone would make the most significant of {result.alarm.tests} tests this "
        f"significant in less than {100.0 * result.alarm.level:g} % of cases; the dependence between the candidates is "
        f"included. {_tests_text(result)}"
    )
    yield (
        f"{len(probabilities.causes)} causes of the catalogue are possible here. In addition, "
        f"{len(probabilities.generics)} candidates represent causes outside the catalogue: "
        f"{', '.join(probabilities.generics)}.{_listed_text(result)}"
    )
    yield (
        "The probability of a set of causes is proportional to its evidence times its prior. The prior has two "
        f"numbers: one more cause is present with a probability of {format_number(prior.one_more)}, regardless of how "
        f"many there are, and something outside the catalogue with {format_number(prior.generic)}. All sets of the "
        "same size are equally probable a priori."
    )
    yield (
        "The common scale of the amplitudes of a cause that share a unit is itself unknown: every power of ten between "
        "the resolution of the data and the physical bound is equally probable."
    )
    yield (
        f"Causes are named if the class of each has a probability of {settings.named_from:g} or more. The data are "
        "then explained if the candidates outside the catalogue have a probability of less than "
        f"{settings.remainder_from:g}, and partly explained if they have more. If no cause reaches "
        f"{settings.named_from:g}, the verdict is unknown if the candidates outside the catalogue have more than half "
        f"of the probability, ambiguous if 2 to {settings.most_alternatives} alternatives together reach "
        f"{format_number(100.0 * settings.covered)} %, and unresolved in all other cases."
    )
    if result.bodies_fixed:
        yield (
            "The present model follows the data only with unknowns that their prior all but excludes, or not at all. "
            "The bodies are therefore fixed at the prior's centre, and the effect of each candidate is computed along "
            "the measured motion."
        )
    if result.bounded is not None:
        yield result.bounded
    yield f"Seed of all random numbers: {result.seed}."


def _tests_text(result: Diagnosis) -> str:
    """Return which tests the alarm combines, in terms of the table of all candidates."""
    listed = [row.name for row in result.candidates]
    others = sorted({*result.alarm.candidates.log_evidence, *result.alarm.noise}.difference(listed))
    more = f", and one for {joined(others)}" if others else ""
    return f"The tests are one for each of the {len(listed)} candidates listed in the appendix{more}."


def _listed_text(result: Diagnosis) -> str:
    """Return which candidates have no linear response, so that they are no rows of the table of all candidates."""
    listed = {row.name for row in result.candidates}
    probabilities = result.probabilities
    others = [name for name in (*probabilities.causes, *probabilities.generics) if name not in listed]
    if not others:
        return " The appendix lists all of them."
    verb = "is" if len(others) == 1 else "are"
    return (
        f" The appendix lists {len(listed)} of these candidates; {joined(others)} {verb} omitted there, without a "
        "linear response."
    )


def computation_sentence(result: Diagnosis) -> str:
    """Return how long each phase of the diagnosis took."""
    phases = ", ".join(f"{name} {seconds:.1f} s" for name, seconds in result.seconds.items())
    total = sum(result.seconds.values())
    return f"Time by phase: {phases}; {total:.1f} s in total, without writing this report."


def unseen_rows(rows: Sequence[Candidate]) -> Rows:
    """Return name, power and 95 % limits of candidates that could hardly have been seen."""
    return [[row.name, f"{row.power:.2f}", limit_text(row, LIMITS) or "no limit"] for row in rows]


def pair_rows(pairs: Sequence[CausePair]) -> Rows:
    """Return two causes, their largest and smallest cosine, and what that means."""
    return [
        [
            pair.first,
            pair.second,
            format_fixed(pair.largest, 3),
            format_fixed(pair.smallest, 3),
            format_fixed(pair.parting, 1) if np.isfinite(pair.parting) else "",
            "equivalent" if pair.equivalent else "",
        ]
        for pair in pairs
    ]
