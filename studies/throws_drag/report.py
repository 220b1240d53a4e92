"""The study's report."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bayesid.diagnosis import Diagnosis
from bayesid.diagnosis.cause_amplitudes import amplitudes_of
from bayesid.report import Document, format_quantity
from bayesid.report.figures.figure_style import COLOURS, styled, wide_figure
from bayesid.report.numbers import format_number, format_p_value, format_unit, relation
from bayesid.report.tables.diagnosis_tables import candidate_rows
from bayesid.report.tables.probability_tables import set_rows
from studies.throws_drag.analysis import SPREAD, Comparison, Study, Wheel

__all__ = ["held_out_figure", "wheel_figure", "write_report"]

SHOWN = 9
"""Number of sets and of candidates in their tables."""


def write_report(result: Any, output: Path) -> None:
    """Write the report of a `studies.throws_drag.Result` as PDF."""
    document = Document("What the throws lack", "Real measurements: thrown rigid bodies with a reaction wheel")
    _question(document)
    for study in result.studies:
        _body(document, study)
    _geometry(document, result.comparison)
    if result.wheel is not None:
        _wheel(document, result.wheel)
    if not result.full:
        document.paragraph("This is the quick run: one body, few throws.")
    document.write(output)


def _question(document: Document) -> None:
    document.section("What was asked")
    document.paragraph(
        "Real throws of rigid bodies that carry a reaction wheel (arXiv:2503.13137). The simulation is the rigid body "
        "with "
        "its recorded wheel; every throw has an initial rate and an accelerometer bias of its own. What it lacks is to "
        "be "
        "named from the data of a few throws alone; then throws that took no part are predicted by both models, and "
        "both "
        "are compared with the geometry that the authors state. Nothing was tuned towards that geometry."
    )
    document.items(
        [
            f"Prior of the body: {100 * SPREAD:g} % about a linear regression on the training throws.",
            "Noise as declared in the study of the throws: gyro 0.007 rad/s (about the wheel's axis more), "
            "accelerometer "
            "0.2 m/s². The samples were filtered over 2 ms, so that neighbours are not quite independent.",
            "Candidates: all of the catalogue that can exist in a laboratory, save hidden vibrations (these bodies "
            "are stiff), and two that a user wrote for this device: gyro-cross (cross-axis sensitivity) and "
            "wheel-tilt.",
        ]
    )


def _body(document: Document, study: Study) -> None:
    found = study.diagnosis
    document.section(f"Body {study.body}: what is missing")
    document.paragraph(
        f"Training throws: {', '.join(study.training)}. Verdict: {found.verdict.status.value}; named: "
        f"{', '.join(found.verdict.causes) or 'nothing'}. The present model leaves chi-square per sample "
        f"{found.gain.before.chi2_per_sample:.2f} and is not adequate unless its p-value exceeds "
        f"{found.alarm.level:g}: p {relation(format_p_value(found.alarm.p_value))}."
    )
    _tried(document, found)
    if study.taken.labels:
        rows = [
            [label, quantity.name, format_unit(quantity.unit), format_quantity(mean, sd)]
            for label in study.taken.labels
            for quantity, mean, sd in amplitudes_of(study.taken, label)
        ]
        origin = (
            "the causes named"
            if found.verdict.causes
            else "the most probable set of known causes, which is not probable enough to be named"
        )
        document.table(
            ["cause", "quantity", "unit", "value ± sd"],
            rows,
            f"The extended model of what follows: {origin}. The widths suppose that nothing else is missing.",
            ["left", "left", "left", "right"],
        )
    held = study.held_out
    document.figure(held_out_figure(study), "Throws left out, predicted by both models.", "80%")
    gain = held.score["extended"] - held.score["rigid"]
    document.table(
        ["throw left out", "log score, rigid", "log score, extended", "gain", "chi² rigid", "chi² extended"],
        [
            [name, f"{one:.0f}", f"{two:.0f}", f"{two - one:+.0f}", f"{a:.2f}", f"{b:.2f}"]
            for name, one, two, a, b in zip(
                held.names,
                held.score["rigid"],
                held.score["extended"],
                held.chi2["rigid"],
                held.chi2["extended"],
                strict=True,
            )
        ],
        "Log density of throws left out given the training throws (higher is better), and chi-square per sample with "
        "body "
        "and effects as trained, only initial rate and accelerometer bias fitted to the throw.",
        ["left", *["right"] * 5],
    )
    document.paragraph(
        f"The extension {'gains' if gain.sum() > 0 else 'loses'} {abs(gain.sum()):.0f} in log score over "
        f"{len(gain)} throws left out and is better on {int((gain > 0).sum())} of them. Chi-square per sample: mean "
        f"{held.chi2['rigid'].mean():.2f} before, {held.chi2['extended'].mean():.2f} after; noise alone gives 1."
    )


def _tried(document: Document, found: Diagnosis) -> None:
    count = len(found.probabilities.sets)
    document.table(
        ["causes", "probability", "log evidence", "size", "bound", "share of the bound"],
        set_rows(found, SHOWN),
        f"The {min(SHOWN, count)} most probable of {count} sets of causes. The log evidence is relative to nothing.",
        ["left", "right", "right", "left", "right", "right"],
    )
    document.table(
        ["candidate", "probability", "signal-to-noise", "p", "log Bayes factor", "size, or 95 % limit", "power"],
        candidate_rows(found.candidates[:SHOWN], found.alarm.level),
        "The most probable candidates. The probability holds whatever accompanies them; all else is of each alone.",
        ["left", "right", "right", "right", "right", "left", "right"],
    )


def _geometry(document: Document, comparison: Comparison) -> None:
    document.section("Against the stated geometry")
    rows = []
    for body in ("Empty", "A"):
        rigid, extended = (comparison.errors[name][body] for name in ("rigid", "extended"))
        rows += [
            [body, moment, f"{one:+.2f}", f"{two:+.2f}"]
            for moment, one, two in zip(("smallest", "middle", "largest"), rigid, extended, strict=True)
        ]
    document.table(
        ["body", "principal moment", "rigid [%]", "extended [%]"],
        rows,
        "Errors of the body without the device, from joint fits of all four bodies; the wheel's inertia is that which "
        "gives the known box its moments: "
        f"{1e6 * comparison.wheel['rigid']:.4f} and {1e6 * comparison.wheel['extended']:.4f} mg m². The stated moments "
        "are themselves uncertain by some 3 % for the plate.",
        ["left", "left", "right", "right"],
    )
    sizes = {
        name: float(np.abs(np.concatenate(list(errors.values()))).mean()) for name, errors in comparison.errors.items()
    }
    document.paragraph(
        f"Mean size of the errors: {sizes['rigid']:.2f} % rigid, {sizes['extended']:.2f} % extended: the extension "
        f"{'brings the bodies nearer to' if sizes['extended'] < sizes['rigid'] else 'takes the bodies farther from'} "
        "the "
        "stated geometry. Effects used: "
        + "; ".join(f"{body}: {', '.join(labels) or 'none'}" for body, labels in comparison.labels.items())
        + ". Faults of the noise, where named, are left out here."
    )


def _wheel(document: Document, wheel: Wheel) -> None:
    found = wheel.diagnosis
    document.section("The reverse: the wheel taken from the model")
    document.paragraph(
        "The recorded momentum of the wheel is dropped from model and recordings. Verdict: "
        f"{found.verdict.status.value}; named: {', '.join(found.verdict.causes) or 'nothing'}. The catalogue's "
        "wheel-momentum is a wheel at constant speed and its wheel-history one whose speed changes; this wheel runs up "
        f"and down within the half second of a throw. {_said_of_wheel(found)}"
    )
    _tried(document, found)
    document.figure(
        wheel_figure(wheel),
        "Torque that the motion needs beyond the model, reconstructed from gyro and accelerometer alone, and the "
        "torque of "
        "the recorded wheel, which the diagnosis never saw.",
    )
    document.table(
        ["axis", "correlation", "needed / recorded"],
        [[axis, f"{wheel.correlation[k]:+.3f}", f"{wheel.size[k]:+.3f}"] for k, axis in enumerate("xyz")],
        "Reconstructed against recorded torque over all throws; 'needed / recorded' is the slope. The wheel turns "
        "about "
        "z.",
        ["left", "right", "right"],
    )
    document.paragraph(
        f"Signal-to-noise ratio of the reconstructed disturbance: {format_number(found.unexplained.signal_to_noise)}; "
        "chi-square per sample of the model without the wheel: "
        f"{format_number(found.gain.before.chi2_per_sample)}."
    )


def _said_of_wheel(found: Diagnosis) -> str:
    if any(cause.startswith("wheel-") for cause in found.verdict.causes):
        return "A wheel is named."
    seen = "What is wrong is seen, but no wheel is named" if not found.alarm.silent else "Nothing is seen"
    return f"{seen}: the fit that the causes are weighed about at first is far from the data."


@styled
def held_out_figure(study: Study) -> Figure:
    """Draw chi-square per sample and gain in log score of the throws left out."""
    figure = wide_figure(2.2)
    left, right = figure.subplots(1, 2)
    held = study.held_out
    place = np.arange(len(held.names))
    for k, name in enumerate(("rigid", "extended")):
        left.bar(place + 0.36 * (k - 0.5), held.chi2[name], 0.34, color=COLOURS[k], label=name)
    left.axhline(1.0, color="#888888", linewidth=0.8)
    left.set_ylabel("chi-square per sample")
    left.legend()
    right.bar(place, held.score["extended"] - held.score["rigid"], 0.5, color=COLOURS[2])
    right.axhline(0.0, color="#000000", linewidth=0.6)
    right.set_ylabel("gain in log score")
    for axes in (left, right):
        axes.set_xticks(place, [name.split("_")[-1] for name in held.names])
    return figure


@styled
def wheel_figure(wheel: Wheel) -> Figure:
    """Draw needed and recorded torque, a row per throw."""
    figure = wide_figure(1.7 * len(wheel.time) + 0.3)
    panels: Any = figure.subplots(len(wheel.time), 3, squeeze=False, sharex=True)
    for r, row in enumerate(panels):
        for k, axes in enumerate(row):
            axes.plot(1e3 * wheel.time[r], 1e3 * wheel.recorded[r][:, k], color="#000000", label="recorded wheel")
            axes.plot(
                1e3 * wheel.time[r],
                1e3 * wheel.needed[r][:, k],
                color=COLOURS[1],
                linestyle="--",
                label="reconstructed",
            )
        row[0].set_ylabel(f"throw {r + 1} [mN m]")
    for k, axes in enumerate(panels[0]):
        axes.set_title(f"torque about {'xyz'[k]}")
    for axes in panels[-1]:
        axes.set_xlabel("time [ms]")
    panels[0][0].legend()
    return figure
