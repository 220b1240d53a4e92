"""Study of real measurements: thrown rigid bodies with a reaction wheel, identified and compared with their geometry.

Data: Blaha, Kuijper, Pop, Smeur, "Rapid and Inexpensive Inertia Tensor Estimation from a Single Object Throw",
arXiv:2503.13137; not part of the project. ``python -m studies.throws --full`` writes ``reports/throws.pdf``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from studies.common.command import Command
from studies.throws.analysis import Analysis, BodyResult, analyse, configure, prepare
from studies.throws.data import DEFAULT_FOLDER, Timing, read_truth
from studies.throws.model import TORQUE, Settings, is_fitted, is_rigid
from studies.throws.report import draw_figures, write_report
from studies.throws.sampling import Sampled, sample_jointly

__all__ = ["Analysis", "BodyResult", "Result", "main", "run"]

QUICK = 4
"""Throws of each body in a quick run."""


@dataclass(frozen=True)
class Result:
    """Numbers and figures of the study.

    Attributes
    ----------
    plain, extended : Analysis
        Rigid body with wheel and nothing else; the same with what it lacks.
    variants : mapping of str to Analysis
        The extended model with other reasonable choices; only in a full run.
    sampled : Sampled or None
        Posterior samples of one joint fit beside its Laplace approximation; only in a full run.
    """

    plain: Analysis
    extended: Analysis
    variants: Mapping[str, Analysis]
    sampled: Sampled | None
    figures: Mapping[str, Figure]
    full: bool


def run(folder: Path | None = None, *, full: bool = False, seed: int = 1, throws: int | None = None) -> Result:
    """Run the study.

    Parameters
    ----------
    folder : path, optional
        Of the measurements; beside the checkout where left out.
    full : bool
        All throws, other settings, and posterior samples.
    throws : int, optional
        Throws of each body; all in a full run and `QUICK` in a quick one where left out.

    Raises
    ------
    InputError
        If the measurements are not there.
    """
    folder = DEFAULT_FOLDER if folder is None else Path(folder)
    truth, count = read_truth(folder), throws if full or throws else QUICK
    rng = np.random.default_rng(seed)

    throws_read = prepare(folder, Timing(), count)
    configured = configure(throws_read, Settings())
    plain = analyse("plain", configured, is_rigid, truth, rng)
    extended = analyse("extended", configured, is_fitted, truth, rng)
    variants = {}
    for label, (settings, timing, free) in _variants().items() if full else ():
        own = throws_read if timing == Timing() else prepare(folder, timing, count, throws_read[0].posterior)
        variants[label] = analyse(label, configure(own, settings), free, truth, rng)
    sampled = sample_jointly(folder, "A", Settings(knots=8), Timing(), seed) if full else None
    return Result(plain, extended, variants, sampled, draw_figures(plain, extended), full)


def _variants() -> dict[str, tuple[Settings, Timing, Callable[[str], bool]]]:
    settings, timing = Settings(), Timing()

    def torque(values: dict[str, float]) -> tuple[Settings, Timing, Callable[[str], bool]]:
        return replace(settings, torque=values), timing, is_fitted

    return {
        "torque prior halved": torque({body: 0.5 * sd for body, sd in TORQUE.items()}),
        "torque prior doubled": torque({body: 2.0 * sd for body, sd in TORQUE.items()}),
        "torque prior 100 for all bodies": torque(dict.fromkeys(TORQUE, 100.0)),
        "gyro noise halved": (replace(settings, rate_sigma=0.0035), timing, is_fitted),
        "gyro noise doubled": (replace(settings, rate_sigma=0.014), timing, is_fitted),
        "no drag": (settings, timing, lambda name: is_fitted(name) and "air-drag" not in name),
        "no cross-axis terms": (settings, timing, lambda name: is_fitted(name) and "gyro-cross" not in name),
        "no wheel tilt": (settings, timing, lambda name: is_fitted(name) and "wheel-tilt" not in name),
        "samples at fast wheel kept": (settings, replace(timing, fast=1e9), is_fitted),
        "more samples at fast wheel left out": (settings, replace(timing, fast=6000.0), is_fitted),
        "start 44 ms later": (settings, replace(timing, start=timing.start + 0.044), is_fitted),
        "wheel delay as recorded": (settings, replace(timing, delay=0.0, delay_periods=0.0), is_fitted),
    }


COMMAND = Command(
    "throws",
    "Identify thrown rigid bodies from real measurements.",
    full="all throws, other settings and posterior samples",
    extra={"--data": {"type": Path, "help": "folder of the measurements"}},
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    options = COMMAND.parse(arguments)
    result = run(options.data, full=options.full)
    write_report(result, options.output)
