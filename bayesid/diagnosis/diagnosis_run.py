"""Diagnosis from end to end: what the simulation gets wrong, its cause, the extended model, what that gains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from bayesid._io.progress import Progress, silent
from bayesid._math.arrays import Floats
from bayesid.diagnosis.candidate_effects import candidates
from bayesid.diagnosis.candidate_table import Candidate, candidate_table
from bayesid.diagnosis.cause_search import CauseSearch, Hypothesis
from bayesid.diagnosis.disturbing_wrench import Unexplained, unexplained_wrench
from bayesid.diagnosis.gain import Gain, measure_gain
from bayesid.diagnosis.verdict import Status, Verdict, judge
from bayesid.inference import Identification, identify
from bayesid.inference.body_quantities import quantity
from bayesid.inference.posterior import Posterior
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.model import RATE_SIGMA, Manoeuvre, Model

__all__ = ["Diagnosis", "diagnose", "extended_posterior", "identify_extended"]


INNER = ("frequency", "damping")
"""Quantities that are no amplitude, of which no upper limit is given."""


@dataclass(frozen=True)
class Diagnosis:
    """Result of `diagnose`.

    Attributes
    ----------
    search : Search
        Every hypothesis tried.
    verdict : Verdict
    candidates : list of Candidate
    gain : Gain
        Present model against the verdict's best.
    unexplained : Unexplained
        Left by the named causes, or by the present model where none is named.
    """

    search: CauseSearch
    verdict: Verdict
    candidates: list[Candidate]
    gain: Gain
    unexplained: Unexplained

    @property
    def before(self) -> Hypothesis:
        """The present model."""
        return self.search.base

    @property
    def after(self) -> Hypothesis:
        """The extended model; the present one where nothing is named."""
        return self.verdict.best if self.verdict.causes else self.search.base

    @cached_property
    def posterior(self) -> Posterior:
        """The extended model's posterior, simulated in full."""
        return extended_posterior(self.after)

    @property
    def start(self) -> Floats:
        """The mode found, as a starting point for `posterior`."""
        return extended_start(self.after, self.posterior)

    def to_dict(self, identification: Identification | None = None) -> dict[str, Any]:
        """Content of diagnosis.json."""
        gain, verdict = self.gain, self.verdict
        held = {
            key: None if side.held_out is None else float(side.held_out.sum())
            for key, side in (("before", gain.before), ("after", gain.after))
        }
        return {
            "status": verdict.status.value,
            "causes": list(verdict.causes),
            "equivalent_to": {cause: list(names) for cause, names in verdict.equivalents.items()},
            "ambiguous_with": [list(rival.labels) for rival in verdict.rivals]
            if verdict.status is Status.AMBIGUOUS
            else [],
            "candidates": [_candidate_dict(row) for row in self.candidates],
            "unexplained": {
                "file": "unexplained.csv",
                "signal_to_noise": self.unexplained.signal_to_noise,
                "fixed_in": None if self.unexplained.fixed_in is None else self.unexplained.fixed_in.value,
            },
            "gain": {
                "chi2_per_sample": {"before": gain.before.chi2_per_sample, "after": gain.after.chi2_per_sample},
                "held_out_log_score": held if held["before"] is not None else None,
                "residual_rms_in_sigma": {"before": gain.before.rms, "after": gain.after.rms},
                "within_one_sigma": {"before": gain.before.inside, "after": gain.after.inside},
                "parameter_shift_in_sd": dict(zip(gain.before.bodies.names, gain.shift.tolist(), strict=True)),
                "parameter_sd_ratio": dict(
                    zip(gain.before.bodies.names, (gain.after.bodies.sd / gain.before.bodies.sd).tolist(), strict=True)
                ),
            },
            "p_value": {"before": self.before.outcome.p_value, "after": self.after.outcome.p_value},
            "most_significant": {"before": self.before.outcome.worst, "after": self.after.outcome.worst},
            "identification": None if identification is None else identification.to_dict(),
        }


def diagnose(
    model: Model,
    manoeuvres: Sequence[Manoeuvre],
    seed: int = 0,
    *,
    effects: Sequence[Effect] | None = None,
    knows_latitude: bool = True,
    progress: Progress = silent,
) -> Diagnosis:
    """Show what a model gets wrong about recordings, and name the cause. Joint torques are not used.

    Parameters
    ----------
    model : Model
    manoeuvres : sequence of Manoeuvre
    seed : int
        Every random number follows from it.
    effects : sequence of Effect, optional
        Candidates; by default all of the catalogue that could exist (`candidates`).
    knows_latitude : bool
        Whether the manoeuvres' arguments of latitude are known.
    progress : Progress, optional
    """
    model = model.without_torque  # whose friction no catalogue of causes holds
    with threadpool_limits(limits=1):  # thousands of small factorisations: threads only get in each other's way
        return _diagnose(model, manoeuvres, seed, effects, knows_latitude, progress)


