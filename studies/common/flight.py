"""Flights of ETS-VII in MuJoCo: what its sensors record of them, and what they use of the limits of a design."""

from __future__ import annotations

import tempfile
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from bayesid._math.arrays import Floats
from bayesid.recording.joint_motion import MeasuredMotion, Motion
from bayesid.recording.recording import Recording
from bayesid.robot.robot import Robot
from bayesid.simulation.model import Manoeuvre
from studies.common.ets7 import ACCELEROMETER, RADIUS, TIP
from studies.truth.motions import Motion as TrueMotion
from studies.truth.mujoco import Orbit, Rotor, Truth, TruthModel
from studies.truth.numerics import substeps
from studies.truth.recordings import by_axis

ORBIT = Orbit(radius=RADIUS)

WATCH_STEP = 0.2  # interval at which the robot is looked at, which is also the largest step of the integration [s]


def light_wheel(momentum: Floats) -> Rotor:
    """Return a wheel of given momentum [N m s], so light that the base with it at rest is the base without it."""
    x, y, z = momentum
    return Rotor((x, y, z), mass=1e-3, spin_inertia=1e-3)


def true_robot(robot: Robot, orbit: Orbit | None = ORBIT, **hidden: Any) -> TruthModel:
    """Return a robot in MuJoCo with the accelerometer of ETS-VII.

    Parameters
    ----------
    robot : Robot
    orbit : Orbit, optional; without one there is no gravity gradient
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
    times : (T,) array; times at which the robot will be read [s]
    step : float; largest integration step [s]
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
    robot : Robot; the robot as it truly is
    motion : Motion; motion of its joints
    times : (T,) array; sample times [s]
    step : float; largest integration step [s]
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
    truth : Truth; what truly happened
    joints : sequence of str; names of the joints
    sigmas : mapping of str to float
        Family of channels (position, torque, rate, accel, attitude) -> noise per sample, in the order in which the
        noise is drawn.
    rng : numpy.random.Generator or None; source of the noise; there is none where left out
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
    name : str; name of the recording
    times : (T,) array; sample times [s]
    channels : mapping; see `readings`
    robot : Robot
    encoder : float; noise of the joint positions
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


class _Watched(TruthModel):
    """Robot in MuJoCo that notes the poses of base and tip whenever it is read."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.base_poses: list[Floats] = []
        self.tip_poses: list[Floats] = []

    def _read(self, *arguments: Any) -> tuple[Any, ...]:
        row: tuple[Any, ...] = super()._read(*arguments)
        w, x, y, z = self.data.qpos[3:7]
        body = self.data.body(TIP)
        self.base_poses.append(_pose(Rotation.from_quat([x, y, z, w]).as_matrix(), self.data.qpos[:3]))
        self.tip_poses.append(_pose(np.array(body.xmat).reshape(3, 3), body.xpos))
        return row


@dataclass(frozen=True)
class Flown:
    """Course of the limited quantities."""

    time: Floats  # (T,): times [s]
    # (T,): speed [m/s] and angular rate [rad/s] of the tip, the larger of those relative to the base and to inertial
    # space, as in `bayesid.design.Limits`
    tip_speed: Floats
    tip_rate: Floats
    base_rotation: Floats  # (T,): rotation of the base since the start [rad]

    def largest(self, name: str) -> float:
        """Return the largest value of a quantity, by the name of its limit."""
        return float(getattr(self, name).max())


def flown_along(robot: Robot, motion: Motion, duration: float) -> Flown:
    """Fly a manoeuvre from rest and return the course of the limited quantities."""
    with tempfile.TemporaryDirectory() as folder:
        urdf = Path(folder) / "robot.urdf"
        robot.write_urdf(urdf)
        model = _Watched(urdf, orbit=ORBIT)
        times = WATCH_STEP * np.arange(round(duration / WATCH_STEP) + 1)
        model.run(prescribed(motion, times, WATCH_STEP), times, step=WATCH_STEP)
    base, tip = np.array(model.base_poses), np.array(model.tip_poses)
    poses = tip, np.linalg.inv(base) @ tip
    speeds = [np.linalg.norm(np.gradient(pose[:, :3, 3], WATCH_STEP, axis=0), axis=1) for pose in poses]
    rates = [np.append(0.0, _turns(pose[:-1], pose[1:]) / WATCH_STEP) for pose in poses]
    rotation = _turns(np.broadcast_to(base[0], base.shape), base)
    return Flown(times, np.maximum(*speeds), np.maximum(*rates), rotation)


def _pose(rotation: Floats, position: Floats) -> Floats:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, position
    return pose


def _turns(before: Floats, after: Floats) -> Floats:
    return np.asarray(Rotation.from_matrix(before[:, :3, :3].transpose(0, 2, 1) @ after[:, :3, :3]).magnitude())
