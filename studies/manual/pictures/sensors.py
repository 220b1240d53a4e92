"""Picture of what further sensors would help: the worst known parameter with each candidate, relative to now."""

from __future__ import annotations

import json
import textwrap
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bayesid.report.figures.figure_style import AFTER, styled, wide_figure
from bayesid.report.numbers import format_number
from studies.manual.pictures.pages import adopt
from studies.manual.pictures.picture import Picture

SHOWN = 6  # number of candidates that are drawn
LINE = 46  # characters of a line of a candidate's name


def _found(folder: Path) -> tuple[str, float, str, list[dict[str, Any]]]:
    """Return the worst known parameter, its sd and unit, and the candidates, the best for it first."""
    read = json.loads((folder / "identifiability" / "identifiability.json").read_text(encoding="utf-8"))
    advice = [one for one in read["advice"] if one["evaluated"]]
    name = advice[0]["worst_parameter"]["name"]
    now = next(one for one in read["parameters"] if one["name"] == name)
    return name, now["sd"], now["unit"], sorted(advice, key=lambda one: one["worst_parameter"]["sd"])


@styled
def draw(folder: Path) -> Figure:
    """Draw the remaining standard deviation with each candidate."""
    name, sd, _, advice = _found(folder)
    shown = advice[:SHOWN]
    figure = wide_figure(2.7)
    axes = figure.subplots()
    rows = np.arange(len(shown))[::-1]
    left = [100.0 * one["worst_parameter"]["sd"] / sd for one in shown]
    axes.barh(rows, left, color=AFTER, height=0.6)
    for row, value in zip(rows, left, strict=True):
        axes.text(value, row, f"{format_number(value, 2)} % ", va="center", ha="right", color="white")
    axes.axvline(100.0, color="black", linewidth=0.8, linestyle="--")
    axes.text(99.0, rows[0] + 0.45, "now", ha="right", va="bottom")
    axes.set_yticks(rows, [textwrap.fill(one["text"], LINE) for one in shown])
    axes.set(xlabel=f"sd of {name} relative to now [%]", xlim=(0.0, 115.0), ylim=(-0.6, len(shown) - 0.1))
    axes.grid(visible=False, axis="y")
    return figure


def reading(folder: Path) -> str:
    """Return what the picture of the candidates states."""
    name, sd, unit, advice = _found(folder)
    best = advice[0]
    left = best["worst_parameter"]["sd"] / sd
    return (
        f"With the sensors as they are, the parameter least well determined relative to its prior is {name} (sd "
        f"{format_number(sd, 2)} {unit.replace('kg m2', 'kg m²')}). The shorter the bar, the more a candidate helps: "
        f"the best one, “{best['text']}”, would reduce its sd to {format_number(100.0 * left, 2)} % of the present "
        "value."
    )


STEPS = (
    "bayesid demo --output out --samples 1000",
    adopt,
    "bayesid identifiability out/study/adopted.toml --output identifiability --samples 200 --profiles 1",
)
PICTURE = Picture("sensors", STEPS, (), draw, reading)
