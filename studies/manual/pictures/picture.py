"""A picture of the manual: the commands that made it, how it is drawn from their files, and what to see."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

__all__ = ["Picture"]


@dataclass(frozen=True)
class Picture:
    """One picture of one task.

    Attributes
    ----------
    name : str
        Name of its file, without suffix, and of the task.
    steps : tuple of str or callable
        Commands in order, run in one folder with the inputs, each with ``--output`` and its folder; or functions that
        write into that folder what a spacecraft, and no command, would have written.
    inputs : tuple of str
        Files of the folder ``inputs`` that the commands read.
    draw : callable
        Draws the picture from the files in that folder.
    reading : callable
        Returns what to see in it, with the numbers of the files.
    """

    name: str
    steps: tuple[str | Callable[[Path], None], ...]
    inputs: tuple[str, ...]
    draw: Callable[[Path], Figure]
    reading: Callable[[Path], str]

    @property
    def commands(self) -> list[str]:
        """Commands alone."""
        return [step for step in self.steps if isinstance(step, str)]
