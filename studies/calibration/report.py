"""Report of the calibration."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bayesid._math.arrays import Floats
from bayesid.inference.importance import TRUSTED
from bayesid.report import Document
from bayesid.report.figures.figure_style import COLOURS, styled, wide_figure
from bayesid.report.numbers import NO_VALUE, format_number, format_p_value, format_percent
from studies.calibration import replicate
from studies.calibration.data import (
    ARM_SPREAD,
    BASE_SPREAD,
    DRAWINGS_SPREAD,
    INDEPENDENT,
    NEAR,
    REPLICATES,
    Case,
    Smoothed,
    smooth_share,
    smoothed_errors,
)
from studies.calibration.replicate import (
    ALL,
    ARMS,
    LEVELS,
    LOG_LIKELIHOOD,
    POINTS,
    Method,
    Replicates,
    pooled_coverage,
    uniform_band,
)
from studies.common.ets7 import START, ets7
from studies.common.figures import robot_outline
from studies.common.monte_carlo import Workers, run_trials
from studies.common.report_parts import add_number_table
from studies.common.study import MADE, TRIALS, CsvTable, Goal, Picture, Report, Setup, Study, Verdict, show

FAMILYWISE = 0.01  # probability that any rank of any case is called not uniform where all are
SEED = 1  # of all replicates
HEADER = ["case and method", "made", *(format_percent(level) for level in LEVELS), "k-hat ≥ 0.7"]
SHORT = 2.0  # standard errors below the stated share from which a coverage is named among what went wrong


def goals_of(cases: Sequence[Replicates]) -> list[Goal]:
    """Return the goal of each case, not decided where fewer replicates than planned contradict nothing."""
    corrected = corrected_p_values(cases)
    goals = []
    for case, planned in REPLICATES.items():
        mine = next((runs for runs in cases if runs.case is case), None)
        made = 0 if mine is None else len(mine.results)
        text = f"ranks uniform (corrected p above {FAMILYWISE:g}), {planned:,} replicates: {case}"
        if mine is None or made == 0:
            goals.append(Goal(text, "none made", Verdict.NOT_TESTED))
            continue
        name = min(mine.p_values, key=lambda key: mine.p_values[key])
        p = corrected[case, name]
        verdict = Verdict.FAIL if p <= FAMILYWISE else Verdict.PASS if made >= planned else Verdict.OPEN
        goals.append(Goal(text, f"{made:,} made; smallest corrected p {format_p_value(p)} ({name})", verdict))
    return [*goals, *_coverage_goals(cases), _emcee_goal(cases)]


def _coverage_goals(cases: Sequence[Replicates]) -> list[Goal]:
    """Return the goal on the coverage of the intervals of each level, in every case and in all together."""
    coverages = replicate.interval_coverage(cases)
    corrected = replicate.holm({key: coverage.p_value for key, coverage in coverages.items()})
    complete = all(
        any(runs.case is case and len(runs.results) >= planned for runs in cases)
        for case, planned in REPLICATES.items()
    )
    goals = []
    for level in LEVELS:
        share = f"{format_percent(level)} intervals contain that share of the true values in every case"
        text = f"{share} (corrected p above {FAMILYWISE:g})"
        mine = [key for key in coverages if key[1] == level]
        if not mine:
            goals.append(Goal(text, "none made", Verdict.NOT_TESTED))
            continue
        worst = min(mine, key=lambda key: coverages[key].p_value)
        verdict = Verdict.FAIL if corrected[worst] <= FAMILYWISE else Verdict.PASS if complete else Verdict.OPEN
        shown = f"all {coverages[ALL, level]}; smallest corrected p {format_p_value(corrected[worst])}"
        goals.append(Goal(text, f"{shown} ({worst[0]}: {coverages[worst]})", verdict))
    return goals


def _emcee_goal(cases: Sequence[Replicates]) -> Goal:
    """Return the goal on emcee where the arm is unknown, which is judged like the others once it is run there."""
    text = f"ranks uniform (corrected p above {FAMILYWISE:g}), emcee: unknown arm and whole system"
    p_values = {
        (runs.case, name): replicate.uniform_p_value(ranks)
        for runs in cases
        if runs.case in ARMS
        for name, ranks in runs.ranks(Method.EMCEE).items()
    }
    if not p_values:
        return Goal(text, "none made", Verdict.NOT_TESTED)
    least = min(replicate.holm(p_values).values())
    verdict = Verdict.FAIL if least <= FAMILYWISE else Verdict.OPEN  # so few replicates show gross errors alone
    made = {runs.case: len(runs.bodies(Method.EMCEE)) for runs in cases if runs.case in ARMS}
    counts = ", ".join(f"{count or 'none'} of {case}" for case, count in made.items())
    return Goal(text, f"{counts}; smallest corrected p {format_p_value(least)}", verdict)


def corrected_p_values(cases: Sequence[Replicates]) -> dict[tuple[Case, str], float]:
    """Return Holm's p-values of all unknowns of all cases together."""
    return replicate.holm({(runs.case, name): p for runs in cases for name, p in runs.p_values.items()})


