"""Base parameters written as formulas in text."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bayesid.identifiability import BaseParameters
from bayesid.report.numbers import format_number

_LOWERED = str.maketrans("0123456789-", "₀₁₂₃₄₅₆₇₈₉₋")

_LETTERS = {"mass": "m", "first": "h", "inertia": "I"}


def symbol(name: str, bodies: Sequence[str]) -> str:
    """Return ``m₂``, ``hz₂`` or ``Iyy₂`` for a parameter of body 2; the base is body 0."""
    body, quantity = name.split(".", 1)
    kind, _, axes = quantity.partition(".")
    return f"{_LETTERS[kind]}{axes}{str(bodies.index(body)).translate(_LOWERED)}"


def regrouping_rows(base: BaseParameters) -> list[list[str]]:
    """Return every base parameter that is a sum of standard parameters: the name of its first one, and the sum."""
    pairs = zip(base.independent, base.regrouping, strict=True)
    return [[name, symbol(name, _bodies(base)) + _sum(base, row)] for name, row in pairs if row.any()]


def unchanged(base: BaseParameters) -> list[str]:
    """Return the base parameters that are standard parameters."""
    pairs = zip(base.independent, base.regrouping, strict=True)
    return [symbol(name, _bodies(base)) for name, row in pairs if not row.any()]


def _bodies(base: BaseParameters) -> list[str]:
    return list(dict.fromkeys(name.split(".", 1)[0] for name in base.standard))


def _sum(base: BaseParameters, row: NDArray[np.floating]) -> str:
    """Return the terms of a sum; equal ones of successive bodies are drawn together, such as ``m₂₋₄``."""
    bodies, text = _bodies(base), ""
    letters = dict.fromkeys(name.split(".", 1)[1] for name in base.dependent)
    for letter in letters:
        terms = [
            (bodies.index(name.split(".", 1)[0]), round(float(value), 9))
            for name, value in zip(base.dependent, row, strict=True)
            if name.endswith(f".{letter}") and value
        ]
        for run in _runs(terms):
            first, last, value = run[0][0], run[-1][0], run[0][1]
            one = symbol(f"{bodies[first]}.{letter}", bodies)
            group = one if first == last else one + f"-{last}".translate(_LOWERED)
            size = "" if abs(value) == 1.0 else f"{format_number(abs(value), 6)} "
            text += f" {'−' if value < 0.0 else '+'} {size}{group}"
    return text


def _runs(terms: list[tuple[int, float]]) -> list[list[tuple[int, float]]]:
    """Split terms where the body is not the next one or the coefficient changes."""
    runs = [terms[:1]] if terms else []
    for before, term in pairwise(terms):
        if term[0] == before[0] + 1 and term[1] == before[1]:
            runs[-1].append(term)
        else:
            runs.append([term])
    return runs
