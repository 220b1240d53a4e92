"""Picture of a weighed load: prior, posterior and truth of its mass, centre of mass and inertia."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bayesid.report.figures.figure_style import AFTER, BEFORE, TRUTH, shared_legend, styled, wide_figure
from bayesid.report.numbers import format_number
from studies.manual.pictures.picture import Picture


def _values(folder: Path) -> Iterator[tuple[str, str, float, float, float, float, float]]:
    """Yield name, unit, guess, half the prior's width, mean, sd and truth of every quantity of the load."""
    found = json.loads((folder / "load" / "identification.json").read_text(encoding="utf-8"))
    body, widths = found["bodies"]["load"], found["widths"]
    guess, truth = (
        tomllib.loads((folder / name).read_text(encoding="utf-8"))["robot"]["loads"][0]
        for name in ("load.toml", "load-flown.toml")
    )
    names = ["mass", *(f"com.{axis}" for axis in "xyz"), *(f"inertia.{axes}" for axes in body["inertia"])]
    stated = [body["mass"], *body["com"], *body["inertia"].values()]
    given, true = ([one["mass"], *one["com"], *one["inertia"]] for one in (guess, truth))
    for name, quantity, centre, value in zip(names, stated, given, true, strict=True):
        prior = widths[f"load.{name}"]["prior"]
        yield name, quantity["unit"].replace("kg m2", "kg m²"), centre, prior, quantity["mean"], quantity["sd"], value


@styled
def draw(folder: Path) -> Figure:
    """Draw one panel for the mass, the centre of mass and the moments of inertia."""
    rows = list(_values(folder))
    groups = {"mass": rows[:1], "centre of mass": rows[1:4], "moments of inertia": rows[4:7]}
    figure = wide_figure(1.9)
    panels = figure.subplots(1, 3, width_ratios=[0.8, 1.1, 1.1])
    for panel, (title, group) in zip(panels, groups.items(), strict=True):
        place = np.arange(len(group))[::-1]
        _, units, *values = zip(*group, strict=True)
        guess, prior, mean, sd, truth = map(np.array, values)
        if title == "centre of mass":
            guess, mean, truth = 0.0 * guess, 1e3 * (mean - guess), 1e3 * (truth - guess)
            prior, sd, unit = 1e3 * prior, 1e3 * sd, "mm from the guess"
            reach = np.array([prior, prior])
        else:  # positive: the prior is log-normal, with the same half of its central range
            factor, unit = np.exp(np.arcsinh(prior / guess)), units[0]
            reach = np.array([guess - guess / factor, guess * factor - guess])
        panel.errorbar(guess, place + 0.2, xerr=reach, fmt="s", color=BEFORE, markersize=3, label="prior, 68 %")
        panel.errorbar(mean, place, xerr=sd, fmt="o", color=AFTER, markersize=3, capsize=2, label="posterior, 68 %")
        panel.plot(truth, place - 0.2, "^", color=TRUTH, markersize=4, label="truth")
        panel.set_yticks(place, [name.partition(".")[2] for name, *_ in group])
        panel.set(title=title, xlabel=f"[{unit}]", ylim=(-0.6, len(group) - 0.4))
        panel.grid(visible=False, axis="y")
    shared_legend(figure, panels[0], columns=3)
    return figure


def reading(folder: Path) -> str:
    """Return what the picture of the load states."""
    _, _, guess, prior, mean, sd, truth = next(_values(folder))
    factor = float(np.exp(np.arcsinh(prior / guess)))
    return (
        f"The guess of {format_number(guess)} kg has a log-normal prior (orange), whose central 68 % interval is "
        f"{format_number(guess / factor, 2)} to {format_number(guess * factor, 2)} kg; the posterior is "
        f"{format_number(mean)} ± {format_number(sd, 2)} kg (1 sigma). The simulated load has a mass of "
        f"{format_number(truth)} kg. The centre of mass moves from the guess to the truth. The base and the arm, which "
        "give the scale, limit the accuracy of the mass."
    )


COMMANDS = (
    "bayesid demo --output out --samples 1000",
    "bayesid simulate load-flown.toml --output flown",
    "bayesid identify load.toml --output load --samples 1000",
)
PICTURE = Picture("load", COMMANDS, ("load-flown.toml", "load.toml"), draw, reading)
