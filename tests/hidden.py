"""Hidden cases on recordings of one length, so that test files share compiled functions, and their diagnosis."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.diagnosis import Diagnosis, diagnose
from studies.truth import hidden_causes

__all__ = ["diagnosed", "shortened"]

SHORT = {"count": 2, "duration": 100.0}


def diagnosed(file: Path) -> Diagnosis:
    """Diagnose a study from its files alone."""
    study = Study.load(file)
    model = load_model(study)
    knows = all(section.argument_of_latitude is not None for section in study.recordings)
    return diagnose(model, load_manoeuvres(study, model.robot), 0, knows_latitude=knows)


def shortened(case: hidden_causes.Case) -> hidden_causes.Case:
    """The case with two recordings of 100 s, unless it says itself how many and how long they are."""
    manoeuvres = {**SHORT, **case.fixed.get("manoeuvres", {})}
    return replace(case, fixed={**case.fixed, "manoeuvres": manoeuvres})
