"""Flights of ETS-VII in MuJoCo, and what its sensors record of them."""

from __future__ import annotations

import tempfile
from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from bayesid.recording.joint_motion import MeasuredMotion, Motion
from bayesid.recording.recording import Recording
from bayesid.robot.robot import Robot
from bayesid.simulation.model import Manoeuvre
from studies.common.ets7 import ACCELEROMETER, RADIUS
from studies.truth.motions import Motion as TrueMotion
from studies.truth.mujoco import Orbit, Rotor, Truth, TruthModel
from studies.truth.numerics import substeps
from studies.truth.recordings import by_axis

__all__ = ["ORBIT", "fly", "light_wheel", "prescribed", "readings", "record", "smoothed", "true_robot"]

Floats = NDArray[np.floating]

ORBIT = Orbit(radius=RADIUS)


def light_wheel(momentum: Floats) -> Rotor:
    """Return a wheel of given momentum [N m s], so light that the base with it at rest is the base without it."""
    x, y, z = momentum
    return Rotor((x, y, z), mass=1e-3, spin_inertia=1e-3)


def true_robot(robot: Robot, orbit: Orbit | None = ORBIT, **hidden: Any) -> TruthModel:
    """Return a robot in MuJoCo with the accelerometer of ETS-VII.

    Parameters
    ----------
    robot : Robot
    orbit : Orbit, optional
        Without one there is no gravity gradient.
    **hidden
        What else moves it, keywords of `studies.truth.mujoco.TruthModel`.
    """
    with tempfile.TemporaryDirectory() as folder:
        urdf = Path(folder) / "robot.urdf"
        robot.write_urdf(urdf)
        return TruthModel(urdf, orbit=orbit, accel_position=ACCELEROMETER, **hidden)


def prescribed(motion: Motion, times: Sequence[float] | Floats, step: float) -> TrueMotion:
    """Return a motion of the package as the simulator wants it, evaluated at once at all times that it will ask for.

    Parameters
    ----------
    motion : Motion
    times : (T,) array
        Times at which the robot will be read [s].
    step : float
        Largest integration step [s].
    """
    asked = {0.0, *map(float, times)}
    for start, stop in pairwise([0.0, *map(float, times)]):
        for now, size in substeps(start, stop, step):
            asked |= {now, now + 0.5 * size, now + size}
    instants = sorted(asked)
    states = dict(zip(instants, zip(*motion.evaluate(np.array(instants)), strict=True), strict=True))
    return lambda time: states[float(time)]


def fly(
    robot: Robot,
    motion: Motion,
    times: Sequence[float] | Floats,
    *,
    step: float,
    rate: ArrayLike = (0.0, 0.0, 0.0),
    attitude: ArrayLike = (0.0, 0.0, 0.0, 1.0),
    orbit: Orbit | None = ORBIT,
    **hidden: Any,
) -> Truth:
    """Fly a manoeuvre from time 0 and return what truly happened at the times.

    Parameters
    ----------
    robot : Robot
        The robot as it truly is.
    motion : Motion
        Motion of its joints.
    times : (T,) array
        Sample times [s].
    step : float
        Largest integration step [s].
    rate, attitude : (3,) and (4,) array_like
        Initial rate in base axes [rad/s] and quaternion x, y, z, w, base to orbit axes.
    orbit, **hidden
        See `true_robot`.
    """
    model = true_robot(robot, orbit, **hidden)
    return model.run(prescribed(motion, times, step), times, rate0=rate, attitude0=attitude, step=step)


def readings(
    truth: Truth,
    joints: Sequence[str],
    sigmas: Mapping[str, float],
    rng: np.random.Generator | None,
    *,
    by_channel: Collection[str] = ("position",),
) -> dict[str, Floats]:
    """Return channels of a recording.

    Parameters
    ----------
    truth : Truth
        What truly happened.
    joints : sequence of str
        Names of the joints.
    sigmas : mapping of str to float
        Family of channels (position, torque, rate, accel, attitude) -> noise per sample, in the order in which the
        noise is drawn.
    rng : numpy.random.Generator or None
        Source of the noise; there is none where left out.
    by_channel : collection of str
        Families whose noise is drawn channel after channel and not sample after sample. The studies differ in it, and
        their numbers with it.
    """
    channels: dict[str, Floats] = {}
    for family, sigma in sigmas.items():
        values = getattr(truth, family)
        names: Sequence[str] = joints if family in ("position", "torque") else "xyzw"[: values.shape[1]]
        if rng is not None and family == "attitude":
            turn = Rotation.from_rotvec(sigma * rng.standard_normal((len(values), 3)))
            values = (Rotation.from_quat(values) * turn).as_quat()
        elif rng is not None and family in by_channel:
            values = values + sigma * rng.standard_normal(values.T.shape).T
        elif rng is not None:
            values = values + sigma * rng.standard_normal(values.shape)
        channels |= by_axis(family, names, values)
    if np.any(truth.force) or np.any(truth.external_torque):
        channels |= by_axis("base_force", "xyz", truth.force) | by_axis("base_torque", "xyz", truth.external_torque)
    return channels


def smoothed(name: str, times: Floats, channels: Mapping[str, Floats], robot: Robot, encoder: float) -> Manoeuvre:
    """Return channels as a manoeuvre, its joints smoothed from their encoders' noise [rad].

    Parameters
    ----------
    name : str
        Name of the recording.
    times : (T,) array
        Sample times [s].
    channels : mapping
        See `readings`.
    robot : Robot
    encoder : float
        Noise of the joint positions.
    """
    recording = Recording(name, None, np.asarray(times), dict(channels))
    sigma: dict[int, float] = {0: encoder}
    return Manoeuvre(recording, MeasuredMotion.from_recording(recording, robot, sigma=sigma))


def record(
    truth: Truth, name: str, robot: Robot, sigmas: Mapping[str, float], rng: np.random.Generator | None, **options: Any
) -> Manoeuvre:
    """Record a flight with noise; see `readings` and `smoothed`."""
    joints = [joint.name for joint in robot.joints]
    channels = readings(truth, joints, sigmas, rng, **options)
    return smoothed(name, truth.times, channels, robot, sigmas["position"])
