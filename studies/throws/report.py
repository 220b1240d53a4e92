"""The study of thrown bodies, its goals and its report."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np
from matplotlib.figure import Figure

from bayesid._io.progress import Progress, silent
from bayesid._io.words import joined
from bayesid.diagnosis import Diagnosis
from bayesid.diagnosis.settings import DEFAULT_SETTINGS
from bayesid.report import Document, format_quantity
from bayesid.report.figures.figure_style import COLOURS, styled, wide_figure
from bayesid.report.numbers import format_fixed, format_number, format_percent, format_probability, format_signed
from bayesid.report.verdict_record import Share
from studies.common.report_parts import columns
from studies.common.study import CsvTable, Goal, Picture, Report, Setup, Severity, Study, Verdict
from studies.throws.analysis import BLOCK_SD, PLATE_SD, Analysis, BodyResult, analyse, prepare
from studies.throws.data import DEFAULT_FOLDER, EXCLUDED, INTERVAL, raw_throws, read_throws, read_truth
from studies.throws.diagnosis import SPREAD, Lacking, geometry_errors, lacking, without_wheel
from studies.throws.joint import LARGEST
from studies.throws.model import is_fitted, is_rigid
from studies.throws.raw import Timing
from studies.throws.residual import (
    CHANNELS,
    PHASES,
    Residual,
    following,
    shaken_axis,
    shaking_words,
)
from studies.throws.rotor import ORDERS, lines_of, loudest_orders

MISCOUNTED = 6  # pole pairs of the motor as the source of the data first stated them
QUICK = 4  # throws of each body that a quick run identifies
TRAINING = 1  # throws of each body that are diagnosed
QUICK_FIT = {"Empty": 1.9, "A": 1.0}  # mean errors of a quick least-squares fit by those who prepared the data [%]
LOW, HIGH = 0.90, 0.98  # share of 95 % intervals that should hold the truth
SECONDS = 600.0  # longest time of a full run [s]
SETS = 10  # number of sets of causes that are listed of each body
AXES = tuple(f"{sensor} {axis}" for sensor in ("gyro", "accelerometer") for axis in "xyz")

Row = tuple[object, ...]


@dataclass(frozen=True)
class Result:
    """Numbers of the study."""

    # rigid body with wheel and nothing else; the same with what the device and the air add
    plain: Analysis
    extended: Analysis
    studies: tuple[Lacking, ...]  # what each body's diagnosis said; empty where it was left out
    errors: Mapping[str, Mapping[str, np.ndarray]]  # of the diagnosed models against the geometry [%]
    wheels: Mapping[str, Diagnosis]  # with the recorded wheel dropped, by body; empty where that was left out
    masses: Mapping[str, float]  # of the bodies with the device on them [kg]
    miscounted: np.ndarray  # (throws,): order of the loudest line of all throws, read with `MISCOUNTED` pole pairs
    # time of the run without the reverse, and of the reverse
    seconds: float
    reverse_seconds: float


def run(
    data: Path | None = None,
    *,
    full: bool = False,
    reverse: bool = False,
    seed: int = 1,
    throws: int | None = None,
    progress: Progress = silent,
) -> Result:
    """Run the study.

    Parameters
    ----------
    data : path, optional; folder of the measurements, by default next to the checkout
    full : bool; all throws, and the diagnosis of every body
    reverse : bool
        Whether to remove the recorded wheel from one throw of every body and search for it, which takes minutes more.
    throws : int, optional; throws of each body, by default all in a full run and `QUICK` in a quick one

    Raises
    ------
    InputError
        If the measurements are not there.
    """
    began = perf_counter()
    folder = DEFAULT_FOLDER if data is None else Path(data)
    truth, count = read_truth(folder), throws if full or throws else QUICK
    rng = np.random.default_rng(seed)
    masses = {body: truth.thrown_mass(body) for body in truth.bodies}
    prepared = prepare(folder, truth, count)
    plain = analyse("rigid", prepared, is_rigid, truth, rng, folder, smooth=False)
    extended = analyse("extended", prepared, is_fitted, truth, rng, folder)
    miscounted = miscounted_orders(folder, truth.bodies, count)
    studies: tuple[Lacking, ...] = ()
    errors: Mapping[str, Mapping[str, np.ndarray]] = {}
    wheels: dict[str, Diagnosis] = {}
    if full:
        recordings = {body: read_throws(folder, body, Timing()) for body in truth.bodies}
        studies = tuple(
            lacking(body, recordings[body], masses[body], TRAINING, seed, progress) for body in truth.bodies
        )
        errors = geometry_errors(studies, truth)
    seconds = perf_counter() - began
    if reverse:
        for body in truth.bodies:
            thrown = read_throws(folder, body, Timing())
            wheels[body] = without_wheel(thrown, masses[body], TRAINING, seed, progress)
    return Result(
        plain, extended, studies, errors, wheels, masses, miscounted, seconds, perf_counter() - began - seconds
    )


def miscounted_orders(folder: Path, bodies: Sequence[str], count: int | None = None) -> np.ndarray:
    """Return the order of the loudest line of each throw, (throws,), read with `MISCOUNTED` pole pairs."""
    timing = Timing(pole_pairs=MISCOUNTED)
    raws = ([lines_of(raw, timing, ORDERS) for raw in raw_throws(folder, body, count)] for body in bodies)
    return np.concatenate([loudest_orders(np.abs(lines)) for lines in raws])


def covered_in_all(result: Result, *, with_truth: bool = False) -> tuple[int, int]:
    """Return how many 95 % intervals of single throws hold the truth over all bodies, and of how many."""
    counts = [body.covered(0.95, with_truth=with_truth) for body in result.extended.bodies.values()]
    return sum(covered for covered, _ in counts), sum(total for _, total in counts)


def goals_of(result: Result) -> list[Goal]:
    """Return each goal, what was reached, and whether that passes; what only a full run tests is not tested before."""
    bodies, studies = result.extended.bodies.values(), result.studies
    ratios = [ratio for body in bodies for ratio in body.joint_formal / body.joint_jackknife]
    torques = [widths["smooth-torque"].ratio for widths in result.extended.widths.values()]
    named = [study.body for study in studies if study.diagnosis.verdict.causes]
    better = [study.body for study in studies if study.held_out.gain.sum() > 0.0]
    return [
        *(_quick_fit(body) for body in bodies if body.name in QUICK_FIT),
        _coverage(result),
        Goal(
            "joint fit: formal over jackknife sd between 0.67 and 1.5 for every moment",
            f"{min(ratios):.2f} to {max(ratios):.2f}",
            Verdict.of(min(ratios) >= 0.67 and max(ratios) <= 1.5),
            Severity.HIGH,
        ),
        Goal(
            f"unexplained torque at most {LARGEST:g} prior sd on every body",
            f"{max(torques):.2f}",
            Verdict.of(max(torques) <= LARGEST),
            Severity.MEDIUM,
        ),
        Goal(
            "a cause named on every body",
            *_full(result, f"{len(named)} of {len(studies)}", len(named)),
            Severity.MEDIUM,
        ),
        Goal(
            "extension predicts omitted throws better",
            *_full(result, f"{len(better)} of {len(studies)} bodies", len(better)),
            Severity.HIGH,
        ),
        *_reverse(result),
        Goal(
            "whole run within 10 minutes, without the search for the removed wheel",
            f"{result.seconds / 60.0:.1f} minutes",
            Verdict.of(result.seconds <= SECONDS if studies else None),
            Severity.LOW,
        ),
    ]


def _quick_fit(body: BodyResult) -> Goal:
    """Return the goal on the mean size of the differences, which is uncertain by what throws differ."""
    goal, mean, error = QUICK_FIT[body.name], body.mean_error, body.mean_error_sd
    text = f"{body.name}: mean difference of single throws from the stated moments at most {goal:g} %, that of a quick "
    verdict = Verdict.between(mean - 2.0 * error, mean + 2.0 * error, most=goal)
    return Goal(f"{text}least-squares fit", f"{mean:.2f} ± {error:.2f} %", verdict, Severity.MEDIUM)


def _full(result: Result, reached: str, count: int) -> tuple[str, Verdict]:
    """Return what was reached on all diagnosed bodies, which only a full run has."""
    if not result.studies:
        return "not run", Verdict.NOT_TESTED
    return reached, Verdict.of(count == len(result.studies))


def _coverage(result: Result) -> Goal:
    count, total = covered_in_all(result)
    low, high = Share(count, total).interval
    text = f"95 % intervals of single throws contain the truth in {100 * LOW:.0f} to {100 * HIGH:.0f} % of cases"
    reached = f"{100.0 * count / total:.0f} % ({100.0 * low:.0f} to {100.0 * high:.0f} %): {_covered(result)}"
    return Goal(text, reached, Verdict.between(low, high, LOW, HIGH), Severity.HIGH)


def _covered(result: Result) -> str:
    """Return how many 95 % intervals of single throws hold the truth, of all bodies and of each."""
    each = {body.name: body.covered(0.95) for body in result.extended.bodies.values()}
    parts = joined(f"{count} of {total} for {name}" for name, (count, total) in each.items())
    return f"{' of '.join(map(str, covered_in_all(result)))} ({parts})"


def _reverse(result: Result) -> list[Goal]:
    """Goals on the recorded wheel dropped: whether its probability says that it is there, and whether it is named."""
    titles = (
        "recorded wheel removed: a wheel about z has a probability of "
        f"{DEFAULT_SETTINGS.named_from:g} or more on every body",
        "recorded wheel removed: the verdict names a wheel on every body",
    )
    if not result.wheels:
        return [Goal(title, "not run", Verdict.NOT_TESTED, Severity.MEDIUM) for title in titles]
    diagnoses = list(result.wheels.values())
    probabilities = [wheel_probability(diagnosis) for diagnosis in diagnoses]
    named = [any(cause.startswith("wheel-history") for cause in diagnosis.verdict.causes) for diagnosis in diagnoses]
    return [
        Goal(
            titles[0],
            f"at least {min(probabilities):.3f}",
            Verdict.of(min(probabilities) >= DEFAULT_SETTINGS.named_from),
            Severity.MEDIUM,
        ),
        Goal(titles[1], f"{sum(named)} of {len(named)}", Verdict.of(all(named)), Severity.MEDIUM),
    ]


def wheel_probability(diagnosis: Diagnosis) -> float:
    """Return the probability that a wheel of unknown course about the recorded wheel's axis is at work."""
    return diagnosis.probabilities.of_any(["wheel-history:z"])


