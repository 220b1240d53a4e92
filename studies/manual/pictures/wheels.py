"""Picture of slews with reaction wheels: their speeds, the rate of the base, and the residuals."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bayesid.recording.recording import Recording
from bayesid.report.figures.figure_style import AFTER, BEFORE, curve_style, styled, wide_figure
from bayesid.report.numbers import format_number
from studies.manual.pictures.picture import Picture


def _diagnosis(folder: Path) -> dict[str, Any]:
    read: dict[str, Any] = json.loads((folder / "wheels" / "diagnosis.json").read_text(encoding="utf-8"))
    return read


@styled
def draw(folder: Path) -> Figure:
    """Draw speeds of the wheels, the rate, and the residuals without and with the cause."""
    recording = Recording.read(folder / "wheels" / "study" / "slew-1.csv")
    speeds = [name for name in recording.channels if name.startswith("wheel_speed.")]
    figure = wide_figure(2.2)
    wheel, rate, residual = figure.subplots(1, 3)
    for index, name in enumerate(speeds):
        wheel.plot(recording.time, recording.channels[name], label=name.partition(".")[2], **curve_style(index))
    wheel.set(title="wheels, slew 1", xlabel="time [s]", ylabel="speed [rad/s]")
    low, high = wheel.get_ylim()
    wheel.set_ylim(low, high + 0.35 * (high - low))
    wheel.legend(ncols=2, loc="upper center", handlelength=1.2, columnspacing=0.8)
    time, values = recording.vector("rate")
    for index, row in enumerate(values.T):
        rate.plot(time, 1e3 * row, label="xyz"[index], **curve_style(index))
    rate.set(title="base, slew 1", xlabel="time [s]", ylabel="angular rate [mrad/s]")
    rate.legend(ncols=3, loc="best", handlelength=1.2, columnspacing=0.8)
    rms = _diagnosis(folder)["gain"]["residual_rms_in_sigma"]
    rows = np.arange(len(rms["before"]))[::-1]
    for shift, key, colour, label in ((0.2, "before", BEFORE, "as given"), (-0.2, "after", AFTER, "with cause")):
        residual.barh(rows + shift, list(rms[key].values()), color=colour, height=0.38, label=label)
    residual.axvline(1.0, color="black", linewidth=0.8, linestyle="--")
    residual.set_xscale("log")
    residual.set_yticks(rows, list(rms["before"]))
    residual.set(xlabel="rms of the residual [σ]", ylim=(-0.6, len(rows) + 0.3))
    residual.legend(ncols=2, loc="upper center", handlelength=1.0, columnspacing=0.8)
    residual.grid(visible=False, axis="y")
    return figure


def reading(folder: Path) -> str:
    """Return what the picture of the slews states."""
    found = _diagnosis(folder)
    chi2 = found["gain"]["chi2_per_sample"]
    return (
        "The speeds of the wheels (left) turn the base (middle), and the known inertias of the wheels give the scale. "
        "The simulation with the wheels as given deviates far more than noise alone (right, orange; dashed: noise). "
        f"The diagnosis names {found['causes'][0]}, a misaligned axis; with it (blue) the chi-square per sample goes "
        f"from {format_number(chi2['before'])} to {format_number(chi2['after'])}."
    )


PICTURE = Picture("wheels", ("bayesid demo --example wheels --output wheels --samples 1000",), (), draw, reading)
