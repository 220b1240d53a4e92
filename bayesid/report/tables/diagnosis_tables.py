"""Rows of a diagnosis report's tables."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bayesid.diagnosis import Candidate, Diagnosis
from bayesid.diagnosis.candidates.jump_instants import jump_instants
from bayesid.diagnosis.outcome.candidate_table import amplitudes_of
from bayesid.diagnosis.outcome.disturbance import TorqueCorrelation
from bayesid.diagnosis.response.effect_functions import CauseAmplitude
from bayesid.report.document import Rows
from bayesid.report.numbers import (
    format_fixed,
    format_number,
    format_p_value,
    format_probability,
    format_quantity,
    format_signed,
    format_unit,
)
from bayesid.report.sentences.amplitude_words import amplitude_text, limit_text
from bayesid.simulation.effects.mass_shift import MassShift

__all__ = [
    "candidate_rows",
    "cause_rows",
    "correlation_rows",
    "gain_rows",
    "unseen_rows",
]

LIMITS = 6
"""Largest number of limits in a cell of the table of candidates out of reach."""

SEEN = 2.0
"""Distance from zero, in standard deviations, above which an amplitude is given and below which a limit."""


def candidate_rows(rows: Sequence[Candidate], alarm: float) -> Rows:
    """Return name, probability, signal-to-noise ratio, p-value, log Bayes factor, size or limit, and power.

    Parameters
    ----------
    rows : sequence of Candidate
    alarm : float
        Adjusted p-value below which a candidate is significant.
    """
    return [
        [
            row.name,
            format_probability(row.probability),
            format_fixed(row.signal_to_noise, 1),
            format_p_value(row.p_value_adjusted),
            "" if row.log_bayes_factor is None else format_signed(row.log_bayes_factor),
            _size_text(row, alarm),
            "" if row.power is None else format_fixed(row.power, 2),
        ]
        for row in rows
    ]


def _size_text(row: Candidate, alarm: float) -> str:
    amplitude = list(map(CauseAmplitude, row.quantities, np.asarray(row.mean).tolist(), np.asarray(row.sd).tolist()))
    seen = row.p_value_adjusted < alarm and any(item.distance > SEEN for item in amplitude)
    return amplitude_text(amplitude) if seen else limit_text(row)


def cause_rows(result: Diagnosis) -> Rows:
    """Return quantity, unit, value, distance from zero and bound for every quantity of every named cause.

    The instants of a jump come last, without a distance.
    """
    best = result.after
    sizes = [
        [
            f"{label}.{item.quantity.name}",
            format_unit(item.quantity.unit),
            format_quantity(item.mean, item.sd),
            f"{format_fixed(item.distance, 1)} sd" if item.sd > 0.0 else "",
            _bound_text(result, label, item.quantity.unit),
        ]
        for label in best.labels
        for item in amplitudes_of(best, label)
    ]
    instants = [
        [f"{MassShift.name}.{quantity.name}", format_unit(quantity.unit), format_quantity(mean, sd), "", ""]
        for quantity, mean, sd in jump_instants(best)
    ]
    return sizes + instants


def _bound_text(result: Diagnosis, label: str, unit: str) -> str:
    found = [bound.largest for bound in result.bounds.get(label, ()) if bound.unit == unit]
    return format_number(found[0]) if found else ""


def gain_rows(result: Diagnosis) -> Rows:
    """Return each measure of fit and prediction with its value before and after, and what noise alone would give."""
    before, after = result.gain.before, result.gain.after
    rows = [
        _measure("chi-square per sample", before.chi2_per_sample, after.chi2_per_sample, 3),
        _measure("share of residuals within 1 σ", before.inside, after.inside, 3),
        *(_measure(f"rms residual of {name} [σ]", value, after.rms.get(name), 3) for name, value in before.rms.items()),
    ]
    spread = math.sqrt(2.0 / result.before.fit.posterior.samples)
    expected = [f"1 ± {format_fixed(spread, 3)}", "0.683", *["1"] * len(before.rms)]
    if before.held_out is not None and after.held_out is not None:
        names = [manoeuvre.recording.name for manoeuvre in result.before.fit.posterior.manoeuvres]
        rows += [
            _measure(f"held-out log score of {name}", float(one), float(two), 1)
            for name, one, two in zip(names, before.held_out, after.held_out, strict=True)
        ]
        rows.append(_measure("held-out log score, sum", float(before.held_out.sum()), float(after.held_out.sum()), 1))
    expected += ["higher is better"] * (len(rows) - len(expected))
    return [[*row, text] for row, text in zip(rows, expected, strict=True)]


def _measure(name: str, before: float, after: float | None, decimals: int) -> list[str]:
    return [name, format_fixed(before, decimals), "" if after is None else format_fixed(after, decimals)]


def unseen_rows(rows: Sequence[Candidate]) -> Rows:
    """Return name, power and 95 % limits of candidates that could hardly have been seen."""
    return [[row.name, f"{row.power:.2f}", limit_text(row, LIMITS) or "no limit"] for row in rows]


def correlation_rows(correlations: Sequence[TorqueCorrelation]) -> Rows:
    """Return torque component, series and correlation."""
    return [[item.component, item.series, format_signed(item.correlation, 2)] for item in correlations]
