"""Manoeuvres flown by an independent simulator, and recorded with noise."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesid import Manoeuvre, MeasuredMotion, Recording, Robot
from bayesid.motion import Motion
from studies.ets7_limits.setting import ACCEL, ENCODER, INTERVAL, POINT, RADIUS, RATE
from studies.truth import mujoco as truth

__all__ = ["fly", "record"]

Floats = NDArray[np.floating]

STEP = 0.25
"""Of the independent simulator [s]."""


def fly(motion: Motion, duration: float, rate: Floats, **hidden: Any) -> Any:
    """Fly a manoeuvre from a given rate [rad/s] and return what truly happened at the samples.

    Parameters
    ----------
    **hidden
        What else acts, keywords of the simulator's ``TruthModel``: ``rotor``, ``fields``.
    """
    with tempfile.TemporaryDirectory() as folder:
        urdf = Path(folder) / "robot.urdf"
        Robot.shipped("ets7").write_urdf(urdf)
        model = truth.TruthModel(urdf, orbit=truth.Orbit(radius=RADIUS), accel_position=POINT, **hidden)
    time = np.arange(0.0, duration + 1e-9, INTERVAL)

    def joints(instant: float) -> tuple[Floats, Floats, Floats]:
        position, velocity, acceleration = motion.evaluate(np.array([instant]))
        return position[0], velocity[0], acceleration[0]

    return model.run(joints, time, rate0=rate, step=STEP)


def record(run: Any, name: str, rng: np.random.Generator, rate: float = RATE, accel: float = ACCEL) -> Manoeuvre:
    """Record a flight with noise per sample [rad/s, m/s2] and that of the joints."""
    robot = Robot.shipped("ets7")
    channels = {
        f"position.{joint.name}": run.position[:, k] + ENCODER * rng.standard_normal(len(run.times))
        for k, joint in enumerate(robot.joints)
    }
    for family, values, sigma in (("rate", run.rate, rate), ("accel", run.accel, accel)):
        noisy = values + sigma * rng.standard_normal(values.shape)
        channels |= {f"{family}.{axis}": noisy[:, k] for k, axis in enumerate("xyz")}
    recording = Recording(name, None, np.asarray(run.times), channels)
    sigmas: dict[int, float] = {0: ENCODER}
    return Manoeuvre(recording, MeasuredMotion.from_recording(recording, robot, sigma=sigmas))
