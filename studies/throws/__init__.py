"""Study of real measurements: thrown bodies with a reaction wheel, identified, diagnosed and held to their geometry.

Data: Blaha, Kuijper, Pop, Smeur, "Rapid and Inexpensive Inertia Tensor Estimation from a Single Object Throw",
arXiv:2503.13137; not part of the project. ``python -m studies.throws --full`` writes ``reports/throws.pdf``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np

from bayesid._io.progress import Progress, silent
from bayesid.diagnosis import Diagnosis
from studies.common.provenance import study_origin
from studies.common.study import Command
from studies.throws.analysis import Analysis, BodyResult, analyse, prepare
from studies.throws.data import CALIBRATION, DEFAULT_FOLDER, Timing, read_throws, read_truth
from studies.throws.diagnosis import Lacking, geometry_errors, lacking, without_wheel
from studies.throws.left_over import pole_pairs
from studies.throws.model import is_fitted, is_rigid
from studies.throws.report import write_report

__all__ = ["Analysis", "BodyResult", "Result", "main", "run"]

QUICK = 4  # throws of each body that a quick run identifies
TRAINING = 1  # throws of each body that are diagnosed


@dataclass(frozen=True)
class Result:
    """Numbers of the study.

    Attributes
    ----------
    plain, extended : Analysis
        Rigid body with wheel and nothing else; the same with what the device and the air add.
    studies : tuple of Lacking
        What each body's diagnosis said; empty where it was left out.
    errors : mapping of str to mapping of str to (3,) array
        Of the diagnosed models against the geometry [%].
    wheels : mapping of str to Diagnosis
        With the recorded wheel dropped, by body; empty where that was left out.
    masses : mapping of str to float
        Of the bodies with the device on them [kg].
    pairs : int
        Pole pairs of the wheel's motor, from the calibration throws' loudest line.
    seconds, reverse_seconds : float
        Time of the run without the reverse, and of the reverse.
    """

    plain: Analysis
    extended: Analysis
    studies: tuple[Lacking, ...]
    errors: Mapping[str, Mapping[str, np.ndarray]]
    wheels: Mapping[str, Diagnosis]
    masses: Mapping[str, float]
    pairs: int
    seconds: float
    reverse_seconds: float


def run(
    folder: Path | None = None,
    *,
    full: bool = False,
    reverse: bool = False,
    seed: int = 1,
    throws: int | None = None,
    progress: Progress = silent,
) -> Result:
    """Run the study.

    Parameters
    ----------
    folder : path, optional
        Of the measurements; beside the checkout where left out.
    full : bool
        All throws, and the diagnosis of every body.
    reverse : bool
        Whether to drop the recorded wheel from a throw of every body and to have it sought, which takes minutes more.
    throws : int, optional
        Throws of each body; all in a full run and `QUICK` in a quick one where left out.

    Raises
    ------
    InputError
        If the measurements are not there.
    """
    began = perf_counter()
    folder = DEFAULT_FOLDER if folder is None else Path(folder)
    truth, count = read_truth(folder), throws if full or throws else QUICK
    rng = np.random.default_rng(seed)
    masses = {body: truth.thrown_mass(body) for body in truth.bodies}
    prepared = prepare(folder, truth, count)
    plain = analyse("rigid", prepared, is_rigid, truth, rng, folder, smooth=False)
    extended = analyse("extended", prepared, is_fitted, truth, rng, folder)
    pairs = pole_pairs([extended.left[body] for body in CALIBRATION])
    studies: tuple[Lacking, ...] = ()
    errors: Mapping[str, Mapping[str, np.ndarray]] = {}
    wheels: dict[str, Diagnosis] = {}
    if full:
        recordings = {body: read_throws(folder, body, Timing()) for body in truth.bodies}
        studies = tuple(
            lacking(body, recordings[body], masses[body], TRAINING, seed, progress, pairs=pairs)
            for body in truth.bodies
        )
        errors = geometry_errors(studies, truth)
    seconds = perf_counter() - began
    if reverse:
        for body in truth.bodies:
            thrown = read_throws(folder, body, Timing())
            wheels[body] = without_wheel(thrown, masses[body], TRAINING, seed, progress)
    return Result(plain, extended, studies, errors, wheels, masses, pairs, seconds, perf_counter() - began - seconds)


COMMAND = Command(
    "throws",
    "Identify and diagnose thrown rigid bodies from real measurements.",
    full="all throws, and the diagnosis of every body",
    seed=1,
    extra={
        "--data": {"type": Path, "help": "folder of the measurements"},
        "--reverse": {"action": "store_true", "help": "drop the recorded wheel from a throw of every body and seek it"},
    },
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    options = COMMAND.parse(arguments)
    folder = DEFAULT_FOLDER if options.data is None else options.data
    result = run(folder, full=options.full, reverse=options.reverse, seed=options.seed)
    inputs = [folder / "truth.json", folder / "index.csv"]
    write_report(result, options.output, origin=study_origin(COMMAND.name, options, inputs))
