"""Words for amplitudes of causes and for limits on them, with the unit behind every run of quantities that share it."""

from __future__ import annotations

from collections.abc import Sequence

from bayesid.diagnosis import Candidate
from bayesid.diagnosis.response.effect_functions import CauseAmplitude
from bayesid.report.numbers import format_number, format_quantity, format_unit

__all__ = ["amplitude_text", "limit_text"]

SHOWN = 3
"""Largest number of quantities of one cause by default."""

NOT_OF_SIZE = ("frequency", "damping")
"""Quantities of a vibration that say nothing of its size, so that a limit on them would mislead."""


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
