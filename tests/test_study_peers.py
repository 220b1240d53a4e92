"""The study of peers: bridge sampling, the goals by made-up trials, the recipes' lines; slowly, a small study."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from bayesid.inference.parameterisation import StudentT
from studies.common.monte_carlo import run_trials
from studies.common.study import Verdict
from studies.peers.contest import REFERENCE, Recipe, attempt, lines, tasks
from studies.peers.recipes import with_scipy, with_sysid
from studies.peers.report import STUDY, goals_of, read
from studies.peers.samplers import Sampler, bridge, effective_samples
from studies.truth.bodies import SERVICER3
from tests.pdf_text import PdfText
from tests.report_rules import broken_rules

REPORTS = Path(__file__).parents[1] / "reports"


def test_bridge_sampling_gives_the_evidence_of_a_normal_density():
    rng, size = np.random.default_rng(1), 5
    factor = np.diag([1.0, 2.0, 0.5, 1.5, 3.0])
    draws = rng.standard_normal((4000, size)) @ factor
    proposal = StudentT.about(np.full(size, 0.2), 1.3 * factor**2)

    def ratio(x):
        return -0.5 * ((x / np.diag(factor)) ** 2).sum(axis=1) + 7.0 - proposal.log_density(x)

    value, error = bridge(ratio(draws), ratio(proposal.draw(4000, rng)), 4000.0)
    truth = 7.0 + 0.5 * size * np.log(2.0 * np.pi) + np.log(np.diag(factor)).sum()
    assert 0.003 < error < 0.03
    assert abs(value - truth) < 4.0 * error


def test_effective_samples_are_those_of_the_worst_coordinate():
    rng = np.random.default_rng(2)
    white, slow = rng.standard_normal((2, 2000, 4))
    for step in range(1, len(slow)):
        slow[step] = 0.8 * slow[step - 1] + 0.6 * slow[step]
    # an autoregression of 0.8 has an autocorrelation time of 1.8 / 0.2
    assert effective_samples(np.stack([white, slow], axis=2)) == pytest.approx(8000 / 9.0, rel=0.25)


def trial(unknowns, sampler, seconds, effective, evidence=None):
    result = {"seconds": seconds, "evaluations": 1000, "gradients": 0, "effective_samples": effective}
    result |= {"finished": effective >= 4000.0, "log_evidence": evidence, "log_evidence_error": 0.01, "mean": []}
    return {"task": {"unknowns": unknowns, "sampler": str(sampler)}, "result": result}


def verdicts(made):
    return {goal.text: goal.verdict for goal in goals_of(made)}


def test_the_goals_follow_from_the_trials():
    speed = "at least 5 times faster than the best peer, 10, 19, 39 and 79 unknowns"
    evidence = "log evidence within 0.1 of a long reference, 10, 19, 39 and 79 unknowns"
    assert verdicts([])[speed] is Verdict.NOT_TESTED
    assert verdicts([])[evidence] is Verdict.NOT_TESTED

    def own(size, reference=-3.05):
        return [trial(size, Sampler.OURS, 10.0, 5000.0, -3.0), trial(size, REFERENCE, 90.0, 20000.0, reference)]

    others = [made for size in (10, 19, 79) for made in own(size)]
    others += [trial(size, name, 80.0, 4000.0) for size in (10, 19) for name in list(Sampler)[1:]]
    others += [trial(79, name, 80.0, 4000.0) for name in (Sampler.STRETCH, Sampler.NUTS, Sampler.DE)]
    slow = [trial(39, name, 80.0, 2000.0) for name in (Sampler.NUTS, Sampler.DE)]
    found = verdicts([*others, *own(39), *slow])
    assert found[evidence] is Verdict.PASS
    assert found[speed] is Verdict.OPEN  # one peer is missing
    assert verdicts(own(39))[evidence] is Verdict.OPEN  # three numbers of unknowns are missing
    last = trial(39, Sampler.STRETCH, 80.0, 500.0)
    assert verdicts([*others, *own(39), *slow, last])[speed] is Verdict.PASS
    assert verdicts([*own(39), *slow, last])[speed] is Verdict.OPEN
    quick = trial(39, Sampler.STRETCH, 30.0, 4000.0)
    assert verdicts([*others, *own(39), *slow, quick])[speed] is Verdict.FAIL
    assert verdicts([*others, *own(39, reference=-3.2)])[evidence] is Verdict.FAIL
    assert verdicts([*others, *own(39, reference=-3.09)])[evidence] is Verdict.OPEN
    sizes = {goal.text: goal.reached for goal in goals_of([*others, *own(39, reference=-3.09)])}
    assert sizes[evidence].startswith("at most 0.090 ± 0.014 (39 unknowns); 0.050 ± 0.014 (10), ")


def test_the_fastest_peer_is_one_with_an_estimate():
    """A bound, which the limit of time sets, stands beside it."""
    own = trial(39, Sampler.OURS, 10.0, 5000.0, -3.0)
    cut = trial(39, Sampler.DE, 60.0, 500.0)

    def reached(*made):
        goals = {goal.text: goal.reached for goal in goals_of([own, *made])}
        text = goals["at least 5 times faster than the best peer, 10, 19, 39 and 79 unknowns"]
        return text.partition("39 unknowns: ")[2].partition("; 79")[0]

    assert reached(cut, trial(39, Sampler.NUTS, 80.0, 4000.0)).startswith("8.0 (NUTS (NumPyro)), 1 other at least 6.0")
    assert reached(cut).startswith("more than 6.0 (1 peer, none with an estimate)")


def test_lines_of_recipes_are_counted_without_words():
    assert 5 < lines(Recipe.BAYESID) < lines(Recipe.SCIPY)


def test_recipes_with_mujoco_and_with_pinocchio_simulate_alike():
    """Twice the same equations, of which neither is the package's; MuJoCo fuses what is fixed to the base."""
    spec = mujoco.MjSpec.from_file(str(SERVICER3))
    spec.option.gravity = np.zeros(3)
    spec.body("base_link").add_freejoint()
    model = spec.compile()
    other = pin.buildModelFromUrdf(str(SERVICER3), pin.JointModelFreeFlyer())
    other.gravity.setZero()
    times = np.linspace(0.0, 20.0, 41)
    both = np.linspace(0.0, 20.0, 81)[:, None]
    speed, size = np.array([0.3, 0.5, 0.4]), np.array([0.4, -0.3, 0.5])
    joints = [size * np.sin(speed * both), size * speed * np.cos(speed * both), -size * speed**2 * np.sin(speed * both)]
    first = np.array([0.01, -0.02, 0.005])
    ours = with_sysid._simulate(model, mujoco.MjData(model), times, joints, first)
    theirs = with_scipy._simulate(other, other.createData(), times, joints, first)
    np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=1e-9)
    assert np.ptp(ours, axis=0).min() > 1e-4


