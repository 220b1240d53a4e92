"""Bags of ROS 1 and ROS 2 written by rosbags from recordings, as a robot's drivers would have written them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from bayesid.recording.recording import Recording

FORMATS = ("ros1", "sqlite3", "mcap")
EPOCH = 1_700_000_000_250_000_000
"""Stamp of time 0 [ns]."""


@dataclass
class Sent:
    """One message: its time since the epoch [s], its delay until arrival [s], its type and its fields."""

    topic: str
    kind: str
    time: float
    fields: dict[str, Any]
    frame: str = ""
    delay: float = 0.0
    stamp: int | None = None
    """Stamp in place of that of the time [ns]."""


@dataclass
class BagWriter:
    """Bag of a recording, whose messages a test may change before it is written."""

    messages: list[Sent] = field(default_factory=list)

    @classmethod
    def of(cls, recording: Recording, rng: np.random.Generator) -> BagWriter:
        """Joints in alternating order, IMU and star sensor of a recording, all arriving with delays of their own."""
        made = cls()
        joints = recording.joints
        times, positions = recording.vector("position", joints)
        for row, (time, values) in enumerate(zip(times, positions, strict=True)):
            order = np.arange(len(joints))[:: 1 if row % 2 else -1]
            content = {"name": [joints[k] for k in order], "position": values[order], "velocity": [], "effort": []}
            made.add("/joint_states", "sensor_msgs/msg/JointState", time, content)
        rates = recording.vector("rate")
        _, accels = recording.vector("accel")
        for time, rate, accel in zip(*rates, accels, strict=True):
            made.add("/imu", "sensor_msgs/msg/Imu", time, imu(rate, accel), "imu_link")
        if "attitude.x" in recording.channels:
            for time, quaternion in zip(*recording.vector("attitude", "xyzw"), strict=True):
                made.add("/star", "geometry_msgs/msg/QuaternionStamped", time, {"quaternion": quaternion}, "orbit")
                pose = {"pose": ((1.0, 2.0, 3.0), quaternion)}
                made.add("/pose", "geometry_msgs/msg/PoseStamped", time, pose, "orbit")
                for topic, (kind, fields) in other_attitudes(quaternion).items():
                    made.add(topic, kind, time, fields, "orbit")
        for message in made.messages:
            message.delay = float(rng.uniform(0.1, 0.2))
        return made

    def add(self, topic: str, kind: str, time: float, fields: dict[str, Any], frame: str = "") -> None:
        self.messages.append(Sent(topic, kind, float(time), fields, frame))

    def on(self, topic: str) -> list[Sent]:
        return [message for message in self.messages if message.topic == topic]

    def write(self, folder: Path, kind: str, name: str = "flight") -> Path:
        """Write the bag in the order of arrival, and return its file or folder."""
        bag = folder / (f"{name}.bag" if kind == "ros1" else name)
        store = get_typestore(Stores.ROS1_NOETIC if kind == "ros1" else Stores.ROS2_HUMBLE)
        if kind == "ros1":
            writer, pack = Writer1(bag), store.serialize_ros1
        else:
            plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
            writer, pack = Writer2(bag, version=8, storage_plugin=plugin), store.serialize_cdr
        make = Maker(store.types)
        with writer:
            topics: dict[str, Any] = {}
            for message in sorted(self.messages, key=lambda sent: sent.time + sent.delay):
                if message.topic not in topics:
                    topics[message.topic] = writer.add_connection(message.topic, message.kind, typestore=store)
                arrival = EPOCH + round((message.time + message.delay) * 1e9)
                writer.write(topics[message.topic], arrival, pack(make.message(message), message.kind))
        return bag


@dataclass
class Maker:
    """Messages of a type store."""

    types: dict[str, Callable[..., Any]]

    def message(self, sent: Sent) -> Any:
        stamp = EPOCH + round(sent.time * 1e9) if sent.stamp is None else sent.stamp
        time = self.types["builtin_interfaces/msg/Time"](sec=stamp // 10**9, nanosec=stamp % 10**9)
        header = self.types["std_msgs/msg/Header"]
        seq = {"seq": 0} if "seq" in header.__dataclass_fields__ else {}
        fields = {key: self._value(sent.kind, key, value) for key, value in sent.fields.items()}
        if "header" in self.types[sent.kind].__dataclass_fields__:
            fields["header"] = header(stamp=time, frame_id=sent.frame, **seq)
        return self.types[sent.kind](**fields)

    def _value(self, kind: str, key: str, value: Any) -> Any:
        if key == "name":
            return list(value)
        if key in ("quaternion", "orientation"):
            return self._quaternion(value)
        if key == "data" and np.ndim(value) == 0:
            return float(value)
        if key == "child_frame_id":
            return value
        if key == "twist":
            zero = self.types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
            twist = self.types["geometry_msgs/msg/Twist"](linear=zero, angular=zero)
            return self.types["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=np.zeros(36))
        if key == "transform":
            shift = self.types["geometry_msgs/msg/Vector3"](*map(float, value[0]))
            return self.types["geometry_msgs/msg/Transform"](translation=shift, rotation=self._quaternion(value[1]))
        if key == "pose":
            point = self.types["geometry_msgs/msg/Point"](*map(float, value[0]))
            pose = self.types["geometry_msgs/msg/Pose"](position=point, orientation=self._quaternion(value[1]))
            if kind == "geometry_msgs/msg/PoseStamped":
                return pose
            return self.types["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=np.zeros(36))
        if key in ("angular_velocity", "linear_acceleration"):
            return self.types["geometry_msgs/msg/Vector3"](*map(float, value))
        return np.array(value, dtype=float)

    def _quaternion(self, value: Sequence[float]) -> Any:
        return self.types["geometry_msgs/msg/Quaternion"](*map(float, value))


def other_attitudes(quaternion: Sequence[float]) -> dict[str, tuple[str, dict[str, Any]]]:
    """The same attitude in messages of other types, by their topics."""
    placed = ((1.0, 2.0, 3.0), quaternion)
    filtered = {**imu((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), "orientation": quaternion}
    return {
        "/transform": ("geometry_msgs/msg/TransformStamped", {"child_frame_id": "base", "transform": placed}),
        "/covariance": ("geometry_msgs/msg/PoseWithCovarianceStamped", {"pose": placed}),
        "/odometry": ("nav_msgs/msg/Odometry", {"child_frame_id": "base", "pose": placed, "twist": None}),
        "/filtered": ("sensor_msgs/msg/Imu", filtered),
    }


def imu(rate: Sequence[float], accel: Sequence[float]) -> dict[str, Any]:
    covariance = np.zeros(9)
    return {
        "orientation": (0.0, 0.0, 0.0, 1.0),
        "orientation_covariance": covariance,
        "angular_velocity": rate,
        "angular_velocity_covariance": covariance,
        "linear_acceleration": accel,
        "linear_acceleration_covariance": covariance,
    }
