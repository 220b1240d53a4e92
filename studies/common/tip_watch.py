"""What the limits bound along a manoeuvre as MuJoCo flies it, not as the package simulates it."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from bayesid._math.arrays import Floats
from bayesid.recording.joint_motion import Motion
from bayesid.robot.robot import Robot
from studies.common.ets7 import TIP
from studies.common.flight import ORBIT, prescribed
from studies.truth.mujoco import TruthModel

__all__ = ["Flown", "flown_along"]

STEP = 0.2
"""Interval at which the robot is looked at, which is also the largest step of the integration [s]."""


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
    """Course of the limited quantities.

    Attributes
    ----------
    time : (T,) array
        Times [s].
    tip_speed, tip_rate : (T,) array
        Speed [m/s] and angular rate [rad/s] of the tip, the larger of those relative to the base and to inertial space,
        as in `bayesid.design.Limits`.
    base_rotation : (T,) array
        Rotation of the base since the start [rad].
    """

    time: Floats
    tip_speed: Floats
    tip_rate: Floats
    base_rotation: Floats

    def largest(self, name: str) -> float:
        """Return the largest value of a quantity, by the name of its limit."""
        return float(getattr(self, name).max())


def flown_along(robot: Robot, motion: Motion, duration: float) -> Flown:
    """Fly a manoeuvre from rest and return the course of the limited quantities."""
    with tempfile.TemporaryDirectory() as folder:
        urdf = Path(folder) / "robot.urdf"
        robot.write_urdf(urdf)
        model = _Watched(urdf, orbit=ORBIT)
        times = STEP * np.arange(round(duration / STEP) + 1)
        model.run(prescribed(motion, times, STEP), times, step=STEP)
    base, tip = np.array(model.base_poses), np.array(model.tip_poses)
    poses = tip, np.linalg.inv(base) @ tip
    speeds = [np.linalg.norm(np.gradient(pose[:, :3, 3], STEP, axis=0), axis=1) for pose in poses]
    rates = [np.append(0.0, _turns(pose[:-1], pose[1:]) / STEP) for pose in poses]
    rotation = _turns(np.broadcast_to(base[0], base.shape), base)
    return Flown(times, np.maximum(*speeds), np.maximum(*rates), rotation)


def _pose(rotation: Floats, position: Floats) -> Floats:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, position
    return pose


def _turns(before: Floats, after: Floats) -> Floats:
    """Return the angles between pairs of attitudes [rad]."""
    return np.asarray(Rotation.from_matrix(before[:, :3, :3].transpose(0, 2, 1) @ after[:, :3, :3]).magnitude())
