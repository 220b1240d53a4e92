"""The study: how it runs, what it is judged by, and what its report shows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import chi2

from bayesid._io.progress import Progress, silent
from bayesid._io.words import counted, joined
from bayesid.design import Search
from bayesid.report import Document, figures, format_quantity
from bayesid.report.figures.figure_style import AFTER, BEFORE, COLOURS, shared_legend, styled, wide_figure
from bayesid.report.numbers import format_fixed, format_number, format_percent, format_signed
from studies.common import mission
from studies.common.ets7 import BIAS
from studies.common.quantities import HEADINGS, LABELS, MASS, ROWS
from studies.common.report_parts import add_number_table
from studies.common.study import CsvTable, Finding, Goal, Picture, Report, Setup, Severity, Statement, Study, Verdict
from studies.load import loops, paper
from studies.load.loops import Flight, Iteration

NOISE_FREE = 1e-6  # relative error to reach without noise

# squared distance from the mean within which ten parameters lie with 99 %, in standard deviations
REGION = float(chi2.ppf(0.99, 10))

TITLES = {"loop": "arm uncertain by 5 %", "exact": "arm known exactly"}  # what is known of the arm, the headline first

# titles of the limits
LIMIT_TITLES = {"tip_speed": "tip speed", "tip_rate": "tip rate", "base_rotation": "base rotation"}


@dataclass(frozen=True)
class Result:
    """Outcome of the study."""

    iterations: list[Iteration]  # the paper's two iterations without noise
    # by the keys of `TITLES`: the safe loop, and its manoeuvres flown again with the arm known exactly
    flights: dict[str, Flight]
    full: bool


def run(folder: Path, *, full: bool = False, seed: int = 0, progress: Progress = silent) -> Result:
    """Run the study; the arguments are options of the command."""
    folder = folder / ("full" if full else "quick")
    folder.mkdir(parents=True, exist_ok=True)
    search = Search() if full else Search(starts=2, iterations=25)
    loop = loops.fly_loop(folder, seed=seed, search=search, progress=progress)
    flights = {"loop": loop, "exact": loops.fly_again(folder, loop, seed=seed)}
    return Result(loops.iterate(seed=seed, search=search), flights, full)


def _goals(result: Result) -> list[Goal]:
    loop, flights = result.flights["loop"], result.flights
    exact = flights["exact"]
    mass, sd = abs(exact.error(-1)[MASS]), exact.relative(-1)[MASS]
    trusted = sum(review["trusted"] for review in loop.reviews)
    largest = {name: max(flight.used.values()) for name, flight in flights.items()}
    used = [
        f"{', '.join(f'{LIMIT_TITLES[key]} {format_percent(part, 4)}' for key, part in flight.used.items())}, "
        f"{TITLES[name]}"
        for name, flight in flights.items()
    ]
    distances = {name: flight.distance(-1) for name, flight in flights.items()}
    error = result.iterations[-1].worst
    return [
        Goal(
            f"Mass of the load: error and sd at most {format_percent(loops.GOAL, 2)} within {loops.AT_MOST} "
            f"manoeuvres, {TITLES['exact']}",
            f"error {format_percent(mass, 2)}, sd {format_percent(sd, 2)} after {len(exact.bodies)}; largest error of "
            f"mass and moments {format_percent(exact.worst(-1)[0], 2)}",
            Verdict.of(sd <= loops.GOAL and mass <= loops.GOAL),
            Severity.MEDIUM,
        ),
        Goal(
            "The loop flies every step, never stops with a no-go, and its diagnosis of all recordings so far trusts "
            "the correct model after every manoeuvre",
            f"{counted(len(loop.bodies), 'manoeuvre')} flown, {'stopped by a' if loop.status == 'no-go' else 'no'} "
            f"no-go; trusted after {trusted} of {len(loop.reviews)}",
            Verdict.of(loop.status != "no-go" and trusted == len(loop.reviews)),
            Severity.MEDIUM,
        ),
        Goal(
            f"Every limit satisfied in MuJoCo, {' and '.join(TITLES.values())}",
            f"largest share used: {'; '.join(used)}",
            Verdict.of(max(largest.values()) <= 1.0),
            Severity.HIGH,
        ),
        Goal(
            "Truth within the 99 % region of the last posterior, ten parameters, "
            f"{' and '.join(TITLES.values())} (squared distance at most {format_fixed(REGION, 1)})",
            ", ".join(f"{format_fixed(distance, 1)} ({TITLES[name]})" for name, distance in distances.items()),
            Verdict.of(max(distances.values()) <= REGION),
            Severity.HIGH,
        ),
        Goal(
            "Without noise, relative error at most 10⁻⁶ after two iterations",
            f"{format_number(error, 2)}, within the flight rule, MuJoCo step {loops.TRUTH_STEP:g} s",
            Verdict.of(error <= NOISE_FREE),
            Severity.HIGH,
        ),
    ]


def _report(result: Result) -> Report[Result]:
    loop, exact = result.flights["loop"], result.flights["exact"]
    reached, ideal = (format_quantity(flight.bodies[-1].mean[0], flight.bodies[-1].sd[0]) for flight in (loop, exact))
    within = "and satisfied every limit" if max(loop.used.values()) <= 1.0 else "but exceeded a limit"
    motion = loops.excitation().motion(result.iterations[-1].parameters)
    return Report(
        title="A load of 370 kg on ETS-VII",
        subtitle="Section 4.2 of Lampariello and Hirzinger (IDETC 2005)",
        question="Does a loop that plans, flies and identifies safely find a load of 370 kg from a guess of 10 kg?",
        answer=f"The loop identified a load of 370 kg as {reached} kg in {len(loop.bodies)} manoeuvres {within}. It "
        f"started from a guess of 10 kg. With the arm known exactly, the same manoeuvres give {ideal} kg: the 5 % "
        "uncertainty (1 sigma) of each link mass dominates that of the load.",
        goals=_goals(result),
        valid="the base is known exactly and rests before each manoeuvre, the load is rigid and rigidly attached, "
        "and only the gravity gradient acts, which the diagnosis of each step had to confirm.",
        full=result.full,
        figure=Picture(
            _loop_figure(result.flights),
            "Left: error and standard deviation (sd) of the load's mass, relative to 370 kg, after every manoeuvre; "
            "uncertainties of the arm are 1 sigma of each link mass. Right: largest tip speed, tip rate and base "
            "rotation in MuJoCo, relative to their limits; the loop plans them to satisfy the limits with 99 % "
            "probability.",
        ),
        setup=Setup(
            robot=f"ETS-VII with the published base and a load of 370 kg on link 6; joints within ±{mission.REACH:g} "
            "rad.",
            manoeuvre=f"Quintic splines of all six joints, {mission.DURATION:g} s each, d-optimal for the load given "
            "the results of the previous steps. At most 50 mm/s and 5 degrees per second at the tip, the flight rule, "
            f"and {loops.SAFE.base_rotation:g} rad of base rotation, each with 99 % probability.",
            sensors=f"{mission.SENSORS}; a constant bias of the accelerometer.",
            known="The base, the orbit, the initial attitude, and each link mass to 5 % (1 sigma).",
            unknown="The load, with a prior about 10 kg whose 1-sigma range is a factor of "
            f"{np.exp(2.0 * loops.SPREAD):.0f} either way; the initial rate; the bias ({format_number(BIAS)} m/s², 1 "
            "sigma); the links.",
            replicates=f"One loop with one drawn arm; at most {loops.AT_MOST} manoeuvres. Posteriors are normal "
            "approximations.",
        ),
        picture=Picture(
            figures.robot_pose(loops.robot_with_load(paper.TRUTH), motion, np.array([0.0, 0.5 * mission.DURATION])),
            "ETS-VII with the load, at rest and halfway through the paper's manoeuvre, which is flown without noise. "
            "The manoeuvres of the loop are not drawn.",
        ),
        sections=[_failures, _evidence],
        statements=_statements(result),
        tables=_tables(result),
    )


def _failures(document: Document, result: Result) -> None:
    document.section("Calibration and failures")
    loop = result.flights["loop"]
    floor = loops.robot_with_load().link("link6").inertial.mass * 0.05
    share = format_percent(floor / paper.TRUTH[MASS], 2)
    remaining = format_number(float(loop.bodies[-1].sd[MASS]), 2)
    document.paragraph(
        f"With an arm uncertain by 5 % (1 sigma), no manoeuvre can reach {format_percent(loops.GOAL, 2)}: link 6 and "
        "the load move as one body, so the error of link 6's mass goes fully into that of the load. 5 % of link 6 is "
        f"{format_number(floor, 2)} kg, {share} of the load. After the last manoeuvre the sd of the load's mass is "
        f"{remaining} kg, and the error {format_percent(float(abs(loop.error(-1)[MASS])), 2)}."
    )
    attempts = []
    for number, plan in enumerate(loop.plans, start=1):
        tries = len(plan["attempts"])
        last = plan["attempts"][-1]["limits"]
        quantiles = ", ".join(
            f"{LIMIT_TITLES[name]} {format_percent(entry['quantile_99'] / entry['limit'], 3)}"
            for name, entry in last.items()
        )
        attempts.append(
            f"Manoeuvre {number}: {counted(tries, 'design')} until all 99 % quantiles were within the limits "
            f"({quantiles})."
        )
    document.items(attempts)
    verdicts = ", ".join(
        f"{review['status']}{''.join(f' ({cause})' for cause in review['causes'])}" for review in loop.reviews
    )
    document.paragraph(f"Diagnoses of all recordings so far, after each manoeuvre: {verdicts}.")
    ratio = ", ".join(
        f"{format_fixed(value, 2)} ({format_signed(away)} sd)"
        for value, away in zip(loop.chi2, loop.chi2_errors(), strict=True)
    )
    counts = joined(str(count) for count in dict.fromkeys(loop.samples))
    spread = " or ".join(format_number(float(np.sqrt(2.0 / count)), 2) for count in dict.fromkeys(loop.samples))
    document.paragraph(
        f"Chi-square per sample of the loop's fits, {counts} samples each: {ratio}. The expected value is 1 ± "
        f"{spread}, slightly less for a fit with many unknowns."
    )


def _evidence(document: Document, result: Result) -> None:
    document.section("Evidence")
    rows = []
    for k, title in enumerate(ROWS):
        cells = [
            format_quantity(flight.bodies[-1].mean[k], flight.bodies[-1].sd[k]) for flight in result.flights.values()
        ]
        printed = [format_number(quantities[k], 5) for quantities in paper.RESULTS]
        rows.append([title, format_number(paper.TRUTH[k], 4), format_number(paper.GUESS[k], 3), *printed, *cells])
    add_number_table(
        document,
        ["load", "true", "guess", "paper, iteration 1", "paper, iteration 2", *TITLES.values()],
        rows,
        "The load: printed values after the paper's two iterations, without noise, and posterior mean ± sd after the "
        "last manoeuvre of the loop.",
    )
    document.figure(
        _error_figure(result.iterations),
        "The paper's case repeated without noise, within the flight rule: relative errors of the ten quantities; those "
        "of the products of inertia are relative to the moments. MuJoCo flew the paper's motion, Eq. (27), with the "
        "parameters that maximise Eq. (26) in the form that the paper presumably intended; the fit is least squares "
        "without a prior.",
    )


def _statements(result: Result) -> list[Statement]:
    first, second = (iteration.worst for iteration in result.iterations)
    printed = [float(np.abs(paper.errors(values)).max()) for values in paper.RESULTS]
    physical = [reading.physical for reading in paper.readings(paper.TRUTH)]
    return [
        Statement(
            "A load of 370 kg is identified from a guess of 10 kg in two iterations (4.2).",
            Finding.CONFIRMED if second < printed[1] else Finding.REFUTED,
            f"Without noise the largest relative error is {format_number(first, 2)} after one iteration and "
            f"{format_number(second, 2)} after two; the paper prints {format_percent(printed[0], 2)} and "
            f"{format_percent(printed[1], 2)}.",
        ),
        Statement(
            "The second iteration gives a clear improvement (4.2).",
            Finding.CONFIRMED if second < 0.1 * first else Finding.NOT_TESTABLE,
            "Without noise the first iteration already reaches the precision of the integration, so little can be "
            "improved, and the paper's first result was probably not a converged fit.",
        ),
        Statement(
            "The load's inertia is printed without its reference point (4.2).",
            Finding.CONFIRMED if physical == [True, False] else Finding.NOT_TESTABLE,
            "The reference point is the load's centre of mass: about the link's origin no rigid body has this inertia.",
        ),
    ]


def _tables(result: Result) -> list[CsvTable]:
    steps = [
        [name, step + 1, HEADINGS[k], paper.TRUTH[k], float(body.mean[k]), float(body.sd[k])]
        for name, flight in result.flights.items()
        for step, body in enumerate(flight.bodies)
        for k in range(10)
    ]
    limits = [
        [name, step + 1, key, row[key], getattr(loops.SAFE, key)]
        for name, flight in result.flights.items()
        for step, row in enumerate(flight.largest)
        for key in row
    ]
    without = [[number, *map(float, iteration.estimate)] for number, iteration in enumerate(result.iterations, start=1)]
    return [
        CsvTable("steps", ["arm", "manoeuvre", f"{loops.LOAD}'s quantity", "true", "mean", "sd"], steps),
        CsvTable("limits", ["arm", "manoeuvre", "limit", "largest in MuJoCo", "allowed"], limits),
        CsvTable("without-noise", ["iteration", *HEADINGS], without),
    ]


@styled
def _loop_figure(flights: dict[str, Flight]) -> Figure:
    """Draw the error and the standard deviation of the mass after every manoeuvre, and what it used of the limits."""
    figure = wide_figure(2.7)
    left, right = figure.subplots(1, 2)
    for index, (name, flight) in enumerate(flights.items()):
        steps = np.arange(1, len(flight.bodies) + 1)
        error = [abs(flight.error(step)[0]) for step in range(len(steps))]
        sd = [flight.relative(step)[0] for step in range(len(steps))]
        colour = COLOURS[index]
        left.plot(steps, 100.0 * np.array(sd), "-", color=colour, label=f"sd, {TITLES[name]}")
        left.plot(steps, 100.0 * np.array(error), "o", color=colour, markersize=4, label=f"error, {TITLES[name]}")
    left.axhline(100.0 * loops.GOAL, color="#888888", linestyle=":")
    left.text(0.55, 110.0 * loops.GOAL, "goal", fontsize=8, va="bottom")
    flown = next(iter(flights.values()))
    steps = np.arange(1, len(flown.bodies) + 1)
    left.set(yscale="log", xlabel="manoeuvre", ylabel="error or sd of the mass [%]", xlim=(0.5, steps[-1] + 0.5))
    left.set_xticks(steps)
    for index, name in enumerate(loops.LIMITED):
        part = 100.0 * np.array([row[name] for row in flown.largest]) / getattr(loops.SAFE, name)
        right.bar(steps + 0.25 * (index - 1), part, 0.22, color=COLOURS[index + 2], label=LIMIT_TITLES[name])
    right.axhline(100.0, color="black", linewidth=0.8)
    right.set(xlabel="manoeuvre", ylabel="share of the limit [%]", ylim=(0.0, 145.0))
    right.set_xticks(steps)
    right.legend(loc="upper left", ncols=2)
    shared_legend(figure, left, 2, place="outside lower center")
    return figure


@styled
def _error_figure(iterations: list[Iteration]) -> Figure:
    figure = wide_figure(2.4)
    axes = figure.subplots()
    place = np.arange(len(LABELS))
    series = {"paper": list(paper.RESULTS), "here, no noise": [iteration.estimate for iteration in iterations]}
    for colour, (name, estimates) in zip((BEFORE, AFTER), series.items(), strict=True):
        for number, estimate in enumerate(estimates):
            error = np.abs(paper.errors(estimate))
            error[error == 0.0] = np.nan  # printed exactly
            fill = "full" if number else "none"
            label = f"{name}, iteration {number + 1}"
            axes.plot(place, error, "os"[number], color=colour, fillstyle=fill, markersize=4, label=label)
    axes.set(yscale="log", ylabel="relative error")
    axes.set_xticks(place, LABELS)
    shared_legend(figure, axes, 4, place="outside lower center")
    return figure


STUDY = Study(
    "load",
    "Identify a load on the arm of ETS-VII.",
    run=run,
    report=_report,
    full="the default effort of each search",
    seed=0,
    extra={"--folder": {"type": Path, "default": Path("out/load"), "help": "folder for the loop's files"}},
)
