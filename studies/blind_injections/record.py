"""Counts of right verdicts, which the package ships to show them beside a verdict of the same status."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict

from bayesid.diagnosis import Status
from bayesid.report.verdict_record import Share
from studies.blind_injections.goals import CLEAR
from studies.blind_injections.trials import Trial

__all__ = ["record_of"]

RIGHT: dict[Status, Callable[[Trial], bool]] = {
    Status.EXPLAINED: lambda trial: trial.holds,
    Status.AMBIGUOUS: lambda trial: trial.in_set,
    Status.UNKNOWN: lambda trial: trial.kind == "unknown",
    Status.UNRESOLVED: lambda trial: trial.kind != "adequate",
    Status.ADEQUATE: lambda trial: trial.kind == "adequate",
}
"""When a verdict of each status counts as right."""


def record_of(trials: Sequence[Trial]) -> dict[str, dict[str, int]]:
    """Return the counts by status, of nulls without alarm ("quiet"), and of clear effects with one ("loud")."""
    shares = {}
    for status, right in RIGHT.items():
        said = [trial for trial in trials if trial.status == status.value]
        shares[status.value] = Share(sum(map(right, said)), len(said))
    nulls = [trial for trial in trials if trial.kind == "adequate"]
    clear = [t for t in trials if t.kind != "adequate" and (t.signal_to_noise or 0.0) >= CLEAR]
    shares["quiet"] = Share(sum(not trial.alarmed for trial in nulls), len(nulls))
    shares["loud"] = Share(sum(trial.alarmed for trial in clear), len(clear))
    return {name: asdict(share) for name, share in shares.items()}
