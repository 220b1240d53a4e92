"""The picture of the README: a recording, the posterior of its hidden cause, and the verdict.

``python -m studies.picture out`` writes ``reports/demo.png`` from what ``bayesid demo --output out`` made.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bayesid._io.files import complete_file
from bayesid.diagnosis.outcome.cause_sizes import Z95
from bayesid.recording.recording import Recording
from bayesid.report.figures.diagnosis_figures import GIVEN
from bayesid.report.figures.figure_style import COLOURS, FILL, curve_style, styled
from bayesid.report.numbers import format_number, format_probability, format_unit

SIZE = (9.0, 2.9)  # width and height [in]
RESOLUTION = 130  # resolution of the picture [dots per inch]
LINEAR = 0.05  # size of a cause up to which the axis of the posterior is linear [N m s]
SETS = 5  # number of candidates whose probabilities are drawn


@styled
def readme_figure(folder: Path, truth: Mapping[str, Mapping[str, float]]) -> Figure:
    """Draw the three panels from the results of a demonstration and what was hidden in its recordings."""
    diagnosis = json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))
    figure = Figure(figsize=SIZE, layout="constrained")
    recording, posterior, verdict = figure.subplots(1, 3, width_ratios=[1.0, 1.15, 1.0])
    _draw_recording(recording, folder / "study" / f"{diagnosis['strongest_recording']}.csv")
    (cause,) = diagnosis["causes"]
    _draw_posterior(posterior, diagnosis["identification"]["effects"][cause], truth[cause], cause)
    _draw_verdict(verdict, diagnosis)
    return figure


def _draw_recording(axes: Axes, file: Path) -> None:
    recording = Recording.read(file)
    time, rate = recording.vector("rate")
    for axis, values in enumerate(rate.T):
        axes.plot(time, 1e3 * values, label="xyz"[axis], **curve_style(axis))
    axes.set(title="1. Recording: the base reacts to its arm", xlabel="time [s]", ylabel="base rate [mrad/s]")
    axes.set_ylim(top=1.4 * 1e3 * float(rate.max()))
    axes.legend(ncols=3, loc="upper left")


def _draw_posterior(axes: Axes, effect: Mapping[str, Any], truth: Mapping[str, float], cause: str) -> None:
    """Draw prior, posterior and truth of each component of the cause's size, on an axis that is linear near zero."""
    place = np.arange(len(effect))[::-1]
    means, sds = (np.array([item[key] for item in effect.values()]) for key in ("mean", "sd"))
    low, high = np.array([item["prior_68"] for item in effect.values()]).T
    axes.barh(place, high - low, left=low, height=0.2, color=GIVEN, alpha=0.5, label="prior, 68 %")
    axes.errorbar(means, place, xerr=Z95 * sds, fmt="o", color=COLOURS[0], markersize=4, label="posterior, 95 %")
    axes.plot([truth[name] for name in effect], place + 0.2, "v", color=COLOURS[1], markersize=5, label="truth")
    axes.set_xscale("symlog", linthresh=LINEAR, linscale=3.0)
    axes.set_xticks([-1.0, -LINEAR, 0.0, LINEAR, 1.0], ["−1", f"−{LINEAR:g}", "0", f"{LINEAR:g}", "1"])
    axes.minorticks_off()
    axes.set_xlim(-2.0, 2.0)
    axes.set_yticks(place, list(effect))
    axes.set_ylim(-0.6, len(effect) + 0.5)
    axes.grid(visible=False, axis="y")
    axes.set_title(f"2. Posterior of {cause}")
    axes.set_xlabel(f"size [{format_unit(next(iter(effect.values()))['unit'])}]")
    axes.legend(ncols=3, loc="upper center", columnspacing=1.0, handlelength=1.2)


def _draw_verdict(axes: Axes, diagnosis: Mapping[str, Any]) -> None:
    """Draw the probabilities of the most probable causes, of something unknown and of nothing."""
    stated = diagnosis["probability"]
    causes = sorted(stated["causes"].items(), key=lambda item: -item[1])[: SETS - 2]
    rows = [*causes, ("something unknown", stated["unknown"]), ("nothing", stated["nothing"])]
    place = np.arange(len(rows))[::-1]
    named = [name in diagnosis["causes"] for name, _ in rows]
    axes.barh(place, [value for _, value in rows], color=[COLOURS[0] if one else FILL for one in named], height=0.6)
    for height, (_, value) in zip(place, rows, strict=True):
        inside = value > 0.5
        text = f" {format_probability(value)} "
        colour, side = ("white", "right") if inside else ("black", "left")
        axes.text(value, height, text, va="center", ha=side, color=colour)
    axes.set_yticks(place, [name for name, _ in rows])
    axes.set_xlim(0.0, 1.0)
    axes.grid(visible=False)
    chi2 = diagnosis["gain"]["chi2_per_sample"]
    gain = f"chi-square per sample {format_number(chi2['before'])} → {format_number(chi2['after'])}"
    axes.set(title=f"3. Verdict: {diagnosis['status']}", xlabel=f"probability of being present\n{gain}")


def run(folder: Path, output: Path) -> None:
    """Write the picture from the folder of a demonstration."""
    truth = json.loads((files("bayesid.app") / "demonstration_data" / "hidden.json").read_text(encoding="utf-8"))
    figure = readme_figure(folder, truth)
    with complete_file(output) as part:
        figure.savefig(part, format="png", dpi=RESOLUTION)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m studies.picture", description="Draw the picture of the README.")
    parser.add_argument("folder", type=Path, help="folder that bayesid demo --output wrote")
    parser.add_argument("--output", type=Path, default=Path("reports/demo.png"))
    given = parser.parse_args()
    run(given.folder, given.output)
