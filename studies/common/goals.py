"""Goals of the studies: what is wanted, what was reached, and whether that passes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from bayesid.report import Document

__all__ = ["Goal", "Verdict", "add_goals"]


class Verdict(StrEnum):
    """What is said of a goal."""

    PASS = "PASS"
    FAIL = "FAIL"
    OPEN = "NOT DECIDED"
    NOT_TESTED = "NOT TESTED"

    @classmethod
    def of(cls, passed: object) -> Verdict:
        """Return PASS or FAIL, or NOT TESTED where nothing was computed (None)."""
        return cls.NOT_TESTED if passed is None else cls.PASS if passed else cls.FAIL


@dataclass(frozen=True)
class Goal:
    """A goal of a study.

    Attributes
    ----------
    text : str
        What is wanted, with its number.
    reached : str
        What was reached, with its interval where there is one.
    verdict : Verdict
        NOT DECIDED where the interval holds values on both sides of the goal.
    """

    text: str
    reached: str
    verdict: Verdict


def add_goals(document: Document, goals: Sequence[Goal], caption: str = "Goals.") -> None:
    """Add the table of goals to a document."""
    rows = [[goal.text, goal.reached, goal.verdict.value] for goal in goals]
    document.table(["goal", "reached", "verdict"], rows, caption, ["left"] * 3)