def _tables(result: Result) -> list[CsvTable]:
    moments = ["model", "throw", "moment", "stated [kg m2]", "identified [kg m2]", "formal sd [kg m2]"]
    bodies = [
        *("body", "throws", "torque sd [N m]", "rms / sd of the torque", "force sd [m/s2]"),
        *(f"noise in flight / at rest, {axis}" for axis in AXES),
        *("wheel [Hz]", "strongest order", "throws with it", "axis"),
        *("amplitude [m/s2]", "half an order away [m/s2]", "force [N]"),
    ]
    left = ["body", "channel", "rms", "rms at rest", "strongest [Hz]", *PHASES, *(f"imbalance, {p}" for p in PHASES)]
    device = [(name, _digits(mean), _digits(sd)) for name, (mean, sd) in result.extended.calibration.items()]
    tables = [
        CsvTable("moments", moments, _moment_rows(result)),
        CsvTable("bodies", bodies, _body_rows(result)),
        CsvTable("residuals", left, _residual_rows(result)),
        CsvTable("device", ["error", "mean", "formal sd"], device),
    ]
    causes = ["diagnosis", "body", "probability", "log evidence", "causes"]
    return [*tables, *([CsvTable("causes", causes, _cause_rows(result))] if result.studies else [])]


def _moment_rows(result: Result) -> Iterator[Row]:
    for analysis in (result.plain, result.extended):
        for body in analysis.bodies.values():
            for throw, moments, sd in zip(body.throws, body.moments, body.formal, strict=True):
                for k, name in enumerate(("smallest", "middle", "largest")):
                    yield analysis.label, throw, name, *map(_digits, (body.truth[k], moments[k], sd[k]))


