"""Content of diagnosis.json."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bayesid.diagnosis.candidates.jump_instants import jump_instants
from bayesid.diagnosis.outcome.candidate_table import Candidate
from bayesid.diagnosis.outcome.cause_amplitudes import amplitudes_of, amplitudes_of_others
from bayesid.diagnosis.outcome.torque_reading import TorqueReading, Unread
from bayesid.inference import Identification
from bayesid.inference.body_quantities import quantity
from bayesid.simulation.effects.mass_shift import MassShift

if TYPE_CHECKING:
    from bayesid.diagnosis.diagnosis_run import Diagnosis

__all__ = ["diagnosis_dict"]

SHOWN = 0.01
"""Probability down to which sets of causes are listed; the most probable one always is."""


def diagnosis_dict(result: Diagnosis, identification: Identification | None) -> dict[str, Any]:
    """Return the content of diagnosis.json.

    Parameters
    ----------
    result : Diagnosis
    identification : Identification or None
        Of the extended model, None where it was not sampled.
    """
    verdict, found = result.verdict, result.probabilities
    inclusion = found.inclusion
    fitted = {name: _fitted(result, name) for name in verdict.causes}
    return {
        "status": verdict.status.value,
        "causes": [name for name in verdict.causes if name in inclusion and name in found.causes],
        "equivalent_to": {cause: list(names) for cause, names in verdict.equivalent_to.items()},
        "ambiguous_with": [list(names) for names in verdict.ambiguous_with],
        "probability": {
            "nothing": found.nothing,
            "unknown": found.unknown,
            "causes": {members[0]: found.of_any(members) for members in _ordered(result)},
        },
        "sets": _sets(result),
        "candidates": [_candidate(row, fitted.get(row.name)) for row in result.candidates],
        "unexplained": {
            "file": "unexplained.csv",
            "signal_to_noise": result.unexplained.signal_to_noise,
            "fixed_in": None if result.unexplained.fixed_in is None else result.unexplained.fixed_in.value,
        },
        "joint_torques": _torques(result.torques),
        "bodies_held": result.held,
        "gain": _gain(result),
        "p_value": result.alarm.p_value,
        "most_significant": result.alarm.loudest,
        "sensitivity": {
            choice: {"status": other.status.value, "causes": list(other.causes)}
            for choice, other in result.sensitivity.others.items()
        },
        "bounds": {
            label: {item.unit: {"largest": item.largest, "reason": item.reason} for item in items}
            for label, items in result.bounds.items()
        },
        "prior": {"one_more_cause": found.prior.one_more, "generic": found.prior.generic},
        "seconds": dict(result.seconds),
        "identification": None if identification is None else identification.to_dict(),
    }


def _ordered(result: Diagnosis) -> list[list[str]]:
    """Return the classes of equivalents, of each the most probable name first."""
    inclusion = result.probabilities.inclusion
    named = result.verdict.causes
    return [sorted(members, key=lambda name: (name not in named, -inclusion[name], name)) for members in result.classes]


def _sets(result: Diagnosis) -> list[dict[str, Any]]:
    sets = result.probabilities.sets
    shown = [item for index, item in enumerate(sets) if index == 0 or item.probability >= SHOWN]
    fitted = [frozenset(result.after.labels), frozenset()]
    return [
        {
            "causes": list(item.causes),
            "generic": [] if item.generic is None else [item.generic],
            "probability": item.probability,
            "log_evidence": item.log_evidence,
            "refitted": item.generic is None and frozenset(item.causes) in fitted,
        }
        for item in shown
    ]


def _gain(result: Diagnosis) -> dict[str, Any]:
    gain = result.gain
    held = {
        key: None if side.held_out is None else float(side.held_out.sum())
        for key, side in (("before", gain.before), ("after", gain.after))
    }
    names = gain.before.bodies.names
    return {
        "chi2_per_sample": {"before": gain.before.chi2_per_sample, "after": gain.after.chi2_per_sample},
        "held_out_log_score": held if held["before"] is not None else None,
        "residual_rms_in_sigma": {"before": gain.before.rms, "after": gain.after.rms},
        "within_one_sigma": {"before": gain.before.inside, "after": gain.after.inside},
        "parameter_shift_in_sd": dict(zip(names, gain.shift.tolist(), strict=True)),
        "parameter_sd_ratio": dict(zip(names, (gain.after.bodies.sd / gain.before.bodies.sd).tolist(), strict=True)),
    }


def _torques(found: TorqueReading | Unread | None) -> dict[str, Any] | None:
    if found is None:
        return None
    if isinstance(found, Unread):
        return {"status": "not evaluated", "reason": found.reason}
    before, after = found.chi2_per_sample
    return {
        "status": found.verdict.status.value,
        "causes": [name for name in found.verdict.causes if name in found.probabilities.causes],
        "ambiguous_with": [list(names) for names in found.verdict.ambiguous_with],
        "probability": {"nothing": found.probabilities.nothing, "unknown": found.probabilities.unknown},
        "candidates": [
            {
                "name": row.name,
                "probability": row.probability,
                "amplitude": {
                    item.name: quantity(mean, sd, item.unit)
                    for item, mean, sd in zip(row.quantities, row.mean.tolist(), row.sd.tolist(), strict=True)
                },
            }
            for row in found.causes
        ],
        "p_value": found.p_value,
        "chi2_per_sample": {"before": before, "after": after},
    }


def _fitted(result: Diagnosis, name: str) -> dict[str, Any]:
    """Return what the extended model says of a named cause: its amplitudes, and of a jump the instants.

    Of a cause with amplitudes in each recording the first recording's have plain keys.
    """
    found = amplitudes_of(result.after, name) + amplitudes_of_others(result.after, name)
    if name == MassShift.name:
        found += jump_instants(result.after)
    return {"amplitude": {item.quantity.name: quantity(item.mean, item.sd, item.quantity.unit) for item in found}}


def _candidate(row: Candidate, fitted: dict[str, Any] | None) -> dict[str, Any]:
    """Return a candidate beside the present model alone, with its amplitudes in the extended model if it is named."""
    entries = list(zip(row.quantities, row.mean.tolist(), row.sd.tolist(), row.upper_limit.tolist(), strict=True))
    return {
        "name": row.name,
        "probability": row.probability,
        "signal_to_noise": row.signal_to_noise,
        "p_value": row.p_value,
        "p_value_adjusted": row.p_value_adjusted,
        "log_bayes_factor": row.log_bayes_factor,
        "amplitude": {key: quantity(mean, sd, unit) for (key, unit), mean, sd, _ in entries},
        "upper_limit_95": {key: limit for (key, _), _, _, limit in entries},
        "power": row.power,
        "generic": row.generic,
        **(fitted or {}),
    }
