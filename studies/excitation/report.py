"""Report of the study."""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bayesid._io.words import joined
from bayesid._math.arrays import Floats
from bayesid.design import THOROUGH, Search, Store
from bayesid.report import Document
from bayesid.report.figures.figure_style import AFTER, BAND, BEFORE, COLOURS, TRUTH, shared_legend, styled, wide_figure
from bayesid.report.numbers import NO_VALUE, format_fixed, format_number, format_p_value, format_percent, format_range
from studies.common import mission
from studies.common.ets7 import BIAS, START, ets7
from studies.common.figures import manoeuvre_figure, robot_outline
from studies.common.quantities import HEADINGS, LABELS, MASS
from studies.common.repeated_fits import Realised, ratio_interval
from studies.common.report_parts import add_number_table
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
from studies.excitation.search import FULL, QUICK, Contest, Crowd, Result, run

# titles of the manoeuvres
TITLES = {
    "printed": "the paper's manoeuvre",
    "poor": "the paper's weaker variant",
    "paper-26": "best by Eq. (26) as printed",
    "paper-26-intended": "best by Eq. (26), corrected",
    "condition-number": "condition number",
    "d-optimal": "d-optimal",
    "a-optimal": "a-optimal",
    "e-optimal": "e-optimal",
    "information-gain": "information gain",
}

DRAWN = ("printed", "paper-26", "condition-number", "d-optimal")  # manoeuvres that are drawn
HEADLINE, IDEAL = mission.ROWS  # what is known of the arm: in the headline, and in the idealised row

# what is known of the arm, as texts and legends state it
ARMS = dict(zip(mission.ROWS, ("arm uncertain by 5 % (1 sigma)", "arm known exactly"), strict=True))

# factor over the condition number that is wanted, and largest deviation of realised from predicted errors
WANTED, WITHIN = 1.3, 0.05
RISK = 0.05  # probability with which realised errors are called wrong although all are as predicted

# number of starts that is wanted, that of a design by default, the difference per parameter that may remain between
# their best manoeuvres, and the number of the base's parameters
STARTS, USUAL, ALIKE, PARAMETERS = 100, Search().starts, 0.02, 10

# number of followed searches that are to reach the best known, and of robots on which they are wanted
SEVERAL, ROBOTS = 3, 3


def goals(result: Result) -> tuple[Goal, ...]:
    """Return the goals of the study with what was reached."""
    contest = result.contest
    factors = {row: contest.factor("d-optimal", "condition-number", row) for row in mission.ROWS}
    kept = all(limit.kept for design in contest.designs.values() for limit in design.reached)
    finer = "on a grid eight times finer than the search's"
    starts = f"{STARTS} starts"
    return (
        Goal(
            f"Geometric-mean sd at least {WANTED} times smaller than that of the best condition number, "
            f"{joined(ARMS[row] for row in factors)}",
            joined(f"{factor:.2f}" for factor in factors.values()) + " times",
            Verdict.of(min(factors.values()) >= WANTED),
            Severity.MEDIUM,
        ),
        _largest_goal(starts, result),
        _robots_goal(starts, result),
        realised_goal(result.realised),
        Goal("Every limit satisfied", finer if kept else f"violated {finer}", Verdict.of(kept), Severity.HIGH),
    )