def _body_rows(result: Result) -> Iterator[Row]:
    for name, residual in result.extended.left.items():
        widths = result.extended.widths[name]
        torque, force = widths["smooth-torque"], widths["smooth-force"]
        order, there, beside = residual.turn
        axis = shaken_axis(residual)
        numbers = (torque.sd, torque.ratio, force.sd, *result.extended.noise[name], residual.wheel[1], order)
        felt = (there[axis], beside[axis], result.masses[name] * there[axis])
        yield (
            *(name, len(residual.names), *map(_digits, numbers), following(residual)),
            *(CHANNELS[axis][-1], *map(_digits, felt)),
        )


def _residual_rows(result: Result) -> Iterator[Row]:
    for name, residual in result.extended.left.items():
        for c, channel in enumerate(AXES):
            numbers = (
                residual.rms[c],
                residual.quiet[c],
                residual.loudest(c),
                *residual.phase[:, c],
                *residual.shaken[:, c],
            )
            yield name, channel, *map(_digits, numbers)


def _cause_rows(result: Result) -> Iterator[Row]:
    diagnoses = [("as recorded", study.body, study.diagnosis) for study in result.studies]
    diagnoses += [("wheel dropped", body, diagnosis) for body, diagnosis in result.wheels.items()]
    for title, body, diagnosis in diagnoses:
        for cause_set in diagnosis.probabilities.sets[:SETS]:
            numbers = (_digits(cause_set.probability), _digits(cause_set.log_evidence))
            yield title, body, *numbers, " + ".join(cause_set.names) or "nothing"


