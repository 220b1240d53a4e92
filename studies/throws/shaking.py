"""Whether the accelerometer shakes with the wheel, in numbers and in words."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from studies.throws.data import CALIBRATION, POLE_PAIRS
from studies.throws.left_over import PHASES, LeftOver

__all__ = ["following", "shaken_axis", "shaking_words"]

NEAR = 0.03
"""Distance from the expected order within which a throw's loudest line counts as the wheel's turn; the wheel coasts for
some 0.09 s, which tells orders 0.05 apart."""


def shaken_axis(left: LeftOver) -> int:
    """Return the channel of the accelerometer that the wheel shakes most."""
    return 3 + int(np.argmax(left.turn[1][3:]))


def following(left: LeftOver, pairs: int) -> int:
    """Return in how many throws the loudest line below order 1.5 is the turn of a wheel with some pairs of poles."""
    return int((np.abs(left.peaks(shaken_axis(left)) - POLE_PAIRS / pairs) < NEAR).sum())


def shaking_words(left: Mapping[str, LeftOver], pairs: int) -> list[str]:
    """Return sentences on what shakes the device and when, for bodies of the calibration and others."""
    axes = {body: shaken_axis(own) for body, own in left.items()}
    known = [own for body, own in left.items() if body in CALIBRATION]
    others = [own for body, own in left.items() if body not in CALIBRATION]
    counts = [
        f"{sum(following(own, pairs) for own in of)} of {sum(len(own.names) for own in of)}" for of in (known, others)
    ]
    running = [own.shaken[1, axes[body]] / own.phase[1, axes[body]] for body, own in left.items()]
    loudest = [PHASES[int(np.nanargmax(own.phase[:, axes[body]]))] for body, own in left.items()]
    most = max(set(loudest), key=loudest.count)
    shaken = (
        f"The wheel shakes the device: the raw accelerometer is loudest at {POLE_PAIRS}/{pairs} of the recorded "
        f"wheel's frequency, a rule from the calibration throws ({counts[0]}) that {counts[1]} throws of the bodies "
        "keep"
    )
    if pairs != POLE_PAIRS:
        shaken += (
            f". The motor seems to have {pairs} pairs of poles and not the {POLE_PAIRS} that the source of the data "
            "states: it would turn more slowly than recorded. The inertias of bodies do not change, since the known "
            "box gives the wheel's momentum; that of the wheel itself would be larger by the same factor"
        )
    return [
        f"{shaken}.",
        f"The residual is largest while the wheel is {most} on {loudest.count(most)} of {len(left)} bodies, where it "
        "passes the frequencies that samples every 5 ms let through. An imbalance of the size seen would leave "
        f"{min(running):.1f} to {max(running):.1f} times as much there. Its force differs between bodies, which that "
        "of one static imbalance would not.",
    ]
