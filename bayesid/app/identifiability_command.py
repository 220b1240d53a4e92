"""What ``bayesid identifiability`` does, apart from the terminal: what can be known, and what a study tells."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from bayesid._io.files import complete_folder, write_json
from bayesid.app.schema import Study
from bayesid.app.study_to_linearisation import missing_part, prepare
from bayesid.app.study_to_model import load_robot
from bayesid.identifiability.base_parameters import BaseParameters, base_parameters
from bayesid.identifiability.practical_identifiability import practical
from bayesid.report import identifiability_report
from bayesid.report.sentences.identifiability_sentences import advice_sentences, practical_sentences, structure_sentence

__all__ = ["run_identifiability"]


def run_identifiability(
    file: Path,
    output: Path,
    *,
    seed: int,
    effective_samples: float,
    profiles: int,
    progress: Callable[[float, str], None],
) -> Iterator[str]:
    """Write identifiability.json and report.pdf of a study; without recordings only of its robot."""
    study = Study.load(file)
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
            effective_samples=effective_samples,
            profiles=profiles,
            progress=progress,
        )
        content |= result.to_dict()
    with complete_folder(output) as folder:
        write_json(folder / "identifiability.json", {"title": study.title, **content, "statement": statement})
        identifiability_report(structure, result, statement, study.title, folder / "report.pdf")
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
