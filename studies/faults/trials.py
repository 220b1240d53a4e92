"""The trials of the study: files spoilt, units mistaken, commands killed, faults around a run, another's cache."""

from __future__ import annotations

import tempfile
import warnings
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import seed as seeded

from bayesid.app.compilation_cache import keep_compiled
from studies.faults.fuzz import KINDS, SLIPS, Spoilt, answer_to, refused, spoilt
from studies.faults.kills import COMMANDS, answers_beside_another_version, kill_and_resume
from studies.faults.surroundings import FULL, SURROUNDINGS, answer_amid, can_fill_a_disk
from studies.truth.bodies import SERVICER3
from studies.truth.mujoco import Manoeuvres, write_study

Task = Mapping[str, Any]  # what is tried, and how often


def tasks(full: bool) -> list[Task]:
    """Return what is tried; the small study kills a campaign alone."""
    spoiling = [{"spoil": 100 + number, "changes": 250 if full else 50} for number in range(4 if full else 1)]
    killing = [{"kill": name, "kills": 8 if name == "campaign" else 3} for name in COMMANDS]
    if not full:
        return [*spoiling, killing[0]]
    around = [{"around": title} for title in SURROUNDINGS if title != FULL or can_fill_a_disk()]
    return [*spoiling, *killing, *({"unit": slip} for slip in SLIPS), *around, {"cache": "another version"}]


def attempt(task: Task, rng: np.random.Generator) -> dict[str, Any]:
    """Try one thing, in a folder of its own."""
    keep_compiled()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        manoeuvres = Manoeuvres(count=1, duration=40.0)
        study = write_study(folder / "made", SERVICER3, np.random.default_rng(3), manoeuvres=manoeuvres).file
        if "spoil" in task:
            return _spoil(task["spoil"], task["changes"], study, folder / "spoilt")
        if "unit" in task:
            clear, said = refused(study, task["unit"], folder)
            return {"refused": clear, "said": said}
        if "around" in task:
            clear, said = answer_amid(study, task["around"], folder)
            return {"refused": clear, "said": said}
        if "cache" in task:
            return answers_beside_another_version(study, folder)
        return asdict(kill_and_resume(task["kill"], study.parent, rng, task["kills"]))


def _spoil(seed: int, changes: int, study: Path, folder: Path) -> dict[str, Any]:
    """Spoil a file so many times, and return the numbers of answers by kind of change and what was wrong with any."""
    answers: dict[str, Counter[str]] = {kind: Counter() for kind in KINDS}
    faults: list[str] = []

    @seeded(seed)
    @settings(
        max_examples=changes,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(spoilt())
    def spoil(change: Spoilt) -> None:
        answer = answer_to(study, change, folder)
        answers[change.kind]["faulty" if answer.fault else "accepted" if answer.accepted else "refused"] += 1
        if answer.fault:
            faults.append(f"{change}: {answer.fault}")

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        spoil()
    return {"answers": {kind: dict(counts) for kind, counts in answers.items()}, "faults": faults}
