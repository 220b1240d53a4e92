"""How often verdicts were right in blind trials whose truth was known.

The counts beside this file are written by the study `blind_injections`, in which MuJoCo hides something in recordings.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from scipy.stats import binomtest

from bayesid.diagnosis import Status

__all__ = ["COUNTS", "Share", "record_sentence", "shipped_record"]

COUNTS = "verdict_record.json"
"""Name of the file of counts: those of each status, and those of data sets with nothing and with much hidden."""


@dataclass(frozen=True)
class Share:
    """A number of trials among others.

    Attributes
    ----------
    count, total : int
    """

    count: int
    total: int

    @property
    def interval(self) -> tuple[float, float]:
        """Return the exact 95 % interval of the share (Clopper and Pearson)."""
        found = binomtest(self.count, self.total).proportion_ci(0.95)
        return float(found.low), float(found.high)

    def __str__(self) -> str:
        low, high = (round(100.0 * end) for end in self.interval)
        return f"{self.count} of {self.total} ({low} to {high} %)"


@cache
def shipped_record() -> dict[str, Share]:
    """Return the counts that come with this version."""
    text = (files("bayesid.report") / COUNTS).read_text(encoding="utf-8")
    return {name: Share(**share) for name, share in json.loads(text).items()}


def record_sentence(status: Status) -> str | None:
    """Return how often verdicts of a status were right in the trials, None where there was no such verdict."""
    record = shipped_record()
    share = record.get(status.value)
    if share is None or not share.total:
        return None
    said = {
        Status.EXPLAINED: f"of the verdicts that explained the data, {share} named only injected causes",
        Status.PARTLY_EXPLAINED: f"of the verdicts that explained part of the data, {share} named only injected causes",
        Status.AMBIGUOUS: f"of the ambiguous verdicts, {share} listed the injected causes among their alternatives",
        Status.UNKNOWN: f"of the verdicts of an unknown cause, {share} followed an injection outside the catalogue",
        Status.UNRESOLVED: f"of the unresolved verdicts, {share} followed an injection",
        Status.ADEQUATE: f"without an injection, {record['quiet']} raised no alarm; with an injection of at least "
        f"seven standard deviations, {record['loud']} raised one",
    }
    return f"In blind trials of this method with known answers: {said[status]}; the 95 % interval is in brackets."
