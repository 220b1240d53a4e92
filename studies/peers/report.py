"""Report of the contests with peers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bayesid._io.words import counted, joined
from bayesid._math.arrays import Floats
from bayesid.report import Document
from bayesid.report.figures.figure_style import COLOURS, TRUTH, styled, wide_figure
from bayesid.report.numbers import NO_VALUE, format_percent, format_range, format_signed
from studies.common.ets7 import START, ets7
from studies.common.figures import robot_outline
from studies.common.monte_carlo import Workers, read_store, run_trials
from studies.common.report_parts import add_number_table
from studies.common.study import MADE, TRIALS, CsvTable, Goal, Picture, Report, Setup, Severity, Study, Verdict, show
from studies.peers.contest import EFFECTIVE, LIMITS, LONG, NESTED, REFERENCE, Recipe, attempt, lines, tasks
from studies.peers.density import CASES
from studies.peers.samplers import ADAPTATION, BROAD, CHAINS, LIVE, Sampler

MODERATE = 39  # number of unknowns up to which the goal on time is one
FASTER = 5.0  # smallest wanted ratio of the best peer's time to the package's
EVIDENCE = 0.1  # largest wanted error of the log evidence

# share of the wanted samples from which on the time to all of them is extrapolated; adaptation outweighs fewer
LEAST = 0.25

SIGMAS = 1.96  # half width of a 95 % interval in standard deviations

# packages whose versions are stated
PACKAGES = ("emcee", "numpyro", "dynesty", "nautilus-sampler", "jax", "scipy", "pin", "mujoco")

# recipes in words
TITLES = {
    Recipe.BAYESID: "bayesid: diagnose, identify",
    Recipe.SCIPY: "SciPy with Pinocchio",
    Recipe.SYSID: "mujoco.sysid",
}

TICKS = (5, 10, 20, 50, 100, 200, 500, 1000, 2000)  # ticks of times in the figure [s]
Made = Sequence[Mapping[str, Any]]  # trials that were made: ``task`` and ``result``


def run(
    *,
    full: bool = False,
    seed: int = 1,
    trials: Path | None = None,
    workers: Workers = 1,
    made: bool = False,
    progress: Callable[[str], None] = show,
) -> Made:
    """Make the trials that the store does not hold yet, or only read those ``made`` so far."""
    if made and trials is not None:
        return read(trials)
    planned = tasks(full)
    outcomes = run_trials(attempt, planned, trials, seed=seed, workers=workers, progress=progress)
    return [{"task": task, "result": result} for task, result in zip(planned, outcomes.complete(), strict=True)]


def read(store: Path) -> Made:
    """Return the trials of a store."""
    return [line for line in read_store(store) if "result" in line]


def _report(made: Made) -> Report[Made]:
    planned = len(tasks(full=True))
    keys = ("seconds", "evaluations", "gradients", "effective_samples", "log_evidence", "log_evidence_error")
    density = [trial for trial in made if "unknowns" in trial["task"]]
    return Report(
        title="Comparison with other software",
        subtitle="Samplers on one density; identification tools on one task",
        question="How does the package compare with its alternatives, on the same density and on the same task?",
        answer=_answer(made),
        goals=goals_of(made),
        valid="the density is that of ETS-VII's base from three recordings of 120 s, smooth, with one known mode.",
        full=len(made) >= planned,
        figure=Picture(
            time_figure(made),
            f"Processor time to {EFFECTIVE:,.0f} effective samples against the number of unknowns. Filled: reached; "
            "hollow: extrapolated from the samples reached within the time limit; triangle: lower bound, because less "
            "than a quarter was reached. Points with the same number of unknowns are offset sideways.",
        ),
        setup=_setup(),
        outline=robot_outline(ets7(), START),
        sections=[_failures, _task, _density],
        tables=[
            CsvTable(
                "density",
                [
                    *("unknowns", "sampler", "seconds", "evaluations", "gradients", "effective samples"),
                    *("log evidence", "error"),
                ],
                [
                    [trial["task"]["unknowns"], trial["task"]["sampler"], *(trial["result"][key] for key in keys)]
                    for trial in density
                ],
            )
        ],
        beside="",
        credit=f"With {', '.join(f'{name} {_version(name)}' for name in PACKAGES)}.",
    )


def _task(document: Document, made: Made) -> None:
    recipes = _recipe_rows(made)
    if not recipes:
        return
    document.section("On the same task")
    add_number_table(
        document,
        ["recipe", "studies", "lines", "time [s]", "mass [%]", "moments [%]", "inside 95 %", "rms error [stated sd]"],
        recipes,
        "The base of a robot with three joints from two recordings of 80 s generated by MuJoCo: lines of user code, "
        "processor time, mean absolute errors of the mass and of the moments of inertia, true values within the stated "
        "95 % intervals (ten per study), and root mean square error in stated standard deviations, which is 1 if the "
        "intervals are correct.",
    )
    document.figure(
        error_figure(made),
        "Errors of the ten quantities of each study, in the standard deviations stated by each recipe. If the "
        "intervals are correct, 95 % of the errors lie between the grey lines.",
    )


def _density(document: Document, made: Made) -> None:
    document.section("On the same density")
    add_number_table(
        document,
        [
            "unknowns, sampler",
            "time [s]",
            "evaluations",
            "effective",
            f"time to {EFFECTIVE:,.0f} [s]",
            "ratio",
            "log evidence",
        ],
        [row for unknowns in sorted(CASES) for row in _rows(made, unknowns)],
        f"Processor time and evaluations until the sampler stopped, effective samples, time to {EFFECTIVE:,.0f} of "
        "them (extrapolated where a quarter or more was reached, else a bound) and its ratio to the package's total "
        "time, and the error of the log evidence relative to bridge sampling, with the standard error stated by the "
        "sampler; that of the reference is not included here, but in the goals. A dash: no value. The package's time "
        "is that of its whole run, which yields more samples, and the evidence.",
    )


def goals_of(made: Made) -> list[Goal]:
    """Return the goals: speed by number of unknowns, evidence, and those of the task."""
    few = [unknowns for unknowns in sorted(CASES) if unknowns <= MODERATE]
    many = [unknowns for unknowns in sorted(CASES) if unknowns > MODERATE]
    return [_speed_goal(made, few), _speed_goal(made, many), _evidence_goal(made), *_task_goals(made)]


def _speed_goal(made: Made, sizes: Sequence[int]) -> Goal:
    """Return the goal on the times with some numbers of unknowns; the worst decides."""
    text = f"at least {FASTER:g} times faster than the best peer, {joined(map(str, sizes))} unknowns"
    parts = {unknowns: _speed(made, unknowns) for unknowns in sizes}
    several = len(sizes) > 1
    reached = "; ".join(
        f"{unknowns} unknowns: {said.replace('; ', ', ')}" if several else said for unknowns, (said, _) in parts.items()
    )
    verdict = Verdict.all_of(part for _, part in parts.values())
    return Goal(text, "not run" if verdict is Verdict.NOT_TESTED else reached, verdict, Severity.LOW)


def _speed(made: Made, unknowns: int) -> tuple[str, Verdict]:
    """Return the ratio of the best peer's time to the package's with so many unknowns, and what it decides."""
    package, peers = _result_of(made, unknowns, Sampler.OURS), _peers(made, unknowns)
    if package is None or not peers:
        return "not run", Verdict.NOT_TESTED
    slow = () if unknowns <= NESTED else (Sampler.DYNESTY, Sampler.NAUTILUS)  # not tried with so many unknowns
    missing = [name for name in list(Sampler)[1:] if name not in peers and name not in slow]
    reached = _fastest(package, peers) + (f"; not run: {' / '.join(missing)}" if missing else "")
    below = [peer for peer in peers.values() if _needed(peer) / package["seconds"] < FASTER]
    failed = not all(map(_is_bound, below))
    return reached, Verdict.FAIL if failed else Verdict.OPEN if below or missing else Verdict.PASS


def _evidence_goal(made: Made) -> Goal:
    """Return the goal on the log evidence; the worst number of unknowns decides."""
    text = f"log evidence within {EVIDENCE:g} of a long reference, {joined(map(str, sorted(CASES)))} unknowns"
    told, verdicts = {}, []
    for unknowns in sorted(CASES):
        error = _evidence_error(made, unknowns, Sampler.OURS)
        if error is None:
            verdicts.append(Verdict.NOT_TESTED)
            continue
        size, sd = abs(error[0]), error[1]
        told[unknowns] = size, f"{size:.3f} ± {sd:.3f}"
        verdicts.append(Verdict.between(size - 2.0 * sd, size + 2.0 * sd, most=EVIDENCE))
    if not told:
        return Goal(text, "not run", Verdict.NOT_TESTED, Severity.HIGH)
    worst = max(told, key=lambda unknowns: told[unknowns][0])
    reached = f"at most {told[worst][1]} ({worst} unknowns)"
    if others := [f"{said} ({unknowns})" for unknowns, (_, said) in told.items() if unknowns != worst]:
        reached += f"; {', '.join(others)}"
    return Goal(text, reached, Verdict.all_of(verdicts), Severity.HIGH)


def _fastest(package: Mapping[str, Any], peers: Mapping[Sampler, Mapping[str, Any]]) -> str:
    """Return the ratio of the fastest peer with an estimate of its time, and the smallest bound, which limits set."""
    ratios = {name: _needed(result) / package["seconds"] for name, result in peers.items()}
    bounds = [ratio for name, ratio in ratios.items() if _is_bound(peers[name])]
    estimates = {name: ratio for name, ratio in ratios.items() if not _is_bound(peers[name])}
    if not estimates:
        return f"more than {min(bounds):.1f} ({counted(len(bounds), 'peer')}, none with an estimate)"
    best = min(estimates, key=lambda name: estimates[name])
    beside = f"; {counted(len(bounds), 'other')} at least {min(bounds):.1f}" if bounds else ""
    return f"{estimates[best]:.1f} ({best}){beside}"


def _task_goals(made: Made) -> list[Goal]:
    goals = []
    for hidden, words in ((False, "nothing hidden"), (True, "hidden wheel momentum")):
        text = f"stated 95 % intervals contain the truth in 95 % of cases, {words}"
        errors = _errors(made, Recipe.BAYESID, hidden)
        if not len(errors):
            goals.append(Goal(text, "not run", Verdict.NOT_TESTED, Severity.HIGH))
            continue
        inside, total = int((np.abs(errors) < SIGMAS).sum()), errors.size
        other = "".join(f"; {name} {_inside(peer)}" for name, peer in _rivals(made, hidden).items())
        # errors of one study depend on each other: a share is decided by studies, and few cannot decide
        verdict = Verdict.FAIL if inside < 0.5 * total else Verdict.OPEN
        told = f"{inside} of {total} in {len(errors)} studies, whose errors are correlated: too few to decide{other}"
        goals.append(Goal(text, told, verdict, Severity.HIGH))
    return goals


def _answer(made: Made) -> str:
    parts: list[str] = []
    ratios, bounds = {}, []
    for unknowns in sorted(CASES):
        package, peers = _result_of(made, unknowns, Sampler.OURS), _peers(made, unknowns)
        if package is not None and peers:
            ratios[unknowns] = min(_needed(peer) / package["seconds"] for peer in peers.values())
            bounds += [_needed(peer) / package["seconds"] for peer in peers.values() if _is_bound(peer)]
    if ratios:
        beside = (
            f" For samplers that reached less than {format_percent(LEAST)} of the samples only lower bounds are known, "
            f"the smallest being {min(bounds):.1f} times."
            if bounds
            else ""
        )
        parts.append(
            f"The fastest alternative takes at least {min(ratios.values()):.1f} times as long as the package. With "
            f"{joined(list(map(str, ratios)))} unknowns it takes {'at least ' if bounds else ''}"
            f"{joined([f'{ratio:.1f}' for ratio in ratios.values()])} times as long.{beside}"
        )
    errors = [_evidence_error(made, unknowns, Sampler.OURS) for unknowns in CASES]
    known = [error for error in errors if error is not None]
    if known:
        largest, error = max(abs(size) for size, _, _ in known), max(sd for _, sd, _ in known)
        parts.append(
            f"The package's log evidence differs from a long reference by at most {largest:.3f}, with a standard "
            f"error of at most {error:.3f}."
        )
    errors_of_package, rivals = _errors(made, Recipe.BAYESID, True), _rivals(made, True)
    if len(errors_of_package) and rivals:
        others = " and ".join(f"{_inside(peer)} for {name}" for name, peer in rivals.items())
        parts.append(
            f"With hidden wheel momentum, {_inside(errors_of_package)} of the package's stated 95 % intervals "
            f"contain the truth, against {others}."
        )
    ratios_of_task = list(_task_ratios(made))
    if ratios_of_task:
        parts.append(
            f"On the same task the package, which diagnoses and identifies, takes {format_range(ratios_of_task, 2)} "
            f"times as long as a point estimate with {' or with '.join(_rivals(made, False))}."
        )
    return " ".join(parts) or "Nothing was run."


def _task_ratios(made: Made) -> Iterator[float]:
    """Yield the package's median time on the task over that of every other recipe, without and with wheels hidden."""
    for hidden in (False, True):
        times = _task_times(made, hidden)
        of_package = times.pop(Recipe.BAYESID, None)
        if of_package is not None:
            yield from (of_package / time for time in times.values())