def _digits(value: float | np.floating) -> str:
    return f"{float(value):.6g}"


def _report(result: Result) -> Report[Result]:
    bodies = result.extended.bodies.values()
    errors = " and ".join(f"{body.mean_error:.2f} % ({body.name})" for body in bodies)
    stated = " and ".join(f"{_uncertain(body)} % ({body.name})" for body in bodies)
    rigid = " and ".join(f"{result.plain.bodies[body.name].mean_error:.2f} % ({body.name})" for body in bodies)
    named = sum(bool(study.diagnosis.verdict.causes) for study in result.studies)
    causes = f" A cause is named on {named} of {len(result.studies)} bodies." if result.studies else ""
    return Report(
        title="Thrown bodies",
        subtitle="Real measurements of a small free-flying device with one reaction wheel",
        question="How well does half a second of real flight determine the principal moments of inertia, are the "
        "intervals calibrated, and does the diagnosis identify what a model of a rigid body with its wheel lacks?",
        answer=f"Single throws differ from the stated principal moments by {errors} on average. The stated moments are "
        f"uncertain by {stated}; with a rigid body and its wheel alone the difference is {rigid}. Of the 95 % "
        f"intervals, {_covered(result)} contain the stated moments.{causes}",
        goals=goals_of(result),
        valid="the wheel's momentum is recorded and one throw series on a box of known inertia gives its scale. Four "
        "choices were made with these throws in view, so this is not a blind test.",
        full=bool(result.studies and result.wheels),
        figure=Picture(
            throws_figure(result.plain, result.extended),
            "Errors of the principal moments in single throws, with formal standard deviations: a rigid body with its "
            "wheel alone (left), and with the effects of the device and of the air (right). The grey band is the "
            "uncertainty of the stated moments.",
        ),
        setup=_setup(result),
        sections=[_failures, _bodies, _diagnosis, _residual_section],
        tables=_tables(result),
        beside="Tables with this report, in SI units: {all}.",
        credit="Data: Blaha, Kuijper, Pop and Smeur, arXiv:2503.13137; no measurement is reproduced here.",
    )


def _uncertain(body: BodyResult) -> str:
    """Return the uncertainty of a body's stated moments [%], as a range where it differs."""
    percent = 100.0 * body.truth_sd / body.truth
    low, high = (format_number(float(end), 2) for end in (percent.min(), percent.max()))
    return low if low == high else f"{low} to {high}"


