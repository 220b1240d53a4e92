"""Report of the study."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bayesid.design import Store
from bayesid.report import Document
from bayesid.report.figures.figure_style import COLOURS, curve_style, shared_legend, styled, wide_figure
from bayesid.report.numbers import format_fixed, format_number, format_percent, format_vector
from bayesid.report.verdict_record import Share
from studies.common import mission
from studies.common.ets7 import BIAS, START, ets7
from studies.common.figures import manoeuvre_figure, robot_outline
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
from studies.separating import analysis
from studies.separating.analysis import Result

RIVALRY = 2.2  # log Bayes factor above which a cause is preferred to its one rival with a probability of 0.9 or more
SURE = 0.9  # share of flights, and of directions, in which the factor is to be exceeded
TICKS = (-10, -3, -1, 0, 1, 3, 10, 30, 100, 300)  # ticks of log Bayes factors
LAST = "first, separating"  # stage with the separating manoeuvre

# words for what is hidden
HIDDEN = {
    "wheel-momentum": f"wheels with {format_vector(analysis.TRUTHS['wheel-momentum'])} N m s",
    "thruster-leak": f"leak of {format_vector(1e3 * analysis.TRUTHS['thruster-leak'])} mN m",
}

NAMES = {"wheel-momentum": "wheel momentum", "thruster-leak": "leak"}  # short names of the two causes


def _preferred(flown: analysis.Realised, stage: str) -> Share:
    """Return in how many of the flights the true cause is preferred with a probability of 0.9 or more."""
    values = flown.factors[stage]
    return Share(int((values > RIVALRY).sum()), len(values))


def _counts(share: Share) -> str:
    return f"{share.count} of {share.total}"


def _shown(result: Result, truth: str, stage: str) -> Share:
    """Return in how many of the random directions the factor is expected above the limit in enough flights."""
    directions = result.directions[truth, stage]
    return Share(sum(direction.exceeding(RIVALRY) >= SURE for direction in directions), len(directions))


def _decided(share: Share) -> Verdict:
    """Return whether a share is at least what is wanted, by its exact 95 % interval."""
    low, high = share.interval
    return Verdict.PASS if low >= SURE else Verdict.FAIL if high < SURE else Verdict.OPEN


def goals(result: Result) -> tuple[Goal, ...]:
    """Return the goals of the study with what was reached."""
    rows = []
    for flown in result.realised:
        values = flown.factors[LAST]
        text = f"Hidden {NAMES[flown.truth]}: ln B over the rival above {RIVALRY} in {format_percent(SURE)} of flights"
        share = _preferred(flown, LAST)
        rows.append(Goal(text, f"{share}, mean {format_fixed(values.mean(), 1)}", _decided(share), Severity.MEDIUM))
        text = f"Hidden {NAMES[flown.truth]}: {analysis.FLIGHTS} sets of flights"
        rows.append(Goal(text, f"{len(values)} flown", Verdict.of(len(values) >= analysis.FLIGHTS), Severity.MEDIUM))
    for truth in analysis.RIVALS:
        share = _shown(result, truth, LAST)
        percent = format_percent(SURE)
        text = (
            f"Hidden {NAMES[truth]}, same size in random directions: expected above {RIVALRY} in {percent} of flights "
            f"for {percent} of the directions"
        )
        rows.append(Goal(text, str(share), _decided(share), Severity.MEDIUM))
    for flown in result.realised:
        gain = flown.factors[LAST] - flown.factors["first, d-optimal"]
        error = gain.std(ddof=1) / np.sqrt(len(gain))
        text = f"Hidden {NAMES[flown.truth]}: the separating manoeuvre gives a higher ln B than the d-optimal one"
        reached = (
            f"ln B {format_fixed(abs(gain.mean()), 1)} ± {format_fixed(error, 1)} "
            f"{'higher' if gain.mean() > 0.0 else 'lower'}"
        )
        verdict = Verdict.OPEN if abs(gain.mean()) < 2.0 * error else Verdict.of(gain.mean() > 0.0)
        rows.append(Goal(text, reached, verdict, Severity.MEDIUM))
    far = [
        abs(flown.factors[stage].mean() - result.expected[flown.truth, stage].log_factor)
        / (flown.factors[stage].std(ddof=1) / np.sqrt(len(flown.factors[stage])))
        for flown in result.realised
        for stage in analysis.STAGES
    ]
    reached = f"at most {format_fixed(max(far), 1)} over {len(far)} means"
    text = "Mean ln B within 3 standard errors of the expected value"
    rows.append(Goal(text, reached, Verdict.of(max(far) <= 3.0), Severity.HIGH))
    costs = [result.designs[name].costs["separation"] for name in ("separation", "d-optimal")]
    factor = format_number(float(np.exp(costs[1] - costs[0])), 3)
    text = "By the separation criterion the separating manoeuvre is the better of the two"
    rows.append(Goal(text, f"smaller cost by a factor of {factor}", Verdict.of(costs[0] <= costs[1]), Severity.MEDIUM))
    return tuple(rows)


def _report(result: Result) -> Report[Result]:
    last, alone, optimal = (
        " and ".join(f"{_counts(_preferred(case, stage))} flights ({NAMES[case.truth]})" for case in result.realised)
        for stage in (LAST, "first alone", "first, d-optimal")
    )
    titles = {"first": "first (the flight's)", "separation": "separating", "d-optimal": "d-optimal"}
    return Report(
        title="Separating two causes",
        subtitle="A manoeuvre designed to separate rivals, ETS-VII in MuJoCo",
        question="Residual wheel momentum and a leaking valve act alike on a slowly drifting base. Does a second "
        "manoeuvre that is designed to separate them identify the true cause?",
        answer=f"The separating manoeuvre identifies the hidden cause in {last}. An identified cause has a probability "
        f"of {SURE:g} or more against its rival. The first manoeuvre alone identifies it in {alone}; with a d-optimal "
        f"second one it is identified in {optimal}.",
        valid="only one of the two acts, with the same size in both manoeuvres; the base mass is uncertain by "
        f"{format_percent(2.0 * analysis.SPREAD)} (1 sigma) and the base drifts by one degree per minute. The design "
        "uses that rate.",
        goals=goals(result),
        full=result.full,
        figure=Picture(
            factor_figure(result),
            "Log Bayes factor of the truth against its rival, one point for each set of flights, and the mean expected "
            f"by linear theory with its standard deviation (bars). The grey line is {RIVALRY}, a probability of 0.9. "
            "The scale is linear between −1 and 1 and logarithmic beyond.",
        ),
        setup=Setup(
            robot=f"ETS-VII with the published base; joints within ±{mission.REACH:g} rad, wrist extended at the "
            "start.",
            manoeuvre=f"{mission.DURATION:g} s each: first the manoeuvre of the flight, then quintic splines of all "
            f"joints, at the 50 mm/s and 5 degrees per second of the flight rule.{_left_out(result)}",
            sensors=f"{mission.SENSORS}; a constant bias of the accelerometer.",
            known="Gravity gradient, initial attitude, and the arm with 5 % uncertainty (1 sigma) of each link mass.",
            unknown=f"With 1 sigma: {format_percent(2.0 * analysis.SPREAD)} of the base mass, the bias "
            f"({format_number(BIAS)} m/s²), the links, and the cause (1 N m s of wheels, or 0.5 mN and 0.5 mN m of "
            f"leak, per axis); and the initial rate (true value {format_vector(analysis.DRIFT)} rad/s).",
            replicates=f"{len(result.realised[0].detected)} sets of flights for each cause, each with a separate arm, "
            f"bias and noise; {result.search.starts} starts for each design. Evidences are linearised about the plan.",
        ),
        outline=robot_outline(ets7(), START),
        picture=Picture(
            manoeuvre_figure({title: result.motions[name] for name, title in titles.items()}),
            "The manoeuvres: joints, tip speed with the flight rule dotted, and rotation of the base from rest.",
        ),
        sections=[_failures, _evidence],
        statements=[
            Statement(
                "The wheels' momentum and the initial rate are among the main causes of the drift (2.1).",
                Finding.NOT_TESTABLE,
                "The true momentum of ETS-VII's wheels is not public. This study separates it from a leak for an "
                "assumed size only.",
            )
        ],
        tables=_tables(result),
    )


def _left_out(result: Result) -> str:
    """Return which directions the separating manoeuvre was not designed for, for a sentence."""
    left_out = result.designs["separation"].left_out
    parts = [f"{count} of the {NAMES[label]}" for label, count in left_out.items()]
    return f" Its design omits directions that no manoeuvre resolves: {', '.join(parts)}." if parts else ""


def _failures(document: Document, result: Result) -> None:
    document.section("Calibration and failures")
    texts = []
    for flown in result.realised:
        resolved = _counts(_shown(result, flown.truth, LAST))
        low, middle = np.quantile([other.log_factor for other in result.directions[flown.truth, LAST]], [0.1, 0.5])
        texts.append(
            f"Hidden {HIDDEN[flown.truth]}: the first manoeuvre alone detects the cause with a mean ln B of "
            f"{format_fixed(flown.detected.mean(), 1)} against no cause. For random directions of the same size, the "
            f"expected ln B over the rival with the separating manoeuvre has a median of {format_fixed(middle, 1)} and "
            f"a 10 % quantile of {format_fixed(low, 1)}; for {resolved} directions it is above {RIVALRY} in "
            f"{format_percent(SURE)} of flights or more."
        )
    texts.append(
        "The full diagnosis with its catalogue was not run here: the models contain only these two causes. A leak with "
        "a net force was not hidden."
    )
    document.items(texts)


def _evidence(document: Document, result: Result) -> None:
    document.section("Evidence")
    rows = []
    for flown in result.realised:
        for stage, values in flown.factors.items():
            expected = result.expected[flown.truth, stage]
            cells = [
                expected.alone,
                expected.energy,
                expected.log_factor,
                values.mean(),
                values.std(ddof=1),
                expected.sd,
            ]
            numbers = [format_fixed(float(cell), 1) for cell in cells]
            shares = [_counts(_preferred(flown, stage)), _counts(_shown(result, flown.truth, stage))]
            rows.append([NAMES[flown.truth], stage, *numbers, *shares])
    titles = ["λ", "λ(1−ρ²)/2", "expected ln B", "mean ln B", "sd ln B", "expected sd", "preferred", "directions"]
    document.table(
        ["hidden", "manoeuvres", *titles],
        rows,
        "λ is the energy of the hidden cause's signal in units of the noise, all other unknowns marginalised; λ(1−ρ²) "
        "is the part that the rival cannot imitate. The expected ln B includes the cost of each prior. Preferred: "
        f"flights with ln B above {RIVALRY}, a probability of {SURE:g}; directions: random directions of causes of the "
        f"same size in which {format_percent(SURE)} of flights are expected above it, with ln B taken as normal.",
        columns("llrrrrrrrr"),
    )
    document.figure(
        _direction_figure(result),
        "Expected ln B of causes of the same size in random directions, with the cost of each prior: share of the "
        f"directions below a value. The grey line is {RIVALRY}. The scale is linear between −1 and 1 and logarithmic "
        "beyond.",
    )


def _tables(result: Result) -> list[CsvTable]:
    factors = [
        [flown.truth, stage, number, float(value)]
        for flown in result.realised
        for stage, values in flown.factors.items()
        for number, value in enumerate(values)
    ]
    names = next(iter(result.designs.values())).motion.family.names
    parameters = [[name, *map(float, np.asarray(design.motion.parameters))] for name, design in result.designs.items()]
    return [
        CsvTable("factors", ["hidden", "manoeuvres", "flight", "log Bayes factor"], factors),
        CsvTable("manoeuvres", ["manoeuvre", *names], parameters),
    ]


@styled
def factor_figure(result: Result) -> Figure:
    """Draw every log Bayes factor beside its expectation."""
    figure = wide_figure(2.7)
    for axes, hidden in zip(figure.subplots(1, len(result.realised), sharey=True), result.realised, strict=True):
        place = np.arange(len(analysis.STAGES))
        expected = [result.expected[hidden.truth, stage] for stage in analysis.STAGES]
        means, sds = [each.log_factor for each in expected], [each.sd for each in expected]
        bars: dict[str, Any] = {"fmt": "s", "color": COLOURS[1], "markersize": 4, "capsize": 3}
        axes.errorbar(place - 0.15, means, sds, label="expected", **bars)
        realised = np.stack([hidden.factors[stage] for stage in analysis.STAGES])
        shift = np.linspace(0.05, 0.3, realised.shape[1])
        axes.plot((place[:, None] + shift).ravel(), realised.ravel(), ".", color=COLOURS[0], label="realised")
        axes.axhline(RIVALRY, color="#888888", linewidth=0.8)
        axes.set_xticks(place, [stage.replace(", ", ",\n") for stage in analysis.STAGES])
        axes.set(title=f"hidden: {HIDDEN[hidden.truth]}", xlim=(-0.5, place[-1] + 0.5))
        axes.set_yscale("symlog", linthresh=1.0)
        axes.set_yticks(TICKS, list(map(format_number, TICKS)))
        axes.grid(visible=False, axis="x")
        axes.legend(loc="upper left")
    figure.axes[0].set_ylabel("log Bayes factor")
    return figure


@styled
def _direction_figure(result: Result) -> Figure:
    figure = wide_figure(2.3)
    for axes, truth in zip(figure.subplots(1, 2, sharey=True), analysis.RIVALS, strict=True):
        for index, stage in enumerate(analysis.STAGES):
            values = np.sort([direction.log_factor for direction in result.directions[truth, stage]])
            share = np.arange(1, len(values) + 1) / len(values)
            axes.plot(values, share, label=stage, **curve_style(index))
        axes.axvline(RIVALRY, color="#888888", linewidth=0.8)
        axes.set(xlabel="expected ln B", title=f"hidden: {NAMES[truth]}")
        axes.set_xscale("symlog", linthresh=1.0)
        axes.set_xticks(TICKS, list(map(format_number, TICKS)))
    figure.axes[0].set_ylabel("share of directions")
    shared_legend(figure, figure.axes[0], len(analysis.STAGES))
    return figure


def _run(full: bool, seed: int, store: Path | None, **options: Any) -> Result:
    """Run the study, the results of its searches kept in a file where one is given."""
    kept = (
        None if store is None else Store.open(store, f"separating {seed} {analysis.FULL if full else analysis.QUICK}")
    )
    return analysis.run(full=full, seed=seed, store=kept, **options)


STUDY = Study(
    "separating",
    "Separate two causes that a first manoeuvre cannot distinguish.",
    run=_run,
    report=_report,
    full=f"thorough searches, {analysis.FLIGHTS} sets of flights for each cause",
    seed=1,
    extra={
        "--store": {"type": Path, "help": "file for the results of the searches, to resume an interrupted run"},
        "--flights": {"type": int, "help": "number of sets of flights for each cause"},
        "--trials": TRIALS["--trials"],
    },
)
