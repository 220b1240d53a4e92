"""What a diagnosis saw: residuals before and after, candidates, and the reconstructed disturbance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator
from scipy import stats

from bayesid._math.arrays import Floats
from bayesid.diagnosis import Candidate, Frame, Unexplained
from bayesid.diagnosis.disturbing_wrench import WAVES
from bayesid.report.figures.agreement_figures import SENSOR_TITLES
from bayesid.report.figures.figure_style import COLOURS, curve_style, decimal_scale, styled, wide_figure
from bayesid.report.residual_series import Residuals

__all__ = ["candidate_strengths", "residual_histories", "residual_spectra", "wrench_histories", "wrench_spectrum"]

PARTS = 40
"""Windows that a recording is cut into for the running mean."""

BINS = 40

BEFORE, AFTER = COLOURS[1], COLOURS[0]

FEW = 7
"""Recordings that one figure can hold."""


@styled
def residual_histories(sides: Sequence[Residuals], index: int) -> Figure:
    """Draw the whitened residual of one recording over time, per sensor axis: before, and after if there is one.

    Parameters
    ----------
    sides : sequence of Residuals
        Before, and after where something is named.
    index : int
        Of the recording.
    """
    kinds = sides[0].kinds
    figure = wide_figure(0.45 + 1.2 * len(kinds))
    panels = figure.subplots(len(kinds), 3, squeeze=False, sharex=True)
    for slot, kind in enumerate(kinds):
        columns = sides[0].posterior.model.channels.of(kind)
        for axis in range(3):
            axes, reach = panels[slot, axis], 4.5
            axes.axhspan(-2.0, 2.0, color="#e8e8e8", linewidth=0.0)
            for side, colour, label in zip(sides, (BEFORE, AFTER), ("before", "after"), strict=False):
                time, value = side.channel(index, columns.start + axis)
                axes.plot(time, value, ".", color=colour, markersize=1.2, alpha=0.5)
                axes.plot(*_running_mean(time, value), color=colour, linewidth=1.0, label=_label(sides, label))
                reach = max(reach, 1.1 * float(np.abs(value).max(initial=0.0)))
            axes.set_ylim(-reach, reach)
            axes.set_title(f"{SENSOR_TITLES[kind.value]} {'xyz'[axis]}")
            axes.locator_params(axis="both", nbins=4)
        panels[slot, 0].set_ylabel("residual [σ]")
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=2)
    return figure


def _label(sides: Sequence[Residuals], label: str) -> str:
    return f"{label}: samples and their running mean" if len(sides) > 1 else "samples and their running mean"


def _running_mean(time: Floats, value: Floats) -> tuple[Floats, Floats]:
    width = max(1, len(value) // PARTS)
    if len(value) < 2 * width:
        return time, value
    window = np.full(width, 1.0 / width)
    return np.convolve(time, window, "valid"), np.convolve(value, window, "valid")


@styled
def residual_spectra(sides: Sequence[Residuals]) -> Figure:
    """Draw the periodogram of the whitened residual by sensor axis, recordings pooled; noise alone has level one."""
    kinds = sides[0].kinds
    figure = wide_figure(0.5 + 1.45 * len(kinds))
    panels = figure.subplots(len(kinds), 3, squeeze=False)
    for slot, kind in enumerate(kinds):
        columns = sides[0].posterior.model.channels.of(kind)
        for axis in range(3):
            axes = panels[slot, axis]
            _draw_spectra(axes, sides, columns.start + axis)
            axes.set_title(f"{SENSOR_TITLES[kind.value]} {'xyz'[axis]}")
            axes.set_xlabel("frequency [Hz]")
        panels[slot, 0].set_ylabel("power [σ² per bin]")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return figure


def _draw_spectra(axes: Axes, sides: Sequence[Residuals], channel: int) -> None:
    for side, colour, label in zip(sides, (BEFORE, AFTER), ("before", "after"), strict=False):
        frequency, power = (np.concatenate(parts) for parts in zip(*_periodograms(side, channel), strict=True))
        if len(frequency) == 0:
            continue
        bins = max(4, min(BINS, len(frequency) // 5))
        edges = np.linspace(0.0, frequency.max() * (1.0 + 1e-9), bins + 1)
        number = np.histogram(frequency, edges)[0]
        full = number > 0
        mean = np.histogram(frequency, edges, weights=power)[0][full] / number[full]
        centre = (0.5 * (edges[1:] + edges[:-1]))[full]
        name = label if len(sides) > 1 else "residual"
        axes.plot(centre, mean, color=colour, marker=".", markersize=3, linewidth=0.8, label=name)
        if side is sides[0]:
            band = stats.gamma.ppf([[0.025], [0.975]], number[full]) / number[full]
            axes.fill_between(
                centre, *band, color="#e8e8e8", linewidth=0.0, zorder=0, label="95 % of bins, were it only noise"
            )
    axes.axhline(1.0, color="black", linewidth=0.6)
    axes.set_yscale("log")
    low, high = axes.get_ylim()
    axes.set_ylim(max(min(low, 0.2), 1e-3), max(high, 5.0))
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 3.0) if high < 100.0 else (1.0,), numticks=8))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.locator_params(axis="x", nbins=4)


def _periodograms(side: Residuals, channel: int) -> list[tuple[Floats, Floats]]:
    """Frequencies between zero and Nyquist [Hz] and power there, by recording."""
    found: list[tuple[Floats, Floats]] = [(np.zeros(0), np.zeros(0))]
    for index in range(side.recordings):
        time, value = side.channel(index, channel)
        if len(value) < 8:
            continue
        power = np.abs(np.fft.rfft(value)) ** 2 / len(value)
        frequency = np.fft.rfftfreq(len(value), float(np.median(np.diff(time))))
        inside = slice(1, (len(value) + 1) // 2)
        found.append((np.asarray(frequency[inside], dtype=float), np.asarray(power[inside], dtype=float)))
    return found


@styled
def candidate_strengths(rows: Sequence[Candidate], named: Sequence[str], alarm: float) -> Figure:
    """Draw the signal-to-noise ratio of candidates as bars.

    Parameters
    ----------
    rows : sequence of Candidate
    named : sequence of str
        The verdict's causes.
    alarm : float
        Family-wise p-value below which a candidate is significant.
    """
    figure = wide_figure(0.75 + 0.155 * len(rows))
    axes = figure.subplots()
    place = np.arange(len(rows))[::-1]
    kinds = {"named": COLOURS[0], "significant": COLOURS[4], "not significant": "#bbbbbb"}
    state = [
        "named" if row.name in named else "significant" if row.p_value_adjusted < alarm else "not significant"
        for row in rows
    ]
    strength = np.array([row.signal_to_noise for row in rows])
    for kind, colour in kinds.items():
        own = [index for index, item in enumerate(state) if item == kind]
        if own:
            axes.barh(place[own], strength[own], color=colour, height=0.7, label=kind)
    for y, value in zip(place, strength, strict=True):
        axes.annotate(f"{value:.1f}", (value, y), (2, 0), textcoords="offset points", va="center", fontsize=6)
    axes.set_yticks(place, [row.name for row in rows])
    axes.set_ylim(-0.7, len(rows) - 0.3)
    axes.set_xlim(0.0, 1.08 * max(float(strength.max(initial=0.0)), 3.0))
    axes.grid(visible=False, axis="y")
    axes.set_xlabel("signal-to-noise ratio")
    axes.legend(loc="lower right")
    return figure


@styled
def wrench_histories(wrench: Unexplained, frame: Frame) -> Figure:
    """Draw a reconstructed torque and force over time in one frame; with ± 1 sd in base axes."""
    figure = wide_figure(3.6)
    panels = figure.subplots(2, 3, squeeze=False, sharex=True)
    families = (
        ("torque", "N m", wrench.torque[frame], wrench.torque_sd),
        ("force", "N", wrench.force[frame], wrench.force_sd),
    )
    for row, (title, unit, values, spread) in enumerate(families):
        scale, prefix = decimal_scale(np.concatenate([np.abs(value).ravel() for value in values[:FEW]]))
        for axis in range(3):
            axes = panels[row, axis]
            for index, name in enumerate(wrench.names[:FEW]):
                time, value = wrench.time[index], values[index][:, axis] / scale
                style = curve_style(index)
                if frame is Frame.BASE:
                    sd = spread[index][:, axis] / scale
                    axes.fill_between(time, value - sd, value + sd, color=style["color"], alpha=0.18, linewidth=0.0)
                axes.plot(time, value, linewidth=0.9, label=name, **style)
            axes.axhline(0.0, color="black", linewidth=0.5)
            axes.set_title(f"{title} {'xyz'[axis]} [{prefix}{unit}]")
            axes.locator_params(axis="both", nbins=4)
    for axes in panels[-1]:
        axes.set_xlabel("time [s]")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4)
    return figure


@styled
def wrench_spectrum(wrench: Unexplained) -> Figure:
    """Draw the amplitude spectrum of the reconstructed torque, base axes, by recording."""
    figure = wide_figure(1.9)
    panels = figure.subplots(1, 3, squeeze=False)
    series = [torque_amplitudes(wrench, index) for index in range(len(wrench.names[:FEW]))]
    scale, prefix = decimal_scale(np.concatenate([amplitude.ravel() for _, amplitude in series]))
    for axis in range(3):
        axes = panels[0, axis]
        for index, (frequency, amplitude) in enumerate(series):
            axes.plot(
                frequency, amplitude[:, axis] / scale, linewidth=0.9, label=wrench.names[index], **curve_style(index)
            )
        axes.set_title(f"torque {'xyz'[axis]} [{prefix}N m]")
        axes.set_xlabel("frequency [Hz]")
        axes.locator_params(axis="both", nbins=4)
    panels[0, 0].set_ylabel("amplitude")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4)
    return figure


def torque_amplitudes(wrench: Unexplained, index: int) -> tuple[Floats, Floats]:
    """Frequencies [Hz] and amplitudes [N m] of one recording's torque about its mean, up to where it is resolved."""
    time, torque = wrench.time[index], wrench.torque[Frame.BASE][index]
    uniform = np.linspace(time[0], time[-1], len(time))
    even = np.stack([np.interp(uniform, time, column) for column in torque.T], axis=1)
    amplitude = 2.0 * np.abs(np.fft.rfft(even - even.mean(axis=0), axis=0)) / len(even)
    frequency = np.fft.rfftfreq(len(even), float(uniform[1] - uniform[0]))
    shown = (frequency > 0.0) & (frequency <= 0.5 * WAVES / float(np.ptp(time)))
    return np.asarray(frequency[shown], dtype=float), np.asarray(amplitude[shown], dtype=float)
