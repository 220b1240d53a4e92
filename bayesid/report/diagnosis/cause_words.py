"""Words for sets of causes and their probabilities, for amplitudes, and for size and direction with 95 %."""

from __future__ import annotations

import math
from collections.abc import Sequence

from bayesid.diagnosis import Candidate, Hypothesis
from bayesid.diagnosis.candidates.cause_kind import CauseAmplitude
from bayesid.diagnosis.evidence.verdict import UNKNOWN, ProbableVerdict
from bayesid.diagnosis.outcome.candidate_table import amplitudes_of
from bayesid.diagnosis.outcome.cause_sizes import Z95, VectorSize, vector_size
from bayesid.report.numbers import (
    format_number,
    format_probability,
    format_quantity,
    format_unit,
    format_vector,
)

__all__ = [
    "NOTHING",
    "SOMETHING",
    "amplitude_text",
    "limit_text",
    "probability_text",
    "set_text",
    "size_text",
    "vector_text",
    "verdict_text",
]

NOTHING, SOMETHING = "nothing", "something unknown"
"""Names of the empty set, and of any generic candidate among the alternatives."""

SHOWN = 3  # largest number of quantities of one cause by default

NOT_OF_SIZE = ("frequency", "damping")
"""Quantities of a vibration that say nothing of its size, so that a limit on them would mislead."""


def set_text(names: Sequence[str]) -> str:
    """Return the causes of a set or of an alternative, joined by plus signs."""
    return " + ".join(SOMETHING if name == UNKNOWN else name for name in names) or NOTHING


def probability_text(value: float) -> str:
    """Return a probability as it stands in parentheses: ``probability 0.93``; the letter p is that of p-values."""
    return f"probability {format_probability(value)}"


def verdict_text(verdict: ProbableVerdict) -> str:
    """Return a verdict in a few words, with its causes and what they are ambiguous with."""
    words = verdict.status.value
    if verdict.causes:
        words += f": {set_text(verdict.causes)}"
    return " or ".join([words, *(set_text(names) for names in verdict.ambiguous_with)])


def amplitude_text(amplitude: Sequence[CauseAmplitude], shown: int = SHOWN) -> str:
    """Return an amplitude in words, with the unit behind every run of quantities that share it.

    Parameters
    ----------
    amplitude : sequence of CauseAmplitude
    shown : int
        Largest number of quantities given; of more, those furthest from zero in their standard deviations.
    """
    furthest = sorted(amplitude, key=lambda item: -item.distance)[:shown]
    chosen = [item for item in amplitude if item in furthest]
    return _with_units(
        [(f"{item.quantity.name} {format_quantity(item.mean, item.sd)}", item.quantity.unit) for item in chosen]
    )


def limit_text(row: Candidate, shown: int = SHOWN) -> str:
    """Return the magnitudes that a candidate's quantities stay below with 95 %."""
    limits = [
        (f"{quantity.name} < {format_number(limit, 2)}", quantity.unit)
        for quantity, limit in zip(row.quantities, row.upper_limit.tolist(), strict=False)
        if quantity.name not in NOT_OF_SIZE
    ]
    return _with_units(limits[:shown]) + (", ..." if len(limits) > shown else "")


def _with_units(parts: Sequence[tuple[str, str]]) -> str:
    """Join texts, each with its unit, and print the unit behind the last of every run that shares it."""
    texts = []
    for place, (text, unit) in enumerate(parts):
        last = place + 1 == len(parts) or parts[place + 1][1] != unit
        texts.append(f"{text} {format_unit(unit)}".rstrip() if last else text)
    return ", ".join(texts)


def size_text(hypothesis: Hypothesis, label: str) -> str:
    """Return size and direction of a cause with ± 95 %; of a cause that physics fixes, that it has no free size."""
    vector = vector_size(hypothesis, label)
    if vector is not None and vector.directed:
        return vector_text(vector)
    amplitude = amplitudes_of(hypothesis, label)
    if not amplitude:
        return "fixed by physics"
    furthest = sorted(amplitude, key=lambda item: -item.distance)[:SHOWN]
    parts = [_quantity(item) for item in amplitude if item in furthest]
    return ", ".join(parts) + (", ..." if len(amplitude) > SHOWN else "")


def vector_text(vector: VectorSize) -> str:
    """Return the magnitude of a vector with ± 95 %, and its direction with the half angle of the cone around it."""
    size = format_quantity(vector.magnitude, Z95 * vector.sd)
    degrees = format_number(math.degrees(vector.angle), 2)
    axes = format_vector(vector.direction, 2)
    return f"{size} {format_unit(vector.unit)} along {axes}, within {degrees}°".replace("  ", " ")


def _quantity(item: CauseAmplitude) -> str:
    text = format_quantity(item.mean, Z95 * item.sd)
    return f"{item.quantity.name} {text} {format_unit(item.quantity.unit)}".rstrip()
