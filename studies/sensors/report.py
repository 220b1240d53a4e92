"""The study's report."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from bayesid.report import Document
from bayesid.report.numbers import format_number
from studies.sensors import texts
from studies.sensors.figures import treatment_figure
from studies.sensors.montecarlo import ALIKE, EXACT, OURS, OURS_READ, PAPER, PIECES, VELOCITY, WEIGHTED, WHOLE, Spread
from studies.sensors.result import REALISTIC, Result
from studies.sensors.rows import (
    MASS,
    falsified_rows,
    honest,
    level_rows,
    median_of,
    parameter_rows,
    percent,
    refit_rows,
    regression_rows,
    rms_of,
    scalar_rows,
    shift_of,
    spread_rows,
    worst,
)

__all__ = ["write_report"]

FINE = "2″, 1e-7, 1e-6"
"""Level at which the joints' treatment decides."""

PLANE = 0.02
"""Error that the paper quotes for the plane and expects in three dimensions."""

SPREAD = ["mass: bias", "shift", "sd", "moment: bias", "shift", "sd", "actual / stated", "chi²"]


def write_report(result: Result, output: Path) -> None:
    """Write the report as PDF."""
    document = Document("Noise and sensor precision", "Section 4.3 of Lampariello and Hirzinger (2005), verified")
    _answer(document, result)
    _levels(document, result)
    _treated(document, "Joints, differentiated twice", texts.JOINTS, result.joints, ())
    _treated(document, "Rates", texts.RATES, result.rates, ("polynomial",))
    _accelerometer(document, result)
    _regressed(document, result)
    _refits(document, result)
    document.section("What was assumed")
    document.items(texts.ASSUMED)
    document.paragraph(
        f"{result.effort.draws} sets of noise at every level, the same unit noise at all of them; "
        f"{result.seconds / 60.0:.0f} minutes."
    )
    document.write(output)


def _answer(document: Document, result: Result) -> None:
    document.section("What was asked, and what came out")
    document.paragraph(texts.ASKED)
    rows = []
    for level in result.levels:
        ours, theirs = result.joints[level][OURS_READ], result.accelerometers[level][WEIGHTED]
        procedure = result.accelerometers[level][PAPER]
        integrated = result.accelerometers[level][ALIKE]
        cells = [f"{rms_of(own, MASS)}; {rms_of(own, worst(own))}" for own in (ours, theirs, integrated, procedure)]
        rows.append([level, *cells])
    document.table(
        ["noise", OURS_READ, "joints exact, accelerations weighted", "joints exact, velocity: (21)", PAPER],
        rows,
        "Root mean square error of the mass; of the moment of inertia with the largest. Percent of the true value, "
        "in brackets the Monte-Carlo error of the last digits, as in all tables in percent. One manoeuvre of 120 s at "
        "2 Hz. To first order: where tens of percent are given, "
        "nonlinear fits may run away (section 7).",
        ["left", *["right"] * 4],
    )
    document.items(_findings(result))


