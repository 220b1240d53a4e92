"""Messages of topics in a bag of ROS 1 or ROS 2, with the stamps of their headers, read by the library rosbags.

A bag is a file ``.bag`` of ROS 1, or a folder or file of ROS 2 with the storage sqlite3 or MCAP. The time of a message
is the stamp in its header, which its sensor's driver gave it; when it arrived where it was recorded says nothing of the
motion. Single messages that cannot be right are left out and counted (`StampedTopic.sound`).
"""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesid._io.errors import InputError
from bayesid._math.arrays import Integers

__all__ = ["StampedTopic", "format_stamp", "read_topics"]


# distance of a stamp from those of its neighbours from which it is no mere exchange of the order [ns]
FAR = 10**9


@dataclass(frozen=True)
class StampedTopic:
    """Messages of one topic.

    Attributes
    ----------
    bag : Path
        Bag that was read.
    name, kind : str
        Name of the topic and type of its messages, such as ``"sensor_msgs/Imu"``.
    stamps, arrivals : (n,) arrays of int
        Stamps of the headers and times at which the messages were recorded [ns].
    messages : tuple
        Messages, whose fields are those of the type.
    contents : tuple of bytes
        The messages as recorded, by which repetitions are known.
    left_out : mapping of str to int
        Number of messages left out, by what is wrong with them.
    reordered : int
        Number of messages whose stamp was earlier than that of one recorded before them.
    """

    bag: Path
    name: str
    kind: str
    stamps: Integers
    arrivals: Integers
    messages: tuple[Any, ...]
    contents: tuple[bytes, ...]
    left_out: Mapping[str, int] = field(default_factory=dict)
    reordered: int = 0

    def error(self, problem: str, *, message: int | None = None, remedy: str) -> InputError:
        """Return an error in the topic, or in one of its messages, counted from 0.

        Parameters
        ----------
        problem : str
        message : int, optional
            Number of the message, from 0.
        remedy : str
        """
        place = f"topic {self.name}"
        if message is not None:
            place = (
                f"{place}, message {message + 1} of {len(self.messages)}, stamp {format_stamp(self.stamps[message])} s"
            )
        return InputError(problem, file=self.bag, place=place, remedy=remedy)

    def frame(self) -> str:
        """Return the frame that the headers name.

        Raises
        ------
        InputError
            If they name several.
        """
        frames = list(dict.fromkeys(message.header.frame_id for message in self.messages))
        if len(frames) > 1:
            raise self.error(
                f"its headers name several frames: {', '.join(map(repr, frames))}",
                remedy="Record each sensor on a separate topic",
            )
        return str(frames[0])

    def kept(self, mask: Sequence[bool] | NDArray[np.bool_]) -> StampedTopic:
        """Return the topic with some of its messages, given by a truth value for each."""
        return self.ordered(np.flatnonzero(np.asarray(mask, dtype=bool)))

    def ordered(self, rows: Integers) -> StampedTopic:
        """Return the topic with some of its messages, given by their places, shape (m,)."""
        messages, contents = (tuple(each[row] for row in rows) for each in (self.messages, self.contents))
        return replace(
            self, stamps=self.stamps[rows], arrivals=self.arrivals[rows], messages=messages, contents=contents
        )

    def sound(self, fault: Callable[[Any], str | None], share: float, between: tuple[int, int]) -> StampedTopic:
        """Return the messages by which a recording can be made, in the order of their stamps.

        A message recorded twice counts once. A message is left out if its stamp is zero, far from those of its
        neighbours, or that of another message, or if its content is faulty.

        Parameters
        ----------
        fault : callable
            Returns what is wrong with the content of a message, or None.
        share : float
            Largest share of the messages that may be left out.
        between : tuple of int
            First and last stamp that matter [ns]; what lies outside is not looked at.

        Raises
        ------
        InputError
            If more messages are faulty; it names the first.
        """
        stamps, faults = _trusted_stamps(self.stamps)
        inside = (stamps >= between[0]) & (stamps <= between[1])
        seen: dict[bytes, int] = {}
        last: dict[tuple[int, tuple[str, ...]], int] = {}
        offset = np.median((stamps - self.arrivals)[inside]) if inside.any() else 0.0
        repeated = np.zeros(len(stamps), dtype=bool)
        for row in np.flatnonzero(inside).tolist():
            repeated[row] = seen.setdefault(self.contents[row], row) != row
            faults[row] = faults[row] or fault(self.messages[row])
            if repeated[row] or faults[row]:
                continue
            key = int(stamps[row]), tuple(getattr(self.messages[row], "name", ()))
            other = last.setdefault(key, row)
            if other != row:  # that message has a wrong stamp whose delay is less usual
                delays = [abs(stamps[each] - self.arrivals[each] - offset) for each in (other, row)]
                wrong, last[key] = (other, row) if delays[0] > delays[1] else (row, other)
                faults[wrong] = "its stamp repeats that of another message"
        counted = inside & ~repeated
        bad = np.array([bool(text) for text in faults]) & counted
        if bad.sum() > share * counted.sum():
            row = int(np.argmax(bad))
            raise self.error(
                f"{faults[row]} ({bad.sum()} of {counted.sum()} messages are faulty; allowed fraction {share:.3g})",
                message=row,
                remedy="Record the topic without such messages, choose another part of the bag by --start and --end, "
                "or omit more of them with --most-faulty",
            )
        rows = np.flatnonzero(counted & ~bad)
        rows = rows[np.argsort(stamps[rows], kind="stable")]
        back = int((np.diff(rows) < 0).sum())
        counts = Counter(str(faults[row]) for row in np.flatnonzero(bad))
        if repeated.any():
            counts["recorded twice"] = int((repeated & inside).sum())
        return replace(self.ordered(rows), left_out=dict(counts), reordered=back)


