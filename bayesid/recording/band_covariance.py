"""Covariances of nearby states of a Gaussian Markov chain, from the banded Cholesky factor of its precision.

Write the precision as ``L L'`` with the lower factor ``L`` in blocks of one node each, which couple neighbours alone.
The states then obey ``x_i = L_ii^-T e_i + G_i x_(i+1)`` with ``G_i = -L_ii^-T L_(i+1,i)'`` and independent standard
normal ``e_i``, so that the covariance of a node with itself follows from that of the next one, and the covariance with
a node ``d`` places on is ``G_i`` times the covariance of the next node with it (Takahashi, Fagan and Chen 1973; Rauch,
Tung and Striebel 1965). The cost grows linearly with the number of nodes; columns of the inverse would make it grow
with its square.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bayesid._math.arrays import Floats

__all__ = ["covariances_by_distance"]


def covariances_by_distance(factor: Floats, order: int) -> Iterator[Floats]:
    """Yield the covariances of all nodes with the node 0, 1, 2 and so on places after them.

    Parameters
    ----------
    factor : (2 order, n order) array
        Lower Cholesky factor of the precision, ``factor[d, j] = L[j + d, j]``.
    order : int
        Number of states of a node.

    Yields
    ------
    (n - d, order, order) array
        Covariances of the states of node ``i`` with those of node ``i + d``.
    """
    count = factor.shape[1] // order
    own, next_ = np.zeros((count, order, order)), np.zeros((count, order, order))
    for column in range(order):
        for row in range(2 * order):
            block = own if row < order else next_
            if row >= column:
                block[:, row % order, column] = factor[row - column, column::order]
    inverse = np.linalg.solve(own, np.broadcast_to(np.eye(order), own.shape))
    noise = inverse.transpose(0, 2, 1) @ inverse
    gain = -inverse.transpose(0, 2, 1) @ next_.transpose(0, 2, 1)
    found = np.empty_like(own)
    found[-1] = noise[-1]
    for node in range(count - 2, -1, -1):
        found[node] = noise[node] + gain[node] @ found[node + 1] @ gain[node].T
    while len(found):
        yield found
        found = gain[: len(found) - 1] @ found[1:]
