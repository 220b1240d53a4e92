"""Command ``bayesid diagnose``, which finds the cause of model errors and measures the gain of an extended model."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bayesid._io.progress import Progress, part_of, silent
from bayesid.app.options import Output, Samples, Seed, StudyFile

if TYPE_CHECKING:
    from bayesid.app.schema import Study
    from bayesid.diagnosis import Diagnosis
    from bayesid.simulation.model import Manoeuvre, Model

__all__ = ["diagnose_study", "run"]

VERDICT = 0.3  # share of the time until the verdict where the extended model is sampled afterwards


def run(
    file: StudyFile,
    output: Output,
    progress: Progress,
    seed: Seed = 0,
    samples: Samples = 4000.0,
    sample: Annotated[bool, typer.Option(help="Sample the extended model with emcee at the end.")] = True,
    fly_next: Annotated[bool, typer.Option(help="Design the next manoeuvre where the verdict is undecided.")] = True,
) -> Iterator[str]:
    """Show how the simulation deviates, name the cause, extend the model by it and measure the gain."""
    from bayesid.app.schema import Study

    yield from diagnose_study(Study.load(file), output, seed, samples if sample else None, progress, plan=fly_next)


def diagnose_study(
    study: Study,
    output: Path,
    seed: int,
    effective_samples: float | None,
    progress: Progress = silent,
    keep: Callable[[Diagnosis], object] = lambda result: None,
    plan: bool = False,
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
        Whether to design the manoeuvre that would decide an undecided verdict.

    Yields
    ------
    str
        Sentences to show.
    """
    from bayesid._io.files import claimed_folder
    from bayesid.app.study_draft import open_places
    from bayesid.app.study_to_model import load_manoeuvres, load_model

    model = load_model(study)
    manoeuvres = load_manoeuvres(study, model.robot)
    yield from open_places(study)
    with claimed_folder(output):
        yield from _written(study, model, manoeuvres, output, seed, effective_samples, progress, keep, plan)
    yield f"Wrote {output / 'report.pdf'}."


def _written(
    study: Study,
    model: Model,
    manoeuvres: Sequence[Manoeuvre],
    output: Path,
    seed: int,
    effective_samples: float | None,
    progress: Progress,
    keep: Callable[[Diagnosis], object],
    plan: bool,
) -> Iterator[str]:
    """Write the verdict, and then all results."""
    import numpy as np

    from bayesid._io.errors import InputError
    from bayesid._io.files import complete_folder, write_json
    from bayesid._io.progress import PhaseClock
    from bayesid.app.report_origin import report_origin
    from bayesid.app.study_to_design import FILE, fly_next, write_motion
    from bayesid.app.study_to_model import cause_prior, stated_bounds
    from bayesid.diagnosis import diagnose, identify_extended
    from bayesid.inference.posterior_file import write_netcdf
    from bayesid.report import diagnosis_report
    from bayesid.report.design_report import separation_sentence
    from bayesid.report.diagnosis.diagnosis_sentences import diagnosis_sentences
    from bayesid.report.verdict_record import record_sentence

    knows = all(section.argument_of_latitude is not None for section in study.recordings)
    result = diagnose(
        model,
        manoeuvres,
        seed,
        bounds=stated_bounds(study),
        prior=cause_prior(study),
        knows_latitude=knows,
        progress=progress if effective_samples is None else part_of(progress, 0.0, VERDICT),
    )
    keep(result)
    yield from diagnosis_sentences(result)
    rivals = result.rivals if plan else None
    if effective_samples is not None or rivals:  # both take long: the verdict is not to be lost with them
        with complete_folder(output) as folder:
            result.unexplained.write(folder / "unexplained.csv")
            write_json(folder / "diagnosis.json", result.to_dict())
    clock, identification = PhaseClock(), None
    if effective_samples is not None:
        sampling = part_of(progress, VERDICT, 1.0)
        sampling(0.0, "sampling the extended model")
        try:
            if result.posterior.size:
                identification = identify_extended(result, seed, effective_samples=effective_samples, progress=sampling)
        except InputError as error:  # no motion at the prior's centre of the extended model
            yield f"The extended model was not sampled: {error}."
    clock.ends("sample")
    advice, next_design = None, None
    if rivals:
        progress(1.0, "designing the next manoeuvre")
        try:
            next_design = fly_next(study, rivals, seed, silent)
        except InputError as error:
            advice = f"No manoeuvre was designed that tells {' and '.join(rivals)} apart: {error}."
        else:
            advice = f"Fly {FILE}, {next_design.problem.plan.family.duration:g} s. {separation_sentence(next_design)}"
        yield advice
    clock.ends("design")
    with complete_folder(output) as folder:
        result.unexplained.write(folder / "unexplained.csv")
        if next_design is not None:
            write_motion(next_design, folder / FILE)
        if identification is not None:
            write_netcdf(identification, folder / "posterior.nc", np.random.default_rng(seed))
        sample, samples = effective_samples is not None, effective_samples
        origin = report_origin(study, "diagnose", seed, output=output, sample=sample, samples=samples, fly_next=plan)
        record = record_sentence(result.verdict.status)
        said = {"record": record, "advice": advice, "origin": origin}
        diagnosis_report(result, identification, study.title, folder / "report.pdf", **said)
        clock.ends("report")
        content = result.to_dict(identification)
        write_json(folder / "diagnosis.json", content | {"seconds": content["seconds"] | clock.seconds})
