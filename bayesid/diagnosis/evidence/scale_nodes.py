"""Nodes of the trapezoidal rule in the logarithm of a scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.evidence.scale_prior import ScaleRange

__all__ = ["LogNodes", "log_nodes", "log_nodes_of_many", "thinning"]

PER_DECADE = 3.0
"""Nodes per decade of the scale where the data see no amplitude."""

PER_ROOT = 1.5
"""Nodes per decade and root of the number of amplitudes that the data see. The more there are, the better their common
scale is known, to ``1 / sqrt(2 m)`` in its logarithm. The log evidence of one group is then within 0.03 of the exact
integral, and mostly within 0.005."""

FINE = 97
"""Points from which the density of the nodes is integrated."""


@dataclass(frozen=True)
class LogNodes:
    """Scales, with the logarithms of their prior weights.

    Attributes
    ----------
    scales, log_weights : (t,) arrays
    """

    scales: Floats
    log_weights: Floats


def log_nodes(whole: ScaleRange, part: tuple[float, float], values: Floats, thinned: float = 1.0) -> LogNodes:
    """Return nodes over a part of a range; the first and the last weigh half.

    How well the data can tell scales apart, and so how near each other the nodes must be, depends on the number of
    amplitudes that they see: the sum of ``(v / (1 + v))^2`` over the eigenvalues ``v`` of the information at a scale,
    half of the Fisher information on its logarithm. The nodes are equally spaced in the integral of that density.

    Parameters
    ----------
    whole : ScaleRange
        Range over which the scale is log-uniform.
    part : pair of float
        Ends of the part.
    values : (k,) array
        Eigenvalues of the information on the amplitudes in units of the scale.
    thinned : float
        Factor on the number of nodes, at most 1.
    """
    if whole.low == whole.high:
        return LogNodes(np.array([whole.high]), np.zeros(1))
    scales, log_weights = _nodes(np.array([part]), np.array([np.log(whole.high / whole.low)]), values[None], thinned)
    return LogNodes(scales[0], log_weights[0])


def log_nodes_of_many(ranges: Sequence[ScaleRange], values: Floats) -> tuple[Floats, Floats]:
    """Return the scales and the logarithms of the weights of `log_nodes` over the whole ranges of groups of one size.

    Parameters
    ----------
    ranges : sequence of ScaleRange
        None of them a single scale.
    values : (n, k) array
        Eigenvalues of each group.

    Returns
    -------
    scales, log_weights : (n, t) arrays
        Rows with fewer nodes than others end with some of no weight.
    """
    ends = np.array([(own.low, own.high) for own in ranges])
    return _nodes(ends, np.log(ends[:, 1] / ends[:, 0]), values, 1.0)


def _nodes(ends: Floats, widths: Floats, values: Floats, thinned: float) -> tuple[Floats, Floats]:
    """Return nodes between ends, (n, 2), of log-uniform priors of some widths, (n,)."""
    first, last = np.log(ends).T
    logs = first[:, None] + (last - first)[:, None] * np.linspace(0.0, 1.0, FINE)
    density = _density(logs, values)
    covered = np.zeros_like(logs)
    np.cumsum(0.5 * (density[:, 1:] + density[:, :-1]), axis=1, out=covered[:, 1:])
    covered *= ((last - first) / (FINE - 1))[:, None]
    lasts = np.maximum(np.ceil(covered[:, -1] * thinned).astype(int), 2)  # place of the last node
    steps = (covered[:, -1] / lasts)[:, None]
    order = np.arange(lasts.max() + 1)
    at = np.minimum(order, lasts[:, None]) * steps
    places = np.stack([np.interp(*row) for row in zip(at, covered, logs, strict=True)])
    weights = steps / _density(places, values) / widths[:, None]
    rows = np.arange(len(ends))
    weights[:, 0] *= 0.5
    weights[rows, lasts] *= 0.5
    scales = np.exp(places)
    scales[rows, 0], scales[rows, lasts] = ends.T  # exactly
    with np.errstate(divide="ignore"):
        return scales, np.log(np.where(order > lasts[:, None], 0.0, weights))


def _density(logs: Floats, values: Floats) -> Floats:
    """Return the number of nodes per unit of the logarithm of a scale, at some of these logarithms, (n, t)."""
    visible = np.exp(2.0 * logs)[:, :, None] * values[:, None, :]
    visible /= 1.0 + visible
    seen = np.einsum("ntk,ntk->nt", visible, visible)
    return np.sqrt(PER_DECADE**2 + PER_ROOT**2 * seen) / np.log(10.0)


def thinning(counts: Sequence[int], limit: int) -> float:
    """Return the factor on the numbers of nodes at which their product stays about at a limit."""
    several = [count for count in counts if count > 1]
    product = float(np.prod([float(count) for count in several]))
    return 1.0 if product <= limit else float((limit / product) ** (1.0 / len(several)))