def _task_times(made: Made, hidden: bool) -> dict[Recipe, float]:
    """Return the median processor time of every recipe that was run [s]."""
    by_recipe = {recipe: _recipes(made, recipe, hidden) for recipe in Recipe}
    return {
        recipe: float(np.median([result["seconds"] for result in results]))
        for recipe, results in by_recipe.items()
        if results
    }


def _setup() -> Setup:
    return Setup(
        robot="ETS-VII for the density; a robot with three joints and a base of 547 kg for the task.",
        manoeuvre="Three random motions of all joints, 120 s each; for the task two of 80 s, generated by MuJoCo.",
        sensors="White noise (1 sigma) at a sampling interval of 0.5 s: rates 10⁻⁵ rad/s, accelerations 10⁻⁵ m/s², "
        "joint positions 10⁻⁶ rad.",
        known="Density: the mode, and the Laplace approximation, which whitens the coordinates for all samplers; the "
        "package chose these coordinates for its sampler. Task: deep space; all links except the base.",
        unknown="Density: "
        + ", ".join(f"{size} ({CASES[size].title})" for size in sorted(CASES))
        + "; link masses are uncertain by 5 % (1 sigma). Task: base and initial rates.",
        replicates=f"Each sampler runs alone in a process with one core, until at least {EFFECTIVE:,.0f} effective "
        f"samples or {min(LIMITS.values()):g} to {max(LIMITS.values()):g} s of processor time, more than five times "
        f"the package's time; code is compiled beforehand. NUTS: {CHAINS} chains in batches with the unit mass matrix, "
        f"{ADAPTATION} steps to adapt the step size. Nested samplers start from a normal prior of {BROAD:g} standard "
        "deviations about the mode, for which the evidence is that of the posterior; dynesty takes single points, "
        f"{LIVE} live; both are run up to {NESTED} unknowns. The reference for means and evidence: chains of the "
        f"package's sampler with {LONG:,.0f} effective samples, and bridge sampling (Meng and Wong 1996) between one "
        "half of them and a Student-t fitted to the other; the chains are not independent of the package. FIGAROH "
        "needs measured joint torques and is therefore not applicable.",
    )


