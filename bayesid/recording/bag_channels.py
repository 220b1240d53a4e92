"""Channels of a recording from the messages of a topic, in the order of its stamps."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from bayesid._math.arrays import Floats, Integers
from bayesid.recording.recording import NORM_TOLERANCE, WHEEL_SPEED
from bayesid.recording.ros_bag import StampedTopic

__all__ = [
    "ATTITUDES",
    "IMU",
    "JOINTS",
    "WHEELS",
    "Channels",
    "attitude_channels",
    "attitude_fault",
    "imu_channels",
    "imu_fault",
    "joint_channels",
    "joint_fault",
    "joint_names",
    "wheel_channels",
    "wheel_fault",
]

JOINTS = ("sensor_msgs/JointState",)
WHEELS = (*JOINTS, "std_msgs/Float64", "std_msgs/Float64MultiArray")
IMU = ("sensor_msgs/Imu",)
ATTITUDES = (
    "geometry_msgs/QuaternionStamped",
    "geometry_msgs/PoseStamped",
    "geometry_msgs/PoseWithCovarianceStamped",
    "geometry_msgs/TransformStamped",
    "nav_msgs/Odometry",
    "sensor_msgs/Imu",
)

GRAVITY = 9.80665  # standard gravity, the specific force of what rests on the ground [m/s2]
# relative difference of a median magnitude from that of gravity up to which it is gravity: no robot that is free
# accelerates so steadily, and gravity differs by 0.5 % over the Earth
NEAR = 0.05
NOT_MEASURED = -1.0  # first element of a covariance by which an IMU says that it does not measure the quantity

Channels = dict[str, tuple[Integers, Floats]]
"""Stamps [ns] and values of each channel, shapes (n,)."""


def joint_fault(message: Any) -> str | None:
    """Return what is wrong with a message of joints: one named twice, values that are missing or not finite."""
    twice = [name for name, count in Counter(message.name).items() if count > 1]
    if twice:
        return f"joint {twice[0]!r} appears twice"
    for family in ("position", "velocity", "effort"):
        values = getattr(message, family)
        if len(values) not in (0, len(message.name)):
            return f"{len(values)} values of {family} for {len(message.name)} joints"
        for name, value in zip(message.name, values, strict=False):
            if family == "position" and not np.isfinite(value):
                return f"{family} of {name} is {value:g}, not finite"
    return None


def joint_names(
    topics: Sequence[StampedTopic], without: Sequence[str], wheels: Collection[str] = ()
) -> tuple[str, ...]:
    """Return the names of the joints of all topics, less those that are not wanted.

    Parameters
    ----------
    topics : sequence of StampedTopic
    without : sequence of str
        Joints to leave out.
    wheels : collection of str
        Wheels, which are no joints where a topic holds both.

    Raises
    ------
    InputError
        If a joint to leave out is in no topic, none is left, or one is in several topics.
    """
    of_topic = [dict.fromkeys(name for message in topic.messages for name in message.name) for topic in topics]
    known = list(dict.fromkeys(name for names in of_topic for name in names))
    for name in without:
        if name not in known:
            raise topics[0].error(f"there is no joint {name!r} to omit", remedy=f"Joints here: {', '.join(known)}")
    names = tuple(name for name in known if name not in {*without, *wheels})
    if not names:
        raise topics[0].error("no joint remains", remedy="Name a topic that contains the robot's joints")
    for name in names:
        holders = [topic for topic, in_topic in zip(topics, of_topic, strict=True) if name in in_topic]
        if len(holders) > 1:
            raise holders[1].error(
                f"the joint {name!r} is also in {holders[0].name}",
                remedy=f"Name one of these topics, or omit the joint: --without {name}",
            )
    return names


def joint_channels(topic: StampedTopic, names: Sequence[str], *, velocity: bool, effort: bool) -> Channels:
    """Return the joints of a topic, each at the stamps of the messages that hold it.

    Parameters
    ----------
    topic : StampedTopic
    names : sequence of str
        Joints that are wanted.
    velocity, effort : bool
        Whether to take velocities beside positions, and efforts; velocities are taken where there are no positions.
    """
    channels = _joint_family(topic, names, "position", "position")
    if velocity or not channels:
        channels |= _joint_family(topic, names, "velocity", "velocity")
    if not channels:
        raise topic.error(
            "its messages contain neither positions nor velocities", remedy="Name a topic that contains them"
        )
    if effort:
        torques = _joint_family(topic, names, "effort", "torque")
        if not torques:
            raise topic.error("its messages contain no efforts", remedy="Omit --effort")
        channels |= torques
    return channels


def _joint_family(topic: StampedTopic, names: Sequence[str], field: str, family: str) -> Channels:
    """Return a field of all messages by joint, or nothing where no message holds the field."""
    samples: dict[str, list[tuple[int, float]]] = {}
    for stamp, message in zip(topic.stamps, topic.messages, strict=True):
        for name, value in zip(message.name, getattr(message, field), strict=False):
            if name in names and np.isfinite(value):
                samples.setdefault(f"{family}.{name}", []).append((int(stamp), float(value)))
    channels = {}
    for channel, pairs in samples.items():
        stamps, rows = np.unique([stamp for stamp, _ in pairs], return_index=True)
        channels[channel] = stamps, np.array([value for _, value in pairs])[rows]
    return channels


def wheel_fault(message: Any) -> str | None:
    """Return what is wrong with a message of wheels: another number of velocities than of names."""
    names, speeds = getattr(message, "name", None), getattr(message, "velocity", None)
    if names is None or speeds is None or len(speeds) == len(names):
        return None
    return f"{len(speeds)} velocities for {len(names)} wheels"


def wheel_channels(topic: StampedTopic, names: Sequence[str]) -> Channels:
    """Return the speeds of wheels in a topic.

    Parameters
    ----------
    topic : StampedTopic
    names : sequence of str
        Wheels that are wanted of those that the messages name, or names of the elements where they name none.

    Raises
    ------
    InputError
        If a name is not there, or the messages have no names and other numbers of elements.
    """
    if topic.kind in JOINTS:
        known = dict.fromkeys(name for message in topic.messages for name in message.name)
        for name in names:
            if name not in known:
                raise topic.error(f"there is no wheel {name!r}", remedy=f"Names here: {', '.join(known)}")
        return _joint_family(topic, names or tuple(known), "velocity", WHEEL_SPEED)
    rows = [np.atleast_1d(np.asarray(message.data, dtype=float)) for message in topic.messages]
    if {len(row) for row in rows} != {len(names)}:
        remedy = f"Name each element: --wheels NAME,NAME={topic.name}"
        raise topic.error(f"{len(names)} names for messages of {len(rows[0])} elements", remedy=remedy)
    return {
        f"{WHEEL_SPEED}.{name}": (topic.stamps, column) for name, column in zip(names, np.array(rows).T, strict=True)
    }


def imu_channels(topic: StampedTopic, *, accel: bool, gravity: bool = False) -> Channels:
    """Return angular velocity and, if wanted, acceleration of an IMU, unless it says that it does not measure them.

    Parameters
    ----------
    topic : StampedTopic
    accel : bool
        Whether the acceleration is wanted.
    gravity : bool
        Whether it is known to hold gravity.

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
        if not gravity:
            _refuse_gravity(topic, np.stack([channels[f"accel.{axis}"][1] for axis in "xyz"], axis=1))
    if not channels:
        problem = "its covariances indicate that it measures neither angular velocity nor acceleration"
        raise topic.error(problem, remedy="Name the topic of an IMU that does")
    return channels


