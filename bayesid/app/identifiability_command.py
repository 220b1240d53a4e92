"""Command ``bayesid identifiability``, which shows what a robot's structure and a study's data can determine."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bayesid._io.progress import Progress
from bayesid.app.options import Output, Seed, StudyFile

if TYPE_CHECKING:
    from bayesid.identifiability import BaseParameters

__all__ = ["run"]


def run(
    file: StudyFile,
    output: Output,
    progress: Progress,
    seed: Seed = 0,
    samples: Annotated[float, typer.Option(min=1.0, help="Number of effective samples where emcee is needed.")] = 500.0,
    profiles: Annotated[int, typer.Option(min=0, help="Largest number of parameters to profile.")] = 6,
) -> Iterator[str]:
    """Determine what manoeuvres and sensors tell of the bodies, and what would tell more: identifiability.json."""
    from bayesid.app.schema import Study

    study = Study.load(file)

    from bayesid._io.files import complete_folder, write_json
    from bayesid.app.report_origin import report_origin
    from bayesid.app.study_to_linearisation import missing_part, prepare
    from bayesid.app.study_to_model import load_robot
    from bayesid.identifiability import base_parameters
    from bayesid.identifiability.practical_identifiability import practical
    from bayesid.report import identifiability_report
    from bayesid.report.identifiability_report import (
        advice_sentences,
        practical_sentences,
        structure_sentence,
    )

    structure = base_parameters(load_robot(study))
    yield structure_sentence(structure)
    content = _structure_dict(structure)
    if missing := missing_part(study):
        statement, result = f"Practical identifiability is not evaluated: {missing}.", None
        content |= {"basis": "not evaluated", "directions": [], "parameters": [], "advice": []}
    else:
        progress(0.0, "fitting")
        linearisation_point = prepare(study, seed)
        statement = linearisation_point.statement
        result = practical(
            linearisation_point.posterior,
            linearisation_point.optimum,
            linearisation_point.basis,
            seed,
            effective_samples=samples,
            profiles=profiles,
            progress=progress,
        )
        content |= result.to_dict()
    with complete_folder(output) as folder:
        write_json(folder / "identifiability.json", {"title": study.title, **content, "statement": statement})
        origin = report_origin(study, "identifiability", seed, output=output, samples=samples, profiles=profiles)
        identifiability_report(structure, result, statement, study.title, folder / "report.pdf", origin=origin)
    yield statement
    if result is not None:
        yield from practical_sentences(result)
        yield from advice_sentences(result)
    yield f"Wrote {output / 'report.pdf'}."


def _structure_dict(structure: BaseParameters) -> dict[str, Any]:
    return {
        "standard_parameters": len(structure.standard),
        "base_parameters": len(structure.independent),
        "independent": list(structure.independent),
        "dependent": list(structure.dependent),
        "regrouping": structure.regrouping.tolist(),
    }
