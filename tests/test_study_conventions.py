"""The study of conventions counts what is said, and hides every mistake and every cause."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.inference.conventions import find_conventions
from studies.common.monte_carlo import read_store
from studies.common.study import Verdict
from studies.conventions import STUDY
from studies.conventions.mistakes import MISTAKES
from studies.conventions.right_studies import UNUSUAL, circumstances
from studies.conventions.trials import Outcome, tasks, trial
from studies.truth.hidden_causes import CASES
from tests.pdf_text import PdfText

REPORTS = Path(__file__).parents[1] / "reports"
NAMED = Outcome("sign", True, "servicer3", 0.6, 1e-5, ("convention:sign:j",), ("convention:sign:j",), True, True, 2.0)
QUIET = Outcome("leak", False, "servicer3", 0.6, 1e-5, (), (), True, True, 0.1)


def test_every_mistake_and_every_cause_is_tried() -> None:
    planned = tasks(full=False)
    assert {task["mistake"] for task in planned if "mistake" in task} == set(MISTAKES)
    assert {task["case"] for task in planned if "case" in task} == {case.name for case in CASES} | set(UNUSUAL)
    assert len(tasks(full=True)) > 7 * len(planned)


def verdicts(outcomes: Sequence[Outcome]) -> list[Verdict]:
    return [goal.verdict for goal in STUDY.report(outcomes).goals]


def test_goals_follow_from_the_outcomes() -> None:
    assert verdicts([NAMED] * 4000 + [QUIET] * 9000) == [Verdict.PASS] * 3
    alarmed = replace(QUIET, said=("convention:sign:j",), alarms=1, seconds=9.0)
    assert verdicts([NAMED] * 4000 + [QUIET] * 900 + [alarmed] * 100)[0] == Verdict.FAIL
    unseen = replace(NAMED, said=(), visible=False)
    assert verdicts([NAMED] * 4000 + [unseen] * 500 + [QUIET] * 9000) == [Verdict.PASS] * 3
    unmended = replace(NAMED, mended=False)
    assert verdicts([NAMED] * 400 + [unmended] * 100 + [QUIET, alarmed])[1:] == [Verdict.FAIL, Verdict.FAIL]


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, len(CASES) // 2])
def test_a_right_study_with_a_strong_cause_is_left_in_peace(number: int) -> None:
    made = trial(tasks(full=False)[number], np.random.default_rng(0))
    assert (made["said"], made["alarms"], made["looks"]) == ((), 0, 3)


@pytest.mark.slow
@pytest.mark.parametrize("name", UNUSUAL)
def test_a_right_study_of_an_unusual_robot_is_left_in_peace_in_all_circumstances(name: str, tmp_path: Path) -> None:
    study = Study.load(UNUSUAL[name](tmp_path, 7))
    model = load_model(study)
    manoeuvres = load_manoeuvres(study, model.robot)
    for changed, recorded in circumstances(model, manoeuvres, np.random.default_rng(8), 6):
        assert find_conventions(changed, recorded) == []


@pytest.mark.slow
def test_joints_that_cannot_be_so_fast_speak_for_seconds() -> None:
    """Rates in counts, small beside their noise, follow the motion in no unit of time that the joints could follow."""
    number = [*MISTAKES].index("rates in counts")
    task = {"mistake": "rates in counts", "robot": "servicer3", "amplitude": 0.2, "noise": 1e-4, "seed": 9000 + number}
    assert "convention:unit:time" not in trial(task, np.random.default_rng(0))["said"]


def test_the_committed_report_is_that_of_its_trials() -> None:
    lines = read_store(REPORTS / "conventions.jsonl.gz")
    outcomes = [Outcome(**line["result"]) for line in lines if "trial" in line]
    assert len(outcomes) == len(tasks(full=True))
    written = PdfText.read(REPORTS / "conventions.pdf")
    for goal in STUDY.report(outcomes).goals:
        for text in (goal.text, goal.reached, goal.verdict.value):
            assert text in written
