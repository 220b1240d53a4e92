"""Picture of a diagnosis: the residuals without and with the named cause, and the probabilities."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bayesid.report.figures.figure_style import AFTER, BEFORE, FILL, shared_legend, styled, wide_figure
from bayesid.report.numbers import format_number, format_probability
from studies.manual.pictures.picture import Picture

SHOWN = 5  # number of causes whose probabilities are drawn


def _diagnosis(folder: Path) -> dict[str, Any]:
    read: dict[str, Any] = json.loads((folder / "out" / "diagnosis.json").read_text(encoding="utf-8"))
    return read


@styled
def draw(folder: Path) -> Figure:
    """Draw residuals by channel without and with the cause, and the most probable causes."""
    found = _diagnosis(folder)
    figure = wide_figure(2.3)
    misfit, causes = figure.subplots(1, 2, width_ratios=[1.2, 1.0])
    residual = found["gain"]["residual_rms_in_sigma"]
    names = list(residual["before"])
    place = np.arange(len(names))
    for shift, key, colour, label in ((-0.2, "before", BEFORE, "study as it is"), (0.2, "after", AFTER, "with cause")):
        misfit.bar(place + shift, [residual[key][name] for name in names], width=0.38, color=colour, label=label)
    misfit.axhline(1.0, color="black", linewidth=0.8, linestyle="--", label="noise alone")
    misfit.set_xticks(place, names, rotation=30)
    misfit.set(ylabel="rms of the residual [σ]", ylim=(0.0, 1.4))
    misfit.grid(visible=False, axis="x")
    likely = sorted(found["probability"]["causes"].items(), key=lambda item: -item[1])[:SHOWN]
    rows = np.arange(len(likely))[::-1]
    named = [AFTER if name in found["causes"] else FILL for name, _ in likely]
    causes.barh(rows, [value for _, value in likely], color=named, height=0.6)
    for row, (_, value) in zip(rows, likely, strict=True):
        side, colour = ("right", "white") if value > 0.5 else ("left", "black")
        causes.text(value, row, f" {format_probability(value)} ", va="center", ha=side, color=colour)
    causes.set_yticks(rows, [name for name, _ in likely])
    causes.set(xlabel="probability", xlim=(0.0, 1.0))
    causes.grid(visible=False)
    shared_legend(figure, misfit, columns=3)
    return figure


def reading(folder: Path) -> str:
    """Return what the picture of a diagnosis states."""
    found = _diagnosis(folder)
    chi2 = found["gain"]["chi2_per_sample"]
    return (
        "Left: the gyro (rate) deviates from the simulation by more than its noise; with the named cause in the model, "
        f"every channel is at the noise level. Right: {found['causes'][0]} is the only cause with a high probability. "
        f"The chi-square per sample goes from {format_number(chi2['before'])} to {format_number(chi2['after'])}."
    )


PICTURE = Picture("drift", ("bayesid demo --output out --samples 1000",), (), draw, reading)
