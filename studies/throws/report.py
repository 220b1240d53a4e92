"""Report of the study: the answer, goals, what failed, what was found, under which conditions."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bayesid.diagnosis import Diagnosis
from bayesid.report import Document
from bayesid.report.numbers import format_p_value, relation
from bayesid.report.tables.probability_tables import set_rows
from studies.throws.bodies import BLOCK_SD, PLATE_SD
from studies.throws.data import EXCLUDED, INTERVAL, WHEEL_INERTIA
from studies.throws.diagnosis import SPREAD, Lacking
from studies.throws.figures import throws_figure
from studies.throws.goals import goal_rows, held_in_all

if TYPE_CHECKING:
    from studies.throws import Result

__all__ = ["write_report"]

Floats = NDArray[np.floating]

SHOWN = 4
"""Sets of causes in each table."""

MOMENTS = ("smallest", "middle", "largest")


def write_report(result: Result, path: Path) -> None:
    """Write the report."""
    document = Document("Thrown bodies", "Real measurements of a small free-flying device with one reaction wheel")
    _answer(document, result)
    _negatives(document, result)
    _bodies(document, result)
    _unexplained(document, result)
    if result.studies:
        _diagnosis(document, result)
    if result.wheel is not None:
        _reverse(document, result.wheel)
    _conditions(document, result)
    document.write(path)


def _answer(document: Document, result: Result) -> None:
    document.section("Answer")
    count, total = held_in_all(result)
    errors = "; ".join(
        f"{body.name} {body.mean_error:.2f} % (rigid body: {result.plain.bodies[body.name].mean_error:.2f} %)"
        for body in result.extended.bodies.values()
    )
    document.items(
        [
            f"Mean error of the principal moments in single throws of half a second: {errors}.",
            f"Of the 95 % intervals of single throws {count} of {total} hold the stated moments: "
            f"{100.0 * count / total:.0f} %.",
            f"Diagnosis from the data alone: {_named(result)}",
        ]
    )
    document.table(("goal", "reached", "verdict"), goal_rows(result), "Goals.", ["left", "left", "left"])


def _named(result: Result) -> str:
    if not result.studies:
        return "not run; a full run makes it."
    parts = [f"{study.body} {_said(study.diagnosis)}" for study in result.studies]
    return "; ".join(parts) + "."


def _said(found: Diagnosis) -> str:
    causes = ", ".join(found.verdict.causes) or "nothing named"
    return (
        f"{found.verdict.status.value} ({causes}; probability of something unknown {found.probabilities.unknown:.2f})"
    )


def _negatives(document: Document, result: Result) -> None:
    document.section("What failed, and what cannot be told")
    plain = result.plain.bodies
    texts = [
        "A rigid body with its wheel and nothing else is wrong: its formal standard deviations of single throws are "
        + " and ".join(f"{body.inflation:.0f} times too small ({body.name})" for body in plain.values())
        + ", judged by the scatter of the throws alone.",
        "The delay of the wheel's reading, and the wheel acceleration beyond which samples are left out, were found on "
        "these throws; the errors are not those of a blind test. The widths of torque, force and noise follow from the "
        "data of each body by marginal likelihood.",
        "Every throw of a body shares the error of its stated geometry and of the wheel's inertia. Intervals that "
        "count "
        f"both hold {held_in_all(result, with_truth=True)[0]} of {held_in_all(result, with_truth=True)[1]}.",
        "The gyro's scale cannot be told from the wheel's inertia; a shift of the wheel's place is not a candidate.",
    ]
    noisy = {body: factor for body, factor in result.extended.noise.items() if factor.max() > 1.5}
    for body, factor in noisy.items():
        texts.append(
            f"{body}: in flight the samples vary up to {factor.max():.1f} times as much about the smooth model as "
            "quiet stretches do."
        )
    for body, widths in result.extended.widths.items():
        if widths["smooth-torque"].doubtful:
            texts.append(f"{body}: the unexplained torque is {widths['smooth-torque'].ratio:.2f} times its prior sd.")
    document.items(texts)


def _bodies(document: Document, result: Result) -> None:
    document.section("The bodies against their geometry")
    rows = []
    for body in result.extended.bodies.values():
        for k, name in enumerate(MOMENTS):
            truth = body.truth[k]
            single = 100.0 * np.sqrt((body.formal[:, k] ** 2).mean()) / truth
            rows.append(
                [
                    body.name,
                    name,
                    f"{1e6 * truth:.1f} ± {1e6 * body.truth_sd[k]:.1f}",
                    f"{body.errors[:, k].mean():+.2f} ± {body.errors[:, k].std(ddof=1):.2f}",
                    f"{single:.2f}",
                    f"{body.joint_errors[k]:+.2f}",
                    f"{100.0 * body.joint_formal[k] / truth:.2f}",
                    f"{100.0 * body.joint_jackknife[k] / truth:.2f}",
                ]
            )
    document.table(
        (
            "body",
            "moment",
            "stated [mg m²]",
            "single [%]",
            "formal sd [%]",
            "joint [%]",
            "formal sd [%]",
            "jackknife [%]",
        ),
        rows,
        "Errors of principal moments with the extended model: mean and scatter of single throws, and the joint fit of "
        "all throws.",
        ["left", "left", *["right"] * 6],
    )
    document.figure(
        throws_figure(result.plain, result.extended),
        "Errors of single throws with formal standard deviations. The grey band is the stated moments' own.",
    )
    extended = result.extended
    document.paragraph(
        f"Inertia of the wheel, from the box of known inertia: {1e6 * extended.wheel:.4f} mg m², "
        f"{1e6 * extended.wheel_formal:.4f} formal and {1e6 * extended.wheel_jackknife:.4f} jackknife sd. The joint "
        "fits " + ("converged." if extended.converged and result.plain.converged else "did not all converge.")
    )


def _unexplained(document: Document, result: Result) -> None:
    document.section("What stays unexplained")
    rows = []
    for body, widths in result.extended.widths.items():
        torque, force = widths["smooth-torque"], widths["smooth-force"]
        noise = result.extended.noise[body]
        rows.append(
            [
                body,
                f"{1e6 * torque.sd:.0f}",
                f"{torque.factor:.2f}",
                f"{torque.ratio:.2f}",
                f"{force.sd:.3f}",
                " / ".join(f"{x:.1f}" for x in noise[:3]),
                " / ".join(f"{x:.1f}" for x in noise[3:]),
            ]
        )
    document.table(
        ("body", "torque sd [µN m]", "factor", "rms / sd", "force sd [m/s²]", "gyro noise x/y/z", "accel. noise x/y/z"),
        rows,
        "Smooth torque and specific force per throw, widths by marginal likelihood; factor: by which one more step "
        "would "
        "change the torque's width. Noise in flight relative to quiet stretches.",
        ["left", *["right"] * 6],
    )
    calibration = [
        [name, f"{1e3 * mean:.2f}", f"{1e3 * sd:.2f}"] for name, (mean, sd) in result.extended.calibration.items()
    ]
    document.table(
        ("device", "mean", "formal sd"),
        calibration,
        "The device's own errors: gyro-cross and wheel-tilt in 0.001 (1, rad), wheel-delay in ms.",
        ["left", "right", "right"],
    )


def _diagnosis(document: Document, result: Result) -> None:
    document.section("Diagnosis from the data alone")
    for study in result.studies:
        _study(document, study)
    rows = [
        [body, *(_signed(result.errors[name][body]) for name in ("rigid", "extended"))]
        for body in result.errors["rigid"]
    ]
    document.table(
        ("body", "rigid [%]", "extended [%]"),
        rows,
        "Errors of the smallest, middle and largest principal moment, from the diagnosed throws alone.",
        ["left", "right", "right"],
    )


def _reverse(document: Document, wheel: Diagnosis) -> None:
    document.section("The reverse: the recorded wheel dropped")
    before = wheel.gain.before.chi2_per_sample
    document.paragraph(
        f"The verdict on the box without its recorded wheel is {_said(wheel)}. Chi-square per sample of the model "
        f"without the wheel: {before:.0f}."
    )
    _sets(document, wheel, "the box without its recorded wheel")


def _study(document: Document, study: Lacking) -> None:
    found, held = study.diagnosis, study.held_out
    gain = held.gain
    labels = ", ".join(effect.label for effect in study.taken.fit.effects) or "nothing"
    document.paragraph(
        f"{study.body}, throw {', '.join(name[-3:] for name in study.training)}: {_said(found)}. The rigid model "
        "leaves "
        f"chi-square per sample {found.gain.before.chi2_per_sample:.0f}, p "
        f"{relation(format_p_value(found.alarm.p_value))}. "
        f"Extension by {labels}: over {len(gain)} throws left out it "
        f"{'gains' if gain.sum() > 0 else 'loses'} {abs(gain.sum()):.0f} in log score with the same noise and is "
        "better "
        f"on {int((gain > 0).sum())} of them."
    )
    _sets(document, found, study.body)


def _sets(document: Document, found: Diagnosis, of: str) -> None:
    document.table(
        ["causes", "probability", "log evidence", "size", "bound", "share of the bound"],
        set_rows(found, SHOWN),
        f"The most probable sets of causes of {of}. The log evidence is relative to nothing.",
        ["left", "right", "right", "left", "right", "right"],
    )


def _conditions(document: Document, result: Result) -> None:
    document.section("Conditions")
    throws = {name: len(body.throws) for name, body in result.extended.bodies.items()}
    document.items(
        [
            f"Samples every {1e3 * INTERVAL:g} ms are local parabolas with Gaussian weights whose neighbours are "
            "uncorrelated; their noise is measured on quiet stretches, by body and axis. Samples next to the wheel's "
            "largest accelerations (12000 rad/s² within 4 ms) are left out, and so are 20 ms at the end.",
            "Extended model: cross-axis terms of the gyro, tilt and delay of the wheel, linear drag, and a torque "
            "and a "
            "specific force per throw that are piecewise linear over 32 ms. Prior of each body: 100 % about a "
            "regression "
            "that needs its mass alone.",
            f"All inertias are relative to the wheel's, nominally {1e6 * WHEEL_INERTIA:.2f} mg m²; the box gives its "
            "true "
            "value. The device is taken off with the parallel-axis theorem.",
            f"Stated moments are taken as uncertain by {100 * PLATE_SD:.0f} % for the plate (CAD) and by "
            f"{100 * BLOCK_SD:.1f} % for what blocks add: our numbers.",
            f"Throws of the bodies: {', '.join(f'{name} {count}' for name, count in throws.items())}. Left out: "
            + "; ".join(f"{name}, because {reason}" for name, reason in EXCLUDED.items())
            + ".",
            f"Diagnosis: prior of the body {100 * SPREAD:g} % about the regression. Imbalance of the wheel is a "
            "torque and "
            "force once in a turn; its own axis' friction and an accelerometer's g-dependent noise are no candidates.",
        ]
    )
    document.foot(
        "Data: Blaha, Kuijper, Pop and Smeur, arXiv:2503.13137; none of them is reproduced here. "
        f"bayesid {version('bayesid')}, seed 1, `python -m studies.throws{' --full' if result.studies else ''}`."
    )


def _signed(values: Floats) -> str:
    return " / ".join(f"{value:+.2f}" for value in values)
