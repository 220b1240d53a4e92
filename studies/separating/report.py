"""Report of the study."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bayesid import InputError
from bayesid._io.words import joined
from bayesid.design import Store
from bayesid.report import Document
from bayesid.report.figures.figure_style import COLOURS, styled, wide_figure
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
from studies.separating.analysis import LAST, NEEDED, PairResult, Realised, Result
from studies.separating.pairs import PAIRS

# numbers of sets of flights for each cause and direction in a full run, by pair, and in a quick one of the first pair
SETS = dict.fromkeys(PAIRS, 50) | {"wheel and leak": 200}
QUICK_SETS = 10

SURE = 0.9  # share of flights in which the true cause is to be identified
AGREE = 3.0  # standard errors within which predicted and realised rates are to agree
TICKS = (-10, -3, -1, 0, 1, 3, 10, 30, 100, 300)  # ticks of log Bayes factors


def decided(realised: Realised, stage: str) -> Share:
    """Return in how many of the flights the true cause has a probability of 0.9 or more against its rival."""
    values = realised.factors[stage]
    return Share(int((values >= NEEDED).sum()), len(values))


def judged(share: Share) -> Verdict:
    """Return whether a share is at least what is wanted, by its exact 95 % interval."""
    low, high = share.interval
    return Verdict.between(low, high, least=SURE)


def _hidden(result: PairResult, realised: Realised) -> str:
    """Return what is hidden, and against which rival."""
    cause = result.pair.cause(realised.label)
    rival = next(other for other in result.pair.causes if other is not cause)
    return f"{cause.name} against {rival.name}"


def _rows(result: Result) -> Iterator[tuple[PairResult, Realised]]:
    return ((pair, realised) for pair in result.pairs for realised in pair.realised)


def goals(result: Result) -> tuple[Goal, ...]:
    """Return the goals of the study with what was reached."""
    rows = []
    for pair in result.pairs:
        told: list[str] = []
        verdicts: list[Verdict] = []
        for where in ("", "same sizes in random directions: "):
            rows_of = [realised for realised in pair.realised if (realised.direction == "stated") is (not where)]
            shares = {pair.pair.cause(realised.label).name: decided(realised, LAST) for realised in rows_of}
            verdicts += map(judged, shares.values())
            if shares:
                told.append(where + ", ".join(f"{name} {share}" for name, share in shares.items()))
        text = f"{pair.pair.name.capitalize()}: each identified in {format_percent(SURE)} of flights"
        rows.append(Goal(text, "; ".join(told), Verdict.all_of(verdicts), Severity.MEDIUM))
    far = [pair.deviation(realised, stage) for pair, realised in _rows(result) for stage in analysis.STAGES]
    worst = max(map(abs, far))
    text = f"Realised rates within {AGREE:g} standard errors of the predicted ones"
    reached = f"at most {format_fixed(worst, 1)}, {len(far)} rates"
    rows.append(Goal(text, reached, Verdict.of(worst <= AGREE), Severity.HIGH))
    rates = [[_least(pair, name) for name in ("separation", "d-optimal")] for pair in result.pairs]
    costs = [[pair.designs[name].costs["separation"] for name in ("separation", "d-optimal")] for pair in result.pairs]
    text = (
        "Averaged over the prior of sizes and directions, the separating manoeuvre identifies the cause that is "
        "identified less often at least as often as the d-optimal one"
    )
    reached = "; ".join(
        f"{pair.pair.name} {new} against {old}" for pair, (new, old) in zip(result.pairs, rates, strict=True)
    )
    reached += " (expected; the flights have one size each)"
    rows.append(Goal(text, reached, Verdict.of(all(new <= old for new, old in costs)), Severity.MEDIUM))
    return tuple(rows)


def _least(pair: PairResult, name: str) -> str:
    """Return the expected rate of decisions of a design for the cause that is decided least often."""
    rate = min(pair.designs[name].rates.values())
    return f"{format_percent(rate.rate, 3)} ± {format_fixed(100.0 * rate.standard_error, 1)} %"


def _counts(pair: PairResult, stage: str) -> str:
    """Return in how many flights each cause in its stated direction is identified, for a sentence."""
    stated = [realised for realised in pair.realised if realised.direction == "stated"]
    shares = [(decided(realised, stage), pair.pair.cause(realised.label).name) for realised in stated]
    return " and ".join(f"{share.count} of {share.total} flights ({name})" for share, name in shares)


def _report(result: Result) -> Report[Result]:
    first = result.pairs[0]
    titles = {"first": "first (the flight's)", "separation": "separating", "d-optimal": "d-optimal"}
    counts = [f"{len(pair.realised[0].detected)} ({pair.pair.name})" for pair in result.pairs]
    return Report(
        title="Separating two causes",
        subtitle="A manoeuvre designed to separate rivals, ETS-VII in MuJoCo",
        question="Residual wheel momentum and a leaking valve are hard to distinguish on a slowly drifting base; so "
        "are the causes of three further pairs (leak and pulses, wheel and dipole, payload and link error). Does a "
        "second manoeuvre that is designed to separate them identify the true cause?",
        answer=f"The separating manoeuvre identifies the hidden cause in {_counts(first, LAST)}. An identified cause "
        f"has a probability of {SURE:g} or more against its rival. The first manoeuvre alone identifies it in "
        f"{_counts(first, 'first alone')}; with a d-optimal second one it is identified in "
        f"{_counts(first, 'first, d-optimal')}.",
        valid="only one of the two acts, with the same size in both manoeuvres; the base mass is uncertain by "
        f"{format_percent(2.0 * analysis.SPREAD)} (1 sigma), and the base drifts at "
        f"{format_fixed(60.0 * float(np.degrees(np.linalg.norm(analysis.DRIFT))), 1)} degrees per minute. The "
        "manoeuvre was designed for that rate; the fits treat it as unknown.",
        goals=goals(result),
        full=_is_full(result),
        figure=Picture(
            factor_figure(first),
            "Log Bayes factor of the truth against its rival, one point for each set of flights, in the stated "
            f"direction. The grey line is {format_number(NEEDED, 2)}, a probability of 0.9; the share above it is "
            "printed with the predicted one. The scale is linear between −1 and 1 and logarithmic beyond.",
        ),
        note="The evidence of each cause is averaged over size and direction with the prior of a diagnosis. Predicted "
        "rates are simulated from the information about the amplitudes alone, without flights.",
        setup=Setup(
            robot=f"ETS-VII with the published base; joints within ±{mission.REACH:g} rad, wrist extended at the "
            "start.",
            manoeuvre=f"{mission.DURATION:g} s each: first the manoeuvre of the flight, then quintic splines of all "
            "joints, at the 50 mm/s and 5 degrees per second of the flight rule.",
            sensors=f"{mission.SENSORS}; a constant bias of the accelerometer.",
            known="Gravity gradient, initial attitude, the instants of pulses, and the arm with 5 % uncertainty "
            "(1 sigma) of each link mass.",
            unknown=f"Base mass ({format_percent(2.0 * analysis.SPREAD)}, 1 sigma), bias ({format_number(BIAS)} m/s², "
            "1 sigma), links, initial rate (true value "
            f"{format_vector(analysis.DRIFT)} rad/s), and size and direction of the cause (prior of a diagnosis).",
            replicates=f"Sets of flights for each cause and direction: {', '.join(counts)}, each with a separate arm, "
            f"bias and noise; {result.search.starts} starts for each design. Evidences are computed by linearising "
            "about the planned motion.",
        ),
        outline=robot_outline(ets7(), START),
        picture=Picture(
            manoeuvre_figure({title: first.motions[name] for name, title in titles.items()}),
            f"The manoeuvres for {first.pair.name}: joints, tip speed with the flight rule dotted, and rotation of the "
            "base from rest.",
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


def _failures(document: Document, result: Result) -> None:
    document.section("Calibration and failures")
    texts = []
    for pair, realised in _rows(result):
        if realised.direction == "stated":
            wrong = int((realised.factors[LAST] <= -NEEDED).sum())
            texts.append(
                f"{pair.pair.name.capitalize()}, hidden {pair.pair.cause(realised.label).words}: after the first "
                "manoeuvre alone the mean log Bayes factor for the cause against no cause is "
                f"{format_fixed(realised.detected.mean(), 1)} ({format_number(NEEDED, 2)} is a probability of "
                f"{SURE:g}). With the separating manoeuvre the wrong cause has a probability of {SURE:g} or more in "
                f"{wrong} of {len(realised.detected)} flights."
            )
    texts.append(
        "The full diagnosis with its catalogue was not run here: the models contain only two causes each. A leak or "
        "pulses with a net force were not hidden. The prior of a payload in a diagnosis requires a positive mass; that "
        "of the design and of this study does not."
    )
    flown = [pair.pair.name for pair in result.pairs]
    if missing := [name for name in PAIRS if name not in flown]:
        texts.insert(0, f"Pairs that were not run: {joined(missing)}.")
    document.items(texts)


def _evidence(document: Document, result: Result) -> None:
    document.section("Evidence")
    rows = []
    for pair, realised in _rows(result):
        for stage, values in realised.factors.items():
            predicted = pair.predicted[realised.label, realised.direction, stage]
            rows.append(
                [
                    _hidden(pair, realised),
                    realised.direction,
                    stage,
                    format_fixed(float(values.mean()), 1),
                    f"{format_percent(predicted.rate, 3)} ± {format_fixed(100.0 * predicted.standard_error, 1)} %",
                    f"{decided(realised, stage).count} of {len(values)}",
                    format_fixed(pair.deviation(realised, stage), 1),
                ]
            )
    document.table(
        ["hidden", "direction", "manoeuvres", "mean ln B", "predicted", "realised", "deviation"],
        rows,
        "Rates at which the true cause reaches a probability of 0.9 against its rival: predicted with its standard "
        "error, realised in flights, and the difference in standard errors.",
        columns("lllrrrr"),
    )
    rows = [
        [pair.pair.name, name, pair.pair.cause(label).name, format_percent(rate.rate, 3), str(rate.draws)]
        for pair in result.pairs
        for name, design in pair.designs.items()
        for label, rate in design.rates.items()
    ]
    document.table(
        ["pair", "second manoeuvre", "true cause", "expected rate", "draws"],
        rows,
        "Rates of decisions expected by the design, averaged over size and direction with the prior of a diagnosis: "
        "sizes are log-uniform between the smallest that any manoeuvre could resolve and the largest plausible one.",
        columns("lllrr"),
    )


def _tables(result: Result) -> list[CsvTable]:
    factors = [
        [pair.pair.name, realised.label, realised.direction, stage, number, float(value)]
        for pair, realised in _rows(result)
        for stage, values in realised.factors.items()
        for number, value in enumerate(values)
    ]
    designs = [(pair.pair.name, *item) for pair in result.pairs for item in pair.designs.items()]
    names = designs[0][2].motion.family.names
    parameters = [[pair, name, *map(float, np.asarray(each.motion.parameters))] for pair, name, each in designs]
    return [
        CsvTable("factors", ["pair", "hidden", "direction", "manoeuvres", "flight", "log Bayes factor"], factors),
        CsvTable("manoeuvres", ["pair", "manoeuvre", *names], parameters),
    ]


@styled
def factor_figure(result: PairResult) -> Figure:
    """Draw every log Bayes factor of the flights with causes in their stated directions."""
    figure = wide_figure(2.7)
    stated = [realised for realised in result.realised if realised.direction == "stated"]
    for axes, realised in zip(figure.subplots(1, len(stated), sharey=True), stated, strict=True):
        place = np.arange(len(analysis.STAGES))
        values = np.stack([realised.factors[stage] for stage in analysis.STAGES])
        shift = np.linspace(-0.2, 0.2, values.shape[1])
        axes.plot((place[:, None] + shift).ravel(), values.ravel(), ".", color=COLOURS[0])
        axes.axhline(NEEDED, color="#888888", linewidth=0.8)
        for number, stage in enumerate(analysis.STAGES):
            rate = result.rate(realised, stage).rate
            predicted = result.predicted[realised.label, "stated", stage].rate
            text = f"{format_percent(rate)}\npredicted {format_percent(predicted)}"
            axes.annotate(text, (number, 1.0), xycoords=("data", "axes fraction"), ha="center", va="top")
        axes.set_xticks(place, [stage.replace(", ", ",\n") for stage in analysis.STAGES])
        title = fill(f"hidden: {result.pair.cause(realised.label).words}", 46)
        axes.set(title=title, xlim=(-0.5, place[-1] + 0.5))
        axes.set_yscale("symlog", linthresh=1.0)
        axes.set_ylim(top=20.0 * max(1.0, float(values.max())))
        axes.set_yticks(TICKS, list(map(format_number, TICKS)))
        axes.grid(visible=False, axis="x")
    figure.axes[0].set_ylabel("log Bayes factor")
    return figure


def _is_full(result: Result) -> bool:
    sets = {pair.pair.name: len(pair.realised[0].detected) for pair in result.pairs}
    return result.search == analysis.FULL and all(sets.get(name, 0) >= count for name, count in SETS.items())


def _run(
    full: bool,
    seed: int,
    store: Path | None,
    pairs: Sequence[str] | None = None,
    flights: Sequence[int] = (),
    **options: Any,
) -> Result:
    """Run the study, the results of its searches kept in a file where one is given."""
    chosen = pairs or (list(SETS) if full else list(SETS)[:1])
    counts = [*flights] or [SETS[name] if full else QUICK_SETS for name in chosen]
    counts *= len(chosen) if len(counts) == 1 else 1
    if len(counts) != len(chosen):
        raise InputError(
            f"--flights has {len(counts)} numbers for {len(chosen)} pairs", remedy="Give one for each pair"
        )
    sets = dict(zip(chosen, counts, strict=True))
    kept = (
        None if store is None else Store.open(store, f"separating {seed} {analysis.FULL if full else analysis.QUICK}")
    )
    return analysis.run(full=full, seed=seed, flights=sets, store=kept, **options)


STUDY = Study(
    "separating",
    "Separate two causes that a first manoeuvre cannot distinguish.",
    run=_run,
    report=_report,
    full=f"thorough searches, all {len(SETS)} pairs, {min(SETS.values())} to {max(SETS.values())} sets of flights for "
    "each cause and direction",
    seed=1,
    extra={
        "--store": {"type": Path, "help": "file for the results of the searches, to resume an interrupted run"},
        "--flights": {
            "type": int,
            "nargs": "+",
            "default": [],
            "help": "number of sets of flights for each cause and direction, one for all pairs or one for each",
        },
        "--pairs": {"nargs": "+", "choices": list(SETS), "help": "pairs of causes, by default the first or all"},
        "--trials": TRIALS["--trials"],
    },
)