def imu_fault(message: Any) -> str | None:
    """Return what is wrong with a message of an IMU: a vector that is not finite."""
    for name in ("angular_velocity", "linear_acceleration"):
        values = _components(message, name)
        if not np.isfinite(values).all():
            return f"{name} is {', '.join(f'{value:g}' for value in values)}, not finite"
    return None


def _components(message: Any, name: str) -> list[float]:
    vector = getattr(message, name)
    return [vector.x, vector.y, vector.z]


def _vector(topic: StampedTopic, name: str, family: str) -> Channels:
    values = np.array([_components(message, name) for message in topic.messages])
    return {f"{family}.{axis}": (topic.stamps, values[:, column]) for column, axis in enumerate("xyz")}


def _refuse_gravity(topic: StampedTopic, acceleration: Floats) -> None:
    median = float(np.median(np.linalg.norm(acceleration, axis=1)))
    unit = next((name for name, size in (("m/s2", GRAVITY), ("g", 1.0)) if abs(median / size - 1.0) < NEAR), None)
    if unit is None:
        return
    raise topic.error(
        f"the median magnitude of linear_acceleration is {median:.4g}, gravity in {unit}; a free robot measures none",
        remedy="Use a topic from which gravity is removed, in m/s2, or omit the accelerometer: --no-accel",
    )


def attitude_fault(message: Any) -> str | None:
    """Return what is wrong with a message that holds an attitude: a quaternion that is none."""
    norm = float(np.linalg.norm(_quaternion(message)))
    return None if abs(norm - 1.0) <= NORM_TOLERANCE else f"the quaternion's norm is {norm:.6g}, not 1"


def attitude_channels(topic: StampedTopic) -> Channels:
    """Return the quaternions of a topic.

    Raises
    ------
    InputError
        If they are those of an IMU that says that it does not measure its attitude.
    """
    first = topic.messages[0]
    if getattr(first, "orientation_covariance", (0.0,))[0] == NOT_MEASURED:
        raise topic.error(
            "its covariance indicates that it does not measure the orientation",
            remedy="Name the topic of a sensor that does",
        )
    values = np.array([_quaternion(message) for message in topic.messages])
    return {f"attitude.{axis}": (topic.stamps, values[:, column]) for column, axis in enumerate("xyzw")}


def _quaternion(message: Any) -> list[float]:
    """Return x, y, z, w of a message of one of `ATTITUDES`."""
    inner = getattr(message, "pose", None) or getattr(message, "transform", None) or message
    inner = getattr(inner, "pose", inner)  # of a pose with covariance
    quaternion = next(
        getattr(inner, name) for name in ("quaternion", "orientation", "rotation") if hasattr(inner, name)
    )
    return [quaternion.x, quaternion.y, quaternion.z, quaternion.w]
