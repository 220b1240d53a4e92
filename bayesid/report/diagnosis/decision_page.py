"""First page of a diagnosis report: the decision, its probabilities, and what it changes for the user."""

from __future__ import annotations

from collections.abc import Iterator

from bayesid._io.words import joined
from bayesid.diagnosis import Diagnosis, Hypothesis, Status
from bayesid.diagnosis.outcome.gain import ParameterChange
from bayesid.report import figures
from bayesid.report.diagnosis.cause_words import NOTHING, SOMETHING, set_text, size_text, verdict_text
from bayesid.report.diagnosis.consequences_page import add_changes, most_moved, of_most_moved_body
from bayesid.report.diagnosis.diagnosis_sentences import (
    action_sentence,
    cause_summary,
    torque_sentence,
    verdict_sentence,
    wrench_sentence,
)
from bayesid.report.document import Document, Rows
from bayesid.report.numbers import (
    format_number,
    format_percent,
    format_probability,
    format_quantity,
    format_range,
    format_unit,
)

__all__ = ["add_decision", "conditions_text", "decision_entries", "probability_rows"]

CLASSES = 3  # classes of causes whose probabilities are stated


def add_decision(document: Document, result: Diagnosis, record: str | None = None) -> None:
    """Add the decision, a picture of it, and its tables.

    Parameters
    ----------
    document : Document
    result : Diagnosis
    record : str, optional
        How often such a verdict was right where the truth was known.
    """
    verdict = verdict_text(result.verdict)
    document.decision(f"Decision. {verdict[:1].upper()}{verdict[1:]}", decision_entries(result, record))
    document.figure(
        figures.plot_verdict(result),
        f"{_picture_text(result)} Right: the residual of {result.recordings[result.strongest_recording]} on the axis "
        "that changes most, with its running mean; the grey band is ± 2 σ of the noise.",
    )
    if result.parameter_changes:
        add_changes(
            document,
            result,
            of_most_moved_body(result.parameter_changes),
            "Inertial parameters, ± sd: as given, fitted without and with the named causes, and the shift between the "
            "two in sd of the fit without them."
            if result.named
            else "Inertial parameters, ± sd: as given, and fitted with the present model.",
        )


def decision_entries(result: Diagnosis, record: str | None = None) -> list[tuple[str, str]]:
    """Return the names and texts of the rows of the box."""
    verdict = result.verdict
    entries = [("Verdict", verdict_sentence(result))]
    for cause in verdict.causes:
        entries += [("Cause", _cause_text(result, cause)), ("Size, with 95 % interval", size_text(result.after, cause))]
    entries += [
        ("Alternative", f"{set_text(names)}, probability {format_probability(result.probability_of(names))}")
        for names in verdict.ambiguous_with
    ]
    listed = "; ".join(" ".join(row) for row in probability_rows(result, CLASSES))
    entries.append(("Probabilities", f"{listed}; each cause alone or with others."))
    if verdict.status in (Status.UNKNOWN, Status.UNRESOLVED, Status.PARTLY_EXPLAINED):
        entries.append(("Unexplained", wrench_sentence(result.unexplained)))
    if result.torques is not None:
        entries.append(("Joint torques", torque_sentence(result.torques)))
    if record:
        entries.append(("Record", record))
    entries += [
        ("Changes", _change_text(result)),
        ("Conditions", conditions_text(result.after)),
        ("Action", action_sentence(result)),
    ]
    return entries


def _picture_text(result: Diagnosis) -> str:
    """Return what the picture of the robot shows."""
    if not result.named:
        return "Left: the robot at the start."
    return "Left: the robot at the start, seen at right angles to the arrow, with the cause in blue where it acts."


def _cause_text(result: Diagnosis, cause: str) -> str:
    probability = format_probability(result.cause_probability(cause))
    return f"{cause}, probability {probability}. {cause_summary(result.after, cause)}".rstrip()


def _change_text(result: Diagnosis) -> str:
    """Return what would be wrong without the named causes, and the errors of the simulation, before and after."""
    text = "No inertial parameter changes, because nothing is added to the model."
    if result.named:
        wrong = [*map(_moved_text, most_moved(result.parameter_changes, 1)), *_motion_texts(result)]
        text = f"Without the named causes, {joined(wrong)}."
    errors = []
    for error in result.simulation_errors:
        after = f" before, {format_number(error.after, 2)} after" if result.named else ""
        errors.append(
            f"{error.kind.value} {format_number(error.before, 2)}{after} (noise alone "
            f"{format_number(error.noise, 2)}) {format_unit(error.kind.unit)}"
        )
    return f"{text} RMS error of the simulation, three axes together: {'; '.join(errors)}."


def _moved_text(moved: ParameterChange) -> str:
    """Return by how much the parameter that moves most would be wrong."""
    relative = abs(moved.fitted / moved.without - 1.0) if moved.without else 0.0
    share = (
        f" ({format_percent(relative, 2)} of its value)" if 0.0 < relative < 1.0 else ""
    )  # moments about zero have no share
    return (
        f"the estimate of {moved.name} would shift by {format_number(abs(moved.shift), 2)} standard deviations{share}, "
        f"more than that of any other parameter ({format_quantity(moved.without, moved.without_sd)} in place of "
        f"{format_quantity(moved.fitted, moved.fitted_sd)} {format_unit(moved.unit)})"
    )


def _motion_texts(result: Diagnosis) -> Iterator[str]:
    """Yield by how much the predicted motion would be wrong."""
    if change := result.motion_change:
        yield f"the predicted base rate would be wrong by up to {format_number(change.rate, 2)} rad/s"
        if change.tip_frame is not None:
            tip = format_number(1e3 * change.tip, 2)
            yield f"the predicted position of {change.tip_frame} would be wrong by up to {tip} mm"


def conditions_text(hypothesis: Hypothesis) -> str:
    """Return what a hypothesis takes for granted of links, noise and attitude."""
    posterior = hypothesis.fit.posterior
    nuisance = [prior for prior in posterior.model.priors if prior.nuisance]
    links = "links exact"
    if nuisance:
        widths = [prior.spread for prior in nuisance]
        width = format_percent(widths[0]) if len(set(widths)) == 1 else f"{format_range(widths)} of their values"
        links = f"links uncertain by {width} (their masses by twice that)"
    coloured = [sensor.kind.value for sensor in posterior.model.sensors if sensor.coloured is not None]
    noise = f"noise of {', '.join(coloured)} coloured" if coloured else "noise white"
    if hypothesis.faults:
        noise += f", with {', '.join(fault.label for fault in hypothesis.faults)}"
    return f"{links}, geometry exact, {noise}; bodies rigid except as described by the causes considered.".capitalize()


def probability_rows(result: Diagnosis, most: int) -> Rows:
    """Return name and probability of nothing, of something unknown, and of the most probable classes of causes.

    Parameters
    ----------
    result : Diagnosis
    most : int
        Number of classes.
    """
    probabilities = result.probabilities
    classes = dict.fromkeys(result.class_of(cause) for cause in probabilities.causes)
    ranked = sorted(classes, key=lambda members: (-probabilities.of_any(members), members))[:most]
    rows = [[" or ".join(members), format_probability(probabilities.of_any(members))] for members in ranked]
    return [
        *rows,
        [SOMETHING, format_probability(probabilities.unknown)],
        [NOTHING, format_probability(probabilities.nothing)],
    ]
