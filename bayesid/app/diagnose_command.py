"""Command ``bayesid diagnose``, which finds the cause of model errors and measures the gain of an extended model."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bayesid._io.progress import Progress, part_of, silent
from bayesid.app.options import Output, Samples, Seed, StudyFile

if TYPE_CHECKING:
    from bayesid.app.schema import Study
    from bayesid.diagnosis import Diagnosis

__all__ = ["diagnose_study", "run"]

VERDICT = 0.3
"""Share of the time until the verdict where the extended model is sampled afterwards."""


def run(
    file: StudyFile,
    output: Output,
    progress: Progress,
    seed: Seed = 0,
    samples: Samples = 4000.0,
    sample: Annotated[bool, typer.Option(help="Sample the extended model with emcee at the end.")] = True,
) -> Iterator[str]:
    """Show how the simulation deviates, name the cause, extend the model by it and measure the gain."""
    from bayesid.app.schema import Study

    yield from diagnose_study(Study.load(file), output, seed, samples if sample else None, progress)


def diagnose_study(
    study: Study,
    output: Path,
    seed: int,
    effective_samples: float | None,
    progress: Progress = silent,
    keep: Callable[[Diagnosis], object] = lambda result: None,
) -> Iterator[str]:
    """Write diagnosis.json, unexplained.csv, posterior.nc of the extended model and report.pdf of a study.

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

    Yields
    ------
    str
        Sentences to show.
    """
    import numpy as np

    from bayesid._io.files import complete_folder, write_json
    from bayesid._io.phase_clock import PhaseClock
    from bayesid.app.report_origin import report_origin
    from bayesid.app.study_to_causes import cause_prior, stated_bounds
    from bayesid.app.study_to_model import load_manoeuvres, load_model
    from bayesid.diagnosis import diagnose, identify_extended
    from bayesid.inference.posterior_file import write_netcdf
    from bayesid.report import diagnosis_report
    from bayesid.report.sentences.diagnosis_sentences import diagnosis_sentences
    from bayesid.report.verdict_record import record_sentence

    model = load_model(study)
    manoeuvres = load_manoeuvres(study, model.robot)
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
    clock, identification = PhaseClock(), None
    if effective_samples is not None and result.posterior.size:
        sampling = part_of(progress, VERDICT, 1.0)
        sampling(0.0, "sampling the extended model")
        identification = identify_extended(result, seed, effective_samples=effective_samples, progress=sampling)
    clock.ends("sample")
    with complete_folder(output) as folder:
        result.unexplained.write(folder / "unexplained.csv")
        if identification is not None:
            write_netcdf(identification, folder / "posterior.nc", np.random.default_rng(seed))
        asked = ["--no-sample"] if effective_samples is None else ["--samples", f"{effective_samples:g}"]
        origin = report_origin(study, "diagnose", seed, ["--output", output.name, *asked])
        record = record_sentence(result.verdict.status)
        diagnosis_report(result, identification, study.title, folder / "report.pdf", record=record, origin=origin)
        clock.ends("report")
        content = result.to_dict(identification)
        write_json(folder / "diagnosis.json", content | {"seconds": content["seconds"] | clock.seconds})
    yield f"Wrote {output / 'report.pdf'}."