def _setup(result: Result) -> Setup:
    throws = {name: len(left.names) for name, left in result.extended.left.items()}
    excluded = "; ".join(f"{name}, because {reason}" for name, reason in EXCLUDED.items())
    return Setup(
        robot="A device with one reaction wheel, alone (cal_device), on a box of known inertia (cal_proof), on a plate "
        "(Empty), and on the plate with blocks (A).",
        manoeuvre="Thrown by hand and caught; the wheel spins up and down in flight. No speed limit applies.",
        sensors=f"Gyro, accelerometer and wheel speed, raw at 4 kHz. Samples every {1e3 * INTERVAL:g} ms are local "
        "parabolas with Gaussian weights, whose neighbours are uncorrelated; their noise is measured in quiet "
        "intervals, by body and axis. Samples next to the largest accelerations of the wheel (12000 rad/s² within 4 "
        "ms) and the last 20 ms are omitted.",
        known=f"Mass, and the stated moments, taken as uncertain by {100 * PLATE_SD:.0f} % for the plate (CAD) and by "
        f"{100 * BLOCK_SD:.1f} % for the contribution of the blocks (our estimates). Inertias are relative to that of "
        "the wheel, which the box calibrates; the device is subtracted with the parallel-axis theorem.",
        unknown="Ten parameters of each body (prior of 100 % about a regression that needs only its mass), cross-axis "
        "terms of the gyro, tilt and delay of the wheel, drag, and a torque and a specific force per throw that are "
        f"piecewise linear over 32 ms. In the diagnosis the prior width of the body is {100 * SPREAD:g} % about the "
        "regression; friction of the wheel axis and noise that depends on acceleration are not candidates.",
        replicates=f"{sum(throws.values())} throws: {', '.join(f'{name} {count}' for name, count in throws.items())}. "
        f"Omitted: {excluded}.",
    )


def _failures(document: Document, result: Result) -> None:
    document.section("Failures and limits")
    plain = result.plain.bodies.values()
    both, total = covered_in_all(result, with_truth=True)
    factors = [factor.max() for factor in result.extended.noise.values()]
    unnamed = [study.body for study in result.studies if not study.diagnosis.verdict.causes]
    texts = []
    if unnamed:
        texts.append(
            f"No cause is named on {', '.join(unnamed)}: the residual of the best catalogue causes is larger than "
            "noise, and the verdict is unknown."
        )
    for study in result.studies:
        if study.body in result.plain.bodies:
            errors = (result.errors[model][study.body] for model in ("rigid", "extended"))
            rigid, extended = (" / ".join(format_signed(value) for value in row) for row in errors)
            texts.append(
                f"{study.body}, from the one diagnosed throw: the errors of the three moments are {rigid} % with the "
                f"rigid model and {extended} % with the identified extension."
            )
    texts += [
        "With a rigid body and its wheel alone, the stated standard deviations of single throws are "
        f"{' and '.join(f'{body.inflation:.0f} times ({body.name})' for body in plain)} too small, by the scatter of "
        "the throws alone.",
        "Four choices were made with these throws in view: the delay of the wheel's reading, the wheel acceleration "
        "beyond which samples are omitted, the smooth force that is fitted together with the torque, and the scaling "
        "of the noise in flight. The sizes of the last two follow from each body's throws by marginal likelihood; the "
        "first two are constants in the code that reads the data.",
        "All throws of a body share the error of its stated geometry and of the wheel's inertia. Intervals that "
        f"include both contain {both} of {total} moments.",
        f"In flight the scatter of the samples about the smooth model is up to {format_fixed(min(factors), 1)} to "
        f"{format_fixed(max(factors), 1)} times that of quiet intervals, depending on the body.",
        "The gyro scale cannot be separated from the wheel's inertia; a displacement of the wheel is not a candidate.",
    ]
    for body, widths in result.extended.widths.items():
        if widths["smooth-torque"].doubtful:
            texts.append(f"{body}: the unexplained torque is {widths['smooth-torque'].ratio:.2f} times its prior sd.")
    document.items(texts)


