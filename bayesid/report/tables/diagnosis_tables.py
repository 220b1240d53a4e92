"""Rows of a diagnosis report's tables."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bayesid.diagnosis import Candidate, Diagnosis, Hypothesis
from bayesid.diagnosis.cause_amplitudes import CauseAmplitude, amplitudes_of
from bayesid.diagnosis.rival_causes import differing, signal_cosine
from bayesid.diagnosis.wrench_correlations import TorqueCorrelation
from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.report.document import Rows
from bayesid.report.numbers import (
    format_fixed,
    format_number,
    format_p_value,
    format_quantity,
    format_signed,
    format_unit,
)
from bayesid.report.sentences.amplitude_words import amplitude_text, limit_text
from bayesid.report.tables.identification_tables import prior_range
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import Prior

__all__ = [
    "candidate_rows",
    "cause_rows",
    "correlation_rows",
    "gain_rows",
    "hypothesis_rows",
    "prior_texts",
    "rival_rows",
    "shift_rows",
    "unseen_rows",
]

LIMITS = 6
"""Largest number of limits in a cell of the table of candidates out of reach."""

SEEN = 2.0
"""Distance from zero, in standard deviations, above which an amplitude is given and below which a limit."""


def candidate_rows(rows: Sequence[Candidate], alarm: float) -> Rows:
    """Return name, signal-to-noise ratio, p-value, log Bayes factor, amplitude or limit, power, and way of evaluation.

    Parameters
    ----------
    rows : sequence of Candidate
    alarm : float
        Adjusted p-value below which a candidate is significant.
    """
    return [
        [
            row.name,
            format_fixed(row.signal_to_noise, 1),
            format_p_value(row.p_value_adjusted),
            "" if row.log_bayes_factor is None else format_signed(row.log_bayes_factor),
            _size_text(row, alarm),
            "" if row.power is None else format_fixed(row.power, 2),
            "refitted" if row.refitted else "linear",
        ]
        for row in rows
    ]


def _size_text(row: Candidate, alarm: float) -> str:
    amplitude = list(map(CauseAmplitude, row.quantities, np.asarray(row.mean).tolist(), np.asarray(row.sd).tolist()))
    seen = row.p_value_adjusted < alarm and any(item.distance > SEEN for item in amplitude)
    return amplitude_text(amplitude) if seen else limit_text(row)


def hypothesis_rows(hypotheses: Sequence[Hypothesis], base: Hypothesis) -> Rows:
    """Return causes, log Bayes factor over a base model, chi-square per sample, p-value, worst test, and adequacy."""
    return [
        [
            " + ".join(hypothesis.labels) or "present model",
            format_signed(hypothesis.log_evidence - base.log_evidence) if hypothesis is not base else "0",
            format_fixed(hypothesis.fit.chi2 / hypothesis.fit.posterior.samples, 3),
            format_p_value(hypothesis.outcome.p_value),
            hypothesis.outcome.worst,
            "yes" if hypothesis.adequate else "no",
        ]
        for hypothesis in hypotheses
    ]


def cause_rows(result: Diagnosis) -> Rows:
    """Return quantity, unit, prior, posterior, and distance from zero for every quantity of every named cause."""
    best = result.after
    return [
        [
            f"{label}.{item.quantity.name}",
            format_unit(item.quantity.unit),
            _prior_text(best, label, index),
            format_quantity(item.mean, item.sd),
            f"{format_fixed(item.distance, 1)} sd" if item.sd > 0.0 else "",
        ]
        for label in best.labels
        for index, item in enumerate(amplitudes_of(best, label))
    ]


def _prior_text(hypothesis: Hypothesis, label: str, index: int) -> str:
    effect = next((effect for effect in hypothesis.fit.effects if effect.label == label), None)
    if effect is not None:
        return prior_texts(effect)[index]
    if label == "initial-rate":
        return f"0 ± {format_number(hypothesis.fit.posterior.unknowns.rate_sigma)}"
    return "none: estimated from the residual"


def prior_texts(effect: Effect) -> list[str]:
    """Return the prior of each quantity of an effect: mean ± sd, or the central 68 % where it is not normal."""
    if type(effect).report is Effect.report and all(p.prior is Prior.NORMAL for p in effect.parameters):
        return [f"{format_number(p.mean)} ± {format_number(p.sigma)}" for p in effect.parameters]
    return [
        f"{format_number(low, 2)} to {format_number(high, 2)}" for low, high in zip(*prior_range(effect), strict=True)
    ]


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


def shift_rows(result: Diagnosis) -> Rows:
    """Return name, unit, value before and after, shift in standard deviations of before, and ratio of the widths."""
    before, after = result.gain.before.bodies, result.gain.after.bodies
    units = list(BODY_QUANTITIES.values())
    return [
        [
            name,
            format_unit(units[k % len(units)]),
            format_quantity(before.mean[k], before.sd[k]),
            format_quantity(after.mean[k], after.sd[k]),
            format_signed(float(result.gain.shift[k])),
            format_fixed(after.sd[k] / before.sd[k], 3),
        ]
        for k, name in enumerate(before.names)
    ]


def rival_rows(result: Diagnosis, rivals: Sequence[Hypothesis]) -> Rows:
    """Return rival, log Bayes factor of the best over it, p-value, what it has instead, and cosine of the signals."""
    best = result.verdict.best
    leader = best if best.labels else rivals[0]
    rows = []
    for rival in rivals:
        cosine = signal_cosine(leader, rival, result) if leader is not rival else None
        mine, theirs = differing(leader, rival)
        rows.append(
            [
                " + ".join(rival.labels),
                format_signed(leader.log_evidence - rival.log_evidence),
                format_p_value(rival.outcome.p_value),
                f"{', '.join(theirs) or 'nothing'} for {', '.join(mine) or 'nothing'}" if leader is not rival else "",
                "" if cosine is None else format_fixed(cosine, 3),
            ]
        )
    return rows


def unseen_rows(rows: Sequence[Candidate]) -> Rows:
    """Return name, power and 95 % limits of candidates that could hardly have been seen."""
    return [[row.name, f"{row.power:.2f}", limit_text(row, LIMITS) or "no limit"] for row in rows]


def correlation_rows(correlations: Sequence[TorqueCorrelation]) -> Rows:
    """Return torque component, series and correlation."""
    return [[item.component, item.series, format_signed(item.correlation, 2)] for item in correlations]
