"""Part of a bag, by the stamps of its headers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from bayesid._io.errors import InputError
from bayesid.recording.ros_bag import StampedTopic

__all__ = ["TimeWindow"]


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
            raise InputError(
                f"the window from {self.start:g} to {self.end:g} s is empty",
                remedy="Give --end after --start, or a --duration above 0",
            )

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