def realised_goal(flown: Mapping[str, Realised]) -> Goal:
    """Return the goal on realised errors, whose independent directions are judged, since parameters are correlated.

    It is missed where one of all simultaneous intervals lies beside the goal. It is reached where the interval of all
    directions together lies within it for every manoeuvre, which needs no correction for their number since all must,
    and where every simultaneous interval of one direction lies within it too, or none of those that do not excludes 1
    and the covariance does not contradict the predicted one.
    """
    text = (
        f"Realised over predicted sd within {format_percent(WITHIN)} of 1 in ten independent directions, every "
        "manoeuvre flown"
    )
    if not flown:
        return Goal(text, "none flown", Verdict.NOT_TESTED, Severity.HIGH)
    simultaneous = 1.0 - RISK / sum(1 + len(each.directions) for each in flown.values())
    verdicts = []
    for each in flown.values():
        together = each.whitened.size
        intervals = [ratio_interval(float(ratio), len(each.errors), simultaneous) for ratio in each.directions]
        every = {_within(interval) for interval in (*intervals, ratio_interval(each.scale, together, simultaneous))}
        inside = [_within(interval) is Verdict.PASS for interval in intervals]
        right = [low <= 1.0 <= high for low, high in intervals]
        alike = all(inside) or (all(np.logical_or(inside, right)) and each.p_value >= RISK / len(flown))
        reached = alike and _within(ratio_interval(each.scale, together, 1.0 - RISK)) is Verdict.PASS
        verdicts.append(Verdict.FAIL if Verdict.FAIL in every else Verdict.PASS if reached else Verdict.OPEN)
    worst = max(flown, key=lambda name: abs(np.log(flown[name].scale)))
    single = [float(ratio) for each in flown.values() for ratio in each.directions]
    said = (
        f"all directions together {flown[worst].scale:.3f} ± {scale_error(flown[worst]):.3f} at worst "
        f"({TITLES[worst]}); single directions {min(single):.3f} to {max(single):.3f}, each ± "
        f"{max(each.rms_error for each in flown.values()):.3f}; {_least_p(flown)}; "
        f"{format_range([len(each.errors) for each in flown.values()], 6)} flights of each"
    )
    return Goal(text, said, Verdict.all_of(verdicts), Severity.HIGH)


def _least_p(flown: Mapping[str, Realised]) -> str:
    """Return the smallest p-value of a covariance, in words."""
    known = {name: each.p_value for name, each in flown.items() if np.isfinite(each.p_value)}
    if not known:
        return "covariances not tested with so few flights"
    name = min(known, key=lambda key: known[key])
    return (
        f"smallest p of a covariance {format_p_value(known[name])} ({TITLES[name]}; at least "
        f"{format_number(RISK / len(flown), 2)} required)"
    )


def _within(interval: tuple[float, float]) -> Verdict:
    return Verdict.between(*interval, least=1.0 - WITHIN, most=1.0 + WITHIN)


def scale_error(realised: Realised) -> float:
    """Return the standard error of `Realised.scale` where the prediction is right."""
    return float(1.0 / np.sqrt(2.0 * realised.whitened.size))


def _robots_goal(starts: str, result: Result) -> Goal:
    """Return whether a thorough search ends as low as the best of many descents, on all robots."""
    text = (
        f"On each of {ROBOTS} robots a thorough search is at most {format_percent(ALIKE)} worse (sd per parameter) "
        f"than the best of {starts}"
    )
    crowd = result.crowds.get("d-optimal")
    if crowd is None or result.searches is None or not result.rivals:
        return Goal(text, "not run", Verdict.NOT_TESTED, Severity.MEDIUM)
    away = {"ETS-VII": float(np.expm1((result.searches.costs - crowd.cost) / PARAMETERS).mean())}
    away |= {
        name: float(np.expm1((rivals.search - rivals.crowd) / PARAMETERS)) for name, rivals in result.rivals.items()
    }
    told = [f"{format_percent(abs(x), 2)} {'worse' if x > 0.0 else 'better'} on {name}" for name, x in away.items()]
    reached = f"{', '.join(told)}; on ETS-VII the mean of {len(result.searches.costs)} searches"
    enough = len(crowd.costs) >= STARTS and len(away) >= ROBOTS
    verdict = Verdict.of(max(away.values()) <= ALIKE) if enough else Verdict.OPEN
    return Goal(text, reached, verdict, Severity.MEDIUM)


def _largest(contest: Contest) -> str:
    """Return the largest factor over (26) of any manoeuvre, and whose it is."""
    factors = {name: contest.factor(name, "paper-26", HEADLINE) for name in contest.motions}
    name = max(factors, key=lambda key: factors[key])
    return f"{factors[name]:.2f} times ({TITLES[name]})"


