"""The device on which JAX computes, and how many points of a posterior it evaluates together."""

from __future__ import annotations

import os
from functools import cache
from typing import NamedTuple

import jax

__all__ = ["Device", "device"]

PROCESSOR = 12  # points that a processor takes together: they fit its cache, and are three times faster than 64
WAITING = 256  # points below which another device mostly waits; a call takes it some 10 ms with 12 and with 1,000
MOST = 8192  # points from which larger batches gain nothing, on an NVIDIA H100
SHARE = 0.5  # part of a device's memory that a batch may take; the rest is for data, and the estimate is rough
UNKNOWN = 4e9  # memory of a device that does not tell [bytes]


class Device(NamedTuple):
    """A device of JAX by its platform, such as ``cpu`` or ``gpu``, and the memory that JAX may take there [bytes]."""

    platform: str
    memory: float = UNKNOWN

    @property
    def fewest(self) -> int:
        """Number of points below which a call costs as much as with that number."""
        return PROCESSOR if self.platform == "cpu" else WAITING

    @property
    def calls(self) -> int:
        """Number of calls at a time."""
        if self.platform != "cpu":
            return 1
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1

    def batch(self, points: int, size: float, processor: int = PROCESSOR) -> int:
        """Return the number of points to evaluate together; powers of two, so that few numbers need compilation.

        Parameters
        ----------
        points : int
            Number of points to evaluate.
        size : float
            Memory of one of them [bytes].
        processor : int
            Number that a processor takes together.
        """
        if self.platform == "cpu":
            return processor
        fit = max(1, min(MOST, int(SHARE * self.memory / size)))
        return min(1 << (max(points, 1) - 1).bit_length(), 1 << (fit.bit_length() - 1))


@cache
def device() -> Device:
    """Return the device on which JAX computes by default."""
    first = jax.devices()[0]
    return Device(first.platform, (first.memory_stats() or {}).get("bytes_limit", UNKNOWN))
