"""Command line ``bayesid COMMAND STUDY.toml --output DIR``.

A command is one file of this folder, ``NAME_command.py``, with a generator function ``run``. The parameters of the
function are the command's arguments and options, its docstring is the help, and it yields the sentences to show. A
parameter ``progress`` is not an option; it receives a `Progress` that draws a bar. JAX and Pinocchio take seconds to
import. A command therefore imports what it needs within ``run``, after it has read the study file, so that help and
errors in the file appear at once.
"""

from __future__ import annotations

import atexit
import errno
import gc
import importlib
import inspect
import os
import pkgutil
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import cache, wraps
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Any

import typer

import bayesid.app
from bayesid._io.errors import InputError
from bayesid._io.progress import Progress
from bayesid._math.divergence import divergence_named
from bayesid._math.memory import take_large_arrays_singly
from bayesid.app.compilation_cache import keep_compiled

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["app", "main"]

SUFFIX = "_command"  # ending of the names of those modules of this folder that are commands

FULL, CLOSED = (
    "Free space on the disk of the output folder and run the command again",
    "Choose another output folder, or grant write permission",
)

# objects made from one search for unused cycles to the next; drawings make many objects and hardly any cycles
SELDOM = 100_000
SOON = 0.003  # time after which an interruption is tried again [s]
EXHAUSTED = "RESOURCE_EXHAUSTED"  # said by errors of JAX where memory is lacking
LACKS_MEMORY = (
    "there is not enough memory for this study. Use fewer or shorter recordings, reduce blocks_per_second, or use a "
    "machine with more free memory"
)
# remedies by the number of an error of the system
REMEDIES = {
    **dict.fromkeys((errno.ENOSPC, errno.EDQUOT, errno.EFBIG), FULL),
    **dict.fromkeys((errno.EACCES, errno.EPERM, errno.EROFS), CLOSED),
}

app = typer.Typer(add_completion=False, no_args_is_help=True, pretty_exceptions_enable=False)
"""Application of typer, to which the commands are added below."""


def _show_version(requested: bool) -> None:
    if requested:
        typer.echo(f"bayesid {bayesid.__version__}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", callback=_show_version, is_eager=True)
    ] = False,
) -> None:
    """Identify the inertial parameters of free-flying space robots from recordings."""


def _command(run: Callable[..., Iterator[str]]) -> Callable[..., None]:
    """Return the function that typer calls: it supplies the progress, and shows the command's sentences and errors."""
    signature = inspect.signature(run, eval_str=True)
    options = [parameter for name, parameter in signature.parameters.items() if name != "progress"]

    @wraps(run)
    def command(**given: Any) -> None:
        keep_compiled()
        with _reported(), _interruptible(), _shown() as progress:
            if len(options) < len(signature.parameters):
                given["progress"] = progress
            for line in run(**given):
                # wrap at words, but keep paths whole so that they can be copied
                _console().print(line, markup=False, overflow="ignore", crop=False)

    command.__signature__ = signature.replace(parameters=options, return_annotation=None)  # type: ignore[attr-defined]
    return command


@cache
def _console() -> Console:
    from rich.console import Console

    return Console(stderr=True, emoji=False, highlight=False)  # names have colons, as in convention:zero:joint1


@contextmanager
def _reported() -> Iterator[None]:
    """Turn errors in the user's input, and of the disk, into one message and exit status 2."""
    try:
        with divergence_named():
            yield
    except InputError as error:
        typer.secho(f"Error: {error}", fg="red", err=True)
        raise typer.Exit(2) from None
    except OSError as error:
        if error.errno == errno.EPIPE:  # the reader of the output is gone, which click handles
            raise
        where = "" if error.filename is None else f"{error.filename}: "
        remedy = REMEDIES.get(error.errno or 0, "Check the disk, or choose another output folder")
        typer.secho(f"Error: {where}{error.strerror or error}. {remedy}", fg="red", err=True)
        raise typer.Exit(2) from None
    except (MemoryError, RuntimeError) as error:
        if not (isinstance(error, MemoryError) or EXHAUSTED in str(error)):
            raise
        typer.secho(f"Error: {LACKS_MEMORY}", fg="red", err=True)
        raise typer.Exit(2) from None
    except KeyboardInterrupt:
        typer.echo(
            "Interrupted. Run the command again to resume from the stored results, or to restart if there are none.",
            err=True,
        )
        raise typer.Exit(130) from None


@contextmanager
def _interruptible() -> Iterator[None]:
    """Let an interruption wait for the end of an evaluation of emcee, which prints all parameters where one ends it."""

    def interrupt(signum: int, frame: FrameType | None) -> None:
        inner = frame
        while inner is not None:
            if inner.f_code.co_name == "__call__" and inner.f_globals.get("__name__") == "emcee.ensemble":
                signal.setitimer(signal.ITIMER_REAL, SOON)
                return
            inner = inner.f_back
        raise KeyboardInterrupt

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, interrupt) for number in (signal.SIGINT, signal.SIGALRM)}
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def _shown() -> Iterator[Progress]:
    """Yield a progress that draws a bar, beginning with the first call after a second.

    What ends sooner, such as bad input, leaves no bar and no empty line.
    """
    with ExitStack() as stack:
        update: list[Callable[[float, str], None]] = []
        begun = time.monotonic()

        def show(fraction: float, text: str, /) -> None:
            if not update and time.monotonic() < begun + 1.0:
                return
            if not update:
                update.append(_bar(stack))
            update[0](fraction, text)

        yield show


def _bar(stack: ExitStack) -> Callable[[float, str], None]:
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    bar = stack.enter_context(Bar(*columns, console=_console(), transient=True))
    task = bar.add_task("starting", total=1.0)
    return lambda fraction, text: bar.update(task, completed=min(fraction, 1.0), description=text)


for _module in pkgutil.iter_modules(bayesid.app.__path__):
    if _module.name.endswith(SUFFIX):
        _run = importlib.import_module(f"bayesid.app.{_module.name}").run
        app.command(_module.name.removesuffix(SUFFIX))(_command(_run))


def main() -> None:
    """Run the command line, in whose process all that JAX computes has 64 bits."""
    os.environ["JAX_ENABLE_X64"] = "True"  # files of the user may compute with JAX when they are imported or executed
    take_large_arrays_singly()
    gc.set_threshold(SELDOM)
    atexit.register(gc.freeze)  # what the process leaves is not searched for cycles
    sys.exit(app())


if __name__ == "__main__":
    main()
