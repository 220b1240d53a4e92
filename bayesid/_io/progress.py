"""Progress of a long computation, as its caller is told of it."""

from __future__ import annotations

from typing import Protocol

__all__ = ["Progress", "part_of", "silent"]


class Progress(Protocol):
    """A callback that long computations call now and then.

    Parameters
    ----------
    fraction : float
        How much is done, 0 to 1.
    text : str
        What is being done.
    """

    def __call__(self, fraction: float, text: str, /) -> None:
        """Take note of the state."""
        ...


def silent(fraction: float, text: str, /) -> None:
    """Take no note of it."""


def part_of(progress: Progress, start: float, end: float) -> Progress:
    """Return the progress of a part that leads from one fraction of the whole to another."""
    return lambda fraction, text: progress(start + (end - start) * fraction, text)
