"""The command line: ``bayesid COMMAND STUDY.toml --output DIR``, and ``bayesid demo``, which needs no study."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from bayesid._io.errors import InputError

__all__ = ["app", "main"]

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Identify the inertial parameters of free-flying space robots from recordings.",
)

StudyFile = Annotated[Path, typer.Argument(metavar="STUDY.toml", help="The study file.")]
Output = Annotated[Path, typer.Option("--output", "-o", help="Folder for the results; it is created.")]
Seed = Annotated[int, typer.Option(help="Every random number follows from it.")]
Samples = Annotated[float, typer.Option("--samples", help="Effective samples wanted.")]

console = Console(stderr=True)


@app.command()
def check(study: StudyFile, output: Output) -> None:
    """Validate a study and its recordings and say what was read, before anyone waits for a sampler."""
    from bayesid.app.commands import run_check

    with _reported():
        for line in run_check(study, output):
            console.print(line)


@app.command()
def identify(study: StudyFile, output: Output, seed: Seed = 0, samples: Samples = 4000.0) -> None:
    """Identify the unknown bodies: identification.json, posterior.nc and report.pdf."""
    from bayesid.app.commands import run_identify

    with _reported(), _progress() as show:
        for line in run_identify(study, output, seed=seed, effective_samples=samples, progress=show):
            console.print(line)


@app.command()
def diagnose(
    study: StudyFile,
    output: Output,
    seed: Seed = 0,
    samples: Samples = 4000.0,
    sample: Annotated[bool, typer.Option(help="Sample the extended model with emcee at the end.")] = True,
) -> None:
    """Show what the simulation gets wrong, name the cause, extend the model by it and measure the gain."""
    from bayesid.app.commands import run_diagnose
    from bayesid.app.compilation_cache import keep_compiled

    keep_compiled()
    with _reported(), _progress() as show:
        for line in run_diagnose(study, output, seed=seed, effective_samples=samples, sample=sample, progress=show):
            console.print(line)


@app.command()
def design(
    study: StudyFile,
    output: Output,
    seed: Seed = 0,
    starts: Annotated[int, typer.Option(min=1, help="Random starts of the search, for every criterion.")] = 2,
    iterations: Annotated[int, typer.Option(min=1, help="Iterations of the optimiser from each start.")] = 60,
) -> None:
    """Design manoeuvres by several criteria, within limits: design.json, a CSV file for each, and report.pdf."""
    from bayesid.app.commands import run_design
    from bayesid.app.compilation_cache import keep_compiled

    keep_compiled()
    with _reported(), _progress() as show:
        for line in run_design(study, output, seed=seed, starts=starts, iterations=iterations, progress=show):
            console.print(line)


@app.command()
def identifiability(
    study: StudyFile,
    output: Output,
    seed: Seed = 0,
    samples: Annotated[float, typer.Option(help="Effective samples wanted where emcee is needed.")] = 500.0,
    profiles: Annotated[int, typer.Option(min=0, help="Parameters that are profiled at most.")] = 6,
) -> None:
    """Say what robot, manoeuvres and sensors can tell of the bodies, and what would tell more: identifiability.json."""
    from bayesid.app.compilation_cache import keep_compiled
    from bayesid.app.identifiability_command import run_identifiability

    keep_compiled()
    with _reported(), _progress() as show:
        for line in run_identifiability(
            study, output, seed=seed, effective_samples=samples, profiles=profiles, progress=show
        ):
            console.print(line)


@app.command()
def simulate(
    study: StudyFile,
    output: Output,
    seed: Seed = 0,
    noise: Annotated[bool, typer.Option(help="Add the declared noise of the sensors.")] = True,
) -> None:
    """Simulate the sensors of a study's recordings at the given values: recordings, simulation.json and report.pdf."""
    from bayesid.app.commands import run_simulate

    with _reported():
        for line in run_simulate(study, output, seed=seed, noise=noise):
            console.print(line)


@app.command()
def predict(
    study: StudyFile,
    output: Output,
    seed: Seed = 0,
    draws: Annotated[int, typer.Option(help="Draws of what is known of the robot.")] = 500,
    posterior: Annotated[
        Path | None, typer.Option(help="posterior.nc of an earlier study, in place of the study's prior.")
    ] = None,
) -> None:
    """Predict where planned joint motions take base and end-effector: prediction.json and report.pdf."""
    from bayesid.app.commands import run_predict

    with _reported(), _progress() as show:
        for line in run_predict(study, output, posterior=posterior, seed=seed, draws=draws, progress=show):
            console.print(line)


@app.command()
def demo(output: Output, seed: Seed = 0, samples: Samples = 4000.0) -> None:
    """Diagnose shipped recordings with a hidden cause, say what was hidden and write the report; needs no file."""
    from bayesid.app.commands import run_demo
    from bayesid.app.compilation_cache import keep_compiled

    keep_compiled()

    with _reported(), _progress() as show:
        for line in run_demo(output, seed=seed, effective_samples=samples, progress=show):
            console.print(line)


@app.command()
def loop(
    study: StudyFile,
    output: Output,
    seed: Seed = 0,
    samples: Samples = 2000.0,
    spacecraft: Annotated[
        Path | None, typer.Option(help="Python file that executes plans; left out, the recordings are put into DIR.")
    ] = None,
    wanted: Annotated[float, typer.Option(help="Relative sd at which to stop, of mass and principal moments.")] = 0.01,
    at_most: Annotated[int, typer.Option(help="Manoeuvres.")] = 5,
) -> None:
    """Plan a manoeuvre, have it executed, identify, and plan again from the posterior: loop.json."""
    from bayesid.app.loop_command import run_loop

    with _reported(), _progress() as show:
        for line in run_loop(
            study,
            output,
            spacecraft=spacecraft,
            wanted=wanted,
            at_most=at_most,
            seed=seed,
            effective_samples=samples,
            progress=show,
        ):
            console.print(line, soft_wrap=True)  # paths to be copied


@contextmanager
def _reported() -> Iterator[None]:
    """Turn errors a user can mend into one message and exit status 2."""
    try:
        yield
    except InputError as error:
        Console(stderr=True, soft_wrap=True).print(f"Error: {error}", style="red", highlight=False, markup=False)
        raise typer.Exit(2) from None
    except KeyboardInterrupt:
        console.print("Interrupted; the same command goes on from what was kept so far.")
        raise typer.Exit(130) from None


@contextmanager
def _progress() -> Iterator[Callable[[float, str], None]]:
    """Show a bar; the callable takes the fraction done and a text."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("starting", total=1.0)

        def show(fraction: float, text: str) -> None:
            bar.update(task, completed=min(fraction, 1.0), description=text)

        yield show


def main() -> None:
    """Run the command line."""
    sys.exit(app())


if __name__ == "__main__":
    main()
