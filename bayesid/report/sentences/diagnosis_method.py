"""Sentences on how a diagnosis was reached, and its glossary."""

from __future__ import annotations

from collections.abc import Iterator

from bayesid.diagnosis import Diagnosis
from bayesid.diagnosis.evidence.verdict import COVERED, MOST_ALTERNATIVES, NAMED
from bayesid.report.numbers import format_number

__all__ = ["GLOSSARY", "computation_sentence", "method_sentences"]

GLOSSARY = (
    ("σ", "Standard deviation of a sensor's noise per sample, with that of the encoders carried through the dynamics."),
    ("chi-square per sample", "Mean square of the residuals in σ; one where the model is right."),
    ("log evidence", "Natural logarithm of the probability of the data under a set of causes, over that under none."),
    ("probability", "Evidence times prior of a set, over the sum of all sets; of a cause, summed over its sets."),
    ("class", "Causes that change the model in the same way, as far as these data can tell; they share a probability."),
    ("something unknown", "Any candidate that names no cause: a smooth torque, force or sensor error, or a pulse."),
    ("p, family-wise", "Probability that noise alone makes the loudest of all tests as loud as this."),
    ("signal to noise", "Root of the decrease of chi-square by a candidate, less its degrees of freedom."),
    ("power", "Probability that a candidate drawn from its prior would have raised the alarm."),
    ("95 % limit", "Value that the magnitude of a quantity stays below with a probability of 95 %."),
    ("cosine", "Correlation of the signals of two causes, apart from what the model's unknowns can explain."),
    ("held-out log score", "Logarithm of the density that a model, fitted to the other recordings, gives to one."),
    ("without, with", "Fitted with the present model, and with the named causes in it."),
)
"""Terms of the report and their meanings."""


def method_sentences(result: Diagnosis) -> Iterator[str]:
    """Return how the verdict was reached."""
    prior, probabilities = result.probabilities.prior, result.probabilities
    yield (
        f"An alarm is raised where the loudest of {result.alarm.tests} tests together is as loud as noise alone "
        f"makes it in less than {100.0 * result.alarm.level:g} % of cases, all dependence between the tests included."
    )
    yield (
        f"{len(probabilities.causes)} causes of the catalogue are possible here: {', '.join(probabilities.causes)}. "
        f"Beside them {len(probabilities.generics)} candidates stand for what is in no catalogue: "
        f"{', '.join(probabilities.generics)}."
    )
    yield (
        "The probability of a set of causes is its evidence times its prior. The prior has two numbers: one more cause "
        f"is at work with a probability of {format_number(prior.one_more)}, however many there are, and something "
        f"outside the catalogue with {format_number(prior.generic)}. All sets of one size are equally probable "
        "beforehand."
    )
    yield (
        "The scale of the amplitudes of a cause that share a unit is itself unknown: every power of ten between what "
        "the data cannot resolve and the physical bound is equally probable."
    )
    yield (
        f"Causes are named where the class of each has a probability of {NAMED:g} or more. Otherwise the verdict is "
        f"ambiguous if two to {MOST_ALTERNATIVES} alternatives hold {format_number(100.0 * COVERED)} %, and unresolved "
        "if more are needed. It is unknown if candidates that name nothing hold the majority."
    )
    if result.held:
        yield (
            "Every fit of the present model drove its bodies to where their prior all but excludes them. They are held "
            "at the prior's centre, and what each candidate changes is computed along the motion that the data show."
        )
    yield f"Seed of all random numbers: {result.seed}."


def computation_sentence(result: Diagnosis) -> str:
    """Return how long each phase of the diagnosis took."""
    phases = ", ".join(f"{name} {seconds:.1f} s" for name, seconds in result.seconds.items())
    return f"Time by phase: {phases}; {sum(result.seconds.values()):.1f} s in all."
