"""Measured against simulated: over time, by frequency, and as a distribution."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator
from scipy import stats

from bayesid._math.arrays import Floats
from bayesid.inference.posterior import Posterior
from bayesid.report.figures.figure_style import COLOURS, decimal_scale, styled, wide_figure
from bayesid.report.sensor_fit import SensorFit, sensor_fits

__all__ = ["SENSOR_TITLES", "measured_against_simulated", "residual_spectrum"]


SENSOR_TITLES = {"rate": "angular rate", "accel": "acceleration", "attitude": "rotation"}
"""What each sensor's axis is called in figures."""

UNITS = {"rate": "rad/s", "accel": "m/s²", "attitude": "rad"}

BINS = 40


@styled
def measured_against_simulated(posterior: Posterior, z: Floats, recording_index: int) -> Figure:
    """Draw each sensor's measured and simulated axes over time, with the whitened residual beneath.

    Parameters
    ----------
    z : (n,) array
        Coordinates of the unknowns, such as the mode.
    recording_index : int
    """
    fits = sensor_fits(posterior, z)[recording_index]
    figure = wide_figure(0.3 + 2.0 * len(fits))
    panels = figure.subplots(
        2 * len(fits), 3, squeeze=False, sharex=True, gridspec_kw={"height_ratios": [1.5, 1.0] * len(fits)}
    )
    for row, fit in enumerate(fits):
        for axis in range(3):
            _draw_axis(panels[2 * row, axis], panels[2 * row + 1, axis], fit, axis)
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=2, markerscale=2.0)
    return figure


def _draw_axis(above: Axes, below: Axes, fit: SensorFit, axis: int) -> None:
    family = fit.kind.value
    scale, prefix = decimal_scale(fit.measured)
    above.plot(fit.time, fit.measured[:, axis] / scale, ".", color=COLOURS[5], markersize=3.0, label="measured")
    above.plot(fit.time, fit.predicted[:, axis] / scale, color="black", linewidth=0.6, label="simulated, as identified")
    above.set_title(f"{SENSOR_TITLES[family]} {'xyz'[axis]} [{prefix}{UNITS[family]}]")
    above.locator_params(axis="both", nbins=4)
    residual = fit.residual[:, axis]
    below.axhspan(-2.0, 2.0, color="#e8e8e8", linewidth=0.0)
    below.plot(fit.residual_time, residual, ".", color=COLOURS[1], markersize=1.5)
    largest = float(np.nanmax(np.abs(residual), initial=0.0))
    below.set_ylim(-max(4.5, 1.1 * largest), max(4.5, 1.1 * largest))
    if axis == 0:
        below.set_ylabel("residual [σ]")
    below.locator_params(axis="both", nbins=4)


@styled
def residual_spectrum(posterior: Posterior, z: Floats) -> Figure:
    """Draw the periodogram of the whitened residuals of each sensor, and their distribution.

    If the model is right, the periodogram is flat at one and the distribution is the standard normal one. All
    recordings are pooled, frequencies gathered in bins of equal width; the band holds 95 % of the bins of one axis.
    """
    recordings = sensor_fits(posterior, z)
    count = len(posterior.model.sensors)
    figure = wide_figure(0.5 + 1.9 * count)
    panels = figure.subplots(count, 2, squeeze=False, gridspec_kw={"width_ratios": [1.7, 1.0]})
    for row in range(count):
        fits = [fits[row] for fits in recordings]
        _draw_spectrum(panels[row, 0], fits)
        _draw_distribution(panels[row, 1], np.concatenate([fit.residual.ravel() for fit in fits]))
    panels[-1, 0].set_xlabel("frequency [Hz]")
    panels[-1, 1].set_xlabel("residual [σ]")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=4)
    return figure


def _draw_spectrum(axes: Axes, fits: list[SensorFit]) -> None:
    nyquist = min(0.5 / float(np.median(np.diff(fit.residual_time))) for fit in fits)
    bins = max(4, min(BINS, sum(len(fit.residual_time) for fit in fits) // 10))
    edges = np.linspace(0.0, nyquist, bins + 1)
    centres = 0.5 * (edges[1:] + edges[:-1])
    for axis in range(3):
        number, power = np.zeros(bins), np.zeros(bins)
        for fit in fits:
            frequency, periodogram = _periodogram(fit, axis)
            number += np.histogram(frequency, edges)[0]
            power += np.histogram(frequency, edges, weights=periodogram)[0]
        full = number > 0
        mean = power[full] / number[full]
        axes.plot(
            centres[full],
            mean,
            color=COLOURS[axis],
            marker=".",
            markersize=3,
            linewidth=0.7,
            label=f"axis {'xyz'[axis]}",
        )
    band = stats.gamma.ppf([[0.025], [0.975]], number[full]) / number[full]
    axes.fill_between(
        centres[full], *band, color="#e8e8e8", linewidth=0.0, label="95 % of bins, were it only noise", zorder=0
    )
    axes.axhline(1.0, color="black", linewidth=0.6)
    axes.set_yscale("log")
    low, high = axes.get_ylim()
    axes.set_ylim(min(low, 0.25), max(high, 4.0))
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 3.0) if high < 100.0 else (1.0,)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_ylabel(f"{SENSOR_TITLES[fits[0].kind.value]}\npower [σ² per bin]")


def _periodogram(fit: SensorFit, axis: int) -> tuple[Floats, Floats]:
    """Frequencies between zero and Nyquist [Hz], and the power there: one on average for noise of unit variance."""
    values = fit.residual[:, axis]
    kept = np.isfinite(values)
    values, time = values[kept], fit.residual_time[kept]
    power = np.abs(np.fft.rfft(values)) ** 2 / len(values)
    frequency = np.fft.rfftfreq(len(values), float(np.median(np.diff(time))))
    inside = slice(1, (len(values) + 1) // 2)
    return np.asarray(frequency[inside], dtype=float), np.asarray(power[inside], dtype=float)


def _draw_distribution(axes: Axes, residual: Floats) -> None:
    residual = residual[np.isfinite(residual)]
    reach = max(4.0, float(np.abs(residual).max()) * 1.05)
    bins = np.linspace(-reach, reach, 41)
    axes.hist(residual, bins=bins.tolist(), density=True, color="#9fcbe6", edgecolor="white", linewidth=0.3)
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
        fontsize=6,
    )