def _best_known(result: Result, crowd: Crowd) -> float:
    """Return the smallest cost by d-optimality that anything found."""
    repeated = [] if result.searches is None else [float(result.searches.costs.min())]
    return min(crowd.cost, result.contest.designs["d-optimal"].optimum.cost, *repeated)


def _largest_goal(starts: str, result: Result) -> Goal:
    """Return whether several searches, each followed to its end, reach the best known: else more may be possible."""
    text = (
        f"At least {SEVERAL} searches that are run to convergence end within {format_percent(ALIKE)} (sd per "
        f"parameter) of the best manoeuvre known, {starts} among them"
    )
    crowd = result.crowds.get("d-optimal")
    if crowd is None:
        reached = f"{_largest(result.contest)} from {result.search.starts} starts; {starts} were not run"
        return Goal(text, reached, Verdict.NOT_TESTED, Severity.MEDIUM)
    repeated = [] if result.searches is None else result.searches.costs.tolist()
    followed = np.array([crowd.cost, *repeated])
    within = int((np.expm1((followed - _best_known(result, crowd)) / PARAMETERS) <= ALIKE).sum())
    count = len(crowd.costs)
    reached = (
        f"{within} of {len(followed)}; largest factor over the optimum of Eq. (26): {_largest(result.contest)}, from "
        f"{count} starts"
    )
    verdict = Verdict.PASS if within >= SEVERAL and count >= STARTS else Verdict.OPEN
    return Goal(text, reached, verdict, Severity.MEDIUM)


def near(result: Result) -> str:
    """Return how near repeated searches end to the best that anything reached, in a sentence; empty without any."""
    crowd = result.crowds.get("d-optimal")
    if crowd is None or result.searches is None:
        return ""
    costs = result.searches.costs
    best = _best_known(result, crowd)
    worse = np.expm1((costs - best) / PARAMETERS)
    usual = np.expm1((crowd.expected(USUAL) - best) / PARAMETERS)
    within = int((worse <= ALIKE).sum())
    return (
        f"Thorough searches by d-optimality end with a sd per parameter {format_percent(worse.mean(), 2)} above the "
        f"best known, on average over {len(costs)}, {within} of them within {format_percent(ALIKE)}; first descents "
        f"from {USUAL} starts, {format_percent(usual, 2)}."
    )


def _consistent(contest: Contest) -> str:
    """Return whether every criterion ranks first the manoeuvre that was designed by it, in a sentence."""
    right = "is the best of all by it" if contest.consistent else "is not always the best of all by it"
    return f"For the {len(contest.designs)} criteria, the manoeuvre designed by a criterion {right}."


