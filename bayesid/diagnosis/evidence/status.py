"""Verdicts of a diagnosis."""

from __future__ import annotations

from enum import Enum

__all__ = ["Status"]


class Status(Enum):
    """Verdicts, as in diagnosis.json."""

    ADEQUATE = "adequate"
    EXPLAINED = "explained"
    AMBIGUOUS = "ambiguous"
    UNRESOLVED = "unresolved"
    UNKNOWN = "unknown"
