"""Directions of the parameter space: the share of the prior's width left in each, and the parameters they move."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from bayesid._math.arrays import Floats
from bayesid.identifiability.directions import Direction
from bayesid.inference.body_quantities import CONTRACTED, PRIOR_ONLY, ContractionVerdict
from bayesid.report.figures.figure_style import COLOURS, styled, wide_figure

__all__ = ["direction_widths", "displacements"]

WORST, MOST_ROWS = 12, 44  # largest numbers of directions and of parameters in the map of displacements
VISIBLE = 0.1  # displacement over the largest of its direction from which on a parameter counts as moved

LOOK = {
    ContractionVerdict.CONTRACTED: COLOURS[2],
    ContractionVerdict.WEAKLY: COLOURS[4],
    ContractionVerdict.NOT: COLOURS[1],
}
"""Colour of each verdict."""


@styled
def direction_widths(directions: Sequence[Direction]) -> Figure:
    """Draw posterior sd over prior sd of every direction."""
    figure = wide_figure(2.1)
    axes = figure.subplots()
    ratio = np.array([item.sd / item.prior_sd for item in directions])
    numbers = np.arange(1, len(ratio) + 1)
    for verdict, colour in LOOK.items():
        chosen = np.array([item.verdict is verdict for item in directions])
        if chosen.any():
            axes.semilogy(numbers[chosen], ratio[chosen], "o", markersize=3.5, color=colour, label=verdict.value)
    axes.axhline(1.0 - CONTRACTED, color="black", linewidth=0.5, linestyle=":")
    axes.axhline(1.0 - PRIOR_ONLY, color="black", linewidth=0.5, linestyle=":")
    axes.set_ylim(0.5 * float(ratio.min()), 2.0)
    axes.set_xlim(0.3, len(ratio) + 0.7)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("direction")
    axes.set_ylabel("posterior sd / prior sd")
    axes.legend(loc="lower left")
    return figure


@styled
def displacements(directions: Sequence[Direction], prior_sd: Floats) -> Figure:
    """Draw the displacements of the worst known directions in units of the prior's widths, parameters down."""
    shown = directions[:WORST]
    moved = np.stack([item.displacement / prior_sd for item in shown], axis=1)
    # each direction is divided by its largest displacement: otherwise the well-known ones would be white
    largest = np.abs(moved).max(axis=0)
    strength = (np.abs(moved) / largest).max(axis=1)
    rows = np.sort(np.argsort(-strength)[:MOST_ROWS])
    rows = rows[strength[rows] > VISIBLE]
    names = [directions[0].names[row] for row in rows]
    figure = wide_figure(0.9 + 0.155 * len(rows))
    axes = figure.subplots()
    axes.grid(False)
    image = axes.imshow(
        moved[rows] / largest, vmin=-1.0, vmax=1.0, cmap="RdBu_r", interpolation="nearest", aspect="auto"
    )
    axes.set_yticks(range(len(rows)), names)
    labels = [f"{number}\n{size:.2g}" for number, size in enumerate(largest, start=1)]
    axes.set_xticks(range(len(shown)), labels)
    axes.set_xlabel("direction, and its largest displacement in prior sd")
    for body in range(1, len(rows)):
        if names[body].split(".")[0] != names[body - 1].split(".")[0]:
            axes.axhline(body - 0.5, color="black", linewidth=0.5)
    figure.colorbar(image, ax=axes, label="displacement over the largest", aspect=30)
    return figure