def _report(result: Result) -> Report[Result]:
    contest = result.contest
    factors = {row: contest.factor("d-optimal", "condition-number", row) for row in mission.ROWS}
    shrink = contest.shrink
    return Report(
        title="The most informative manoeuvre for the base",
        subtitle="ETS-VII; sections 3.2, 3.3 and 4.1 of the paper",
        question="Which manoeuvre of ETS-VII, within its flight rule, is most informative about its base?",
        answer="Compared with the best condition number, the d-optimal manoeuvre reduces the base's standard "
        f"deviations by a factor of {factors[HEADLINE]:.2f}. This is the factor of their geometric mean with an "
        f"{ARMS[HEADLINE]}; with the {ARMS[IDEAL]} it is {factors[IDEAL]:.2f}. The standard deviation of the mass "
        f"alone, which is limited by the arm, falls by a factor of {_of_mass(contest):.2f}; {_starts(result)}.",
        valid=f"all manoeuvres last {mission.DURATION:g} s, begin and end at rest with the wrist extended, and stay "
        "within 50 mm/s and 5 degrees per second at the tip; the base is initially at rest and only the gravity "
        "gradient acts.",
        goals=goals(result),
        note=f"Errors of parameters are correlated, so realised errors are judged along the principal axes of the "
        "predicted correlations, in which they are independent. The goal is missed if one of all intervals with 95 % "
        f"simultaneous confidence is outside 1 ± {format_percent(WITHIN)}. It is reached if for every manoeuvre the 95 "
        "% interval of all directions together is inside, and neither a simultaneous interval of one direction nor a "
        "likelihood-ratio test of a covariance (5 % family-wise) contradicts the prediction.",
        full=result.full,
        figure=Picture(
            _factor_figure(contest),
            "Geometric mean of the ten standard deviations of each manoeuvre over that of the d-optimal one; larger is "
            "less informative. Filled: each link's mass uncertain by 5 % (1 sigma); open: arm known exactly.",
        ),
        setup=Setup(
            robot=f"ETS-VII with the published base, nominal links, joints within ±{mission.REACH:g} rad.",
            manoeuvre=f"Quintic splines of all six joints, {mission.DURATION:g} s, at the speed that the flight rule "
            f"allows. The paper's manoeuvre (coefficients of section 4.1) had to be reduced to "
            f"{format_percent(shrink['printed'], 2)} of its amplitudes, and its weaker variant to "
            f"{format_percent(shrink['poor'], 2)}. In Eq. (26) as printed most terms cancel, since its differences "
            "have signs; corrected, it takes their magnitudes.",
            sensors=f"{mission.SENSORS}; the encoders' noise is part of every criterion.",
            known="The gravity gradient, the attitude at the start, and the arm with each link's mass uncertain by 5 % "
            "(1 sigma).",
            unknown="The base (mass uncertain by a factor of e², 1 sigma), the rate at the start, the accelerometer's "
            f"bias ({format_number(BIAS)} m/s², 1 sigma), and the links, which are marginalised.",
            replicates=f"{result.search.starts} random starts and {result.search.exchanges} exchanges per "
            f"criterion{_crowds(result)}; {_flights(result)}, each with a separate draw of arm, bias and noise. "
            "Times of searches are in the report on cost.",
        ),
        outline=robot_outline(ets7(), START),
        sections=[_evidence, _calibration],
        statements=_statements(result),
        tables=_tables(result),
    )


def _starts(result: Result) -> str:
    """Return from how many random starts the two that are compared were searched, for a sentence."""
    usual = result.search.starts
    crowd = result.crowds.get("d-optimal")
    starts = usual if crowd is None else max(usual, len(crowd.costs))  # those of the usual search are among the crowd
    starts += 0 if result.searches is None else THOROUGH.starts * len(result.searches.costs)
    return (
        f"the d-optimal search used {starts} random starts, that by condition number {usual} and the best manoeuvres "
        "of the other criteria"
    )


def _of_mass(contest: Contest) -> float:
    """Return how many times smaller the sd of the mass is by d-optimality than by the condition number."""
    predicted = contest.predicted[HEADLINE]
    return float(predicted["condition-number"].sd[MASS] / predicted["d-optimal"].sd[MASS])


def _crowds(result: Result) -> str:
    """Return how many starts some criteria had beside the others, for a sentence."""
    if not result.crowds:
        return ""
    parts = [f"{len(crowd.costs)} by {TITLES[name]}" for name, crowd in result.crowds.items()]
    return f", {' and '.join(parts)}, whose best manoeuvres were also starts of the others"


def _flights(result: Result) -> str:
    counts = {len(realised.errors) for realised in result.realised.values()}
    if len(counts) == 1 and len(result.realised) == len(result.contest.designs):
        return f"{counts.pop()} flights of every design"
    return ", ".join(f"{len(realised.errors)} flights of {TITLES[name]}" for name, realised in result.realised.items())


