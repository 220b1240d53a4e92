"""The report of the benchmark."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bayesid._io.words import joined
from bayesid._math.arrays import Floats
from bayesid.report import Document
from bayesid.report.figures.figure_style import AFTER, TRUTH, styled, wide_figure
from bayesid.report.numbers import format_number, format_text
from studies.benchmark.device import add_device
from studies.benchmark.run import EVALUATED, RUNS, Benchmark, Result, run
from studies.common.provenance import processor
from studies.common.report_parts import columns
from studies.common.study import CsvTable, Goal, Picture, Report, Setup, Severity, Study, Verdict

# other simulators, the fair one first: a loop in Python is only listed
RIVALS = ("MuJoCo rollouts in C", "Pinocchio, step by step in Python")
FASTER = 100.0  # smallest wanted ratio of the fair one's time to that of an evaluation

ERROR = 0.01  # largest wanted error of the integration [standard deviations of a sample]
LINKS, WHITENING = 1.3, 1.5  # largest wanted ratios of the times with 60 and 6 links, and with noisy and exact joints

# number of effective samples that are wanted, and the time of an identification with them, all compiled [s]
SAMPLES, SECONDS = 4000.0, 8.0

ENOUGH = 50.0  # number of autocorrelation times from which on the estimate of the autocorrelation is reliable

# figures of merit: name, value in each run, goal, and whether more is better
Figures = Sequence[tuple[str, Floats, float, bool]]


def figures_by_goal(runs: Sequence[Benchmark]) -> list[tuple[Severity, Figures]]:
    """Return the figures of merit in each run, those of one goal together, with the severity of a miss."""
    fair = RIVALS[0]
    links = _over(runs, lambda run: run.links[60] / run.links[6])
    noisy = _over(runs, lambda run: max(run.whitening.values()) / run.whitening["white"])
    identification = f"time of an identification to {SAMPLES:.0f} effective samples, compiled [s]"
    return [
        (
            Severity.LOW,
            [
                (
                    f"time of {fair} over that of one evaluation",
                    _over(runs, lambda run: run.speedups[fair]),
                    FASTER,
                    True,
                )
            ],
        ),
        (Severity.HIGH, [("integration error [σ of a sample]", _over(runs, lambda run: run.error), ERROR, False)]),
        (
            Severity.LOW,
            [
                ("time with 60 links over that with 6", links, LINKS, False),
                ("time with noisy joints over that with exact ones", noisy, WHITENING, False),
            ],
        ),
        (Severity.LOW, [(identification, _over(runs, lambda run: run.sampling.seconds), SECONDS, False)]),
    ]


def _over(runs: Sequence[Benchmark], value: Callable[[Benchmark], float]) -> Floats:
    return np.array([value(run) for run in runs])


def goals_of(runs: Sequence[Benchmark]) -> list[Goal]:
    """Return the goals: met or missed in every run, else not decided."""
    goals = []
    for severity, figures in figures_by_goal(runs):
        texts = [
            f"{name}: at {'least' if more else 'most'} {format_number(goal, 4)}" for name, _, goal, more in figures
        ]
        reached = [_spread(values) for _, values, _, _ in figures]
        verdict = Verdict.all_of(
            _judged(values >= goal if more else values <= goal) for _, values, goal, more in figures
        )
        goals.append(Goal("; ".join(texts), "; ".join(reached), verdict, severity))
    return goals


def _judged(met: NDArray[np.bool_]) -> Verdict:
    return Verdict.of(met.all()) if met.all() or not met.any() else Verdict.OPEN


def _spread(values: Floats) -> str:
    middle, low, high = (format_number(float(f(values)), 3) for f in (np.median, np.min, np.max))
    return f"{middle} ({low} to {high})"


def _varies(values: Floats) -> str:
    return format_number(float(values.max() / values.min()), 2)


def _report(result: Result) -> Report[Result]:
    runs = result.runs
    figures = [figure for _, figures in figures_by_goal(runs) for figure in figures]
    evaluations = np.array([run.evaluation for run in runs])
    ratios = [np.array([run.speedups[name] for run in runs]) for name in RIVALS]
    measured = [(name, values) for name, values, _, _ in figures] + [
        (f"time of {RIVALS[1]} over that of one evaluation", ratios[1]),
        (
            "evaluations per effective sample, emcee's default move over the package's",
            _over(runs, lambda run: run.sampling.default_cost / run.sampling.cost),
        ),
    ]
    rows = [(number, name, value) for name, values in measured for number, value in enumerate(values, start=1)]
    return Report(
        title="Benchmark",
        subtitle="Cost of simulations and of effective samples",
        question="How much time does one evaluation, a simulation with its likelihood, take compared with other "
        "simulators at the same accuracy, how does that depend on the problem, and how much time does an effective "
        "sample take?",
        answer=f"MuJoCo's rollouts in C take {_spread(ratios[0])} times as long as one evaluation of the log "
        f"likelihood. One evaluation takes {_spread(1e6 * evaluations)} µs. Case: ETS-VII with {EVALUATED}.",
        goals=goals_of(runs),
        valid=f"run on {processor()}. Between runs the time of an evaluation varies by a factor of "
        f"{_varies(evaluations)}, the ratios to the other simulators by {joined(map(_varies, ratios))}.",
        full=result.full,
        figure=Picture(
            merit_figure(figures),
            f"Every figure of merit over its goal in {len(runs)} runs (dots: median; bars: smallest to largest). To "
            "the right of the line the goal is met; where less is better, the inverse is drawn.",
        ),
        setup=Setup(
            robot="ETS-VII; chains of 6 to 60 links that cut one arm into equal parts.",
            manoeuvre="A random manoeuvre of all joints for 120 s. No flight rule is applied: only times count.",
            sensors="Rate and accelerometer at 2 Hz, 10⁻⁵ rad/s and 10⁻⁵ m/s²; encoders exact, or with noise.",
            known="Arm and orbit. MuJoCo's joints are driven by the exact torques at mid-step, its best case; it "
            "simulates without the gravity gradient.",
            unknown=f"Base and initial rate; three recordings and {runs[0].sampling.chains.z.shape[-1]} unknowns where "
            "samples are drawn.",
            replicates=f"{len(runs)} complete runs, one after the other; within a run the shortest of several times "
            "counts, after a first call that is discarded.",
        ),
        sections=[_simulations, _samples, _device],
        tables=[CsvTable("runs", ["run", "figure of merit", "value"], rows)],
        beside="",
    )


def _simulations(document: Document, result: Result) -> None:
    runs = result.runs
    document.section("Simulations")
    rows = [
        [
            f"{rival.name} (step {rival.step:g} s, error {format_number(rival.error, 2)} σ)",
            _spread(np.array([1e6 * run.rivals[k].seconds for run in runs])),
            _spread(np.array([run.speedups[rival.name] for run in runs])),
        ]
        for k, rival in sorted(enumerate(runs[0].rivals), key=lambda entry: RIVALS.index(entry[1].name))
    ]
    rows.insert(
        0,
        ["one evaluation, as in the answer", _spread(np.array([1e6 * run.evaluation for run in runs])), "1 (1 to 1)"],
    )
    cases: tuple[tuple[str, list[Mapping[Any, float]]], ...] = (
        ("links", [run.links for run in runs]),
        ("samples", [run.samples for run in runs]),
        ("", [run.whitening for run in runs]),
    )
    for title, times in cases:
        first = next(iter(times[0]))
        rows += [
            [
                format_text(f"{'joints exact' if key == 'white' else key} {title}".strip()),
                _spread(np.array([1e6 * seconds[key] for seconds in times])),
                _spread(np.array([seconds[key] / seconds[first] for seconds in times])),
            ]
            for key in times[0]
        ]
    document.table(
        ["simulator or case", "time [µs]", "ratio"],
        rows,
        f"Median of {len(runs)} runs (smallest to largest). Ratios: other simulators over one evaluation of the log "
        f"likelihood, that of ETS-VII with {EVALUATED}; cases over the first with the same unit. The steps of other "
        "simulators are short enough for an error below 0.01 σ, where they can reach it.",
        columns("lrr"),
    )


def _samples(document: Document, result: Result) -> None:
    runs = result.runs
    document.section("Effective samples")
    rows = []
    for number, sampling in enumerate([made.sampling for made in runs], start=1):
        chains = sampling.chains
        rows += [
            _cost(number, "package's", chains.evaluations, chains.effective_samples, sampling.seconds),
            _cost(
                number, "default", sampling.default_evaluations, sampling.default_effective, sampling.default_seconds
            ),
        ]
    lengths = min(run.sampling.default_lengths for run in runs)
    doubt = "" if lengths >= ENOUGH else ", too few for a reliable estimate, so its cost is a lower bound"
    document.table(
        ["run", "moves", "evaluations", "effective samples", "evaluations per sample", "time per sample [ms]"],
        rows,
        "Cost of an effective sample, including burn-in: with the package's moves (Laplace-t independence and "
        f"differential evolution) and with emcee's default stretch move, whose chain covers at least {lengths:.0f} "
        f"autocorrelation times{doubt}. The package's time is that of the whole identification, with mode and "
        "evidence.",
        columns("rlrrrr"),
    )


def _device(document: Document, result: Result) -> None:
    add_device(document, result.device, float(np.median([run.evaluation for run in result.runs])), result.search)


def _cost(number: int, moves: str, evaluations: int, effective: float, seconds: float) -> list[str]:
    counts = [str(evaluations), f"{effective:.0f}", f"{evaluations / effective:.1f}"]
    return [str(number), moves, *counts, f"{1e3 * seconds / effective:.2f}"]


@styled
def merit_figure(figures: Figures) -> Figure:
    """Draw every figure over its goal, so that more is better."""
    figure = wide_figure(0.7 + 0.28 * len(figures))
    axes = figure.subplots()
    for row, (_, values, goal, more) in enumerate(figures):
        ratio = values / goal if more else goal / values
        axes.plot([ratio.min(), ratio.max()], [row, row], color=AFTER, linewidth=2.5, alpha=0.5)
        axes.plot(np.median(ratio), row, "o", color=AFTER, markersize=4)
    axes.axvline(1.0, color=TRUTH, linewidth=0.8)
    axes.set(xscale="log", xlabel="times better than the goal")
    axes.set_yticks(range(len(figures)), [name for name, _, _, _ in figures])
    axes.invert_yaxis()
    return figure


STUDY = Study(
    "benchmark",
    f"Measure the cost of simulations and of effective samples in {RUNS} runs.",
    run=run,
    report=_report,
    full="longer chains, more repeats",
)
