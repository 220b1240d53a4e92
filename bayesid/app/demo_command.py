"""Command ``bayesid demo``, which diagnoses shipped recordings with a hidden cause."""

from __future__ import annotations

import json
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bayesid._io.errors import InputError
from bayesid._io.files import create_folder, write_text
from bayesid._io.progress import Progress
from bayesid.app.options import Output, Samples, Seed

if TYPE_CHECKING:
    from bayesid.diagnosis import Diagnosis

__all__ = ["run"]


EXAMPLES = {"arm": "demonstration_data", "wheels": "demonstration_data_of_wheels", "axes": "demonstration_data"}
"""Folders of the shipped studies by their names."""

TURNED = ("rate", "accel")  # sensors that the example of axes puts in others


def run(
    output: Output,
    progress: Progress,
    seed: Seed = 0,
    effective_samples: Samples = 4000.0,
    example: Annotated[str, typer.Option(metavar="NAME", help=f"Example to diagnose: {', '.join(EXAMPLES)}.")] = "arm",
) -> Iterator[str]:
    """Diagnose built-in recordings with a hidden cause, then reveal the cause; needs no input files."""
    from bayesid.app.diagnose_command import diagnose_study
    from bayesid.app.schema import Study
    from bayesid.report.numbers import format_number

    if example == "axes":
        yield from _other_axes(output, seed, progress)
        return
    answer = _copy_demonstration(example, output / "study")
    yield f"Recordings from an independent simulator, with a hidden cause: {output / 'study'}."
    result: list[Diagnosis] = []
    study = Study.load(output / "study" / "study.toml")
    yield from diagnose_study(study, output, seed, effective_samples, progress, result.append)
    named = result[0].verdict.causes
    for cause, values in answer.items():
        parts = ", ".join(f"{key} {format_number(value, 4)}" for key, value in values.items())
        yield f"The hidden cause was {cause}: {parts}. It was {'identified' if cause in named else 'not identified'}."


def _other_axes(output: Path, seed: int, progress: Progress) -> Iterator[str]:
    """Put rate sensor and accelerometer of the recordings in axes turned about x, diagnose, and put that right."""
    from bayesid.app.convention_remedies import fixed_study
    from bayesid.app.diagnose_command import diagnose_study
    from bayesid.app.schema import Study
    from bayesid.recording.recording import Recording

    folder = output / "study"
    _copy_demonstration("axes", folder)
    for file in sorted(folder.glob("*.csv")):
        recording = Recording.read(file)
        turned = {f"{family}.{axis}": -recording.channels[f"{family}.{axis}"] for family in TURNED for axis in "yz"}
        Recording(recording.name, file, recording.time, {**recording.channels, **turned}).write(file)
    yield f"Recordings from an independent simulator, with sensor axes turned by 180 degrees about x: {folder}."
    yield from diagnose_study(Study.load(folder / "study.toml"), output, seed, None, progress)
    yield from fixed_study(folder / "study.toml", lambda question: True)


def _copy_demonstration(example: str, folder: Path) -> dict[str, dict[str, float]]:
    """Copy a shipped study into a folder.

    Parameters
    ----------
    example : str
        Name of the study.
    folder : Path

    Returns
    -------
    dict
        True values of the effects hidden in its recordings, by effect and key, in SI units.
    """
    if example not in EXAMPLES:
        raise InputError(f"there is no example {example!r}", remedy=f"Choose one of {', '.join(EXAMPLES)}")
    create_folder(folder)
    shipped = files("bayesid.app") / EXAMPLES[example]
    answer: dict[str, dict[str, float]] = {}
    for entry in shipped.iterdir():
        text = entry.read_text(encoding="utf-8")
        if entry.name == "hidden.json":
            answer = json.loads(text)
        else:
            write_text(folder / entry.name, text)
    return answer
