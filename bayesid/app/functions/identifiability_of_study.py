"""What a robot's structure and a study's data can determine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bayesid._io.progress import Progress, silent
from bayesid._io.short_form import ShortForm, Summary
from bayesid.app.functions.study_source import StudySource, study_of
from bayesid.app.study_to_linearisation import LinearisationPoint, fitted_point, missing_part, prepare
from bayesid.app.study_to_model import load_robot
from bayesid.identifiability.base_parameters import BaseParameters, base_parameters
from bayesid.identifiability.practical_identifiability import Practical, practical
from bayesid.inference.posterior import Posterior
from bayesid.report.identifiability_report import advice_sentences, practical_sentences, structure_sentence
from bayesid.robot.robot import Robot

__all__ = ["Identifiability", "identifiability"]


@dataclass(frozen=True, repr=False)
class Identifiability(ShortForm):
    """Result of `identifiability`.

    Attributes
    ----------
    title : str
        Title of the study.
    structure : BaseParameters
        Parameters that the motion of the robot can determine in principle.
    practical : Practical or None
        Parameters that these manoeuvres, sensors and priors determine; None if they are not given.
    statement : str
        Basis of `practical`, or the reason why it is not evaluated.
    """

    title: str
    structure: BaseParameters
    practical: Practical | None
    statement: str

    def summary(self) -> Summary:
        """Return which parameters can be determined, how well, and which additions would help."""
        lines = [structure_sentence(self.structure), self.statement]
        if self.practical is not None:
            lines += [*practical_sentences(self.practical), *advice_sentences(self.practical)]
        return Summary(lines)

    def to_dict(self) -> dict[str, Any]:
        """Return the content of identifiability.json."""
        structure = {
            "standard_parameters": len(self.structure.standard),
            "base_parameters": len(self.structure.independent),
            "independent": list(self.structure.independent),
            "dependent": list(self.structure.dependent),
            "regrouping": self.structure.regrouping.tolist(),
        }
        unknown = {"basis": "not evaluated", "directions": [], "parameters": [], "advice": []}
        evaluated = unknown if self.practical is None else self.practical.to_dict()
        return {"title": self.title, **structure, **evaluated, "statement": self.statement}


def identifiability(
    study: StudySource | Posterior | Robot,
    seed: int = 0,
    *,
    effective_samples: float = 500.0,
    profiles: int = 6,
    progress: Progress = silent,
) -> Identifiability:
    """Determine which body parameters manoeuvres and sensors resolve, and which additions would help.

    Parameters
    ----------
    study : path, Study, Posterior or Robot
        For a robot alone, only structural identifiability is determined.
    seed : int
        Seed of all random numbers.
    effective_samples : float
        Number of effective samples if emcee is required.
    profiles : int
        Maximum number of parameters to profile.
    progress : Progress, optional
        Receiver of the fraction done.

    Raises
    ------
    InputError
        If the study is invalid.
    """
    title, missing = "", "no recordings are given" if isinstance(study, Robot) else ""
    if isinstance(study, Posterior):
        robot = study.model.robot
    elif isinstance(study, Robot):
        robot = study
    else:
        study = study_of(study)
        title, missing, robot = study.title, missing_part(study), load_robot(study)
    structure = base_parameters(robot)
    if missing or isinstance(study, Robot):
        return Identifiability(title, structure, None, f"Practical identifiability is not evaluated: {missing}.")
    progress(0.0, "fitting")
    point: LinearisationPoint = (
        fitted_point(study, np.random.default_rng(seed)) if isinstance(study, Posterior) else prepare(study, seed)
    )
    evaluated = practical(
        point.posterior,
        point.optimum,
        point.basis,
        seed,
        effective_samples=effective_samples,
        profiles=profiles,
        progress=progress,
    )
    return Identifiability(title, structure, evaluated, point.statement)
