"""Rank and dependence of a regressor's columns, told apart from rounding.

QR decompositions as in Gautier (J. Robotic Systems 1991), checked by singular values.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import qr

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats

__all__ = ["ZERO", "checked_rank", "equilibrated", "regrouping", "spanning"]

ZERO = 1e-10
"""Relative size below which a singular value, or the part of a column that no other column explains, is rounding."""

FAINT = 1e-3
"""Relative length below which a column is not stretched to unit length, as that would stretch its rounding."""

GAP = 1e3
"""Ratio of the smallest singular value kept to the largest dropped below which the rank is not told."""

REMEDY = "Look for joints that are almost, but not quite, parallel or on one axis"


def equilibrated(matrix: Floats) -> tuple[Floats, Floats]:
    """Return a matrix with its columns divided by their lengths, but for faint ones, and what they were divided by."""
    length = np.linalg.norm(matrix, axis=0)
    length = np.maximum(length, FAINT * length.max(initial=0.0))
    length = np.where(length > 0.0, length, 1.0)
    return matrix / length, length


def spanning(matrix: Floats, order: Sequence[int]) -> list[int]:
    """Return the columns, taken in order, that the ones before do not span."""
    basis = np.zeros((len(matrix), 0))
    chosen: list[int] = []
    for index in order:
        rest = matrix[:, index]
        for _ in range(2):  # twice is enough against rounding
            rest = rest - basis @ (basis.T @ rest)
        if (size := np.linalg.norm(rest)) > ZERO:
            basis = np.column_stack([basis, rest / size])
            chosen.append(index)
    return chosen


def checked_rank(matrix: Floats, found: int) -> tuple[float, float]:
    """Return the relative singular values on both sides of a rank.

    Raises
    ------
    InputError
        If QR with column pivoting or the singular values give another rank, or there is no gap.
    """
    if not matrix.size:
        return 1.0, 0.0
    values = np.linalg.svd(matrix, compute_uv=False)
    diagonal = np.abs(np.diag(qr(matrix, mode="r", pivoting=True)[0]))
    ranks = {found, int(np.sum(diagonal > ZERO)), int(np.sum(values > ZERO))}
    kept = float(values[found - 1] / values[0])
    dropped = float(values[found] / values[0]) if found < len(values) else 0.0
    if len(ranks) > 1 or kept < GAP * dropped:
        raise InputError(
            f"the number of base parameters cannot be told: {' or '.join(map(str, sorted(ranks)))}, with relative "
            f"singular values {kept:.2g} and {dropped:.2g} on both sides",
            remedy=REMEDY,
        )
    return kept, dropped


def regrouping(matrix: Floats, independent: Sequence[int], dependent: Sequence[int]) -> Floats:
    """Solve ``matrix[dependent] = matrix[independent] beta``, once refined, and drop what is rounding.

    Raises
    ------
    InputError
        If the solution leaves a rest.
    """
    first, second = matrix[:, independent], matrix[:, dependent]
    beta = np.linalg.lstsq(first, second)[0]
    beta = beta + np.linalg.lstsq(first, second - first @ beta)[0]
    beta[np.abs(beta) < ZERO] = 0.0
    worst = float(np.abs(second - first @ beta).max(initial=0.0))
    if worst > 10.0 * ZERO:
        raise InputError(f"the dependent parameters regroup only to {worst:.2g}", remedy=REMEDY)
    return beta