def run(
    *,
    full: bool = False,
    trials: Path,
    workers: Workers = 1,
    made: bool = False,
    progress: Callable[[str], None] = show,
) -> list[Replicates]:
    """Make the replicates that the store does not hold yet, unless those ``made`` so far are enough, and read all."""
    if not made:
        run_trials(replicate.make, replicate.plan(full), trials, seed=SEED, workers=workers, progress=progress)
    return replicate.read(trials)


def _report(cases: Sequence[Replicates]) -> Report[Sequence[Replicates]]:
    corrected = corrected_p_values(cases)
    made, planned = sum(len(runs.results) for runs in cases), sum(REPLICATES.values())
    share, error = pooled_coverage([runs.bodies() for runs in cases if runs.results], LEVELS[-1])
    wrong = [p for p in corrected.values() if p <= FAMILYWISE]
    said = f"{len(wrong)} ranks contradict uniformity" if wrong else "no rank contradicts uniformity"
    return Report(
        title="Calibration",
        subtitle="Coverage of the posterior's intervals",
        question="Does the truth lie within the stated intervals as often as stated, through the whole chain?",
        answer=f"{_percent(share, error)} % of the bodies' true values lie within their {format_percent(LEVELS[-1])} "
        f"intervals, and {said}, over {made:,} replicates"
        + (f" of the {planned:,} needed for a decision." if made < planned else "."),
        goals=goals_of(cases),
        valid="noise is white and as declared, joints move smoothly, the model lacks no effect, and the truths are "
        "drawn from the prior.",
        full=made >= planned,
        figure=Picture(
            ecdf_figure(cases, len(corrected)),
            "Empirical distribution of the ranks minus the uniform one, by importance sampling: every unknown (grey), "
            "the log likelihood (colour), and the band that any curve of any case exceeds with a probability of at "
            f"most {format_percent(FAMILYWISE, 1)}.",
        ),
        note=f"P-values of ranks are exact and simultaneous over {len(POINTS)} points of their distribution, and "
        f"corrected by Holm's method over all {len(corrected)} ranks of all cases. P-values of coverage use the "
        "standard error over replicates, since the numbers of a replicate are dependent, and are corrected by Holm's "
        f"method over each case, all cases together and {len(LEVELS)} levels. A goal fails at "
        f"{format_percent(FAMILYWISE, 1)} family-wise, and is not decided until all its replicates are made.",
        setup=_setup(cases),
        outline=robot_outline(ets7(), START),
        sections=[_failures, _findings, _chi_square],
        tables=[CsvTable("coverage", HEADER, _coverage_rows(cases))],
        beside="",
    )


def _setup(cases: Sequence[Replicates]) -> Setup:
    seconds = np.median([result["seconds"] for runs in cases for result in runs.results])
    return Setup(
        robot="ETS-VII, alone or with a load, and a planar robot on a table.",
        manoeuvre="Random motion of all joints for 120 s, from a random attitude and initial rate (10⁻³ rad/s).",
        sensors="Every 0.5 s rates with 10⁻⁵ rad/s, accelerations with 10⁻⁵ m/s² and an unknown constant error of 10⁻⁴ "
        "m/s², joint positions with 10⁻⁶ rad.",
        known="The orbit with its gravity gradient, the attitude at the start, the sensors' noise.",
        unknown=f"Log-Cholesky coordinates of width {BASE_SPREAD:g} for base and load (mass uncertain by a factor of "
        f"1.8), {ARM_SPREAD:g} for an arm with masses uncertain by 5 % (1 sigma), {DRAWINGS_SPREAD:g} for links where "
        "the whole system is unknown; the initial rate that matches the smoothed joints.",
        replicates="Each draws the unknowns from the prior, records with all noise, smooths the joints, computes the "
        "mode, and ranks the truth among draws of the posterior. Around one data set, truths are drawn from its "
        "posterior and each replicate's posterior is that of both data sets. Data of cases named MuJoCo share no code "
        f"with the package. Median processor time of a replicate: {seconds:.1f} s. Method: Talts et al. 2018; "
        "Säilynoja, Bürkner and Vehtari 2022 (bands); Modrák et al. 2023.",
    )


