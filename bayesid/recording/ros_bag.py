"""Messages of topics in a bag of ROS 1 or ROS 2, with the stamps of their headers, read by the library rosbags.

A bag is a file ``.bag`` of ROS 1, or a folder or file of ROS 2 with the storage sqlite3 or MCAP. The time of a message
is the stamp in its header, which its sensor's driver gave it; when it arrived where it was recorded says nothing of the
motion.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats, Integers

__all__ = ["StampedTopic", "format_stamp", "read_topics"]


@dataclass(frozen=True)
class StampedTopic:
    """Messages of one topic in the order of their stamps."""

    bag: Path  # bag that was read
    # name of the topic and type of its messages, such as ``"sensor_msgs/Imu"``
    name: str
    kind: str
    frame: str  # frame that the headers name
    # (n,) stamps of the headers and times at which the messages were recorded [ns]
    stamps: Integers
    arrivals: Integers
    messages: tuple[Any, ...]  # messages, whose fields are those of the type

    def error(self, problem: str, *, message: int | None = None, remedy: str) -> InputError:
        """Return an error in the topic, or in one of its messages, counted from 0."""
        place = f"topic {self.name}"
        if message is not None:
            place = (
                f"{place}, message {message + 1} of {len(self.messages)}, stamp {format_stamp(self.stamps[message])} s"
            )
        return InputError(problem, file=self.bag, place=place, remedy=remedy)

    def numbers(self, read: Callable[[Any], Sequence[float]], meaning: str) -> Floats:
        """Return numbers of every message, shape (n, k), and refuse any that is not finite."""
        values = np.array([read(message) for message in self.messages], dtype=float)
        lost = ~np.isfinite(values).all(axis=1)
        if lost.any():
            row = int(np.argmax(lost))
            shown = ", ".join(f"{value:g}" for value in values[row])
            raise self.error(
                f"{meaning} is {shown}, not finite ({int(lost.sum())} such messages)",
                message=row,
                remedy="Record the topic without such messages; where a sensor has no sample, none should be sent",
            )
        return values

    def kept(self, wanted: Sequence[bool]) -> StampedTopic:
        """Return the topic with some of its messages."""
        mask = np.array(wanted, dtype=bool)
        messages = tuple(message for message, keep in zip(self.messages, wanted, strict=True) if keep)
        return StampedTopic(
            self.bag, self.name, self.kind, self.frame, self.stamps[mask], self.arrivals[mask], messages
        )


def read_topics(bag: Path, wanted: Mapping[str, Sequence[str]]) -> dict[str, StampedTopic]:
    """Return the messages of topics.

    Parameters
    ----------
    bag : Path
        File or folder of the bag.
    wanted : mapping of str to sequence of str
        Types of messages that each topic may have, such as ``"sensor_msgs/Imu"``.

    Raises
    ------
    InputError
        If rosbags is not installed, the bag cannot be read, a topic is absent, empty or of another type, or its stamps
        are missing, repeat or run back.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise InputError(
            "bags are read by the library rosbags, which is not installed",
            file=bag,
            remedy="Install bayesid with its extra `ros`, such as by pip install -e '.[ros]'",
        ) from None
    if not bag.exists():
        raise InputError("there is no such bag", file=bag, remedy="Give the file .bag of ROS 1 or the folder of ROS 2")
    try:
        # bags with the storage sqlite3 of older releases hold no definitions, and the wanted types never changed
        with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            kinds = {name: _plain(info.msgtype or "several types") for name, info in reader.topics.items()}
            for name, allowed in wanted.items():
                _check_topic(bag, name, allowed, kinds)
            raw: dict[str, list[tuple[int, Any]]] = {name: [] for name in wanted}
            chosen = [connection for connection in reader.connections if connection.topic in wanted]
            for connection, arrival, data in reader.messages(chosen):
                raw[connection.topic].append((arrival, reader.deserialize(data, connection.msgtype)))
    except InputError:
        raise
    except Exception as error:  # the library and what it builds on raise errors of many kinds for a damaged file
        raise InputError(
            f"it cannot be read as a bag: {error or type(error).__name__}",
            file=bag,
            remedy="Give the file .bag of ROS 1, or the folder of ROS 2 with its metadata.yaml",
        ) from error
    return {name: _stamped(bag, name, kinds[name], messages) for name, messages in raw.items()}


def _plain(kind: str) -> str:
    """Return a type's name as in ROS 1, without the ``msg`` of ROS 2."""
    return kind.replace("/msg/", "/")


def format_stamp(stamp: int | np.integer[Any]) -> str:
    """Return a stamp [ns] in seconds with all its digits."""
    return f"{int(stamp) // 10**9}.{int(stamp) % 10**9:09d}"


def _check_topic(bag: Path, name: str, allowed: Sequence[str], kinds: Mapping[str, str]) -> None:
    if name not in kinds:
        fitting = [topic for topic, kind in kinds.items() if kind in allowed]
        known = ", ".join(f"{topic} ({kind})" for topic, kind in sorted(kinds.items())) or "none"
        hint = f"Of the right type: {', '.join(fitting)}. " if fitting else ""
        raise InputError(
            "there is no such topic", file=bag, place=f"topic {name}", remedy=f"{hint}Topics here: {known}"
        )
    if kinds[name] not in allowed:
        problem = f"its messages are {kinds[name]}"
        raise InputError(problem, file=bag, place=f"topic {name}", remedy=f"Name a topic of {' or '.join(allowed)}")


def _stamped(bag: Path, name: str, kind: str, messages: Iterable[tuple[int, Any]]) -> StampedTopic:
    pairs = list(messages)
    headers = [message.header for _, message in pairs]
    stamps = np.array([header.stamp.sec * 10**9 + header.stamp.nanosec for header in headers], dtype=np.int64)
    arrivals = np.array([arrival for arrival, _ in pairs], dtype=np.int64)
    frames = list(dict.fromkeys(header.frame_id for header in headers))
    topic = StampedTopic(bag, name, kind, ", ".join(frames), stamps, arrivals, tuple(message for _, message in pairs))
    if not pairs:
        raise topic.error("it has no messages", remedy="Name a topic that was recorded")
    if len(frames) > 1:
        problem = f"its headers name several frames: {', '.join(map(repr, frames))}"
        raise topic.error(problem, remedy="Record each sensor on a topic of its own")
    if (stamps <= 0).any():
        raise topic.error(
            f"the stamp of the header is zero ({int((stamps <= 0).sum())} such messages)",
            message=int(np.argmax(stamps <= 0)),
            remedy="Have the driver stamp its messages; the time of arrival is no substitute",
        )
    falls = np.diff(stamps) <= 0
    if falls.any():
        row = int(np.argmax(falls)) + 1
        fault = "repeats" if stamps[row] == stamps[row - 1] else "is earlier than"
        problem = f"the stamp {fault} the one before it, {format_stamp(stamps[row - 1])} s"
        raise topic.error(problem, message=row, remedy="Record one driver on one clock that runs forwards")
    return topic
