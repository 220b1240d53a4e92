"""Rows of a diagnosis report's tables."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis import Candidate, Diagnosis, Hypothesis
from bayesid.diagnosis.candidate_table import effect_amplitude
from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.report.diagnosis_advice import differing, imitation
from bayesid.report.numbers import format_number, format_quantity, format_unit
from bayesid.report.report_tables import prior_range
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import Prior, Quantity

__all__ = ["amplitude_text", "amplitudes_of", "cause_rows", "format_p"]

Rows = list[list[str]]
Amplitude = list[tuple[Quantity, float, float]]

SHOWN = 3
"""Quantities of one candidate that a table's cell holds."""

SEEN = 2.0
"""Standard deviations from zero above which an amplitude is given, and below which a limit."""

SMALLEST_P = 1e-12

INNER = ("frequency", "damping")
"""Quantities of a vibration that say nothing of its size, so that a limit on them would mislead."""


def format_p(value: float) -> str:
    """Return a p-value to two digits."""
    return "< 10⁻¹²" if value < SMALLEST_P else format_number(value, 2)


def amplitudes_of(hypothesis: Hypothesis, label: str) -> Amplitude:
    """Quantities, means and standard deviations of one cause of a hypothesis, all causes fitted together."""
    for index, effect in enumerate(hypothesis.fit.effects):
        if effect.label == label:
            mean, sd = effect_amplitude(hypothesis, index)
            return list(zip(effect.quantities, mean.tolist(), sd.tolist(), strict=False))
    fault = next(fault for fault in hypothesis.faults if fault.label == label)
    if label == "initial-rate":
        return _initial_rates(hypothesis)
    return list(zip(fault.quantities, fault.mean.tolist(), fault.sd.tolist(), strict=True))


def _initial_rates(hypothesis: Hypothesis) -> Amplitude:
    fit = hypothesis.fit
    posterior, sigma = fit.posterior, fit.posterior.unknowns.rate_sigma
    free = hypothesis.engine.free.tolist()
    spread = np.sqrt(np.diag(fit.covariance))
    found = []
    for place, name in enumerate(posterior.unknowns.names):
        if name.startswith("initial-rate[") and place in free:
            recording, axis = name.removeprefix("initial-rate[").split("].")
            key = f"{posterior.manoeuvres[int(recording)].recording.name}.{axis}"
            found.append(
                (Quantity(key, "rad/s"), float(sigma * fit.z[place]), float(sigma * spread[free.index(place)]))
            )
    return found


def amplitude_text(amplitude: Amplitude, shown: int | None = SHOWN) -> str:
    """Return an amplitude in words, with the unit behind every run of quantities that share it.

    Parameters
    ----------
    shown : int, optional
        Quantities given; of more, those furthest from zero in their standard deviations. All where left out.
    """
    chosen = list(amplitude)
    if shown is not None and len(chosen) > shown:
        furthest = sorted(chosen, key=lambda item: -_distance(item[1], item[2]))[:shown]
        chosen = [item for item in chosen if item in furthest]
    parts = []
    for place, ((key, unit), mean, sd) in enumerate(chosen):
        last = place + 1 == len(chosen) or chosen[place + 1][0].unit != unit
        behind = f" {format_unit(unit)}" if last and format_unit(unit) else ""
        parts.append(f"{key} {format_quantity(mean, sd)}{behind}")
    return ", ".join(parts)


def limit_text(row: Candidate, shown: int | None = SHOWN) -> str:
    """Return the sizes that a candidate's quantities stay below with 95 %, in magnitude."""
    whole = [
        (quantity, limit)
        for quantity, limit in zip(row.quantities, row.upper_limit.tolist(), strict=False)
        if quantity[0] not in INNER
    ]
    limits = whole[:shown]
    parts = []
    for place, ((key, unit), limit) in enumerate(limits):
        last = place + 1 == len(limits) or limits[place + 1][0].unit != unit
        behind = f" {format_unit(unit)}" if last and format_unit(unit) else ""
        parts.append(f"{key} < {format_number(limit, 2)}{behind}")
    return ", ".join(parts) + (", ..." if len(whole) > len(limits) else "")


def candidate_rows(rows: Sequence[Candidate], alarm: float) -> Rows:
    """Name, signal-to-noise, adjusted p-value, log Bayes factor, amplitude or limit, power, whether refitted."""
    found = []
    for row in rows:
        amplitude = list(zip(row.quantities, np.asarray(row.mean).tolist(), np.asarray(row.sd).tolist(), strict=False))
        size = ""
        if amplitude:
            seen = row.p_value_adjusted < alarm and any(_distance(mean, sd) > SEEN for _, mean, sd in amplitude)
            size = amplitude_text(amplitude) if seen else limit_text(row)
        found.append(
            [
                row.name,
                f"{row.signal_to_noise:.1f}",
                format_p(row.p_value_adjusted),
                "" if row.log_bayes_factor is None else signed(row.log_bayes_factor),
                size,
                "" if row.power is None else f"{row.power:.2f}",
                "refitted" if row.refitted else "linear",
            ]
        )
    return found


