"""The study's report."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bayesid.report import Document
from bayesid.report.figures.figure_style import COLOURS, styled, wide_figure
from bayesid.report.numbers import format_number
from studies.common.ets7 import ACCEL, RATE
from studies.ets7_limits.figures import manoeuvre_figure
from studies.ets7_limits.setting import INTERVAL
from studies.separating.analysis import STAGES, Result
from studies.separating.setting import DRIFT, SPREAD, TRUTHS

__all__ = ["factor_figure", "write_report"]

RIVALRY = 2.7
"""Log Bayes factor within which two causes are rivals."""

HIDDEN = {
    "wheel-momentum": f"a wheel momentum of ({', '.join(f'{v:g}' for v in TRUTHS['wheel-momentum'])}) N m s",
    "thruster-leak": f"a leak's torque of ({', '.join(f'{1e3 * v:g}' for v in TRUTHS['thruster-leak'])}) mN m",
}


def write_report(result: Result, output: Path) -> None:
    """Write the report as PDF."""
    document = Document("Telling two causes apart", "A manoeuvre designed to separate rivals, ETS-VII in MuJoCo")
    document.section("What was asked, and what came out")
    document.paragraph(
        "Momentum left in the wheels of a base that drifts slowly makes a torque, rate × momentum, that is nearly "
        "constant. So does a leaking valve. On a small first manoeuvre the two look alike. A second manoeuvre was "
        "designed for the signal of each that the other cannot imitate; MuJoCo hid one of the two, then the other, and "
        "the models were compared by their evidence, with base body and initial rates unknown."
    )
    for item in result.realised:
        before, after = item.factors["first alone"], item.factors["first, separating"]
        other = item.factors["first, d-optimal"]
        document.paragraph(
            f"Hidden: {HIDDEN[item.truth]}. The first manoeuvre sees that something is there: the log Bayes "
            "factor of the "
            f"truth against no cause is {item.detected.min():.1f} to {item.detected.max():.1f} over "
            f"{len(before)} noises. "
            f"Against the rival it is {_range(before)}, where 2.7 is asked for to name a cause. "
            "With the separating manoeuvre it is "
            f"{_range(after)}, with a d-optimal manoeuvre of the same duration and limits {_range(other)}."
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
    return f"{values.mean():.1f} on average ({values.min():.1f} to {values.max():.1f})".replace("-", "−")


def _verdict(result: Result) -> str:
    means = {(item.truth, stage): float(item.factors[stage].mean()) for item in result.realised for stage in STAGES}
    worse = [
        item.truth
        for item in result.realised
        if means[item.truth, "first, separating"] < means[item.truth, "first, d-optimal"]
    ]
    if not worse:
        return "Both ways the d-optimal manoeuvre separates less than the designed one."
    return (
        f"Not both ways is the designed manoeuvre the better one: where {' and '.join(worse)} is hidden, in the "
        "direction chosen here, the d-optimal one separates more. The criterion adds up what is left of a "
        "rival over all "
        "its parameters, so that a direction that happens to be hard to see may be left out; over all directions see "
        "below."
    )


def _factors(document: Document, result: Result) -> None:
    document.section("Bayes factors, predicted and realised")
    rows = []
    for item in result.realised:
        for stage, values in item.factors.items():
            own = result.expected[item.truth, stage]
            cells = [own.alone, own.energy, own.log_factor, values.mean(), values.std(ddof=1)]
            rows.append(
                [
                    item.truth,
                    stage,
                    *(f"{cell:.1f}".replace("-", "−") for cell in cells),
                    f"{np.sqrt(own.apart):.1f}",
                    f"{(values > RIVALRY).sum()} of {len(values)}",
                ]
            )
    document.table(
        [
            "hidden",
            "manoeuvres",
            "λ",
            "λ(1−ρ²)/2",
            "expected ln B",
            "mean ln B",
            "sd ln B",
            "expected sd",
            "ln B > 2.7",
        ],
        rows,
        "λ: energy of the hidden cause's signal in units of the noise, base and initial rates marginalised; "
        "λ(1−ρ²): what "
        "the rival cannot imitate. The expected ln B adds what each prior costs (the wheels have three parameters, the "
        "leak six) to λ(1−ρ²)/2; both are linear theory before the flight. Mean and standard deviation are over the "
        "noises, evidences by Laplace's approximation.",
        ["left", "left", *["right"] * 7],
    )
    document.figure(
        factor_figure(result),
        "Log Bayes factor of the truth against its rival: every noise (points), the "
        "mean expected by linear theory with its standard deviation (bars). The grey line is 2.7.",
    )
    for truth, found in result.sampled.items():
        document.paragraph(
            f"Check of Laplace's approximation, {truth} hidden, first noise, with the separating manoeuvre: "
            f"ln B = {found.laplace:.2f}, by importance sampling {found.sampled:.2f} ± {found.error:.2f} (Pareto k-hat "
            f"{found.pareto_k:.2f})."
        )


def _directions(document: Document, result: Result) -> None:
    document.section("Other directions")
    rows = []
    for (truth, stage), energies in result.directions.items():
        low, middle, high = np.quantile(energies, [0.1, 0.5, 0.9])
        rows.append(
            [
                truth,
                stage,
                *(format_number(float(v), 2) for v in (low, middle, high)),
                f"{(energies > RIVALRY).mean():.0%}",
            ]
        )
    document.table(
        ["hidden", "manoeuvres", "10 % quantile", "median", "90 % quantile", "above 2.7"],
        rows,
        f"λ(1−ρ²)/2, predicted, of effects of the same size in {len(next(iter(result.directions.values())))} random "
        "directions.",
        ["left", "left", *["right"] * 4],
    )


def _pairs(document: Document, result: Result) -> None:
    document.section("How the rivals were chosen")
    document.paragraph(
        "For every pair of five candidates the noncentrality on the first manoeuvre was computed, at the amplitudes of "
        "their priors and summed over their parameters: alone, and with the rival of any size marginalised. A leak "
        "and a drift of the rate sensor, or a leak and an accelerometer bias, are still more alike. Wheels and leak "
        "were taken because a motion of the base decides between them: the wheels' torque follows the rate, the "
        "leak's does not. No manoeuvre was designed for the other pairs."
    )
    document.table(
        ["pair", "alone", "with the rival", "least part left"],
        [
            [
                " / ".join(pair.labels),
                " / ".join(format_number(value) for value in pair.alone),
                " / ".join(format_number(value) for value in pair.apart),
                f"{format_number(100.0 * pair.left, 2)} %",
            ]
            for pair in result.pairs
        ],
        "Noncentralities on the first manoeuvre, the most alike pairs first.",
        ["left", "right", "right", "right"],
    )


def _manoeuvres(document: Document, result: Result) -> None:
    document.section("The manoeuvres")
    document.paragraph(
        "The first manoeuvre is that of the flight: joints 2 to 4 by 0.264, −0.321 and 0.057 rad, out and back. Both "
        "designed manoeuvres move all six joints on B-splines within 50 mm/s and 5 degrees per second at the tip; both "
        "searches began at the same random starts."
    )
    document.table(
        ["designed by", "sum λ(1−ρ²), weaker rival", "half log-determinant", "tip speed [mm/s]", "tip rate [deg/s]"],
        [
            [
                name,
                format_number(float(np.exp(-2.0 * item.costs["separation"]))),
                f"{item.costs['d-optimal']:.1f}".replace("-", "−"),
                *(
                    f"{scale * next(r.largest for r in item.reached if r.name == key):.1f}"
                    for key, scale in (("tip_speed", 1e3), ("tip_rate", 180.0 / np.pi))
                ),
            ]
            for name, item in result.designs.items()
        ],
        "Both criteria of both manoeuvres, each alone: the first is to be large, the second small.",
        ["left", *["right"] * 4],
    )
    document.figure(manoeuvre_figure(result.designs["separation"].trajectory), "The separating manoeuvre.")
    document.figure(manoeuvre_figure(result.designs["d-optimal"].trajectory), "The d-optimal manoeuvre.")


def _diagnosed(document: Document, result: Result) -> None:
    document.section("What the diagnosis says")
    if not result.verdicts:
        document.paragraph("Not evaluated: `diagnose` was not asked in this run.")
        return
    document.table(
        ["hidden", "manoeuvres", "status", "named", "rivals"],
        [
            [truth, stage, item.status, ", ".join(item.causes) or "—", "; ".join(item.rivals) or "—"]
            for (truth, stage), item in result.verdicts.items()
        ],
        "The package's diagnosis on the first noise, with the five candidates of the study.",
    )
    document.paragraph(
        "The diagnosis has all five candidates to choose from, and the manoeuvre was designed for two of them: where a "
        "leak and a drift of the rate sensor remain rivals, another manoeuvre would have to be designed for that pair."
    )


def _assumed(document: Document, result: Result) -> None:
    document.section("What was assumed")
    drift = ", ".join(f"{value:g}" for value in DRIFT)
    document.items(
        [
            f"Manoeuvres of {result.duration:g} s, samples each {INTERVAL:g} s with {format_number(RATE)} rad/s and "
            f"{format_number(ACCEL)} m/s² of white noise; joints and attitude at the start known exactly.",
            f"Base unknown to a relative width of {100.0 * SPREAD:g} % (log-Cholesky), arm known exactly, "
            "gravity gradient "
            f"modelled. Every manoeuvre starts at a rate of ({drift}) rad/s, about a degree in a minute, "
            "which the fits "
            "do not know; the design does, from the first manoeuvre. Wheels and leak are the same in both manoeuvres.",
            "Priors: 1 N m s of wheel momentum; 0.5 mN and 0.5 mN m of leak; 10⁻⁷ rad/s² of rate drift, "
            "5 × 10⁻⁵ rad/s of rate bias, 2 × 10⁻⁵ m/s² of accelerometer bias, per axis. The leak that is "
            "hidden has no "
            "force. ETS-VII's true wheel momentum is not public.",
        ]
    )


@styled
def factor_figure(result: Result) -> Figure:
    """Draw every log Bayes factor beside its expectation."""
    figure = wide_figure(2.5)
    for axes, item in zip(figure.subplots(1, len(result.realised)), result.realised, strict=True):
        for place, (stage, values) in enumerate(item.factors.items()):
            own = result.expected[item.truth, stage]
            axes.errorbar(
                place - 0.15,
                own.log_factor,
                np.sqrt(own.apart),
                color=COLOURS[1],
                marker="s",
                markersize=4,
                capsize=3,
                label="expected" if place == 0 else None,
            )
            shift = np.linspace(0.05, 0.25, len(values))
            axes.plot(
                place + shift,
                values,
                color=COLOURS[0],
                linestyle="",
                marker=".",
                label="realised" if place == 0 else None,
            )
        axes.axhline(RIVALRY, color="#888888", linewidth=0.8)
        axes.set_xticks(range(len(STAGES)), [stage.replace(", ", ",\n") for stage in item.factors])
        axes.set(
            title=f"hidden: {item.truth}", ylabel="log Bayes factor", yscale="symlog", xlim=(-0.5, len(STAGES) - 0.5)
        )
        axes.set_yticks([-3, 0, 3, 10, 30, 100], ["−3", "0", "3", "10", "30", "100"])
        axes.grid(visible=False, axis="x")
        axes.legend(loc="upper left")
    return figure
