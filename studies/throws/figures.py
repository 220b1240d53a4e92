"""Figures of the study."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from bayesid.report.figures.figure_style import styled, wide_figure
from studies.throws.analysis import Analysis
from studies.throws.left_over import CHANNELS, ORDERS, LeftOver

__all__ = ["left_over_figure", "throws_figure"]


@styled
def throws_figure(plain: Analysis, extended: Analysis) -> Figure:
    """Draw the errors of single throws, a row per body, a column per model."""
    figure = wide_figure(1.6 * len(extended.bodies))
    panels = figure.subplots(len(extended.bodies), 2, sharey="row", squeeze=False)
    for row, body in zip(panels, extended.bodies, strict=True):
        for axes, analysis in zip(row, (plain, extended), strict=True):
            result = analysis.bodies[body]
            band = float(100.0 * (result.truth_sd / result.truth).max())
            axes.axhspan(-band, band, color="#eeeeee")
            axes.axhline(0.0, color="#888888", linewidth=0.8)
            places = np.arange(len(result.throws))
            for index, name in enumerate(("smallest", "middle", "largest")):
                sd = 100.0 * result.formal[:, index] / result.truth[index]
                place = places + 0.2 * (index - 1)
                axes.errorbar(
                    place, result.errors[:, index], sd, fmt="os^"[index], markersize=3, linewidth=1, label=name
                )
            axes.set_xticks(places, [name[-3:] for name in result.throws])
            axes.set_title(f"{body}, {analysis.label} model")
        row[0].set_ylabel("error [%]")
    for axes in panels[-1]:
        axes.set_xlabel("number of the throw")
    handles, labels = panels[0][1].get_legend_handles_labels()
    figure.legend(handles, [f"{label} moment" for label in labels], loc="outside upper center", ncols=3)
    return figure


@styled
def left_over_figure(left: Mapping[str, LeftOver]) -> Figure:
    """Draw the spectrum of what is left on the accelerometer, and the raw accelerometer against the wheel's orders."""
    figure = wide_figure(0.6 + 0.72 * len(left))
    panels = figure.subplots(len(left), 2, sharex="col", squeeze=False)
    for row, (body, own) in zip(panels, left.items(), strict=True):
        spectrum = np.array([own.spectrum[:, c] for c in range(3, 6)])
        for edge in (own.wheel[0], own.wheel[2]):
            row[0].axvspan(edge - 2.0, edge + 2.0, color="#eeeeee")
        for c in range(3, 6):
            row[0].plot(own.frequencies[1:], 1e3 * spectrum[c - 3, 1:], linewidth=1, label=CHANNELS[c][-1])
            row[1].semilogy(
                ORDERS, np.sqrt((own.orders[:, :, c] ** 2).mean(axis=0)), linewidth=1, label=CHANNELS[c][-1]
            )
        row[1].axvline(own.turn[0], color="#888888", linewidth=0.8)
        row[0].set_title(body, loc="left")
        row[0].set_ylabel("[mm/s²]")
        row[1].set_ylabel("[m/s²]")
    panels[0][0].set_title("residual of samples")
    panels[0][1].set_title("raw readings, wheel at speed")
    panels[-1][0].set_xlabel("frequency [Hz]")
    panels[-1][1].set_xlabel("frequency / that of the recorded wheel")
    handles, labels = panels[0][1].get_legend_handles_labels()
    figure.legend(handles, [f"accelerometer {label}" for label in labels], loc="outside upper center", ncols=3)
    return figure
