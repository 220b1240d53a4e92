"""Report of the study."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bayesid._io.words import joined
from bayesid.report import Document, format_quantity
from bayesid.report.figures.figure_style import COLOURS, styled, wide_figure
from bayesid.report.numbers import format_fixed, format_number, format_percent, format_vector
from studies.common.ets7 import ACCEL, RATE
from studies.common.report_parts import columns
from studies.ets7_limits.figures import manoeuvre_figure
from studies.ets7_limits.setting import INTERVAL
from studies.separating.analysis import Result
from studies.separating.setting import DRIFT, SPREAD, STAGES, TRUTHS

__all__ = ["factor_figure", "write_report"]

RIVALRY = 2.2
"""Log Bayes factor by which a cause must exceed its one rival for a probability of 0.9, from which it is named."""

HIDDEN = {
    "wheel-momentum": f"a wheel momentum of {format_vector(TRUTHS['wheel-momentum'])} N m s",
    "thruster-leak": f"a leak's torque of {format_vector(1e3 * TRUTHS['thruster-leak'])} mN m",
}
"""Words for what is hidden."""


def write_report(result: Result, output: Path) -> None:
    """Write the report as PDF."""
    document = Document("Telling two causes apart", "A manoeuvre designed to separate rivals, ETS-VII in MuJoCo")
    document.section("Question and answer")
    document.paragraph(
        "Momentum left in the wheels of a base that drifts slowly makes a torque, rate × momentum, that is nearly "
        "constant. So does a leaking valve. On a small first manoeuvre the two look alike. A second manoeuvre was "
        "designed for the part of each signal that the other cannot imitate. MuJoCo hid one of the two, then the "
        "other, and the models were compared by their evidence, with base body and initial rates unknown."
    )
    for item in result.realised:
        before, other, after = (_range(item.factors[stage]) for stage in STAGES)
        document.paragraph(
            f"Hidden: {HIDDEN[item.truth]}. With the first manoeuvre alone, the log Bayes factor of the truth against "
            f"no cause is {_range(item.detected)} over {len(item.detected)} noises, and against the rival {before}, "
            f"where {RIVALRY} is required to name a cause. With the separating manoeuvre the latter is {after}, and "
            f"with a d-optimal manoeuvre of the same duration and limits {other}."
        )
    document.paragraph(_verdict(result))
    _factors(document, result)
    _directions(document, result)
    _pairs(document, result)
    _manoeuvres(document, result)
    _diagnosed(document, result)
    _assumed(document, result)
    document.write(output)


def _range(values: np.ndarray) -> str:
    mean, low, high = (format_fixed(value, 1) for value in (values.mean(), values.min(), values.max()))
    return f"{mean} on average ({low} to {high})"


def _verdict(result: Result) -> str:
    worse = [
        item.truth
        for item in result.realised
        if item.factors["first, separating"].mean() < item.factors["first, d-optimal"].mean()
    ]
    if not worse:
        return "Whichever cause is hidden, the d-optimal manoeuvre separates less than the separating one."
    return (
        f"Where {joined(worse)} is hidden, in the direction chosen here, the d-optimal manoeuvre separates more than "
        "the separating one. The criterion adds up the part of a rival's signal that cannot be imitated over all its "
        "parameters, so that a direction that is hard to see may be neglected. The section on other directions shows "
        "what holds over all of them."
    )


def _factors(document: Document, result: Result) -> None:
    document.section("Bayes factors, expected and realised")
    rows = []
    for item in result.realised:
        for stage, values in item.factors.items():
            expected = result.expected[item.truth, stage]
            cells = [
                expected.alone,
                expected.energy,
                expected.log_factor,
                values.mean(),
                values.std(ddof=1),
                expected.sd,
            ]
            above = f"{(values > RIVALRY).sum()} of {len(values)}"
            rows.append([item.truth, stage, *(format_fixed(float(cell), 1) for cell in cells), above])
    titles = ["λ", "λ(1−ρ²)/2", "expected ln B", "mean ln B", "sd ln B", "expected sd", f"ln B > {RIVALRY}"]
    document.table(
        ["hidden", "manoeuvres", *titles],
        rows,
        "λ is the energy of the hidden cause's signal in units of the noise, with base and initial rates "
        "marginalised; λ(1−ρ²) is the part that the rival cannot imitate. The expected log Bayes factor ln B adds the "
        "cost of each prior (the wheels have three parameters, the leak six) to λ(1−ρ²)/2; both are linear theory "
        "before the flight. Mean and standard deviation (sd) are over the noises, with evidences by Laplace's "
        "approximation.",
        columns("llrrrrrrr"),
    )
    document.figure(
        factor_figure(result),
        "Log Bayes factor of the truth against its rival: the value of each noise (points), and the mean expected by "
        f"linear theory with its standard deviation (bars). The grey line is {RIVALRY}.",
    )
    for truth, sampled in result.sampled.items():
        document.paragraph(
            f"Check of Laplace's approximation with {truth} hidden, on the first noise and the separating manoeuvre: "
            f"ln B is {format_fixed(sampled.laplace, 2)}, and by importance sampling "
            f"{format_quantity(sampled.sampled, sampled.error)} (Pareto k-hat {sampled.pareto_k:.2f})."
        )


def _directions(document: Document, result: Result) -> None:
    document.section("Other directions")
    document.table(
        ["hidden", "manoeuvres", "10 % quantile", "median", "90 % quantile", f"above {RIVALRY}"],
        [
            [*key, *_numbers(np.quantile(energies, [0.1, 0.5, 0.9]), 2), f"{(energies > RIVALRY).mean():.0%}"]
            for key, energies in result.directions.items()
        ],
        f"Predicted λ(1−ρ²)/2 of effects of the same size in {len(next(iter(result.directions.values())))} random "
        "directions.",
        columns("llrrrr"),
    )


def _numbers(values: Iterable[float], digits: int = 3) -> list[str]:
    return [format_number(float(value), digits) for value in values]


def _pairs(document: Document, result: Result) -> None:
    document.section("How the rivals were chosen")
    document.paragraph(
        "For every pair of five candidates the noncentrality on the first manoeuvre was computed, at the amplitudes "
        "of their priors and summed over their parameters: alone, and with the rival of any size marginalised. A leak "
        "and a drift of the rate sensor, or a leak and an accelerometer bias, are still more alike. Wheels and leak "
        "were chosen because a motion of the base decides between them: the torque of the wheels follows the rate, "
        "that of the leak does not. No manoeuvre was designed for the other pairs."
    )
    document.table(
        ["pair", "alone", "with the rival", "smaller remaining fraction"],
        [
            [
                *(" / ".join(texts) for texts in (pair.labels, _numbers(pair.alone), _numbers(pair.apart))),
                format_percent(pair.left, 2),
            ]
            for pair in result.pairs
        ],
        "Noncentralities on the first manoeuvre, the most alike pairs first.",
        columns("lrrr"),
    )


def _manoeuvres(document: Document, result: Result) -> None:
    document.section("The manoeuvres")
    document.paragraph(
        "The first manoeuvre is that of the flight: joints 2 to 4 move by 0.264, −0.321 and 0.057 rad, out and back. "
        "Both designed manoeuvres move all six joints on B-splines within 50 mm/s and 5 degrees per second at the "
        "tip; both searches began at the same random starts."
    )
    document.table(
        ["designed by", "sum λ(1−ρ²), weaker rival", "half log-determinant", "tip speed [mm/s]", "tip rate [deg/s]"],
        [
            [
                name,
                format_number(float(np.exp(-2.0 * item.costs["separation"]))),
                format_fixed(item.costs["d-optimal"], 1),
                format_fixed(1e3 * item.largest["tip_speed"], 1),
                format_fixed(float(np.degrees(item.largest["tip_rate"])), 1),
            ]
            for name, item in result.designs.items()
        ],
        "Both criteria of both manoeuvres, without the first manoeuvre: the first is to be large, the second small.",
        columns("lrrrr"),
    )
    document.figure(manoeuvre_figure(result.designs["separation"].trajectory), "The separating manoeuvre.")
    document.figure(manoeuvre_figure(result.designs["d-optimal"].trajectory), "The d-optimal manoeuvre.")


def _diagnosed(document: Document, result: Result) -> None:
    document.section("Verdict of the diagnosis")
    if not result.verdicts:
        document.paragraph("This section was not evaluated: the diagnosis was left out of this run.")
        return
    document.table(
        ["hidden", "manoeuvres", "status", "named", "ambiguous with"],
        [
            [*key, item.status, ", ".join(item.causes) or "—", "; ".join(item.others) or "—"]
            for key, item in result.verdicts.items()
        ],
        "The package's diagnosis on the first noise, with the five candidates of the study.",
    )
    document.paragraph(
        "The diagnosis has all five candidates to choose from, and the manoeuvre was designed for two of them. Where "
        "a leak and a drift of the rate sensor remain rivals, another manoeuvre would have to be designed for that "
        "pair."
    )


def _assumed(document: Document, result: Result) -> None:
    document.section("Assumptions")
    document.items(
        [
            f"Manoeuvres last {result.duration:g} s, with samples every {INTERVAL:g} s and {format_number(RATE)} "
            f"rad/s and {format_number(ACCEL)} m/s² of white noise. The joints and the attitude at the start are "
            "known exactly.",
            f"The base is unknown to a relative width of {100.0 * SPREAD:g} % (log-Cholesky), the arm is known "
            "exactly, and the gravity gradient is modelled. Every manoeuvre starts at a rate of "
            f"{format_vector(DRIFT)} rad/s, about a degree in a minute, which the fits do not know; the design knows "
            "it from the first manoeuvre. Wheels and leak are the same in both manoeuvres.",
            "Priors, per axis: 1 N m s of wheel momentum; 0.5 mN and 0.5 mN m of leak; 10⁻⁷ rad/s² of rate drift, 5 × "
            "10⁻⁵ rad/s of rate bias, and 2 × 10⁻⁵ m/s² of accelerometer bias. The hidden leak has no force. The true "
            "wheel momentum of ETS-VII is not public.",
        ]
    )


@styled
def factor_figure(result: Result) -> Figure:
    """Draw every log Bayes factor beside its expectation."""
    figure = wide_figure(2.5)
    for axes, item in zip(figure.subplots(1, len(result.realised)), result.realised, strict=True):
        place = np.arange(len(STAGES))
        expected = [result.expected[item.truth, stage] for stage in STAGES]
        means, sds = [each.log_factor for each in expected], [each.sd for each in expected]
        bars: dict[str, Any] = {"fmt": "s", "color": COLOURS[1], "markersize": 4, "capsize": 3}
        axes.errorbar(place - 0.15, means, sds, label="expected", **bars)
        realised = np.stack([item.factors[stage] for stage in STAGES])
        shift = np.linspace(0.05, 0.25, realised.shape[1])
        axes.plot((place[:, None] + shift).ravel(), realised.ravel(), ".", color=COLOURS[0], label="realised")
        axes.axhline(RIVALRY, color="#888888", linewidth=0.8)
        axes.set_xticks(place, [stage.replace(", ", ",\n") for stage in STAGES])
        axes.set(
            title=f"hidden: {item.truth}", ylabel="log Bayes factor", yscale="symlog", xlim=(-0.5, place[-1] + 0.5)
        )
        axes.set_yticks([-3, 0, 3, 10, 30, 100], ["−3", "0", "3", "10", "30", "100"])
        axes.grid(visible=False, axis="x")
        axes.legend(loc="upper left")
    return figure
