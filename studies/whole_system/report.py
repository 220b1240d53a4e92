"""Report of the study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy import stats

from bayesid import Robot
from bayesid.report import Document, format_quantity
from bayesid.report.figures.figure_style import COLOURS, styled, wide_figure
from bayesid.report.numbers import format_fixed, format_number, format_percent
from bayesid.robot.inertial_parameters import mass_com_inertia
from studies.common.ets7 import ACCEL, ENCODER, RATE
from studies.common.report_parts import QUANTITY_TITLES, columns, not_evaluated
from studies.whole_system.contest import Method
from studies.whole_system.coverage import Coverage
from studies.whole_system.information import Information, Known, Sensors
from studies.whole_system.sampled import Sampled
from studies.whole_system.setting import ARM, BASE_SPREAD, COULOMB, LOAD, LOAD_SPREAD, TORQUE, VISCOUS, bodies, groups

__all__ = ["Result", "write_report"]

GROUPS = ("base", "load", "arm", "whole system")
"""Titles of the columns for the masses of `groups`."""

COORDINATES = ("α", "d1", "d2", "d3", "s12", "s23", "s13", "t1", "t2", "t3")
"""Titles of the ten log-Cholesky coordinates of a body."""

CONTENT = float(stats.chi2.cdf(1.0, 1))
"""Probability within one standard deviation of a normal distribution."""


@dataclass(frozen=True)
class Result:
    """Outcome of the study; samples and coverage are evaluated in a full run only.

    Attributes
    ----------
    truth, drawings : Robot
        The robot as it truly is, and as the drawings state it.
    known : mapping of str to Information
        Information of every manoeuvre by name.
    cases : tuple of Sampled
        Identifications with emcee.
    coverage : Coverage or None
        Errors over systems drawn from the prior.
    methods : tuple of Method
        Errors of the linear and of the integral method.
    duration : float
        Duration of each manoeuvre [s].
    hand_speed : float
        Largest speed of the end-effector relative to the base with six joints moving [m/s].
    """

    truth: Robot
    drawings: Robot
    known: Mapping[str, Information]
    cases: tuple[Sampled, ...]
    coverage: Coverage | None
    methods: tuple[Method, ...]
    duration: float
    hand_speed: float


def write_report(result: Result, output: Path) -> None:
    """Write the report as PDF."""
    document = Document("The whole system identified", "Problem 3 of Lampariello and Hirzinger (2005)")
    _summary(document, result)
    _manoeuvres(document, result)
    _parts(document, result)
    _samples(document, result)
    _coverage(document, result)
    _methods(document, result)
    _assumed(document, result)
    document.write(output)


def _percents(knowledge: Known, *, before: bool = False) -> list[str]:
    """Return the relative standard deviations of four masses in the order of `GROUPS`, before or after the data."""
    pairs = [knowledge.mass(*members) for members in groups(knowledge.robot).values()]
    return [format_percent(prior if before else after, 2) if prior else "known" for prior, after in pairs]


def _summary(document: Document, result: Result) -> None:
    six = result.known["six joints"]
    motion, torques = (six.knowledge(sensors) for sensors in (Sensors.MOTION, Sensors.TORQUES))
    thrust = result.known["six joints, known thrust"].knowledge(Sensors.MOTION)
    linear = next(method for method in result.methods if method.title == "regressors, motion alone")
    document.section("Question and answer")
    document.paragraph(
        "ETS-VII holds a load of 120 kg. The ten inertial parameters of no body are known exactly: the arm's six "
        f"links are known from drawings to {100 * ARM:g} % in log-Cholesky coordinates ({200 * ARM:g} % of each "
        f"mass), the base to {100 * BASE_SPREAD:g} %, the load to {100 * LOAD_SPREAD:g} %. These are 80 unknowns, to "
        f"which the initial rate is added. What do {result.duration:g} s of motion and its sensors teach?"
    )
    document.items(
        [
            "Motion alone fixes the ratios of the masses and not their scale. The scale comes from the drawings of "
            f"the arm: the mass of the whole system is known to {_percents(motion)[3]} after the manoeuvre and to "
            f"{_percents(motion, before=True)[3]} before.",
            f"Measured joint torques bring the scale, to {_percents(torques)[3]}, although the friction of every "
            f"joint is unknown. A known thrust brings it without them, to {_percents(thrust)[3]}.",
            f"Of the 80 directions in which the bodies could differ, the data narrow {motion.contraction} (motion) or "
            f"{torques.contraction} (with torques) to less than half of the prior. The others keep their prior and "
            "are reported as such: the base parameters tell which combinations can be identified in principle, the "
            "manoeuvre and the noise which of them are.",
            "The paper's linear regressor method (19), applied to motion alone, estimates a system of "
            f"{100.0 * (1.0 + linear.errors[:, 3].mean()):.2g} % of the true mass. Its right side is zero, and least "
            "squares with noisy entries takes the smallest parameters that explain it. The integral of the motion "
            "does not have that problem.",
        ]
    )


def _manoeuvres(document: Document, result: Result) -> None:
    document.section("What each manoeuvre and each sensor teaches")
    rows = []
    for name, information in result.known.items():
        for sensors in Sensors:
            knowledge = information.knowledge(sensors)
            rows.append([name, sensors.value[0], str(knowledge.contraction), *_percents(knowledge)])
    prior = result.known["six joints"].knowledge(Sensors.MOTION)
    document.table(
        ["manoeuvre", "sensors", "directions learnt", *GROUPS],
        [*rows, ["before", "drawings", "0", *_percents(prior, before=True)]],
        "Relative standard deviation of four masses after one manoeuvre, and the number of directions (of 80) whose "
        "width the data at least halve. The information is linearised about the truth. With joint torques, friction "
        "in every joint is unknown.",
        columns("llrrrrr"),
    )
    document.figure(
        _directions_figure({name: info.knowledge(Sensors.TORQUES) for name, info in result.known.items()}),
        "Ratio of posterior to prior width of the 80 independent directions with all sensors, best known first. A "
        "ratio of one (10⁰) means that the data are not informative.",
    )
    document.figure(
        _shrinkage_figure(result.known["six joints"]),
        "What six moving joints teach of each log-Cholesky coordinate of each body: one minus the ratio of posterior "
        "to prior width, with motion alone and with joint torques. Where a cell is white, the posterior is the prior.",
    )


def _parts(document: Document, result: Result) -> None:
    document.section("What must be known")
    parts = groups(result.truth)
    cases: dict[str, tuple[str, ...]] = {"nothing": (), "link 2 (22.5 kg)": ("link2",)}
    cases |= {f"the {name}": parts[name] for name in ("arm", "load", "base")}
    vague = dict.fromkeys(bodies(result.truth), 1.0)
    before = result.known["six joints"].knowledge(Sensors.MOTION, widths=vague)
    rows = [["nothing", "before any", "", *_percents(before, before=True)]]
    for title, known in cases.items():
        for name, sensors in (
            ("six joints", Sensors.MOTION),
            ("six joints", Sensors.TORQUES),
            ("six joints, known thrust", Sensors.MOTION),
        ):
            knowledge = result.known[name].knowledge(sensors, known=known, widths=vague)
            rows.append([title, name, sensors.value[0], *_percents(knowledge)])
    document.paragraph(
        "The paper concludes that part of the system must be known to identify the whole. Here no drawings help: "
        "every body that is not known has a prior of 100 % in log-Cholesky coordinates, 200 % of its mass. Motion "
        "alone then leaves the scale to the prior, with or without gravity gradient, and one known body of any size "
        "restores it, as far as the motion ties the others to it. Joint torques or a known thrust restore it with "
        "nothing known."
    )
    document.table(
        ["known exactly", "manoeuvre", "sensors", *GROUPS],
        rows,
        "Relative standard deviation of four masses without drawings. A value above 100 % only means that nothing is "
        "known, since the linearisation does not hold there.",
        columns("lllrrrr"),
    )


def _samples(document: Document, result: Result) -> None:
    document.section("Identified and sampled")
    if not result.cases:
        not_evaluated(document)
        return
    document.paragraph(
        "The drawings are one draw such that the truth is a draw of the prior about them; for the load they state "
        f"{result.drawings.link(LOAD).inertial.mass:.3g} kg. One recording with noise, with all six joints moving, is "
        "identified with emcee. Its ensembles propose in coordinates linear in the parameters, where the ridges that "
        "the unknown scale makes are straight."
    )
    rows = []
    for case in result.cases:
        r = case.result
        numbers = [
            str(r.posterior.size),
            f"{r.chains.effective_samples:.0f}",
            f"{r.chains.r_hat:.4f}",
            str(r.chains.evaluations),
            f"{r.evidence.pareto_k:.2f}",
            f"{r.evidence.value:.2f} ± {r.evidence.error:.2f}" if r.evidence.trusted else "not evaluated",
            f"{r.optimum.chi2 / r.posterior.samples:.3f}",
            f"{case.distance:.0f} ({case.p_value:.2f})",
        ]
        rows.append([case.title, *numbers])
    titles = [
        "unknowns",
        "eff. samples",
        "R-hat",
        "evaluations",
        "k-hat",
        "log evidence",
        "chi²/sample",
        "distance (p)",
    ]
    document.table(
        ["sensors", *titles],
        rows,
        "Convergence, importance sampling (the evidence is evaluated where Pareto k-hat is below 0.7), and the "
        "squared distance of the true bodies from the mean, to be compared with their 80 unknowns.",
        columns("lrrrrrrrr"),
    )
    for case in result.cases:
        document.table(
            ["body", "quantity", "true", "drawings", "identified ± standard deviation (sd)", "error / sd"],
            _body_rows(case, result.drawings),
            f"Identified from {case.title}: masses of all bodies, and all parameters of the load.",
            columns("llrrrr"),
        )
        for sentence in case.result.disagreements:
            document.paragraph(sentence)


def _body_rows(case: Sampled, drawings: Robot) -> list[list[str]]:
    rows = []
    for name, body in case.result.bodies.items():
        stated = mass_com_inertia(drawings.link(name).inertial.vector)
        for k, title in enumerate(QUANTITY_TITLES if name == LOAD else QUANTITY_TITLES[:1]):
            true, mean, sd = float(case.truth[name][k]), float(body.mean[k]), float(body.sd[k])
            numbers = [format_number(true, 4), format_number(float(stated[k]), 4), format_quantity(mean, sd)]
            rows.append([name, title, *numbers, format_fixed((mean - true) / sd, 1)])
    return rows


def _coverage(document: Document, result: Result) -> None:
    document.section("Does the uncertainty hold the truth?")
    coverage = result.coverage
    if coverage is None:
        not_evaluated(document)
        return
    count, n = len(coverage.distances), coverage.unknowns
    inside = (np.abs(coverage.scores) < 1.0).sum(axis=0)
    document.paragraph(
        f"{count} systems were drawn from the prior. Each was flown by the independent simulator on another manoeuvre "
        f"of {0.5 * result.duration:g} s, recorded with fresh noise, and identified from motion alone. The squared "
        f"distance of the truth should be chi-square with {n} degrees of freedom: its mean is "
        f"{coverage.distances.mean():.1f} ± {np.sqrt(2.0 * n / count):.1f}, and the Kolmogorov-Smirnov test gives p = "
        f"{coverage.p_value:.2f}. The masses of base, load and whole system lie within one standard deviation in "
        f"{inside[0]}, {inside[1]} and {inside[2]} cases of {count} ({CONTENT * count:.0f} ± "
        f"{np.sqrt(count * CONTENT * (1.0 - CONTENT)):.0f} expected)."
    )
    document.figure(
        _coverage_figure(coverage),
        "Squared distances of the truth in the drawn systems, sorted, against quantiles of chi-square.",
    )


def _methods(document: Document, result: Result) -> None:
    document.section("Regressors against the integral of the motion")
    count = len(result.methods[0].errors)
    document.paragraph(
        "The paper compares the linear regressor method (19) with the least squares of the integrated motion (21). "
        f"Here both get the same {count} recordings of one flight that differ by their noise, and the same prior of "
        "base and arm. The linear method differentiates the rates with local cubics over nine samples, weights every "
        "equation by its residuals, and gets no prior of the load, which would be wrong when made normal. The "
        "integral method is the mode of this package's posterior, with encoder noise carried through the dynamics; "
        "its fits start at the truth, to save time."
    )
    rows = []
    for method in result.methods:
        for k, (group, errors, stated) in enumerate(zip(GROUPS, method.errors.T, method.believed.T, strict=True)):
            spread = errors.std(ddof=1)
            mean = format_quantity(100.0 * errors.mean(), 100.0 * spread / np.sqrt(count))
            widths = [format_percent(float(width), 2) for width in (spread, stated.mean())]
            rows.append(["" if k else method.title, f"mass of the {group}", f"{mean} %", *widths])
    document.table(
        ["method", "quantity", "mean error ± its uncertainty", "spread", "stated sd"],
        rows,
        "Relative errors of masses over recordings with fresh noise. The truth is fixed here, so that the mean error "
        "includes that of the drawings where the data do not overrule them; the stated standard deviation (sd) covers "
        "both.",
        columns("llrrr"),
    )


def _assumed(document: Document, result: Result) -> None:
    document.section("Assumptions")
    document.items(
        [
            "The truth is the published ETS-VII (base of the paper; sources of the arm in the robot file) with a "
            "rigid load on link 6. MuJoCo simulates the motion with gravity gradient on every body; joints follow "
            "their path exactly.",
            f"The noise per sample at 2 Hz is {RATE:g} rad/s of the rate, {ACCEL:g} m/s² of the accelerometer, "
            f"{ENCODER:g} rad of the encoders, and {TORQUE:g} N m of the joint torques.",
            f"Friction of {COULOMB:g} N m (dry) and {VISCOUS:g} N m s (viscous) in every joint is added to the "
            "torques by its formula. It is unknown to the identification, with priors of 5 N m and 50 N m s.",
            "Manoeuvres are sums of three sines between 0.02 and 0.06 Hz under ramps, with excursions of about half a "
            f"radian. The end-effector reaches {result.hand_speed:.2g} m/s relative to the base, where the flight "
            "allowed 0.05. The known thrust has two pulses of 20 N over 2 s on the base.",
            "Widths of directions and masses are from information linearised about the truth; the sampled posteriors "
            "are not linearised.",
        ]
    )


@styled
def _directions_figure(knowledge: Mapping[str, Known]) -> Figure:
    figure = wide_figure(2.6)
    axes = figure.subplots()
    for colour, (name, known) in zip(COLOURS, knowledge.items(), strict=False):
        widths = np.maximum(known.directions, 1e-9)
        axes.semilogy(np.arange(1, len(widths) + 1), widths, ".-", color=colour, markersize=3.0, label=name)
    axes.axhline(0.5, color="grey", linewidth=0.6)
    axes.set(xlabel="direction", ylabel="posterior / prior width")
    axes.legend()
    return figure


@styled
def _shrinkage_figure(information: Information) -> Figure:
    figure = wide_figure(2.9)
    panels = figure.subplots(1, 2, sharey=True)
    names = bodies(information.robot)
    for axes, sensors in zip(panels, (Sensors.MOTION, Sensors.TORQUES), strict=True):
        knowledge = information.knowledge(sensors)
        values = np.array([knowledge.shrinkage(name) for name in names])
        axes.imshow(values, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
        axes.set_xticks(range(10), COORDINATES)
        axes.set_yticks(range(len(names)), names)
        axes.set_title(sensors.value[0])
    figure.colorbar(panels[0].images[0], ax=panels, label="shrinkage")
    return figure


@styled
def _coverage_figure(coverage: Coverage) -> Figure:
    figure = wide_figure(2.4)
    axes = figure.subplots()
    count = len(coverage.distances)
    quantiles = stats.chi2(coverage.unknowns).ppf((np.arange(count) + 0.5) / count)
    axes.plot(quantiles, np.sort(coverage.distances), ".", color=COLOURS[0])
    axes.plot(quantiles[[0, -1]], quantiles[[0, -1]], color="black", linewidth=0.6)
    axes.set(xlabel=f"quantile of chi-square, {coverage.unknowns} degrees of freedom", ylabel="squared distance")
    return figure
