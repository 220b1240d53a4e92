"""Rank and linear dependence of a regressor's columns, distinguished from rounding errors.

The QR decompositions follow Gautier (J. Robotic Systems 1991); singular values check them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import qr

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats

__all__ = ["ZERO", "checked_rank", "equilibrated", "regrouping", "spanning"]

ZERO = 1e-10
"""Relative size up to which a singular value, or the part of a column that no other column explains, is rounding."""

# relative length below which a column is not scaled to unit length, because that would amplify its rounding errors
FAINT = 1e-3
GAP = 1e3  # smallest ratio of the last singular value kept to the first dropped at which the rank counts as determined
# remedy in the errors of this module: nearly dependent columns come from nearly degenerate geometry
REMEDY = "Look for joints that are almost, but not quite, parallel or on one axis"


def equilibrated(matrix: Floats) -> tuple[Floats, Floats]:
    """Return a matrix with its columns scaled to unit length, and the divisors of the columns.

    Faint columns are divided by the length at which a column starts to count as faint, and zero columns by one.
    """
    length = np.linalg.norm(matrix, axis=0)
    length = np.maximum(length, FAINT * length.max(initial=0.0))
    length = np.where(length > 0.0, length, 1.0)
    return matrix / length, length


def spanning(matrix: Floats, order: Sequence[int]) -> list[int]:
    """Return the indices of the columns, taken in the given order, that the columns before them do not span."""
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


def checked_rank(matrix: Floats, rank: int) -> tuple[float, float]:
    """Check a rank, and return the last singular value kept and the first dropped, relative to the largest.

    Raises
    ------
    InputError
        If QR with column pivoting or the singular values give another rank, or the two values are too close.
    """
    if not matrix.size:
        return 1.0, 0.0
    values = np.linalg.svd(matrix, compute_uv=False)
    diagonal = np.abs(np.diag(qr(matrix, mode="r", pivoting=True)[0]))
    ranks = {rank, int(np.sum(diagonal > ZERO)), int(np.sum(values > ZERO))}
    kept = float(values[rank - 1] / values[0])
    dropped = float(values[rank] / values[0]) if rank < len(values) else 0.0
    if len(ranks) > 1 or kept < GAP * dropped:
        raise InputError(
            f"the number of base parameters cannot be told: {' or '.join(map(str, sorted(ranks)))}, with relative "
            f"singular values {kept:.2g} and {dropped:.2g} on both sides",
            remedy=REMEDY,
        )
    return kept, dropped


def regrouping(matrix: Floats, independent: Sequence[int], dependent: Sequence[int]) -> Floats:
    """Solve ``matrix[:, dependent] = matrix[:, independent] beta`` with one refinement, and set rounding to zero.

    Raises
    ------
    InputError
        If the solution leaves a residual larger than rounding.
    """
    first, second = matrix[:, independent], matrix[:, dependent]
    beta = np.linalg.lstsq(first, second)[0]
    beta = beta + np.linalg.lstsq(first, second - first @ beta)[0]
    beta[np.abs(beta) < ZERO] = 0.0
    worst = float(np.abs(second - first @ beta).max(initial=0.0))
    if worst > 10.0 * ZERO:
        raise InputError(f"the dependent parameters regroup only to {worst:.2g}", remedy=REMEDY)
    return beta
