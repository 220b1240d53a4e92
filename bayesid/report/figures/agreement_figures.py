"""Measured and simulated readings over time, with the whitened residual beneath: sensors and joint torques."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bayesid._math.arrays import Floats
from bayesid.inference.sensor_fit import SensorFit, TorqueFit
from bayesid.report.figures.figure_style import (
    BAND,
    COLOURS,
    axis_title,
    decimal_scale,
    residual_limits,
    shared_legend,
    styled,
    title_panel,
    wide_figure,
)
from bayesid.report.numbers import format_unit

__all__ = ["measured_against_simulated", "torques_over_time"]

COLUMNS = 3
"""Number of sensor axes or joints in a row."""


@styled
def measured_against_simulated(fits: Sequence[SensorFit]) -> Figure:
    """Draw the axes of each sensor in one recording: measured and simulated, and the residual beneath.

    Parameters
    ----------
    fits : sequence of SensorFit
        Readings of each sensor.
    """
    figure, panels = _paired_panels(len(fits))
    for row, fit in enumerate(fits):
        scale, prefix = decimal_scale(fit.measured)
        for axis in range(fit.kind.size):
            above, below = panels[2 * row][axis], panels[2 * row + 1][axis]
            _draw_readings(above, fit.time, fit.measured[:, axis] / scale, fit.predicted[:, axis] / scale)
            title_panel(above, f"{axis_title(fit.kind, axis)} [{prefix}{format_unit(fit.kind.unit)}]")
            _draw_residual(below, fit.residual_time, fit.residual[:, axis])
        for axis in range(fit.kind.size, COLUMNS):
            panels[2 * row][axis].set_axis_off()
            panels[2 * row + 1][axis].set_axis_off()
    shared_legend(figure, panels[0][0], columns=2, markerscale=2.0)
    return figure


@styled
def torques_over_time(fits: Sequence[TorqueFit]) -> Figure:
    """Draw the torque of each joint in one recording: measured and simulated, and the residual beneath.

    Parameters
    ----------
    fits : sequence of TorqueFit
        Torque of each joint; the residuals are those of the samples that the likelihood uses.
    """
    count = -(-len(fits) // COLUMNS)
    figure, panels = _paired_panels(count)
    for index in range(count * COLUMNS):
        row, column = divmod(index, COLUMNS)
        above, below = panels[2 * row][column], panels[2 * row + 1][column]
        if index >= len(fits):
            above.set_axis_off()
            below.set_axis_off()
            continue
        fit = fits[index]
        _draw_readings(above, fit.time, fit.measured, fit.predicted)
        title_panel(above, f"{fit.joint} [{fit.unit}]")
        _draw_residual(below, fit.residual_time, fit.residual)
    shared_legend(figure, panels[0][0], columns=2, markerscale=2.0)
    return figure


def _paired_panels(rows: int) -> tuple[Figure, list[list[Axes]]]:
    """Return a figure with so many rows of three pairs of panels, readings above and residuals below."""
    figure = wide_figure(0.3 + 1.95 * rows)
    panels = figure.subplots(
        2 * rows, COLUMNS, squeeze=False, sharex=True, gridspec_kw={"height_ratios": [1.5, 1.0] * rows}
    )
    for below in panels[1::2, 0]:
        below.set_ylabel("residual [σ]")
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    return figure, panels.tolist()


def _draw_readings(axes: Axes, time: Floats, measured: Floats, predicted: Floats) -> None:
    axes.plot(time, measured, ".", color=COLOURS[5], markersize=3.0, label="measured")
    axes.plot(time, predicted, color="black", linewidth=0.6, label="simulated")
    axes.locator_params(axis="both", nbins=4)


def _draw_residual(axes: Axes, time: Floats, residual: Floats) -> None:
    axes.axhspan(-2.0, 2.0, **BAND)
    axes.plot(time, residual, ".", color=COLOURS[1], markersize=1.5)
    residual_limits(axes, residual)
    axes.locator_params(axis="both", nbins=4)
