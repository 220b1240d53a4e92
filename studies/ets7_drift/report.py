"""Report of the study."""

from __future__ import annotations

from dataclasses import astuple, fields
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bayesid.report import Document, figures, format_quantity
from bayesid.report.figures.figure_style import AFTER, BAND, BEFORE, TRUTH, shared_legend, styled, wide_figure
from bayesid.report.numbers import (
    format_fixed,
    format_number,
    format_percent,
    format_probability,
    format_signed,
    format_unit,
    format_vector,
)
from bayesid.report.sentences.set_words import set_text
from studies.common.ets7 import RADIUS, RAMPS, TIP_SPEED, ets7, tip_speed
from studies.common.goals import Goal, Verdict
from studies.common.report_parts import QUANTITY_TITLES, columns
from studies.common.template import (
    Finding,
    Setup,
    Statement,
    Summary,
    add_first_page,
    add_setup,
    add_statements,
    write_study,
    write_table,
)
from studies.ets7_drift.analysis import CAUSES, Amplitude, Attitude, Case, Step
from studies.ets7_drift.world import (
    ATTITUDE_SIGMA,
    DURATION,
    ENCODER_SIGMA,
    INTERVAL,
    MOMENTUM,
    MOTION,
    RATE,
    RATE_SIGMA,
    SPREAD,
)

__all__ = ["attitude_figure", "goals_of", "write_report"]

BETTER = 100.0
"""Factor by which the predicted attitude should be nearer to the measured one than the present simulation."""

FAR = 3.0
"""Errors of one number that should not be exceeded [standard deviations]."""

REACH = 1.96
"""Half-width of a 95 % band [standard deviations]."""

NOISE = float(np.degrees(np.sqrt(3.0) * ATTITUDE_SIGMA))
"""Expected size of the attitude's noise [degrees]."""


def write_report(case: Case, output: Path, *, full: bool, origin: str | None = None) -> None:
    """Write the report as PDF, and beside it its summary and its further tables."""
    document = Document("Drift of ETS-VII", "Section 2.1 and figure 2 of Lampariello and Hirzinger (IDETC 2005)")
    summary = Summary(
        "With attitude control off, the attitude of ETS-VII drifted away from its simulation (the paper's figure 2). "
        "Can the causes be named from rates and joints alone, with the base known to 5 % only, and does the simulation "
        "with them predict the measured attitude, which was not used?",
        _answer(case),
        tuple(goals_of(case)),
        "the wheels' momentum is constant, the links are known exactly and the noise is white. Recordings are "
        "simulated; no flight telemetry of ETS-VII is public.",
        full,
    )
    add_first_page(
        document,
        summary,
        attitude_figure(case.attitudes[0]),
        f"The first of {len(case.attitudes)} recordings. Above: the paper's figure 2 with its remedy, Euler angles of "
        "the base since the start; the bump between 60 and 145 s is the motion of the arm. Below: error of the "
        "predicted attitude, with the 95 % band predicted from what the rates leave unknown and the attitude's noise.",
    )
    add_setup(document, _setup(case), figures.robot_pose(ets7(), MOTION, np.array([0.0, 100.0])), "ETS-VII at rest.")
    _negatives(document, case)
    _evidence(document, case, output)
    add_statements(document, _statements(case))
    write_study(document, summary, output, origin)


def _answer(case: Case) -> str:
    verdict = case.diagnosis.verdict
    named = ", ".join(verdict.causes) or "nothing"
    said = "the three true causes and no other" if case.right else "which is not what was hidden"
    return (
        f"The diagnosis is {verdict.status.value} and names {named}: {said}. The simulation with them "
        f"predicts the attitude to {format_number(_rms(case, 'extended'), 2)} degrees (rms), where without them it is "
        f"{format_number(_rms(case, 'plain'), 2)} degrees off."
    )


def _rms(case: Case, name: str) -> float:
    """Return the root mean square error of one simulation over all recordings [degrees]."""
    return float(np.sqrt(np.mean([attitude.errors[name] ** 2 for attitude in case.attitudes])))


