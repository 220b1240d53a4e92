"""Picture of joint torques: a measured torque, and the mass of the base with and without the torques."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from bayesid.recording.recording import Recording
from bayesid.report.figures.figure_style import AFTER, BEFORE, TRUTH, curve_style, styled, wide_figure
from bayesid.report.numbers import format_number
from studies.manual.pictures.picture import Picture

CASES = {"motion alone": ("motion-alone", BEFORE), "with torques": ("with-torque", AFTER)}


def _base(folder: Path, name: str) -> dict[str, Any]:
    read = json.loads((folder / name / "identification.json").read_text(encoding="utf-8"))
    base: dict[str, Any] = read["bodies"]["base_link"]
    return base


def _truth(folder: Path) -> float:
    from bayesid import Robot

    return Robot.from_urdf(folder / "out" / "study" / "robot.urdf").link("base_link").inertial.mass


@styled
def draw(folder: Path) -> Figure:
    """Draw the torques of one manoeuvre, and the intervals of the mass."""
    recording = Recording.read(folder / "flown-torque" / "manoeuvre-1.csv")
    figure = wide_figure(2.2)
    torque, mass = figure.subplots(1, 2, width_ratios=[1.2, 1.0])
    for index in range(3):
        values = recording.channels[f"torque.joint{index + 1}"]
        torque.plot(recording.time, values, label=f"joint{index + 1}", **curve_style(index))
    torque.set(title="manoeuvre 1", xlabel="time [s]", ylabel="joint torque [N m]")
    torque.legend(ncols=3, loc="upper right", handlelength=1.2, columnspacing=0.8)
    torque.set_ylim(top=1.5 * torque.get_ylim()[1])
    for row, (name, colour) in zip((1, 0), CASES.values(), strict=True):
        found = _base(folder, name)["mass"]
        mass.errorbar(found["mean"], row, xerr=1.96 * found["sd"], fmt="o", color=colour, markersize=4, capsize=3)
    mass.axvline(_truth(folder), color=TRUTH, linewidth=1.2)
    mass.text(_truth(folder), 1.55, " truth", va="center")
    mass.set_yticks((1, 0), list(CASES))
    mass.set(title="mass of the base, 95 %", xlabel="mass [kg]", ylim=(-0.6, 1.8))
    mass.grid(visible=False, axis="y")
    return figure


def reading(folder: Path) -> str:
    """Return what the picture of the torques states."""
    alone, joint = (_base(folder, name)["mass"] for name, _ in CASES.values())
    return (
        "Every link of the arm is uncertain. Motion alone then gives the mass of the base as "
        f"{format_number(alone['mean'])} ± {format_number(alone['sd'], 2)} kg (right, orange): it determines only "
        "ratios of masses. The torques (left, noise 2 mN m) reduce this to "
        f"{joint['mean']:.1f} ± {joint['sd']:.1f} kg (blue). "
        f"The simulated base has {format_number(_truth(folder))} kg."
    )


COMMANDS = (
    "bayesid demo --output out --samples 1000",
    "bayesid simulate torque-flown.toml --output flown-torque",
    "bayesid identify motion-alone.toml --output motion-alone --samples 1000",
    "bayesid identify with-torque.toml --output with-torque --samples 1000",
)
PICTURE = Picture("torque", COMMANDS, ("torque-flown.toml", "motion-alone.toml", "with-torque.toml"), draw, reading)