def test_peers_on_the_same_task_found_the_same():
    """SciPy around Pinocchio and MuJoCo's toolbox minimise the same squares by other equations and other parameters."""
    made = read(REPORTS / "peers.jsonl.gz")
    for hidden in (False, True):
        first, second = (
            [item["result"] for item in made if item["task"].get("recipe") == name and item["task"]["hidden"] is hidden]
            for name in (Recipe.SCIPY, Recipe.SYSID)
        )
        assert len(first) == len(second) == 3
        for own, other in zip(first, second, strict=True):
            np.testing.assert_allclose(np.subtract(own["mean"], other["mean"]) / np.array(own["sd"]), 0.0, atol=0.01)
            np.testing.assert_allclose(own["sd"], other["sd"], rtol=0.01)


def test_the_report_is_that_of_the_trials(tmp_path):
    made = read(REPORTS / "peers.jsonl.gz")
    STUDY.write(made, tmp_path / "peers.pdf")
    rebuilt, kept = PdfText.read(tmp_path / "peers.pdf"), PdfText.read(REPORTS / "peers.pdf")
    for goal in goals_of(made):
        for text in (goal.text, goal.reached, goal.verdict.value):
            assert text in rebuilt
            assert text in kept
    assert broken_rules(tmp_path / "peers.pdf", full=False) == []


@pytest.mark.slow
def test_a_small_study(tmp_path):
    made = run_trials(attempt, tasks(full=False), tmp_path / "trials.jsonl", seed=3).complete()
    own, reference, moves, known, _ = made
    assert own["finished"]
    assert abs(own["log_evidence"] - reference["log_evidence"]) < 0.1
    assert own["effective_samples"] / own["evaluations"] > 5.0 * moves["effective_samples"] / moves["evaluations"]
    for result in (own, moves):
        assert np.abs(np.subtract(result["mean"], reference["mean"])).max() < 0.3
    errors = np.subtract(known["mean"], known["truth"]) / np.array(known["sd"])
    assert np.abs(errors).max() < 5.0
    STUDY.write(read(tmp_path / "trials.jsonl"), tmp_path / "peers.pdf")
    assert broken_rules(tmp_path / "peers.pdf", full=False) == []
