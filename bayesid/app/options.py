"""Arguments and options that several commands share, as annotations for typer, and what they stand for."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bayesid._io.errors import InputError

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["Output", "Samples", "Scheduler", "Seed", "StudyFile", "executor_at", "executor_of"]

StudyFile = Annotated[Path, typer.Argument(metavar="STUDY.toml", help="Study file.")]
Output = Annotated[Path, typer.Option("--output", "-o", help="Folder for the results, created if it does not exist.")]
Seed = Annotated[int, typer.Option(min=0, help="Seed of all random numbers.")]
Samples = Annotated[float, typer.Option("--samples", min=1.0, help="Number of effective samples.")]


SECONDS = 10  # time in which a scheduler must answer [s]

Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Scheduler of a dask cluster to use, such as tcp://host:8786.")
]


@contextmanager
def executor_of(scheduler: str | None) -> Iterator[Executor | None]:
    """Give a context the executor of a scheduler as `executor_at` returns it, or none where no address is given."""
    if not scheduler:
        yield None
        return
    with _client_at(scheduler) as client:  # closed, else it waits for a scheduler that ends before it
        yield client.get_executor()


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
    executor: Executor = _client_at(scheduler).get_executor()
    return executor


def _client_at(scheduler: str) -> Client:
    try:
        from distributed import Client
    except ImportError:
        raise InputError(
            "dask.distributed is not installed", place="--scheduler", remedy="pip install 'bayesid[dask]'"
        ) from None
    try:
        return Client(scheduler, timeout=SECONDS)
    except (OSError, ValueError) as error:
        remedy = "Start one with `dask scheduler`, and workers with `dask worker ADDRESS`"
        raise InputError(f"no scheduler answers at {scheduler}: {error}", place="--scheduler", remedy=remedy) from error
