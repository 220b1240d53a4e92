"""Progress of a loop: how well each body is known after each step, and how close its limits came."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bayesid.report.figures.figure_style import COLOURS, WIDTH, styled

__all__ = ["loop_progress"]

SHOWN = ("mass", "inertia.xx", "inertia.yy", "inertia.zz")
"""Quantities whose relative standard deviations are drawn."""

MARKS = ("o", "s", "^", "D")
"""Marks of the quantities, in their order."""


@styled
def loop_progress(steps: Sequence[dict[str, Any]]) -> Figure:
    """Draw relative standard deviations after each step, and the 99 % quantile of each limited quantity over its limit.

    Parameters
    ----------
    steps : sequence of dict
        Steps of a loop that were identified.
    """
    figure = Figure(figsize=(WIDTH, 2.6), layout="constrained")
    known, limits = figure.subplots(1, 2)
    numbers = [step["step"] for step in steps]
    bodies = steps[0]["identification"]["bodies"]
    for colour, name in zip(COLOURS, bodies, strict=False):
        for mark, key in zip(MARKS, SHOWN, strict=True):
            items = [step["identification"]["bodies"][name][key] for step in steps]
            ratio = [100.0 * item["sd"] / abs(item["mean"]) for item in items]
            known.plot(numbers, ratio, marker=mark, markersize=3.5, color=colour, label=f"{name} {key}", alpha=0.8)
    known.set(yscale="log", xlabel="step", ylabel="standard deviation / mean [%]", title="What is known")
    names = list(dict.fromkeys(key for step in steps for key in step["plan"]["attempts"][-1]["limits"]))
    for colour, name in zip(COLOURS, names, strict=False):
        entries = [step["plan"]["attempts"][-1]["limits"].get(name) for step in steps]
        used = [np.nan if item is None else 100.0 * item["quantile_99"] / item["limit"] for item in entries]
        limits.plot(numbers, used, marker="o", markersize=3.5, color=colour, label=name.replace("_", " "))
    limits.axhline(100.0, color="black", linewidth=0.8, linestyle="--")
    limits.set(xlabel="step", ylabel="99 % quantile / limit [%]", title="Limits that depend on what is known")
    limits.set_ylim(0.0, 110.0)
    for axes in (known, limits):
        axes.set_xticks(numbers)
        axes.set_xlim(numbers[0] - 0.5, numbers[-1] + 0.5)
    known.legend()
    if names:
        limits.legend(loc="lower right")
    return figure
