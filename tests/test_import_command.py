"""Bags of ROS 1 and ROS 2 become recordings: what was measured and when, or one clear error and nothing written."""

from __future__ import annotations

import json
import re
import sqlite3
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from bayesid.app.command_line import app
from bayesid.recording.recording import Recording
from studies.truth.bodies import SERVICER4
from studies.truth.mujoco import Manoeuvres, Sensors, write_study

pytest.importorskip("rosbags", reason="the extra ros is not installed")
from tests.ros_bags import FORMATS, BagWriter

TOPICS = ("--joints", "/joint_states", "--imu", "/imu")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A flight of the four-joint servicer in MuJoCo, with gaps and sensors that sample at different times."""
    made = write_study(
        tmp_path_factory.mktemp("flown"),
        SERVICER4,
        np.random.default_rng(11),
        sensors=Sensors(rate_period=0.2, accel_period=0.2, attitude_period=1.0, encoder_period=0.25),
        manoeuvres=Manoeuvres(count=1, duration=30.0, ramp=10.0),
        gaps={"position.joint1": [(10.0, 12.0)], "rate": [(20.0, 23.0)], "accel": [(20.0, 23.0)]},
    )
    return made.file.parent


@pytest.fixture(scope="module")
def robot(folder: Path) -> Path:
    return folder / "robot.urdf"


@pytest.fixture(scope="module")
def flown(folder: Path) -> Recording:
    """The recording of the flight."""
    read = Recording.read(folder / "manoeuvre-1.csv")
    # a message holds all joints or none
    present = np.isfinite(read.channels["position.joint1"])
    channels = {c: np.where(present, v, np.nan) if c.startswith("position") else v for c, v in read.channels.items()}
    return Recording("flight", None, read.time, channels)


@pytest.fixture
def writer(flown: Recording) -> BagWriter:
    return BagWriter.of(flown, np.random.default_rng(0))


def run(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(app, ["import", *map(str, arguments)])
    return result.exit_code, re.sub(r"\s+", " ", result.output)


def test_what_was_recorded_otherwise_is_converted(flown, writer, tmp_path):
    bag, output = writer.write(tmp_path, "mcap"), tmp_path / "out"
    remedies = ("--recorded", "joints.joint2.sign=-1", "--recorded", "sensors.accel.unit=g")
    status, said = run(bag, *TOPICS, *remedies, "--output", output)
    assert status == 0, said
    read, content = Recording.read(output / "flight.csv"), json.loads((output / "flight.import.json").read_text())
    assert content["recorded"] == [*remedies[1::2]]
    for column, factor in {"position.joint2": -1.0, "position.joint1": 1.0, "accel.x": 9.80665}.items():
        np.testing.assert_allclose(read.series(column)[1], factor * flown.series(column)[1], rtol=1e-9)


@pytest.mark.parametrize(
    ("kind", "attitude"),
    [
        *((kind, topic) for kind in FORMATS for topic in ("/star", "/pose")),
        *(("mcap", topic) for topic in ("/transform", "/covariance", "/odometry", "/filtered")),
    ],
)
def test_a_recording_comes_back_with_its_times_and_gaps(flown, writer, tmp_path, kind, attitude):
    bag = writer.write(tmp_path, kind)
    status, output = run(bag, *TOPICS, "--attitude", attitude, "--output", tmp_path / "out")
    assert status == 0, output
    assert sorted(item.name for item in (tmp_path / "out").iterdir()) == ["flight.csv", "flight.import.json"]
    read = Recording.read(tmp_path / "out" / "flight.csv")
    assert set(read.channels) == set(flown.channels)
    for column in flown.channels:
        times, values = flown.series(column)
        # header stamps count, not the arrival, which is up to 0.2 s later
        np.testing.assert_allclose(read.series(column)[0], times, atol=1e-8, err_msg=column)
        np.testing.assert_allclose(read.series(column)[1], values, rtol=1e-10, atol=1e-14, err_msg=column)


def test_a_bag_of_an_older_release_without_definitions_of_types_is_read(writer, tmp_path):
    bag = writer.write(tmp_path, "sqlite3")
    with sqlite3.connect(bag / "flight.db3") as database:
        database.execute("DELETE FROM message_definitions")
    database.close()
    status, output = run(bag, *TOPICS, "--output", tmp_path / "out")
    assert status == 0, output
    assert (tmp_path / "out" / "flight.csv").is_file()


def test_the_file_within_the_folder_of_a_bag_will_do(writer, tmp_path):
    bag = writer.write(tmp_path, "mcap")
    status, output = run(bag / "flight.mcap", *TOPICS, "--output", tmp_path / "out")
    assert status == 0, output
    assert Recording.read(tmp_path / "out" / "flight.csv").joints


@pytest.mark.parametrize("options", [("--start", 5.1, "--end", 14.9), ("--start", 5.1, "--duration", 9.8)])
def test_a_window_takes_its_own_part_of_the_bag(flown, writer, tmp_path, options):
    bag = writer.write(tmp_path, "ros1")
    status, output = run(bag, *TOPICS, *options, "--output", tmp_path / "out")
    assert status == 0, output
    read = Recording.read(tmp_path / "out" / "flight.csv")
    times, values = flown.series("rate.x")
    joint = flown.series("position.joint2")[0]
    origin = joint[joint >= 5.1][0]  # time 0 is the first message of the joints
    inside = (times >= origin) & (times <= joint[joint <= 14.9][-1])
    np.testing.assert_allclose(read.series("rate.x")[0], times[inside] - origin, atol=1e-8)
    np.testing.assert_allclose(read.series("rate.x")[1], values[inside], rtol=1e-10, atol=1e-14)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--start", 100.0), "it has no message from 100 to"),
        (("--start", 5.0, "--end", 4.0), "the window from 5 to 4 s is empty"),
        (("--duration", 0.0), "the window from 0 to 0 s is empty"),
        (("--start", -1.0), "the window starts at -1 s, before the bag"),
        (("--end", 4.0, "--duration", 2.0), "both --end and --duration are given"),
        (("--start", 20.5, "--end", 22.5), "it has no message"),
    ],
)
def test_a_window_without_messages_is_refused(writer, tmp_path, options, message):
    status, output = run(writer.write(tmp_path, "ros1"), *TOPICS, *options, "--output", tmp_path / "out")
    assert status == 2
    assert message in output
    assert not (tmp_path / "out").exists()


def test_a_drafted_study_of_an_imported_bag_passes_check(writer, robot, tmp_path, slow):
    bag = writer.write(tmp_path, "ros1")
    status, output = run(bag, *TOPICS, "--attitude", "/star", "--output", tmp_path / "out")
    assert status == 0, output
    for call in (
        ("init", robot, tmp_path / "out" / "flight.csv", "--output", tmp_path / "study.toml"),
        ("check", tmp_path / "study.toml", "--output", tmp_path / "check"),
    ):
        result = CliRunner().invoke(app, [str(word) for word in call])
        assert result.exit_code == 0, result.output


def test_where_a_recording_comes_from_is_stated(writer, tmp_path):
    bag = writer.write(tmp_path, "mcap")
    status, output = run(bag, *TOPICS, "--output", tmp_path / "out")
    assert status == 0, output
    assert "Time 0 is the stamp 1700000000.250000000 s" in output
    assert "in the axes of frame 'imu_link'" in output
    assert "longest gap 3.2 s" in output
    stated = json.loads((tmp_path / "out" / "flight.import.json").read_text())
    assert stated["stamp_of_time_0_ns"] == 1_700_000_000_250_000_000
    assert stated["clock"] == "stamps of the headers"
    assert sorted(stated["joints"]) == ["joint1", "joint2", "joint3", "joint4"]
    joints, imu = stated["topics"]
    assert joints["longest_gap"] == pytest.approx(2.5, abs=0.3)
    assert imu["kind"] == "sensor_msgs/Imu"
    assert "rad/s" in imu["meaning"]
    assert imu["frame"] == "imu_link"


def test_readings_outside_the_joints_messages_are_left_out_and_counted(writer, tmp_path):
    writer.messages = [m for m in writer.messages if m.topic != "/joint_states" or 5.0 <= m.time <= 25.0]
    status, output = run(writer.write(tmp_path, "ros1"), *TOPICS, "--output", tmp_path / "out")
    assert status == 0, output
    read = Recording.read(tmp_path / "out" / "flight.csv")
    assert read.time[-1] == pytest.approx(20.0)
    assert "86 of 136 messages" in output
    assert "Omitted: 50 messages (before the first or after the last message of the joints)." in output


def test_velocities_and_efforts_come_where_they_are_wanted(writer, tmp_path):
    for message in writer.on("/joint_states"):
        message.fields["velocity"] = 2.0 * message.fields["position"]
        message.fields["effort"] = 3.0 * message.fields["position"]
    bag = writer.write(tmp_path, "sqlite3")
    run(bag, *TOPICS, "--output", tmp_path / "plain")
    plain = Recording.read(tmp_path / "plain" / "flight.csv")
    assert not [column for column in plain.channels if column.startswith(("velocity", "torque"))]
    status, output = run(bag, *TOPICS, "--velocity", "--effort", "--output", tmp_path / "all")
    assert status == 0, output
    read = Recording.read(tmp_path / "all" / "flight.csv")
    for family, factor in (("velocity", 2.0), ("torque", 3.0)):
        for joint in plain.joints:
            expected = factor * read.series(f"position.{joint}")[1]
            np.testing.assert_allclose(read.series(f"{family}.{joint}")[1], expected, rtol=1e-9)


def test_velocities_that_are_not_there_are_an_error(writer, tmp_path):
    status, output = run(writer.write(tmp_path, "ros1"), *TOPICS, "--velocity", "--output", tmp_path / "out")
    assert status == 2
    assert "contain no velocities" in output
    assert not (tmp_path / "out").exists()


def test_joints_without_positions_are_recorded_by_speed(writer, tmp_path):
    for message in writer.on("/joint_states"):
        message.fields["velocity"], message.fields["position"] = message.fields["position"], []
    status, output = run(writer.write(tmp_path, "ros1"), *TOPICS, "--output", tmp_path / "out")
    assert status == 0, output
    read = Recording.read(tmp_path / "out" / "flight.csv")
    assert {c for c in read.channels if c.endswith("joint1")} == {"velocity.joint1"}


def with_gripper(writer: BagWriter) -> None:
    for message in writer.on("/joint_states")[1::3]:
        message.fields = dict(message.fields, name=["gripper"], position=[0.1])
        message.frame = "gripper"


def test_joints_of_two_publishers_keep_their_own_stamps(flown, writer, tmp_path):
    with_gripper(writer)
    status, output = run(writer.write(tmp_path, "mcap"), *TOPICS, "--output", tmp_path / "out")
    assert status == 0, output
    read = Recording.read(tmp_path / "out" / "flight.csv")
    assert sorted(read.joints) == ["gripper", "joint1", "joint2", "joint3", "joint4"]
    times = flown.series("position.joint1")[0]
    of_gripper = np.arange(len(times)) % 3 == 1
    np.testing.assert_allclose(read.series("position.joint1")[0], times[~of_gripper], atol=1e-8)
    np.testing.assert_allclose(read.series("position.gripper")[0], times[of_gripper], atol=1e-8)


def test_joints_of_two_topics_are_one_recording(flown, writer, tmp_path):
    for message in writer.on("/joint_states"):
        for topic, wanted in (("/left", ("joint1", "joint2")), ("/right", ("joint3", "joint4"))):
            own = [name in wanted for name in message.fields["name"]]
            fields = {
                **message.fields,
                "name": [n for n, take in zip(message.fields["name"], own, strict=True) if take],
            }
            fields["position"] = message.fields["position"][own]
            writer.add(topic, message.kind, message.time, fields, topic)
    bag = writer.write(tmp_path, "mcap")
    status, output = run(bag, "--joints", "/left", "--joints", "/right", "--imu", "/imu", "--output", tmp_path / "out")
    assert status == 0, output
    read = Recording.read(tmp_path / "out" / "flight.csv")
    for joint in flown.joints:
        np.testing.assert_allclose(read.series(f"position.{joint}")[1], flown.series(f"position.{joint}")[1], rtol=1e-9)
    status, output = run(bag, *TOPICS, "--joints", "/left", "--output", tmp_path / "both")
    assert status == 2
    assert "topic /left: the joint 'joint2' is also in /joint_states" in output


def test_a_bag_named_with_a_dot_keeps_its_name(writer, tmp_path):
    for name in ("run_0.1", "run_0.2"):
        status, output = run(writer.write(tmp_path, "sqlite3", name), *TOPICS, "--output", tmp_path / "out")
        assert status == 0, output
    assert sorted(item.name for item in (tmp_path / "out").glob("*.csv")) == ["run_0.1.csv", "run_0.2.csv"]


def test_a_joint_that_only_some_messages_hold_can_be_left_out(writer, tmp_path):
    with_gripper(writer)
    bag = writer.write(tmp_path, "mcap")
    status, output = run(bag, *TOPICS, "--without", "gripper", "--output", tmp_path / "out")
    assert status == 0, output
    read = Recording.read(tmp_path / "out" / "flight.csv")
    assert sorted(read.joints) == ["joint1", "joint2", "joint3", "joint4"]


def test_an_imu_that_measures_only_one_quantity_gives_only_that(writer, tmp_path):
    unknown = np.array([-1.0, *np.zeros(8)])
    for message in writer.on("/imu"):
        message.fields["linear_acceleration_covariance"] = unknown
    status, output = run(writer.write(tmp_path, "mcap"), *TOPICS, "--output", tmp_path / "out")
    assert status == 0, output
    assert "accel.x" not in Recording.read(tmp_path / "out" / "flight.csv").channels


def on_the_ground(writer: BagWriter) -> None:
    for message in writer.on("/imu"):
        message.fields["linear_acceleration"] = message.fields["linear_acceleration"] + [0.0, 0.0, 9.81]


def test_gravity_is_refused_unless_the_accelerometer_is_left_out(writer, tmp_path):
    on_the_ground(writer)
    bag = writer.write(tmp_path, "ros1")
    status, output = run(bag, *TOPICS, "--output", tmp_path / "out")
    assert status == 2
    assert "9.81" in output
    assert "--no-accel" in output
    assert not (tmp_path / "out").exists()
    status, output = run(bag, *TOPICS, "--no-accel", "--output", tmp_path / "out")
    assert status == 0, output
    assert "accel.x" not in Recording.read(tmp_path / "out" / "flight.csv").channels


def in_g(writer: BagWriter) -> None:
    for message in writer.on("/imu"):
        message.fields["linear_acceleration"] = [0.01, 0.0, 1.0]


def zero_stamps(writer: BagWriter) -> None:
    for message in writer.on("/imu"):
        message.stamp = 0


def other_clock(writer: BagWriter) -> None:
    for message in writer.on("/imu"):
        message.stamp = 5_000_000_000 + round(message.time * 1e9)


def slightly_other_clock(writer: BagWriter) -> None:
    for message in writer.on("/imu"):
        message.stamp = 1_700_000_003_000_000_000 + round(message.time * 1e9)


def repeated_stamp(writer: BagWriter) -> None:
    messages = writer.on("/imu")
    messages[8].stamp = 1_700_000_000_250_000_000 + round(messages[7].time * 1e9)
    messages[7].delay, messages[8].delay = 0.15, 0.15


def recorded_twice(writer: BagWriter) -> None:
    writer.messages.append(writer.on("/imu")[8])


def swapped(writer: BagWriter) -> None:
    messages = writer.on("/imu")
    messages[8].delay = messages[9].time - messages[8].time + messages[9].delay + 0.01


def first_stamps_zero(writer: BagWriter) -> None:
    for message in writer.on("/imu")[:2]:
        message.stamp = 0


def garbled_stamp(writer: BagWriter) -> None:
    writer.on("/imu")[20].stamp = 1_900_000_000_000_000_000


def clock_set_back(writer: BagWriter) -> None:
    for message in writer.on("/joint_states")[40:]:
        message.stamp = 1_700_000_000_250_000_000 + round((message.time - 9.0) * 1e9)


def not_a_number(writer: BagWriter) -> None:
    writer.on("/joint_states")[3].fields["position"][1] = np.nan


def infinite_rate(writer: BagWriter) -> None:
    writer.on("/imu")[5].fields["angular_velocity"] = [0.0, np.inf, 0.0]


def short_position(writer: BagWriter) -> None:
    writer.on("/joint_states")[6].fields["position"] = [0.1, 0.2]


def joint_twice(writer: BagWriter) -> None:
    writer.on("/joint_states")[6].fields["name"] = ["joint1", "joint1", "joint2", "joint3"]


def half_lost(writer: BagWriter) -> None:
    for message in writer.on("/joint_states")[::2]:
        message.fields["position"] = np.where(
            [name == "joint2" for name in message.fields["name"]], np.nan, message.fields["position"]
        )


def moved_frame(writer: BagWriter) -> None:
    writer.on("/imu")[-1].frame = "other_imu"


def measures_nothing(writer: BagWriter) -> None:
    for message in writer.on("/imu"):
        for key in ("linear_acceleration_covariance", "angular_velocity_covariance"):
            message.fields[key] = np.array([-1.0, *np.zeros(8)])


def no_unit_quaternion(writer: BagWriter) -> None:
    writer.on("/star")[2].fields["quaternion"] = [0.0, 0.0, 0.0, 0.0]


def imu_elsewhere(writer: BagWriter) -> None:
    writer.messages = [
        m for m in writer.messages if (m.topic == "/imu" and m.time > 15.0) or (m.topic != "/imu" and m.time < 12.0)
    ]


@pytest.mark.parametrize(
    ("spoil", "topic", "lost", "words"),
    [
        (repeated_stamp, "/imu", 8, "1 message (its stamp repeats that of another message)"),
        (recorded_twice, "/imu", None, "1 message (recorded twice)"),
        (swapped, "/imu", None, "Sorted by their stamps: 1."),
        (first_stamps_zero, "/imu", None, "2 messages (the stamp of the header is zero)"),
        (garbled_stamp, "/imu", 20, "s later than the stamps around it"),
        (not_a_number, "/joint_states", 3, "1 message (position of joint2 is nan, not finite)"),
        (infinite_rate, "/imu", 5, "1 message (angular_velocity is 0, inf, 0, not finite)"),
        (short_position, "/joint_states", 6, "1 message (2 values of position for 4 joints)"),
        (joint_twice, "/joint_states", 6, "1 message (joint 'joint1' appears twice)"),
    ],
)
def test_single_faulty_messages_are_left_out_and_counted(flown, writer, tmp_path, spoil, topic, lost, words):
    clean = writer.write(tmp_path, "mcap", "clean")
    run(clean, *TOPICS, "--output", tmp_path / "out")
    spoil(writer)
    status, output = run(writer.write(tmp_path, "mcap"), *TOPICS, "--output", tmp_path / "out")
    assert status == 0, output
    assert words in output
    column = "rate.x" if topic == "/imu" else "position.joint1"
    known, read = (Recording.read(tmp_path / "out" / f"{name}.csv").series(column) for name in ("clean", "flight"))
    places = np.arange(len(known[0]))
    kept = places >= 2 if spoil is first_stamps_zero else places != lost
    for there, here in zip(known, read, strict=True):
        np.testing.assert_allclose(here, there[kept], rtol=1e-9, atol=1e-9)
    # a window that the fault lies outside does not see it
    status, output = run(tmp_path / "flight", *TOPICS, "--start", 9.0, "--output", tmp_path / "later")
    assert status == 0, output
    assert "Omitted" not in output
    assert "Sorted" not in output


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (in_g, ("/imu", "gravity in g", "m/s2")),
        (zero_stamps, ("/imu", "message 1", "stamp of the header is zero", "136 such messages")),
        (other_clock, ("/imu", "behind those of /joint_states", "the same clock")),
        (slightly_other_clock, ("/imu", "2.7", "ahead of those of /joint_states")),
        (clock_set_back, ("/joint_states", "of 113 messages are faulty", "--most-faulty")),
        (half_lost, ("/joint_states", "message 1", "joint2 is nan", "57 of 113 messages are faulty", "--most-faulty")),
        (moved_frame, ("/imu", "'imu_link', 'other_imu'")),
        (measures_nothing, ("/imu", "neither angular velocity nor acceleration")),
        (no_unit_quaternion, ("/star", "message 3", "norm is 0", "1 of 31 messages are faulty")),
        (imu_elsewhere, ("/imu", "does not overlap in time with /joint_states")),
    ],
)
def test_messages_that_make_no_recording_are_refused(
    writer: BagWriter, tmp_path: Path, spoil: Callable[[BagWriter], None], words: tuple[str, ...]
) -> None:
    spoil(writer)
    bag = writer.write(tmp_path, "mcap")
    status, output = run(bag, *TOPICS, "--attitude", "/star", "--output", tmp_path / "out")
    assert status == 2, output
    assert all(word in output for word in (str(bag), *words)), output
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--joints", "/arm", "--imu", "/imu"), ("topic /arm", "no such topic", "Of the right type: /joint_states")),
        (("--joints", "/imu", "--attitude", "/star"), ("its messages are sensor_msgs/Imu", "sensor_msgs/JointState")),
        (("--joints", "/joint_states"), ("no sensor of the base is named", "--imu")),
        (("--joints", "/joint_states", "--imu", "/joint_states"), ("one topic is named twice",)),
        ((*TOPICS, "--without", "hand"), ("no joint 'hand' to omit", "joint1")),
        ((*TOPICS, "--effort"), ("contain no efforts", "--effort")),
    ],
)
def test_wrong_topics_are_refused(writer, tmp_path, arguments, words):
    status, output = run(writer.write(tmp_path, "sqlite3"), *arguments, "--output", tmp_path / "out")
    assert status == 2, output
    assert all(word in output for word in words), output
    assert not (tmp_path / "out").exists()


def truncated(bag: Path) -> None:
    bag.write_bytes(bag.read_bytes()[:2000])


def no_metadata(bag: Path) -> None:
    (bag / "metadata.yaml").unlink()


@pytest.mark.parametrize(("kind", "damage"), [("ros1", truncated), ("mcap", no_metadata)])
def test_a_damaged_bag_is_refused(writer, tmp_path, kind, damage):
    bag = writer.write(tmp_path, kind)
    damage(bag)
    status, output = run(bag, *TOPICS, "--output", tmp_path / "out")
    assert status == 2, output
    assert "cannot be read as a bag" in output


def test_an_absent_bag_is_refused(tmp_path):
    status, output = run(tmp_path / "none.bag", *TOPICS, "--output", tmp_path / "out")
    assert status == 2
    assert "there is no such bag" in output


def test_without_the_extra_the_error_names_it(writer, tmp_path, monkeypatch):
    bag = writer.write(tmp_path, "ros1")
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    status, output = run(bag, *TOPICS, "--output", tmp_path / "out")
    assert status == 2
    assert "extra `ros`" in output


def test_speeds_of_wheels_come_from_joint_states_and_from_plain_numbers(flown, writer, tmp_path):
    """Numbers without a header have the time of their arrival; a name that a topic of joints holds is no joint then."""
    for k, time in enumerate(np.arange(0.0, 30.0, 0.5)):
        both = {"name": ["w1", "w2"], "position": [], "velocity": [10.0 + k, -float(k)], "effort": []}
        writer.add("/wheels", "sensor_msgs/msg/JointState", time, both)
        writer.add("/third", "std_msgs/msg/Float64", time, {"data": 3.0 * k})
    bag = writer.write(tmp_path, "ros1")
    wheels = "--wheels", "/wheels", "--wheels", "w3=/third"
    status, output = run(bag, *TOPICS, *wheels, "--output", tmp_path / "out")
    assert status == 0, output
    assert "Interpreted as speed in rad/s of w1, w2." in output
    read = Recording.read(tmp_path / "out" / "flight.csv")
    assert read.wheels == ("w1", "w2", "w3")
    assert set(read.joints) == set(flown.joints)
    for name, slope, first in (("w1", 1.0, 10.0), ("w2", -1.0, 0.0), ("w3", 3.0, 0.0)):
        times, speed = read.series(f"wheel_speed.{name}")
        np.testing.assert_allclose(speed, first + slope * np.arange(60))
        np.testing.assert_allclose(times, np.arange(0.0, 30.0, 0.5), atol=1e-8)
    status, output = run(bag, "--imu", "/imu", "--wheels", "a,b=/third", "--output", tmp_path / "other")
    assert status == 2
    assert "2 names for messages of 1 elements" in output
