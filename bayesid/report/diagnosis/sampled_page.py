"""Samples in a diagnosis report: whether they confirm the linearised fit, and the readings that they predict."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from bayesid.diagnosis import Diagnosis
from bayesid.diagnosis.outcome.candidate_table import amplitudes_of
from bayesid.inference import Identification
from bayesid.inference.predicted_readings import SensorFit
from bayesid.report import figures
from bayesid.report.document import Document
from bayesid.report.identification_report import agreement_sentences
from bayesid.report.numbers import format_number, format_percent

__all__ = ["add_measured", "add_sampled", "sampled_sentence"]


def add_sampled(document: Document, result: Diagnosis, identification: Identification) -> None:
    """Add whether sampling confirms the values of the linearised fit, and how the samples were made."""
    document.section("The extended model, sampled" if result.named else "The present model, sampled")
    document.paragraph(
        f"{sampled_sentence(result, identification)} The file posterior.nc contains the samples, and diagnosis.json "
        "their means and intervals. For distributions, correlations and convergence, "
        + ("add the named causes to the study and run bayesid identify." if result.named else "run bayesid identify.")
    )
    document.items(agreement_sentences(identification))


def sampled_sentence(result: Diagnosis, identification: Identification) -> str:
    """Return how far means and widths of the samples are from those of the linearised fit."""
    pairs = list(_pairs(result, identification))
    if not pairs:
        return "The model has no parameters whose samples could be compared with the linearised fit."
    moved, where = max((abs(mean - fitted) / sd, name) for name, mean, _, fitted, sd in pairs)
    wider, there = max((abs(width / sd - 1.0), name) for name, _, width, _, sd in pairs)
    return (
        f"Sampling does not rely on linearisation. The means of the samples differ from the fitted values by at most "
        f"{format_number(moved, 2)} standard deviations ({where}), and the standard deviations by at most "
        f"{format_percent(wider, 2)} ({there})."
    )


def _pairs(result: Diagnosis, identification: Identification) -> Iterator[tuple[str, float, float, float, float]]:
    """Yield name, mean and sd of the samples, and those of the fit, of inertial parameters and sizes of causes."""
    quantities = [
        (mean, sd) for body in identification.bodies.values() for mean, sd in zip(body.mean, body.sd, strict=True)
    ]
    for change, (mean, sd) in zip(result.parameter_changes, quantities, strict=True):
        if change.fitted_sd > 0.0:
            yield change.name, float(mean), float(sd), change.fitted, change.fitted_sd
    fitted = {
        f"{label}.{amplitude.quantity.name}": amplitude
        for label in result.after.labels
        for amplitude in amplitudes_of(result.after, label)
    }
    for row in identification.effect_quantities:
        name = f"{row.label}.{row.name}"
        if name in fitted and fitted[name].sd > 0.0:
            yield name, row.mean, row.sd, fitted[name].mean, fitted[name].sd


def add_measured(document: Document, result: Diagnosis, fits: Sequence[Sequence[SensorFit]]) -> None:
    """Add measured and simulated readings of the strongest recording, with the named causes in the model.

    Parameters
    ----------
    document : Document
    result : Diagnosis
    fits : sequence of sequence of SensorFit
        Readings of each recording and sensor.
    """
    strongest = result.strongest_recording
    document.section("Measured and simulated")
    document.paragraph(
        f"The figure compares the readings of {result.recordings[strongest]} with those that the fitted "
        f"{'model with the named causes' if result.named else 'present model'} predicts."
    )
    document.figure(
        figures.measured_against_simulated(fits[strongest]),
        f"Measured and simulated readings of {result.recordings[strongest]}, sensor axes; below, the residual in σ.",
    )
