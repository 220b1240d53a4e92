"""Arguments and options that several commands share, as annotations for typer, and what they stand for."""

from __future__ import annotations

from concurrent.futures import Executor
from pathlib import Path
from typing import Annotated

import typer

from bayesid._io.errors import InputError

__all__ = ["Output", "Samples", "Scheduler", "Seed", "StudyFile", "executor_at"]

StudyFile = Annotated[Path, typer.Argument(metavar="STUDY.toml", help="Study file.")]
Output = Annotated[Path, typer.Option("--output", "-o", help="Folder for the results, created if it does not exist.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of all random numbers.")]
Samples = Annotated[float, typer.Option("--samples", min=1.0, help="Number of effective samples.")]


SECONDS = 10  # time in which a scheduler must answer [s]

Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Scheduler of dask.distributed, such as tcp://host:8786.")
]


def executor_at(scheduler: str) -> Executor:
    """Return the executor of a scheduler of dask.distributed, whose workers must be able to import this package.

    Parameters
    ----------
    scheduler : str
        Address, such as ``tcp://host:8786``.

    Raises
    ------
    InputError
        If dask.distributed is not installed, or no scheduler answers at the address.
    """
    try:
        from distributed import Client
    except ImportError:
        raise InputError(
            "dask.distributed is not installed", place="--scheduler", remedy="pip install 'bayesid[dask]'"
        ) from None
    try:
        executor: Executor = Client(scheduler, timeout=SECONDS).get_executor()
    except (OSError, ValueError) as error:
        remedy = "Start one with `dask scheduler`, and workers with `dask worker ADDRESS`"
        raise InputError(f"no scheduler answers at {scheduler}: {error}", place="--scheduler", remedy=remedy) from error
    return executor
