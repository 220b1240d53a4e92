"""Command ``bayesid loop``, which plans a manoeuvre, has it executed, identifies the bodies and plans again."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer

from bayesid._io.progress import Progress
from bayesid.app.options import Output, Samples, Seed, StudyFile

__all__ = ["run"]


def run(
    file: StudyFile,
    output: Output,
    progress: Progress,
    seed: Seed = 0,
    effective_samples: Samples = 2000.0,
    spacecraft: Annotated[
        Path | None,
        typer.Option(
            help="Python file that executes plans; without it, put step-N-recording.csv into the output folder."
        ),
    ] = None,
    precision: Annotated[
        float | None,
        typer.Option(
            "--wanted", help="Required relative sd of mass and principal moments; 0.01 if no other goal is given."
        ),
    ] = None,
    wanted_sd: Annotated[
        list[str] | None,
        typer.Option(metavar="BODY.QUANTITY=SD", help="Required sd of a quantity in SI units; repeatable."),
    ] = None,
    wanted_tip: Annotated[
        float | None, typer.Option(metavar="MM", help="Required longest semi-axis of the end-effector's 95 % region.")
    ] = None,
    wanted_cause: Annotated[
        str | None,
        typer.Option(
            metavar="NAME[=0.95]", help="Cause whose presence or absence is to be established with that probability."
        ),
    ] = None,
    at_most: Annotated[int, typer.Option(help="Maximum number of manoeuvres.")] = 5,
    diagnose: Annotated[bool, typer.Option(help="Diagnose after every step and stop if the model is wrong.")] = True,
) -> Iterator[str]:
    """Plan a manoeuvre, evaluate its recording, plan the next one and so on: loop.json and report.pdf."""
    from bayesid.app.schema import Study

    study = Study.load(file)

    from bayesid.app.functions.loop_study import loop
    from bayesid.app.report_origin import report_origin
    from bayesid.report import loop_report
    from bayesid.report.effect_catalogue import catalogue, entry_of

    if wanted_cause is not None:
        entry_of(wanted_cause.partition("=")[0], catalogue())  # before anything is flown
    asked: dict[str, Any] = {
        "spacecraft": spacecraft,
        "precision": precision,
        "wanted_sd": wanted_sd,
        "wanted_tip": wanted_tip,
        "wanted_cause": wanted_cause,
        "at_most": at_most,
        "diagnose": diagnose,
    }
    result = loop(study, output, seed, effective_samples=effective_samples, **asked, progress=progress)
    written = any("identification" in step for step in result.history.steps)
    if written:
        origin = report_origin(
            study, "loop", seed, output=output, samples=effective_samples, wanted=asked.pop("precision"), **asked
        )
        loop_report(result.history, study.title, output / "report.pdf", origin=origin)
    yield from result.summary().sentences
    if written:
        yield f"Wrote {output / 'report.pdf'}."
    yield f"Wrote {result.history.folder / 'loop.json'}."
