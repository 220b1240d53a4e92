"""Report of the calibration."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

import numpy as np
from arviz.stats.ecdf_utils import ecdf_confidence_band
from matplotlib.figure import Figure

from bayesid._math.arrays import Floats
from bayesid.inference.importance import TRUSTED
from bayesid.report import Document
from bayesid.report.figures.figure_style import COLOURS, styled, wide_figure
from studies.calibration.cases import ARM_SPREAD, BASE_SPREAD, DRAWINGS_SPREAD, INDEPENDENT, REPLICATES, Case
from studies.calibration.encoders import NEAR, Smoothed, smooth_share, smoothed_errors
from studies.calibration.outcomes import Replicates
from studies.calibration.replicate import LOG_LIKELIHOOD, Method
from studies.calibration.uniformity import POINTS, coverage, holm, uniform_p_value
from studies.common.tables import add_number_table

__all__ = ["FAMILYWISE", "LEVELS", "goal_rows", "write_report"]

LEVELS = (0.5, 0.9, 0.95)
"""Levels of the intervals whose coverage is counted."""

FAMILYWISE = 0.01
"""Probability that any rank of any case is called not uniform where all are."""


def goal_rows(cases: Sequence[Replicates]) -> list[list[str]]:
    """Return each goal, what was reached, and PASS, FAIL, or NOT DECIDED where too few replicates were made."""
    corrected = corrected_p_values(cases)
    rows = []
    for case, planned in REPLICATES.items():
        mine = next((item for item in cases if item.case is case), None)
        made = 0 if mine is None else len(mine.results)
        goal = f"{case}: {planned:,} replicates"
        if mine is None or made == 0:
            rows.append([goal, "none made", "NOT TESTED"])
            continue
        name = min(mine.p_values, key=lambda key: mine.p_values[key])
        p = corrected[case, name]
        verdict = "FAIL" if p <= FAMILYWISE else "PASS" if made >= planned else "NOT DECIDED"
        rows.append([goal, f"{made:,} made; smallest corrected p {_p(p)} ({name})", verdict])
    return rows


def corrected_p_values(cases: Sequence[Replicates]) -> dict[tuple[Case, str], float]:
    """Return Holm's p-values of all unknowns of all cases together."""
    return holm({(item.case, name): p for item in cases for name, p in item.p_values.items()})


