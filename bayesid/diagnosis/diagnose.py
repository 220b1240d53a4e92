"""Diagnosis from end to end: what the simulation gets wrong, its cause, the extended model, what that gains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from bayesid._io.progress import PhaseClock, Progress, silent
from bayesid._math.divergence import divergence_named
from bayesid.diagnosis.candidates.cause_kind import candidates
from bayesid.diagnosis.evidence.cause_sets import CausePrior
from bayesid.diagnosis.evidence.verdict import Rest, Status, verdict_sensitivity
from bayesid.diagnosis.outcome.candidate_table import candidate_table
from bayesid.diagnosis.outcome.disturbance import disturbing_wrench
from bayesid.diagnosis.outcome.gain import measure_gain
from bayesid.diagnosis.outcome.torque_reading import TorqueReading, TorquesNotRead, torque_candidates, torques_beside
from bayesid.diagnosis.response.perturbed_model import PerturbedModel
from bayesid.diagnosis.response.present_fit import (
    PresentFit,
    fit_present_model,
    improbable,
    step_along_data,
    without_torque,
)
from bayesid.diagnosis.result import Diagnosis
from bayesid.diagnosis.run_size import RunSize
from bayesid.diagnosis.search.fitted_set import Hypothesis
from bayesid.diagnosis.search.linearisation import Catalogue
from bayesid.diagnosis.search.misfit import with_misfit
from bayesid.diagnosis.search.model_search import search_models
from bayesid.diagnosis.settings import DEFAULT_SETTINGS, FULL, DiagnosisSettings
from bayesid.inference import Identification, identify
from bayesid.inference.conventions import refuse_conventions
from bayesid.inference.noise_changes import relinearised
from bayesid.inference.posterior import Posterior
from bayesid.inference.wrong_units import refuse_wrong_units
from bayesid.simulation.effects import bounds_by_label
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import PhysicalBound
from bayesid.simulation.model import RATE_SIGMA, Manoeuvre, Model

__all__ = ["diagnose", "identify_extended"]


@threadpool_limits.wrap(limits=1)  # thousands of small factorisations: threads only get in each other's way
@divergence_named()
def diagnose(
    model: Model,
    manoeuvres: Sequence[Manoeuvre],
    seed: int = 0,
    *,
    effects: Sequence[Effect] | None = None,
    bounds: Mapping[str, Sequence[PhysicalBound]] | None = None,
    prior: CausePrior | None = None,
    settings: DiagnosisSettings = DEFAULT_SETTINGS,
    knows_latitude: bool = True,
    executor: Executor | None = None,
    progress: Progress = silent,
) -> Diagnosis:
    """Determine what a model gets wrong about recordings, and name the cause.

    The verdict is on the motion; joint torques are evaluated after it (`read_torques`), unless an unnamed cause moves
    the base.

    Parameters
    ----------
    model : Model
    manoeuvres : sequence of Manoeuvre
    seed : int
        Seed of every random number.
    effects : sequence of Effect, optional
        Candidates; by default all effects of the catalogue that could exist (`candidates`).
    bounds : mapping of str to sequence of PhysicalBound, optional
        Largest sizes that replace those of the catalogue, by the candidates' labels.
    prior : CausePrior, optional
        Prior of the number of causes, and of something outside the catalogue.
    settings : DiagnosisSettings, optional
        Thresholds of the decisions.
    knows_latitude : bool
        Whether the manoeuvres' arguments of latitude are known.
    executor : concurrent.futures.Executor, optional
        Executor for the refits that omit each of the recordings; by default they run one after the other.
    progress : Progress, optional

    Raises
    ------
    InputError
        If the numbers of a recording cannot be in the units of the format, or another convention is wrong
        (`ConventionError`); or if no fit of the present simulation is finite (`DivergenceError`).
    """
    refuse_conventions(model, manoeuvres)
    rng, clock = np.random.default_rng(seed), PhaseClock()
    whole, model, prior = model, model.without_torque, prior or CausePrior()
    catalogue = _catalogue(model, manoeuvres, knows_latitude) if effects is None else list(effects)
    on_torques = [] if whole.torque is None else torque_candidates(whole)
    limits = bounds_by_label([*catalogue, *on_torques], whole, bounds)
    at_rest = model.rate_sigma == 0.0
    posterior = Posterior.of(replace(model, rate_sigma=RATE_SIGMA, speed_errors=True) if at_rest else model, manoeuvres)
    refuse_wrong_units(posterior if whole.torque is None else Posterior.of(whole, manoeuvres))
    size = RunSize.of(posterior, catalogue)
    size.refuse()
    clock.ends("load")
    rates = posterior.unknowns.layout.all_rates
    perturbed = PerturbedModel(posterior, range(rates.start, rates.stop) if at_rest else ())
    progress(0.0, f"compiling the simulation; {size}")
    perturbed.compile()
    clock.ends("compile")
    progress(0.1, "fitting the present model")
    considered = Catalogue(tuple(catalogue), limits, prior, settings)
    start = perturbed
    perturbed, present = _fitted(start, settings)
    clock.ends("fit")
    search = search_models(perturbed, present.fit, considered, rng, progress, bodies_fixed=present.held)
    if not present.held and improbable(present.fit, settings) and not search.alarm.silent:
        progress(0.6, "weighing the causes along the motion in the data")
        with_bodies, fixed = _fitted(start, settings, hold=True)
        along = search_models(with_bodies, fixed.fit, considered, rng, progress, bodies_fixed=True)
        if along.highest > search.highest:
            perturbed, present, search = with_bodies, fixed, along
    before = Hypothesis(perturbed, present.fit)
    progress(0.65, "fitting the most probable causes")
    search, fitted = with_misfit(search, catalogue, settings)
    classes = search.classes()
    sensitivity = verdict_sensitivity(
        search.probabilities, classes, search.alarm.silent, search.widened, settings, search.noise
    )
    verdict = sensitivity.verdict
    clock.ends("verdict")
    named = list(verdict.causes)
    progress(0.7, "fitting the extended model")
    after = before
    if named:
        after = fitted.get(frozenset(named)) or search.under(named).fit(named, catalogue)
    progress(0.75, "measuring the gain")
    gain = measure_gain(before, after, executor)
    progress(0.85, "reconstructing the disturbance")
    open_question = verdict.status in (Status.UNKNOWN, Status.UNRESOLVED)
    remains = verdict.remainder.verdict is Rest.PRESENT
    lacking = Hypothesis(perturbed, without_torque(search.base.fit)) if present.held else before
    disturbance = disturbing_wrench(lacking, search.base.bank, open_question, settings)
    unexplained = disturbing_wrench(after, search.under(named).point.bank, remains, settings) if named else disturbance
    table = candidate_table(search, catalogue, rng)
    torques: TorqueReading | TorquesNotRead | None = None
    if whole.torque is not None:
        progress(0.95, "reading the joint torques")
        torques = torques_beside(verdict, after, whole, prior, rng, limits, settings)
    clock.ends("consequences")
    return Diagnosis(
        before,
        after,
        search,
        classes,
        sensitivity,
        table,
        gain,
        disturbance,
        unexplained,
        torques,
        tuple(catalogue),
        limits,
        seed,
        clock.seconds,
    )


def _fitted(
    perturbed: PerturbedModel, settings: DiagnosisSettings, *, hold: bool = False
) -> tuple[PerturbedModel, PresentFit]:
    """Return the fit of the present model, and the model with the encoders' errors linearised about it.

    Where the bodies are held, the integration step suits the motion in the data.
    """
    posterior = perturbed.posterior
    first = fit_present_model(perturbed, settings=settings, hold=hold)
    if first.held and (step := step_along_data(posterior)) < posterior.step:
        posterior = Posterior.of(posterior.model, posterior.manoeuvres, step=step)
        perturbed = PerturbedModel(posterior, perturbed.frozen)
        first = fit_present_model(perturbed, settings=settings, hold=hold)
    perturbed = perturbed.with_posterior(relinearised(posterior, first.fit.z))
    return perturbed, fit_present_model(perturbed, first.fit.z, settings, hold=hold)


def _catalogue(model: Model, manoeuvres: Sequence[Manoeuvre], knows_latitude: bool) -> list[Effect]:
    """Return the candidates that could be at work in some recordings.

    Those with amplitudes of their own in each recording are left out where there are many recordings.
    """
    recordings = [manoeuvre.recording for manoeuvre in manoeuvres]
    wheels = any(recording.wheels or "wheel_momentum.x" in recording.channels for recording in recordings)
    longest = max(float(recording.time[-1]) for recording in recordings)
    blocks = max((manoeuvre.blocks_per_second for manoeuvre in manoeuvres), key=lambda rate: rate or float("inf"))
    possible = candidates(model, knows_latitude=knows_latitude, records_wheels=wheels, longest=longest)
    shown = [effect for effect in possible if effect.shows_in(recordings, blocks)]
    return [effect for effect in shown if len(recordings) <= FULL or not effect.per_recording]


def identify_extended(
    diagnosis: Diagnosis, seed: int, *, effective_samples: float = 4000.0, progress: Progress = silent
) -> Identification:
    """Sample the extended model.

    Parameters
    ----------
    diagnosis : Diagnosis
    seed : int
    effective_samples : float
        Number of independent draws to which the sample is equivalent.
    progress : Progress, optional
    """
    return identify(
        diagnosis.posterior, seed, start=diagnosis.start, effective_samples=effective_samples, progress=progress
    )
