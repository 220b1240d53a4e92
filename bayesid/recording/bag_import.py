"""Recordings made from bags of ROS.

Time is that of the headers' stamps, from the first message of the joints. Every message keeps its own time and none is
interpolated, so that gaps stay gaps. Readings of the base before the first and after the last message of the joints are
left out, since nothing is known of the motion there. The topics of a bag must be stamped by one clock.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.recording.bag_channels import (
    ATTITUDES,
    IMU,
    JOINTS,
    attitude_channels,
    imu_channels,
    joint_channels,
    of_joints,
)
from bayesid.recording.recording import Recording
from bayesid.recording.ros_bag import StampedTopic, read_topics

__all__ = ["BagTopics", "ImportedBag", "ImportedTopic", "TimeWindow", "import_bag", "refuse_mixed_clocks"]

# difference of the stamps of two topics, against their arrival, from which on their clocks are others [s]; a slow
# telemetry stamps its samples once in a second
APART = 1.0


@dataclass(frozen=True)
class TimeWindow:
    """Part of a bag in seconds from the first stamp of all topics that are read; both ends belong to it.

    Parameters
    ----------
    start : float
        First instant [s].
    end : float, optional
        Last instant [s]; by default that of the bag.

    Raises
    ------
    InputError
        If it starts before the bag or has no length.
    """

    start: float = 0.0
    end: float | None = None

    def __post_init__(self) -> None:
        if not self.start >= 0.0:
            raise InputError(
                f"the window starts at {self.start:g} s, before the bag", remedy="Give --start in seconds from 0 on"
            )
        if self.end is not None and not self.end > self.start:
            problem = f"the window from {self.start:g} to {self.end:g} s is empty"
            raise InputError(problem, remedy="Give --end after --start, or a --duration above 0")

    @staticmethod
    def of_options(start: float, end: float | None, duration: float | None) -> TimeWindow:
        """Return the window from a start to an end or of a duration [s], of which one may be given."""
        if end is not None and duration is not None:
            raise InputError("both --end and --duration are given", remedy="Give one of them")
        return TimeWindow(start, start + duration if duration is not None else end)

    def of(self, topics: Mapping[str, StampedTopic]) -> dict[str, StampedTopic]:
        """Return the messages of topics in the window.

        Raises
        ------
        InputError
            If a topic has none.
        """
        first = min(int(topic.stamps[0]) for topic in topics.values())
        last = max(int(topic.stamps[-1]) for topic in topics.values())
        low = first + round(1e9 * self.start)
        high = last if self.end is None else first + round(1e9 * self.end)
        found = {name: topic.kept([low <= stamp <= high for stamp in topic.stamps]) for name, topic in topics.items()}
        for name, topic in found.items():
            if not topic.messages:
                raise topics[name].error(
                    f"it has no message from {self.start:g} to {(high - first) / 1e9:g} s",
                    remedy=f"Choose a window within the bag, which lasts {(last - first) / 1e9:.6g} s",
                )
        return found


@dataclass(frozen=True)
class BagTopics:
    """What to take from a bag.

    Parameters
    ----------
    joints : str
        Topic of the joints.
    imu, attitude : str, optional
        Topics of the base's sensors, at least one of them.
    without : sequence of str, optional
        Joints to leave out.
    velocity, effort : bool
        Whether to take the joints' velocities beside their positions, and their efforts.
    accel : bool
        Whether to take the accelerations of the IMU.
    window : TimeWindow
        Which part of the bag to take.
    """

    joints: str
    imu: str | None = None
    attitude: str | None = None
    without: Sequence[str] = ()
    velocity: bool = False
    effort: bool = False
    accel: bool = True
    window: TimeWindow = field(default_factory=TimeWindow)

    def __post_init__(self) -> None:
        named = [topic for topic in (self.joints, self.imu, self.attitude) if topic is not None]
        if len(named) < 2:
            raise InputError("no sensor of the base is named", remedy="Give --imu TOPIC, --attitude TOPIC or both")
        if len(set(named)) < len(named):
            raise InputError(f"one topic is named twice: {', '.join(named)}", remedy="Name a topic for each sensor")


@dataclass(frozen=True)
class ImportedTopic:
    """What became of a topic."""

    # name, type and frame of the topic
    name: str
    kind: str
    frame: str
    columns: tuple[str, ...]  # columns of the recording that hold it
    # number of messages in the bag, and of those in the recording
    messages: int
    used: int
    # median and longest time between the used messages [s]
    interval: float
    longest_gap: float


@dataclass(frozen=True)
class ImportedBag:
    """A recording made from a bag, the stamp of its time 0 [ns], and what became of the topics."""

    recording: Recording
    start: int
    topics: tuple[ImportedTopic, ...]


def import_bag(bag: Path, wanted: BagTopics) -> ImportedBag:
    """Return the recording of a bag.

    Raises
    ------
    InputError
        If the bag or a topic cannot be read, the topics are stamped by different clocks, a topic has no message in the
        window, a value is not finite, a joint is in some messages only, or the IMU feels gravity.
    """
    kinds = {wanted.joints: JOINTS, wanted.imu: IMU, wanted.attitude: ATTITUDES}
    whole = read_topics(bag, {name: allowed for name, allowed in kinds.items() if name is not None})
    refuse_mixed_clocks(list(whole.values()))
    read = wanted.window.of(whole)
    joints, names = of_joints(read[wanted.joints], wanted.without)
    found = [(joints, joint_channels(joints, names, velocity=wanted.velocity, effort=wanted.effort))]
    if wanted.imu is not None:
        imu = _during(joints, read[wanted.imu])
        found.append((imu, imu_channels(imu, accel=wanted.accel)))
    if wanted.attitude is not None:
        attitude = _during(joints, read[wanted.attitude])
        found.append((attitude, attitude_channels(attitude)))
    topics = tuple(_described(topic, channels, len(whole[topic.name].messages)) for topic, channels in found)
    return ImportedBag(_recording(bag, found), int(joints.stamps[0]), topics)


def _during(joints: StampedTopic, topic: StampedTopic) -> StampedTopic:
    """Return the messages of a topic from the first to the last of the joints."""
    inside = topic.kept([joints.stamps[0] <= stamp <= joints.stamps[-1] for stamp in topic.stamps])
    if not inside.messages:
        raise topic.error(f"it has no message during those of {joints.name}", remedy="Record both at the same time")
    return inside


def _recording(bag: Path, found: Sequence[tuple[StampedTopic, Mapping[str, Floats]]]) -> Recording:
    """Return a recording with one row for every stamp; a channel without a message then has no sample."""
    stamps = np.unique(np.concatenate([topic.stamps for topic, _ in found]))
    columns = {}
    for topic, channels in found:
        rows = np.searchsorted(stamps, topic.stamps)
        for name, values in channels.items():
            columns[name] = np.full(len(stamps), np.nan)
            columns[name][rows] = values
    try:
        return Recording(bag.stem, None, (stamps - stamps[0]) / 1e9, columns)
    except InputError as error:
        raise InputError(error.problem, file=bag, place=error.place, remedy=error.remedy) from None


def _described(topic: StampedTopic, channels: Mapping[str, Floats], messages: int) -> ImportedTopic:
    steps = np.diff(topic.stamps) / 1e9 if len(topic.stamps) > 1 else np.zeros(1)
    return ImportedTopic(
        name=topic.name,
        kind=topic.kind,
        frame=topic.frame,
        columns=tuple(channels),
        messages=messages,
        used=len(topic.messages),
        interval=float(np.median(steps)),
        longest_gap=float(steps.max()),
    )


def refuse_mixed_clocks(topics: Sequence[StampedTopic]) -> None:
    """Refuse topics whose stamps come from different clocks.

    All messages of a bag arrive on one clock. By how much stamps precede the arrival is a small delay, or, where the
    stamps are those of a simulation, the same function of time for every topic.

    Raises
    ------
    InputError
        If the stamps of a topic are far from those of the first at the same arrival, or they have no time in common.
    """
    reference = topics[0]
    for topic in topics[1:]:
        ahead = (topic.stamps - topic.arrivals) / 1e9
        expected = np.interp(
            (topic.arrivals - reference.arrivals[0]) / 1e9,
            (reference.arrivals - reference.arrivals[0]) / 1e9,
            (reference.stamps - reference.arrivals) / 1e9,
        )
        apart = float(np.median(ahead - expected))
        if abs(apart) > APART:
            raise _error(
                topic, f"its stamps are {abs(apart):.6g} s {'ahead of' if apart > 0 else 'behind'} those of", reference
            )
        if topic.stamps[-1] < reference.stamps[0] or topic.stamps[0] > reference.stamps[-1]:
            raise _error(topic, "it has no time in common with", reference)


def _error(topic: StampedTopic, problem: str, reference: StampedTopic) -> InputError:
    return topic.error(
        f"{problem} {reference.name}", remedy="Stamp all topics by one clock, either the computer's or the simulation's"
    )
