"""The trials: what is hidden, what the diagnosis said, kept in a file."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from bayesid.assemble import load_manoeuvres, load_model
from bayesid.diagnosis import Diagnosis, diagnose
from bayesid.diagnosis.search import significance
from bayesid.study import Study
from tests import hidden

__all__ = ["Plan", "Trial", "make", "plan", "read", "run"]


@dataclass(frozen=True)
class Plan:
    """One trial to be made: case of `tests.hidden`, seed, strength."""

    case: str
    seed: int
    strength: float = 1.0


@dataclass(frozen=True)
class Trial:
    """One trial made.

    Attributes
    ----------
    case, seed, strength
        As planned.
    kind : str
        "effect", "adequate" or "unknown": what should be said.
    hidden : tuple of str
        Causes, by any of whose names in `accept` they may go.
    status : str
    causes : tuple of str
    sets : tuple of tuple of str
        The causes named and all rivals, equivalents included.
    signal_to_noise : float
        Of the best hypothesis against the present model.
    p_value : float
        Family-wise, of what the present model leaves.
    seconds : float
    """

    case: str
    seed: int
    strength: float
    kind: str
    hidden: tuple[str, ...]
    accept: tuple[str, ...]
    status: str
    causes: tuple[str, ...]
    sets: tuple[tuple[str, ...], ...]
    signal_to_noise: float
    p_value: float
    seconds: float

    @property
    def alarmed(self) -> bool:
        """Whether anything was said to be there."""
        return self.status != "adequate"

    @property
    def named_rightly(self) -> bool:
        """Whether the hidden set was the one named."""
        return self.status == "explained" and self._right(self.causes)

    @property
    def in_set(self) -> bool:
        """Whether the hidden set is among those reported."""
        return self.status in ("explained", "ambiguous") and any(self._right(labels) for labels in self.sets)

    @property
    def misnamed(self) -> bool:
        """Whether something else was named, alone or among rivals."""
        return self.status in ("explained", "ambiguous") and not self.in_set

    def _right(self, labels: Sequence[str]) -> bool:
        names = set(self.hidden) | set(self.accept)
        return len(labels) == len(self.hidden) and set(labels) <= names


def plan(full: bool) -> list[Plan]:
    """Return the trials: every case once; with ``full`` at five strengths and four seeds, and a thousand nulls."""
    if not full:
        return [Plan(case.name, 100 + number) for number, case in enumerate(hidden.CASES)]
    plans = [
        Plan(case.name, seed, strength)
        for seed in range(4)
        for strength in (0.15, 0.3, 0.5, 1.0, 2.0)
        for case in hidden.CASES
        if case.status != "adequate"
    ]
    nulls = [case.name for case in hidden.CASES if case.status == "adequate"]
    return plans + [Plan(nulls[seed % len(nulls)], 1000 + seed) for seed in range(1000)]


def run(plans: Sequence[Plan], kept: Path, progress: Callable[[int, int, Trial], None] | None = None) -> list[Trial]:
    """Make the trials that the file does not hold yet.

    Parameters
    ----------
    plans : sequence of Plan
    kept : path
        JSON lines; it is created, and extended after every trial.
    """
    done = {(t.case, t.seed, t.strength): t for t in read(kept)}
    trials = []
    for number, item in enumerate(plans, start=1):
        key = (item.case, item.seed, item.strength)
        if key not in done:
            done[key] = make(item)
            kept.parent.mkdir(parents=True, exist_ok=True)
            with kept.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(done[key])) + "\n")
        trials.append(done[key])
        if progress is not None:
            progress(number, len(plans), done[key])
    return trials


def read(kept: Path) -> list[Trial]:
    """Read the trials made so far; a last line cut off by an interruption is left out."""
    if not kept.is_file():
        return []
    trials = []
    for line in kept.read_text(encoding="utf-8").splitlines():
        try:
            content = json.loads(line)
        except json.JSONDecodeError:
            continue
        for key in ("hidden", "accept", "causes"):
            content[key] = tuple(content[key])
        content["sets"] = tuple(tuple(labels) for labels in content["sets"])
        trials.append(Trial(**content))
    return trials


def make(item: Plan) -> Trial:
    """Hide, diagnose, compare."""
    case = next(case for case in hidden.CASES if case.name == item.case)
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        study = Study.load(case.make(Path(folder), item.seed, item.strength))
        model = load_model(study)
        knows = all(section.argument_of_latitude is not None for section in study.recordings)
        result = diagnose(model, load_manoeuvres(study, model.robot), item.seed, knows_latitude=knows)
    tried = result.search.tried
    best = result.after if result.verdict.causes else (tried[1] if len(tried) > 1 else tried[0])
    return Trial(
        item.case,
        item.seed,
        item.strength,
        case.status,
        tuple(case.causes),
        tuple(case.accept),
        result.verdict.status.value,
        result.verdict.causes,
        _sets(result),
        significance(best, result.before)[0],
        result.before.outcome.p_value,
        time.perf_counter() - began,
    )


def _sets(result: Diagnosis) -> tuple[tuple[str, ...], ...]:
    verdict = result.verdict
    sets = [verdict.causes, *(rival.labels for rival in verdict.rivals)]
    for cause, names in verdict.equivalents.items():
        sets += [tuple(name if label == cause else label for label in verdict.causes) for name in names]
    return tuple(labels for labels in sets if labels)
