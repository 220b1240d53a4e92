"""How often verdicts were right in blind trials whose truth was known.

The counts beside this file are written by the study `blind_injections`, in which MuJoCo hides something in recordings.
They name the releases that made the trials.
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
"""Name of the file of counts, apart for trials inside and outside the catalogue: those of each status, of data sets
with nothing hidden ("quiet") and with much hidden ("loud"), and of hidden causes explained by others ("misnamed")."""


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

    def __add__(self, other: Share) -> Share:
        return Share(self.count + other.count, self.total + other.total)

    def __str__(self) -> str:
        if not self.total:
            return "none"
        low, high = (round(100.0 * end) for end in self.interval)
        return f"{self.count} of {self.total} ({low} to {high} %)"


@dataclass(frozen=True)
class Record:
    """Counts of the trials.

    Attributes
    ----------
    releases : list of str
        Releases of this package that made the trials.
    inside, outside : dict of str to Share
        Trials with nothing or causes of the catalogue hidden, and with an effect outside it.
    """

    releases: list[str]
    inside: dict[str, Share]
    outside: dict[str, Share]


@cache
def shipped_record() -> Record:
    """Return the counts that come with this version."""
    text = (files("bayesid.report") / COUNTS).read_text(encoding="utf-8")
    counts = json.loads(text)
    inside, outside = ({name: Share(**share) for name, share in counts[w].items()} for w in ("inside", "outside"))
    return Record(counts["releases"], inside, outside)


def record_sentence(status: Status) -> str | None:
    """Return how often verdicts of a status were right in the trials, None where there was no such verdict.

    Trials with a cause of the catalogue and with one outside it are reported apart.
    """
    record = shipped_record()
    inside, outside = record.inside, record.outside
    here, there = inside[status.value], outside[status.value]
    if not (here + there).total:
        return None
    misnamed = f"; outside it, {outside['misnamed']} injections were wrongly explained by causes of the catalogue"
    said = {
        Status.EXPLAINED: f"inside the catalogue, {here} verdicts that explained the data named only injected causes"
        f"{misnamed}",
        Status.PARTLY_EXPLAINED: f"inside the catalogue, {here} verdicts that explained part of the data named only "
        f"injected causes; outside it, {there} did",
        Status.AMBIGUOUS: f"inside the catalogue, {here} ambiguous verdicts listed the injected causes among their "
        f"alternatives; outside it, {there} listed something unknown",
        Status.UNKNOWN: f"{here + there} verdicts of an unknown cause followed an injection outside the catalogue; "
        f"{there.count} of the {outside['misnamed'].total} injections outside it led to such a verdict",
        Status.UNRESOLVED: f"{here + there} unresolved verdicts followed an injection, {there.total} of them outside "
        "the catalogue",
        Status.ADEQUATE: f"without an injection, {inside['quiet']} raised no alarm; of injections of at least seven "
        f"standard deviations, {inside['loud']} inside the catalogue and {outside['loud']} outside it raised one",
    }
    made_by = " and ".join(record.releases)
    return f"In blind trials of bayesid {made_by} (95 % intervals in brackets): {said[status]}."
