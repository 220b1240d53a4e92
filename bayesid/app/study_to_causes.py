"""What a study says of the causes that could be at work."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bayesid.app.schema import Study
from bayesid.diagnosis.evidence.cause_sets import CausePrior
from bayesid.simulation.effects.physical_bound import PhysicalBound

if TYPE_CHECKING:
    from bayesid.diagnosis.loop_review import DiagnosisReview

__all__ = ["cause_prior", "loop_review", "stated_bounds"]


def stated_bounds(study: Study) -> dict[str, list[PhysicalBound]]:
    """Return the largest sizes that the study states, by the candidates' labels."""
    return {
        label: [PhysicalBound(unit, size, "Stated in the study.") for unit, size in sizes.items()]
        for label, sizes in study.diagnosis.bounds.items()
    }


def cause_prior(study: Study) -> CausePrior:
    """Return the study's prior of the number of causes, and of something generic."""
    return CausePrior(study.diagnosis.one_more_cause, study.diagnosis.outside_catalogue)


def loop_review(study: Study) -> DiagnosisReview:
    """Return the diagnosis of what a loop has flown, with what the study says of causes."""
    from bayesid.diagnosis.loop_review import DiagnosisReview

    stated = study.design is not None and "argument_of_latitude" in study.design.model_fields_set
    first = study.recordings[0].argument_of_latitude if study.recordings else None
    return DiagnosisReview(stated_bounds(study), cause_prior(study), stated or first is not None)
