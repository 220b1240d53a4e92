"""The study's report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from bayesid.report import Document
from bayesid.report.numbers import format_number
from studies.common.quantities import MASS
from studies.common.tables import add_number_table
from studies.sensors import rows, texts
from studies.sensors.figures import treatment_figure
from studies.sensors.montecarlo import (
    EQUAL,
    EXACT,
    LIKELIHOOD,
    PAPER,
    PIECES,
    VELOCITY,
    WEIGHTED,
    WHOLE,
    WITHOUT_JUNCTIONS,
    Spread,
)
from studies.sensors.result import REALISTIC, Result
from studies.sensors.rows import honesty_of, median_of, percent, rms_of, shift_of

__all__ = ["write_report"]

FINE = "2″, 1e-7, 1e-6"
"""Level at which the joints' treatment decides."""

PLANE = 0.02
"""Error that the paper quotes for the plane and expects in three dimensions."""

SPREAD = ["mass: bias", "shift", "sd", "moment: bias", "shift", "sd", "actual / stated", "chi²"]
"""Headings of bias, shift and standard deviation of an estimator."""

Tables = Mapping[str, Mapping[str, Spread]]


def write_report(result: Result, output: Path) -> None:
    """Write the report as PDF."""
    document = Document("Noise and sensor precision", "Section 4.3 of Lampariello and Hirzinger (2005), verified")
    _answer(document, result)
    _levels(document, result)
    _treated(document, "Joints, differentiated twice", texts.JOINTS, result.joints)
    _treated(document, "Rates", texts.RATES, result.rates, out=("polynomial",))
    _accelerometer(document, result)
    _regressed(document, result)
    _refits(document, result)
    document.section("Assumptions")
    document.items(texts.ASSUMPTIONS)
    document.paragraph(
        f"There are {result.effort.draws} sets of noise, which all levels share but for its size. The computation took "
        f"{result.seconds / 60.0:.0f} minutes."
    )
    document.write(output)


def _answer(document: Document, result: Result) -> None:
    document.section("Questions and answers")
    document.paragraph(texts.QUESTION)
    cells = []
    for level in result.levels:
        uses = result.accelerometers[level]
        shown = (result.joints[level][WITHOUT_JUNCTIONS], uses[WEIGHTED], uses[EQUAL], uses[PAPER])
        cells.append([level, *(f"{rms_of(spread, MASS)}; {rms_of(spread, spread.worst())}" for spread in shown)])
    add_number_table(
        document,
        ["noise", WITHOUT_JUNCTIONS, "joints exact, accelerations weighted", "joints exact, velocity: (21)", PAPER],
        cells,
        "Root mean square error of the mass; of the moment of inertia with the largest error. Errors are in percent of "
        "the true value. As in all tables in percent, brackets hold the Monte-Carlo error of the last digits. The data "
        "are one manoeuvre of 120 s at 2 Hz. Errors are to first order; where they are tens of percent, nonlinear fits "
        "may diverge (section 7).",
    )
    document.items(_findings(result))


def _findings(result: Result) -> list[str]:
    first = next(iter(result.levels))
    standard = REALISTIC if REALISTIC in result.levels else first
    return [
        _plane_finding(result, first),
        _integration_finding(result, first),
        _joint_finding(result.joints[standard], standard),
        *([_fine_finding(result.joints[FINE])] if FINE in result.levels else []),
        *([_linear_finding(result)] if result.regressions else []),
        f"Stated uncertainty. The ratio of actual to stated errors, over mass and moments, is at {standard} "
        f"{honesty_of(result.joints[standard][WITHOUT_JUNCTIONS])} for the {WITHOUT_JUNCTIONS}, "
        f"{honesty_of(result.accelerometers[standard][VELOCITY])} for the {VELOCITY}, and "
        f"{honesty_of(result.accelerometers[standard][EQUAL])} for (21).",
    ]


