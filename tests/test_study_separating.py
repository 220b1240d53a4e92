"""The separating study: what linear theory expects of the rivals, and one short flight."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bayesid.report.verdict_record import Share
from bayesid.robot.joint_state import JointState
from studies.common import mission
from studies.common.study import Verdict
from studies.separating.analysis import TRUTHS, Expected, Linearised, expectations, flown, realise, references
from studies.separating.report import LAST, RIVALRY, _decided, _shown

DURATION = 40.0


class Still:
    """An arm that rests."""

    def evaluate(self, time: np.ndarray) -> JointState:
        """Return the joint state."""
        rest = np.zeros((len(time), 6))
        return JointState(mission.start() + rest, rest, rest)


def linearised(first: np.ndarray, second: np.ndarray, data: np.ndarray | None = None) -> Linearised:
    """Signals of one wheel and one leak parameter, and of an unknown that is never seen."""
    signals = np.stack([first, second, np.zeros_like(first)])
    score = signals @ (np.zeros_like(first) if data is None else data)
    names = ("wheel-momentum.x", "thruster-leak.torque.x", "initial-rate[0].x")
    return Linearised(signals @ signals.T, names, score)


def test_noncentralities_are_those_of_two_signals():
    first, second = np.array([3.0, 1.0, 0.0]), np.array([0.0, 2.0, 1.0])
    found = linearised(first, second).expect("wheel-momentum", np.array([2.0]))
    assert found.alone == pytest.approx(4.0 * first @ first)
    left = first - second * (first @ second) / (1.0 + second @ second)  # the rival has a prior
    assert found.apart == pytest.approx(4.0 * first @ left)

    # by hand: mean log evidence of y = s + noise under N(0, 1 + signal signal')
    def evidence(signal: np.ndarray) -> float:
        covariance = np.eye(3) + np.outer(signal, signal)
        mean = 2.0 * first @ np.linalg.solve(covariance, 2.0 * first) + np.trace(np.linalg.inv(covariance))
        return -0.5 * float(mean + np.linalg.slogdet(covariance)[1])

    assert found.log_factor == pytest.approx(evidence(first) - evidence(second))


def test_flights_above_a_limit_follow_from_mean_and_deviation():
    found = Expected(alone=9.0, apart=4.0, log_factor=2.2 + 2.0 * 1.2816)
    assert found.exceeding(2.2) == pytest.approx(0.9, abs=1e-4)
    assert Expected(9.0, 0.0, 1.0).exceeding(2.2) == 0.0


def test_directions_count_where_flights_enough_are_above_the_limit():
    """What the prior costs is included: the part that the rival cannot imitate alone would do in every direction."""
    costly, cheap = Expected(60.0, 20.0, 2.5), Expected(60.0, 20.0, 10.0)
    result = SimpleNamespace(directions={("thruster-leak", LAST): [costly] * 60 + [cheap] * 140})
    assert min(costly.energy, cheap.energy) > RIVALRY
    share = _shown(result, "thruster-leak", LAST)
    assert (share.count, share.total) == (140, 200)
    assert _decided(share) is Verdict.FAIL
    assert _decided(Share(180, 200)) is Verdict.OPEN
    assert _decided(Share(200, 200)) is Verdict.PASS


def test_a_second_manoeuvre_shares_all_but_the_initial_rate():
    one = linearised(np.array([3.0, 1.0]), np.array([0.0, 2.0]))
    both = one.with_another(one)
    assert both.names[-1] == "second initial-rate[0].x"
    np.testing.assert_allclose(both.information[:2, :2], 2.0 * one.information[:2, :2])
    np.testing.assert_allclose(both.information[3, :3], 0.0)


def test_evidence_is_that_of_the_normal_distribution():
    first, second, data = np.array([3.0, 1.0, 0.0]), np.array([0.0, 2.0, 1.0]), np.array([1.0, -2.0, 0.5])
    found = linearised(first, second, data)

    def evidence(signal: np.ndarray) -> float:
        covariance = np.eye(3) + np.outer(signal, signal)
        return -0.5 * float(data @ np.linalg.solve(covariance, data) + np.linalg.slogdet(covariance)[1])

    difference = found.log_evidence([0, 2]) - found.log_evidence([1, 2])
    assert difference == pytest.approx(evidence(first) - evidence(second))


def test_a_leak_pushes_steadily():
    leak, nothing = (flown(Still(), name, TRUTHS["thruster-leak"], duration=DURATION) for name in ("thruster-leak", ""))
    pushed = leak.rate - nothing.rate
    np.testing.assert_allclose(pushed[-1], 2.0 * pushed[len(pushed) // 2], rtol=0.02)


@pytest.mark.usefixtures("slow")
def test_realised_factors_are_those_that_linear_theory_expects():
    motions = dict.fromkeys(("first", "d-optimal", "separation"), mission.flight_manoeuvre(4.0))
    known = references(motions, arm_spread=0.0)
    expected, _ = expectations(known, seed=0)
    for item in realise(motions, known, noises=3, seed=5, arm_spread=0.0):
        for stage, values in item.factors.items():
            own = expected[item.truth, stage]
            assert values.mean() == pytest.approx(own.log_factor, abs=4.0 * own.sd / np.sqrt(3.0) + 1.0), stage
