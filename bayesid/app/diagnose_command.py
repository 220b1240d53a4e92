"""Command ``bayesid diagnose``, which finds the cause of model errors and measures the gain of an extended model."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bayesid._io.progress import Progress, part_of, silent
from bayesid.app.options import Output, Samples, Scheduler, Seed, StudyFile, executor_of

if TYPE_CHECKING:
    from bayesid.app.schema import Study
    from bayesid.diagnosis import Diagnosis

__all__ = ["diagnose_study", "run"]


def run(
    file: StudyFile,
    output: Output,
    progress: Progress,
    seed: Seed = 0,
    effective_samples: Samples = 4000.0,
    sample: Annotated[bool, typer.Option(help="Sample the extended model with emcee after the verdict.")] = True,
    fly_next: Annotated[
        bool, typer.Option(help="Design the next manoeuvre if the verdict is ambiguous or unresolved.")
    ] = True,
    scheduler: Scheduler = None,
) -> Iterator[str]:
    """Name the causes of a misfit of the simulation, add them to the model and measure the improvement."""
    from bayesid.app.schema import Study

    study, sampled = Study.load(file), effective_samples if sample else None
    with executor_of(scheduler) as executor:
        yield from diagnose_study(study, output, seed, sampled, progress, plan=fly_next, executor=executor)


def diagnose_study(
    study: Study,
    output: Path,
    seed: int,
    effective_samples: float | None,
    progress: Progress = silent,
    keep: Callable[[Diagnosis], object] = lambda result: None,
    plan: bool = False,
    executor: Executor | None = None,
) -> Iterator[str]:
    """Write diagnosis.json, unexplained.csv, posterior.nc of the extended model and report.pdf of a study.

    The verdict is written before the extended model is sampled and the next manoeuvre designed.

    Parameters
    ----------
    study : Study
        Study to diagnose.
    output : Path
        Folder of the results.
    seed : int
        Seed of all random numbers.
    effective_samples : float or None
        Number of effective samples of the extended model, which is not sampled where it is None.
    progress : Progress
        Receiver of the fraction done.
    keep : callable
        Function that receives the diagnosis.
    plan : bool
        Whether to design the manoeuvre that would resolve an ambiguous or unresolved verdict.
    executor : concurrent.futures.Executor, optional
        As for `bayesid.diagnose`.

    Yields
    ------
    str
        Sentences to print.
    """
    import numpy as np

    from bayesid._io.files import claimed_folder, complete_folder, write_json
    from bayesid._io.progress import PhaseClock
    from bayesid.app.functions.diagnose_study import VERDICT, diagnose, followed_up
    from bayesid.app.report_origin import report_origin
    from bayesid.app.study_draft import open_places
    from bayesid.app.study_to_conventions import convention_lines, remedy_sentence
    from bayesid.app.study_to_design import FILE, write_motion
    from bayesid.inference.posterior_file import write_netcdf
    from bayesid.recording.convention import ConventionError
    from bayesid.report import diagnosis_report
    from bayesid.report.convention_report import convention_report, convention_verdict
    from bayesid.report.diagnosis.diagnosis_sentences import diagnosis_sentences
    from bayesid.report.verdict_record import record_sentence

    yield from open_places(study)
    sample = effective_samples is not None
    with claimed_folder(output):
        whole = part_of(progress, 0.0, VERDICT) if sample else progress
        try:
            result = diagnose(study, seed=seed, sample=False, fly_next=False, executor=executor, progress=whole)
        except ConventionError as error:
            with complete_folder(output) as folder:
                write_json(folder / "diagnosis.json", convention_verdict(error.conventions))
                origin = report_origin(study, "diagnose", seed, output=output, sample=sample, fly_next=plan)
                convention_report(error.conventions, study.title, folder / "report.pdf", origin=origin)
            yield from convention_lines(error.conventions)
            yield remedy_sentence(study.file)
            yield f"Wrote {output / 'report.pdf'}."
            return
        yield from diagnosis_sentences(result)
        if sample or (plan and result.rivals):  # both take long: the verdict is not to be lost with them
            with complete_folder(output) as folder:
                result.unexplained.write(folder / "unexplained.csv")
                write_json(folder / "diagnosis.json", result.to_dict())
        result = followed_up(result, study if plan else None, seed, effective_samples, progress)
        keep(result)
        yield from (sentence for sentence in (result.not_sampled, result.advice) if sentence)
        clock = PhaseClock()
        with complete_folder(output) as folder:
            result.unexplained.write(folder / "unexplained.csv")
            if result.next_manoeuvre is not None:
                write_motion(result.next_manoeuvre, folder / FILE)
            if result.identification is not None:
                write_netcdf(result.identification, folder / "posterior.nc", np.random.default_rng(seed))
            asked = {"sample": sample, "samples": effective_samples, "fly_next": plan}
            origin = report_origin(study, "diagnose", seed, output=output, **asked)
            record = record_sentence(result.verdict.status)
            diagnosis_report(result, study.title, folder / "report.pdf", record=record, origin=origin)
            clock.ends("report")
            content = result.to_dict()
            write_json(folder / "diagnosis.json", content | {"seconds": content["seconds"] | clock.seconds})
    yield f"Wrote {output / 'report.pdf'}."