def _failures(document: Document, made: Made) -> None:
    document.section("What went wrong")
    sentences = _slower(made)
    late = [
        f"{trial['task']['sampler']} ({trial['task']['unknowns']})"
        for trial in made
        if "unknowns" in trial["task"] and not trial["result"]["finished"]
    ]
    sentences.append(
        f"Stopped at the time limit (number of unknowns): {'; '.join(late)}."
        if late
        else "No sampler was stopped at the time limit."
    )
    beyond = joined(str(unknowns) for unknowns in sorted(CASES) if unknowns > NESTED)
    sentences.append(f"{Sampler.DYNESTY} and {Sampler.NAUTILUS} were not run with {beyond} unknowns.")
    shifts = [
        (float(np.abs(np.subtract(result["mean"], reference["mean"])).max()), f"{name} ({unknowns})")
        for unknowns in CASES
        for name, result in {Sampler.OURS: _result_of(made, unknowns, Sampler.OURS), **_peers(made, unknowns)}.items()
        if (reference := _result_of(made, unknowns, REFERENCE)) is not None and result is not None and result["mean"]
    ]
    if shifts:
        worst, where = max(shifts)
        sentences.append(
            f"Sample means differ from those of the reference by at most {worst:.2f} standard deviations ({where})."
        )
    missing = [task for task in tasks(full=True) if not any(trial["task"] == task for trial in made)]
    if missing:
        kinds = sorted({task.get("sampler") or TITLES[Recipe(task["recipe"])] for task in missing})
        sentences.append(f"Trials of the full study that were not run: {len(missing)} ({', '.join(kinds)}).")
    sentences.append(
        "The rollout of mujoco.sysid drives joints by forces and does not accept their motion. Its recipe therefore "
        "contains a separate simulation, and takes parameters, optimiser and intervals from the toolbox. MuJoCo 4.0.0 "
        "accepts the inertia tensor that the toolbox writes only after one more line of user code."
    )
    document.items(sentences)


