"""Causes that change the model in the same way, as far as the data can tell."""

from __future__ import annotations

import numpy as np

from bayesid._math.arrays import Floats, Integers
from bayesid.diagnosis.evidence.gram import Gram, independent_directions
from bayesid.diagnosis.evidence.set_evidence import SetEvidence

__all__ = ["classes_of_equivalents"]

SEEN = 1.0
"""Information on the amplitudes in units of their largest scale, in the most visible direction, from which on the data
see a difference."""

ROUNDING = 1e-9
"""Fraction of a cause's whole information below which what another leaves of it is rounding."""


def classes_of_equivalents(evidence: SetEvidence) -> tuple[tuple[str, ...], ...]:
    """Return the causes of the catalogue in classes, each sorted, in the order of their first names.

    Two causes are equivalent where neither offers anything visible, at the bounds of its scales, beyond what amplitudes
    of any size of the other can imitate. A joint effect of two causes is not compared with a third. What the data
    cannot see at all is equivalent to nothing, and each such cause is a class of its own. A cause joins a class if it
    is equivalent to every member.
    """
    columns, units, directions = {}, {}, {}
    for name in evidence.catalogue:
        spectra = evidence.spectra([name])
        columns[name] = np.concatenate([own.columns for own in spectra])
        units[name] = np.concatenate([own.root * own.range.high for own in spectra])
        directions[name] = independent_directions(evidence.gram.matrix[np.ix_(columns[name], columns[name])])
    visible = {name for name in evidence.catalogue if _largest(evidence.gram, columns[name], units[name]) >= SEEN}

    def imitated(name: str, other: str) -> bool:
        left = _largest(evidence.gram, columns[name], units[name], columns[other], directions[other])
        return left < max(SEEN, ROUNDING * _largest(evidence.gram, columns[name], units[name]))

    classes: list[list[str]] = []
    for name in evidence.catalogue:
        fitting = (
            members
            for members in classes
            if name in visible
            and members[0] in visible
            and all(imitated(name, other) and imitated(other, name) for other in members)
        )
        joined = next(fitting, None)
        if joined is None:
            classes.append([name])
        else:
            joined.append(name)
    return tuple(tuple(members) for members in classes)


def _largest(
    gram: Gram, columns: Integers, units: Floats, others: Integers | None = None, directions: Floats | None = None
) -> float:
    """Return the largest eigenvalue of the information on columns, after others have taken their share."""
    matrix = gram.matrix[np.ix_(columns, columns)]
    if others is not None and directions is not None:
        shared = gram.matrix[np.ix_(columns, others)] @ directions
        matrix = matrix - shared @ shared.T
    return float(np.linalg.eigvalsh(units[:, None] * matrix * units).max(initial=0.0))