def _chi_square(document: Document, cases: Sequence[Replicates]) -> None:
    document.section("Chi-square per sample")
    smoothed = smoothed_errors()
    sharp = np.sqrt([row.near[2] for row in smoothed])
    document.paragraph(
        "Chi-square is that of the data at the truth, so its mean is one if the stated covariance is right. It is "
        "below one if the noise propagated from the encoders is overstated, above one if it is understated. The second "
        "table, for exactly known joint motions, explains why both occur. The smoothing models a motion as a five-fold "
        "integral of white noise, the smoothest that its algebra allows. Real robot motions are smoother: of the "
        "stated variance of position, speed and acceleration the shares "
        f"{', '.join(f'{1.0 - smooth_share(order):.1f}' for order in range(3))} are roughness that such motions do not "
        "have, whatever the sampling and the encoder, provided that the encoder's noise and not the interval limits "
        f"the smoothing. The resulting ratios are {', '.join(f'{smooth_share(order):.1f}' for order in range(3))}, and "
        "the chi-square of a sensor whose errors are mostly propagated accelerations can fall to one half. Within a "
        f"second of the ends of quintic ramps, where the jerk jumps, the actual error of the acceleration is "
        f"{sharp.min():.1f} to {sharp.max():.1f} times the stated one: jumps that the samples reveal are unknowns of "
        "the process, but a single joint, as here, does not reveal all of them. Both effects are small in a sensor "
        "whose noise is as large as the propagated one."
    )
    add_number_table(
        document,
        ["case", "rate", "accelerometer"],
        [[runs.case, *(_mean(runs.chi2(sensor)) for sensor in ("rate", "accel"))] for runs in cases if runs.results],
        "Mean chi-square per sample at the truth, with its standard error over replicates. In the case around one data "
        "set, half of the samples are the same in all replicates, and their mean need not be one.",
    )
    parts = [f"{part}, {name}" for part in ("between", "near") for name in ("pos.", "speed", "accel.")]
    add_number_table(
        document,
        ["sampling, encoder", *parts],
        [_smoothed_row(row) for row in smoothed],
        "Mean square of the errors of smoothed joints over the stated variance, ideally one: near the ends of ramps "
        f"(within {NEAR:g} s) and between them.",
    )


def _findings(document: Document, cases: Sequence[Replicates]) -> None:
    document.section("Ranks and intervals")
    corrected = corrected_p_values(cases)
    wrong = [f"{name} ({case}; p {format_p_value(p)})" for (case, name), p in corrected.items() if p <= FAMILYWISE]
    sentences = [
        f"Not uniform at {100.0 * FAMILYWISE:g} % family-wise: " + "; ".join(wrong) + "."
        if wrong
        else f"None of {len(corrected)} ranks contradicts uniformity at {100.0 * FAMILYWISE:g} % family-wise. With few "
        "replicates this is weak evidence: see the width of the bands."
    ]
    for title, chosen in (("data generated by the package", False), ("data generated by MuJoCo", True)):
        ranks = [runs.bodies() for runs in cases if (runs.case in INDEPENDENT) is chosen and len(runs.results)]
        if ranks:
            shares = [pooled_coverage(ranks, level) for level in LEVELS]
            words = ", ".join(_percent(*share) for share in shares)
            sentences.append(
                f"For {title}, {words} % (with standard errors) of the bodies' true values lie within the "
                f"{', '.join(f'{100.0 * level:g}' for level in LEVELS)} % intervals."
            )
    pooled = np.concatenate([runs.ranks()[LOG_LIKELIHOOD] for runs in cases if runs.results])
    p_value = format_p_value(replicate.uniform_p_value(pooled))
    sentences.append(f"Log likelihood of all {len(pooled)} replicates together: p = {p_value} for uniform ranks.")
    chi2 = [np.concatenate([runs.chi2(sensor) for runs in cases if runs.results]) for sensor in ("rate", "accel")]
    sentences.append(
        f"Chi-square per sample at the truth is {_mean(chi2[0])} for rates and {_mean(chi2[1])} for accelerations, in "
        "part because two errors offset each other: the noise propagated from the encoders is overstated where joints "
        "move smoothly and understated where jumps of their jerk are too small to be detected. This matters where it "
        "exceeds the noise of the sensors (section 4)."
    )
    document.items(sentences)
    add_number_table(
        document,
        HEADER,
        [row for row in _coverage_rows(cases) if row[0].endswith(f": {Method.IMPORTANCE}") or row[0].startswith(ALL)],
        "Percentage of the true mass, centre of mass and inertia of all identified bodies within the stated central "
        "intervals, with the standard error over replicates. Emcee samples one replicate in twenty, and none of the "
        "whole system. Results of Laplace and emcee for each case are in calibration-coverage.csv.",
    )