def write_report(cases: Sequence[Replicates], file: Path) -> None:
    """Write the report as PDF."""
    made, planned = sum(len(item.results) for item in cases), sum(REPLICATES.values())
    corrected = corrected_p_values(cases)
    document = Document("Calibration", "Whether the truth lies where the posterior says")
    document.section("Answer")
    document.items(_answer(cases, corrected))
    document.paragraph(
        f"{made:,} of {planned:,} replicates were made. Each draws the unknowns from the prior, records a manoeuvre "
        f"of 120 "
        "s with noise of all sensors and encoders, smooths the joints, finds the mode, and ranks the truth among "
        "draws of the posterior. Where the intervals are honest, every rank is uniform, and so is that of the log "
        "likelihood, which sees all unknowns at once."
    )
    if made < planned:
        document.paragraph(
            "The study is incomplete. Replicates of a case are independent, and those made are the first of the plan. "
            "A goal without a contradiction is not decided until all its replicates are made."
        )
    document.table(
        ["ranks uniform in", "reached", ""],
        goal_rows(cases),
        f"Goals, by importance sampling. P-values are exact and simultaneous over {len(POINTS)} points of the ranks' "
        f"distribution, and corrected by Holm's method over all {len(corrected)} ranks of all cases. FAIL at "
        f"{100.0 * FAMILYWISE:g} % family-wise.",
        ["left", "left", "left"],
    )
    document.section("What went wrong")
    document.items(_failures(cases))
    document.section("Ranks and coverage")
    document.figure(
        ecdf_figure(cases, len(corrected)),
        "Empirical distribution of the ranks less the uniform one, by importance sampling: every unknown (grey), the "
        "log "
        "likelihood (colour), and the band that all curves of all cases leave with a probability of at most 1 %.",
    )
    add_number_table(
        document,
        ["case and method", "made", *(f"{100.0 * level:g} %" for level in LEVELS), "k-hat > 0.7"],
        [row for item in cases for row in _coverage_rows(item)] + _pooled_rows(cases),
        "Percentage of the true mass, centre of mass and inertia of all identified bodies within the stated central "
        "intervals, with the standard error over replicates. Emcee samples one replicate of twenty, and none with an "
        "unknown arm, where it takes minutes; for the base alone it costs six times as much as all the rest.",
    )
    document.section("Chi-square per sample")
    smoothed = smoothed_errors()
    sharp = np.sqrt([row.near[2] for row in smoothed])
    document.paragraph(
        "Chi-square is that of the data at the truth, so that its mean is one where the stated covariance is right. "
        "It is "
        "below one where the noise carried from the encoders is overstated, above one where understated. The second "
        "table, of joint motions that are known exactly, says why it may be either. The smoothing takes a motion as a "
        "five-fold integral of white noise, the smoothest that its algebra allows. Robots move smoother than that: of "
        "the stated variance of position, speed and acceleration the shares "
        f"{', '.join(f'{1.0 - smooth_share(order):.1f}' for order in range(3))} are roughness that such motions do not "
        "have, whatever the sampling and the encoder, as long as the encoder's noise and not the interval limits the "
        f"smoothing. Ratios of {', '.join(f'{smooth_share(order):.1f}' for order in range(3))} follow, and a sensor "
        "whose errors are mostly carried accelerations shows a chi-square down to one half. Within a second of the "
        "ends "
        "of quintic ramps, where the jerk jumps, the stated acceleration is too sharp by a factor of "
        f"{sharp.min():.1f} to {sharp.max():.1f}. A sensor with as much noise of its own, as here, shows little of "
        "either. The remedy would be a smoother process with jumps of the jerk as unknowns; it is not made."
    )
    add_number_table(
        document,
        ["case", "rate", "accelerometer"],
        [[item.case, *(_mean(item.chi2(sensor)) for sensor in ("rate", "accel"))] for item in cases if item.results],
        "Mean chi-square per sample at the truth, with its standard error over replicates. Around one data set, half "
        "of "
        "the samples are the same in all replicates, and their mean need not be one.",
    )
    add_number_table(
        document,
        [
            "sampling, encoder",
            *(f"{part}, {name}" for part in ("between", "near") for name in ("pos.", "speed", "accel.")),
        ],
        [_smoothed_row(row) for row in smoothed],
        "Mean square of the errors of smoothed joints over the stated variance, one where all is right: "
        f"near the ends of ramps (within {NEAR:g} s) and between.",
    )
    document.section("Conditions")
    document.paragraph(
        f"Rates of 1e-5 rad/s and accelerations of 1e-5 m/s² per sample at 0.5 s, joint positions of 1e-6 rad, an "
        f"unknown constant error of the accelerometer of 1e-4 m/s², gravity gradient, random attitude and initial rate "
        f"(1e-3 rad/s), random motion of all joints. Priors in log-Cholesky coordinates: width {BASE_SPREAD:g} for "
        f"base "
        f"and load (mass uncertain by a factor of 1.8), {ARM_SPREAD:g} for an arm known to 5 %, {DRAWINGS_SPREAD:g} "
        f"for "
        f"links where the whole system is unknown. Around one data set, truths are drawn from its posterior and each "
        f"replicate's posterior is that of both data sets. Data of cases named MuJoCo share no code with the package; "
        f"those of the others are the package's own. The initial rate is that which belongs to the joints as smoothed. "
        f"Median processor time of a replicate "
        f"{np.median([result['seconds'] for item in cases for result in item.results]):.1f} s."
    )
    document.foot(
        f"bayesid {version('bayesid')}; python -m studies.calibration --full; seed of the replicates 1. Method: "
        f"Talts et "
        "al. 2018; Säilynoja, Bürkner & Vehtari 2022 (bands, by ArviZ); Modrák et al. 2023; Säilynoja et al. 2025."
    )
    document.write(file)


def _answer(cases: Sequence[Replicates], corrected: dict[tuple[Case, str], float]) -> list[str]:
    wrong = [f"{name} ({case}; p {_p(p)})" for (case, name), p in corrected.items() if p <= FAMILYWISE]
    sentences = [
        f"Not uniform at {100.0 * FAMILYWISE:g} % family-wise: " + "; ".join(wrong) + "."
        if wrong
        else f"None of {len(corrected)} ranks contradicts uniformity at {100.0 * FAMILYWISE:g} % family-wise. Where "
        "replicates are few that is weak evidence: see the width of the bands."
    ]
    for title, chosen in (("the package's own data", False), ("data made by MuJoCo", True)):
        ranks = [item.bodies() for item in cases if (item.case in INDEPENDENT) is chosen and len(item.results)]
        if ranks:
            shares = [_pooled(ranks, level) for level in LEVELS]
            words = ", ".join(f"{100.0 * s:.1f} ± {100.0 * e:.1f}" for s, e in shares)
            sentences.append(
                f"On {title}, {words} % (with standard errors) of the bodies' true values lie within the "
                f"{', '.join(f'{100.0 * level:g}' for level in LEVELS)} % intervals."
            )
    pooled = np.concatenate([item.ranks()[LOG_LIKELIHOOD] for item in cases if item.results])
    sentences.append(
        f"The log likelihood of all {len(pooled)} replicates together: p = {_p(uniform_p_value(pooled))} of its ranks "
        "being uniform."
    )
    chi2 = [np.concatenate([item.chi2(sensor) for item in cases if item.results]) for sensor in ("rate", "accel")]
    sentences.append(
        f"Chi-square per sample at the truth is {_mean(chi2[0])} for rates and {_mean(chi2[1])} for accelerations, but "
        "not by merit alone: the noise carried from the encoders is overstated where joints move smoothly and "
        "understated where their jerk jumps, which shows where it outweighs the sensors' own (section 4)."
    )
    return sentences


