"""The study of thrown bodies, its goals and its report."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np
from matplotlib.figure import Figure

from bayesid import InputError
from bayesid._io.progress import Progress, silent
from bayesid._io.words import joined
from bayesid.diagnosis import Diagnosis
from bayesid.diagnosis.evidence.verdict import Rest
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
from studies.throws.model import KNOTS, is_fitted, is_rigid
from studies.throws.raw import POLE_PAIRS, Timing
from studies.throws.residual import (
    CHANNELS,
    PHASES,
    Residual,
    following,
    shaken_axis,
    shaking_words,
)
from studies.throws.rotor import ORDERS, lines_of, loudest_orders, near, pole_pairs, speed_ratio

MISCOUNTED = 6  # pole pairs of the motor as the source of the data first stated them
QUICK = 4  # throws of each body that a quick run identifies
TRAINING = 5  # throws of each body that are diagnosed together
DROPPED = 1  # throws of each body that are diagnosed without their recorded wheel
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
    refused: Mapping[str, str]  # why a body was not diagnosed, by body
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
    refused: Mapping[str, str] = {}
    errors: Mapping[str, Mapping[str, np.ndarray]] = {}
    wheels: dict[str, Diagnosis] = {}
    if full:
        studies, refused = _diagnosed(folder, extended, masses, seed, progress)
        errors = geometry_errors(studies, truth)
    seconds = perf_counter() - began
    if reverse:
        for body in truth.bodies:
            thrown, unexplained = read_throws(folder, body, Timing()), extended.unexplained(body)
            wheels[body] = without_wheel(thrown, masses[body], unexplained, DROPPED, seed, progress)
    return Result(
        plain, extended, studies, refused, errors, wheels, masses, miscounted, seconds, perf_counter() - began - seconds
    )


def _diagnosed(
    folder: Path, extended: Analysis, masses: Mapping[str, float], seed: int, progress: Progress
) -> tuple[tuple[Lacking, ...], dict[str, str]]:
    """Return the diagnoses of all bodies, and why a body was refused, which does not end the others."""
    studies, refused = [], {}
    for body, mass in masses.items():
        recordings = read_throws(folder, body, Timing())
        try:
            studies.append(lacking(body, recordings, mass, extended.unexplained(body), TRAINING, seed, progress))
        except InputError as error:
            refused[body] = str(error)
    return tuple(studies), refused


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
    better = [study.body for study in studies if study.gain.sum() > 0.0]
    return [
        _quick_fit([body for body in bodies if body.name in QUICK_FIT]),
        _coverage(list(bodies)),
        _miscounted(result),
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
        _named(result),
        _moments_no_worse(result),
        _reverse(result),
        Goal(
            "whole run within 10 minutes, without the search for the removed wheel",
            f"{result.seconds / 60.0:.1f} minutes",
            Verdict.of(result.seconds <= SECONDS if studies else None),
            Severity.LOW,
        ),
    ]


def _quick_fit(bodies: Sequence[BodyResult]) -> Goal:
    """Return the goal on the mean sizes of the differences, which are uncertain by what throws differ."""
    limits = joined(f"{QUICK_FIT[body.name]:g} % ({body.name})" for body in bodies)
    text = (
        f"mean difference of single throws from the stated moments at most that of a quick least-squares fit, {limits}"
    )
    reached = "; ".join(f"{body.name} {body.mean_error:.2f} ± {body.mean_error_sd:.2f} %" for body in bodies)
    ends = [
        (body.mean_error - 2.0 * body.mean_error_sd, body.mean_error + 2.0 * body.mean_error_sd, QUICK_FIT[body.name])
        for body in bodies
    ]
    verdict = Verdict.all_of(Verdict.between(low, high, most=most) for low, high, most in ends)
    return Goal(text, reached, verdict, Severity.MEDIUM)


def _full(result: Result, reached: str, count: int) -> tuple[str, Verdict]:
    """Return what was reached on all diagnosed bodies, which only a full run has."""
    if not result.studies:
        return "not run", Verdict.NOT_TESTED
    return reached, Verdict.of(count == len(result.studies))


def _coverage(bodies: Sequence[BodyResult]) -> Goal:
    """Return the goal on the intervals of each body, whose truth is uncertain by what its throws share."""
    percent = f"{100 * LOW:.0f} to {100 * HIGH:.0f} %"
    text = f"95 % intervals of single throws contain the stated moments in {percent} of cases, on every body"
    shares = {body.name: Share(*body.covered(0.95)) for body in bodies}
    reached = "; ".join(f"{name} {share}" for name, share in shares.items())
    verdict = Verdict.all_of(Verdict.between(*share.interval, LOW, HIGH) for share in shares.values())
    return Goal(text, reached, verdict, Severity.HIGH)


def _miscounted(result: Result) -> Goal:
    """Return the goal on a wrong number of pole pairs, whose ratio to the true one every throw has to say."""
    timing, orders = Timing(pole_pairs=MISCOUNTED), result.miscounted
    ratio, count = speed_ratio(orders, timing), near(orders, MISCOUNTED / POLE_PAIRS)
    return Goal(
        f"read with {MISCOUNTED} pole pairs instead of {POLE_PAIRS}, the wheel turns in every throw at "
        f"{MISCOUNTED}/{POLE_PAIRS} of the recorded speed",
        f"{ratio} in {count} of {len(orders)}: {pole_pairs(orders, timing)} pole pairs",
        Verdict.of(count == len(orders)),
        Severity.HIGH,
    )


# candidates of the diagnosis that are the effects of the joint fit
CANDIDATES = {
    "gyro-cross": "gyro-cross",
    "wheel-tilt": "wheel-tilt",
    "air-drag": "rotational-drag",
    "wheel-imbalance": "wheel-imbalance",
}


def _named(result: Result) -> Goal:
    """Return the goal on the causes that omitted throws confirm, body by body."""
    confirmed = [
        (study, candidate)
        for study in result.studies
        for effect, candidate in CANDIDATES.items()
        if result.extended.confirmed(effect, study.body)
    ]
    named = [candidate in study.diagnosis.verdict.causes for study, candidate in confirmed]
    return Goal(
        "imbalance, cross-axis terms, tilt and drag are named on each body whose omitted throws confirm them",
        f"{sum(named)} of {len(named)}" if result.studies else "not run",
        Verdict.of(all(named)) if result.studies else Verdict.NOT_TESTED,
        Severity.MEDIUM,
    )


def _moments_no_worse(result: Result) -> Goal:
    """Return the goal on the moments of the diagnosed throws with the named causes against those of a rigid body."""
    largest = {
        body: tuple(float(np.abs(result.errors[model][body]).max()) for model in ("rigid", "extended"))
        for body in (result.errors["rigid"] if result.errors else {})
    }
    return Goal(
        "largest error of the diagnosed throws' moments is no larger with the named causes than with a rigid body",
        "; ".join(
            f"{body} {rigid:.2f} % (rigid) and {extended:.2f} % (named causes)"
            for body, (rigid, extended) in largest.items()
        )
        or "not run",
        Verdict.of(all(extended <= rigid for rigid, extended in largest.values()) if largest else None),
        Severity.HIGH,
    )


def _covered(result: Result) -> str:
    """Return how many 95 % intervals of single throws hold the truth, of all bodies and of each."""
    each = {body.name: body.covered(0.95) for body in result.extended.bodies.values()}
    parts = joined(f"{count} of {total} for {name}" for name, (count, total) in each.items())
    return f"{' of '.join(map(str, covered_in_all(result)))} ({parts})"


def _reverse(result: Result) -> Goal:
    """Return the goal on the recorded wheel dropped: that the verdict names it with the probability of a name."""
    sure = DEFAULT_SETTINGS.named_from
    text = f"recorded wheel removed: a wheel about z is named, with a probability of {sure:g} or more, on every body"
    if not result.wheels:
        return Goal(text, "not run", Verdict.NOT_TESTED, Severity.MEDIUM)
    diagnoses = list(result.wheels.values())
    least = min(map(wheel_probability, diagnoses))
    named = [any(cause.startswith("wheel-history") for cause in diagnosis.verdict.causes) for diagnosis in diagnoses]
    reached = f"named on {sum(named)} of {len(named)}; smallest probability {format_probability(least)}"
    return Goal(text, reached, Verdict.of(all(named) and least >= sure), Severity.MEDIUM)


def wheel_probability(diagnosis: Diagnosis) -> float:
    """Return the probability that a wheel of unknown course about the recorded wheel's axis is at work."""
    return diagnosis.probabilities.of_any(["wheel-history:z"])


