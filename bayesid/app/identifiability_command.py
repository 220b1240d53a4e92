"""Command ``bayesid identifiability``, which shows what a robot's structure and a study's data can determine."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

import typer

from bayesid._io.progress import Progress
from bayesid.app.options import Output, Seed, StudyFile

__all__ = ["run"]


def run(
    file: StudyFile,
    output: Output,
    progress: Progress,
    seed: Seed = 0,
    effective_samples: Annotated[
        float, typer.Option("--samples", min=1.0, help="Number of effective samples if emcee is required.")
    ] = 500.0,
    profiles: Annotated[int, typer.Option(min=0, help="Maximum number of parameters to profile.")] = 6,
) -> Iterator[str]:
    """Determine which parameters the recordings resolve, and what would help: identifiability.json and report.pdf."""
    from bayesid.app.schema import Study

    study = Study.load(file)

    from bayesid._io.files import complete_folder, write_json
    from bayesid.app.functions.identifiability_of_study import identifiability
    from bayesid.app.report_origin import report_origin
    from bayesid.report import identifiability_report

    result = identifiability(study, seed, effective_samples=effective_samples, profiles=profiles, progress=progress)
    with complete_folder(output) as folder:
        write_json(folder / "identifiability.json", result.to_dict())
        effort = (("samples", effective_samples), ("profiles", profiles))
        origin = report_origin(study, "identifiability", seed, output=output, **dict(effort))
        identifiability_report(
            result.structure, result.practical, result.statement, study.title, folder / "report.pdf", origin=origin
        )
    yield from result.summary().sentences
    yield f"Wrote {output / 'report.pdf'}."