def _bodies(document: Document, result: Result) -> None:
    document.section("The bodies against their geometry")
    rows = []
    for body in result.extended.bodies.values():
        for k, name in enumerate(("smallest", "middle", "largest")):
            truth, errors = body.truth[k], body.errors[:, k]
            single = 100.0 * np.sqrt((body.formal[:, k] ** 2).mean()) / truth
            widths = (100.0 * sd[k] / truth for sd in (body.joint_formal, body.joint_jackknife))
            rows.append(
                [
                    *(body.name, name, format_quantity(1e6 * truth, 1e6 * body.truth_sd[k])),
                    f"{format_signed(errors.mean(), 2)} ± {errors.std(ddof=1):.2f}",
                    f"{single:.2f}",
                    format_signed(body.joint_errors[k], 2),
                    *(f"{width:.2f}" for width in widths),
                ]
            )
    extended = result.extended
    settled = "converged" if extended.converged and result.plain.converged else "did not all converge"
    document.table(
        ["body", "moment", "stated [mg m²]", "single [%]", "sd [%]", "joint [%]", "sd [%]", "jackknife [%]"],
        rows,
        "Errors of principal moments with the extended model: mean and scatter of single throws, and the joint fit of "
        f"all throws; sd is the formal one. The joint fits {settled}. The wheel's inertia is "
        f"{1e6 * extended.wheel:.4f} mg m², with sd {1e6 * extended.wheel_formal:.4f} formal and "
        f"{1e6 * extended.wheel_jackknife:.4f} by jackknife.",
        columns("llrrrrrr"),
    )


def _diagnosis(document: Document, result: Result) -> None:
    if not result.studies:
        return
    document.section("Results of the diagnosis")
    document.table(
        ["body", "verdict", "unknown", "most probable set", "chi-square", "gain", "wheel about z"],
        [
            [
                study.body,
                study.diagnosis.verdict.status.value,
                format_probability(study.diagnosis.probabilities.unknown),
                _likely(study.diagnosis),
                format_number(study.diagnosis.gain.before.chi2_per_sample),
                f"{format_number(study.held_out.gain.sum())}, {(study.held_out.gain > 0.0).sum()} of "
                f"{len(study.held_out.gain)}",
                _dropped(result, study.body),
            ]
            for study in result.studies
        ],
        "The first throw of each body, diagnosed from its data alone: verdict, probability of an unknown cause, most "
        "probable set of causes, chi-square per sample of the rigid model, and gain of the extension in log score on "
        "omitted throws, with the number of throws that it predicts better. Last: the same throw without its recorded "
        "wheel, with the probability of a wheel of unknown time history about the correct axis and the verdict.",
        columns("lllllll"),
    )
    if result.wheels:
        minutes = format_number(result.reverse_seconds / 60.0, 2)
        unfitted = sum(diagnosis.bodies_fixed for diagnosis in result.wheels.values())
        chi2 = [diagnosis.gain.before.chi2_per_sample for diagnosis in result.wheels.values()]
        document.paragraph(
            f"Without the recorded wheel, the chi-square per sample of a rigid body is {format_number(min(chi2), 2)} "
            f"to {format_number(max(chi2), 2)}, and its fit diverges. For {unfitted} of {len(result.wheels)} bodies "
            f"the parameters are fixed at the prior and causes are weighed along the measured motion. This took "
            f"{minutes} minutes. The verdict is unknown wherever the residual of the named causes is larger than noise."
        )


def _likely(diagnosis: Diagnosis) -> str:
    best = diagnosis.probabilities.sets[0]
    return f"{' + '.join(best.names) or 'nothing'} ({format_percent(best.probability)})"


def _dropped(result: Result, body: str) -> str:
    if body not in result.wheels:
        return "not run"
    diagnosis = result.wheels[body]
    return f"{format_probability(wheel_probability(diagnosis))}, {diagnosis.verdict.status.value}"