def _tables(result: Result) -> list[CsvTable]:
    moments = ["model", "throw", "moment", "stated [kg m2]", "identified [kg m2]", "formal sd [kg m2]"]
    bodies = [
        *(
            "body",
            "throws",
            "static imbalance [kg m]",
            "sd [kg m]",
            "torque sd [N m]",
            "rms / sd of the torque",
            "force sd [m/s2]",
        ),
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
            *(name, len(residual.names), *map(_digits, result.extended.imbalance[name])),
            *(*map(_digits, numbers), following(residual)),
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
    beside = sum(study.diagnosis.remainder.verdict is Rest.PRESENT for study in result.studies)
    causes = (
        f" The diagnosis names at least one cause on {named} of {len(result.studies)} bodies, and states on {beside} "
        "that something unnamed remains."
        if result.studies
        else ""
    )
    return Report(
        title="Thrown bodies",
        subtitle="Real measurements of a small free-flying device with one reaction wheel",
        question="How well does half a second of real flight determine the principal moments of inertia, are the "
        "intervals calibrated, and does the diagnosis identify what a model of a rigid body with its wheel lacks?",
        answer=f"Single throws differ from the stated principal moments by {errors} on average. The stated moments are "
        f"uncertain by {stated}; with a rigid body and its wheel alone the difference is {rigid}. Of the 95 % "
        f"intervals, {_covered(result)} contain the stated moments.{causes}",
        goals=goals_of(result),
        valid="the wheel's momentum is recorded and one throw series on a box of known inertia gives its scale. Five "
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
        sensors=f"Gyro, accelerometer and wheel speed, raw at 4 kHz. Samples every {1e3 * INTERVAL:g} ms are "
        "values of parabolas fitted locally with Gaussian weights; the noise of neighbouring samples is uncorrelated. "
        "Their noise is measured in quiet "
        "intervals, by body and axis. Rates next to the largest accelerations of the wheel "
        f"({Timing().fast:.0f} rad/s² within {1e3 * Timing().margin:g} ms) and the last 20 ms are omitted. All "
        "recordings of a body are cut to begin at the same wheel angle, determined from the imbalance signal in the "
        "raw readings.",
        known=f"Mass, and the stated moments, taken as uncertain by {100 * PLATE_SD:.0f} % for the plate (CAD) and by "
        f"{100 * BLOCK_SD:.1f} % for the contribution of the blocks (our estimates). Inertias are relative to that of "
        "the wheel, which the box calibrates; the device is subtracted with the parallel-axis theorem.",
        unknown="Ten parameters of each body (prior of 100 % about a regression that needs only its mass), cross-axis "
        "terms of the gyro, tilt, delay and imbalance of the wheel, drag, and a torque and a specific force per throw "
        f"that are piecewise linear over {1e3 * Timing().duration / (KNOTS - 1):.0f} ms. In the diagnosis the prior "
        f"width of the body is {100 * SPREAD:g} % about the regression, and torque and force are part of the present "
        "model, with the sizes of the joint fit: a cause has to show what they cannot. Friction of the wheel axis and "
        "noise that depends on acceleration are not candidates.",
        replicates=f"{sum(throws.values())} throws: {', '.join(f'{name} {count}' for name, count in throws.items())}. "
        f"Omitted: {excluded}.",
    )


def _failures(document: Document, result: Result) -> None:
    document.section("Failures and limits")
    plain, bodies = result.plain.bodies.values(), result.extended.bodies.values()
    both, total = covered_in_all(result, with_truth=True)
    factors = [factor.max() for factor in result.extended.noise.values()]
    unnamed = [study.body for study in result.studies if not study.diagnosis.verdict.causes]
    texts = [f"No cause is named on {', '.join(unnamed)}."] if unnamed else []
    texts += [f"{body} was not diagnosed: {reason}" for body, reason in result.refused.items()]
    for study in result.studies:
        if all(study.body in errors for errors in result.errors.values()):
            errors = (result.errors[model][study.body] for model in ("rigid", "extended"))
            rigid, extended = (" / ".join(format_signed(value) for value in row) for row in errors)
            texts.append(
                f"{study.body}, from the diagnosed throws: the errors of the three moments are {rigid} % with a rigid "
                f"body and {extended} % with the unexplained torque and the named causes."
            )
    texts += [
        "With a rigid body and its wheel alone, the stated standard deviations of single throws are "
        f"{' and '.join(f'{body.inflation:.0f} times ({body.name})' for body in plain)} too small, by the scatter of "
        "the throws alone.",
        "Five choices were made with these throws in view: the interval of the samples, the delay of the wheel's "
        "reading, the wheel acceleration beyond which samples are omitted, the smooth force that is fitted together "
        "with the torque, and the scaling of the noise in flight. The sizes of the last two follow from each body's "
        "throws by marginal likelihood; the first three are constants in the code that reads the data.",
        "All throws of a body share the error of its stated geometry and of the wheel's inertia. Intervals that "
        f"include both contain {both} of {total} moments.",
        *map(_shared_error, bodies),
        f"In flight the scatter of the samples about the smooth model is up to {format_fixed(min(factors), 1)} to "
        f"{format_fixed(max(factors), 1)} times that of quiet intervals, depending on the body.",
        "The gyro scale cannot be separated from the wheel's inertia; a displacement of the wheel is not a candidate.",
    ]
    for body, widths in result.extended.widths.items():
        if widths["smooth-torque"].doubtful:
            texts.append(f"{body}: the unexplained torque is {widths['smooth-torque'].ratio:.2f} times its prior sd.")
    document.items(texts)


def _shared_error(body: BodyResult) -> str:
    """Return the sentence on what all throws of a body have in common, which their intervals do not include."""
    errors = " / ".join(format_signed(error, 2) for error in body.joint_errors)
    inside, total = body.covered(0.95, about=body.joint)
    return (
        f"{body.name}: the joint fit of all throws differs from the stated moments by {errors} %; {inside} of {total} "
        "intervals of single throws contain the value of the joint fit."
    )


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
        ["body", "verdict", "named", "unknown", "most probable set", "gain", "torque", "without wheel"],
        [
            [
                study.body,
                study.diagnosis.verdict.status.value,
                ", ".join(study.diagnosis.verdict.causes) or "nothing",
                format_probability(study.diagnosis.probabilities.unknown),
                _likely(study.diagnosis),
                f"{format_number(study.gain.sum())}, {(study.gain > 0.0).sum()} of {len(study.gain)}",
                f"{1e3 * study.unexplained.torque:.2f}",
                _dropped(result, study.body),
            ]
            for study in result.studies
        ],
        f"The first {TRAINING} throws of each body, diagnosed together: verdict, named causes, probability of an "
        "unknown cause, most probable set of causes, gain of the named causes in log score on throws that are omitted "
        "one by one, with the number of throws that are predicted better, and root mean square of the unexplained "
        "torque that remains [mN m], a different one in every throw. Last: one throw without its recorded wheel, with "
        "the probability of a wheel of unknown time history about the correct axis and the verdict.",
        columns("llllllrl"),
    )
    document.table(
        ["omitted from the model", *result.masses],
        [[effect, *(_loss(loss) for loss in by_body.values())] for effect, by_body in result.extended.losses.items()],
        "By how much worse throws are predicted, each from all others, when an effect is omitted from the joint fit "
        "[nats], and how many throws are predicted worse. A negative number is an effect that omitted throws "
        "contradict.",
        columns("l" + "r" * len(result.masses)),
    )
    if result.wheels:
        minutes = format_number(result.reverse_seconds / 60.0, 2)
        unfitted = sum(diagnosis.bodies_fixed for diagnosis in result.wheels.values())
        chi2 = [diagnosis.gain.before.chi2_per_sample for diagnosis in result.wheels.values()]
        document.paragraph(
            "Without the recorded wheel, the chi-square per sample of the present model is "
            f"{format_number(min(chi2), 2)} to {format_number(max(chi2), 2)}. On {unfitted} of {len(result.wheels)} "
            "bodies it cannot follow the data: their parameters were fixed at the prior, and the effect of each cause "
            f"was computed along the measured motion. These diagnoses took {minutes} minutes."
        )


def _loss(loss: np.ndarray) -> str:
    return f"{format_signed(loss.sum(), 1)}, {(loss > 0.0).sum()} of {len(loss)}"


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
    each = joined(
        f"{format_quantity(1e6 * size, 1e6 * sd)} ({body})" for body, (size, sd) in result.extended.imbalance.items()
    )
    document.items(
        [
            *shaking_words(result.extended.left),
            "One imbalance of the wheel for all throws of a body explains the line; only the phase differs between "
            f"throws. Its static part, from each body alone, is {each} g mm.",
            "The unexplained torque differs from throw to throw and is not named: its root mean square is "
            + joined(
                f"{1e3 * widths['smooth-torque'].sd:.2f} ({body})" for body, widths in result.extended.widths.items()
            )
            + " mN m.",
        ]
    )
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
