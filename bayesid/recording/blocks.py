"""Samples averaged over blocks of time, and the instants from which a model predicts such an average.

The mean of white samples loses nothing of what a motion says that is a cubic within the block, if the model predicts
the same mean. It does by a Gauss rule of two nodes, whose places and weights have the mean, variance and skewness of
the time stamps that went in (Golub and Welsch 1969, Calculation of Gauss quadrature rules): gaps and jitter cost
nothing. A block of one sample is that sample, one of two its two samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesid._math.arrays import Floats, Integers

__all__ = ["BLOCKS_PER_SECOND", "Blocks"]

BLOCKS_PER_SECOND = 10.0
"""Blocks a second where a study states nothing: five times the fastest vibration or joint that is looked for has."""

LEAST = 100.0
"""Blocks of a recording at least: what is short, such as a throw of half a second, moves fast."""

WHOLE = 1e-3  # relative excess of an interval over a part of a block that is rounding


@dataclass(frozen=True)
class Blocks:
    """Partition of n time stamps into b blocks.

    Attributes
    ----------
    stamps : (n,) array
        Time stamps of all samples [s].
    first, count : (b,) integer array
        Number of the first sample of each block, and of its samples.
    time : (b,) array
        Mean of the stamps of each block [s].
    node, weight : (b, 2) array
        Instants [s] and weights that give the mean of a cubic over the stamps; the second weighs nothing in a block of
        one sample.
    """

    stamps: Floats
    first: Integers
    count: Integers
    time: Floats
    node: Floats
    weight: Floats

    @classmethod
    def of(cls, stamps: Floats, per_second: float, breaks: Floats | Sequence[float] = ()) -> Blocks:
        """Return the longest blocks of equally many samples of which there are at least so many a second.

        Parameters
        ----------
        stamps : (n,) array
            Increasing time stamps [s].
        per_second : float
            Least number of blocks a second, and more in a recording that has fewer than `LEAST`; 0 keeps every sample.
        breaks : (k,) array_like
            Instants that no block may hold within [s], such as those at which a known force changes.
        """
        interval = float(np.median(np.diff(stamps))) if len(stamps) > 1 else np.inf
        most = 1
        if per_second > 0.0 and len(stamps) > 1:
            least = max(per_second, LEAST / float(stamps[-1] - stamps[0]))
            most = int((1.0 + WHOLE) / (least * interval))
        if most < 2:
            ones = np.ones(len(stamps), dtype=int)
            pairs = np.repeat(stamps[:, None], 2, axis=1)
            return cls(stamps, np.arange(len(stamps)), ones, stamps, pairs, np.tile([1.0, 0.0], (len(stamps), 1)))
        # borders halfway between even stamps, so that jitter moves no sample into another block
        number = np.floor(((stamps - stamps[0]) / interval + 0.5) / most)
        side = np.searchsorted(np.sort(np.asarray(breaks, dtype=float)), stamps, side="right")
        first = np.flatnonzero(np.concatenate([[True], (np.diff(number) > 0.0) | (np.diff(side) > 0)]))
        count = np.diff(np.append(first, len(stamps)))
        time = stamps[first] + np.add.reduceat(stamps - np.repeat(stamps[first], count), first) / count
        apart = stamps - np.repeat(time, count)
        second, third = (np.add.reduceat(apart**power, first) / count for power in (2, 3))
        skew = np.divide(third, second, out=np.zeros_like(third), where=second > 0.0)
        root = np.sqrt(skew**2 + 4.0 * second)
        share = np.divide(skew, root, out=np.zeros_like(root), where=root > 0.0)
        node = time[:, None] + 0.5 * np.stack([skew - root, skew + root], axis=1)
        weight = 0.5 * np.stack([1.0 + share, 1.0 - share], axis=1)
        weight[count == 1] = [1.0, 0.0]
        return cls(stamps, first, count, time, node, weight)

    @property
    def reduced(self) -> bool:
        """Whether any block has more than one sample."""
        return len(self.first) < len(self.stamps)

    @property
    def interval(self) -> float:
        """Median time between the samples [s]."""
        return float(np.median(np.diff(self.stamps)))

    @property
    def typical(self) -> float:
        """Median number of samples of a block."""
        return float(np.median(self.count))

    @property
    def weight_of_samples(self) -> Floats:
        """Weight of every sample in the mean of its block, (n,)."""
        return np.repeat(1.0 / self.count, self.count)

    def mean(self, values: Floats) -> Floats:
        """Return the means of values (n, ...) over the blocks, (b, ...)."""
        if not self.reduced:
            return values
        total = np.add.reduceat(values, self.first, axis=0)
        return np.asarray(total / self.count.reshape(-1, *[1] * (values.ndim - 1)))

    def samples_of(self, rows: Integers) -> Integers:
        """Return the numbers of all samples of some blocks."""
        return np.concatenate([np.arange(self.first[row], self.first[row] + self.count[row]) for row in rows])
