"""Measured and simulated readings over time, and whitened residuals over time, by frequency and as a distribution."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter, NullLocator
from scipy import stats

from bayesid._math.arrays import Floats
from bayesid.diagnosis import Diagnosis
from bayesid.inference.identification import Identification
from bayesid.inference.predicted_readings import SensorFit, TorqueFit
from bayesid.inference.residual_view import ResidualSpectrum, ResidualView
from bayesid.recording.full_rate import ChannelSpectrum
from bayesid.report.figures.figure_style import (
    BAND,
    COLOURS,
    FILL,
    axis_title,
    decimal_scale,
    residual_limits,
    sensor_panels,
    sensor_title,
    shared_legend,
    styled,
    title_panel,
    wide_figure,
)
from bayesid.report.numbers import format_unit

__all__ = [
    "NOISE_BAND",
    "SIDES",
    "channel_spectra",
    "draw_history",
    "measured_against_simulated",
    "plot_residuals",
    "plot_spectrum",
    "residual_statistics",
    "torques_over_time",
]

COLUMNS = 3  # number of sensor axes or joints in a row
PARTS = 40  # number of windows that a recording is cut into for the running mean

SIDES = (("before", COLOURS[1]), ("after", COLOURS[0]))
"""Names and colours of the residuals of the present model and of the extended one."""

NOISE_BAND = "95 % of bins for noise alone"
"""Legend of the band that holds the bins of a spectrum if the residuals are noise alone."""


class Curves(NamedTuple):
    """What a pair of panels shows: readings above, as measured and simulated, and the residual beneath."""

    title: str
    time: Floats
    measured: Floats
    predicted: Floats
    residual_time: Floats
    residual: Floats


@styled
def channel_spectra(spectra: Sequence[ChannelSpectrum], rotations: Sequence[tuple[float, float]] = ()) -> Figure:
    """Draw the amplitude spectral density of each channel; what is right of the line is above the blocks' rate.

    Parameters
    ----------
    spectra : sequence of ChannelSpectrum
    rotations : sequence of pairs of float
        Lowest and highest frequency of rotation of each recorded wheel [Hz], which are shaded.
    """
    rows = -(-len(spectra) // COLUMNS)
    figure = wide_figure(1.3 * rows + 0.2)
    for place, spectrum in enumerate(spectra):
        axes = figure.add_subplot(rows, COLUMNS, place + 1)
        axes.loglog(spectrum.frequency, spectrum.density, color=COLOURS[0], linewidth=0.6)
        if spectrum.reduced:
            axes.axvline(spectrum.block_rate, color=COLOURS[1], linewidth=0.8)
        for line in spectrum.tones:
            axes.axvline(line.frequency, color=COLOURS[1], linewidth=0.6, linestyle=":")
        first, last = spectrum.frequency[0], spectrum.frequency[-1]
        for low, high in rotations:
            if low <= last and high >= first:
                axes.axvspan(max(low, first), min(high, last), color=COLOURS[2], alpha=0.25, linewidth=0.0)
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0,) if last > 30.0 * first else (1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda frequency, _: f"{frequency:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
        title_panel(axes, spectrum.name)
        if place >= len(spectra) - COLUMNS:
            axes.set_xlabel("Hz")
    return figure


@styled
def measured_against_simulated(fits: Sequence[SensorFit]) -> Figure:
    """Draw the axes of each sensor in one recording, a row for each: measured and simulated, and the residual."""
    rows = []
    for fit in fits:
        scale, prefix = decimal_scale(fit.measured)
        title = f"[{prefix}{format_unit(fit.kind.unit)}]"
        columns = zip(fit.measured.T / scale, fit.predicted.T / scale, fit.residual.T, strict=True)
        rows.append(
            [
                Curves(f"{axis_title(fit.kind, axis)} {title}", fit.time, above, simulated, fit.residual_time, below)
                for axis, (above, simulated, below) in enumerate(columns)
            ]
        )
    return _paired_panels(rows)


@styled
def torques_over_time(fits: Sequence[TorqueFit]) -> Figure:
    """Draw the torque of each joint in one recording, three in a row: measured and simulated, and the residual.

    The residuals are those of the samples that the likelihood uses.
    """
    curves = [
        Curves(f"{fit.joint} [{fit.unit}]", fit.time, fit.measured, fit.predicted, fit.residual_time, fit.residual)
        for fit in fits
    ]
    return _paired_panels([curves[start : start + COLUMNS] for start in range(0, len(curves), COLUMNS)])


def _paired_panels(rows: Sequence[Sequence[Curves]]) -> Figure:
    """Draw rows of up to three pairs of panels."""
    figure = wide_figure(0.3 + 1.95 * len(rows))
    ratios = {"height_ratios": [1.5, 1.0] * len(rows)}
    panels = figure.subplots(2 * len(rows), COLUMNS, squeeze=False, sharex=True, gridspec_kw=ratios)
    for below in panels[1::2, 0]:
        below.set_ylabel("residual [σ]")
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    for row, curves in enumerate(rows):
        for column in range(COLUMNS):
            above, below = panels[2 * row, column], panels[2 * row + 1, column]
            if column >= len(curves):
                above.set_axis_off()
                below.set_axis_off()
                continue
            drawn = curves[column]
            title_panel(above, drawn.title)
            above.plot(drawn.time, drawn.measured, ".", color=COLOURS[5], markersize=3.0, label="measured")
            above.plot(drawn.time, drawn.predicted, color="black", linewidth=0.6, label="simulated")
            above.locator_params(axis="both", nbins=4)
            below.axhspan(-2.0, 2.0, **BAND)
            below.plot(drawn.residual_time, drawn.residual, ".", color=COLOURS[1], markersize=1.5)
            residual_limits(below, drawn.residual)
            below.locator_params(axis="both", nbins=4)
    shared_legend(figure, panels[0, 0], columns=2, markerscale=2.0)
    return figure


Residuals = Identification | Diagnosis | Sequence[ResidualView]
"""What has residuals: a result, or views of them before and, where causes are named, after."""


def _sides(result: Residuals) -> Sequence[ResidualView]:
    """Return the residuals before, and after where causes are named."""
    if isinstance(result, Diagnosis):
        return result.residuals
    return [ResidualView.at(result.posterior, result.optimum.z)] if isinstance(result, Identification) else result


@styled
def plot_residuals(result: Residuals, recording: int | None = None, *, axes: Any = None) -> Figure:
    """Draw the residuals of one recording over time, in standard deviations of the noise, by sensor and axis.

    Parameters
    ----------
    result : Identification, Diagnosis or sequence of ResidualView
        Of a diagnosis that names causes, the residuals with and without them are drawn.
    recording : int, optional
        Number of the recording, by default the first, or that where the causes change most.
    axes : array_like of Axes, optional
        Panels to draw in, a row for each sensor, by default those of a new figure.
    """
    if recording is None:
        recording = result.strongest_recording if isinstance(result, Diagnosis) else 0
    sides = _sides(result)
    kinds = sides[0].kinds
    figure, panels = sensor_panels(axes, kinds, 0.45 + 1.2 * len(kinds), sharex=True)
    for sensor, kind in enumerate(kinds):
        for axis in range(kind.size):
            axes = panels[sensor, axis]
            axes.axhspan(-2.0, 2.0, **BAND)
            drawn = []
            for side, (name, colour) in zip(sides, SIDES, strict=False):
                time, value = side.series(recording, kind, axis)
                label = "samples and their running mean"
                draw_history(axes, time, value, colour, f"{name}: {label}" if len(sides) > 1 else label)
                drawn.append(value)
            residual_limits(axes, np.concatenate(drawn))
            title_panel(axes, axis_title(kind, axis))
            axes.locator_params(axis="both", nbins=4)
        panels[sensor, 0].set_ylabel("residual [σ]")
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    shared_legend(figure, panels[0, 0], columns=2)
    return figure


def draw_history(axes: Axes, time: Floats, value: Floats, colour: str, label: str) -> None:
    """Draw residuals over time as points, with a running mean as a line."""
    axes.plot(time, value, ".", color=colour, markersize=1.2, alpha=0.5)
    axes.plot(*_running_mean(time, value), color=colour, linewidth=1.0, label=label)


def _running_mean(time: Floats, value: Floats) -> tuple[Floats, Floats]:
    width = max(1, len(value) // PARTS)
    if len(value) < 2 * width:
        return time, value
    window = np.full(width, 1.0 / width)
    return np.convolve(time, window, "valid"), np.convolve(value, window, "valid")


@styled
def plot_spectrum(result: Residuals, *, axes: Any = None) -> Figure:
    """Draw the spectra of the residuals by sensor and axis; noise alone has level one.

    Parameters
    ----------
    result : Identification, Diagnosis or sequence of ResidualView
        Of a diagnosis that names causes, the spectra with and without them are drawn.
    axes : array_like of Axes, optional
        Panels to draw in, a row for each sensor, by default those of a new figure.
    """
    sides = _sides(result)
    kinds = sides[0].kinds
    figure, panels = sensor_panels(axes, kinds, 0.5 + 1.45 * len(kinds))
    for sensor, kind in enumerate(kinds):
        for axis in range(kind.size):
            axes = panels[sensor, axis]
            curves = [
                (name if len(sides) > 1 else "residual", colour, side.spectrum(kind, axis))
                for side, (name, colour) in zip(sides, SIDES, strict=False)
            ]
            _draw_spectra(axes, curves)
            title_panel(axes, axis_title(kind, axis))
            axes.set_xlabel("frequency [Hz]")
            axes.locator_params(axis="x", nbins=4)
        panels[sensor, 0].set_ylabel("power [σ² per bin]")
    shared_legend(figure, panels[0, 0], columns=3)
    return figure


@styled
def residual_statistics(residuals: ResidualView) -> Figure:
    """Draw the spectrum of each sensor axis and the distribution of each sensor's residuals, one row per sensor.

    If the model is right, the spectra are flat at one and the distributions are standard normal.
    """
    kinds = residuals.kinds
    figure = wide_figure(0.5 + 1.9 * len(kinds))
    panels = figure.subplots(len(kinds), 2, squeeze=False, gridspec_kw={"width_ratios": [1.7, 1.0]})
    for sensor, kind in enumerate(kinds):
        curves = [
            (f"axis {kind.axes[axis]}", COLOURS[axis], residuals.spectrum(kind, axis)) for axis in range(kind.size)
        ]
        _draw_spectra(panels[sensor, 0], curves)
        panels[sensor, 0].set_ylabel(f"{sensor_title(kind)}\npower [σ² per bin]")
        _draw_distribution(panels[sensor, 1], residuals.pooled(kind))
    panels[-1, 0].set_xlabel("frequency [Hz]")
    panels[-1, 1].set_xlabel("residual [σ]")
    shared_legend(figure, panels[0, 0], columns=4, place="outside upper left")
    return figure


def _draw_spectra(axes: Axes, curves: Sequence[tuple[str, str, ResidualSpectrum]]) -> None:
    """Draw named spectra, and the band that holds 95 % of the bins of the first if it is noise alone."""
    for name, colour, spectrum in curves:
        axes.plot(spectrum.frequency, spectrum.power, color=colour, marker=".", markersize=3, linewidth=0.8, label=name)
    frequency, _, ordinates = curves[0][2]
    if len(frequency):
        band = stats.gamma.ppf([[0.025], [0.975]], ordinates) / ordinates
        axes.fill_between(frequency, *band, **BAND, zorder=0, label=NOISE_BAND)
    axes.axhline(1.0, color="black", linewidth=0.6)
    axes.set_yscale("log")
    low, high = axes.get_ylim()
    axes.set_ylim(max(min(low, 0.2), 1e-3), max(high, 5.0))
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 3.0) if high < 100.0 else (1.0,), numticks=8))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_locator(NullLocator())


def _draw_distribution(axes: Axes, residual: Floats) -> None:
    reach = max(4.0, 1.05 * float(np.abs(residual).max(initial=0.0)))
    bins = np.linspace(-reach, reach, 41)
    axes.hist(residual, bins=bins.tolist(), density=True, color=FILL, edgecolor="white", linewidth=0.3)
    grid = np.linspace(-reach, reach, 401)
    axes.plot(grid, stats.norm.pdf(grid), color="black", linewidth=0.8)
    axes.set_ylabel("density [1/σ]")
    axes.text(
        0.98,
        0.96,
        f"mean {residual.mean():.3f}\nsd {residual.std():.3f}\n{len(residual)} samples",
        transform=axes.transAxes,
        ha="right",
        va="top",
    )
