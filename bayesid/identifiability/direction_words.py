"""Description of a direction in words: the pattern that its numbers show, and no more."""

from __future__ import annotations

from enum import Enum

import numpy as np

from bayesid._io.words import joined
from bayesid._math.arrays import Floats
from bayesid.identifiability.directions import Direction, common_factor
from bayesid.inference.contraction import ContractionVerdict

__all__ = ["Part", "describe", "parts_of", "subject"]

ALIKE = 0.95  # cosine between displacement and pattern, in prior standard deviations, above which the pattern is named
NEGLIGIBLE = 0.25  # size relative to the largest part below which a part is left out of the words
NAMED = 3  # largest number of parts named, so that the words remain readable
# nouns in sentences by the first part of a quantity's name
NOUNS = {"mass": "mass", "com": "centre of mass", "inertia": "inertia"}


class Part(Enum):
    """Sign of a part's change relative to the largest part."""

    WITH = "with"
    AGAINST = "against"


def describe(direction: Direction, values: Floats, prior_sd: Floats, whole: bool = True) -> str:
    """Describe a direction, and how much of the prior's width the data left in it.

    Parameters
    ----------
    direction : Direction
        Direction over n quantities.
    values, prior_sd : (n,) array
        Values and prior standard deviations of these quantities, each in its unit.
    whole : bool
        True if the quantities are those of all bodies that are not known exactly.
    """
    what, ratio = subject(direction, values, prior_sd, whole), direction.sd / direction.prior_sd
    verdict = direction.verdict
    if verdict is ContractionVerdict.NOT:
        shared = "cannot be told apart" if " against " in what else "not learnt"
        return f"{what}: {shared}, {_percent(ratio)} of the prior's width is left"
    if verdict is ContractionVerdict.WEAKLY:
        return f"{what}: weakly learnt, {_percent(ratio)} of the prior's width is left"
    return f"{what}: known to {_percent(ratio)} of the prior's width"


def subject(direction: Direction, values: Floats, prior_sd: Floats, whole: bool = True) -> str:
    """Name the quantities that a direction moves."""
    moved = direction.displacement / prior_sd
    bodies = list(dict.fromkeys(name.split(".")[0] for name in direction.names))
    owner = np.array([bodies.index(name.split(".")[0]) for name in direction.names])
    factor = common_factor(direction.names, values)
    if len(bodies) > 1 and _cosine(moved, factor / prior_sd) > ALIKE:
        return "all masses and inertias in proportion (the scale)" if whole else f"{joined(bodies)} in proportion"
    for index, body in enumerate(bodies):
        if _cosine(moved, np.where(owner == index, factor, 0.0) / prior_sd) > ALIKE:
            return f"mass and inertia of {body} in proportion"
    phrases: list[str] = []
    for sign, name in parts_of(direction, prior_sd):
        text = _noun(name, len(bodies) > 1)
        phrases.append(text if not phrases else f"{sign.value} {text}")
    return " ".join(phrases)


def parts_of(direction: Direction, prior_sd: Floats) -> list[tuple[Part, str]]:
    """Return the largest parts of a displacement in units of the prior's widths, with signs relative to the first."""
    moved = direction.displacement / prior_sd
    order = np.argsort(-np.abs(moved))[:NAMED]
    kept = [k for k in order if abs(moved[k]) >= NEGLIGIBLE * abs(moved[order[0]])]
    return [(Part.WITH if moved[k] * moved[order[0]] > 0.0 else Part.AGAINST, direction.names[k]) for k in kept]


def _noun(name: str, several: bool) -> str:
    body, _, key = name.partition(".")
    family, _, axis = key.partition(".")
    text = f"{NOUNS[family]} {axis}".strip()
    return f"{text} of {body}" if several else text


def _cosine(first: Floats, second: Floats) -> float:
    size = float(np.linalg.norm(first) * np.linalg.norm(second))
    return float(abs(first @ second)) / size if size > 0.0 else 0.0


def _percent(ratio: float) -> str:
    value = 100.0 * ratio
    return f"{value:.0f} %" if value >= 1.0 else f"{value:.1g} %"
