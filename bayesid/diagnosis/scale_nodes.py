"""Nodes of the trapezoidal rule in the logarithm of a scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.scale_prior import ScaleRange

__all__ = ["LogNodes", "log_nodes", "thinning"]

PER_DECADE = 4.0
"""Nodes per decade of the scale of a few amplitudes, good to 0.001 in the log evidence of one or two groups."""

PER_ROOT = 2.0
"""Nodes per decade and root of the number of amplitudes. The more there are, the better their common scale is known,
to ``1 / sqrt(2 m)`` in its logarithm; the error of the trapezoidal rule is then below 0.01."""


@dataclass(frozen=True)
class LogNodes:
    """Scales, with the logarithms of their prior weights.

    Attributes
    ----------
    scales, log_weights : (t,) arrays
    """

    scales: Floats
    log_weights: Floats


def log_nodes(whole: ScaleRange, part: tuple[float, float], amplitudes: int, thinned: float = 1.0) -> LogNodes:
    """Return nodes over a part of a range, equally spaced in the logarithm; the first and the last weigh half.

    Parameters
    ----------
    whole : ScaleRange
        Range over which the scale is log-uniform.
    part : pair of float
        Ends of the part.
    amplitudes : int
        Number of amplitudes that share the scale.
    thinned : float
        Factor on the number of nodes, at most 1.
    """
    if whole.low == whole.high:
        return LogNodes(np.array([whole.high]), np.zeros(1))
    decades = np.log10(part[1] / part[0])
    count = max(int(np.ceil(decades * max(PER_DECADE, PER_ROOT * np.sqrt(amplitudes)) * thinned)) + 1, 3)
    weights = np.full(count, np.log(part[1] / part[0]) / (count - 1) / np.log(whole.high / whole.low))
    weights[[0, -1]] *= 0.5
    scales = np.exp(np.linspace(np.log(part[0]), np.log(part[1]), count))
    scales[[0, -1]] = part  # exactly
    return LogNodes(scales, np.log(weights))


def thinning(counts: Sequence[int], limit: int) -> float:
    """Return the factor on the numbers of nodes at which their product stays about at a limit."""
    several = [count for count in counts if count > 1]
    product = float(np.prod([float(count) for count in several]))
    return 1.0 if product <= limit else float((limit / product) ** (1.0 / len(several)))
