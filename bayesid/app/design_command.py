"""Command ``bayesid design``, which designs manoeuvres by several criteria, within limits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated

import typer

from bayesid._io.errors import InputError
from bayesid._io.progress import Progress
from bayesid.app.options import Output, Scheduler, Seed, StudyFile, executor_of

__all__ = ["run"]


def run(
    file: StudyFile,
    output: Output,
    progress: Progress,
    seed: Seed = 0,
    starts: Annotated[int, typer.Option(min=1, help="Number of random starts per criterion.")] = 12,
    iterations: Annotated[int, typer.Option(min=1, help="Maximum number of optimiser iterations per start.")] = 400,
    thorough: Annotated[
        bool,
        typer.Option(
            help="Search more thoroughly, including combinations of the best motions; takes about five times as long."
        ),
    ] = False,
    separate: Annotated[
        tuple[str, str] | None,
        typer.Option(metavar="A B", help="Two effects of the catalogue that the manoeuvre must distinguish."),
    ] = None,
    scheduler: Scheduler = None,
) -> Iterator[str]:
    """Design the best manoeuvre by each criterion within limits: design.json, CSV files and report.pdf."""
    from bayesid.app.schema import Study

    study = Study.load(file)

    import bayesid
    from bayesid._io.files import claimed_folder, complete_folder, write_json
    from bayesid._io.store import content_key
    from bayesid._io.words import counted
    from bayesid.app.functions.design_study import design, effort_of
    from bayesid.app.report_origin import report_origin
    from bayesid.app.study_to_design import load_problem, separating, write_motion
    from bayesid.app.study_to_encoders import ASSUMED, assume_missing, encoder_noise
    from bayesid.design import Store
    from bayesid.report import design_report

    if separate is not None:
        study = separating(study, separate)
    problem = load_problem(study)
    noise, assumed = assume_missing(encoder_noise(study, problem.plan.model.robot))
    yield (
        f"{study.title}: {counted(len(problem.criteria), 'criterion', 'criteria')}, "
        f"{problem.plan.family.size} parameters of "
        f"{problem.plan.family.name}, {problem.plan.family.duration:g} s."
    )
    if assumed:
        yield f"The study gives no sensors.encoder.sigma for {', '.join(assumed)}: {ASSUMED:g} rad or m is assumed."
    progress(0.0, "compiling")
    effort = effort_of(starts, iterations, thorough)
    key = content_key(bayesid.__version__, *study.defining_files, seed, effort, *(separate or ()))
    with claimed_folder(output):
        store = Store.open(output / "search.json", key)
        try:
            with executor_of(scheduler) as executor:
                result = design(
                    problem,
                    seed,
                    starts=starts,
                    iterations=iterations,
                    thorough=thorough,
                    encoder=noise,
                    executor=executor,
                    store=store,
                    progress=progress,
                )
        except InputError as error:
            raise error.within(file=file) from None
        result = replace(result, title=study.title)
        with complete_folder(output) as folder:
            write_json(folder / "design.json", result.to_dict())
            for motion in result.manoeuvres:
                write_motion(motion, folder / f"{motion.name}.csv")
            asked = (("starts", starts), ("iterations", iterations), ("thorough", thorough))
            origin = report_origin(study, "design", seed, output=output, **dict(asked), separate=separate)
            design_report(result.manoeuvres, result.best, study.title, folder / "report.pdf", origin=origin)
        store.remove()
    yield from result.summary().sentences
    yield f"Wrote {output / 'report.pdf'}."
