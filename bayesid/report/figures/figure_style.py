"""The look that all figures share: page width, small sans-serif letters, a palette for the colour-blind, legends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from io import BytesIO
from typing import Any, ParamSpec, TypeVar

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import ScalarFormatter
from numpy.typing import ArrayLike

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.simulation.sensors import SensorKind

__all__ = [
    "AFTER",
    "BAND",
    "BEFORE",
    "COLOURS",
    "DASHES",
    "FILL",
    "TRUTH",
    "WIDTH",
    "PageFigure",
    "PlainLabels",
    "axis_title",
    "curve_style",
    "decimal_scale",
    "ellipse_outline",
    "panels_of",
    "residual_limits",
    "sensor_panels",
    "sensor_title",
    "shared_legend",
    "styled",
    "title_panel",
    "wide_figure",
    "with_plain_labels",
]

WIDTH = 6.7  # width of the text on an A4 page [in]; figures are printed in their true size

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Colours of curves, by Okabe and Ito, Color Universal Design (2008)."""

BEFORE, AFTER, TRUTH = COLOURS[1], COLOURS[0], "#808080"
"""Orange of what was before (a model without its causes, the paper), blue of what is after, and grey of the truth."""

DASHES = ("-", "--", ":", "-.")  # dashes of curves, one after the other when the colours are used up

FILL = "#9fcbe6"
"""Colour of histograms and marginal densities."""

BAND: Any = {"color": "#e8e8e8", "linewidth": 0.0}
"""Look of the grey band in which noise alone would stay."""

LEAST_REACH = 4.5  # smallest half-height of a panel of residuals [σ]

_TITLES = {SensorKind.RATE: "angular rate", SensorKind.ACCEL: "acceleration", SensorKind.ATTITUDE: "rotation"}
"""Quantity that a sensor measures, where figures call it otherwise than files do."""

_SETTINGS: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.fontsize": 7.5,
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
    """Decorate a function that draws, so that it draws in the shared look."""
    decorated: Callable[P, T] = mpl.rc_context(_SETTINGS)(draw)
    return decorated


class PlainLabels(ScalarFormatter):
    """Labels of ticks as plain text, whose common power of ten alone is set as a formula, which takes far longer."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the label of a tick."""
        return super().__call__(x, pos).removeprefix(r"$\mathdefault{").removesuffix("}$")


def with_plain_labels(fig: Figure) -> None:
    """Label the ticks of linear axes as plain text, where nothing else was chosen for them."""
    for axes in fig.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if type(axis.get_major_formatter()) is ScalarFormatter:
                with mpl.rc_context(_SETTINGS):
                    axis.set_major_formatter(PlainLabels())


def title_panel(axes: Axes, text: str) -> None:
    """Title a panel at a fixed height; looking for labels to keep clear of takes a fifth of a figure's time."""
    axes.set_title(text, y=1.0)


class PageFigure(Figure):
    """Figure of its own, which notebooks show though pyplot does not know it."""

    def _repr_png_(self) -> bytes:
        shown = BytesIO()
        self.savefig(shown, format="png", dpi=110)
        return shown.getvalue()


def wide_figure(height: float) -> Figure:
    """Return an empty figure of the page's width and a height in inches."""
    return PageFigure(figsize=(WIDTH, height), layout="constrained")


def panels_of(axes: Any, rows: int, columns: int, height: float, **layout: Any) -> tuple[Figure, Any]:
    """Return a figure and its panels (rows, columns), which are those given or those of a new figure.

    Parameters
    ----------
    axes : array_like of matplotlib Axes or None
        Panels to draw in, row by row.
    rows, columns : int
        Numbers of panels that are needed.
    height : float
        Height of a new figure [in].
    layout : object
        Further arguments of `Figure.subplots` for a new figure.

    Raises
    ------
    InputError
        If another number of axes is given.
    """
    if axes is None:
        figure = wide_figure(height)
        return figure, figure.subplots(rows, columns, squeeze=False, **layout)
    given = np.asarray(axes, dtype=object).ravel()
    if given.size != rows * columns:
        remedy = f"Use the axes of matplotlib's subplots({rows}, {columns}), or none for a new figure"
        raise InputError(f"{given.size} axes are given where {rows * columns} are needed", remedy=remedy)
    return given[0].get_figure(root=True), given.reshape(rows, columns)


def curve_style(index: int) -> dict[str, Any]:
    """Return colour and dashes of a curve; no two of the first 28 are alike."""
    return {"color": COLOURS[index % len(COLOURS)], "linestyle": DASHES[index // len(COLOURS) % len(DASHES)]}


def decimal_scale(values: ArrayLike) -> tuple[float, str]:
    """Return the power of a thousand to divide values by, and its text before their unit."""
    largest = float(np.nanmax(np.abs(np.asarray(values, dtype=float)), initial=0.0))
    if not np.isfinite(largest) or largest == 0.0 or 0.1 <= largest < 1000.0:
        return 1.0, ""
    power = 3 * int(np.floor(np.log10(largest) / 3.0))
    return 10.0**power, f"$10^{{{power}}}$ "


def sensor_title(kind: SensorKind) -> str:
    """Return the quantity that a sensor measures, as figures call it."""
    return _TITLES.get(kind, kind.value)


def axis_title(kind: SensorKind, axis: int) -> str:
    """Return the title of the panel of one axis of a sensor, such as ``angular rate x``."""
    return f"{sensor_title(kind)} {kind.axes[axis]}"


def sensor_panels(axes: Any, kinds: Sequence[SensorKind], height: float, sharex: bool = False) -> tuple[Figure, Any]:
    """Return a figure and its panels (sensors, axes), as `panels_of`; those without an axis are hidden."""
    columns = max(kind.size for kind in kinds)
    figure, panels = panels_of(axes, len(kinds), columns, height, sharex=sharex)
    for row, kind in zip(panels, kinds, strict=True):
        for panel in row[kind.size :]:
            panel.set_visible(False)
    return figure, panels


def residual_limits(axes: Axes, residual: Floats) -> None:
    """Make a panel symmetric about zero and high enough for all residuals; those that are not a number are ignored."""
    reach = max(LEAST_REACH, 1.1 * float(np.nanmax(np.abs(residual), initial=0.0)))
    axes.set_ylim(-reach, reach)


def shared_legend(
    figure: Figure, axes: Axes, columns: int, place: str = "outside upper center", markerscale: float = 1.0
) -> None:
    """Put the legend of one panel outside all panels, for all of them; into it in a figure of somebody else's."""
    handles, labels = axes.get_legend_handles_labels()
    if not isinstance(figure, PageFigure):
        axes.legend(handles, labels, markerscale=markerscale)
        return
    figure.legend(handles, labels, loc=place, ncols=columns, markerscale=markerscale)


def ellipse_outline(covariance: Floats, reach: float) -> Floats:
    """Return the outline (2, n) of a (2, 2) covariance about the origin, ``reach`` standard deviations out."""
    angle = np.linspace(0.0, 2.0 * np.pi, 181)
    values, vectors = np.linalg.eigh(covariance)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    return np.asarray(reach * (vectors * np.sqrt(np.maximum(values, 0.0))) @ circle)