def _slower(made: Made) -> list[str]:
    """Return sentences on the recipes that take less time than the package's on the same task."""
    sentences = []
    for hidden, words in ((False, "With nothing hidden"), (True, "With hidden wheel momentum")):
        times = _task_times(made, hidden)
        of_package = times.pop(Recipe.BAYESID, None)
        faster = [
            f"{TITLES[recipe]} {time:.1f} s" for recipe, time in times.items() if of_package and time < of_package
        ]
        if faster:
            sentences.append(
                f"{words} the package is slower on the same task: its median time is {of_package:.1f} s, against "
                f"{joined(faster)}."
            )
    return sentences


def _rows(made: Made, unknowns: int) -> list[list[str]]:
    package = _result_of(made, unknowns, Sampler.OURS)
    rows = []
    for name in (*Sampler, REFERENCE):
        result = _result_of(made, unknowns, name)
        if result is None:
            continue
        sampled = f"{result['effective_samples']:,.0f}" if result["effective_samples"] > 0.0 else NO_VALUE
        compared = [NO_VALUE, NO_VALUE]
        if name != REFERENCE and package is not None:
            least, needed = "> " if _is_bound(result) else "", _needed(result)
            compared = [f"{least}{needed:,.0f}", f"{least}{needed / package['seconds']:.1f}"]
        error = _evidence_error(made, unknowns, name)
        evidence = NO_VALUE if error is None else f"{format_signed(error[0], 3)} ± {error[2]:.3f}"
        numbers = [f"{result['seconds']:.0f}", f"{result['evaluations']:,}", sampled, *compared, evidence]
        rows.append([f"{unknowns}, {name}", *numbers])
    return rows


