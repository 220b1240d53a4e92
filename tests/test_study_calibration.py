"""The calibration study: its tests of uniformity, the errors of smoothed joints, and the report of its outcomes."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from studies.calibration import STUDY, make, plan, read
from studies.calibration.data import REPLICATES, Case, _ratios, smooth_share
from studies.calibration.replicate import (
    ALL,
    POINTS,
    Method,
    Replicates,
    coverage,
    holm,
    interval_coverage,
    uniform_band,
    uniform_p_value,
)
from studies.calibration.report import goals_of
from studies.common.monte_carlo import run_trials
from studies.common.study import Verdict
from tests.pdf_text import PdfText
from tests.report_rules import broken_rules

REPORTS = Path(__file__).parents[1] / "reports"


def ranks_with(counts):
    """Ranks of which so many lie below each of the points."""
    edges = [0.0, *POINTS, 1.0]
    inside = np.diff([0, *counts, 120])
    middles = [0.5 * (low + high) for low, high in pairwise(edges)]
    return np.repeat(middles, inside)


def test_the_band_holds_uniform_ranks_as_often_as_it_says():
    low, high = uniform_band(120, 0.95)
    ranks = np.random.default_rng(5).uniform(size=(4000, 120))
    shares = (ranks[:, :, None] < POINTS).mean(axis=1)
    inside = int(((shares >= low) & (shares <= high)).all(axis=1).sum())
    assert stats.binomtest(inside, len(shares), 0.95).pvalue > 0.01


def test_the_test_of_uniformity_is_that_of_the_band():
    low, high = (120 * side for side in uniform_band(120, 0.95))
    for edge in (low, high):
        counts = np.maximum.accumulate(np.round(edge).astype(int))
        sign = 1 if edge is high else -1
        assert uniform_p_value(ranks_with(counts)) > 0.045
        assert uniform_p_value(ranks_with(np.clip(counts + 2 * sign, 0, 120))) < 0.05


def test_p_values_of_uniform_ranks_are_as_rare_as_they_say_and_wrong_widths_are_found():
    rng = np.random.default_rng(1)
    p = np.array([uniform_p_value(rng.uniform(size=30)) for _ in range(100)])
    assert stats.binomtest(int((p <= 0.1).sum()), len(p), 0.1, alternative="greater").pvalue > 0.01
    assert (p <= 0.5).mean() > 0.3  # few counts make few values of p
    errors = rng.normal(size=300)
    assert uniform_p_value(stats.norm.cdf(errors)) > 0.01
    for wrong in (1.4 * errors, errors / 1.4, errors + 0.4):
        assert uniform_p_value(stats.norm.cdf(wrong)) < 0.01


def test_holm_and_coverage_by_hand():
    assert holm({"a": 0.01, "b": 0.04, "c": 0.03}) == pytest.approx({"a": 0.03, "c": 0.06, "b": 0.06})
    share, error = coverage(np.array([[0.3, 0.5], [0.9, 0.6], [0.01, 0.99]]), 0.5)
    assert share == pytest.approx(0.5)
    assert error == pytest.approx(0.5 / np.sqrt(3.0))


def made_up(case, number, spread):
    """Replicates of a case whose errors are so many times what is stated."""
    errors = np.random.default_rng(7).normal(size=(number, 3))
    ranks = stats.norm.cdf(spread * errors)
    rows = [{f"base_link.com.{axis}": value for axis, value in zip("xyz", row, strict=True)} for row in ranks]
    return Replicates(case, [{"ranks": {Method.IMPORTANCE: row}} for row in rows], [])


def test_intervals_that_are_too_narrow_fail_and_what_was_not_run_is_not_tested():
    def verdicts(made):
        return {goal.text: goal.verdict for goal in goals_of(made)}

    ninety = "90 % intervals contain that share of the true values in every case (corrected p above 0.01)"
    right = [made_up(case, planned, 1.0) for case, planned in REPLICATES.items()]
    assert verdicts([])[ninety] is Verdict.NOT_TESTED
    assert verdicts(right)[ninety] is Verdict.PASS
    assert verdicts(right[:2])[ninety] is Verdict.OPEN
    assert verdicts([*right[:-1], made_up(right[-1].case, 100, 1.5)])[ninety] is Verdict.FAIL
    emcee = "ranks uniform (corrected p above 0.01), emcee: unknown arm and whole system"
    assert verdicts(right)[emcee] is Verdict.NOT_TESTED
    shares = interval_coverage(right)
    assert shares[ALL, 0.9].share == pytest.approx(0.9, abs=4.0 * shares[ALL, 0.9].error)


def test_smoothed_motions_are_stated_too_loosely_by_the_share_that_theory_gives():
    """By the transfer function of the smoothing, far from the ends of the ramps at 20 and 100 s."""
    time = np.arange(0.0, 120.1, 0.5)
    ratios = np.mean([_ratios(time, 1e-5, seed) for seed in range(30)], axis=0)
    between = ratios[:, (time > 25.0) & (time < 95.0)].mean(axis=1)
    assert between == pytest.approx([smooth_share(order) for order in range(3)], abs=0.06)
    assert ratios[2, time == 20.0] > 10.0


def test_the_plan_holds_every_replicate_once_and_its_beginning_some_of_every_case():
    full = plan(True)
    assert {case: sum(item.case is case for item in full) for case in Case} == REPLICATES
    assert {item.case for item in full[:20]} == set(Case)
    assert any(item.sampled for item in full)
    assert not any(item.sampled for item in plan(False))


@pytest.mark.slow
def test_the_report_is_that_of_the_outcomes(tmp_path):
    cases = read(REPORTS / "calibration.jsonl.gz")
    STUDY.write(cases, tmp_path / "calibration.pdf")
    rebuilt, kept = PdfText.read(tmp_path / "calibration.pdf"), PdfText.read(REPORTS / "calibration.pdf")
    for goal in goals_of(cases):
        for text in (goal.text, goal.reached, goal.verdict.value):
            assert text in rebuilt
            assert text in kept
    assert broken_rules(tmp_path / "calibration.pdf") == []


@pytest.mark.usefixtures("slow")
def test_replicates_of_the_small_plan(tmp_path):
    exact, flown = plan(False)
    tasks = [exact, replace(flown, sampled=True)]
    made = run_trials(make, tasks, tmp_path / "trials.jsonl", seed=5).complete()
    cases = {item.case: item for item in read(tmp_path / "trials.jsonl")}
    assert set(cases) == {Case.EXACT, Case.MUJOCO}
    for result in made:
        assert result["converged"]
        for squares, samples in result["chi2"].values():
            assert samples == 723
            assert abs(squares - samples) < 5.0 * np.sqrt(2.0 * samples)
    laplace, weighted, chains = (made[-1]["ranks"][method] for method in Method)
    assert set(chains) == set(weighted) == set(laplace)
    # 499 draws each, some of them alike
    assert max(abs(chains[name] - weighted[name]) for name in chains) < 0.15
    assert np.all((np.array(list(chains.values())) > 0.0) & (np.array(list(chains.values())) < 1.0))
