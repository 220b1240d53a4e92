"""Picture of a user-defined effect: the manual's own example, identified from recordings with a known torque."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bayesid.report.figures.figure_style import AFTER, BEFORE, TRUTH, styled, wide_figure
from studies.manual.pictures.picture import Picture

PROSE = Path(__file__).parents[1] / "manual.typ"  # contains the example
TRUE = (2.0e-3, -1.0e-3, 1.5e-3)  # torque in the recordings, base axes [N m]
FILES = [f"manoeuvre-{number}.csv" for number in (1, 2, 3)]
TORQUE = dict(zip((f"base_torque.{axis}" for axis in "xyz"), TRUE, strict=True))
FORCE = {f"base_force.{axis}": 0.0 for axis in "xyz"}


def _rows(file: Path) -> list[dict[str, str]]:
    with file.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def _write(file: Path, rows: list[dict[str, Any]]) -> None:
    file.parent.mkdir(exist_ok=True)
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.DictWriter(stream, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def push(folder: Path) -> None:
    """Write the motions of the demonstration with a known torque, and the example of the manual as a plugin."""
    for name in FILES:
        rows = _rows(folder / "out" / "study" / name)
        _write(folder / "pushed" / name, [{**row, **TORQUE, **FORCE} for row in rows])
    blocks = re.findall(r"```python\n(.*?)```", PROSE.read_text(encoding="utf-8"), flags=re.DOTALL)
    (example,) = (block for block in blocks if 'name = "steady-torque"' in block)
    (folder / "steady_torque.py").write_text(example, encoding="utf-8")


def hide(folder: Path) -> None:
    """Write the simulated recordings without the columns of the torque, which becomes unknown."""
    for name in FILES:
        rows = _rows(folder / "simulated-pushed" / name)
        kept = [{key: value for key, value in row.items() if key not in {*TORQUE, *FORCE}} for row in rows]
        _write(folder / "flown-pushed" / name, kept)


def _sizes(folder: Path) -> dict[str, Any]:
    read = json.loads((folder / "effect" / "identification.json").read_text(encoding="utf-8"))
    sizes: dict[str, Any] = read["effects"]["steady-torque"]
    return sizes


@styled
def draw(folder: Path) -> Figure:
    """Draw prior, posterior and truth of the three components, and the deviations from the truth."""
    sizes = _sizes(folder)
    figure = wide_figure(1.9)
    size, error = figure.subplots(1, 2)
    place = np.arange(3)[::-1]
    mean, sd = (1e3 * np.array([one[key] for one in sizes.values()]) for key in ("mean", "sd"))
    low, high = 1e3 * np.array([one["prior_68"] for one in sizes.values()]).T
    true = 1e3 * np.array(TRUE)
    size.barh(place, high - low, left=low, height=0.5, color=BEFORE, alpha=0.35, label="prior, 68 %")
    size.plot(mean, place, "o", color=AFTER, markersize=4, label="posterior")
    size.plot(true, place, "|", color="black", markersize=13, label="truth")
    size.set(title="size of steady-torque", xlabel="torque [mN m]", xlim=(-1.5, 2.5), ylim=(-0.6, 3.2))
    size.legend(ncols=3, loc="upper center", handlelength=1.0, columnspacing=0.8)
    error.axvline(0.0, color=TRUTH, linewidth=1.2, label="truth")
    error.errorbar(1e3 * (mean - true), place, xerr=1e3 * 1.96 * sd, fmt="o", color=AFTER, markersize=4, capsize=2)
    error.set(title="posterior minus truth, 95 %", xlabel="torque [µN m]", ylim=(-0.6, 3.2))
    for panel in (size, error):
        panel.set_yticks(place, list(sizes))
        panel.grid(visible=False, axis="y")
    return figure


def reading(folder: Path) -> str:
    """Return what the picture of the effect states."""
    x = _sizes(folder)["x"]
    return (
        "A torque was added as `base_torque` to the planned motion, the sensors were simulated, and its columns were "
        "removed (`studies/manual/pictures/effect.py` does both). A study that names the class above, stored as "
        f"`steady_torque.py`, under `plugins` and `effects` recovers it: x is {1e3 * x['mean']:.4f} ± "
        f"{1e3 * x['sd']:.4f} mN m, where {1e3 * TRUE[0]:g} mN m acted. Right: all three components "
        "agree with the truth within their 95 % intervals, which are far narrower than the prior."
    )


STEPS = (
    "bayesid demo --output out --samples 1000",
    push,
    "bayesid simulate effect-flown.toml --output simulated-pushed",
    hide,
    "bayesid identify effect.toml --output effect --samples 1000",
)
PICTURE = Picture("effect", STEPS, ("effect-flown.toml", "effect.toml"), draw, reading)
