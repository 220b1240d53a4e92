"""Picture of a planned manoeuvre: the motion of its joints, how far it uses its limits, and what it would determine."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bayesid.recording.recording import Recording
from bayesid.report.figures.figure_style import AFTER, BEFORE, curve_style, styled, wide_figure
from bayesid.report.numbers import format_number
from studies.manual.pictures.pages import adopt
from studies.manual.pictures.picture import Picture


def _best(folder: Path) -> dict[str, Any]:
    read = json.loads((folder / "design" / "design.json").read_text(encoding="utf-8"))
    best: dict[str, Any] = next(one for one in read["manoeuvres"] if one["name"] == read["best"])
    return best


def _identified(folder: Path) -> dict[str, float]:
    """Return the standard deviations from the three recordings, by parameter."""
    read = json.loads((folder / "after" / "identification.json").read_text(encoding="utf-8"))
    base = read["bodies"]["base_link"]
    inertia = {f"inertia.{axes}": one for axes, one in base["inertia"].items()}
    com = {f"com.{axis}": one for axis, one in zip("xyz", base["com"], strict=True)}
    return {f"base_link.{name}": one["sd"] for name, one in {"mass": base["mass"], **com, **inertia}.items()}


@styled
def draw(folder: Path) -> Figure:
    """Draw the angles of the joints, the use of the limits, and the predicted standard deviations."""
    best = _best(folder)
    recording = Recording.read(folder / "design" / best["file"])
    figure = wide_figure(2.3)
    joints, limits, sds = figure.subplots(1, 3, width_ratios=[1.1, 0.9, 0.9])
    for index, name in enumerate(recording.joints):
        angle = recording.channels[f"position.{name}"]
        joints.plot(recording.time, angle, label=name, **curve_style(index))
    joints.set(title=best["name"], xlabel="time [s]", ylabel="joint angle [rad]")
    joints.set_ylim(top=1.5 * joints.get_ylim()[1])
    joints.legend(ncols=2, loc="upper center", handlelength=1.0, columnspacing=0.8)
    used = [one for one in best["limits"].items() if one[1]["limit"]]
    rows = np.arange(len(used))[::-1]
    limits.barh(rows, [100.0 * one["largest"] / one["limit"] for _, one in used], color=BEFORE, height=0.5)
    limits.axvline(100.0, color="black", linewidth=0.8, linestyle="--")
    limits.set_yticks(rows, [name for name, _ in used])
    limits.set(title="use of the limits", xlabel="largest value / limit [%]", xlim=(0.0, 110.0))
    planned, now = best["predicted_sd"], _identified(folder)
    rows = np.arange(len(now))[::-1]
    sds.barh(rows, [planned[name] / sd for name, sd in now.items()], color=AFTER, height=0.6)
    sds.axvline(1.0, color="black", linewidth=0.8, linestyle="--")
    sds.set_yticks(rows, [name.partition(".")[2] for name in now])
    sds.set(title="predicted sd", xlabel="sd / sd before", xlim=(0.0, 1.05))
    for panel in (limits, sds):
        panel.grid(visible=False, axis="y")
    return figure


def reading(folder: Path) -> str:
    """Return what the picture of the manoeuvre states."""
    best, now = _best(folder), _identified(folder)
    mass = best["predicted_sd"]["base_link.mass"]
    uncertain = (
        "Every limit is satisfied with 99 % probability. "
        if best["go"]
        else "Not every limit is satisfied with 99 % probability. "
    )
    return (
        f"Left: the recommended motion, {format_number(best['duration'])} s from rest to rest. Middle: how far it uses "
        f"its limits at the prior's centre; no bar may pass the dashed line. {uncertain}Right: the standard deviations "
        "with it, relative to those of the three recordings (the prior of this study); that of the mass goes from "
        f"{format_number(now['base_link.mass'], 2)} to {format_number(mass, 2)} kg."
    )


STEPS = (
    "bayesid demo --output out --samples 1000",
    adopt,
    "bayesid identify out/study/adopted.toml --output after --samples 1000",
    "bayesid design plan.toml --output design --starts 2 --iterations 20",
)
PICTURE = Picture("plan", STEPS, ("plan.toml",), draw, reading)