def _plane_finding(result: Result, level: str) -> str:
    likelihood, procedure = result.joints[level][WITHOUT_JUNCTIONS], result.accelerometers[level][PAPER]

    def times(spread: Spread) -> float:
        return float(spread.rms[spread.worst()] / PLANE)

    def manoeuvres(spread: Spread) -> str:
        return format_number(max(1.0, times(spread) ** 2), 2)

    text = (
        "The paper writes 'A similar error can be expected in three dimensions', which is 2 % for sigma 0.04. At "
        f"{level}, one manoeuvre gives the mass with an error of {rms_of(likelihood, MASS)} % and the worst moment "
        f"with {rms_of(likelihood, likelihood.worst())} % if the accelerometer is used as it reads, "
        f"{format_number(times(likelihood), 2)} times the error in the plane. The paper's procedure, as this study "
        f"reads it, gives {rms_of(procedure, MASS)} % and {rms_of(procedure, procedure.worst())} %, "
        f"{format_number(times(procedure), 2)} times the error in the plane. Noise averages: 2 % need about "
        f"{manoeuvres(likelihood)} such manoeuvres (or as many times the samples) in the former case, and "
        f"{manoeuvres(procedure)} in the latter, as far as its error is not bias."
    )
    if level not in result.refits:
        return text
    refits = result.refits[level][PAPER]
    k = refits.linear.worst()
    return (
        f"{text} These errors are to first order. Nonlinear fits by the paper's procedure diverge for "
        f"{int(refits.diverged.sum())} of {len(refits.diverged)} sets of noise; their median errors are "
        f"{median_of(refits.nonlinear, MASS)} % and {median_of(refits.nonlinear, k)} %, to first order "
        f"{median_of(refits.linear, MASS)} % and {median_of(refits.linear, k)} %."
    )


def _integration_finding(result: Result, level: str) -> str:
    uses = result.accelerometers[level]
    equal, weighted = uses[EQUAL], uses[WEIGHTED]
    k = equal.worst()
    ratio = equal.sd[k] / weighted.sd[k]
    error = ratio * np.hypot(*(spread.sd_error[k] / spread.sd[k] for spread in (equal, weighted)))
    biases = [format_number(100.0 * float(result.falsified[use].bias[MASS]), 2) for use in (EQUAL, WEIGHTED)]
    return (
        "Integration of the accelerometer, which the paper calls 'not yet analyzed', multiplies the standard deviation "
        f"of the worst moment by {percent(0.01 * ratio, 0.01 * error)} at {level} if least squares take the velocities "
        "for white and weight SI units equally. With the full covariance of the velocities nothing is lost: the "
        f"largest ratio of standard deviations is {(uses[WHOLE].sd / weighted.sd).max():.4f}. A constant bias of 10⁻⁴ "
        f"m/s² becomes a ramp and changes the mass by {biases[0]} % in (21), and by {biases[1]} % without integration. "
        "To make the bias an unknown costs next to nothing."
    )


def _joint_finding(spreads: Mapping[str, Spread], level: str) -> str:
    exact = spreads[EXACT]
    shifts = [f"{name} {shift_of(spread, exact, MASS)}" for name, spread in spreads.items() if name != EXACT]
    return (
        f"Joints differentiated twice. At {level} the treatments differ not in noise but in distortion. The noise of "
        "the base's sensors alone gives the mass a standard deviation of "
        f"{percent(exact.sd[MASS], exact.sd_error[MASS])} %. On the same noise, the treatments shift it by the "
        f"following percentages: {', '.join(shifts)}. With better accelerometers the difference grows (section 3)."
    )


def _fine_finding(spreads: Mapping[str, Spread]) -> str:
    cells = [
        f"{name} {rms_of(spread, MASS)} and {rms_of(spread, spread.worst())} % ({honesty_of(spread)} of what is stated)"
        for name, spread in spreads.items()
        if name in (EXACT, PIECES.title, LIKELIHOOD, WITHOUT_JUNCTIONS)
    ]
    return (
        f"At {FINE} the joints decide. The errors of mass and worst moment are: {'; '.join(cells)}. All other "
        "treatments are biased by more than they state. Near the junctions of (27) the package's smoother is biased "
        "too, unless those samples are left out; polynomials that know the junctions are better than it here."
    )


def _linear_finding(result: Result) -> str:
    level, regressions = next(iter(result.regressions.items()))
    name, best = min(regressions.items(), key=lambda item: float((item[1].errors[:, MASS] ** 2).mean()))
    raw, predicted, least = (
        format_number(100.0 * float(value), digits)
        for value, digits in (
            (regressions["differences"].errors[:, MASS].mean(), 3),
            (result.predicted[level][MASS], 3),
            (best.errors[:, MASS].mean(), 2),
        )
    )
    return (
        "The linear method (19), with the arm known, is not badly posed but biased, because the regressor is measured. "
        f"At {level} central differences give a mass that is wrong by {raw} % ({predicted} % in closed form). The best "
        f"treatment that was tried, {name}, leaves {least} %. More samples do not help. The integral method has no "
        "such bias."
    )


