"""Picture of an import: the messages of a bag by their arrival, and the recording by their stamps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bayesid.recording.recording import Recording
from bayesid.report.figures.figure_style import AFTER, BEFORE, shared_legend, styled, wide_figure
from studies.manual.pictures.picture import Picture

STAMP = 1_700_000_000_000_000_000  # stamp of time 0 [ns]
DELAY = (0.2, 0.9)  # range of the delays until arrival [s]
SHOWN = (40.0, 55.0)  # part of the recording that is drawn [s]


def _arrivals(count: int) -> np.ndarray:
    return np.random.default_rng(0).uniform(*DELAY, count)


def write_bag(folder: Path) -> None:
    """Write the first manoeuvre of the demonstration as a bag of ROS 2, each message arriving with a delay."""
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    if (folder / "flight").exists():
        return
    recording = Recording.read(folder / "out" / "study" / "manoeuvre-1.csv")
    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = store.types
    zero, turned = np.zeros(9), kinds["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)

    def header(time: float, frame: str) -> Any:
        second, rest = divmod(STAMP + round(time * 1e9), 10**9)
        return kinds["std_msgs/msg/Header"](kinds["builtin_interfaces/msg/Time"](second, rest), frame)

    def vector(values: np.ndarray) -> Any:
        return kinds["geometry_msgs/msg/Vector3"](*map(float, values))

    messages = []
    time, position = recording.vector("position", recording.joints)
    _, rate = recording.vector("rate")
    _, accel = recording.vector("accel")
    rows = zip(time, position, rate, accel, _arrivals(len(time)), strict=True)
    empty = np.array([])
    for at, joints, turning, pushed, delay in rows:
        state = kinds["sensor_msgs/msg/JointState"](header(at, ""), list(recording.joints), joints, empty, empty)
        imu = kinds["sensor_msgs/msg/Imu"](header(at, "imu"), turned, zero, vector(turning), zero, vector(pushed), zero)
        messages += [(at + delay, "/joint_states", state), (at + delay, "/imu", imu)]
    with Writer(folder / "flight", version=8) as writer:
        topics = {
            topic: writer.add_connection(topic, kind, typestore=store)
            for topic, kind in (("/joint_states", "sensor_msgs/msg/JointState"), ("/imu", "sensor_msgs/msg/Imu"))
        }
        for arrival, topic, message in sorted(messages, key=lambda entry: entry[0]):
            kind = topics[topic].msgtype
            writer.write(topics[topic], STAMP + round(arrival * 1e9), store.serialize_cdr(message, kind))


@styled
def draw(folder: Path) -> Figure:
    """Draw the angle of a joint and a rate of the base, by the time of arrival and by the stamps."""
    recording = Recording.read(folder / "recordings" / "flight.csv")
    delay = _arrivals(len(recording.time))
    figure = wide_figure(2.1)
    for panel, name, factor, unit in zip(
        figure.subplots(1, 2), ("position.joint1", "rate.z"), (1.0, 1e3), ("rad", "mrad/s"), strict=True
    ):
        shown = (recording.time > SHOWN[0]) & (recording.time < SHOWN[1])
        values = factor * recording.channels[name][shown]
        arrived = (recording.time + delay)[shown]
        panel.plot(arrived, values, "x", color=BEFORE, markersize=3.5, label="by arrival (not used)")
        panel.plot(recording.time[shown], values, ".-", color=AFTER, markersize=3.5, label="by stamp, as imported")
        panel.set(title=f"{name}", xlabel="time [s]", ylabel=f"{name.partition('.')[0]} [{unit}]")
    shared_legend(figure, figure.axes[0], columns=2)
    return figure


def reading(folder: Path) -> str:
    """Return what the picture of the import states."""
    recording = Recording.read(folder / "recordings" / "flight.csv")
    channels = len(recording.channels)
    return (
        f"The messages arrive {DELAY[0]:g} to {DELAY[1]:g} s after they were measured (crosses), and not evenly. The "
        f"recording with its {channels} channels has the times of the header stamps (points), so its curves are "
        f"smooth. All {len(recording.time)} messages of each topic are in it."
    )


STEPS = (
    "bayesid demo --output out --samples 1000",
    write_bag,
    "bayesid import flight --joints /joint_states --imu /imu --output recordings",
)
PICTURE = Picture("bag", STEPS, (), draw, reading)