def _pooled(ranks: Sequence[Floats], level: float) -> tuple[float, float]:
    """Return the coverage of replicates of several cases, each replicate with the same weight, and its error."""
    shares = np.concatenate([(np.abs(2.0 * item - 1.0) < level).mean(axis=1) for item in ranks])
    return float(shares.mean()), float(shares.std() / np.sqrt(len(shares)))


def _failures(cases: Sequence[Replicates]) -> list[str]:
    errors = [f"{item.case}: {message}" for item in cases for message in item.failures]
    modes = sum(item.count("converged", False) for item in cases)
    chains = sum(item.count("emcee_converged", False) for item in cases)
    sampled = chains + sum(item.count("emcee_converged", True) for item in cases)
    untrusted = sum(result["pareto_k"] >= TRUSTED for item in cases for result in item.results)
    shifts = ", ".join(f"{item.rate_shift:.1f} ({item.case})" for item in cases if item.rate_shift > 0.0)
    sentences = [
        f"Replicates that raised an error: {len(errors)}." + "".join(f" {text}." for text in sorted(set(errors))),
        f"Searches for the mode that did not converge: {modes}. Runs of emcee that did not converge: {chains} of "
        f"{sampled}. "
        f"Replicates whose weights are not trusted (Pareto k-hat of {TRUSTED:g} and more): {untrusted}; they count "
        f"like "
        "all others.",
    ]
    if shifts:
        sentences.append(
            "The initial rate in a posterior is not the base's own, but the one that belongs to the joints as "
            "smoothed: "
            "an error of a smoothed joint speed at time 0 moves it, and its stated interval leaves that out. Root mean "
            f"square of the difference in stated standard deviations: {shifts}. Ranks "
            "and coverage here are of the rate as the posterior means it; the bodies are the same in both readings."
        )
    return sentences


def _coverage_rows(item: Replicates) -> list[list[str]]:
    rows = []
    for method in Method:
        ranks = item.bodies(method)
        if len(ranks) < 2:
            continue
        cells = [f"{100.0 * share:.1f} ± {100.0 * error:.1f}" for share, error in (coverage(ranks, v) for v in LEVELS)]
        bad = sum(result["pareto_k"] >= TRUSTED for result in item.results)
        rows.append(
            [f"{item.case}: {method}", str(len(ranks)), *cells, str(bad) if method is Method.IMPORTANCE else "-"]
        )
    return rows


def _pooled_rows(cases: Sequence[Replicates]) -> list[list[str]]:
    rows = []
    for method in Method:
        ranks = [made for item in cases if len(made := item.bodies(method))]
        if ranks:
            cells = [
                f"{100.0 * share:.1f} ± {100.0 * error:.1f}" for share, error in (_pooled(ranks, v) for v in LEVELS)
            ]
            rows.append([f"all cases: {method}", str(sum(map(len, ranks))), *cells, "-"])
    return rows


def _smoothed_row(row: Smoothed) -> list[str]:
    return [f"{row.interval:g} s, {row.encoder:g} rad", *(f"{value:.2f}" for value in (*row.between, *row.near))]


def _mean(values: Floats) -> str:
    if len(values) < 2:
        return f"{values.mean():.3f}"
    return f"{values.mean():.3f} ± {values.std(ddof=1) / np.sqrt(len(values)):.3f}"


def _p(value: float) -> str:
    return f"{value:.2g}" if value >= 1e-6 else "below 1e-6"


@styled
def ecdf_figure(cases: Sequence[Replicates], family: int) -> Figure:
    """Draw the differences of all ranks' distributions from the uniform one, a panel for each case."""
    shown = [item for item in cases if item.results]
    rows = int(np.ceil(len(shown) / 3))
    figure = wide_figure(1.75 * rows)
    panels = figure.subplots(rows, 3, squeeze=False, sharex=True)
    for axes, item in zip(panels.ravel(), shown, strict=False):
        count = len(item.results)
        low, high = ecdf_confidence_band(count, POINTS, POINTS, prob=1.0 - FAMILYWISE / family)
        axes.fill_between(POINTS, low - POINTS, high - POINTS, color=COLOURS[0], alpha=0.15, linewidth=0.0)
        for name, ranks in item.ranks().items():
            share = np.searchsorted(np.sort(ranks), POINTS, side="right") / count
            special = name == LOG_LIKELIHOOD
            style = (
                {"color": COLOURS[1], "linewidth": 1.4, "zorder": 3} if special else {"color": "0.6", "linewidth": 0.5}
            )
            axes.plot(POINTS, share - POINTS, **style)
        axes.set_title(f"{item.case} ({count})", fontsize=7)
    for axes in panels.ravel()[len(shown) :]:
        axes.set_visible(False)
    for axes in panels[-1]:
        axes.set_xlabel("rank")
    return figure