def _findings(result: Result) -> list[str]:
    first = next(iter(result.levels))
    ours, procedure = result.joints[first][OURS_READ], result.accelerometers[first][PAPER]
    uses = result.accelerometers[first]
    index = worst(uses[ALIKE])
    ratio = float(uses[ALIKE].sd[index] / uses[WEIGHTED].sd[index])
    ratio_error = ratio * float(
        np.hypot(*(own.sd_error[index] / own.sd[index] for own in (uses[ALIKE], uses[WEIGHTED])))
    )
    standard = REALISTIC if REALISTIC in result.levels else first
    falsified, plain = result.falsified[ALIKE].bias, result.falsified[WEIGHTED].bias
    found = [
        f"'A similar error can be expected in three dimensions', 2 % for sigma 0.04. At {first} the mass errs by "
        f"{rms_of(ours, MASS)} % and the worst moment by {rms_of(ours, worst(ours))} % after one manoeuvre if the "
        f"accelerometer is used as it reads, {_times(ours)} times the plane's figure; by the paper's own procedure, "
        f"as read here, by {rms_of(procedure, MASS)} % and {rms_of(procedure, worst(procedure))} %, "
        f"{_times(procedure)} times. Noise averages: the former needs about "
        f"{_manoeuvres(ours)} such manoeuvres (or as many times the samples) for 2 %, the latter "
        f"{_manoeuvres(procedure)}, as far as its error is not bias." + _nonlinear(result, first),
        "Integrating the accelerometer ('not yet analyzed') multiplies the standard deviation of the worst moment by "
        f"{percent(0.01 * ratio, 0.01 * ratio_error)} if least squares take the velocities for white and weigh SI "
        f"units alike, at {first}. With the velocities' whole covariance nothing is lost: the largest ratio of "
        f"standard deviations is {_largest_ratio(uses):.4f}. A constant bias of 10⁻⁴ m/s² becomes a ramp and falsifies "
        f"the mass by {format_number(100.0 * float(falsified[MASS]), 2)} % in (21), by "
        f"{format_number(100.0 * float(plain[MASS]), 1)} % without integration; making it an unknown costs next to "
        "nothing.",
        _joint_finding(result.joints[standard], standard),
        *([_fine_finding(result.joints[FINE])] if FINE in result.levels else []),
    ]
    if result.regressions:
        level = next(iter(result.regressions))
        best = min(result.regressions[level].items(), key=lambda item: float((item[1].errors[:, MASS] ** 2).mean()))
        raw = result.regressions[level]["differences"].errors[:, MASS].mean()
        found.append(
            "The linear method (19), with the arm known, is not badly posed but biased, because the regressor is "
            f"measured: at {level} central differences give a mass wrong by {format_number(100.0 * float(raw), 3)} % "
            f"({format_number(100.0 * float(result.predicted[level][MASS]), 3)} % in closed form); the best treatment "
            f"tried, {best[0]}, still by {format_number(100.0 * float(best[1].errors[:, MASS].mean()), 2)} %. More "
            "samples do not help. The integral method has no such bias."
        )
    found.append(
        "Honesty: what estimators state against what they err, over mass and moments, at "
        f"{standard}: {OURS_READ} {honest(result.joints[standard][OURS_READ])}, {VELOCITY} "
        f"{honest(result.accelerometers[standard][VELOCITY])}, (21) {honest(result.accelerometers[standard][ALIKE])}."
    )
    return found


def _times(spread: Spread) -> str:
    return format_number(float(spread.rms[worst(spread)] / PLANE), 2)


def _manoeuvres(spread: Spread) -> str:
    return format_number(float(max(1.0, (spread.rms[worst(spread)] / PLANE) ** 2)), 2)


def _largest_ratio(uses: Mapping[str, Spread]) -> float:
    return float((uses[WHOLE].sd / uses[WEIGHTED].sd).max())


def _joint_finding(spreads: Mapping[str, Spread], level: str) -> str:
    exact = spreads[EXACT]
    shifts = [f"{name} {shift_of(own, exact, MASS)}" for name, own in spreads.items() if name != EXACT]
    return (
        f"Joints differentiated twice: at {level} what separates the treatments is not noise but distortion. The noise "
        f"of the base's sensors alone gives the mass a standard deviation of "
        f"{percent(float(exact.sd[MASS]), float(exact.sd_error[MASS]))} %; the treatments shift it, on the same noise, "
        f"by [%]: {', '.join(shifts)}. With better accelerometers the difference grows (section 3)."
    )


def _nonlinear(result: Result, level: str) -> str:
    if level not in result.refits:
        return ""
    own = result.refits[level][PAPER]
    k = worst(own.linear)
    return (
        f" All to first order; nonlinear fits by that procedure run away in {int(own.runaway.sum())} of "
        f"{len(own.runaway)} draws, and their median errors are {median_of(own.nonlinear, MASS)} % and "
        f"{median_of(own.nonlinear, k)} %, to first order {median_of(own.linear, MASS)} % and "
        f"{median_of(own.linear, k)} %."
    )


def _fine_finding(spreads: Mapping[str, Spread]) -> str:
    cells = [
        f"{name} {rms_of(own, MASS)} and {rms_of(own, worst(own))} % ({honest(own)} of what is stated)"
        for name, own in spreads.items()
        if name in (EXACT, PIECES.title, OURS, OURS_READ)
    ]
    return (
        f"At {FINE} the joints decide. Errors of mass and worst moment: {'; '.join(cells)}. All other treatments are "
        "biased by more than they state. Where (27) meets its splines the package's smoother is biased too, "
        "unless those samples are left unread; polynomials that know the place are better than it here."
    )


