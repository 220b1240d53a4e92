"""A wrong convention of a recording: what is wrong, how probable that is, and the lines of the study that put it right.

A convention is never corrected silently: whoever meets one states it, with its remedy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from bayesid._io.errors import InputError

__all__ = ["STATE_CONVENTIONS", "Convention", "ConventionError", "in_one_line"]

STATE_CONVENTIONS = "State this in the study, or run `bayesid init --fix STUDY.toml`"
"""Remedy of wrong conventions."""

HEADER_END = "\0"  # marks headers, which values in brackets may resemble


@dataclass(frozen=True)
class Convention:
    """What a recording or study takes otherwise than declared.

    Attributes
    ----------
    name : str
        Such as ``convention:axes:rate``.
    channel : str
        Sensor, joint or column that it concerns.
    remedy : str
        What to write into the study, as TOML; ``[[recordings]]`` stands for the recording that the text names.
    text : str
        What is wrong, in one sentence.
    probability : float
        Probability that it is so.
    """

    name: str
    channel: str
    remedy: str
    text: str
    probability: float = 1.0

    def to_dict(self) -> dict[str, Any]:
        """Return the content of check.json and diagnosis.json."""
        return asdict(self)

    def __str__(self) -> str:
        return f"{self.text} In the study: {in_one_line(self.remedy)}" if self.remedy else self.text


def in_one_line(remedy: str) -> str:
    """Return the lines of a remedy as ``[section] key = value; key = value``, further sections after "and"."""
    text = ""
    for line in filter(None, remedy.splitlines()):
        between = "" if not text else " " if text.endswith(HEADER_END) else " and " if line.startswith("[") else "; "
        text += f"{between}{line}{HEADER_END if line.startswith('[') else ''}"
    return text.replace(HEADER_END, "")


class ConventionError(InputError):
    """Refusal of recordings with wrong conventions.

    Parameters
    ----------
    conventions : sequence of Convention
    problem, file, place, remedy
        As for `InputError`; by default the problem is what the conventions say.
    """

    def __init__(
        self,
        conventions: Sequence[Convention],
        problem: str = "",
        *,
        file: str | Path | None = None,
        place: str | None = None,
        remedy: str | None = None,
    ) -> None:
        self.conventions = tuple(conventions)
        super().__init__(problem or " ".join(map(str, conventions)), file=file, place=place, remedy=remedy)

    def within(self, *, file: str | Path | None = None, place: str | None = None) -> ConventionError:
        """Return the same error with the given file and place where it has none.

        Parameters
        ----------
        file : str or Path, optional
        place : str, optional
        """
        where = {"file": self.file or file, "place": self.place or place}
        return ConventionError(self.conventions, self.problem, remedy=self.remedy, **where)  # type: ignore[arg-type]
