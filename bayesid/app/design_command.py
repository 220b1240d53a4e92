"""Command ``bayesid design``, which designs manoeuvres by several criteria, within limits."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Annotated

import typer

from bayesid._io.errors import InputError
from bayesid._io.progress import Progress
from bayesid.app.options import Output, Scheduler, Seed, StudyFile, executor_at

__all__ = ["run"]


def run(
    file: StudyFile,
    output: Output,
    progress: Progress,
    seed: Seed = 0,
    starts: Annotated[int, typer.Option(min=1, help="Number of random starts for every criterion.")] = 12,
    iterations: Annotated[int, typer.Option(min=1, help="Most iterations of the optimiser from each.")] = 400,
    thorough: Annotated[
        bool, typer.Option(help="Search on between the best motions, which takes about five times as long.")
    ] = False,
    separate: Annotated[
        tuple[str, str] | None,
        typer.Option(metavar="A B", help="Two effects of the catalogue that the manoeuvre is to tell apart."),
    ] = None,
    scheduler: Scheduler = None,
) -> Iterator[str]:
    """Design manoeuvres by several criteria, within limits: design.json, a CSV file for each, and report.pdf."""
    from bayesid.app.schema import Study

    study = Study.load(file)

    import bayesid
    from bayesid._io.files import claimed_folder, complete_folder, write_json
    from bayesid._io.store import content_key
    from bayesid._io.words import counted
    from bayesid.app.report_origin import report_origin
    from bayesid.app.study_to_design import load_problem, separating, write_motion
    from bayesid.app.study_to_encoders import ASSUMED, assume_missing, encoder_noise
    from bayesid.design import THOROUGH, Search, Store, best_design, design
    from bayesid.report import design_report
    from bayesid.report.design_report import design_sentences

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
        yield f"The study gives no sensors.encoder.sigma of {', '.join(assumed)}: {ASSUMED:g} rad or m is assumed."
    progress(0.0, "compiling")
    effort = replace(THOROUGH if thorough else Search(), starts=starts, iterations=iterations)
    key = content_key(bayesid.__version__, *study.defining_files, seed, effort, *(separate or ()))
    with claimed_folder(output):
        store = Store.open(output / "search.json", key)
        try:
            with executor_at(scheduler) if scheduler else ThreadPoolExecutor(os.cpu_count()) as executor:
                designs = design(
                    problem, seed, noise, replace(effort, executor=executor), store=store, progress=progress
                )
            best = best_design(designs)
        except InputError as error:
            raise error.within(file=file) from None
        with complete_folder(output) as folder:
            content = {"title": study.title, "seed": seed, "manoeuvres": [motion.to_dict() for motion in designs]}
            write_json(folder / "design.json", {**content, "best": best.name})
            for motion in designs:
                write_motion(motion, folder / f"{motion.name}.csv")
            effort_words = (("starts", starts), ("iterations", iterations), ("thorough", thorough))
            origin = report_origin(study, "design", seed, output=output, **dict(effort_words), separate=separate)
            design_report(designs, best, study.title, folder / "report.pdf", origin=origin)
        store.remove()
    yield from design_sentences(designs, best)
    yield f"Wrote {output / 'report.pdf'}."
