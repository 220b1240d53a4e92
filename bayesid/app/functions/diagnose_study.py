"""Diagnosis of a study: the verdict, samples of the extended model, and the manoeuvre that would decide."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from typing import Any

from bayesid._io.errors import InputError
from bayesid._io.progress import PhaseClock, Progress, part_of, silent
from bayesid.app.functions.study_source import StudySource, study_of
from bayesid.app.schema import Study
from bayesid.app.study_to_design import FILE
from bayesid.app.study_to_design import fly_next as designed_next
from bayesid.app.study_to_model import cause_prior, load_manoeuvres, load_model, stated_bounds
from bayesid.diagnosis import CausePrior, Diagnosis, DiagnosisSettings, identify_extended
from bayesid.diagnosis import diagnose as diagnose_motion
from bayesid.diagnosis.settings import DEFAULT_SETTINGS
from bayesid.report.design_report import separation_sentence
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import PhysicalBound
from bayesid.simulation.model import Manoeuvre, Model

__all__ = ["diagnose", "followed_up"]

VERDICT = 0.3  # share of the time until the verdict where the extended model is sampled afterwards


def diagnose(
    study: StudySource | Model,
    manoeuvres: Sequence[Manoeuvre] | None = None,
    seed: int = 0,
    *,
    effective_samples: float = 4000.0,
    sample: bool = True,
    fly_next: bool = True,
    effects: Sequence[Effect] | None = None,
    bounds: Mapping[str, Sequence[PhysicalBound]] | None = None,
    prior: CausePrior | None = None,
    settings: DiagnosisSettings = DEFAULT_SETTINGS,
    knows_latitude: bool = True,
    executor: Executor | None = None,
    progress: Progress = silent,
) -> Diagnosis:
    """Name the causes of a misfit of the simulation, add them to the model and measure the improvement.

    Parameters
    ----------
    study : path, Study or Model
        Path of a study file, the study that was read from it, or its model.
    manoeuvres : sequence of Manoeuvre, optional
        Recorded manoeuvres of a model; a study names its recordings.
    seed : int
        Seed of all random numbers.
    effective_samples : float
        Goal for the number of effective samples of the extended model.
    sample : bool
        Whether to sample the extended model with emcee after the verdict.
    fly_next : bool
        Whether to design the next manoeuvre of a study if the verdict is ambiguous or unresolved.
    effects : sequence of Effect, optional
        Candidates, by default all effects of the catalogue that can act.
    bounds : mapping of str to sequence of PhysicalBound, optional
        Largest plausible sizes that replace the defaults, by the candidates' labels; by default those of the study.
    prior : CausePrior, optional
        Prior of the number of causes and of a cause outside the catalogue, by default that of the study.
    settings : DiagnosisSettings
        Thresholds of the decisions.
    knows_latitude : bool
        Whether the arguments of latitude of a model's manoeuvres are known; for a study, whether it gives all of them.
    executor : concurrent.futures.Executor, optional
        Executor whose workers read one recording each, and refit with one recording omitted.
    progress : Progress, optional
        Receiver of the fraction done.

    Raises
    ------
    InputError
        If the study is invalid, or values cannot be in the units of the format.
    """
    whole: Study | None = None
    if isinstance(study, Model):
        model = study
    else:
        whole = study_of(study)
        model = load_model(whole)
        reading = part_of(progress, 0.0, 0.05)
        if manoeuvres is None:
            manoeuvres = load_manoeuvres(whole, model.robot, reading, executor)
        knows_latitude = all(section.argument_of_latitude is not None for section in whole.recordings)
        bounds, prior = bounds or stated_bounds(whole), prior or cause_prior(whole)
    result = diagnose_motion(
        model,
        manoeuvres or (),
        seed,
        effects=effects,
        bounds=bounds,
        prior=prior,
        settings=settings,
        knows_latitude=knows_latitude,
        executor=executor,
        progress=part_of(progress, 0.0, VERDICT) if sample else progress,
    )
    return followed_up(result, whole if fly_next else None, seed, effective_samples if sample else None, progress)


def followed_up(
    result: Diagnosis, study: Study | None, seed: int, effective_samples: float | None, progress: Progress = silent
) -> Diagnosis:
    """Return a diagnosis with the samples of its extended model, and with the manoeuvre that would decide.

    Parameters
    ----------
    result : Diagnosis
        Result of `diagnose`.
    study : Study or None
        With the limits of the next manoeuvre, which is not designed where it is None.
    seed : int
        Seed of all random numbers.
    effective_samples : float or None
        Goal for the number of effective samples of the extended model, which is not sampled where it is None.
    progress : Progress, optional
        Receiver of the fraction done.
    """
    clock, changes = PhaseClock(), dict[str, Any]()
    if effective_samples is not None:
        sampling = part_of(progress, VERDICT, 1.0)
        sampling(0.0, "sampling the extended model")
        try:
            if result.posterior.size:
                changes["identification"] = identify_extended(
                    result, seed, effective_samples=effective_samples, progress=sampling
                )
        except InputError as error:  # no motion at the prior's centre of the extended model
            changes["not_sampled"] = f"The extended model was not sampled: {error}."
    clock.ends("sample")
    if study is not None and result.rivals:
        progress(1.0, "designing the next manoeuvre")
        try:
            planned = designed_next(study, result.rivals, seed, silent)
        except InputError as error:
            changes["advice"] = f"No manoeuvre was designed to distinguish {' and '.join(result.rivals)}: {error}."
        else:
            changes["next_manoeuvre"] = planned
            changes["advice"] = (
                f"Fly {FILE}, {planned.problem.plan.family.duration:g} s. {separation_sentence(planned)}"
            )
    clock.ends("design")
    return replace(result, **changes, seconds=result.seconds | clock.seconds)
