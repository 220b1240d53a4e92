"""Advice on the next experiment: the manoeuvre that would bring a cause out."""

from __future__ import annotations

from bayesid.simulation.effects import known_effects

__all__ = ["advice"]

ADVICE = {
    "initial-rate": "It is there before the arm moves: record a rest before the motion.",
    "noise": "It is present at rest: record the sensor with the arm at rest.",
    "outliers": "They are single samples: look at the readings themselves, and record at rest.",
    "quantisation": "The readings lie on a lattice: record at rest, and compare with the resolution in the data sheet.",
}
"""Manoeuvre that would bring a cause out that is no effect, by its name or a part of it."""

ANYTHING = "Repeat with other amplitudes, other speeds and the base in another attitude."
"""Advice on a cause of which nothing is known."""


def advice(name: str) -> str:
    """Return the manoeuvre that would bring a cause out, as a sentence; of an effect its class states it."""
    bare = name.partition(":")[0]
    effect = known_effects().get(bare)
    said = effect.separated_by if effect else next((text for key, text in ADVICE.items() if key in bare), "")
    return said or ANYTHING