def _recipe_rows(made: Made) -> list[list[str]]:
    rows = []
    for hidden, words in ((False, "nothing hidden"), (True, "hidden wheel momentum")):
        for recipe in Recipe:
            results = _recipes(made, recipe, hidden)
            if not results:
                continue
            errors = _errors(made, recipe, hidden)
            relative = np.abs(
                [np.subtract(result["mean"], result["truth"]) / np.array(result["truth"]) for result in results]
            )
            rows.append(
                [
                    f"{TITLES[recipe]}, {words}",
                    str(len(results)),
                    str(lines(recipe)),
                    f"{np.median([result['seconds'] for result in results]):.0f}",
                    f"{100.0 * relative[:, 0].mean():.3f}",
                    f"{100.0 * relative[:, 4:7].mean():.3f}",
                    _inside(errors),
                    f"{np.sqrt((errors**2).mean()):.1f}",
                ]
            )
    return rows


def _result_of(made: Made, unknowns: int, sampler: str) -> Mapping[str, Any] | None:
    for trial in made:
        if trial["task"].get("unknowns") == unknowns and trial["task"]["sampler"] == sampler:
            result: Mapping[str, Any] = trial["result"]
            return result
    return None


def _peers(made: Made, unknowns: int) -> dict[Sampler, Mapping[str, Any]]:
    results = {name: _result_of(made, unknowns, name) for name in list(Sampler)[1:]}
    return {name: result for name, result in results.items() if result is not None}


def _needed(result: Mapping[str, Any]) -> float:
    """Return the time to the wanted samples [s], extrapolated where fewer were reached, or a lower bound of it."""
    share = 1.0 if _is_bound(result) else min(result["effective_samples"] / EFFECTIVE, 1.0)
    return float(result["seconds"] / share)


def _is_bound(result: Mapping[str, Any]) -> bool:
    """Whether so few samples were reached that the time is a bound."""
    return bool(result["effective_samples"] < LEAST * EFFECTIVE)


