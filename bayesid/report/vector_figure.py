"""A figure as a document sets it: vectors and text, in its own height or in one that fills the pages."""

from __future__ import annotations

import io
import math

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.collections import PathCollection, QuadMesh
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from bayesid.report.figures.figure_style import with_plain_labels

__all__ = ["VectorFigure"]

MANY_POINTS = 4000  # number of points above which a line or a scatter plot is drawn as pixels inside the vector figure
RESOLUTION = 250  # resolution of what is drawn as pixels [dots per inch]
ROOM = 1.15  # least distance of named ticks along a vertical axis, in heights of their letters


class VectorFigure:
    """A figure that can be drawn as SVG, and laid out, in several heights.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Figure, which is laid out in its own height and must not be changed afterwards.
    """

    def __init__(self, figure: Figure) -> None:
        for axes in figure.axes:
            for artist in axes.get_children():
                if _points(artist) > MANY_POINTS:
                    artist.set_rasterized(True)
        with_plain_labels(figure)
        self._figure = figure
        self._engine = figure.get_layout_engine()
        self._width, self._height = map(float, figure.get_size_inches())
        self._drawn: dict[float, bytes] = {}  # by height; laying out again would move the axes by rounding
        self._lay_out()
        self._lowest = self._least_height()

    def height(self, factor: float) -> float:
        """Return its height multiplied by a factor, or as much of its height as its named ticks need [inch]."""
        return max(factor * self._height, min(self._lowest, self._height))

    def blank(self, factor: float = 1.0) -> bytes:
        """Return an empty SVG of the size that `svg` has."""
        width, height = 72.0 * self._width, 72.0 * self.height(factor)
        size = f'width="{width}pt" height="{height}pt" viewBox="0 0 {width} {height}"'
        return f'<svg xmlns="http://www.w3.org/2000/svg" {size}/>'.encode()

    def svg(self, factor: float = 1.0) -> bytes:
        """Return the figure, its height multiplied by a factor (`height`), as SVG with many points as a picture."""
        height = self.height(factor)
        if height not in self._drawn:
            self._drawn[height] = self._in_height(height)
        return self._drawn[height]

    def _in_height(self, height: float) -> bytes:
        figure = self._figure
        figure.set_size_inches(self._width, height)
        if height != self._laid_out:
            self._lay_out()
        figure.set_dpi(RESOLUTION)
        figure.set_layout_engine("none")  # drawing would lay the figure out once more
        content = io.BytesIO()
        with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": "bayesid"}):
            # savefig would draw the figure twice, the first time to find its layout
            FigureCanvasSVG(figure).print_svg(content, metadata={"Date": None})
        figure.set_layout_engine(self._engine)
        figure.set_size_inches(self._width, self._height)
        return content.getvalue()

    def _lay_out(self) -> None:
        if self._engine is not None:
            self._engine.execute(self._figure)
        self._laid_out = float(self._figure.get_size_inches()[1])

    def _least_height(self) -> float:
        """Return the height in which the named ticks of every vertical axis still have room [inch]."""
        lowest = 0.0
        for axes in self._figure.axes:
            named = [label for label in axes.get_yticklabels() if label.get_text()]
            needed = ROOM * sum(float(label.get_fontsize()) for label in named) / 72.0
            free = self._height * (1.0 - axes.get_position().height)
            lowest = max(lowest, free + needed if named else 0.0)
        return lowest


def _points(artist: Artist) -> float:
    """Return the number of points of a line, of a scatter plot, or of a mesh, which counts as many; otherwise 0."""
    match artist:
        case Line2D():
            return len(artist.get_xdata())  # type: ignore[arg-type]
        case PathCollection():
            return len(artist.get_offsets())  # type: ignore[arg-type]
        case QuadMesh():
            return math.inf
    return 0
