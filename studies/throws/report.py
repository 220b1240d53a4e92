"""Report of the study: the answer, goals, what failed, what was found, under which conditions."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bayesid.report import Document
from studies.common.goals import add_goals
from studies.common.report_parts import not_evaluated
from studies.throws.bodies import BLOCK_SD, PLATE_SD
from studies.throws.data import EXCLUDED, INTERVAL, POLE_PAIRS, WHEEL_INERTIA
from studies.throws.diagnosis import SPREAD
from studies.throws.goals import goals_of, held_in_all, wheel_probability
from studies.throws.report_bodies import add_bodies
from studies.throws.report_diagnosis import add_diagnosis, add_reverse, said
from studies.throws.report_left_over import add_left_over

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
    add_bodies(document, result)
    add_left_over(document, result)
    if result.studies:
        add_diagnosis(document, result)
    else:
        not_evaluated(document, "Diagnosis from the data alone")
    if result.wheels:
        add_reverse(document, result.wheels, result.reverse_seconds)
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
            *_described(result),
        ]
    )
    add_goals(document, goals_of(result))


def _described(result: Result) -> list[str]:
    orders = [f"{left.turn[0]:.2f}" for left in result.extended.left.values()]
    texts = [
        "What stays unexplained shakes with the wheel: on every body the raw accelerometer is loudest at "
        f"{' to '.join(sorted({min(orders), max(orders)}))} times the recorded wheel's frequency, as that of a motor "
        f"with {result.pairs} pairs of poles, where the record takes it to have {POLE_PAIRS}."
    ]
    if result.wheels:
        held = [wheel_probability(found) for found in result.wheels.values()]
        texts.append(
            f"With the recorded wheel dropped, a wheel of unknown course about the right axis has a probability of "
            f"{min(held):.3f} or more on each of {len(held)} bodies; the verdicts are "
            + ", ".join(f"{found.verdict.status.value} ({body})" for body, found in result.wheels.items())
            + "."
        )
    return texts


def _named(result: Result) -> str:
    if not result.studies:
        return "not run; a full run makes it."
    parts = [f"{study.body} {said(study.diagnosis)}" for study in result.studies]
    return "; ".join(parts) + "."


def _negatives(document: Document, result: Result) -> None:
    document.section("What failed, and what cannot be told")
    plain = result.plain.bodies
    texts = [
        "A rigid body with its wheel and nothing else is wrong: its formal standard deviations of single throws are "
        + " and ".join(f"{body.inflation:.0f} times too small ({body.name})" for body in plain.values())
        + ", judged by the scatter of the throws alone.",
        "Four choices were made while looking at these throws, so that the errors are not those of a blind test: the "
        "delay of the wheel's reading, the wheel acceleration beyond which samples are left out, that a smooth force "
        "is fitted beside the torque, and that the noise in flight is scaled. The sizes of the last two follow from "
        "each body's throws by marginal likelihood; the first two are constants of the reader.",
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


def _conditions(document: Document, result: Result) -> None:
    document.section("Conditions")
    throws = {name: len(left.names) for name, left in result.extended.left.items()}
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
            f"Throws: {', '.join(f'{name} {count}' for name, count in throws.items())}, {sum(throws.values())} in all, "
            "of which the calibration takes those of the device and of the box. Left out: "
            + "; ".join(f"{name}, because {reason}" for name, reason in EXCLUDED.items())
            + ".",
            f"Diagnosis: prior of the body {100 * SPREAD:g} % about the regression. Imbalance of the wheel is a "
            "torque and "
            "force once in a turn; its own axis' friction and an accelerometer's g-dependent noise are no candidates.",
        ]
    )
    document.foot(
        "Data: Blaha, Kuijper, Pop and Smeur, arXiv:2503.13137; none of them is reproduced here. "
        f"bayesid {version('bayesid')}, seed 1, "
        f"`python -m studies.throws{' --full' if result.studies else ''}{' --reverse' if result.wheels else ''}`."
    )
