"""The arithmetic of the benchmark on its smallest cases and made-up times; no time is compared with a limit."""

from __future__ import annotations

import csv
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from bayesid.inference.predicted_readings import integration_error_at
from studies.benchmark.device import LAST, DeviceTimes, device_targets
from studies.benchmark.report import STUDY, figures_by_goal, goals_of
from studies.benchmark.run import Benchmark, Result, Rival, Sampling, chain, posterior_of, seconds_per_evaluation
from studies.common.study import Severity, Verdict
from tests.pdf_text import PdfText
from tests.report_rules import broken_rules


def test_chains_of_any_length_are_the_same_arm() -> None:
    short, long = chain(6), chain(60)
    assert len(long.joints) == 60
    np.testing.assert_allclose(short.mass, long.mass)


@pytest.mark.slow
def test_an_evaluation_is_timed() -> None:
    posterior = posterior_of(chain(3), interval=2.0)
    assert 0.0 < seconds_per_evaluation(posterior, repeats=1) < 1.0
    assert integration_error_at(posterior, posterior.starting_point()) < 0.01


def measured(evaluation: float) -> Benchmark:
    """Times as one run could give them."""
    chains = SimpleNamespace(evaluations=24000, effective_samples=6000.0, z=np.zeros((4, 10, 13)))
    return Benchmark(
        evaluation=evaluation,
        error=7.3e-6,
        rivals=[
            Rival("Pinocchio, step by step in Python", 1.0, 0.5, 2e-4),
            Rival("MuJoCo rollouts in C", 0.01, 0.02, 0.006),
        ],
        links={6: 1e-4, 20: 1e-4, 60: 1.4e-4},
        samples={121: 1e-4, 241: 1.5e-4, 601: 2e-4, 1201: 3e-4},
        whitening={"white": 1e-4, "encoder 1e-6 rad": 1.1e-4, "encoder 1e-4 rad": 1.2e-4},
        windows={"white": 0, "encoder 1e-6 rad": 4},
        sampling=Sampling(chains, 6.0, 100000, 400.0, 50.0, 60.0),
    )


@pytest.mark.slow
def test_goals_are_met_missed_or_open_over_all_runs(tmp_path: Path) -> None:
    runs = [measured(evaluation) for evaluation in (1e-4, 2e-4, 1.5e-4, 1.2e-4, 1.8e-4)]
    values = {name: list(found) for _, figures in figures_by_goal(runs) for name, found, _, _ in figures}
    assert values["time of MuJoCo rollouts in C over that of one evaluation"] == pytest.approx(
        [100, 50, 66.67, 83.33, 55.56], rel=1e-4
    )
    assert values["time of an identification to 4000 effective samples, compiled [s]"] == pytest.approx([6.0] * 5)
    goals = goals_of(runs)
    assert [goal.verdict for goal in goals] == [Verdict.OPEN, Verdict.PASS, Verdict.FAIL, Verdict.PASS]
    assert goals[2].reached == "1.4 (1.4 to 1.4); 1.2 (1.2 to 1.2)"  # links and noisy joints, of which the former miss
    assert [goal.severity for goal in goals] == [Severity.LOW, Severity.HIGH, Severity.LOW, Severity.LOW]
    STUDY.write(Result(runs, True, search=12.3), tmp_path / "benchmark.pdf")
    text = PdfText.read(tmp_path / "benchmark.pdf")
    assert "150 (100 to 200) µs" in text
    assert "varies by a factor of 2, the ratios to the other simulators by 2 and 2" in text
    assert text.row("simulations of 120 s per second: at least 500000", "400000", "not reached")
    assert "measured on NVIDIA H100, November 2026" in text
    assert "not tested: no accelerator here" in text
    assert "this machine's processor 12.3" in text
    assert broken_rules(tmp_path / "benchmark.pdf") == []
    with (tmp_path / "benchmark-runs.csv").open(newline="") as stream:
        rows = [(name, float(value)) for _, name, value in list(csv.reader(stream))[1:]]
    others = {name: [value for other, value in rows if other == name] for name, _ in rows if name not in values}
    pinocchio = others.pop("time of Pinocchio, step by step in Python over that of one evaluation")
    assert pinocchio == pytest.approx([10000, 5000, 6667, 8333, 5556], rel=1e-4)
    cost = others.pop("evaluations per effective sample, emcee's default move over the package's")
    assert cost == pytest.approx([62.5] * 5)  # 250 evaluations a sample over 4
    assert not others


def test_a_device_is_compared_with_its_targets_and_the_last_one_elsewhere():
    assert [row[1:] for row in device_targets(None)] == [("400000", "not reached"), ("not measured", "not tested")]
    assert DeviceTimes.read(LAST).simulations == pytest.approx(4e5)
    fast = DeviceTimes("made up", "2026-11-27", {1024: 4e-6}, 3.0)
    assert [row[1:] for row in device_targets(fast)] == [("750000", "reached"), ("3 s", "not reached")]


def test_figures_of_a_device_are_kept_with_their_date(tmp_path: Path):
    measured = DeviceTimes("made up", "2026-11-27", {12: 1e-3, 1024: 4e-6}, 3.0, 2.5)
    measured.write(tmp_path / "last.json")
    assert DeviceTimes.read(tmp_path / "last.json") == measured
