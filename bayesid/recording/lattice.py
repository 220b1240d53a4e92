"""Readings on a lattice, and what its step leaves in their mean over a block."""

from __future__ import annotations

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.recording.blocks import Blocks

__all__ = ["ON_LATTICE", "lattice_step", "mean_deviation", "mean_rounding_error"]

ROUNDING = 1e-9  # distance relative to the largest reading below which two readings are one
ON_LATTICE = 0.02
"""Largest distance from a multiple of the step, in steps."""

FEWEST = 2.0  # steps that readings must span


def lattice_step(values: Floats) -> float | None:
    """Return the step of the lattice that readings (n,) lie on, or None where they lie on none.

    Parameters
    ----------
    values : (n,) array
    """
    if len(values) == 0:
        return None
    distances = np.diff(np.unique(values))
    distances = distances[distances > ROUNDING * np.abs(values).max()]
    if len(distances) == 0:
        return None
    step = float(distances.min())
    ratio = (values - values.min()) / step
    off = np.abs(ratio - np.round(ratio)).max()
    return step if off <= ON_LATTICE and ratio.max() >= FEWEST else None


def mean_rounding_error(step: float, crossed: Floats, noise: float) -> Floats:
    """Return the standard deviation of the mean of rounding errors that many samples do not average out, (n,).

    The rounding error is a saw-tooth of the reading. Its mean over a block in which the reading crosses ``s`` steps
    evenly has the variance ``step^2 / 12 (1 - s)^2`` up to half a step, as its Fourier series shows, and beyond it at
    most ``step^2 / (192 s^2)``. Noise before the rounding leaves ``exp(-4 pi^2 noise^2 / step^2)`` of it.

    Parameters
    ----------
    step : float
    crossed : (n,) array
        Steps that the reading crosses within each block.
    noise : float
        Standard deviation of the noise before the rounding, in the unit of the step.
    """
    far = 1.0 / (192.0 * np.maximum(crossed, 0.5) ** 2)
    variance = np.where(crossed < 0.5, (1.0 - crossed) ** 2 / 12.0, far)
    return np.asarray(step * np.sqrt(variance) * np.exp(-2.0 * (np.pi * noise / step) ** 2))


def mean_deviation(blocks: Blocks, means: Floats, sigma: float, step: float | None) -> Floats:
    """Return the standard deviation of each mean over a block relative to that of a sample, (b,).

    Parameters
    ----------
    blocks : Blocks
    means : (b,) array
        Means of one column.
    sigma : float
        Standard deviation of the white noise of a sample, its rounding included.
    step : float, optional
        Step of the lattice on which the samples lie, None where they lie on none.
    """
    variance = 1.0 / blocks.count
    if step and blocks.reduced:
        noise = float(np.sqrt(max(sigma**2 - step**2 / 12.0, 0.0)))
        crossed = np.abs(np.gradient(means, blocks.time)) * blocks.interval * blocks.count / step
        alone = blocks.count == 1  # the noise of a sample has its rounding already
        variance = variance + np.where(alone, 0.0, (mean_rounding_error(step, crossed, noise) / sigma) ** 2)
    return np.sqrt(variance)
