"""The study's report."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bayesid._io.words import joined
from bayesid.report import Document
from bayesid.report.figures import robot_pose
from bayesid.report.numbers import format_fixed, format_percent, format_range, format_text
from studies.base_body import paper
from studies.common.ets7 import ACCELEROMETER, INTERVAL, POSES, TIP_SPEED, ets7, tip_speed
from studies.common.quantities import JUDGED, MASS
from studies.common.report_parts import columns
from studies.common.study import (
    TRIALS,
    CsvTable,
    Finding,
    Goal,
    Picture,
    Report,
    Setup,
    Severity,
    Statement,
    Study,
    Verdict,
)
from studies.sensors import tables
from studies.sensors.checks import SmoothingErrors
from studies.sensors.estimators import EQUAL, EXACT, LIKELIHOOD, PAPER, WEIGHTED, WHOLE, WITHOUT_JUNCTIONS, Spread
from studies.sensors.result import REALISTIC, Result, run
from studies.sensors.signals import motion

PLANE = 0.02  # error that the paper quotes for the plane and expects in three dimensions

# ratio of actual to stated errors that counts as honest; its Monte-Carlo error with 48 sets of noise is 0.1
HONEST = (0.75, 1.33)

LOSS = 1.01  # largest ratio of standard deviations at which nothing counts as lost
SHOWN = ("0.04 deg/s", REALISTIC, "2″, 1e-7, 1e-6")  # titles of the columns of estimates beside the report
SPREAD = ["bias", "bias error", "sd", "sd error", "rms", "rms error", "stated sd", "actual over stated"]

# levels of noise at which all treatments are drawn


def _report(result: Result) -> Report[Result]:
    planned = motion()
    fastest, _ = tip_speed(planned, planned.duration)
    haste = f"{format_fixed(fastest / TIP_SPEED, 1)} times as fast as the flight rule permits"
    return Report(
        title="Noise and sensor precision",
        subtitle="Section 4.3 of Lampariello and Hirzinger (IDETC 2005)",
        question="Section 4.3 expects an error of 2 % in three dimensions, as its reference had in the plane with "
        "noise of sigma 0.04. It names sensors, but not the effect of integrating the accelerometer. How do noise and "
        "sensors affect the identified base?",
        answer=_answer(result),
        valid=f"the arm is known exactly, the tip moves {haste}, noise is white and independent, and the initial "
        "attitude is known. Errors are to first order about the truth, checked by nonlinear fits.",
        goals=_goals(result),
        full=bool(result.refits),
        figure=Picture(
            tables.level_figure(result),
            "Root mean square error of mass and worst moment after one manoeuvre, by level of noise, over "
            f"{result.effort.draws} sets of noise (bars: Monte-Carlo error). The last labels give star tracker, "
            "accelerometer [m/s²] and encoder [rad]. Grey: the paper's 2 %. The likelihood is the package's.",
        ),
        setup=Setup(
            robot="ETS-VII with the paper's base and a public arm, flown by an independent simulator (MuJoCo).",
            manoeuvre=f"The paper's optimum of (26) in {planned.duration:.0f} s, as in the report on the base body. "
            f"The tip moves at {1e3 * fastest:.0f} mm/s, {haste}: errors at the permitted speed are larger (report "
            "on the base body).",
            sensors=f"Rates, accelerometer at {ACCELEROMETER} m and encoders, white noise every {INTERVAL:g} s. The "
            f"paper's sigmas {paper.SIGMAS[0]:g} and {paper.SIGMAS[1]:g} have no unit; both reports read them as "
            "degrees per second for the rates and degrees for the joints; the accelerometer's sigma is the same "
            "fraction of its peak signal as that of the rates is of the peak rate, and “4 % of peak” is that fraction. "
            "'2″' is a star tracker whose attitude is differentiated; its noise is taken as white.",
            known="Orbit, arm and initial attitude. There is no prior.",
            unknown="Ten parameters of the base and the initial rate.",
            replicates=f"{result.effort.draws} sets of noise, the same at all levels except for its size; "
            f"{len(result.levels)} levels, {len(next(iter(result.joints.values())))} treatments of the joints.",
        ),
        picture=Picture(
            robot_pose(ets7(), planned, POSES),
            "The robot at four instants of the paper's manoeuvre: at rest, and in half of an oscillation.",
        ),
        sections=[_negatives, _evidence],
        statements=_statements(result),
        tables=[
            CsvTable("estimates", ["treated", "noise", "treatment", "quantity", *SPREAD], tables.estimate_rows(result)),
            CsvTable(
                "linear",
                ["noise", "treatment", "quantity", "bias", "bias error", "closed form"],
                tables.linear_rows(result),
            ),
            CsvTable(
                "fits",
                ["noise", "estimator", "fits", "diverged", "median error of mass", "linear", "largest difference [sd]"],
                tables.refit_rows(result),
            ),
        ],
        beside="Tables with this report, relative to the truth: every estimator at every level, for joints, rates and "
        "accelerometer ({0}), the linear method ({1}), and the nonlinear fits ({2}).",
    )


def _first(result: Result) -> str:
    return next(iter(result.levels))


def _standard(result: Result) -> str:
    return REALISTIC if REALISTIC in result.levels else _first(result)


def _both(spread: Spread) -> float:
    """Return the larger root mean square error of mass and worst moment."""
    return float(max(spread.rms[MASS], spread.rms[spread.worst()]))


def _answer(result: Result) -> str:
    level = _first(result)
    best = result.joints[level][LIKELIHOOD]
    mass, moment = tables.equal_rms(result, level, PAPER)
    return (
        f"With noise of {level} one manoeuvre determines the mass to {tables.rms_of(best, MASS)} %; the paper expects "
        f"2 %. The least well determined moment of inertia follows to {tables.rms_of(best, best.worst())} % (brackets: "
        "Monte-Carlo error of the last digits). Both are results of the package's likelihood; the paper's procedure "
        f"gives {mass} % and {moment} %."
    )


def _goals(result: Result) -> list[Goal]:
    likelihood = {name: spreads[LIKELIHOOD] for name, spreads in result.joints.items()}
    loss = max(float((uses[WHOLE].sd / uses[WEIGHTED].sd)[JUDGED].max()) for uses in result.accelerometers.values())
    better = [name for name, spread in likelihood.items() if _both(spread) <= _both(result.accelerometers[name][PAPER])]
    return [
        Goal(
            "the package's likelihood has smaller errors than the paper's procedure at every level",
            f"at {len(better)} of {len(likelihood)} levels",
            Verdict.of(len(better) == len(likelihood)),
            Severity.MEDIUM,
        ),
        _honest("the package's likelihood", likelihood),
        Goal(
            "integrating the accelerometer loses no information if its full covariance is used (ratio of sd at most "
            f"{LOSS:g})",
            format_fixed(loss, 4),
            Verdict.of(loss <= LOSS),
            Severity.MEDIUM,
        ),
    ]


def _honest(name: str, spreads: dict[str, Spread]) -> Goal:
    ratios = np.array([spread.honesty[JUDGED] for spread in spreads.values()])
    errors = ratios * np.array([(spread.rms_error / spread.rms)[JUDGED] for spread in spreads.values()])
    inside = [level for level, row in zip(spreads, ratios, strict=True) if _is_honest(row)]
    outside = [level for level in spreads if level not in inside]
    reached = f"{format_range(ratios.ravel(), 2)}; {len(inside)} of {len(spreads)} levels"
    return Goal(
        f"actual over stated errors of mass and moments between {HONEST[0]:g} and {HONEST[1]:g} at every level: {name}",
        reached + (f"; not at {format_text('; '.join(outside))}" if outside else ""),
        _judged(ratios, errors),
        Severity.HIGH,
    )


def _judged(ratios: np.ndarray, errors: np.ndarray) -> Verdict:
    """Return whether ratios are within `HONEST`, given their Monte-Carlo errors."""
    low, high = ratios - errors, ratios + errors
    if ((high < HONEST[0]) | (low > HONEST[1])).any():
        return Verdict.FAIL
    return Verdict.PASS if _is_honest(low) and _is_honest(high) else Verdict.OPEN


def _is_honest(ratios: np.ndarray) -> bool:
    return bool(((ratios >= HONEST[0]) & (ratios <= HONEST[1])).all())


def _over_levels(result: Result, name: str) -> str:
    """Return the range of the ratios of actual to stated errors over all levels of noise."""
    return format_range(np.concatenate([spreads[name].honesty[JUDGED] for spreads in result.joints.values()]), 2)


def _ratios(spreads: Mapping[str, Spread]) -> np.ndarray:
    return spreads[LIKELIHOOD].honesty[JUDGED]


def _negatives(document: Document, result: Result) -> None:
    document.section("Failures, and validity of the numbers")
    level, standard = _first(result), _standard(result)
    uses, falsified = result.accelerometers[level], result.falsified
    equal, weighted = uses[EQUAL], uses[WEIGHTED]
    k = equal.worst()
    ratio = float(equal.sd[k] / weighted.sd[k])
    error = ratio * float(np.hypot(*(spread.sd_error[k] / spread.sd[k] for spread in (equal, weighted))))
    texts = [
        "The package's likelihood: at the junctions of the motion, Eq. (27), the third derivative of the joint angles "
        "jumps, and a jump that the samples do not resolve can bias the smoother. The ratio of actual to stated errors "
        f"is {tables.honesty_of(result.joints[standard][LIKELIHOOD])} at {format_text(standard)} with the samples near "
        f"the junctions and {tables.honesty_of(result.joints[standard][WITHOUT_JUNCTIONS])} without them (over all "
        f"levels: {_over_levels(result, LIKELIHOOD)} and {_over_levels(result, WITHOUT_JUNCTIONS)}).",
        *(_failing(result, name) for name, spreads in result.joints.items() if not _is_honest(_ratios(spreads))),
        "If the accelerometer is integrated as in Eq. (21), with equally weighted velocities that are taken as white, "
        f"the worst moment is {tables.percent(0.01 * ratio, 0.01 * error)} times as uncertain, and a constant bias of "
        f"10⁻⁴ m/s² changes the mass by {format_percent(abs(float(falsified[EQUAL][MASS])), 2)} (without integration: "
        f"{format_percent(abs(float(falsified[WEIGHTED][MASS])), 2)}). For one unknown, the variance is 3 times that "
        f"of the accelerations in closed form (computed: {format_fixed(result.scalars[0].matrices ** 2, 2)}).",
    ]
    if result.regressions:
        texts.append(_linear(result))
    texts.append(_refits(result))
    document.items(texts)


def _linear(result: Result) -> str:
    level, regressions = next(iter(result.regressions.items()))
    name, best = min(regressions.items(), key=lambda regression: float((regression[1][:, MASS] ** 2).mean()))
    raw, closed, least = (
        format_percent(float(value), digits)
        for value, digits in (
            (regressions["differences"][:, MASS].mean(), 3),
            (result.predicted[level][MASS], 3),
            (best[:, MASS].mean(), 2),
        )
    )
    return (
        f"The linear method, Eq. (19), is biased because its regressor is measured. At {level} central differences "
        f"give a mass error of {raw} ({closed} in closed form), and the best treatment ({name}) gives {least}. More "
        "samples do not reduce the bias."
    )


def _refits(result: Result) -> str:
    if not result.refits:
        return "The first-order approximation was not tested: only the full study has nonlinear fits."
    diverged = [
        f"{int(refits.diverged.sum())} of {len(refits.diverged)} at {format_text(level)}"
        for level, procedures in result.refits.items()
        for refits in (procedures[PAPER],)
    ]
    gap = max(float(procedures[LIKELIHOOD].difference[JUDGED].max()) for procedures in result.refits.values())
    rough = [format_text(level) for level in result.refits if tables.diverging(result, level)]
    consequence = f", so its errors at {joined(rough)} are only orders of magnitude" if rough else ""
    return (
        f"Nonlinear fits: with the paper's procedure {'; '.join(diverged)} diverge{consequence}. With the likelihood "
        f"they differ from first order by a median of at most {format_fixed(gap, 2)} sd."
    )


def _smoothed(errors: SmoothingErrors) -> str:
    """Return why the errors of smoothed joints are overstated."""
    measured, expected = (
        joined([format_fixed(float(value), 2) for value in values]) for values in (errors.measured, errors.expected)
    )
    return (
        "The reason: the stated errors allow for encoder noise that passes the smoother and for real motion that it "
        "removes; this motion is smoother than the smoother's model assumes, so the second part is overstated. Errors "
        f"of position, velocity and acceleration are {measured} times the stated ones. If only noise passed, they "
        f"would be {expected} times, √(1 − (2d + 1)/(2p)) for derivative d and a process of order p. Away from the "
        "junctions the stated errors are therefore too large, not too small."
    )


def _failing(result: Result, level: str) -> str:
    """Return what is seen of the cause at a level where the likelihood does not state its errors rightly."""
    spread, exact = result.joints[level][LIKELIHOOD], result.joints[level][EXACT]
    text = (
        f"At {format_text(level)} the likelihood's errors are {tables.honesty_of(spread)} times the stated ones, with "
        f"a chi-square per degree of freedom of {format_fixed(float(spread.chi2.mean()), 2)}."
    )
    if not _is_honest(exact.honesty[JUDGED]):
        return f"{text} The stated errors are wrong with exact joints too; the cause is not known."
    share = float((exact.rms[JUDGED] / spread.rms[JUDGED]).max())
    return (
        f"{text} With exact joints the ratio is {tables.honesty_of(exact)}, and the errors are "
        f"at most {format_percent(share, 1)} of those with measured joints; it is the propagated encoder noise that is "
        f"misstated. {_smoothed(result.smoothing[level])}"
    )


def _evidence(document: Document, result: Result) -> None:
    document.section("Evidence")
    names = (EXACT, LIKELIHOOD, WITHOUT_JUNCTIONS)
    document.table(
        [
            "noise",
            *(name if name != EXACT else "exact joints" for name in names),
            "exact joints, Eq. (21)",
            PAPER,
        ],
        [
            [
                format_text(level),
                *(tables.rms_pair(result.joints[level][name]) for name in names),
                *("; ".join(tables.equal_rms(result, level, name)) for name in (EQUAL, PAPER)),
            ]
            for level in result.levels
        ],
        "Root mean square errors of the mass; of the worst moment [%]. Brackets give the Monte-Carlo error of the last "
        "digits; “about” marks levels at which nonlinear fits with the paper's procedure diverge.",
        columns("lrrrrr"),
    )
    standard = _standard(result)
    document.table(
        ["treatment of the joints", "mass: bias", "sd", "moment: bias", "sd", "actual / stated"],
        tables.treatment_rows(result, standard),
        f"Treatments of the joints at {format_text(standard)}, rates and accelerations not filtered [%]. Actual over "
        "stated errors are ranges over mass and moments; a calibrated treatment has 1.",
        columns("lrrrrr"),
    )
    shown = {name: result.joints[name] for name in SHOWN if name in result.joints}
    document.figure(
        tables.treatment_figure({format_text(name): spreads for name, spreads in shown.items()}),
        "Bias (dot; the thick bar is its Monte-Carlo error) and standard deviation (thin bar) of the mass and of the "
        "worst moment, by treatment of the joints.",
    )


def _statements(result: Result) -> list[Statement]:
    level, standard = _first(result), _standard(result)
    likelihood, procedure = result.joints[level][LIKELIHOOD], result.accelerometers[level][PAPER]
    treated = result.joints[standard]
    raw = treated["differences"]
    honest = [name for name, spread in treated.items() if _is_honest(spread.honesty[JUDGED]) and name != EXACT]
    sds = [float(result.joints[name][LIKELIHOOD].rms[MASS]) for name in result.levels]
    return [
        Statement(
            "An error similar to 2 % can be expected in three dimensions after the same procedure.",
            Finding.CONFIRMED if _both(procedure) <= PLANE else Finding.REFUTED,
            f"With sigma read as above, the error of the worst moment after one manoeuvre is "
            f"{tables.equal_rms(result, level, PAPER)[1]} % with the paper's procedure, and "
            f"{tables.rms_of(likelihood, likelihood.worst())} % with the package's likelihood. "
            f"{_averaged(result.joints[level][EXACT], likelihood)}",
        ),
        Statement(
            "The accelerometer's signal must be integrated.",
            Finding.REFUTED,
            "Integration is not necessary. It loses nothing with the full covariance, and much without it.",
        ),
        Statement(
            "Differentiating the joints twice can be improved by filtering.",
            Finding.CONFIRMED if len(honest) and not _is_honest(raw.honesty[JUDGED]) else Finding.REFUTED,
            f"At {format_text(standard)} the errors of central differences are {tables.honesty_of(raw)} times the "
            f"stated errors. Calibrated treatments: {joined(honest) or 'none'}.",
        ),
        Statement(
            "The precision of the sensors is very important.",
            Finding.CONFIRMED if max(sds) > 2.0 * min(sds) else Finding.REFUTED,
            f"The error of the mass is {format_percent(max(sds), 2)} to {format_percent(min(sds), 2)} over the levels.",
        ),
    ]


def _averaged(exact: Spread, likelihood: Spread) -> str:
    """Return how many manoeuvres average to 2 %, by errors over drawn noise and by stated deviations."""
    worst = max((MASS, likelihood.worst()), key=lambda index: float(likelihood.rms[index]))
    count = max(1.0, float(likelihood.rms[worst] / PLANE) ** 2)
    error = 2.0 * count * float(likelihood.rms_error[worst] / likelihood.rms[worst])
    stated = float(np.sqrt((exact.stated[:, JUDGED] ** 2).mean(axis=0)).max())
    fewest = np.ceil(max(1.0, (stated / PLANE) ** 2))
    return (
        f"Averaging {format_fixed(count, 0)} ± {format_fixed(error, 0)} such manoeuvres would reach 2 % with the "
        f"likelihood, according to the errors over {len(likelihood.errors)} sets of noise ({fewest:.0f} according to "
        f"the first-order standard deviations, worst {format_percent(stated, 2)}; see the report on the base body)."
    )


STUDY = Study(
    "sensors",
    "Test the paper's expectations for noise and sensors.",
    run=run,
    report=_report,
    full="all levels of noise, more draws, and nonlinear fits, which takes minutes",
    seed=1,
    extra=TRIALS,
)
