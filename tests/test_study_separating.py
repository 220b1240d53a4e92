"""The separating study: the pairs, what linear theory predicts of them, and one short flight."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import logsumexp

from bayesid._math.double_precision import in_double_precision
from bayesid.design.decision_rate import DecisionRate, log_evidence
from bayesid.design.rival_prior import RivalPrior
from bayesid.report.verdict_record import Share
from bayesid.robot.joint_state import JointState
from studies.common import mission
from studies.common.study import Verdict
from studies.separating.analysis import LAST, NEEDED, STAGES, Linearised, PairResult, Realised, rival_model
from studies.separating.pairs import ERROR, HAND, LEAK, LINK, PAIRS, PAYLOAD, PULSES
from studies.separating.report import _is_full, decided, judged

DURATION = 40.0


class Still:
    """An arm that rests."""

    def evaluate(self, time: np.ndarray) -> JointState:
        """Return the joint state."""
        rest = np.zeros((len(time), 6))
        return JointState(mission.start() + rest, rest, rest)


def linearised(first: np.ndarray, second: np.ndarray, data: np.ndarray | None = None) -> Linearised:
    """Signals of one wheel and one leak parameter, and of an unknown that the readings show as well."""
    signals = np.stack([first, second, 0.3 * np.ones_like(first)])
    score = signals @ (np.zeros_like(first) if data is None else data)
    names = ("wheel-momentum.x", "thruster-leak.torque.x", "initial-rate[0].x")
    return Linearised(signals @ signals.T, names, score)


def test_a_second_manoeuvre_shares_all_but_the_initial_rate():
    one = linearised(np.array([3.0, 1.0]), np.array([0.0, 2.0]))
    both = one.with_another(one)
    assert both.names[-1] == "second initial-rate[0].x"
    np.testing.assert_allclose(both.information[:2, :2], 2.0 * one.information[:2, :2])
    np.testing.assert_allclose(both.information[3, :3], [*one.information[2, :2], 0.0])


def test_the_evidence_is_that_of_normal_readings_whose_unknowns_are_marginalised():
    first, second, data = np.array([3.0, 1.0, 0.0]), np.array([0.0, 2.0, 1.0]), np.array([4.0, -2.0, 0.5])
    unit = np.array([2.0, 0.5, 1.0])  # coordinates per amplitude
    information, score = linearised(first, second, data).left(np.diag(unit), [0, 1])
    nuisance = np.eye(3) + 0.09 * np.ones((3, 3))
    scales = np.geomspace(1e-2, 1.0, 4001)

    def expected(signal: np.ndarray) -> float:
        values = []
        for scale in np.sqrt(scales[1:] * scales[:-1]):
            covariance = nuisance + scale**2 * np.outer(signal, signal)
            values.append(-0.5 * float(data @ np.linalg.solve(covariance, data) + np.linalg.slogdet(covariance)[1]))
        alone = -0.5 * float(data @ np.linalg.solve(nuisance, data) + np.linalg.slogdet(nuisance)[1])
        return float(logsumexp(values) - np.log(len(values)) - alone)

    grid = RivalPrior(np.ones((1, 1)), np.array([0]), np.array([[1e-2]])).grid
    for place, signal in enumerate((2.0 * first, 0.5 * second)):
        part = slice(place, place + 1)
        found = in_double_precision(log_evidence)(information[part, part], score[None, part], grid)
        assert float(found[0]) == pytest.approx(expected(signal), abs=0.01)


def test_a_leak_pushes_steadily_and_pulses_as_much_on_average():
    robot = mission.published_robot()
    rates = []
    for cause in (LEAK, PULSES, None):
        flown, hidden = (robot, {}) if cause is None else cause.hide(cause.amplitudes, robot)
        rates.append(mission.fly(Still(), flown, duration=DURATION, **hidden).rate)
    leak, pulses = rates[0] - rates[2], rates[1] - rates[2]
    np.testing.assert_allclose(leak[-1], 2.0 * leak[len(leak) // 2], rtol=0.02)
    np.testing.assert_allclose(pulses[-1], leak[-1], rtol=0.03)
    assert np.abs(pulses[10]).max() < 1e-9  # before the first pulse


def test_a_payload_and_an_error_change_the_bodies_as_stated():
    robot = mission.published_robot()
    carrying, _ = PAYLOAD.hide(PAYLOAD.amplitudes, robot)
    assert carrying.mass == pytest.approx(robot.mass + 5.0)
    assert carrying.link(HAND).inertial.mass == pytest.approx(robot.link(HAND).inertial.mass + 5.0)
    wrong, _ = ERROR.hide(ERROR.amplitudes, robot)
    assert wrong.link(LINK).inertial.mass != pytest.approx(robot.link(LINK).inertial.mass, rel=1e-2)
    assert wrong.link(HAND) == robot.link(HAND)


def test_the_change_of_an_error_is_predicted_whole_and_not_to_first_order():
    """Moments are exponential in the first coordinate, which scales them all: 0.1 of it by exp(0.2)."""
    robot = mission.published_robot()
    coordinates = np.stack([ERROR.amplitudes, ERROR.turned(np.random.default_rng(1))])
    step = 1e-4

    def moments(amplitudes: np.ndarray) -> np.ndarray:
        return ERROR.hide(amplitudes, robot)[0].link(LINK).inertial.vector

    derivatives = np.stack([(moments(row) - moments(-row)) / (2.0 * step) for row in step * np.eye(10)])
    for truth, linear in zip(coordinates, ERROR.linear(coordinates), strict=True):
        whole = moments(truth) - robot.link(LINK).inertial.vector
        np.testing.assert_allclose(linear @ derivatives, whole, rtol=1e-5, atol=1e-6 * np.abs(whole).max())


@pytest.mark.parametrize("pair", PAIRS.values(), ids=PAIRS)
def test_random_directions_have_the_stated_size(pair):
    rng = np.random.default_rng(3)
    for cause in pair.causes:
        turned = cause.turned(rng)
        assert turned.shape == cause.amplitudes.shape
        if cause is PAYLOAD:
            assert np.linalg.norm(turned[1:4]) == pytest.approx(np.linalg.norm(cause.amplitudes[1:4]))
        else:
            assert np.linalg.norm(turned) == pytest.approx(np.linalg.norm(cause.amplitudes))
        assert not np.allclose(turned, cause.amplitudes)


def result_with(count: int, total: int, predicted: float) -> tuple[PairResult, Realised]:
    """A pair of which one cause was identified in so many of the flights."""
    values = np.where(np.arange(total) < count, NEEDED + 0.1, NEEDED - 0.1)
    realised = Realised("thruster-leak", "stated", values, dict.fromkeys(STAGES, values))
    rates = {("thruster-leak", "stated", stage): DecisionRate(predicted, 0.0, 10**6) for stage in STAGES}
    return PairResult(PAIRS["wheel and leak"], {}, {}, rates, [realised]), realised


def test_a_rate_is_judged_by_its_interval_and_against_the_prediction():
    result, realised = result_with(360, 400, 0.9)
    assert (decided(realised, LAST).count, decided(realised, LAST).total) == (360, 400)
    assert judged(Share(340, 400)) is Verdict.FAIL
    assert judged(Share(360, 400)) is Verdict.OPEN
    assert judged(Share(380, 400)) is Verdict.PASS
    assert result.deviation(realised, LAST) == pytest.approx(0.0, abs=0.01)
    off, realised = result_with(320, 400, 0.9)
    assert off.deviation(realised, LAST) == pytest.approx(-0.1 / np.sqrt(0.09 / 400), rel=0.01)
    never, realised = result_with(0, 400, 0.0)
    assert never.deviation(realised, LAST) == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize("name", PAIRS)
def test_every_pair_has_a_model_and_a_truth(name):
    """A field that the truth does not know, such as a magnetic one without an inclination, would stop a long run."""
    pair, nominal = PAIRS[name], mission.published_robot()
    assert set(pair.labels) <= {effect.label for effect in rival_model(pair).effects}
    for cause in pair.causes:
        robot, hidden = cause.hide(cause.turned(np.random.default_rng(0)), nominal)
        pushed = [np.any(field(8.0, np.eye(3), np.zeros(3))[1]) for field in hidden.get("fields", ())]
        heavier = [np.any(robot.link(k).inertial.vector != nominal.link(k).inertial.vector) for k in (HAND, LINK)]
        assert any((*pushed, *heavier, "rotor" in hidden))


@pytest.mark.usefixtures("slow")
def test_realised_rates_are_those_that_the_study_predicts(tmp_path):
    """On one short search, with decisions in few flights; a store of trials makes it resume."""
    from bayesid.design import Search
    from studies.separating.analysis import run

    options = {
        "points": 3,
        "search": Search(starts=1, iterations=2),
        "flights": {"wheel and leak": 1},
        "trials": tmp_path / "trials.jsonl",
    }
    result = run(**options)
    (pair,) = result.pairs
    assert pair.designs["separation"].costs["separation"] <= pair.designs["d-optimal"].costs["separation"]
    assert {(item.label, item.direction) for item in pair.realised} == {case[:2] for case in pair.predicted}
    assert all(abs(pair.deviation(item, stage)) < 4.0 for item in pair.realised for stage in STAGES)
    stored = (tmp_path / "trials-wheel-and-leak.jsonl").read_text().splitlines()
    assert len(stored) == 1 + 4
    assert not _is_full(result)
