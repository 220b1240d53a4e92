"""Manoeuvres flown in MuJoCo, and recorded with noise."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesid.design.designed import sample_times
from bayesid.recording.joint_motion import Motion
from bayesid.simulation.model import Manoeuvre
from studies.common import flight
from studies.common.ets7 import ACCEL, ENCODER, INTERVAL, RATE, ets7
from studies.truth.mujoco import Truth

__all__ = ["fly", "record"]

STEP = 0.25
"""Integration step of MuJoCo [s]."""


def fly(motion: Motion, duration: float, rate: NDArray[np.floating], **hidden: Any) -> Truth:
    """Fly a manoeuvre from an initial rate [rad/s] and return the true motion at the samples."""
    return flight.fly(ets7(), motion, sample_times(duration, INTERVAL), rate=rate, step=STEP, **hidden)


def record(truth: Truth, name: str, rng: np.random.Generator) -> Manoeuvre:
    """Record a flight with the noise that manoeuvres are designed for."""
    return flight.record(truth, name, ets7(), {"position": ENCODER, "rate": RATE, "accel": ACCEL}, rng)
