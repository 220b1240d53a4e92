"""Time that each phase of a long computation took."""

from __future__ import annotations

import time

__all__ = ["PhaseClock"]


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
        """Write down that some of the time of a phase [s] was that of another."""
        self.seconds[phase] -= seconds
        self.seconds[other] = self.seconds.get(other, 0.0) + seconds
