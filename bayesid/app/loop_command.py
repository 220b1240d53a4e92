"""Command ``bayesid loop``, which plans a manoeuvre, has it executed, identifies the bodies and plans again."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bayesid._io.errors import InputError
from bayesid._io.progress import Progress
from bayesid.app.options import Output, Samples, Seed, StudyFile

if TYPE_CHECKING:
    from bayesid.design.loop_goals import Goal
    from bayesid.simulation.model import Model

__all__ = ["goals_of", "run"]


def run(
    file: StudyFile,
    output: Output,
    progress: Progress,
    seed: Seed = 0,
    samples: Samples = 2000.0,
    spacecraft: Annotated[
        Path | None,
        typer.Option(
            help="Python file that executes plans; without it, put step-N-recording.csv into the output folder."
        ),
    ] = None,
    wanted: Annotated[
        float | None, typer.Option(help="Relative sd of mass and principal moments; 0.01 if nothing else is wanted.")
    ] = None,
    wanted_sd: Annotated[
        list[str] | None, typer.Option(metavar="BODY.QUANTITY=SD", help="Sd of a quantity in SI units; repeatable.")
    ] = None,
    wanted_tip: Annotated[
        float | None, typer.Option(metavar="MM", help="Semi-axis of the end-effector's 95 % region.")
    ] = None,
    wanted_cause: Annotated[
        str | None, typer.Option(metavar="NAME[=0.95]", help="Cause whose presence is to be decided.")
    ] = None,
    at_most: Annotated[int, typer.Option(help="Largest number of manoeuvres.")] = 5,
    diagnose: Annotated[bool, typer.Option(help="Diagnose after every step, and stop if the model is wrong.")] = True,
) -> Iterator[str]:
    """Plan a manoeuvre, have it executed, identify, diagnose, plan again: loop.json and report.pdf."""
    if at_most < 1:
        raise InputError(f"{at_most} manoeuvres", place="--at-most", remedy="Allow at least one")

    from bayesid.app.schema import Study

    study = Study.load(file)

    from bayesid._io.files import claimed_folder
    from bayesid.app.report_origin import report_origin
    from bayesid.app.study_to_design import load_loop_problem
    from bayesid.app.study_to_encoders import encoder_noise
    from bayesid.app.study_to_model import loop_review
    from bayesid.app.user_files import load_spacecraft
    from bayesid.design import Loop, Sampled
    from bayesid.report import loop_report
    from bayesid.report.loop_report import loop_sentences

    problem = load_loop_problem(study)
    model, tip_frame = problem.plan.model, None if study.design is None else study.design.tip_frame
    loop = Loop(
        problem,
        encoder_noise(study, model.robot),
        seed=seed,
        goals=goals_of(model, wanted, wanted_sd or (), wanted_tip, wanted_cause, tip_frame),
        at_most=at_most,
        identifier=Sampled(samples),
        reviewer=loop_review(study) if diagnose else None,
    )
    executing = None if spacecraft is None else load_spacecraft(spacecraft)
    with claimed_folder(output):
        history = loop.run(executing, output, progress)
        written = any("identification" in step for step in history.steps)
        if written:
            origin = report_origin(
                study,
                "loop",
                seed,
                output=output,
                samples=samples,
                spacecraft=spacecraft,
                wanted=wanted,
                wanted_sd=wanted_sd,
                wanted_tip=wanted_tip,
                wanted_cause=wanted_cause,
                at_most=at_most,
                diagnose=diagnose,
            )
            loop_report(history, study.title, output / "report.pdf", origin=origin)
    yield from loop_sentences(history)
    if written:
        yield f"Wrote {output / 'report.pdf'}."
    yield f"Wrote {history.folder / 'loop.json'}."


def goals_of(
    model: Model,
    precision: float | None,
    deviations: Sequence[str],
    region: float | None,
    cause: str | None,
    tip_frame: str | None,
) -> tuple[Goal, ...]:
    """Return the goals of a loop; a relative precision of 1 % where nothing else is wanted.

    Parameters
    ----------
    model : Model
        Model of the loop.
    precision : float or None
        Relative standard deviation of mass and principal moments.
    deviations : sequence of str
        ``BODY.QUANTITY=SD``, in SI units.
    region : float or None
        Longest semi-axis of the end-effector's region [mm].
    cause : str or None
        ``NAME`` or ``NAME=PROBABILITY``.
    tip_frame : str or None
        Frame of the end-effector.

    Raises
    ------
    InputError
        If an option cannot be read, or the model has no such body.
    """
    from bayesid.design.loop_goals import CauseProbability, QuantitySd, RelativePrecision, TipRegion

    goals: list[Goal] = []
    if precision is not None:
        if not 0.0 < precision < 1.0:
            problem = f"{precision:g} is not between 0 and 1"
            raise InputError(problem, place="--wanted", remedy="Give a relative precision: 0.01 is 1 %")
        goals.append(RelativePrecision(precision))
    for text in deviations:
        name, _, value = text.partition("=")
        bodies = [body.name for body in model.bodies]
        body = next((body for body in bodies if name.startswith(f"{body}.")), None)
        if body is None:
            remedy = f"Write BODY.QUANTITY=SD, with a body among {', '.join(bodies)}: {bodies[0]}.mass=0.5"
            raise InputError(f"{text!r} names no body to identify", place="--wanted-sd", remedy=remedy)
        goals.append(QuantitySd(body, name.removeprefix(f"{body}."), _number(value, text, "--wanted-sd")))
    if region is not None:
        if not region > 0.0:
            raise InputError(f"{region:g} mm", place="--wanted-tip", remedy="Give a positive number of millimetres")
        goals.append(TipRegion(1e-3 * region, tip_frame))
    if cause is not None:
        name, sign, value = cause.partition("=")
        goals.append(CauseProbability(name, _number(value, cause, "--wanted-cause") if sign else 0.95))
    return tuple(goals) or (RelativePrecision(),)


def _number(text: str, whole: str, place: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{whole!r} has no number after '='", place=place, remedy="Write NAME=NUMBER") from None