def _evidence_error(made: Made, unknowns: int, sampler: str) -> tuple[float, float, float] | None:
    """Return the error of a log evidence, its standard error, and the part that the sampler states."""
    result, reference = _result_of(made, unknowns, sampler), _result_of(made, unknowns, REFERENCE)
    if result is None or reference is None or result["log_evidence"] is None or sampler == REFERENCE:
        return None
    stated = result["log_evidence_error"]
    both = float(np.hypot(stated, reference["log_evidence_error"]))
    return float(result["log_evidence"] - reference["log_evidence"]), both, stated


def _recipes(made: Made, recipe: Recipe, hidden: bool) -> list[Mapping[str, Any]]:
    return [
        trial["result"] for trial in made if trial["task"].get("recipe") == recipe and trial["task"]["hidden"] is hidden
    ]


def _errors(made: Made, recipe: Recipe, hidden: bool) -> Floats:
    """Return the errors in stated standard deviations, shape (studies, 10)."""
    results = _recipes(made, recipe, hidden)
    return np.array([np.subtract(result["mean"], result["truth"]) / np.array(result["sd"]) for result in results])


def _rivals(made: Made, hidden: bool) -> dict[str, Floats]:
    """Return the errors of the other recipes in stated standard deviations, (studies, 10), by the name of each."""
    by_recipe = {TITLES[recipe]: _errors(made, recipe, hidden) for recipe in Recipe if recipe is not Recipe.BAYESID}
    return {name: errors for name, errors in by_recipe.items() if len(errors)}


def _inside(errors: Floats) -> str:
    return f"{int((np.abs(errors) < SIGMAS).sum())} of {errors.size}"


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "(not installed)"


@styled
def time_figure(made: Made) -> Figure:
    """Draw the time to the wanted samples against the number of unknowns; samplers stand beside each other."""
    figure = wide_figure(2.5)
    axes = figure.subplots()
    shown = [name for name in Sampler if any(_result_of(made, size, name) for size in CASES)]
    needed: list[float] = []
    for number, (colour, name) in enumerate(zip(COLOURS, shown, strict=False)):
        beside = 1.035 ** (number - 0.5 * (len(shown) - 1))
        axes.plot([], [], "o", color=colour, markersize=5, label=str(name))
        for size in sorted(CASES):
            result = _result_of(made, size, name)
            if result is not None:
                filled = colour if result["effective_samples"] >= EFFECTIVE else "white"
                needed.append(_needed(result))
                marker = "^" if _is_bound(result) else "o"
                axes.plot(beside * size, needed[-1], marker, color=colour, markersize=5, mfc=filled)
    axes.set(xscale="log", yscale="log", xlabel="unknowns", ylabel="processor time [s]")
    axes.set_xticks(sorted(CASES), [str(size) for size in sorted(CASES)])
    if needed:
        axes.set_ylim(0.7 * min(needed), 1.4 * max(needed))
        ticks = [tick for tick in TICKS if 0.7 * min(needed) < tick < 1.4 * max(needed)]
        axes.set_yticks(ticks, [str(tick) for tick in ticks])
    axes.minorticks_off()
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    return figure


@styled
def error_figure(made: Made) -> Figure:
    """Draw the errors of every recipe in the standard deviations that it states, without and with wheels hidden."""
    figure = wide_figure(2.2)
    panels = figure.subplots(1, 2, sharey=True)
    for axes, hidden, title in zip(panels, (False, True), ("nothing hidden", "hidden wheels"), strict=True):
        for place, (recipe, colour) in enumerate(zip(Recipe, COLOURS, strict=False)):
            errors = _errors(made, recipe, hidden).ravel()
            axes.plot(place + np.linspace(-0.25, 0.25, len(errors)), errors, ".", color=colour)
        for limit in (-SIGMAS, SIGMAS):
            axes.axhline(limit, color=TRUTH, linewidth=0.8)
        axes.set_xticks(
            range(len(Recipe)), [TITLES[recipe].partition(":")[0].replace(" around ", " around\n") for recipe in Recipe]
        )
        axes.set_title(title)
    panels[0].set_ylabel("error [stated sd]")
    return figure


STUDY = Study(
    "peers",
    "Compare the package with its alternatives.",
    run=run,
    report=_report,
    full="every case, every sampler and every recipe",
    seed=1,
    extra={**TRIALS, **MADE},
)