def goals_of(case: Case) -> list[Goal]:
    """Return the goals, which were set before the study was run."""
    true = _true(case)
    ratio = _rms(case, "plain") / _rms(case, "extended")
    ends = np.abs(case.distances)
    inside = int((ends <= REACH).sum())
    far = max((abs(item.distance) for item in case.amplitudes), default=None)
    bodies = case.diagnosis.gain.after.bodies
    base = np.abs((bodies.mean - case.world.base) / bodies.sd)
    return [
        Goal(
            "the three true causes are named, and no other",
            f"{', '.join(case.diagnosis.verdict.causes) or 'nothing'}; probability of the three and nothing else "
            f"{format_probability(true)}",
            Verdict.of(case.right),
        ),
        Goal(
            f"the predicted attitude is {BETTER:g} times nearer than the present simulation (rms)",
            f"{format_number(ratio, 2)} times",
            Verdict.of(ratio >= BETTER),
        ),
        Goal(
            "the predicted 95 % band holds the measured attitude at the end of a recording in all but one axis or in "
            "all",
            f"{inside} of {ends.size}; largest error {format_fixed(float(ends.max()), 1)} sd",
            Verdict.of(inside >= ends.size - 1),
        ),
        Goal(
            f"amplitudes within {FAR:g} sd of the truth",
            "none named"
            if far is None
            else f"{len(case.amplitudes)} amplitudes, largest error {format_fixed(far, 1)} sd",
            Verdict.of(None if far is None else far <= FAR),
        ),
        Goal(
            f"the base's ten parameters within {FAR:g} sd of the truth",
            f"largest error {format_fixed(float(base.max()), 1)} sd",
            Verdict.of(base.max() <= FAR),
        ),
    ]


def _true(case: Case) -> float:
    """Return the probability of the three true causes and nothing else."""
    sets = case.diagnosis.probabilities.sets
    return sum(item.probability for item in sets if item.generic is None and set(item.causes) == set(CAUSES))


def _setup(case: Case) -> Setup:
    ramps = " and ".join(f"{start:g} to {stop:g} s" for start, stop in RAMPS)
    fastest, _ = tip_speed(MOTION, DURATION)
    return Setup(
        robot=f"ETS-VII as shipped with this package, on a circular orbit of {RADIUS / 1e3:g} km, without attitude "
        "control. An independent simulator (MuJoCo) makes the recordings.",
        manoeuvre="Joints 2 to 4 move by 0.264, −0.321 and 0.057 rad out and back, as in flight, over "
        f"{ramps}; its linear ramps are replaced by quintic ones. The tip moves with up to {1e3 * fastest:.0f} mm/s, "
        f"where the flight's rule is {1e3 * TIP_SPEED:.0f} mm/s.",
        sensors=f"Every {INTERVAL:g} s, noise per sample: rates {format_number(RATE_SIGMA)} rad/s (the paper's star "
        f"sensor: 2 arcsec), joints {format_number(ENCODER_SIGMA)} rad. The attitude, {format_number(ATTITUDE_SIGMA)} "
        "rad, is kept for comparison alone, but for the exact one at the start.",
        known="Orbit, links and joint motion. The present simulation starts at rest and has no effect.",
        unknown=f"Base body, with a mass known to 5 % (relative width {SPREAD:g}, of which the true base is a draw); "
        f"hidden: gravity gradient, momentum {format_vector(MOMENTUM)} N m s left in the wheels, and initial rates of "
        f"{format_number(RATE)} rad/s per axis (assumed, as no values are public).",
        replicates=f"{len(case.world.manoeuvres)} recordings of {DURATION:g} s, attitudes and places on orbit drawn "
        "at random, one base. A single world: rates of right verdicts are in the report on blind injections.",
    )


def _negatives(document: Document, case: Case) -> None:
    document.section("What fails, and how sure the answer is")
    verdict = case.diagnosis.verdict
    off = (case.diagnosis.gain.before.bodies.mean[0] / case.world.base[0] - 1.0) * 100.0
    texts = [
        "The present simulation cannot be mended by its base: "
        + (
            "every fit of it drives the base to where its prior all but excludes it, so that the base stays at the "
            "prior"
            if case.diagnosis.held
            else f"fitted to the rates, the base imitates the drift, with a mass {format_signed(float(off), 0)} % off"
        )
        + f", and the attitude is {format_number(_rms(case, 'fitted'), 2)} degrees off (rms).",
        "The gravity gradient has no amplitude of its own: its size follows from base and orbit.",
    ]
    missed = [cause for cause in CAUSES if cause not in verdict.causes]
    wrong = [cause for cause in verdict.causes if cause not in CAUSES]
    if missed or wrong:
        texts.insert(0, f"Missed: {', '.join(missed) or 'none'}; wrongly named: {', '.join(wrong) or 'none'}.")
    if verdict.ambiguous_with:
        texts.append(f"Other explanations that stay possible: {'; '.join(map(set_text, verdict.ambiguous_with))}.")
    if verdict.equivalent_to:
        others = "; ".join(f"{', '.join(names)} for {cause}" for cause, names in verdict.equivalent_to.items())
        texts.append(f"Other names of the same change of the model: {others}.")
    inside = np.mean([np.abs(item.missed) <= REACH * item.sd for item in case.attitudes])
    texts.append(
        f"Over all samples the band holds {format_percent(float(inside), 3)} of the measured angles. Errors along one "
        "recording are correlated, so that this says less than its number of samples suggests."
    )
    document.items(texts)