def _failures(document: Document, cases: Sequence[Replicates]) -> None:
    document.section("What went wrong")
    errors = [f"{runs.case}: {message}" for runs in cases for message in runs.failures]
    modes = sum(runs.count("converged", False) for runs in cases)
    chains = sum(runs.count("emcee_converged", False) for runs in cases)
    sampled = chains + sum(runs.count("emcee_converged", True) for runs in cases)
    untrusted = sum(result["pareto_k"] >= TRUSTED for runs in cases for result in runs.results)
    shifts = ", ".join(f"{runs.rate_shift:.1f} ({runs.case})" for runs in cases if runs.rate_shift > 0.0)
    sentences = [
        f"Replicates that raised an error: {len(errors)}." + "".join(f" {text}." for text in sorted(set(errors))),
        f"Searches for the mode that did not converge: {modes}. Runs of emcee that did not converge: {chains} of "
        f"{sampled}. Replicates whose weights are not trusted (Pareto k-hat of {TRUSTED:g} or more): {untrusted}; "
        "they count like all others.",
    ]
    short = [
        f"{name} {coverage} at {format_percent(level)}"
        for (name, level), coverage in replicate.interval_coverage(cases).items()
        if level - coverage.share > SHORT * coverage.error
    ]
    if short:
        sentences.insert(
            0,
            f"Intervals that contain the truth less often than stated, by more than {SHORT:g} standard errors before "
            f"any correction for the number of cases: {', '.join(short)}.",
        )
    if shifts:
        sentences.append(
            "The initial rate in a posterior is not the true rate of the base, but the one that matches the smoothed "
            "joints: an error of a smoothed joint speed at time 0 shifts it, and its stated interval excludes this "
            f"shift. Root mean square of the difference in stated standard deviations: {shifts}. Ranks and coverage "
            "here refer to the rate as the posterior defines it; the bodies are the same in both definitions."
        )
    document.items(sentences)


def _coverage_rows(cases: Sequence[Replicates]) -> list[list[str]]:
    """Return the coverage of each case and of all together, by method."""
    rows = []
    for runs in cases:
        bad = str(sum(result["pareto_k"] >= TRUSTED for result in runs.results))
        for method in Method:
            ranks = runs.bodies(method)
            if len(ranks) > 1:
                cells = [_percent(*replicate.coverage(ranks, level)) for level in LEVELS]
                doubt = bad if method is Method.IMPORTANCE else NO_VALUE
                rows.append([f"{runs.case}: {method}", str(len(ranks)), *cells, doubt])
    for method in Method:
        every = [made for runs in cases if len(made := runs.bodies(method))]
        if every:
            cells = [_percent(*pooled_coverage(every, level)) for level in LEVELS]
            rows.append([f"{ALL}: {method}", str(sum(map(len, every))), *cells, NO_VALUE])
    return rows


def _percent(share: float, error: float) -> str:
    return f"{100.0 * share:.1f} ± {100.0 * error:.1f}"


def _smoothed_row(row: Smoothed) -> list[str]:
    ratios = (f"{value:.2f}" for value in (*row.between, *row.near))
    return [f"{row.interval:g} s, {format_number(row.encoder)} rad", *ratios]


def _mean(values: Floats) -> str:
    if len(values) < 2:
        return f"{values.mean():.3f}"
    return f"{values.mean():.3f} ± {values.std(ddof=1) / np.sqrt(len(values)):.3f}"


@styled
def ecdf_figure(cases: Sequence[Replicates], family: int) -> Figure:
    """Draw the differences of all ranks' distributions from the uniform one, a panel for each case."""
    shown = [runs for runs in cases if runs.results]
    rows = int(np.ceil(len(shown) / 3))
    figure = wide_figure(0.85 * rows)
    panels = figure.subplots(rows, 3, squeeze=False, sharex=True)
    for axes, runs in zip(panels.ravel(), shown, strict=False):
        count = len(runs.results)
        low, high = uniform_band(count, 1.0 - FAMILYWISE / family)
        axes.fill_between(POINTS, low - POINTS, high - POINTS, color=COLOURS[0], alpha=0.15, linewidth=0.0)
        for name, ranks in runs.ranks().items():
            share = np.searchsorted(np.sort(ranks), POINTS, side="right") / count
            special = name == LOG_LIKELIHOOD
            colour, width, order = (COLOURS[1], 1.4, 3) if special else ("0.6", 0.5, 2)
            axes.plot(POINTS, share - POINTS, color=colour, linewidth=width, zorder=order)
        axes.set_title(runs.case)
    for axes in panels.ravel()[len(shown) :]:
        axes.set_visible(False)
    for axes in panels[-1]:
        axes.set_xlabel("rank")
    figure.supylabel("share of ranks below − rank", fontsize=8)
    return figure


STUDY = Study(
    "calibration",
    "Check whether the truth lies within the stated intervals as often as stated.",
    run=run,
    report=_report,
    full="all replicates of all cases (hours)",
    extra={**TRIALS, "--trials": {**TRIALS["--trials"], "default": Path("out/calibration.jsonl")}, **MADE},
)