def _evidence(document: Document, result: Result) -> None:
    document.section("Evidence")
    contest = result.contest
    rows = []
    for name, title in TITLES.items():
        if name in contest.motions:
            numbers = [
                cell
                for row in mission.ROWS
                for cell in (
                    format_fixed(contest.factor(name, "paper-26", row), 2),
                    format_percent(contest.worst(name, row), 2),
                    format_number(float(contest.predicted[row][name].sd[0]), 3),
                )
            ]
            rows.append([title, *numbers])
    header = [
        "manoeuvre",
        *(f"{key}, {arm}" for arm in ("5 %", "exact") for key in ("factor", "worst", "mass sd [kg]")),
    ]
    add_number_table(
        document,
        header,
        rows,
        "Predicted posteriors, arm uncertain by 5 % (1 sigma) and known exactly. Factor: geometric-mean sd of (26) as "
        "printed over that of the manoeuvre; worst: largest relative sd of mass and moments of inertia; and the sd of "
        "the base's mass.",
    )
    document.paragraph(" ".join(filter(None, [_consistent(contest), near(result)])))
    if result.crowds:
        document.figure(
            _crowd_figure(result),
            "Benefit of more starts: cost of every first descent, the best first, and mean of the best of n of them "
            "with the middle 80 % (band). Left: (26) as printed over the best value; right: geometric-mean sd per "
            f"parameter over the best by d-optimality. The dotted line is {format_percent(ALIKE)}; the square is the "
            "best after its search was completed.",
        )
    document.figure(
        _cloud_figure(result),
        "Information (minus half the log-determinant of the covariance of the base's coordinates, arm uncertain by "
        f"5 %) of {len(result.cloud.motion)} random manoeuvres, each scaled at random within the largest that "
        "satisfies the rule, against (26) in both readings and against the sum of the squared largest excursions, "
        "added in SI units without weights.",
    )
    drawn = {TITLES[name].removeprefix("best by "): contest.motions[name] for name in DRAWN if name in contest.motions}
    document.figure(
        manoeuvre_figure(drawn), "Joint positions, speed of the tip (the rule dotted) and rotation of the base."
    )


def _calibration(document: Document, result: Result) -> None:
    document.section("Calibration and failures")
    rows = []
    for name, realised in result.realised.items():
        beyond = [LABELS[k] for k in range(10) if abs(realised.rms[k] - 1.0) > WITHIN]
        rows.append(
            [
                TITLES[name],
                str(len(realised.errors)),
                f"{realised.scale:.3f} ± {scale_error(realised):.3f}",
                f"{realised.directions.min():.3f} to {realised.directions.max():.3f}",
                format_p_value(realised.p_value) if np.isfinite(realised.p_value) else NO_VALUE,
                format_percent(realised.rms_error, 2),
                ", ".join(beyond),
                format_number(float(realised.last_step.max()), 2),
            ]
        )
    add_number_table(
        document,
        [
            *("manoeuvre", "flights", "ratio, all directions", "ratio, single directions", "p of covariance"),
            *("standard error of one ratio", f"parameters off by > {format_percent(WITHIN)}", "last step [sd]"),
        ],
        [[cell or "none" for cell in row] for row in rows],
        "Flights in MuJoCo: realised over predicted sd of ten independent directions together and of each, p-value of "
        "their covariance, standard error of one ratio, and parameters whose realised error is not within "
        f"{format_percent(WITHIN)} of the predicted sd; some of ten are outside by chance alone. The modes were "
        "computed by Gauss-Newton steps with the Jacobian of the plan; last step: largest change of a coordinate in "
        "the last step.",
    )
    document.figure(
        _realised_figure(result.realised),
        "Root mean square error of each of the ten parameters over its predicted sd, and their geometric mean, by "
        f"manoeuvre. The grey band is ± {format_percent(WITHIN)}; the lines are two standard errors of one ratio about "
        "1.",
    )


