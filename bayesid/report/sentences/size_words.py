"""Words for the size and direction of a cause with 95 %."""

from __future__ import annotations

import math

from bayesid.diagnosis import Hypothesis
from bayesid.diagnosis.outcome.candidate_table import CauseAmplitude, amplitudes_of
from bayesid.diagnosis.outcome.cause_sizes import Z95, VectorSize, vector_size
from bayesid.report.numbers import format_number, format_quantity, format_unit, format_vector

__all__ = ["size_text", "vector_text"]

SHOWN = 3
"""Largest number of quantities of a cause that is no vector."""


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
