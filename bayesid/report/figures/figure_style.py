"""One look for all figures: the page's width, small sans-serif letters, a palette that the colour-blind can read."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

__all__ = ["COLOURS", "DASHES", "WIDTH", "curve_style", "decimal_scale", "styled", "wide_figure"]

WIDTH = 6.7
"""Width of the text on an A4 page [in]; figures are set in their true size."""

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Okabe and Ito, Color Universal Design (2008)."""

DASHES = ("-", "--", ":", "-.")

_SETTINGS: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 7.0,
    "axes.titlesize": 7.5,
    "axes.labelsize": 7.0,
    "xtick.labelsize": 6.5,
    "ytick.labelsize": 6.5,
    "legend.fontsize": 6.5,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "lines.linewidth": 1.0,
    "axes.grid": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.4,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.use_mathtext": True,
    "axes.formatter.limits": (-3, 4),
    "legend.frameon": False,
}

P = ParamSpec("P")
T = TypeVar("T")


def styled(draw: Callable[P, T]) -> Callable[P, T]:
    """Decorate a function that draws, so that it draws in this look."""
    decorated: Callable[P, T] = mpl.rc_context(_SETTINGS)(draw)
    return decorated


def wide_figure(height: float) -> Figure:
    """Return an empty figure of the page's width; its height is in inches."""
    return Figure(figsize=(WIDTH, height), layout="constrained")


def curve_style(index: int) -> dict[str, Any]:
    """Return colour and dashes of a curve; no two of the first 28 are alike."""
    return {"color": COLOURS[index % len(COLOURS)], "linestyle": DASHES[index // len(COLOURS) % len(DASHES)]}


def decimal_scale(values: ArrayLike) -> tuple[float, str]:
    """Return the power of a thousand to divide values by, and how to write it before their unit."""
    largest = float(np.nanmax(np.abs(np.asarray(values, dtype=float)), initial=0.0))
    if not np.isfinite(largest) or largest == 0.0 or 0.1 <= largest < 1000.0:
        return 1.0, ""
    power = 3 * int(np.floor(np.log10(largest) / 3.0))
    return 10.0**power, f"$10^{{{power}}}$ "