def _evidence(document: Document, case: Case, output: Path) -> None:
    document.section("Evidence")
    named = " of the named causes" if case.diagnosis.verdict.causes else ""
    document.table(
        ["causes", "probability", "log evidence", "chi-square per sample"],
        [_step_row(step) for step in case.steps],
        f"The most probable sets{named} with none to three causes, each fitted. The probability is that of the set "
        "alone, and the log evidence is relative to nothing.",
        columns("lrrr"),
    )
    after = case.diagnosis.gain.after.bodies
    truth = case.world.base
    quantities = [*case.amplitudes]
    for k, title in enumerate(QUANTITY_TITLES):
        name, unit = title.rstrip("]").split(" [")
        quantities.append(Amplitude(name, unit, float(truth[k]), float(after.mean[k]), float(after.sd[k])))
    file = write_table(output, "quantities", [field.name for field in fields(Amplitude)], map(astuple, quantities))
    document.table(
        ["quantity", "unit", "truth", "estimate ± sd", "error [sd]"],
        [
            [
                item.name,
                format_unit(item.unit),
                format_number(item.truth, 4),
                format_quantity(item.mean, item.sd),
                format_signed(item.distance),
            ]
            for item in quantities
            if not item.name.startswith("initial rate")
        ],
        "Wheel momentum and base body, fitted together with the other causes. The initial rates, one vector for each "
        f"recording, are in {file}.",
        columns("llrrr"),
    )
    before, extended = case.diagnosis.gain.before, case.diagnosis.gain.after
    document.paragraph(
        f"The chi-square per sample is {format_number(before.chi2_per_sample)} before and "
        f"{format_fixed(extended.chi2_per_sample, 3)} after the extension. {_held_out(case)}"
    )


def _held_out(case: Case) -> str:
    """Return the scores of recordings that were left out, if there are any."""
    before, after = case.diagnosis.gain.before.held_out, case.diagnosis.gain.after.held_out
    if before is None or after is None:
        return ""
    scores = [format_number(float(score.sum()), 4) for score in (before, after)]
    return f"The log score of recordings left out is {scores[0]} before and {scores[1]} after."


def _step_row(step: Step) -> list[str]:
    fit = step.fitted.fit
    return [
        set_text(step.found.causes),
        format_probability(step.found.probability),
        format_signed(step.found.log_evidence) if step.found.causes else "0",
        format_number(fit.chi2 / fit.posterior.samples),
    ]


def _statements(case: Case) -> list[Statement]:
    return [
        Statement(
            "Gravity gradient, residual momentum of the wheels and a non-zero initial rate give rise to the drift (1).",
            Finding.CONFIRMED if case.right else Finding.NOT_TESTABLE,
            "In simulation: the three make a drift like that of figure 2, are named from the rates alone, and with "
            "them the attitude is predicted."
            if case.right
            else "The three make a drift like that of figure 2, but the diagnosis does not name them.",
        ),
        Statement(
            "They gave rise to the drift of the flight.",
            Finding.NOT_TESTABLE,
            "Neither telemetry nor momentum of the wheels is public.",
        ),
        Statement(
            "The simulation without external actions is a rather strong assumption.",
            Finding.CONFIRMED,
            f"After {DURATION:g} s without the causes the attitude is {format_number(_last(case), 2)} degrees off.",
        ),
    ]


def _last(case: Case) -> float:
    """Return the largest difference of an angle at the end between measured attitude and the present simulation."""
    return max(float(np.abs(item.plain[-1] - item.measured[-1]).max()) for item in case.attitudes)


@styled
def attitude_figure(attitude: Attitude) -> Figure:
    """Draw the paper's figure 2 for one recording, and beneath it the error of the prediction with its band."""
    figure = wide_figure(3.7)
    panels = figure.subplots(2, 3, sharex=True, sharey="row")
    dots = {"color": AFTER, "linestyle": "", "marker": ".", "markersize": 3.5, "label": "predicted, with the causes"}
    for axis, (above, below) in enumerate(panels.T):
        above.plot(attitude.time, attitude.measured[:, axis], color=TRUTH, linewidth=1.6, label="measured")
        above.plot(attitude.time, attitude.plain[:, axis], "--", color=BEFORE, label="simulated before")
        above.plot(attitude.time[::12], attitude.extended[::12, axis], **dots)
        above.set_title(f"about {'xyz'[axis]}")
        reach = REACH * attitude.sd[:, axis]
        below.fill_between(attitude.time, -reach, reach, label="95 % band", **BAND)
        below.plot(attitude.time, attitude.missed[:, axis], color=AFTER, linewidth=0.7)
        below.set_xlabel("time [s]")
    panels[0, 0].set_ylabel("angle [deg]")
    panels[1, 0].set_ylabel("error [deg]")
    panels[1, 0].legend()
    shared_legend(figure, panels[0, 0], 3)
    return figure