def _trusted_stamps(stamps: Integers) -> tuple[Integers, list[str | None]]:
    """Return stamps [ns] in which those that cannot be are replaced by a neighbour's, and what is wrong with each.

    The stamps that can be are the longest run of them that does not fall (Schensted 1961), and what is near it.
    """
    faults: list[str | None] = [None if stamp > 0 else "the stamp of the header is zero" for stamp in stamps]
    ends: list[int] = []
    places: list[int] = []
    before = np.full(len(stamps), -1)
    for row in np.flatnonzero(stamps > 0):
        place = bisect_right(ends, int(stamps[row]))
        before[row] = places[place - 1] if place else -1
        ends[place : place + 1], places[place : place + 1] = [int(stamps[row])], [int(row)]
    run = [places[-1]] if places else []
    while run and before[run[-1]] >= 0:
        run.append(int(before[run[-1]]))
    trusted = np.array(run[::-1], dtype=int)
    if not len(trusted):
        return stamps, faults
    around = np.clip(np.searchsorted(trusted, np.arange(len(stamps))), 0, len(trusted) - 1)
    near = stamps[trusted[around]]
    apart = np.abs(stamps - near)
    for row in np.flatnonzero((apart > FAR) & (stamps > 0)):
        relation = "earlier" if stamps[row] < near[row] else "later"
        faults[row] = f"its stamp is {apart[row] / 1e9:.6g} s {relation} than the stamps around it"
    return np.where([text is None for text in faults], stamps, near), faults


def read_topics(bag: Path, types: Mapping[str, Sequence[str]]) -> dict[str, StampedTopic]:
    """Return the messages of topics.

    Parameters
    ----------
    bag : Path
        File or folder of the bag.
    types : mapping of str to sequence of str
        Types of messages that each topic may have, such as ``"sensor_msgs/Imu"``.

    Raises
    ------
    InputError
        If rosbags is not installed, the bag cannot be read, or a topic is absent, empty or of another type.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise InputError(
            "reading bags requires the library rosbags, which is not installed",
            file=bag,
            remedy="Install bayesid with the extra `ros`, for example with pip install -e '.[ros]'",
        ) from None
    if not bag.exists():
        raise InputError("there is no such bag", file=bag, remedy="Give the file .bag of ROS 1 or the folder of ROS 2")
    try:
        # bags with the storage sqlite3 of older releases hold no definitions, and the wanted types never changed
        with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            kinds = {name: _plain(info.msgtype or "several types") for name, info in reader.topics.items()}
            for name, allowed in types.items():
                _check_topic(bag, name, allowed, kinds)
            raw: dict[str, list[tuple[int, Any, bytes]]] = {name: [] for name in types}
            chosen = [connection for connection in reader.connections if connection.topic in types]
            for connection, arrival, data in reader.messages(chosen):
                message = reader.deserialize(data, connection.msgtype)
                raw[connection.topic].append((arrival, message, bytes(data)))
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


def _stamp(message: Any, arrival: int) -> int:
    """Return the stamp of a message [ns], which is its arrival where its type has no header."""
    header = getattr(message, "header", None)
    return arrival if header is None else int(header.stamp.sec * 10**9 + header.stamp.nanosec)


def _stamped(bag: Path, name: str, kind: str, read: Sequence[tuple[int, Any, bytes]]) -> StampedTopic:
    stamps = np.array([_stamp(message, arrival) for arrival, message, _ in read], dtype=np.int64)
    arrivals = np.array([arrival for arrival, _, _ in read], dtype=np.int64)
    messages, contents = tuple(message for _, message, _ in read), tuple(content for *_, content in read)
    topic = StampedTopic(bag, name, kind, stamps, arrivals, messages, contents)
    if not read:
        raise topic.error("it has no messages", remedy="Name a topic that was recorded")
    return topic