def _statements(result: Result) -> list[Statement]:
    cloud, contest = result.cloud, result.contest
    printed, intended, motion = (
        " ± ".join(format_fixed(value, 2) for value in cloud.correlation(values))
        for values in (cloud.printed, cloud.intended, cloud.motion)
    )
    ranks = cloud.correlation(cloud.motion)[0]
    best = contest.factor("d-optimal", "paper-26-intended", HEADLINE)
    worse = contest.worst("poor", IDEAL) / contest.worst("printed", IDEAL)
    return [
        Statement(
            "The degree of excitation of a manoeuvre is related to the amount of base body motion (3.2).",
            Finding.CONFIRMED if ranks > 0.5 else Finding.REFUTED,
            f"Over {len(cloud.motion)} random manoeuvres the rank correlation of the information with the plain sum of "
            f"the squared excursions is {motion}, with (26) as intended {intended} and as printed {printed}.",
        ),
        Statement(
            "Maximising (26) gives the optimal exciting manoeuvre (3.3.1).",
            Finding.REFUTED if best > 1.05 else Finding.CONFIRMED,
            f"The sds of the d-optimal manoeuvre are {best:.2f} times smaller than those of the best by (26) as "
            "intended.",
        ),
        Statement(
            "A manoeuvre that turns the base little about its third axis loses precision (4.1).",
            Finding.CONFIRMED if worse > 1.0 else Finding.REFUTED,
            f"The poor neighbour's worst relative sd is {worse:.1f} times that of the printed optimum, arm known "
            "exactly.",
        ),
    ]


def _tables(result: Result) -> list[CsvTable]:
    contest = result.contest
    sds = [
        [name, row, *map(float, contest.predicted[row][name].sd)] for row in mission.ROWS for name in contest.motions
    ]
    designed = list(contest.designs.values())
    parameters = [[each.name, *map(float, each.parameters)] for each in designed]
    realised = [
        [name, len(fits.errors), *map(float, fits.rms), *map(float, fits.directions)]
        for name, fits in result.realised.items()
    ]
    ratios = [f"rms / predicted sd, {text}" for text in HEADINGS]
    ratios += [f"rms / predicted sd, direction {number}" for number in range(1, PARAMETERS + 1)]
    return [
        CsvTable("predicted", ["manoeuvre", "arm", *(f"sd {text}" for text in HEADINGS)], sds),
        CsvTable("manoeuvres", ["manoeuvre", *designed[0].problem.plan.family.names], parameters),
        CsvTable("realised", ["manoeuvre", "flights", *ratios], realised),
    ]


@styled
def _factor_figure(contest: Contest) -> Figure:
    names = [name for name in TITLES if name in contest.motions][::-1]
    figure = wide_figure(0.24 * len(names) + 0.7)
    axes = figure.subplots()
    place = np.arange(len(names))
    for row, fill in zip(mission.ROWS, ("full", "none"), strict=True):
        values = [contest.factor("d-optimal", name, row) for name in names]
        axes.plot(values, place, "o", color=COLOURS[0], fillstyle=fill, label=ARMS[row])
    axes.axvline(1.0, color="#888888", linewidth=0.8)
    axes.axvline(WANTED, color="#888888", linewidth=0.8, linestyle=":")
    axes.text(WANTED, place[-1] + 0.45, " goal for the condition number", va="bottom", ha="left", fontsize=7)
    axes.set(
        xscale="log", xlabel="geometric-mean sd over that of the d-optimal manoeuvre", ylim=(-0.6, place[-1] + 1.2)
    )
    axes.set_yticks(place, [TITLES[name] for name in names])
    ticks = [value for value in (0.5, 1, 2, 5, 10, 20, 50, 100) if value < 1.2 * axes.get_xlim()[1]]
    axes.set_xticks(ticks, [f"{value:g}" for value in ticks])
    axes.minorticks_off()
    axes.legend(loc="lower right")
    return figure


def _relative(name: str, crowd: Crowd, costs: Floats) -> Floats:
    """Return costs as ratios to the best first descent: of sds per parameter, or of the values of (26)."""
    best = crowd.costs.min()
    return np.exp((costs - best) / PARAMETERS) if name == "d-optimal" else np.asarray(costs / best)


