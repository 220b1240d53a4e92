"""From hypotheses to a verdict: what is at work, under which other names, and what does as well."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.cause_search import CauseSearch, Hypothesis
from bayesid.diagnosis.disturbing_wrench import Unexplained, unexplained_wrench

__all__ = ["Status", "Verdict", "judge"]

RIVALRY = 2.7
"""Logarithm of the Bayes factor within which two adequate hypotheses are rivals."""

CROWD = 4
"""Rivals of other classes from which on nothing is named."""

FAINT = 5.5
"""Signal-to-noise ratio below which what no hypothesis explains is called unresolved and not unknown."""

HIDDEN = 1.0
"""Information, at the prior's scale, that a difference between two effects must have to be seen at all."""


class Status(Enum):
    """Verdicts, as in diagnosis.json."""

    ADEQUATE = "adequate"
    EXPLAINED = "explained"
    AMBIGUOUS = "ambiguous"
    UNRESOLVED = "unresolved"
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class Verdict:
    """What the search says.

    Attributes
    ----------
    status : Status
    best : Hypothesis
        The named causes, or the present model where none is named.
    equivalents : dict of str to tuple of str
        Other names for the same change of the model, by cause.
    rivals : tuple of Hypothesis
        Other sets of causes that do as well.
    disturbance : Unexplained
        What it would take in the present model.
    """

    status: Status
    best: Hypothesis
    equivalents: dict[str, tuple[str, ...]]
    rivals: tuple[Hypothesis, ...]
    disturbance: Unexplained

    @property
    def causes(self) -> tuple[str, ...]:
        """The named causes; none unless something is named."""
        return self.best.labels if self.status in (Status.EXPLAINED, Status.AMBIGUOUS) else ()


def judge(search: CauseSearch) -> Verdict:
    """Run a search and judge what it found.

    A set of causes must also not be much less probable than a free disturbance, or it only imitates something unknown;
    one with faults of the noise, which can imitate more, not at all.
    """
    found = search.run()
    disturbance = unexplained_wrench(search.base, name_frame=False)
    if search.base.adequate:
        return Verdict(Status.ADEQUATE, search.base, {}, (), disturbance)
    free = search.base.log_evidence + disturbance.log_bayes_factor
    found = [
        hypothesis for hypothesis in found if hypothesis.log_evidence > free - (0.0 if hypothesis.noisy else RIVALRY)
    ]
    if not found:
        return Verdict(_unnamed(search), search.base, {}, (), disturbance)
    best = found[0]
    same: dict[str, list[str]] = {}
    rivals: list[Hypothesis] = []
    for other in found[1:]:
        swap = _equivalent(best, other, search)
        if swap is not None:
            same.setdefault(swap[0], []).append(swap[1])
        elif best.log_evidence - other.log_evidence < RIVALRY and not _contains(best, other, rivals, search):
            rivals.append(other)
    equivalents = {cause: tuple(names) for cause, names in same.items()}
    if len(rivals) > CROWD:
        return Verdict(Status.UNRESOLVED, search.base, {}, tuple(rivals), disturbance)
    return Verdict(Status.AMBIGUOUS if rivals else Status.EXPLAINED, best, equivalents, tuple(rivals), disturbance)


def _contains(best: Hypothesis, other: Hypothesis, rivals: Sequence[Hypothesis], search: CauseSearch) -> bool:
    """Whether a rival is only another name of one already listed."""
    return any(_equivalent(rival, other, search) is not None for rival in rivals)


def _unnamed(search: CauseSearch) -> Status:
    """Say what to call something that no hypothesis explains."""
    outcome = search.base.outcome
    strongest = max((score.signal_to_noise for score in outcome.scores.values()), default=0.0)
    noise = min((p for name, p in outcome.log_p.items() if name not in outcome.scores), default=0.0)
    return Status.UNRESOLVED if strongest < FAINT and noise > -20.0 else Status.UNKNOWN


def _equivalent(first: Hypothesis, second: Hypothesis, search: CauseSearch) -> tuple[str, str] | None:
    """Return the names in which two hypotheses differ, if both change the model in the same way."""
    mine = [label for label in first.labels if label not in second.labels]
    theirs = [label for label in second.labels if label not in first.labels]
    if len(mine) != 1 or len(theirs) != 1:
        return None
    columns = search.suite.effects
    if mine[0] not in columns or theirs[0] not in columns:
        return None
    a, b = columns[mine[0]], columns[theirs[0]]
    if _unseen(a, b, first) and _unseen(b, a, first):
        return mine[0], theirs[0]
    return None


def _unseen(columns: Floats, others: Floats, hypothesis: Hypothesis) -> bool:
    """Whether columns offer nothing visible that the others do not."""
    fit = hypothesis.fit
    both = fit_without(hypothesis, np.concatenate([columns, others], axis=1))
    n = columns.shape[1]
    own, cross, rest = both[:n, :n], both[:n, n:], both[n:, n:]
    del fit
    left = own - cross @ np.linalg.pinv(rest, rcond=1e-10, hermitian=True) @ cross.T
    return bool(np.linalg.eigvalsh(left).max() < HIDDEN)


def fit_without(hypothesis: Hypothesis, columns: Floats) -> Floats:
    """Inner products of columns after the model's own unknowns have taken their share."""
    own = hypothesis.fit.own
    cross = own.T @ columns
    hessian = own.T @ own + np.eye(own.shape[1])
    return columns.T @ columns - cross.T @ np.linalg.solve(hessian, cross)
