"""What a rigid body with its wheel gets wrong about real throws: named from the data alone, and what that gains.

Data as in `studies.throws`; ``python -m studies.throws_drag --full`` writes ``reports/throws_drag.pdf``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bayesid._io.progress import Progress, silent
from studies.common.command import Command
from studies.throws.data import DEFAULT_FOLDER, read_truth
from studies.throws_drag.analysis import Comparison, Study, Wheel, compare, find_wheel, study_body
from studies.throws_drag.report import write_report

__all__ = ["Result", "main", "run"]

BODIES = ("A", "Empty")
"""Diagnosed: the plate with blocks, and the bare plate, which feels the air most."""


@dataclass(frozen=True)
class Result:
    """Numbers of the study.

    Attributes
    ----------
    studies : tuple of Study
        One per body.
    comparison : Comparison
        Against the authors' geometry.
    wheel : Wheel or None
        The reverse: the wheel taken from the model of the first body.
    """

    studies: tuple[Study, ...]
    comparison: Comparison
    wheel: Wheel | None
    full: bool


def run(
    folder: Path | None = None,
    *,
    full: bool = False,
    seed: int = 1,
    names: Sequence[str] | None = None,
    reverse: bool = True,
    progress: Progress = silent,
) -> Result:
    """Run the study.

    Parameters
    ----------
    folder : path, optional
        Of the measurements; beside the checkout where left out.
    full : bool
        Both bodies and more throws.
    seed : int
        Every random number follows from it.
    names : sequence of str, optional
        Candidates of the catalogue; all but hidden vibrations where left out.
    reverse : bool
        Whether to take the wheel from the model and have it found.
    progress : callable, optional
        Told a fraction and a sentence, anew in every diagnosis.

    Raises
    ------
    InputError
        If the measurements are not there.
    """
    folder = DEFAULT_FOLDER if folder is None else Path(folder)
    truth = read_truth(folder)
    training, testing = (3, 4) if full else (2, 2)
    studies = tuple(
        study_body(folder, body, training, testing, seed, names, progress) for body in BODIES[: 2 if full else 1]
    )
    comparison = compare(folder, studies, training, truth)
    wheel = find_wheel(folder, BODIES[0], 2, seed, names, progress) if reverse else None
    return Result(studies, comparison, wheel, full)


COMMAND = Command(
    "throws_drag",
    "Name what a rigid body with its wheel gets wrong about real throws.",
    full="both bodies and more throws",
    seed=1,
    extra={"--data": {"type": Path, "help": "folder of the measurements"}},
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    options = COMMAND.parse(arguments)
    write_report(run(options.data, full=options.full, seed=options.seed), options.output)
