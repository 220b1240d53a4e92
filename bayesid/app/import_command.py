"""Command ``bayesid import``, which makes a recording from a ROS bag."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bayesid.app.options import Output
from bayesid.recording.recording import WHEEL_SPEED

if TYPE_CHECKING:
    from bayesid.recording.bag_import import ImportedTopic

__all__ = ["run"]


def run(
    bag: Annotated[Path, typer.Argument(metavar="BAG", help="ROS 1 file (.bag) or ROS 2 folder.")],
    output: Output,
    joints: Annotated[
        list[str] | None, typer.Option(metavar="TOPIC", help="Joints, sensor_msgs/JointState; repeatable.")
    ] = None,
    wheels: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[NAMES=]TOPIC",
            help="Wheels: the velocities of a sensor_msgs/JointState, or a std_msgs/Float64 or Float64MultiArray, "
            "whose elements are named in a comma-separated list; repeatable.",
        ),
    ] = None,
    imu: Annotated[str | None, typer.Option(metavar="TOPIC", help="IMU of the base, sensor_msgs/Imu.")] = None,
    attitude: Annotated[
        str | None,
        typer.Option(
            metavar="TOPIC",
            help="Star tracker, geometry_msgs/QuaternionStamped, PoseStamped, PoseWithCovarianceStamped or "
            "TransformStamped, nav_msgs/Odometry or sensor_msgs/Imu.",
        ),
    ] = None,
    without: Annotated[list[str] | None, typer.Option(metavar="JOINT", help="Joint to omit; repeatable.")] = None,
    velocity: Annotated[
        bool,
        typer.Option(
            "--velocity", help="Import velocities in addition to positions, because they are measured separately."
        ),
    ] = False,
    effort: Annotated[bool, typer.Option("--effort", help="Import efforts as joint torques.")] = False,
    accel: Annotated[bool, typer.Option(help="Import the accelerations of the IMU.")] = True,
    start: Annotated[
        float, typer.Option(metavar="S", help="Start of the window, in seconds from the first stamp.")
    ] = 0.0,
    end: Annotated[
        float | None, typer.Option(metavar="S", help="End of the window, in seconds from the first stamp.")
    ] = None,
    duration: Annotated[
        float | None, typer.Option(metavar="S", help="Length of the window in seconds, instead of --end.")
    ] = None,
    most_faulty: Annotated[
        float,
        typer.Option(metavar="FRACTION", help="Largest fraction of a topic's messages that may be omitted as faulty."),
    ] = 0.02,
    recorded: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=VALUE",
            help="Convention of the recording that differs from the format, as a key of a study, such as "
            "joints.elbow.sign=-1 or sensors.rate.unit=deg/s; the readings are converted; repeatable.",
        ),
    ] = None,
) -> Iterator[str]:
    """Convert a ROS 1 or ROS 2 bag into a recording, NAME.csv, and document its origin in NAME.import.json."""
    from bayesid._io.errors import InputError
    from bayesid._io.files import complete_folder, write_json
    from bayesid.app.study_to_conventions import imported_as
    from bayesid.recording.bag_import import BagTopics, TimeWindow, import_bag
    from bayesid.recording.ros_bag import format_stamp

    conventions = tuple(recorded or ())

    window = TimeWindow.of_options(start, end, duration)
    selected = BagTopics(
        tuple(joints or ()),
        imu,
        attitude,
        tuple(without or ()),
        velocity,
        effort,
        accel,
        window,
        most_faulty,
        tuple(wheels or ()),
        any(key.startswith("sensors.accel.gravity") for key in conventions),
    )
    imported = import_bag(bag, selected)
    recording = imported.recording
    if velocity and not any(column.startswith("velocity.") for column in recording.channels):
        raise InputError(
            "the messages of the joints contain no velocities", file=bag, place="--velocity", remedy="Omit the option"
        )
    if conventions:
        recording = recording.converted(imported_as(conventions, recording.joints))
    file = output / f"{recording.name}.csv"
    with complete_folder(output) as folder:
        recording.write(folder / file.name)
        content = {
            "bag": str(bag),
            "file": file.name,
            "clock": "stamps of the headers",
            "stamp_of_time_0_ns": imported.start,
            "duration": float(recording.time[-1]),
            "joints": list(recording.joints),
            "recorded": list(conventions),
            "topics": [{**asdict(topic), "meaning": _meaning(topic)} for topic in imported.topics],
        }
        write_json(folder / f"{recording.name}.import.json", content)
    yield f"Time 0 is the stamp {format_stamp(imported.start)} s; the recording lasts {recording.time[-1]:.6g} s."
    whole = (start, end, duration) == (0.0, None, None)
    for topic in imported.topics:
        yield (
            f"{topic.name}: {topic.used} of {topic.messages} messages, interval {topic.interval:.4g} s, "
            f"longest gap {topic.longest_gap:.4g} s. {_faults(topic, whole)}{_meaning(topic)}"
        )
    yield f"Wrote {file}."


def _faults(topic: ImportedTopic, whole: bool) -> str:
    """Return what was left out of a topic and put in order; of the whole bag also what no joint accompanies."""
    left_out = dict(topic.left_out)
    outside = topic.messages - topic.used - sum(left_out.values())
    if whole and outside:
        left_out["before the first or after the last message of the joints"] = outside
    parts = [f"{count} {'message' if count == 1 else 'messages'} ({text})" for text, count in left_out.items()]
    text = f"Omitted: {'; '.join(parts)}. " if parts else ""
    return f"{text}Sorted by their stamps: {topic.reordered}. " if topic.reordered else text


def _meaning(topic: ImportedTopic) -> str:
    """Return units and axes of a topic in one sentence or two."""
    families = list(dict.fromkeys(column.partition(".")[0] for column in topic.columns))
    frame = f"frame '{topic.frame}'" if topic.frame else "a frame without a name"
    if "attitude" in families:
        return (
            f"Interpreted as the rotation from base axes to {frame}, which must be orbit axes: non-rotating, with x "
            "along the zenith at time 0 and z along the orbit normal."
        )
    if "rate" in families or "accel" in families:
        units = {"rate": "angular velocity in rad/s", "accel": "acceleration without gravity in m/s2"}
        quantities = " and ".join(units[family] for family in families)
        return f"Interpreted as {quantities}, in the axes of {frame}; the study states their mounting."
    if families == [WHEEL_SPEED]:
        return f"Interpreted as speed in rad/s of {', '.join(column.partition('.')[2] for column in topic.columns)}."
    units = {"position": "rad or m", "velocity": "rad/s or m/s", "torque": "N m or N"}
    joints = dict.fromkeys(column.partition(".")[2] for column in topic.columns)
    quantities = ", ".join(f"{family} in {units[family]}" for family in families)
    return f"Interpreted as {quantities} of {', '.join(joints)}."