@styled
def _crowd_figure(result: Result) -> Figure:
    figure = wide_figure(1.9)
    panels = figure.subplots(1, len(result.crowds))
    for axes, (name, crowd) in zip(panels, result.crowds.items(), strict=True):
        ordered, total = np.sort(crowd.costs), len(crowd.costs)
        counts = np.unique(np.geomspace(1, total, 30).astype(int))
        shares = np.array([crowd.share_of_best(count) for count in counts])
        middle = [[ordered[np.searchsorted(np.cumsum(row), part)] for row in shares] for part in (0.1, 0.9)]
        low, high = (_relative(name, crowd, np.array(part)) for part in middle)
        axes.fill_between(counts, low, high, color=COLOURS[0], alpha=0.2, linewidth=0.0)
        axes.plot(counts, _relative(name, crowd, shares @ ordered), color=COLOURS[0], label="best of n, mean")
        axes.plot(1 + np.arange(total), _relative(name, crowd, ordered), ".", color=COLOURS[1], label="each descent")
        axes.plot(total, _relative(name, crowd, np.array(crowd.cost)), "s", color=COLOURS[2], label="completed")
        axes.axhline(1.0 + ALIKE if name == "d-optimal" else 1.0 - ALIKE, color="#888888", linestyle=":", linewidth=0.8)
        axes.set(xscale="log", xlabel="number of starts n, or rank", title=TITLES[name])
        axes.set_xticks([1, 3, 10, 30, 100], ["1", "3", "10", "30", "100"])
        axes.minorticks_off()
    panels[0].set_ylabel("over the best first")
    shared_legend(figure, panels[0], 3)
    return figure


@styled
def _cloud_figure(result: Result) -> Figure:
    cloud = result.cloud
    figure = wide_figure(1.8)
    titles = ("Eq. (26) as printed", "Eq. (26), corrected", "sum of squared excursions")
    panels = figure.subplots(1, 3, sharey=True)
    units = ("", "", " m², rad²")
    clouds = (cloud.printed, cloud.intended, cloud.motion)
    for axes, title, unit, values in zip(panels, titles, units, clouds, strict=True):
        axes.plot(1e3 * values, cloud.information, ".", color=COLOURS[0], markersize=3)
        axes.set_title(f"rank correlation {format_fixed(cloud.correlation(values)[0], 2)}")
        axes.set_xlabel(f"{title}\n[10⁻³{unit}]")
    panels[0].set_ylabel("information [nats]")
    return figure


@styled
def _realised_figure(realised: Mapping[str, Realised]) -> Figure:
    """Draw the ten ratios of every manoeuvre on its line, and their geometric mean."""
    figure = wide_figure(max(1.5, 0.55 + 0.19 * len(realised)))
    axes = figure.subplots()
    axes.axvspan(1.0 - WITHIN, 1.0 + WITHIN, **BAND)
    for row, each in enumerate(realised.values()):
        reach = 2.0 * each.rms_error
        axes.plot([1.0 - reach, 1.0 + reach], [row, row], color=TRUTH, label=None if row else "± 2 standard errors")
        axes.plot(each.rms, np.full(10, row), "o", color=AFTER, markersize=3.5, label=None if row else "parameter")
        axes.plot(each.ratio, row, "|", color=BEFORE, markersize=11, mew=2, label=None if row else "geometric mean")
    axes.set_yticks(range(len(realised)), [TITLES[name] for name in realised])
    axes.set(xlabel="realised / predicted sd", ylim=(len(realised) - 0.5, -0.5))
    shared_legend(figure, axes, 3)
    return figure


def _run(full: bool, seed: int, store: Path | None, **options: Any) -> Result:
    """Run the study with the searches in threads, their results kept in a file where one is given."""
    kept = None if store is None else Store.open(store, f"excitation {seed} {FULL if full else QUICK}")
    with ThreadPoolExecutor(os.cpu_count()) as executor:
        return run(full=full, seed=seed, store=kept, executor=executor, **options)


STUDY = Study(
    "excitation",
    "Compare manoeuvres by the posterior that they give.",
    run=_run,
    report=_report,
    full="all criteria, the thorough effort for each search, every design flown",
    seed=1,
    extra={
        "--repeats": {"type": int, "help": "number of flights of each design that is flown"},
        "--starts": {"type": int, "help": "number of further descents by (26) and d-optimality"},
        "--searches": {"type": int, "help": "number of thorough searches by d-optimality that are compared"},
        "--store": {"type": Path, "help": "file that stores the results of the searches, to resume an interrupted run"},
        **TRIALS,
    },
)
