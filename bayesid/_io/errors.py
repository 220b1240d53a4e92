"""Errors for the user, each with the file, the place in it, the value received and the remedy."""

from __future__ import annotations

from pathlib import Path

__all__ = ["InputError"]


class InputError(ValueError):
    """Invalid input.

    Parameters
    ----------
    problem : str
        Description of the problem, with the value received.
    file : path, optional
        File that contains the problem.
    place : str, optional
        Place in the file, such as a key, a column, a row or a link.
    remedy : str, optional
        Advice on how to correct the input.
    """

    def __init__(
        self, problem: str, *, file: str | Path | None = None, place: str | None = None, remedy: str | None = None
    ) -> None:
        self.problem, self.file, self.place, self.remedy = problem, file, place, remedy
        where = ": ".join(str(part) for part in (file, place) if part is not None)
        message = f"{where}: {problem}" if where else problem
        super().__init__(f"{message}. {remedy}" if remedy else message)

    def within(self, *, file: str | Path | None = None, place: str | None = None) -> InputError:
        """Return the same error with the given file and place where it has none.

        Parameters
        ----------
        file : str or Path, optional
            File in which the error is.
        place : str, optional
            Place in the file.
        """
        return InputError(self.problem, file=self.file or file, place=self.place or place, remedy=self.remedy)
