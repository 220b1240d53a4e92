"""The arithmetic of the study of cost on made-up times, and a small run; no time is compared with a limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from bayesid import InputError
from studies.common.study import Severity, Verdict
from studies.cost.report import STUDY, goals_of
from studies.cost.run import Cost, Floor, Nested, Run, Timed, run, run_command, stored_in
from studies.cost.search_times import SearchTimes, search_times
from tests.conftest import QUICKLY
from tests.pdf_text import PdfText
from tests.report_rules import broken_rules

PHASES = {"load": 0.5, "compile": 0.4, "fit": 0.4, "consequences": 1.5, "sample": 0.0, "design": 0.0, "report": 5.0}


def timed(verdict: float, memory: float = 1.2, sample: float = 0.0) -> Run:
    """A diagnosis of which three seconds and a half come before the first phase."""
    phases = {"start": 3.5, **PHASES, "verdict": verdict, "sample": sample}
    return Run(sum(phases.values()), sum(phases.values()), memory, phases)


def made_up(nested: Nested | None) -> Cost:
    titles = (
        "nothing hidden",
        "leak",
        "payload",
        "link error",
        "wheel and bias",
        "growing torque",
        "oscillating torque",
    )
    warm = {"nothing hidden": 0.1, "leak": 0.15}
    return Cost(
        diagnoses={name: [timed(16.0), *(timed(warm.get(name, 4.0) + 0.01 * k) for k in range(3))] for name in titles},
        sampled={name: timed(0.1, sample=8.0 + k) for k, name in enumerate(("leak", "payload", "link error"))},
        commands={
            "check": [Run(20.0, 20.0, 0.6, {}), Run(5.0, 5.0, 0.5, {})],
            "identify": [Run(40.0, 60.0, 1.0, {}), Run(19.0, 25.0, 1.0, {}), Run(21.0, 25.0, 1.0, {})],
            "design": [Run(200.0, 300.0, 1.0, {}), Run(150.0, 250.0, 1.6, {})],
        },
        large={
            "check, 40 recordings": [Run(30.0, 30.0, 0.6, {}), Run(9.0, 9.0, 0.5, {})],
            "diagnose, 40 recordings": [timed(60.0), timed(30.0, memory=2.4)],
        },
        candidates={10: 1.5, 20: 2.0, 40: 3.0, 46: 4.6},
        growth={"recordings": {1: 2e-4, 2: 4e-4}},
        floor=Floor(6e5, 2.4e6, 3e10, 1e10, 2e-4),
        nested=nested,
        search=SearchTimes(19.0, 7.0, (0.02, 0.031, 0.05), (0.01, 0.01, 0.02), 48),
    )


def test_goals_are_met_missed_or_open(tmp_path: Path) -> None:
    cost = replace(made_up(Nested(100.0, 25, done=False)), full=True)
    goals = goals_of(cost)
    verdicts = {goal.text.partition(":")[0] + f" {goal.reached[:3]}": goal.verdict for goal in goals}
    by_text = [goal.verdict for goal in goals]
    # warm 5 s (payload takes 8.8 s) and 10 s, cold 20 s (20.8 s) and 40 s, memory, samples, identify and design,
    # much data, start of a search
    assert by_text == [
        Verdict.FAIL,
        Verdict.FAIL,
        Verdict.PASS,
        Verdict.PASS,
        Verdict.FAIL,
        Verdict.FAIL,  # 2.4 GB
        Verdict.PASS,
    ], verdicts
    assert goals[1].text.endswith("at most 40 s for wheel and bias, growing torque, oscillating torque")
    assert goals[-2].reached == "9 s, 0.5 GB; 35 s, 2.4 GB"
    within = replace(cost, large={**cost.large, "diagnose, 40 recordings": [timed(60.0), timed(30.0, memory=1.9)]})
    assert goals_of(within)[-2].verdict is Verdict.PASS
    assert {goal.severity for goal in goals} == {Severity.LOW}
    STUDY.write(cost, tmp_path / "cost.pdf")
    text = PdfText.read(tmp_path / "cost.pdf")
    assert "10 times above that bound" in text  # 200 µs over 6e5 operations at 3e10 a second
    assert "The limit of 5 s (nothing hidden, leak, payload and link error) is missed in 2 of 4 cases." in text
    assert "4 of 7 goals are missed" in text
    assert "each of 46 candidates would take more than 1000 times as long" in text  # 100 s for each over 4.6 s
    assert "takes 31.0 ms on one core" in text
    assert "The files of check, identify and design state no time by phase" in text
    assert "1.50 s" in text
    assert broken_rules(tmp_path / "cost.pdf") == []


def test_times_of_an_earlier_run_stand_beside_these(tmp_path: Path) -> None:
    cost = replace(made_up(None), full=True)
    STUDY.write(cost, tmp_path / "earlier.pdf")
    commands = {**cost.commands, "check": [Run(20.0, 20.0, 0.6, {}), Run(2.0, 2.0, 0.5, {"start": 0.5, "load": 1.5})]}
    now = replace(cost, commands=commands, before=tmp_path / "earlier-runs.csv")
    STUDY.write(now, tmp_path / "cost.pdf")
    text = PdfText.read(tmp_path / "cost.pdf")
    assert "check 5.0 2.0 −60" in text
    assert "All others are within 10 % of the run that wrote earlier-runs.csv" in text
    assert "start 0.5, load 1.5" in text
    assert broken_rules(tmp_path / "cost.pdf") == []


def test_a_nested_run_is_stated_as_finished_or_not(tmp_path: Path) -> None:
    for one, part in (
        (None, ""),
        (Nested(5.0, 25, done=False), "more than 50 times"),
        (Nested(5.0, 25, done=True), "50"),
    ):
        STUDY.write(replace(made_up(one), full=True), tmp_path / "cost.pdf")
        text = PdfText.read(tmp_path / "cost.pdf")
        assert ("dynesty" in text) is (one is not None)
        assert ("in which it did not finish" in text) is (one is not None and not one.done)
        assert f"candidates would take {part}" in text if part else True


def test_time_to_the_verdict_leaves_out_what_follows() -> None:
    assert timed(4.0, sample=7.0).to_verdict == pytest.approx(3.5 + 0.5 + 0.4 + 0.4 + 4.0)


def test_a_command_that_fails_says_why(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text("title = 1\n")
    with pytest.raises(RuntimeError, match=r"check of .*study\.toml failed: .*title"):
        run_command(("check",), tmp_path / "study.toml", tmp_path / "out", tmp_path / "cache")


def test_an_interrupted_study_goes_on_where_it_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[int] = []

    def fly(words: Sequence[str], study: Path, output: Path, cache: Path) -> Run:
        if len(made) == 2:
            raise KeyboardInterrupt
        output.mkdir()
        cache.mkdir(exist_ok=True)
        made.append(len(list(cache.iterdir())))
        (cache / f"compiled-{len(made)}").touch()
        return timed(float(len(made)))

    monkeypatch.setattr("studies.cost.run.run_command", fly)
    said: list[str] = []
    place = stored_in(tmp_path / "runs")
    wanted = ("leak", ("diagnose",), tmp_path / "study.toml", 3, place / "cache-leak")
    (place / "cache-leak").mkdir()
    (place / "cache-leak" / "of a run that was cut off").touch()
    with pytest.raises(KeyboardInterrupt):
        Timed(place, said.append).runs(*wanted)
    (place / "out-leak-2").mkdir()
    monkeypatch.setattr("studies.cost.run.run_command", lambda *_: timed(3.0))
    assert Timed(stored_in(place), said.append).runs(*wanted) == [timed(1.0), timed(2.0), timed(3.0)]
    assert made == [0, 1]
    assert said == ["leak, cold", "leak, warm", "leak, warm", "leak, warm"]
    monkeypatch.setattr("studies.cost.run.fingerprint", lambda study: "other")
    with pytest.raises(InputError, match="made by other code"):
        stored_in(place)


@pytest.mark.slow
def test_a_small_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XLA_FLAGS", QUICKLY)  # of the commands, in processes of their own
    monkeypatch.setattr("studies.cost.run.COUNTS", (4,))
    cost = run(titles=("nothing hidden",), commands=())
    cold, warm = cost.diagnoses["nothing hidden"]
    assert cold.wall > cold.to_verdict > 0.0
    assert warm.phases["compile"] < cold.phases["compile"]
    assert 0.3 < warm.memory < 8.0
    assert list(cost.candidates) == [4]
    assert cost.search is None
    STUDY.write(cost, tmp_path / "cost.pdf")
    assert broken_rules(tmp_path / "cost.pdf", full=False) == []


def test_a_search_begins_without_compiled_code_however_often_it_is_timed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A resumed study stores what commands compile; a cold start must not find any of it."""
    found = []

    def clock(cache: Path, *, one_core: bool) -> dict:
        found.append(len(list(cache.iterdir())))
        (cache / f"compiled-{len(found)}").touch()
        return {"ready": 2.0 - (len(found) > 1), "criterion": [0.02], "limits": [0.01], "unknowns": 48}

    monkeypatch.setattr("studies.cost.search_times.search_clock", clock)
    times = search_times(), search_times()
    assert found == [0, 1, 2, 0, 1, 2]
    assert (times[0].cold, times[0].warm) == (2.0, 1.0)
