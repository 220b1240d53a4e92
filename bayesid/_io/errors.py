"""The errors a user meets: each names the file, the place in it, the value received and the remedy."""

from __future__ import annotations

from pathlib import Path

__all__ = ["InputError"]


class InputError(ValueError):
    """Input that cannot be used.

    Parameters
    ----------
    problem : str
        What is wrong, with the value received.
    file : path, optional
        The file it is in.
    place : str, optional
        Where in the file: a key, a column, a row, a link.
    remedy : str, optional
        What to do about it.
    """

    def __init__(
        self, problem: str, *, file: str | Path | None = None, place: str | None = None, remedy: str | None = None
    ) -> None:
        self.problem, self.file, self.place, self.remedy = problem, file, place, remedy
        where = ": ".join(str(part) for part in (file, place) if part is not None)
        message = f"{where}: {problem}" if where else problem
        super().__init__(f"{message}. {remedy}" if remedy else message)

    def within(self, *, file: str | Path | None = None, place: str | None = None) -> InputError:
        """Return the same error with its file or place filled in where it has none."""
        return InputError(self.problem, file=self.file or file, place=self.place or place, remedy=self.remedy)
