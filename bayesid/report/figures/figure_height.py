"""Height of a figure that gives way to what stands beside it on a page."""

from __future__ import annotations

from matplotlib.figure import Figure

__all__ = ["fitted_height"]

ROOM = 1.15
"""Least distance of named ticks along a vertical axis, in heights of their letters."""


def fitted_height(figure: Figure, factor: float) -> float:
    """Return a figure's height multiplied by a factor, or as much of its height as its named ticks need [inch].

    Parameters
    ----------
    figure : Figure
        Figure that is laid out already.
    factor : float
    """
    height = float(figure.get_size_inches()[1])
    lowest = 0.0
    for axes in figure.axes:
        named = [label for label in axes.get_yticklabels() if label.get_text()]
        needed = ROOM * sum(float(label.get_fontsize()) for label in named) / 72.0
        lowest = max(lowest, height + needed - axes.get_position().height * height if named else 0.0)
    return max(factor * height, min(lowest, height))