def _levels(document: Document, result: Result) -> None:
    document.section("Levels of noise")
    add_number_table(
        document,
        ["name", "rates [rad/s]", "accelerometer [m/s²]", "encoders [rad]"],
        rows.level_rows(result),
        "White noise per sample, in brackets its share of the signal's peak. The last names state star sensor, "
        "accelerometer [m/s²] and encoder [rad].",
    )
    for text in texts.LEVELS:
        document.paragraph(text)
    names = list(result.levels)
    chosen = dict.fromkeys((names[0], REALISTIC if REALISTIC in names else names[-1]))
    add_number_table(
        document,
        ["base", "true", *(part for name in chosen for part in (f"bias, {name}", "sd", "stated"))],
        rows.parameter_rows({name: result.joints[name][WITHOUT_JUNCTIONS] for name in chosen}),
        f"All ten parameters, {WITHOUT_JUNCTIONS}; ± is the Monte-Carlo error.",
    )


def _add_spreads(document: Document, tables: Tables, heading: str, caption: str, out: Sequence[str] = ()) -> None:
    """Add the figure of the chief levels and a table for every level."""
    shown = [name for name in tables if name in texts.SHOWN] or list(tables)[:1]
    document.figure(treatment_figure({name: tables[name] for name in shown}, out), caption)
    for name, spreads in tables.items():
        caption = f"Bias, shift and standard deviation (sd) at noise {name}, in percent."
        add_number_table(document, [heading, *SPREAD], rows.spread_rows(spreads), caption)


def _treated(document: Document, title: str, intro: Sequence[str], tables: Tables, out: Sequence[str] = ()) -> None:
    document.section(title)
    for text in intro:
        document.paragraph(text)
    caption = (
        "Bias (dot; the thick bar is its Monte-Carlo error) and standard deviation (thin bar) of the mass and of the "
        "moment with the largest error."
    )
    if out:
        caption += f" One treatment is far off and not shown: {', '.join(out)}."
    _add_spreads(document, tables, "treatment", caption, out)


def _accelerometer(document: Document, result: Result) -> None:
    document.section("The accelerometer: as it reads, or integrated")
    document.paragraph(texts.INTEGRAL[0])
    document.formula(
        '(op("var") A_v) / (op("var") A_a) = (integral_0^T s^2 dif t integral_0^T (integral_t^T S dif u)^2 dif t) '
        "/ (integral_0^T S^2 dif t)^2 = 3 quad (s = cos omega t), quad 6/5 quad (s = 1)"
    )
    for text in texts.INTEGRAL[1:]:
        document.paragraph(text)
    add_number_table(
        document,
        ["shape", "closed form", "matrices", "simulated", "full covariance", "A per bias", "matrices"],
        rows.scalar_rows(result),
        "One unknown: standard deviation with velocities taken for white, over that with accelerations; the same with "
        "the full covariance; and error of A per unit of constant bias.",
    )
    caption = "Bias and standard deviation as above, by use of the accelerometer. Joints are exact except in the last."
    _add_spreads(document, result.accelerometers, "use", caption)
    add_number_table(
        document,
        ["use", "bias of 10⁻⁴ m/s²", "trapezoidal rule"],
        rows.falsified_rows(result),
        "Errors without any noise [%]: mass / largest of the moments. The trapezoidal rule at 2 Hz integrates the "
        "data, which are compared with the exact velocity; there is no error where both are integrated alike. Errors "
        "are to first order, which does not hold for tens of percent. A bias that is unknown does no harm.",
    )


def _regressed(document: Document, result: Result) -> None:
    document.section("The linear method")
    for text in texts.LINEAR:
        document.paragraph(text)
    if result.regressions:
        add_number_table(
            document,
            ["noise", "treatment", "mass", "ixx", "iyy", "izz", "sd of mass", "unphysical"],
            rows.regression_rows(result),
            "Bias of the linear method [%], and number of its estimates that no physical body can have.",
            words=2,
        )


def _refits(document: Document, result: Result) -> None:
    document.section("Validity of the linearisation")
    if not result.refits:
        document.paragraph("This is not evaluated: only the full study has the nonlinear fits.")
        return
    document.paragraph(texts.REFITS)
    add_number_table(
        document,
        ["noise", "estimator", "diverged", "mass", "linear", "moment", "linear", "difference [sd]"],
        rows.refit_rows(result),
        "Median absolute errors [%] of nonlinear fits and of the linear estimator on the same noise, and largest "
        "median difference of mass and moments, in standard deviations. A fit diverged if mass or a moment is off by "
        "more than 100 %.",
        words=2,
    )
