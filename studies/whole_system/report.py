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
from studies.common.study import CsvTable, Finding, Goal, Picture, Report, Setup, Severity, Statement, Study, Verdict
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
    haste = f"{format_fixed(result.hand_speed / TIP_SPEED, 1)} times as fast as the flight rule permits"
    drawn = ""
    if result.coverage is not None:
        drawn = f" {len(result.coverage.distances)} systems drawn from the prior, each on a separate manoeuvre."
    return Report(
        title="The whole system identified",
        subtitle="Problem 3 of Lampariello and Hirzinger (IDETC 2005)",
        question="ETS-VII carries a load of 120 kg, and the inertial parameters of all bodies are uncertain. What does "
        "one manoeuvre determine, with which sensors, and what must be known in advance?",
        answer=f"With joint torques, the mass of the whole system has a standard deviation of {torques}. With a known "
        f"thrust it is {thrust}, with motion alone {motion}: motion determines ratios of masses, and only the drawings "
        f"give their scale. Data: one recording of {result.duration:g} s at 2 Hz, with noise per sample of "
        f"{format_number(RATE)} rad/s, {format_number(ACCEL)} m/s² and {format_number(TORQUE)} N m (torques); the "
        f"manoeuvre moves the tip {haste}.",
        valid=f"the tip moves {haste}, joints follow their path, the load is rigid and noise is white; widths are "
        "linearised about the truth unless marked as sampled.",
        goals=_goals(result),
        full=result.coverage is not None,
        figure=Picture(
            _mass_figure(result),
            "Relative standard deviation of four masses: from the drawings alone, and after one manoeuvre with six "
            "joints, from motion alone, with joint torques (friction unknown), and with a known thrust instead of "
            "torques. Dashed: the goal.",
        ),
        setup=Setup(
            robot="ETS-VII with a rigid load of 120 kg on link 6, flown by an independent simulator (MuJoCo) with "
            "gravity gradient on every body.",
            manoeuvre=f"{result.duration:g} s of three sines between 0.02 and 0.06 Hz in each joint. The end-effector "
            f"moves at up to {1e3 * result.hand_speed:.0f} mm/s relative to the base, {haste}; no case has the "
            "permitted speed. The known thrust has two pulses of 20 N, 2 s each.",
            sensors=f"At 2 Hz, noise per sample: rate {format_number(RATE)} rad/s, accelerometer "
            f"{format_number(ACCEL)} m/s², encoders {format_number(ENCODER)} rad; joint torques, where measured, "
            f"{format_number(TORQUE)} N m.",
            known="Kinematics and orbit. The drawings give each link mass to 5 % (1 sigma).",
            unknown=f"All 80 parameters, 1 sigma {200 * BASE_SPREAD:g} % of the base mass and {200 * LOAD_SPREAD:g} % "
            f"of the load mass; the initial rate; friction of every joint where torques are measured (true values "
            f"{COULOMB:g} N m dry and {VISCOUS:g} N m s viscous).",
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
        beside="Tables with this report: standard deviations if there are no drawings and one part is known exactly "
        "({0}), and every sampled parameter ({1}). The linear method differentiates the measured rates with local "
        "cubic polynomials and weights each equation by its residuals. The integral method is the mode of the "
        "posterior; its fits start at the truth.",
    )


def _known(result: Result, manoeuvre: str, sensors: Sensors) -> Known:
    return result.known[manoeuvre].knowledge(sensors)


def _percents(knowledge: Known, *, before: bool = False) -> list[str]:
    """Return the relative standard deviations of four masses in the order of `GROUPS`, before or after the data."""
    pairs = [knowledge.mass(*members) for members in groups(knowledge.robot).values()]
    return [format_percent(prior if before else after, 2) if prior else "known" for prior, after in pairs]


def _goals(result: Result) -> list[Goal]:
    system = groups(result.truth)["whole system"]
    motion, *others = (_known(result, *case).mass(*system)[1] for case in CHIEF)
    goals = [
        Goal(
            f"mass of the whole system to {format_percent(WANTED)} {title}",
            " and ".join(format_percent(width, 2) for width in widths),
            Verdict.of(max(widths) <= WANTED),
            Severity.MEDIUM,
        )
        for title, widths in (("with motion alone", [motion]), ("with joint torques and with a known thrust", others))
    ]
    texts = (
        f"sampled posteriors are neither too narrow nor too wide for the true bodies (two-sided p at least {LEVEL:g} "
        "divided by their number) and mode, importance sampling and emcee agree",
        f"squared distances over drawn systems follow chi-square (Kolmogorov-Smirnov p at least {LEVEL:g}), and no "
        f"more of them than chance allows are beyond its {format_percent(TAIL)} or below its "
        f"{format_percent(1.0 - TAIL)} quantile (two-sided p at least {LEVEL:g})",
    )
    if result.coverage is None:
        return [*goals, *(Goal(text, "not run", Verdict.NOT_TESTED, Severity.HIGH) for text in texts)]
    coverage, cases = result.coverage, result.cases
    agreed = [case for case in cases if not case.result.disagreements]
    distances = ", ".join(f"p = {format_number(case.p_value, 2)} ({case.title})" for case in cases)
    sampled = f"{distances}, each at least {_part(cases):g} required; {len(agreed)} of {len(cases)} agree"
    spread = (
        f"p = {coverage.p_value:.2f}; {coverage.far} and {coverage.near} of {len(coverage.distances)}, p = "
        f"{coverage.tail_p_value:.2f}"
    )
    right = coverage.p_value >= LEVEL and coverage.tail_p_value >= LEVEL
    return [
        *goals,
        Goal(texts[0], sampled, Verdict.of(len(agreed) == len(cases) and _well_sized(cases)), Severity.HIGH),
        Goal(texts[1], spread, Verdict.of(right), Severity.HIGH),
    ]


def _part(cases: Sequence[Sampled]) -> float:
    """Return the part of `LEVEL` with which each sampled posterior is tested."""
    return LEVEL / len(cases)


def _well_sized(cases: Sequence[Sampled]) -> bool:
    """Return whether no posterior is too narrow or too wide, each tested with its part of `LEVEL`."""
    return min(case.p_value for case in cases) >= _part(cases)


def _negatives(document: Document, result: Result) -> None:
    document.section("Failures and limits")
    motion, torques, _ = (_known(result, *case) for case in CHIEF)
    linear = next(method for method in result.methods if method.title == "regressors, motion alone")
    system = 1.0 + float(linear.errors[:, 3].mean())
    before, after = _known(result, *CHIEF[0]).mass(*groups(result.truth)["whole system"])
    texts = [
        "Motion alone gives no absolute scale: the equations of motion are homogeneous in the masses, gravity gradient "
        "included, so no manoeuvre, motion sensor or observation time can determine it. The prior sets the floor. The "
        f"drawings determine the mass of the whole system to {format_percent(before, 2)} and the motion improves this "
        f"to {format_percent(after, 2)} only because it fixes mass ratios. The reports on the base body, on what "
        "ETS-VII could have identified and on a load refer to this finding.",
        "With motion alone, the paper's linear regressor method (19) estimates the mass of the whole system as "
        f"{format_percent(system, 2)} of its true value and states a standard deviation of "
        f"{format_percent(float(linear.believed[:, 3].mean()), 2)}. The right side of its equations is zero, so the "
        "data contain no information about the scale, and noise in the regressor biases all masses towards zero, more "
        "so in longer recordings. Only the prior prevents smaller estimates.",
        f"The eight bodies have 80 parameters. In {motion.contraction} of 80 independent directions the data at least "
        f"halve the prior width with motion alone, in {torques.contraction} with joint torques. The other directions "
        "remain closer to the prior.",
    ]
    for case in result.cases:
        texts += list(case.result.disagreements)
    if result.cases:
        texts.append(_distances(result))
    if result.coverage is None:
        texts.append("Sampled posteriors and coverage were not tested: only the full study includes them.")
    else:
        coverage = result.coverage
        count, inside = len(coverage.distances), (np.abs(coverage.scores) < 1.0).sum(axis=0)
        cells = ", ".join(f"{name} {number}" for name, number in zip(SCORED, inside, strict=True))
        texts.append(
            f"Masses within one standard deviation in {count} drawn systems: {cells} (expected: "
            f"{CONTENT * count:.0f} ± {np.sqrt(count * CONTENT * (1.0 - CONTENT)):.0f}). The mean squared "
            f"distance is {coverage.distances.mean():.1f} ± {np.sqrt(2.0 * coverage.unknowns / count):.1f} for "
            f"{coverage.unknowns} unknowns."
        )
    document.items(texts)


def _distances(result: Result) -> str:
    """Return how far the truth is from the sampled posteriors, and what that can tell."""
    seen = ", ".join(f"{format_fixed(case.distance, 1)} ({case.title})" for case in result.cases)
    unknowns = 10 * len(bodies(result.truth))
    return (
        f"Squared distance of the truth from the sampled posteriors: {seen}; expected: {unknowns} ± "
        f"{np.sqrt(2.0 * unknowns):.0f}. All cases share one truth and one set of drawings; in directions that the "
        "data do not determine, the distance only measures the difference between truth and drawings."
    )


def _evidence(document: Document, result: Result) -> None:
    document.section("Evidence")
    document.table(
        ["manoeuvre", "sensors", "directions determined", *GROUPS],
        [
            [name, sensors.value[0], str(knowledge.contraction), *_percents(knowledge)]
            for name, information in result.known.items()
            for sensors in Sensors
            for knowledge in (information.knowledge(sensors),)
        ],
        "Relative standard deviation of four masses after one manoeuvre, and number of the 80 directions whose prior "
        "width the data at least halve.",
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
        f"Linear regressor method and integral method: relative errors over {count} recordings of one flight with "
        "independent noise. The true masses are the same in all recordings, so the mean error includes the error of "
        "the drawings; the stated standard deviation (sd) includes it as well.",
        columns("llrrr"),
    )
    document.figure(
        _shrinkage_figure(result.known["six joints"]),
        "Information from six moving joints about each log-Cholesky coordinate of each body: one minus the ratio of "
        "posterior to prior width. In a white cell the posterior is the prior.",
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
            "The linear method requires joint torques and a friction model: with a right side of zero it is badly "
            "posed (3).",
            Finding.CONFIRMED if bias > FAR else Finding.REFUTED,
            f"With motion alone its mean error is {format_number(bias, 2)} times its stated standard deviation.",
        ),
        Statement(
            "Identification of the whole system requires a known part (5).",
            Finding.CONFIRMED if gain > 2.0 else Finding.REFUTED,
            "This applies to motion alone. With joint torques the mass of the whole system is "
            f"{format_number(gain, 2)} times more precise, and without drawings its standard deviation is "
            f"{format_percent(vague.mass(*system)[1], 2)}.",
        ),
        Statement(
            "The arm is known from CAD data, generally to 5 % (1).",
            Finding.NOT_TESTABLE,
            "Used as stated: 5 % of each mass.",
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
