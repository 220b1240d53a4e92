"""Recordings made from bags of ROS.

Time is that of the headers' stamps, from the first message of the joints. Every message keeps its own time and none is
interpolated, so that gaps stay gaps. Readings of the base before the first and after the last message of the joints are
left out, since nothing is known of the motion there. Single faulty messages are left out and counted. The topics of a
bag must be stamped by one clock.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.recording.bag_channels import (
    ATTITUDES,
    IMU,
    JOINTS,
    WHEELS,
    Channels,
    attitude_channels,
    attitude_fault,
    imu_channels,
    imu_fault,
    joint_channels,
    joint_fault,
    joint_names,
    wheel_channels,
    wheel_fault,
)
from bayesid.recording.recording import Recording
from bayesid.recording.ros_bag import StampedTopic, read_topics

__all__ = ["BagTopics", "ImportedBag", "ImportedTopic", "TimeWindow", "import_bag"]

# share of a topic's messages that are left out without asking
MOST_FAULTY = 0.02

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
                f"the window starts at {self.start:g} s, before the bag", remedy="Give --start in seconds, 0 or later"
            )
        if self.end is not None and not self.end > self.start:
            problem = f"the window from {self.start:g} to {self.end:g} s is empty"
            raise InputError(problem, remedy="Give --end after --start, or a --duration above 0")

    @staticmethod
    def of_options(start: float, end: float | None, duration: float | None) -> TimeWindow:
        """Return the window from a start to an end or of a duration [s], of which one may be given.

        Parameters
        ----------
        start : float
            First instant, from the first stamp [s].
        end : float or None
            Last instant, from the first stamp [s].
        duration : float or None
            Length from the start [s].
        """
        if end is not None and duration is not None:
            raise InputError("both --end and --duration are given", remedy="Give one of them")
        return TimeWindow(start, start + duration if duration is not None else end)

    def of(self, topics: Sequence[StampedTopic]) -> tuple[int, int]:
        """Return the first and last stamp of the window [ns].

        Raises
        ------
        InputError
            If a topic has no message in it.
        """
        stamps = [topic.stamps[topic.stamps > 0] for topic in topics]
        if not all(map(len, stamps)):
            topic = topics[[len(times) for times in stamps].index(0)]
            problem = f"the stamp of the header is zero ({len(topic.messages)} such messages)"
            remedy = "Configure the driver to stamp its messages; arrival times are no substitute"
            raise topic.error(problem, message=0, remedy=remedy)
        first = min(int(times.min()) for times in stamps)
        last = max(int(times.max()) for times in stamps)
        low = first + round(1e9 * self.start)
        high = last if self.end is None else first + round(1e9 * self.end)
        for topic, times in zip(topics, stamps, strict=True):
            if not ((times >= low) & (times <= high)).any():
                raise topic.error(
                    f"it has no message from {self.start:g} to {(high - first) / 1e9:g} s",
                    remedy=f"Choose a window within the bag, which lasts {(last - first) / 1e9:.6g} s",
                )
        return low, high


@dataclass(frozen=True)
class BagTopics:
    """What to take from a bag.

    Parameters
    ----------
    joints : sequence of str
        Topics of the joints; each joint keeps the stamps of its own messages.
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
    most_faulty : float
        Largest share of a topic's messages that may be left out as faulty.
    wheels : sequence of str
        Topics of the wheels' speeds, each as ``TOPIC`` or ``NAME,NAME=TOPIC``.
    gravity : bool
        Whether the accelerations are known to hold gravity, and so are not refused for it.
    """

    joints: Sequence[str]
    imu: str | None = None
    attitude: str | None = None
    without: Sequence[str] = ()
    velocity: bool = False
    effort: bool = False
    accel: bool = True
    window: TimeWindow = field(default_factory=TimeWindow)
    most_faulty: float = MOST_FAULTY
    wheels: Sequence[str] = ()
    gravity: bool = False

    @property
    def named_wheels(self) -> dict[str, tuple[str, ...]]:
        """Names of the wheels by the topic of their speeds; none where the topic names them itself."""
        parts = [text.rpartition("=") for text in self.wheels]
        return {topic: tuple(names.split(",")) if names else () for names, _, topic in parts}

    def __post_init__(self) -> None:
        if not self.joints and not self.wheels:
            raise InputError(
                "neither joints nor wheels are named", remedy="Give --joints TOPIC, --wheels TOPIC or both"
            )
        if self.imu is None and self.attitude is None:
            raise InputError("no sensor of the base is named", remedy="Give --imu TOPIC, --attitude TOPIC or both")
        # one topic may be both: an IMU may tell its attitude, too
        named = [*self.joints, *{name for name in (self.imu, self.attitude) if name is not None}]
        if not 0.0 <= self.most_faulty < 1.0:
            problem = f"the largest fraction of faulty messages is {self.most_faulty:g}"
            raise InputError(problem, place="--most-faulty", remedy="Give a fraction from 0 to below 1")
        if len(set(named)) < len(named):
            raise InputError(f"one topic is named twice: {', '.join(named)}", remedy="Name a topic for each sensor")


@dataclass(frozen=True)
class ImportedTopic:
    """What became of a topic."""

    #: name, type and frame of the topic
    name: str
    kind: str
    frame: str
    columns: tuple[str, ...]  #: columns of the recording that hold it
    #: number of messages in the bag, and of those in the recording
    messages: int
    used: int
    #: median and longest time between the used messages [s]
    interval: float
    longest_gap: float
    left_out: Mapping[str, int]  #: number of messages left out, by what is wrong with them
    reordered: int  #: number of messages that were recorded after one of a later stamp


@dataclass(frozen=True)
class ImportedBag:
    """A recording made from a bag, the stamp of its time 0 [ns], and what became of the topics."""

    recording: Recording
    start: int
    topics: tuple[ImportedTopic, ...]


def import_bag(bag: Path, selected: BagTopics) -> ImportedBag:
    """Return the recording of a bag.

    Parameters
    ----------
    bag : Path
        File of ROS 1, or folder of ROS 2.
    selected : BagTopics
        Topics to read, and what of them.

    Raises
    ------
    InputError
        If the bag or a topic cannot be read, the topics are stamped by different clocks, a topic has no message in the
        window, too many messages of one are faulty, a joint is in two topics, or the IMU feels gravity.
    """
    kinds: dict[str, tuple[str, ...]] = dict.fromkeys(selected.named_wheels, WHEELS) | dict.fromkeys(
        selected.joints, JOINTS
    )
    for name, allowed in ((selected.attitude, ATTITUDES), (selected.imu, IMU)):
        kinds |= {} if name is None else {name: allowed}
    whole = read_topics(bag, kinds)
    between = selected.window.of(list(whole.values()))

    def sound(name: str, fault: Callable[[Any], str | None]) -> StampedTopic:
        return whole[name].sound(fault, selected.most_faulty, between)

    read: list[tuple[StampedTopic, Channels, str]] = []
    spun = [(sound(name, wheel_fault), wheels) for name, wheels in selected.named_wheels.items()]
    read += [(topic, wheel_channels(topic, wheels), "") for topic, wheels in spun]
    wheels = {channel.partition(".")[2] for _, channels, _ in read for channel in channels}
    arms = [sound(name, joint_fault) for name in selected.joints]
    names = joint_names(arms, selected.without, wheels) if arms else ()
    for topic in arms:
        used = topic.kept([not set(names).isdisjoint(message.name) for message in topic.messages])
        read.append((used, joint_channels(used, names, velocity=selected.velocity, effort=selected.effort), ""))
    joints = [stamps for _, channels, _ in read for stamps, _ in channels.values()]
    known = max(int(stamps[0]) for stamps in joints), min(int(stamps[-1]) for stamps in joints)
    base: list[tuple[StampedTopic, Callable[[StampedTopic], Channels]]] = []
    if selected.imu is not None:
        base.append(
            (sound(selected.imu, imu_fault), partial(imu_channels, accel=selected.accel, gravity=selected.gravity))
        )
    if selected.attitude is not None:
        base.append((sound(selected.attitude, attitude_fault), attitude_channels))
    moving = [*arms, *(topic for topic, _ in spun)]
    _refuse_mixed_clocks([*moving, *(topic for topic, _ in base)])
    for topic, channels_of in base:
        inside = _during(moving[0], topic, known)
        read.append((inside, channels_of(inside), inside.frame()))
    topics = tuple(
        _described(topic, channels, frame, len(whole[topic.name].messages)) for topic, channels, frame in read
    )
    return ImportedBag(*_recording(bag, [channels for _, channels, _ in read]), topics)


def _during(joints: StampedTopic, topic: StampedTopic, known: tuple[int, int]) -> StampedTopic:
    """Return the messages of a topic while all joints are known."""
    inside = topic.kept((topic.stamps >= known[0]) & (topic.stamps <= known[1]))
    if not inside.messages:
        raise topic.error(f"it has no message in the period of {joints.name}", remedy="Record both at the same time")
    return inside


def _recording(bag: Path, by_topic: Sequence[Channels]) -> tuple[Recording, int]:
    """Return a recording with one row for every stamp, and its first stamp; what has no message there has no sample."""
    stamps = np.unique(np.concatenate([sampled for channels in by_topic for sampled, _ in channels.values()]))
    columns = {}
    for channels in by_topic:
        for name, (sampled, values) in channels.items():
            columns[name] = np.full(len(stamps), np.nan)
            columns[name][np.searchsorted(stamps, sampled)] = values
    name = bag.name if bag.is_dir() else bag.stem
    try:
        return Recording(name, None, (stamps - stamps[0]) / 1e9, columns), int(stamps[0])
    except InputError as error:
        raise InputError(error.problem, file=bag, place=error.place, remedy=error.remedy) from None


def _described(topic: StampedTopic, channels: Channels, frame: str, messages: int) -> ImportedTopic:
    sampled = [np.unique(stamps) for stamps, _ in channels.values() if len(stamps) > 1]
    steps: list[Floats] = [np.diff(stamps) / 1e9 for stamps in sampled] or [np.zeros(1)]
    return ImportedTopic(
        name=topic.name,
        kind=topic.kind,
        frame=frame,
        columns=tuple(channels),
        messages=messages,
        used=len(topic.messages),
        interval=float(np.median(np.concatenate(steps))),
        longest_gap=float(max(step.max() for step in steps)),
        left_out=topic.left_out,
        reordered=topic.reordered,
    )


def _refuse_mixed_clocks(topics: Sequence[StampedTopic]) -> None:
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
            raise _error(topic, "it does not overlap in time with", reference)


def _error(topic: StampedTopic, problem: str, reference: StampedTopic) -> InputError:
    return topic.error(
        f"{problem} {reference.name}",
        remedy="Stamp all topics with the same clock, either the computer's or the simulation's",
    )
