"""Progress of a long computation, reported to its caller, and the time that each of its phases takes."""

from __future__ import annotations

import time
from typing import Protocol

__all__ = ["PhaseClock", "Progress", "part_of", "silent"]


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
    """Return the progress for a part of a computation, from one fraction of the whole to another.

    Parameters
    ----------
    progress : Progress
        Receiver of the fraction of the whole.
    start : float
        Fraction of the whole at which the part begins.
    end : float
        Fraction of the whole at which it ends.
    """
    return lambda fraction, text: progress(start + (end - start) * fraction, text)


class PhaseClock:
    """Clock that writes down how long each phase took; it starts with the first.

    Attributes
    ----------
    seconds : dict of str to float
        Time by phase [s].
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.monotonic()

    def ends(self, phase: str) -> None:
        """Write down that a phase ends now and the next begins."""
        now = time.monotonic()
        self.seconds[phase] = self.seconds.get(phase, 0.0) + now - self._last
        self._last = now

    def moves(self, phase: str, other: str, seconds: float) -> None:
        """Write down that some of the time of a phase [s] was that of another.

        Parameters
        ----------
        phase : str
            Phase that has the time so far.
        other : str
            Phase that gets it.
        seconds : float
            Time to move [s].
        """
        self.seconds[phase] -= seconds
        self.seconds[other] = self.seconds.get(other, 0.0) + seconds
