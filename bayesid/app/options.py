"""Arguments and options that several commands share, as annotations for typer."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = ["Output", "Samples", "Seed", "StudyFile"]

StudyFile = Annotated[Path, typer.Argument(metavar="STUDY.toml", help="Study file.")]
Output = Annotated[Path, typer.Option("--output", "-o", help="Folder for the results; it is created.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of all random numbers.")]
Samples = Annotated[float, typer.Option("--samples", min=1.0, help="Number of effective samples.")]
