"""Progress of a long computation, reported to its caller."""

from __future__ import annotations

from typing import Protocol

__all__ = ["Progress", "part_of", "silent"]


class Progress(Protocol):
    """Callback that long computations call repeatedly.

    Parameters
    ----------
    fraction : float
        Fraction of the computation that is done, 0 to 1.
    text : str
        Description of the present activity.
    """

    def __call__(self, fraction: float, text: str, /) -> None:
        """Receive the present state."""
        ...


def silent(fraction: float, text: str, /) -> None:
    """Ignore the present state."""


def part_of(progress: Progress, start: float, end: float) -> Progress:
    """Return the progress for a part of a computation, from one fraction of the whole to another."""
    return lambda fraction, text: progress(start + (end - start) * fraction, text)
