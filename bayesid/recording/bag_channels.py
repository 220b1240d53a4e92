"""Channels of a recording from the messages of a topic, in the order of its stamps."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.recording.recording import NORM_TOLERANCE
from bayesid.recording.ros_bag import StampedTopic

__all__ = ["ATTITUDES", "IMU", "JOINTS", "attitude_channels", "imu_channels", "joint_channels", "of_joints"]

JOINTS = ("sensor_msgs/JointState",)
IMU = ("sensor_msgs/Imu",)
ATTITUDES = ("geometry_msgs/QuaternionStamped", "geometry_msgs/PoseStamped")

GRAVITY = 9.80665  # standard gravity, the specific force of what rests on the ground [m/s2]
# relative difference of a median magnitude from that of gravity up to which it is gravity: no robot that is free
# accelerates so steadily, and gravity differs by 0.5 % over the Earth
NEAR = 0.05
NOT_MEASURED = -1.0  # first element of a covariance by which an IMU says that it does not measure the quantity

Channels = dict[str, Floats]


def of_joints(topic: StampedTopic, without: Sequence[str]) -> tuple[StampedTopic, tuple[str, ...]]:
    """Return the messages that hold joints, and the names of these, without those that are not wanted.

    Raises
    ------
    InputError
        If a joint is in some messages only or twice in one, or a joint that is not wanted is in none.
    """
    for row, message in enumerate(topic.messages):
        twice = [name for name, count in Counter(message.name).items() if count > 1]
        if twice:
            raise topic.error(f"joint {twice[0]!r} appears twice", message=row, remedy="Give every joint its own name")
    known = list(dict.fromkeys(name for message in topic.messages for name in message.name))
    for name in without:
        if name not in known:
            raise topic.error(f"there is no joint {name!r} to leave out", remedy=f"Joints here: {', '.join(known)}")
    names = tuple(name for name in known if name not in without)
    if not names:
        raise topic.error("no joint is left", remedy="Name a topic that holds the robot's joints")
    held = topic.kept([not set(names).isdisjoint(message.name) for message in topic.messages])
    counts = Counter(name for message in held.messages for name in message.name)
    rarest = min(names, key=lambda name: counts[name])
    if counts[rarest] < len(held.messages):
        raise held.error(
            f"joint {rarest!r} is in {counts[rarest]} of {len(held.messages)} messages only, here it is not",
            message=[rarest in message.name for message in held.messages].index(False),
            remedy=f"Record a topic that holds all joints at once, or leave it out: --without {rarest}",
        )
    return held, names


def joint_channels(topic: StampedTopic, names: Sequence[str], *, velocity: bool, effort: bool) -> Channels:
    """Return the positions of joints, their velocities where there are none or they are wanted, and wanted efforts."""
    channels = _joint_family(topic, names, "position", "position")
    if velocity or not channels:
        channels |= _joint_family(topic, names, "velocity", "velocity")
    if not channels:
        raise topic.error("its messages hold neither positions nor velocities", remedy="Name a topic that holds them")
    if effort:
        torques = _joint_family(topic, names, "effort", "torque")
        if not torques:
            raise topic.error("its messages hold no efforts", remedy="Leave --effort out")
        channels |= torques
    return channels


def _joint_family(topic: StampedTopic, names: Sequence[str], field: str, family: str) -> Channels:
    """Return a field of all messages by joint, or nothing where no message holds the field."""
    sizes = [len(getattr(message, field)) for message in topic.messages]
    if not any(sizes):
        return {}
    for row, (size, message) in enumerate(zip(sizes, topic.messages, strict=True)):
        if size != len(message.name):
            problem = f"{size} values of {field} for {len(message.name)} joints"
            raise topic.error(problem, message=row, remedy="Record one value for each joint in every message")

    def ordered(message: Any) -> list[float]:
        values: Mapping[str, float] = dict(zip(message.name, getattr(message, field), strict=True))
        return [values[name] for name in names]

    values = topic.numbers(ordered, f"{field} of {', '.join(names)}")
    return {f"{family}.{name}": values[:, column] for column, name in enumerate(names)}


def imu_channels(topic: StampedTopic, *, accel: bool) -> Channels:
    """Return angular velocity and, if wanted, acceleration of an IMU, unless it says that it does not measure them.

    Raises
    ------
    InputError
        If it measures neither, or the acceleration is that of gravity.
    """
    first = topic.messages[0]
    channels: Channels = {}
    if first.angular_velocity_covariance[0] != NOT_MEASURED:
        channels |= _vector(topic, "angular_velocity", "rate")
    if accel and first.linear_acceleration_covariance[0] != NOT_MEASURED:
        channels |= _vector(topic, "linear_acceleration", "accel")
        _refuse_gravity(topic, np.stack([channels[f"accel.{axis}"] for axis in "xyz"], axis=1))
    if not channels:
        problem = "its covariances say that it measures neither angular velocity nor acceleration"
        raise topic.error(problem, remedy="Name the topic of an IMU that does")
    return channels


def _vector(topic: StampedTopic, field: str, family: str) -> Channels:
    def components(message: Any) -> list[float]:
        vector = getattr(message, field)
        return [vector.x, vector.y, vector.z]

    values = topic.numbers(components, field)
    return {f"{family}.{axis}": values[:, column] for column, axis in enumerate("xyz")}


def _refuse_gravity(topic: StampedTopic, acceleration: Floats) -> None:
    median = float(np.median(np.linalg.norm(acceleration, axis=1)))
    unit = next((name for name, size in (("m/s2", GRAVITY), ("g", 1.0)) if abs(median / size - 1.0) < NEAR), None)
    if unit is None:
        return
    raise topic.error(
        f"the median magnitude of linear_acceleration is {median:.4g}, gravity in {unit}, which no free robot feels",
        remedy="Take a topic from which gravity is removed, in m/s2, or leave the accelerometer out: --no-accel",
    )


def attitude_channels(topic: StampedTopic) -> Channels:
    """Return the quaternions of a topic.

    Raises
    ------
    InputError
        If a quaternion's norm is not one.
    """

    def components(message: Any) -> list[float]:
        quaternion = message.quaternion if hasattr(message, "quaternion") else message.pose.orientation
        return [quaternion.x, quaternion.y, quaternion.z, quaternion.w]

    values = topic.numbers(components, "the quaternion")
    norm = np.linalg.norm(values, axis=1)
    off = np.abs(norm - 1.0) > NORM_TOLERANCE
    if off.any():
        row = int(np.argmax(off))
        raise topic.error(
            f"the quaternion's norm is {norm[row]:.6g}, not 1", message=row, remedy="Record unit quaternions"
        )
    return {f"attitude.{axis}": values[:, column] for column, axis in enumerate("xyzw")}
