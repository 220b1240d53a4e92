"""Consequences in a diagnosis report: the inertial parameters with and without the causes, and the disturbance."""

from __future__ import annotations

from collections.abc import Sequence

from bayesid.diagnosis import Diagnosis, Frame, Status
from bayesid.diagnosis.outcome.disturbance import TorqueCorrelation
from bayesid.diagnosis.outcome.gain import ParameterChange
from bayesid.diagnosis.outcome.torque_of_causes import torque_of_causes
from bayesid.report import figures
from bayesid.report.diagnosis.diagnosis_sentences import wrench_sentence
from bayesid.report.document import Document, Rows
from bayesid.report.numbers import format_number, format_quantity, format_signed, format_unit

__all__ = [
    "add_changes",
    "add_consequences",
    "change_rows",
    "correlation_rows",
    "most_moved",
    "of_most_moved_body",
]

LISTED = ("mass", "com.x", "com.y", "com.z", "inertia.xx", "inertia.yy", "inertia.zz")  # in the table of the first page

AXES = {Frame.BASE: "base", Frame.ORBIT: "orbit (zenith, along-track, normal)", Frame.INERTIAL: "inertial"}
"""Names of the axes in which a disturbance is drawn."""


def add_changes(document: Document, result: Diagnosis, changes: Sequence[ParameterChange], caption: str) -> None:
    """Add a table of inertial parameters; what a fit with the named causes says only where there are some."""
    fits = ["without:", "with:", "shift [sd]:"] if result.named else ["fitted:"]
    document.table(
        ["parameter", "unit", "given:", "prior sd:", *fits],
        change_rows(changes, result.named),
        caption,
    )


def add_consequences(document: Document, result: Diagnosis) -> None:
    """Add the inertial parameters that the first page omits, and the reconstructed disturbance."""
    named, changes = result.named, result.parameter_changes
    document.section("Consequences" if named else "Inertial parameters and the disturbance")
    shown = of_most_moved_body(changes)
    if rest := [change for change in changes if change not in shown]:
        add_changes(document, result, rest, "The other inertial parameters, ± sd.")
    if named and changes:
        document.figure(
            figures.parameter_forest(changes),
            "Inertial parameters relative to their values without the named causes; bars are 95 % intervals. The "
            "axis covers the two fits: a wider prior is a line over the whole width. A shift beyond the bars is an "
            "error that the stated standard deviations do not cover.",
        )
    if (error := result.joint_error) is not None:
        document.figure(
            figures.joint_error_curve(error),
            f"Recorded less true position of {error.joint} by the position, if the unnamed cause is an error of its "
            "encoder; the band is ± 1 standard deviation.",
        )
    _add_disturbance(document, result)


def _add_disturbance(document: Document, result: Diagnosis) -> None:
    """Add the torque and force that would explain the residual; nothing where only readings are at fault."""
    named, wrench = result.named, result.disturbance
    hooks = ("wrench", "momentum", "table", "modes")
    moves = any(effect.uses(hook) for effect in result.after.fit.effects for hook in hooks)
    # a fault of the noise could hide a disturbance
    if result.verdict.status is Status.ADEQUATE or (named and not (moves or result.after.faults)):
        return
    document.paragraph(
        f"The residual{' without the named causes' if named else ''} was reconstructed as a disturbance of the base: "
        "a torque about, and a force through, the common centre of mass, both smooth in time. Their size is estimated "
        "from the data; bands are ± 1 standard deviation. The part that the model's unknowns can explain is not "
        "included."
        + (f" {wrench_sentence(wrench)}" if named else "")  # the first page states it where nothing is named
    )
    if wrench.signal_to_noise > 0.0:
        _add_wrench(document, result)
        if named and result.verdict.status is not Status.PARTLY_EXPLAINED:  # of which the first page states it
            rest = wrench_sentence(result.unexplained)
            document.paragraph(f"With the named causes in the model: {rest[0].lower()}{rest[1:]}")


def _add_wrench(document: Document, result: Diagnosis) -> None:
    """Add the figures of the disturbance and the table of its correlations; in all axes where nothing is named."""
    cause = torque_of_causes(result.after) if result.named else None
    if cause is not None:
        cause = [cause[r] for r in result.disturbance.recordings]
    dashed = " Dashed: the full torque of the named causes, including the part that the model's unknowns could explain."
    frames = [Frame.BASE]
    if not result.named:
        frames += [Frame.INERTIAL] if result.before.fit.posterior.model.orbit is None else [Frame.ORBIT, Frame.INERTIAL]
    for frame in frames:
        document.figure(
            figures.plot_disturbance(result, frame),
            f"Reconstructed torque and force, {AXES[frame]} axes.{'' if cause is None else dashed}",
        )
    if not result.named:
        document.figure(
            figures.wrench_spectrum(result.disturbance),
            "Amplitude of the reconstructed torque by frequency, base axes, up to the highest resolved frequency.",
        )
        if rows := correlation_rows(result.torque_correlations):
            document.table(
                ["component, base axes", "correlated with", "correlation:"],
                rows,
                "Largest correlations of the reconstructed torque with known time series, all recordings pooled. "
                "Because the series are smooth, a correlation of one half can occur by chance.",
            )


def change_rows(changes: Sequence[ParameterChange], named: bool = True) -> Rows:
    """Return parameter, unit, given, prior sd, without, with, and shift in sd; only the fit where nothing is named."""
    rows = []
    for item in changes:
        given = [format_number(item.given, 4), format_number(item.prior_sd, 2)]  # wide priors would round it away
        start = [item.name, format_unit(item.unit), *given]
        without = format_quantity(item.without, item.without_sd)
        fitted = [format_quantity(item.fitted, item.fitted_sd), format_signed(item.shift)] if named else []
        rows.append([*start, without, *fitted])
    return rows


def most_moved(changes: Sequence[ParameterChange], most: int) -> list[ParameterChange]:
    """Return the parameters that move most in standard deviations, in their usual order."""
    chosen = sorted(changes, key=lambda item: -abs(item.shift))[:most]
    return [item for item in changes if item in chosen]


def of_most_moved_body(changes: Sequence[ParameterChange]) -> list[ParameterChange]:
    """Return mass, centre of mass and moments of inertia of the body with the parameter that moves most."""
    names = [moved.name for moved in most_moved(changes, 1)]
    bodies = [
        name.rpartition(".inertia.")[0] or name.rpartition(".com.")[0] or name.rpartition(".")[0] for name in names
    ]
    return [change for change in changes if change.name in {f"{body}.{key}" for body in bodies for key in LISTED}]


def correlation_rows(correlations: Sequence[TorqueCorrelation]) -> Rows:
    """Return torque component, series and correlation."""
    return [[item.component, item.series, format_signed(item.correlation, 2)] for item in correlations]
