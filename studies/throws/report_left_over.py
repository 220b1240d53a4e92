"""Section of the report on what stays unexplained: its size, its place in flight, and whether it follows the wheel."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from bayesid.report import Document
from studies.throws.data import CALIBRATION, POLE_PAIRS
from studies.throws.figures import left_over_figure
from studies.throws.left_over import CHANNELS, PHASES, LeftOver

if TYPE_CHECKING:
    from studies.throws import Result

__all__ = ["add_left_over"]

NEAR = 0.03
"""Distance from the expected order within which a throw's loudest line counts as the wheel's turn; the wheel coasts for
some 0.09 s, which tells orders 0.05 apart."""

GYRO, ACCEL = range(3), range(3, 6)


def _widths(document: Document, result: Result) -> None:
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


def add_left_over(document: Document, result: Result) -> None:
    """Add the widths of what the extended model takes up, and the description of what it leaves."""
    document.section("What stays unexplained")
    _widths(document, result)
    left = result.extended.left
    document.table(
        ("body", "axis", "rms", "quiet", "peak [Hz]", *PHASES),
        [row for body, own in left.items() for row in _phase_rows(body, own)],
        "Residual of the samples under the extended model in all throws, on the axis of each sensor where it is "
        "largest relative to its noise in quiet stretches: root mean square in 0.001 rad/s (gyro) and 0.001 m/s² "
        "(accelerometer), over the flight and by phase of the wheel, and the loudest frequency above 10 Hz.",
        ["left", "left", *["right"] * 8],
    )
    document.figure(
        left_over_figure(left),
        "What is left, mean over throws. Left: amplitude of the residual of the samples; the bands are the recorded "
        "wheel's frequency where it idles. Right: amplitude of the raw accelerometer at multiples of the recorded "
        "wheel's frequency while it coasts at speed; the line is the loudest.",
    )
    document.table(
        ("body", "wheel [Hz]", "order", "throws", "axis", "there", "beside", "force [N]", "expected / seen by phase"),
        [_order_row(body, own, result) for body, own in left.items()],
        "Order tracking of the raw accelerometer while the wheel coasts: the recorded wheel's highest frequency, the "
        f"order of the loudest line, throws in which it is {POLE_PAIRS}/{result.pairs} ± {NEAR:g}, and on the axis "
        "where it is largest its amplitude there and half an order beside it [m/s²], and the force on the body's mass. "
        "Last: rms that an imbalance of this size leaves in the samples over the rms seen, in the phases "
        + ", ".join(PHASES)
        + ".",
        ["left", "right", "right", "right", "left", *["right"] * 3, "left"],
    )
    document.paragraph(_words(left, result.pairs))


def _phase_rows(body: str, left: LeftOver) -> list[list[str]]:
    rows = []
    for channels in (GYRO, ACCEL):
        worst = max(channels, key=lambda c: left.rms[c] / left.quiet[c])
        rows.append(
            [
                body,
                CHANNELS[worst],
                f"{1e3 * left.rms[worst]:.1f}",
                f"{1e3 * left.quiet[worst]:.1f}",
                f"{left.loudest(worst):.0f}",
                *(f"{1e3 * value:.1f}" for value in left.phase[:, worst]),
            ]
        )
    return rows


def _order_row(body: str, left: LeftOver, result: Result) -> list[str]:
    order, there, beside = left.turn
    axis = _shaken_axis(left)
    share = left.shaken[:, axis] / left.phase[:, axis]
    return [
        body,
        f"{left.wheel[1]:.0f}",
        f"{order:.2f}",
        f"{_following(left, result.pairs)} of {len(left.names)}",
        CHANNELS[axis][-1],
        f"{there[axis]:.2f}",
        f"{beside[axis]:.2f}",
        f"{result.masses[body] * there[axis]:.2f}",
        " / ".join(f"{value:.1f}" for value in share),
    ]


def _shaken_axis(left: LeftOver) -> int:
    """Return the axis of the accelerometer that the wheel shakes most."""
    return 3 + int(np.argmax(left.turn[1][3:]))


def _following(left: LeftOver, pairs: int) -> int:
    """Return in how many throws the loudest line below order 1.5 is the turn of a wheel with some pairs of poles."""
    return int((np.abs(left.peaks(_shaken_axis(left)) - POLE_PAIRS / pairs) < NEAR).sum())


def _words(left: Mapping[str, LeftOver], pairs: int) -> str:
    axes = {body: _shaken_axis(own) for body, own in left.items()}
    known = [own for body, own in left.items() if body in CALIBRATION]
    others = [own for body, own in left.items() if body not in CALIBRATION]
    counts = [
        f"{sum(_following(own, pairs) for own in of)} of {sum(len(own.names) for own in of)}" for of in (known, others)
    ]
    running = [own.shaken[1, axes[body]] / own.phase[1, axes[body]] for body, own in left.items()]
    loudest = [PHASES[int(np.nanargmax(own.phase[:, axes[body]]))] for body, own in left.items()]
    most = max(set(loudest), key=loudest.count)
    text = (
        f"The raw accelerometer is loudest at {POLE_PAIRS}/{pairs} of the recorded wheel's frequency, by the rule that "
        f"the calibration throws give: in {counts[0]} of these and in {counts[1]} throws of the bodies. The device is "
        "shaken by its wheel"
    )
    if pairs != POLE_PAIRS:
        text += (
            f", whose motor seems to have {pairs} pairs of poles and not the {POLE_PAIRS} that the source of the data "
            "states: it would turn more slowly than recorded. The inertias do not change, since the known box gives "
            "the wheel's momentum; the inertia of the wheel itself would be larger by the same factor"
        )
    return text + (
        f". The samples' residual is largest while the wheel is {most} on {loudest.count(most)} of {len(left)} bodies, "
        "where the wheel passes the frequencies that samples every 5 ms let through. An imbalance of this size would "
        f"leave {min(running):.1f} to {max(running):.1f} times what is seen while it runs up. The force differs "
        "between bodies, as that of one static imbalance would not."
    )