def hypothesis_rows(hypotheses: Sequence[Hypothesis], base: Hypothesis) -> Rows:
    """Causes, log Bayes factor against the present model, chi-square per sample, p-value left, worst test, verdict."""
    return [
        [
            " + ".join(hypothesis.labels) or "present model",
            signed(hypothesis.log_evidence - base.log_evidence) if hypothesis is not base else "0",
            f"{hypothesis.fit.chi2 / hypothesis.fit.posterior.samples:.3f}",
            format_p(hypothesis.outcome.p_value),
            hypothesis.outcome.worst,
            "yes" if hypothesis.adequate else "no",
        ]
        for hypothesis in hypotheses
    ]


def cause_rows(result: Diagnosis) -> Rows:
    """Cause, quantity, unit, prior, value and distance from zero for every named cause."""
    best, rows = result.after, []
    for label in best.labels:
        effect = next((effect for effect in best.fit.effects if effect.label == label), None)
        for index, ((key, unit), mean, sd) in enumerate(amplitudes_of(best, label)):
            if effect is not None:
                prior = prior_texts(effect)[index]
            elif label == "initial-rate":
                prior = f"0 ± {format_number(best.fit.posterior.unknowns.rate_sigma)}"
            else:
                prior = "none: estimated from the residual"
            distance = f"{_distance(mean, sd):.1f} sd" if sd > 0.0 else ""
            rows.append([f"{label}.{key}", format_unit(unit), prior, format_quantity(mean, sd), distance])
    return rows


def prior_texts(effect: Effect) -> list[str]:
    """Return the prior of each quantity of an effect: mean ± sd, or the central 68 % where it is not normal."""
    if type(effect).report is Effect.report and all(p.prior is Prior.NORMAL for p in effect.parameters):
        return [f"{format_number(p.mean)} ± {format_number(p.sigma)}" for p in effect.parameters]
    return [
        f"{format_number(low, 2)} to {format_number(high, 2)}" for low, high in zip(*prior_range(effect), strict=True)
    ]


def gain_rows(result: Diagnosis) -> Rows:
    """Measures of fit and prediction before and after."""
    before, after = result.gain.before, result.gain.after
    rows = [
        [
            "chi-square per sample",
            f"{before.chi2_per_sample:.3f}",
            f"{after.chi2_per_sample:.3f}",
            f"1 ± {math.sqrt(2.0 / result.before.fit.posterior.samples):.3f}",
        ],
        ["share of residuals within 1 σ", f"{before.inside:.3f}", f"{after.inside:.3f}", "0.683"],
    ]
    rows += [
        [f"rms residual of {name} [σ]", f"{value:.3f}", f"{after.rms[name]:.3f}" if name in after.rms else "", "1"]
        for name, value in before.rms.items()
    ]
    if before.held_out is not None and after.held_out is not None:
        names = [manoeuvre.recording.name for manoeuvre in result.before.fit.posterior.manoeuvres]
        rows += [
            [f"held-out log score of {name}", f"{one:.1f}", f"{two:.1f}", "higher is better"]
            for name, one, two in zip(names, before.held_out, after.held_out, strict=True)
        ]
        one, two = float(before.held_out.sum()), float(after.held_out.sum())
        rows.append(["held-out log score, sum", f"{one:.1f}", f"{two:.1f}", "higher is better"])
    return [[cell.replace("-", "−") if _numeric(cell) else cell for cell in row] for row in rows]


def shift_rows(result: Diagnosis) -> Rows:
    """Every inertial parameter before and after, its shift in standard deviations of before, the ratio of widths."""
    before, after = result.gain.before.bodies, result.gain.after.bodies
    units = list(BODY_QUANTITIES.values())
    return [
        [
            name,
            format_unit(units[k % len(units)]),
            format_quantity(before.mean[k], before.sd[k]),
            format_quantity(after.mean[k], after.sd[k]),
            signed(float(result.gain.shift[k])),
            f"{after.sd[k] / before.sd[k]:.3f}",
        ]
        for k, name in enumerate(before.names)
    ]


def rival_rows(result: Diagnosis, rivals: Sequence[Hypothesis]) -> Rows:
    """Rival, log Bayes factor of the best over it, what differs, and how like it looks."""
    best = result.verdict.best
    rows = []
    for rival in rivals:
        leader = best if best.labels else rivals[0]
        alike = imitation(leader, rival, result) if leader is not rival else None
        mine, theirs = differing(leader, rival)
        rows.append(
            [
                " + ".join(rival.labels),
                signed(leader.log_evidence - rival.log_evidence),
                format_p(rival.outcome.p_value),
                f"{', '.join(theirs) or 'nothing'} for {', '.join(mine) or 'nothing'}" if leader is not rival else "",
                "" if alike is None else f"{alike:.3f}",
            ]
        )
    return rows


def unseen_rows(rows: Sequence[Candidate]) -> Rows:
    """Name, power and 95 % limits of candidates that could not have been seen."""
    return [[row.name, f"{row.power:.2f}", limit_text(row, 6) or "no limit"] for row in rows]


def signed(value: float) -> str:
    """Return a number with its sign, to one decimal."""
    return f"{value:+.1f}".replace("-", "−")


def _distance(mean: float, sd: float) -> float:
    return abs(mean) / sd if sd > 0.0 else float("inf")


def _numeric(cell: str) -> bool:
    return cell.lstrip("-").replace(".", "", 1).isdigit()


def largest_shift(names: Sequence[str], shift: Floats) -> tuple[str, float] | None:
    """Return the inertial parameter that moved most, in standard deviations of before."""
    if len(shift) == 0:
        return None
    k = int(np.argmax(np.abs(shift)))
    return names[k], float(shift[k])
