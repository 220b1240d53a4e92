"""The study's report."""

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
from bayesid.report.numbers import format_number
from studies.common.ets7 import ACCEL, BASE, ENCODER, RATE
from studies.whole_system.contest import QUANTITIES, Method
from studies.whole_system.coverage import Coverage
from studies.whole_system.information import Information, Known, Sensors
from studies.whole_system.sampled import Sampled
from studies.whole_system.setting import ARM, BASE_SPREAD, COULOMB, LOAD, LOAD_SPREAD, TORQUE, VISCOUS, bodies

__all__ = ["Result", "write_report"]

GROUPS = ("base", "load", "arm", "whole system")
KEYS = ("mass", "com x", "com y", "com z", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")


@dataclass(frozen=True)
class Result:
    """What the study found; samples and coverage in a full run only.

    ``known`` holds the information of every manoeuvre by name; ``hand_speed`` is the largest relative to the base with
    six joints moving [m/s].
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


def masses(knowledge: Known) -> list[tuple[float, float]]:
    """Prior and posterior relative width of four masses, in the order of `GROUPS`."""
    names = bodies(knowledge.robot)
    arm = [name for name in names if name not in (BASE, LOAD)]
    return [knowledge.mass(*members) for members in ((BASE,), (LOAD,), arm, names)]


def _summary(document: Document, result: Result) -> None:
    six = result.known["six joints"]
    motion, torques = (masses(six.knowledge(sensors)) for sensors in (Sensors.MOTION, Sensors.TORQUES))
    thrust = masses(result.known["six joints, known thrust"].knowledge(Sensors.MOTION))
    document.section("What was asked, and what came out")
    document.paragraph(
        "ETS-VII holds a load of 120 kg. Of no body the ten inertial parameters are known exactly: the arm's six links "
        f"are known from drawings to {100 * ARM:g} % in log-Cholesky coordinates ({200 * ARM:g} % of each mass), the "
        f"base to {100 * BASE_SPREAD:g} %, the load to {100 * LOAD_SPREAD:g} %: 80 unknowns and the initial rate. What "
        f"do {result.duration:g} s of motion and its sensors teach?"
    )
    document.items(
        [
            f"Motion alone fixes ratios of masses and not their scale. The scale comes from the drawings of the arm: "
            f"the mass of the whole system is known to {_percent(motion[3][1])}, from {_percent(motion[3][0])} before.",
            f"Measured joint torques bring the scale, although friction in every joint is unknown: "
            f"{_percent(torques[3][1])}. A known thrust does the same without them: {_percent(thrust[3][1])}.",
            f"Of the 80 directions in which the bodies could differ, the data narrow "
            f"{six.knowledge(Sensors.MOTION).contraction} (motion) or "
            f"{six.knowledge(Sensors.TORQUES).contraction} (torques too) to less than half of the prior. The rest "
            "is the prior and is reported as such: the base parameters tell which combinations could "
            "ever be learnt, the manoeuvre and the noise which of them are.",
            _regressor_sentence(result),
        ]
    )


def _regressor_sentence(result: Result) -> str:
    linear = next(m for m in result.methods if m.title == "regressors, motion alone")
    whole = linear.errors[:, 3].mean()
    return (
        "The paper's linear regressor method (19), used on motion alone, answers with a system of "
        f"{100.0 * (1.0 + whole):.2g} % of the true mass: its right side is zero, and least squares with noisy entries "
        "takes the smallest parameters that explain it. The integral of the motion does not have that problem."
    )


def _manoeuvres(document: Document, result: Result) -> None:
    document.section("What each manoeuvre and each sensor teaches")
    rows = []
    for name, information in result.known.items():
        for sensors in Sensors:
            knowledge = information.knowledge(sensors)
            rows.append(
                [
                    name,
                    sensors.value[0],
                    str(knowledge.contraction),
                    *(_percent(width) for _, width in masses(knowledge)),
                ]
            )
    prior = masses(result.known["six joints"].knowledge(Sensors.MOTION))
    rows.append(["before", "drawings", "0", *(_percent(width) for width, _ in prior)])
    document.table(
        ["manoeuvre", "sensors", "directions learnt", *GROUPS],
        rows,
        "Relative standard deviation of four masses after one manoeuvre, and the number of directions (of 80) whose "
        "width the data at least halve. The information is linearised about the truth. With joint torques, friction "
        "in every joint is unknown.",
        ["left", "left", "right", "right", "right", "right", "right"],
    )
    document.figure(
        _directions_figure({name: info.knowledge(Sensors.TORQUES) for name, info in result.known.items()}),
        "Posterior over prior width of the 80 independent directions, all sensors, best known first. At one (10⁰) the "
        "data said nothing.",
    )
    document.figure(
        _shrinkage_figure(result.known["six joints"]),
        "What six moving joints teach of each log-Cholesky coordinate of each body: one less the ratio of posterior to "
        "prior width, with motion alone and with joint torques. White: the answer is the prior.",
    )


def _parts(document: Document, result: Result) -> None:
    document.section("What must be known")
    names = bodies(result.truth)
    arm = tuple(name for name in names if name not in (BASE, LOAD))
    cases: dict[str, tuple[str, ...]] = {
        "nothing": (),
        "link 2 (22.5 kg)": ("link2",),
        "the arm": arm,
        "the load": (LOAD,),
        "the base": (BASE,),
    }
    vague = dict.fromkeys(names, 1.0)
    before = masses(result.known["six joints"].knowledge(Sensors.MOTION, widths=vague))
    rows = [["nothing", "before any", "", *(_percent(width) for width, _ in before)]]
    for title, known in cases.items():
        for name, sensors in (
            ("six joints", Sensors.MOTION),
            ("six joints", Sensors.TORQUES),
            ("six joints, known thrust", Sensors.MOTION),
        ):
            knowledge = result.known[name].knowledge(sensors, known=known, widths=vague)
            widths = masses(knowledge)
            rows.append(
                [title, name, sensors.value[0], *(_percent(after) if prior else "known" for prior, after in widths)]
            )
    document.paragraph(
        "The paper concludes that part of the system must be known to identify the whole. Here no drawings help: every "
        "body that is not known has a prior of 100 % in log-Cholesky coordinates, 200 % of its mass. Motion alone then "
        "leaves the scale to the prior, gravity gradient or not, and one known body of any size restores it, "
        "as far as the motion ties the others to it. Joint torques or a known thrust do so with nothing known."
    )
    document.table(
        ["known exactly", "manoeuvre", "sensors", *GROUPS],
        rows,
        "Relative standard deviation of four masses without drawings. Above 100 % the linearisation means no more than "
        "that nothing is known.",
        ["left", "left", "left", "right", "right", "right", "right"],
    )


def _samples(document: Document, result: Result) -> None:
    document.section("Identified and sampled")
    if not result.cases:
        document.paragraph("Not evaluated: only the full study has it.")
        return
    document.paragraph(
        "The drawings are one draw such that the truth is a draw of the prior about them; for the load they say "
        f"{result.drawings.link(LOAD).inertial.mass:.3g} kg. One recording with noise, all six joints moving, is "
        "identified with emcee: ensembles propose in coordinates linear in the parameters, where the ridges that the "
        "unknown scale makes are straight."
    )
    rows = []
    for case in result.cases:
        r = case.result
        rows.append(
            [
                case.title,
                str(r.posterior.size),
                f"{r.chains.effective_samples:.0f}",
                f"{r.chains.r_hat:.4f}",
                f"{r.chains.evaluations}",
                f"{r.evidence.pareto_k:.2f}",
                f"{r.evidence.value:.2f} ± {r.evidence.error:.2f}" if r.evidence.trusted else "not evaluated",
                f"{r.optimum.chi2 / r.posterior.samples:.3f}",
                f"{case.distance:.0f} ({case.p_value:.2f})",
            ]
        )
    document.table(
        [
            "sensors",
            "unknowns",
            "eff. samples",
            "R-hat",
            "evaluations",
            "k-hat",
            "log evidence",
            "chi²/sample",
            "distance (p)",
        ],
        rows,
        "Convergence, importance sampling (evidence is evaluated where Pareto k-hat is below 0.7), and the squared "
        "distance of the true bodies from the mean, to be compared with their 80 unknowns.",
        ["left", *["right"] * 8],
    )
    for case in result.cases:
        document.table(
            ["body", "quantity", "true", "drawings", "identified ± sd", "error / sd"],
            _body_rows(case, result.drawings),
            f"Identified from {case.title}: masses of all bodies, and everything of the load.",
            ["left", "left", "right", "right", "right", "right"],
        )
        for sentence in case.result.disagreements:
            document.paragraph(sentence)


def _body_rows(case: Sampled, drawings: Robot) -> list[list[str]]:
    rows = []
    for name, body in case.result.bodies.items():
        given = drawings.link(name).inertial
        drawn = [given.mass, *given.com, *(given.inertia[i] for i in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))]
        for k, key in enumerate(KEYS if name == LOAD else KEYS[:1]):
            unit = "kg" if k == 0 else "m" if k < 4 else "kg m²"
            true, mean, sd = float(case.truth[name][k]), float(body.mean[k]), float(body.sd[k])
            rows.append(
                [
                    name,
                    f"{key} [{unit}]",
                    format_number(true, 4),
                    format_number(float(drawn[k]), 4),
                    format_quantity(mean, sd),
                    f"{(mean - true) / sd:.1f}",
                ]
            )
    return rows


def _coverage(document: Document, result: Result) -> None:
    document.section("Does the uncertainty hold the truth?")
    coverage = result.coverage
    if coverage is None:
        document.paragraph("Not evaluated: only the full study has it.")
        return
    count, n = len(coverage.distances), coverage.unknowns
    inside = (np.abs(coverage.scores) < 1.0).sum(axis=0)
    document.paragraph(
        f"{count} systems were drawn from the prior, each flown by the independent simulator on a manoeuvre of its own "
        f"of {0.5 * result.duration:g} s and recorded with fresh noise, and identified from motion alone. The squared "
        f"distance of the truth should be chi-square with {n} degrees of freedom: its mean is "
        f"{coverage.distances.mean():.1f} ± {np.sqrt(2.0 * n / count):.1f}, the Kolmogorov-Smirnov test gives p = "
        f"{coverage.p_value:.2f}. Within one standard deviation lie the masses of base, load and whole system in "
        f"{inside[0]}, {inside[1]} and {inside[2]} cases of {count} ({0.683 * count:.0f} ± "
        f"{np.sqrt(count * 0.683 * 0.317):.0f} expected)."
    )
    document.figure(
        _coverage_figure(coverage),
        "Squared distances of the truth in the drawn systems, sorted, against quantiles of chi-square.",
    )


def _methods(document: Document, result: Result) -> None:
    document.section("Regressors against the integral of the motion")
    count = len(result.methods[0].errors)
    document.paragraph(
        "The paper sets the linear regressor method (19) against the least squares of the integrated motion (21). Both "
        f"get the same {count} recordings of one flight that differ by their noise, and the same prior of base and "
        "arm. The linear method differentiates the rates with local cubics over nine samples, weights every equation "
        "by its own residuals, and gets no prior of the load, which would be wrong when made normal. The integral "
        "method is the mode of this package's posterior, with encoder noise carried through the dynamics; its fits "
        "start at the truth, to save time."
    )
    rows = []
    for method in result.methods:
        for k, quantity in enumerate(QUANTITIES):
            errors, believed = method.errors[:, k], method.believed[:, k]
            bias, spread = errors.mean(), errors.std(ddof=1)
            rows.append(
                [
                    method.title if k == 0 else "",
                    quantity,
                    f"{format_quantity(100.0 * bias, 100.0 * spread / np.sqrt(count))} %",
                    _percent(spread),
                    _percent(float(believed.mean())),
                ]
            )
    document.table(
        ["method", "quantity", "mean error ± its uncertainty", "spread", "sd it states"],
        rows,
        "Relative errors of masses over recordings with fresh noise. The truth is fixed here, so that the mean error "
        "holds that of the drawings where the data leave them in force; the stated sd covers both.",
        ["left", "left", "right", "right", "right"],
    )


def _assumed(document: Document, result: Result) -> None:
    document.section("What was assumed")
    document.items(
        [
            "Truth: the published ETS-VII (paper's base, sources of the arm in the robot file) with a rigid load on "
            "link 6; motion by MuJoCo with gravity gradient on every body; joints follow their path exactly.",
            f"Noise per sample at 2 Hz: rate {RATE:g} rad/s, accelerometer {ACCEL:g} m/s², encoders {ENCODER:g} rad, "
            f"joint torques {TORQUE:g} N m.",
            f"Friction in every joint: {COULOMB:g} N m dry and {VISCOUS:g} N m s viscous, added to the torques by its "
            "formula; unknown to the identification, with priors of 5 N m and 50 N m s.",
            "Manoeuvres: sums of three sines between 0.02 and 0.06 Hz under ramps, excursions of about half a radian; "
            f"the end-effector reaches {result.hand_speed:.2g} m/s relative to the base, the flight allowed 0.05. "
            "Known thrust: two pulses of 20 N over 2 s on the base.",
            "Widths of directions and masses from information linearised about the truth; the sampled posteriors are "
            "not linearised.",
        ]
    )


@styled
def _directions_figure(knowledge: Mapping[str, Known]) -> Figure:
    figure = wide_figure(2.6)
    axes = figure.subplots()
    for index, (name, known) in enumerate(knowledge.items()):
        widths = np.maximum(known.directions, 1e-9)
        axes.semilogy(np.arange(1, len(widths) + 1), widths, ".-", color=COLOURS[index], markersize=3.0, label=name)
    axes.axhline(0.5, color="grey", linewidth=0.6)
    axes.set_xlabel("direction")
    axes.set_ylabel("posterior / prior width")
    axes.legend()
    return figure


@styled
def _shrinkage_figure(information: Information) -> Figure:
    figure = wide_figure(2.9)
    panels = figure.subplots(1, 2, sharey=True)
    names = bodies(information.robot)
    image = None
    for axes, sensors in zip(panels, (Sensors.MOTION, Sensors.TORQUES), strict=True):
        knowledge = information.knowledge(sensors)
        values = np.array([knowledge.shrinkage(name) for name in names])
        image = axes.imshow(values, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
        axes.set_xticks(range(10), ["α", "d1", "d2", "d3", "s12", "s23", "s13", "t1", "t2", "t3"])
        axes.set_yticks(range(len(names)), names)
        axes.set_title(sensors.value[0])
    if image is not None:
        figure.colorbar(image, ax=panels, label="shrinkage")
    return figure


@styled
def _coverage_figure(coverage: Coverage) -> Figure:
    figure = wide_figure(2.4)
    axes = figure.subplots()
    count = len(coverage.distances)
    quantiles = stats.chi2(coverage.unknowns).ppf((np.arange(count) + 0.5) / count)
    axes.plot(quantiles, np.sort(coverage.distances), ".", color=COLOURS[0])
    ends = [quantiles[0], quantiles[-1]]
    axes.plot(ends, ends, color="black", linewidth=0.6)
    axes.set_xlabel(f"quantile of chi-square, {coverage.unknowns} degrees of freedom")
    axes.set_ylabel("squared distance")
    return figure


def _percent(relative: float) -> str:
    return f"{format_number(100.0 * relative, 2)} %"