def _levels(document: Document, result: Result) -> None:
    document.section("Noise looked at")
    document.table(
        ["name", "rates [rad/s]", "accelerometer [m/s²]", "encoders [rad]"],
        level_rows(result),
        "White noise per sample, in brackets its share of the signal's peak. Names of the last are star sensor, "
        "accelerometer [m/s²], encoder [rad].",
        ["left", "right", "right", "right"],
    )
    for text in texts.LEVELS:
        document.paragraph(text)
    first = next(iter(result.levels))
    chosen = {name: result.joints[name][OURS_READ] for name in dict.fromkeys((first, list(result.levels)[-1]))}
    if REALISTIC in result.levels:
        chosen = {name: result.joints[name][OURS_READ] for name in (first, REALISTIC)}
    document.table(
        ["base", "true", *(part for name in chosen for part in (f"bias, {name}", "sd", "stated"))],
        parameter_rows(chosen),
        f"All ten parameters, {OURS_READ}; ± Monte-Carlo error.",
        ["left", *["right"] * (1 + 3 * len(chosen))],
    )


def _treated(
    document: Document,
    title: str,
    intro: tuple[str, ...],
    tables: Mapping[str, Mapping[str, Spread]],
    out: tuple[str, ...],
) -> None:
    document.section(title)
    for text in intro:
        document.paragraph(text)
    shown = [name for name in tables if name in (*texts.SHOWN,)] or list(tables)[:1]
    document.figure(
        treatment_figure({name: tables[name] for name in shown}, out),
        "Bias (dot; thick bar: its Monte-Carlo error) and standard deviation (thin bar) of mass and of the moment with "
        "the largest error." + (f" Left out because it is far off: {', '.join(out)}." if out else ""),
    )
    for name, spreads in tables.items():
        document.table(
            ["treatment", *SPREAD], spread_rows(spreads), f"Noise {name}. Percent.", ["left", *["right"] * 8]
        )


def _accelerometer(document: Document, result: Result) -> None:
    document.section("The accelerometer: as it reads, or integrated")
    document.paragraph(texts.INTEGRAL[0])
    document.formula(
        '(op("var") A_v) / (op("var") A_a) = (integral_0^T s^2 dif t integral_0^T (integral_t^T S dif u)^2 dif t) '
        "/ (integral_0^T S^2 dif t)^2 = 3 quad (s = cos omega t), quad 6/5 quad (s = 1)"
    )
    for text in texts.INTEGRAL[1:]:
        document.paragraph(text)
    document.table(
        ["shape", "closed form", "matrices", "simulated", "whole covariance", "A per bias", "matrices"],
        scalar_rows(result),
        "One unknown: standard deviation by velocities taken for white, over that by accelerations; with the whole "
        "covariance; and error of A per unit of constant bias.",
        ["left", *["right"] * 6],
    )
    uses = result.accelerometers
    shown = [name for name in uses if name in texts.SHOWN] or list(uses)[:1]
    document.figure(
        treatment_figure({name: uses[name] for name in shown}),
        "The same for all uses of the accelerometer. Joints exact, but for the last.",
    )
    for name, spreads in uses.items():
        document.table(["use", *SPREAD], spread_rows(spreads), f"Noise {name}. Percent.", ["left", *["right"] * 8])
    document.table(
        ["use", "bias of 10⁻⁴ m/s²", "trapezoidal rule"],
        falsified_rows(result),
        "Errors without any noise [%]: mass / largest of the moments. Trapezoidal rule: the data's integral by that "
        "rule at 2 Hz, compared with the exact velocity; none where both are integrated alike. To first order, which "
        "errors of tens of percent are beyond. Where the bias is unknown it does no harm.",
        ["left", "right", "right"],
    )


def _regressed(document: Document, result: Result) -> None:
    document.section("The linear method")
    for text in texts.LINEAR:
        document.paragraph(text)
    if result.regressions:
        document.table(
            ["noise", "treatment", "mass", "ixx", "iyy", "izz", "sd of mass", "unphysical"],
            regression_rows(result),
            "Bias of the linear method [%]; how many of its estimates are no physical body.",
            ["left", "left", *["right"] * 6],
        )


def _refits(document: Document, result: Result) -> None:
    document.section("Is the linearisation valid?")
    if not result.refits:
        document.paragraph("Not evaluated: only the full study has the nonlinear fits.")
        return
    document.paragraph(texts.REFITS)
    document.table(
        ["noise", "estimator", "ran away", "mass", "linear", "moment", "linear", "apart [sd]"],
        refit_rows(result),
        "Median absolute errors [%] of nonlinear fits and of the linear estimator on the same draws; largest median "
        "difference of mass and moments, in standard deviations. Ran away: mass or a moment off by more than 100 %.",
        ["left", "left", *["right"] * 6],
    )
