"""Report of the study."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.figure import Figure
from scipy import stats

from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.report import Document, format_quantity
from bayesid.report.figures.figure_style import AFTER, COLOURS, TRUTH, shared_legend, styled, wide_figure
from bayesid.report.numbers import format_fixed, format_number, format_percent
from bayesid.robot.inertial_parameters import mass_com_inertia
from studies.common.ets7 import ACCEL, ENCODER, RATE, START, TIP_SPEED, ets7
from studies.common.figures import robot_outline
from studies.common.report_parts import columns
from studies.common.study import CsvTable, Finding, Goal, Picture, Report, Setup, Statement, Study, Verdict
from studies.whole_system.identification import SCORED, TAIL, Coverage, Method, Result, Sampled, run
from studies.whole_system.system import (
    BASE_SPREAD,
    COULOMB,
    LOAD_SPREAD,
    TORQUE,
    VISCOUS,
    Information,
    Known,
    Sensors,
    bodies,
    groups,
)

GROUPS = ("base", "load", "arm", "whole system")  # titles of the columns for the masses of `groups`

# titles of the ten log-Cholesky coordinates of a body
COORDINATES = ("α", "d1", "d2", "d3", "s12", "s23", "s13", "t1", "t2", "t3")

LEVEL = 0.05  # P-value below which a test fails
WANTED = 0.01  # wanted relative standard deviation of the mass of the whole system
FAR = 3.0  # mean error of a method in its own stated standard deviations from which on it is biased
CONTENT = float(stats.chi2.cdf(1.0, 1))  # probability within one standard deviation of a normal distribution


# manoeuvres and sensors of the first page
CHIEF = (("six joints", Sensors.MOTION), ("six joints", Sensors.TORQUES), ("six joints, known thrust", Sensors.MOTION))


def _report(result: Result) -> Report[Result]:
    motion, torques, thrust = (_percents(_known(result, *case))[3] for case in CHIEF)
    # widths at the permitted speed are larger
    haste = f"{format_fixed(result.hand_speed / TIP_SPEED, 1)} times as fast as the flight's rule permits"
    drawn = ""
    if result.coverage is not None:
        drawn = f" {len(result.coverage.distances)} systems drawn from the prior, each on its own manoeuvre."
    return Report(
        title="The whole system identified",
        subtitle="Problem 3 of Lampariello and Hirzinger (IDETC 2005)",
        question="ETS-VII holds a load of 120 kg and the ten inertial parameters of no body are known exactly: what "
        "does one manoeuvre teach, with which sensors, and what must be known?",
        answer="Motion alone fixes ratios of masses and not their scale, which stays known as the drawings know it "
        f"(whole system: {motion}); joint torques bring it to {torques} and a known thrust to {thrust}, with a "
        f"manoeuvre that moves the tip {haste}.",
        valid=f"the tip moves {haste}, joints follow their path, the load is rigid and noise is white; widths are "
        "linearised about the truth unless they are said to be sampled.",
        goals=_goals(result),
        full=result.coverage is not None,
        figure=Picture(
            _mass_figure(result),
            "Relative standard deviation of four masses after one manoeuvre with six joints: from the drawings, from "
            "motion, with joint torques (friction unknown), and with a known thrust in place of torques.",
        ),
        setup=Setup(
            robot="ETS-VII with a rigid load of 120 kg on link 6, flown by an independent simulator (MuJoCo) with "
            "gravity gradient on every body.",
            manoeuvre=f"{result.duration:g} s of three sines between 0.02 and 0.06 Hz in each joint. The end-effector "
            f"moves with up to {1e3 * result.hand_speed:.0f} mm/s relative to the base, {haste}; no row has the "
            "permitted speed. The known thrust has two pulses of 20 N over 2 s.",
            sensors=f"At 2 Hz, noise per sample: rate {format_number(RATE)} rad/s, accelerometer "
            f"{format_number(ACCEL)} m/s², encoders {format_number(ENCODER)} rad; joint torques, where measured, "
            f"{format_number(TORQUE)} N m.",
            known="Kinematics and orbit. Drawings state every link to 5 % of its mass.",
            unknown=f"All 80 parameters: base to {200 * BASE_SPREAD:g} % of its mass, load to {200 * LOAD_SPREAD:g} %, "
            f"initial rate; friction of every joint where torques are measured (truly {COULOMB:g} N m dry and "
            f"{VISCOUS:g} N m s viscous).",
            replicates=f"{len(result.methods[0].errors)} recordings of one flight for the comparison of "
            f"methods.{drawn}",
        ),
        outline=robot_outline(ets7(), START),
        sections=[_negatives, _evidence],
        statements=_statements(result),
        tables=[
            CsvTable(
                "known",
                ["known exactly", "manoeuvre", "sensors", *(f"sd of {group}" for group in GROUPS)],
                _known_rows(result),
            ),
            CsvTable("bodies", ["sensors", "body", "quantity", "truth", "drawings", "mean", "sd"], _body_rows(result)),
        ],
        beside="Beside this report: what one exactly known body gives where no drawings help ({0}), and every sampled "
        "parameter ({1}). The linear method differentiates rates with local cubics and weights every equation by its "
        "residuals; the integral method is the mode of the posterior, whose fits start at the truth.",
    )


def _known(result: Result, manoeuvre: str, sensors: Sensors) -> Known:
    return result.known[manoeuvre].knowledge(sensors)


def _percents(knowledge: Known, *, before: bool = False) -> list[str]:
    """Return the relative standard deviations of four masses in the order of `GROUPS`, before or after the data."""
    pairs = [knowledge.mass(*members) for members in groups(knowledge.robot).values()]
    return [format_percent(prior if before else after, 2) if prior else "known" for prior, after in pairs]


def _goals(result: Result) -> list[Goal]:
    system = groups(result.truth)["whole system"]
    goals = []
    for title, case in zip(("motion alone", "joint torques", "a known thrust"), CHIEF, strict=True):
        width = _known(result, *case).mass(*system)[1]
        goals.append(
            Goal(
                f"mass of the whole system to {format_percent(WANTED)} with {title}",
                format_percent(width, 2),
                Verdict.of(width <= WANTED),
            )
        )
    texts = (
        f"sampled posteriors are neither too narrow nor too wide for the true bodies (two-sided p at least {LEVEL:g} "
        "over their number) and three methods agree",
        f"squared distances over drawn systems are chi-square (Kolmogorov-Smirnov p at least {LEVEL:g})",
        f"beyond the {format_percent(TAIL)} quantile, and below that of {format_percent(1.0 - TAIL)}, no more of them "
        f"than chance allows (two-sided p at least {LEVEL:g})",
    )
    if result.coverage is None:
        return [*goals, *(Goal(text, "not run", Verdict.NOT_TESTED) for text in texts)]
    coverage, cases = result.coverage, result.cases
    agreed = [case for case in cases if not case.result.disagreements]
    distances = ", ".join(f"p = {format_number(case.p_value, 2)} ({case.title})" for case in cases)
    sampled = f"{distances}; {len(agreed)} of {len(cases)} agree"
    tail = f"{coverage.far} and {coverage.near} of {len(coverage.distances)}, p = {coverage.tail_p_value:.2f}"
    return [
        *goals,
        Goal(texts[0], sampled, Verdict.of(len(agreed) == len(cases) and _well_sized(cases))),
        Goal(texts[1], f"p = {coverage.p_value:.2f}", Verdict.of(coverage.p_value >= LEVEL)),
        Goal(texts[2], tail, Verdict.of(coverage.tail_p_value >= LEVEL)),
    ]


def _well_sized(cases: Sequence[Sampled]) -> bool:
    """Return whether no posterior is too narrow or too wide, each tested with its part of `LEVEL`."""
    return min(case.p_value for case in cases) >= LEVEL / len(cases)


def _negatives(document: Document, result: Result) -> None:
    document.section("What goes wrong, and what cannot be had")
    motion, torques, _ = (_known(result, *case) for case in CHIEF)
    linear = next(method for method in result.methods if method.title == "regressors, motion alone")
    system = 1.0 + float(linear.errors[:, 3].mean())
    texts = [
        "The paper's linear regressor method (19) on motion alone estimates a whole system of "
        f"{format_percent(system, 2)} of the true mass and states "
        f"{format_percent(float(linear.believed[:, 3].mean()), 2)} as its standard deviation. Its right side is zero: "
        "the data know nothing of the scale, and the noise of the entries counts as evidence for small masses, the "
        "more so the longer the recording. Only the prior holds them up.",
        f"Of the 80 directions in which the bodies could differ the data halve the width of {motion.contraction} "
        f"(motion) or {torques.contraction} (with torques); the others keep their prior.",
    ]
    for case in result.cases:
        texts += list(case.result.disagreements)
    if result.cases:
        texts.append(_distances(result))
    if result.coverage is None:
        texts.append("Sampled posteriors and coverage were not tested: only the full study has them.")
    else:
        coverage = result.coverage
        count, inside = len(coverage.distances), (np.abs(coverage.scores) < 1.0).sum(axis=0)
        cells = ", ".join(f"{name} {number}" for name, number in zip(SCORED, inside, strict=True))
        texts.append(
            f"Coverage of masses within one standard deviation, of {count} drawn systems: {cells}, where "
            f"{CONTENT * count:.0f} ± {np.sqrt(count * CONTENT * (1.0 - CONTENT)):.0f} are expected. The mean squared "
            f"distance is {coverage.distances.mean():.1f} ± {np.sqrt(2.0 * coverage.unknowns / count):.1f} for "
            f"{coverage.unknowns} unknowns."
        )
    document.items(texts)


def _distances(result: Result) -> str:
    """Return how far the truth is from the sampled posteriors, and what that can tell."""
    seen = ", ".join(f"{format_fixed(case.distance, 1)} ({case.title})" for case in result.cases)
    unknowns = 10 * len(bodies(result.truth))
    return (
        f"Squared distance of the truth from the sampled posteriors: {seen}, where {unknowns} ± "
        f"{np.sqrt(2.0 * unknowns):.0f} are due. All share one truth and one set of drawings; where the data teach "
        "nothing, the distance is that between these two."
    )


def _evidence(document: Document, result: Result) -> None:
    document.section("Evidence")
    document.table(
        ["manoeuvre", "sensors", "directions learnt", *GROUPS],
        [
            [name, sensors.value[0], str(knowledge.contraction), *_percents(knowledge)]
            for name, information in result.known.items()
            for sensors in Sensors
            for knowledge in (information.knowledge(sensors),)
        ],
        "Relative standard deviation of four masses after one manoeuvre, and number of directions (of 80) whose width "
        "the data at least halve.",
        columns("llrrrrr"),
    )
    count = len(result.methods[0].errors)
    document.table(
        ["method", "mass of", "mean error ± its uncertainty", "spread", "stated sd"],
        [
            _method_row(method, k, group, count)
            for method in result.methods
            for k, group in enumerate(GROUPS)
            if group in ("base", "whole system")
        ],
        f"Linear regressors against the integral of the motion, relative errors over {count} recordings of one flight "
        "with fresh noise. The truth is fixed, so that the mean error includes that of the drawings; the stated "
        "standard deviation (sd) covers both.",
        columns("llrrr"),
    )
    document.figure(
        _shrinkage_figure(result.known["six joints"]),
        "What six moving joints teach of each log-Cholesky coordinate of each body: one minus the ratio of posterior "
        "to prior width. Where a cell is white, the posterior is the prior.",
    )
    if result.coverage is not None:
        document.figure(
            _coverage_figure(result.coverage),
            "Squared distances of the truth in the drawn systems, sorted, against quantiles of chi-square.",
        )


def _method_row(method: Method, k: int, group: str, count: int) -> list[str]:
    errors, stated = method.errors[:, k], method.believed[:, k]
    spread = errors.std(ddof=1)
    mean = format_quantity(100.0 * float(errors.mean()), 100.0 * float(spread / np.sqrt(count)))
    return [method.title, group, f"{mean} %", *(format_percent(float(width), 2) for width in (spread, stated.mean()))]


def _known_rows(result: Result) -> Iterator[tuple[object, ...]]:
    """Yield the relative deviations of four masses without drawings, by what is known exactly, in one linearisation."""
    parts = groups(result.truth)
    cases: dict[str, tuple[str, ...]] = {"nothing": (), "link 2": ("link2",)}
    cases |= {name: parts[name] for name in ("arm", "load", "base")}
    vague = dict.fromkeys(bodies(result.truth), 1.0)
    for title, known in cases.items():
        for name, sensors in CHIEF:
            knowledge = result.known[name].knowledge(sensors, known=known, widths=vague)
            widths = [knowledge.mass(*members)[1] for members in groups(knowledge.robot).values()]
            yield title, name, sensors.value[0], *(f"{width:.4g}" for width in widths)


def _body_rows(result: Result) -> Iterator[tuple[object, ...]]:
    """Yield every sampled parameter beside the truth and the drawings."""
    for case in result.cases:
        for name, body in case.result.bodies.items():
            stated = mass_com_inertia(result.drawings.link(name).inertial.vector)
            for k, key in enumerate(BODY_QUANTITIES):
                numbers = (case.truth[name][k], stated[k], body.mean[k], body.sd[k])
                yield case.title, name, key, *(f"{float(value):.6g}" for value in numbers)


def _statements(result: Result) -> list[Statement]:
    linear = next(method for method in result.methods if method.title == "regressors, motion alone")
    motion, torques, _ = (_known(result, *case) for case in CHIEF)
    bias = abs(float(linear.errors[:, 3].mean() / linear.believed[:, 3].mean()))
    system = groups(result.truth)["whole system"]
    gain = motion.mass(*system)[1] / torques.mass(*system)[1]
    vague = result.known["six joints"].knowledge(Sensors.TORQUES, widths=dict.fromkeys(bodies(result.truth), 1.0))
    return [
        Statement(
            "The linear method needs joint torques and friction: with a right side of zero it is badly posed (3).",
            Finding.CONFIRMED if bias > FAR else Finding.REFUTED,
            f"On motion alone it is {format_number(bias, 2)} of its own standard deviations wrong.",
        ),
        Statement(
            "Part of the system must be known to identify the whole (5).",
            Finding.CONFIRMED if gain > 2.0 else Finding.REFUTED,
            f"From motion alone. Joint torques are {format_number(gain, 2)} times better and need no drawings: without "
            f"any they tell the whole to {format_percent(vague.mass(*system)[1], 2)}.",
        ),
        Statement(
            "The arm is known from CAD data, generally to 5 % (1).",
            Finding.NOT_TESTABLE,
            "Taken as stated: 5 % of each mass.",
        ),
    ]


@styled
def _mass_figure(result: Result) -> Figure:
    figure = wide_figure(2.6)
    axes = figure.subplots()
    knowledge = [_known(result, *case) for case in CHIEF]
    members = list(groups(result.truth).values())
    place = np.arange(len(members))
    before = [100.0 * knowledge[0].mass(*names)[0] for names in members]
    axes.plot(place - 0.24, before, "o", color=TRUTH, label="drawings")
    looks = (("motion", AFTER), ("motion and joint torques", COLOURS[2]), ("motion, known thrust", COLOURS[3]))
    for shift, known, (label, colour) in zip((-0.08, 0.08, 0.24), knowledge, looks, strict=True):
        axes.plot(place + shift, [100.0 * known.mass(*names)[1] for names in members], "o", color=colour, label=label)
    axes.axhline(100.0 * WANTED, color=TRUTH, linewidth=0.8, linestyle="--")
    axes.set(yscale="log", ylabel="relative sd of the mass [%]")
    axes.set_xticks(place, GROUPS)
    shared_legend(figure, axes, 4)
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
        axes.grid(False)
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
    axes.plot(quantiles, np.sort(coverage.distances), ".", color=AFTER)
    axes.plot(quantiles[[0, -1]], quantiles[[0, -1]], color=TRUTH, linewidth=0.6)
    axes.set(xlabel=f"quantile of chi-square, {coverage.unknowns} degrees of freedom", ylabel="squared distance")
    return figure


STUDY = Study(
    "whole_system",
    "Identify every body of the robot.",
    run=run,
    report=_report,
    full="also sample the posteriors and check the coverage",
    seed=1,
)
