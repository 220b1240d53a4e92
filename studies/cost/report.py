"""Report of the cost of commands."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bayesid._io.words import joined
from bayesid.report import Document
from bayesid.report.figures.figure_style import AFTER, BEFORE, styled, wide_figure
from bayesid.report.numbers import NO_VALUE, format_number, format_signed
from studies.benchmark.run import EVALUATED
from studies.common.provenance import MODELS, processor
from studies.common.report_parts import columns
from studies.common.study import CsvTable, Goal, Picture, Report, Setup, Severity, Study, Verdict
from studies.cost.run import AFTER_VERDICT, COMMANDS, DIAGNOSES, LARGE, Cost, Nested, Run, middle, run
from studies.cost.search_times import SearchTimes

MEMORY = 1.5  # largest wanted memory of a diagnosis [GB]
SAMPLES = 30.0  # longest wanted time for 4,000 effective samples of an extended model [s]
BEGIN = 20.0  # longest wanted time of a cold start of a search [s]
CHANGED = 0.1  # relative change of a time beside an earlier run from which it is told


def goals_of(cost: Cost) -> list[Goal]:
    """Return every goal with what was reached."""
    goals = [_times(cost, code) for code in ("warm", "cold")]
    memory = {name: max(run.memory for run in runs) for name, runs in cost.diagnoses.items()}
    worst = max(memory, key=lambda name: memory[name])
    sampled = {name: run.phases["sample"] for name, run in cost.sampled.items()}
    goals += [
        Goal(
            f"Memory of a diagnosis: at most {MEMORY:g} GB",
            f"{format_number(memory[worst], 3)} GB ({worst})",
            Verdict.of(memory[worst] <= MEMORY),
            Severity.LOW,
        ),
        Goal(
            f"4,000 effective samples of the extended model of a single cause within a further {SAMPLES:g} s",
            ", ".join(f"{name} {seconds:.1f} s" for name, seconds in sampled.items()) or "not sampled",
            Verdict.of(max(sampled.values()) <= SAMPLES if sampled else None),
            Severity.LOW,
        ),
    ]
    goals += [_command_goal(cost.commands), _large_goal(cost.large), _search_goal(cost.search)]
    return [goal for goal in goals if goal is not None]


def _command_goal(commands: Mapping[str, list[Run]]) -> Goal | None:
    """Return the goal on the time of other commands; None where none was run."""
    limits = {name: limit for name, limit in COMMANDS.items() if limit is not None and name in commands}
    walls = {name: [run.wall for run in commands[name][1:]] for name in limits}
    if not walls:
        return None
    text = "Files to report, with cached compiled code, at most: "
    text += ", ".join(f"{name} {limit:g} s" for name, limit in limits.items())
    told = ", ".join(f"{name} {_spread(each)}" for name, each in walls.items())
    verdicts = [Verdict.between(min(each), max(each), most=limits[name]) for name, each in walls.items()]
    return Goal(text, told, Verdict.all_of(verdicts), Severity.LOW)


def _times(cost: Cost, code: str) -> Goal | None:
    """Return the goal on the time to the verdict, with the limit of each group of diagnoses; None without any."""
    part = slice(0, 1) if code == "cold" else slice(1, None)
    texts, told, verdicts = [], [], []
    for limit in sorted({getattr(case, code) for case in DIAGNOSES}):
        wanted = [case.title for case in DIAGNOSES if case.title in cost.diagnoses and getattr(case, code) == limit]
        each = {name: [run.to_verdict for run in cost.diagnoses[name][part]] for name in wanted}
        if each:
            texts.append(f"at most {limit:g} s for {', '.join(each)}")
            told += [f"{name} {_spread(values)}" for name, values in each.items()]
            verdicts += [Verdict.between(min(values), max(values), most=limit) for values in each.values()]
    if not texts:
        return None
    kind = "without cached compiled code" if code == "cold" else "with cached compiled code"
    text = f"Files to verdict, {kind}: {'; '.join(texts)}"
    return Goal(text, ", ".join(told), Verdict.all_of(verdicts), Severity.LOW)


def _large_goal(large: Mapping[str, list[Run]]) -> Goal | None:
    """Return the goal of what was run on much data; None where nothing was."""
    texts, told, verdicts = [], [], []
    for row in LARGE:
        if row.title in large:
            texts.append(f"{row.title}: {row.seconds:g} s and {row.memory:g} GB")
            if not large[row.title]:
                told.append("refused for its memory")
                verdicts.append(Verdict.FAIL)
                continue
            warm = large[row.title][-1]
            seconds = warm.to_verdict if row.command == "diagnose" else warm.wall
            told.append(f"{seconds:.0f} s, {format_number(warm.memory, 2)} GB")
            verdicts.append(Verdict.of(seconds <= row.seconds and warm.memory <= row.memory))
    if not texts:
        return None
    text = f"Large data sets, with cached compiled code, at most: {'; '.join(texts)}"
    return Goal(text, "; ".join(told), Verdict.all_of(verdicts), Severity.LOW)


def _search_goal(search: SearchTimes | None) -> Goal:
    text = f"Cold start of a search for manoeuvres: at most {BEGIN:g} s"
    if search is None:
        return Goal(text, "not measured", Verdict.NOT_TESTED, Severity.LOW)
    reached = f"{search.cold:.1f} s, {search.warm:.1f} s with cached compiled code"
    return Goal(text, reached, Verdict.of(search.cold <= BEGIN), Severity.LOW)


def _criterion(search: SearchTimes) -> str:
    low, middle_of, high = (1e3 * value for value in np.percentile(search.criterion, [5.0, 50.0, 95.0]))
    return (
        f"One evaluation of a design criterion with its gradient takes {middle_of:.1f} ms on one core ({low:.1f} to "
        f"{high:.1f}, 90 % of {len(search.criterion)} manoeuvres of {search.unknowns} free numbers)."
    )


def _nested(cost: Cost, one: Nested) -> str:
    count, seconds = max(cost.candidates.items())
    ratio = one.seconds * count / seconds
    unfinished = "" if one.done else ", in which it did not finish"
    return (
        f"One run of dynesty with {one.unknowns} unknowns takes {one.seconds:.0f} s of processor time{unfinished}. One "
        f"run for each of {count} candidates would take {'' if one.done else 'more than '}{format_number(ratio, 2)} "
        "times as long as the verdict on all of them."
    )


def _spread(values: Sequence[float]) -> str:
    if len(values) < 2:
        return f"{values[0]:.1f} s"
    return f"{np.median(values):.1f} s ({min(values):.1f} to {max(values):.1f})"


def _report(cost: Cost) -> Report[Cost]:
    warm = {name: middle(runs, lambda run: run.to_verdict) for name, runs in cost.diagnoses.items()}
    quickest, slowest = min(warm, key=lambda name: warm[name]), max(warm, key=lambda name: warm[name])
    goals = goals_of(cost)
    return Report(
        title="Cost",
        subtitle="Time and memory of commands, from files to answers",
        question="How long do commands take from files to answers, with and without cached compiled code, how much "
        "memory do they need, and how does that grow with the problem?",
        answer=f"A diagnosis of three recordings reaches its verdict in {warm[quickest]:.1f} s ({quickest}) to "
        f"{warm[slowest]:.1f} s ({slowest}). It evaluates the whole catalogue with cached compiled "
        f"code.{_limits_text(warm)} "
        f"{sum(goal.verdict is Verdict.FAIL for goal in goals)} of {len(goals)} goals are missed.",
        goals=goals,
        valid=f"run on {processor()}, with no other load. The machine's speed varies by a factor of two between days.",
        full=cost.full,
        figure=Picture(
            phases_figure(cost),
            "Time from files to report of each diagnosis, without cached compiled code (left bar) and with it (right "
            "bar): orange until the verdict, blue after it. Samples are not drawn.",
        ),
        setup=Setup(
            robot="A servicer with three joints where files are timed; ETS-VII and chains of links for evaluations.",
            manoeuvre="Three random manoeuvres of 140 to 160 s, far faster than the flight rule permits: only times "
            "count.",
            sensors="Rate and accelerometer at 4 Hz and encoders, written to files by MuJoCo.",
            known="Links, orbit and sensors, as stated in the study files.",
            unknown="Base and initial rates, and the hidden cause.",
            replicates="One run without cached compiled code and three with it; medians, with smallest and largest.",
        ),
        sections=[_phases, _compared, _growth],
        tables=[_runs(cost)],
        beside="",
    )


def _runs(cost: Cost) -> CsvTable:
    names = ["start", "load", "compile", "fit", "verdict", *AFTER_VERDICT]
    rows = [
        [kind, name, number, "cold" if number == 0 else "warm", run.wall, run.processor, run.memory]
        + [run.phases.get(phase, "") for phase in names]
        for kind, group in (("diagnose", cost.diagnoses), ("command", cost.commands), ("large", cost.large))
        for name, runs in group.items()
        for number, run in enumerate(runs)
    ]
    return CsvTable("runs", ["kind", "what", "run", "code", "wall", "processor", "memory", *names], rows)


def _limits_text(warm: Mapping[str, float]) -> str:
    """Return the wanted times to the verdict beside those that were reached, for a sentence."""
    parts = []
    for limit in sorted({case.warm for case in DIAGNOSES if case.title in warm}):
        times = {case.title: warm[case.title] for case in DIAGNOSES if case.title in warm and case.warm == limit}
        late = sum(value > limit for value in times.values())
        parts.append(f" The limit of {limit:g} s ({joined(times)}) is missed in {late} of {len(times)} cases.")
    return "".join(parts)


def _phases(document: Document, cost: Cost) -> None:
    document.section("Time by phase")
    phases = ("start", "load", "compile", "fit", "verdict", "consequences", "report")
    rows = []
    for name, runs in cost.diagnoses.items():
        parts = (runs[:1], runs[1:])
        cells = [[float(np.median([run.phases.get(phase, 0.0) for run in part])) for part in parts] for phase in phases]
        memory = max(run.memory for run in runs)
        rows.append([name, *(f"{cold:.1f} / {warm:.1f}" for cold, warm in cells), f"{memory:.2f}"])
    document.table(
        ["diagnosis of", *phases, "memory [GB]"],
        rows,
        "Time by phase [s], without / with cached compiled code; medians. Start: import of the package, reading of the "
        "files, smoothing of the joints' motion. Compile: functions of the simulation; further functions are compiled "
        "or loaded in the phases that use them.",
        columns("l" + "r" * (len(phases) + 1)),
    )
    rows = []
    for name, runs in cost.commands.items():
        warm, memory = runs[1:], max(run.memory for run in runs)
        phases_of = ", ".join(f"{phase} {np.median([r.phases[phase] for r in warm]):.1f}" for phase in runs[-1].phases)
        walls = _spread([run.wall for run in warm])
        rows.append([name, f"{runs[0].wall:.1f}", walls, f"{memory:.2f}", phases_of or NO_VALUE])
    silent = [name for name, runs in cost.commands.items() if not runs[-1].phases]
    unsaid = f" The files of {joined(silent)} state no time by phase." if silent else ""
    if rows:
        document.table(
            ["command", "without [s]", "with cached code [s]", "memory [GB]", "phases, with cached code [s]"],
            rows,
            "Other commands on the recordings with nothing hidden, from files to report, without and with cached "
            f"compiled code; design with its default settings.{unsaid}",
            columns("lrrrl"),
        )


def _compared(document: Document, cost: Cost) -> None:
    """Tabulate the times of an earlier run beside those of this one, where one was given."""
    if cost.before is None:
        return
    with cost.before.open(encoding="utf-8", newline="") as stream:
        lines = [line for line in csv.DictReader(stream) if line["code"] == "warm"]
    rows = []
    for kind, group in (("diagnose", cost.diagnoses), ("command", cost.commands)):
        for name, runs in group.items():
            earlier = [float(line["wall"]) for line in lines if (line["kind"], line["what"]) == (kind, name)]
            if not earlier:
                continue
            was, now = float(np.median(earlier)), middle(runs, lambda run: run.wall)
            if abs(now / was - 1.0) > CHANGED:
                change = format_signed(100.0 * (now / was - 1.0), 0)
                rows.append([f"diagnose ({name})" if kind == "diagnose" else name, f"{was:.1f}", f"{now:.1f}", change])
    within = f"within {100.0 * CHANGED:.0f} % of the run that wrote {cost.before.name}"
    if not rows:
        document.paragraph(f"All times to the report with cached compiled code are {within}.")
        return
    document.table(
        ["command", "then [s]", "now [s]", "change [%]"],
        rows,
        f"Files to report with cached compiled code, compared with an earlier run. All others are {within}.",
        columns("lrrr"),
    )


def _growth(document: Document, cost: Cost) -> None:
    document.section("Growth, and the lower bound")
    grown = [(name, "{:.0f} µs", 1e6, times) for name, times in cost.growth.items()]
    if len(cost.candidates) > 1:
        grown.append(("candidates (verdict)", "{:.2f} s", 1.0, cost.candidates))
    rows = []
    for name, form, unit, times in grown:
        first = next(iter(times.values()))
        ratios = ", ".join(format_number(value / first, 3) for value in times.values())
        rows.append([name, ", ".join(map(str, times)), form.format(unit * first), ratios])
    document.table(
        ["what grows", "sizes", "time of the first", "ratios to the first"],
        rows,
        "Time of one evaluation of ETS-VII's log density in a batch, and time of a verdict by number of candidates.",
        columns("llrl"),
    )
    floor = cost.floor
    document.paragraph(
        f"One evaluation, of ETS-VII with {EVALUATED}, takes {format_number(floor.operations / 1e6, 3)} million "
        "floating-point operations and, by the compiler's count, reads and writes "
        f"{format_number(floor.traffic / 1e6, 3)} MB, mostly in caches. One core multiplies matrices at "
        f"{format_number(floor.speed / 1e9, 3)} GFLOP/s and streams {format_number(floor.bandwidth / 1e9, 3)} GB/s "
        f"from memory. At that speed the operations alone would take {format_number(1e6 * floor.least, 2)} µs; "
        f"{format_number(1e6 * floor.seconds, 3)} µs were measured here. One evaluation is "
        f"{format_number(floor.seconds / floor.least, 2)} times above that bound, as is usual for small matrices and "
        "short loops."
    )
    if cost.search is not None:
        document.paragraph(_criterion(cost.search))
    if cost.nested is not None:
        document.paragraph(_nested(cost, cost.nested))


@styled
def phases_figure(cost: Cost) -> Figure:
    """Draw the time until the verdict and after it, cold and warm."""
    figure = wide_figure(1.7)
    axes = figure.subplots()

    for number, runs in enumerate(cost.diagnoses.values()):
        for shift, part in ((-0.2, runs[:1]), (0.2, runs[1:])):
            verdict = float(np.median([run.to_verdict for run in part]))
            whole = float(np.median([run.wall for run in part]))
            axes.bar(number + shift, verdict, 0.36, color=BEFORE)
            axes.bar(number + shift, whole - verdict, 0.36, bottom=verdict, color=AFTER)
    axes.set_xticks(range(len(cost.diagnoses)), [name.replace(" ", "\n") for name in cost.diagnoses])
    axes.set_ylabel("time [s]")
    return figure


STUDY = Study(
    "cost",
    "Measure time and memory of commands from files to answers, and how they grow with the problem.",
    run=run,
    report=_report,
    full="repeat every run, draw samples, and run a nested sampler for up to ten minutes",
    seed=0,
    extra={
        "--before": {"type": Path, "help": "CSV file with the times of an earlier run, for comparison"},
        "--runs": {"type": Path, "help": "folder that stores the timed runs, to resume an interrupted study"},
    },
    inputs=lambda options: [MODELS / "ets7.urdf", *([] if options.before is None else [options.before])],
)
