"""Comparison of the clocks by which the topics of a bag are stamped."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesid._io.errors import InputError
from bayesid.recording.ros_bag import StampedTopic

__all__ = ["refuse_mixed_clocks"]

# difference of the stamps of two topics, against their arrival, from which on their clocks are others [s]; a slow
# telemetry stamps its samples once in a second
APART = 1.0


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