def _diagnose(
    model: Model,
    manoeuvres: Sequence[Manoeuvre],
    seed: int,
    effects: Sequence[Effect] | None,
    knows_latitude: bool,
    progress: Progress,
) -> Diagnosis:
    at_rest = model.rate_sigma == 0.0
    posterior = Posterior.of(replace(model, rate_sigma=RATE_SIGMA, speed_errors=True) if at_rest else model, manoeuvres)
    rates = posterior.unknowns.layout.all_rates
    frozen = range(rates.start, rates.stop) if at_rest else ()
    catalogue = candidates(model, knows_latitude=knows_latitude) if effects is None else list(effects)
    search = CauseSearch(posterior, frozen, catalogue, seed, progress)
    verdict = judge(search)
    progress(0.8, "measuring the gain")
    best = verdict.best if verdict.causes else search.base
    gain = measure_gain(search.base, best)
    progress(0.9, "reconstructing the disturbance")
    open_question = verdict.status in (Status.UNKNOWN, Status.UNRESOLVED)
    unexplained = unexplained_wrench(best, open_question) if verdict.causes or open_question else verdict.disturbance
    return Diagnosis(search, verdict, candidate_table(search), gain, unexplained)


def extended_posterior(hypothesis: Hypothesis) -> Posterior:
    """Build the posterior of a hypothesis, its effects in the simulation itself."""
    fit = hypothesis.fit
    model = fit.posterior.model
    for index, effect in enumerate(fit.effects):
        model = model.extend(effect.tuned(fit.values(index)))
    if hypothesis.engine.frozen.size:
        model = replace(model, rate_sigma=0.0)
    manoeuvres = [_without(manoeuvre, fit.posterior, index) for index, manoeuvre in enumerate(fit.posterior.manoeuvres)]
    return Posterior.of(model, manoeuvres)


def extended_start(hypothesis: Hypothesis, posterior: Posterior) -> Floats:
    """Mode of a hypothesis in the coordinates of its own posterior."""
    fit = hypothesis.fit
    z = np.delete(fit.z, hypothesis.engine.frozen)
    return np.concatenate([z, *fit.coordinates]) if posterior.size else np.zeros(0)


def identify_extended(
    diagnosis: Diagnosis,
    seed: int,
    *,
    effective_samples: float = 4000.0,
    progress: Progress = silent,
) -> Identification:
    """Sample the extended model."""
    return identify(
        diagnosis.posterior, seed, start=diagnosis.start, effective_samples=effective_samples, progress=progress
    )


def _without(manoeuvre: Manoeuvre, posterior: Posterior, index: int) -> Manoeuvre:
    """Return a manoeuvre without the samples that a hypothesis counts as outliers."""
    gone = posterior.data.left_out_times(index)
    if not gone:
        return manoeuvre
    channels = dict(manoeuvre.recording.channels)
    for kind, times in gone.items():
        rows = np.isin(manoeuvre.recording.time, times)
        for axis in ("x", "y", "z", "w"):
            key = f"{kind.value}.{axis}"
            if key in channels:
                channels[key] = np.where(rows, np.nan, channels[key])
    return replace(manoeuvre, recording=replace(manoeuvre.recording, channels=channels))


def _candidate_dict(row: Candidate) -> dict[str, Any]:
    entries = list(zip(row.quantities, row.mean, row.sd, strict=False)) if len(row.mean) else []
    return {
        "name": row.name,
        "signal_to_noise": row.signal_to_noise,
        "p_value": row.p_value,
        "p_value_adjusted": row.p_value_adjusted,
        "log_bayes_factor": row.log_bayes_factor,
        "amplitude": {key: quantity(mean, sd, unit) for (key, unit), mean, sd in entries},
        "upper_limit_95": {
            key: float(limit)
            for (key, _), limit in (zip(row.quantities, row.upper_limit, strict=False) if len(row.mean) else ())
            if key not in INNER
        },
        "power": row.power,
        "refitted": row.refitted,
    }