def _residual_section(document: Document, result: Result) -> None:
    document.section("Unexplained residual")
    document.items(shaking_words(result.extended.left))
    document.figure(
        residual_figure(result.extended.left),
        "Residual, mean over throws. Left: amplitude of the residual of the samples; the bands mark the frequency of "
        "the recorded wheel at idle. Right: amplitude of the raw accelerometer at multiples of the recorded wheel's "
        "frequency while it coasts at speed; the line marks the strongest.",
    )


@styled
def throws_figure(plain: Analysis, extended: Analysis) -> Figure:
    """Draw the errors of single throws, a row per body, a column per model."""
    figure = wide_figure(1.6 * len(extended.bodies))
    panels = figure.subplots(len(extended.bodies), 2, sharey="row", squeeze=False)
    for row, body in zip(panels, extended.bodies, strict=True):
        for axes, analysis in zip(row, (plain, extended), strict=True):
            result = analysis.bodies[body]
            band = float(100.0 * (result.truth_sd / result.truth).max())
            axes.axhspan(-band, band, color="#eeeeee")
            axes.axhline(0.0, color="#888888", linewidth=0.8)
            places = np.arange(len(result.throws))
            for index, name in enumerate(("smallest", "middle", "largest")):
                sd = 100.0 * result.formal[:, index] / result.truth[index]
                place = places + 0.2 * (index - 1)
                axes.errorbar(
                    *(place, result.errors[:, index], sd),
                    fmt="os^"[index],
                    color=COLOURS[index],
                    markersize=3,
                    linewidth=1,
                    label=name,
                )
            axes.set_xticks(places, [name[-3:] for name in result.throws])
            axes.set_title(f"{body}, {analysis.label} model")
        row[0].set_ylabel("error [%]")
    for axes in panels[-1]:
        axes.set_xlabel("number of the throw")
    handles, labels = panels[0][1].get_legend_handles_labels()
    figure.legend(handles, [f"{label} moment" for label in labels], loc="outside upper center", ncols=3)
    return figure


@styled
def residual_figure(left: Mapping[str, Residual]) -> Figure:
    """Draw the spectrum of what is left on the accelerometer, and the raw accelerometer against the wheel's orders."""
    figure = wide_figure(0.6 + 0.72 * len(left))
    panels = figure.subplots(len(left), 2, sharex="col", squeeze=False)
    for row, (body, residual) in zip(panels, left.items(), strict=True):
        spectrum = np.array([residual.spectrum[:, c] for c in range(3, 6)])
        for edge in (residual.wheel[0], residual.wheel[2]):
            row[0].axvspan(edge - 2.0, edge + 2.0, color="#eeeeee")
        for c, colour in zip(range(3, 6), COLOURS, strict=False):
            look = {"linewidth": 1, "color": colour, "label": CHANNELS[c][-1]}
            row[0].plot(residual.frequencies[1:], 1e3 * spectrum[c - 3, 1:], **look)
            row[1].semilogy(ORDERS, np.sqrt((residual.orders[:, :, c] ** 2).mean(axis=0)), **look)
        row[1].axvline(residual.turn[0], color="#888888", linewidth=0.8)
        row[0].set_title(body, loc="left")
        row[0].set_ylabel("[mm/s²]")
        row[1].set_ylabel("[m/s²]")
    panels[0][0].set_title("residual of samples")
    panels[0][1].set_title("raw readings, wheel at speed")
    panels[-1][0].set_xlabel("frequency [Hz]")
    panels[-1][1].set_xlabel("frequency / recorded wheel frequency")
    handles, labels = panels[0][1].get_legend_handles_labels()
    figure.legend(handles, [f"accelerometer {label}" for label in labels], loc="outside upper center", ncols=3)
    return figure


STUDY = Study(
    "throws",
    "Identify and diagnose thrown rigid bodies from real measurements.",
    run=run,
    report=_report,
    full="all throws, and the diagnosis of every body",
    seed=1,
    extra={
        "--data": {"type": Path, "help": "folder of the measurements"},
        "--reverse": {
            "action": "store_true",
            "help": "remove the recorded wheel from one throw of every body and search for it",
        },
    },
    inputs=lambda options: [(options.data or DEFAULT_FOLDER) / name for name in ("truth.json", "index.csv")],
)
