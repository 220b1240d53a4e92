"""The criterion that distinguishes rivals: its evidence, rates, gradient, prior, and its manoeuvre beside others."""

from __future__ import annotations

from dataclasses import replace

import jax
import numpy as np
import pytest
from scipy.special import digamma, logsumexp
from test_design import PARAMETERS, Growing, Steady, flown, plan

from bayesid._io.errors import InputError
from bayesid._math.double_precision import in_double_precision
from bayesid.design import DOptimal, Limits, Problem, Search, Separation, design
from bayesid.design.decision_rate import DecisionRate, RivalDraws, decided_margins, log_evidence, smooth_rates
from bayesid.design.design_result import with_starts
from bayesid.design.go_no_go import ATTEMPTS, _best_by_others, plan_to_go
from bayesid.design.rival_prior import MOMENT_REACHES, UNRESOLVED, RivalPrior, relative_floors
from bayesid.design.search_starts import adapted_to_family
from bayesid.design.trajectory_search import Store
from bayesid.diagnosis.candidates.linear_cause import REACHES, moment_spreads
from bayesid.diagnosis.evidence.gram import Gram
from bayesid.diagnosis.evidence.scales import UNRESOLVED_GAIN, AmplitudeGroup, CandidateCause, range_of
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.simulation.effects import Effect, Parameter, Payload, PhysicalBound, ThrusterLeak

LEAK = RivalPrior(np.ones((1, 6)), np.array([0, 0, 0, 1, 1, 1]), np.array([[1e-3, 3e-4]]))
WHEEL = RivalPrior(np.ones((1, 3)), np.zeros(3, dtype=int), np.array([[2e-3]]))


def columns(rng: np.random.Generator) -> np.ndarray:
    """Signals of a leak and of wheels in 200 whitened readings, which partly agree."""
    signals = rng.normal(size=(200, 9)) * np.array([*[8.0] * 3, *[20.0] * 3, *[15.0] * 3])
    signals[:, 6:] += 0.7 * signals[:, 3:6]
    return signals


def group(name: str, prior: RivalPrior, scale: int, form: int = 0) -> AmplitudeGroup:
    """The same prior as a diagnosis has it."""
    own = prior.scale_of == scale
    return AmplitudeGroup(name, 1.0, float(prior.floors[form, scale]), prior.spreads[form, own] ** 2)


@pytest.mark.slow
def test_the_evidence_is_that_of_a_diagnosis():
    rng = np.random.default_rng(3)
    signals = columns(rng)
    body = RivalPrior(np.array([[1.0, 0.6, 0.4], [1.0, 0.2, 0.1]]), np.zeros(3, dtype=int), np.array([[1e-3], [3e-3]]))
    gram = Gram(signals.T @ signals, np.zeros(9), {"N": np.arange(3), "N m": np.arange(3, 6), "wheel": np.arange(6, 9)})
    causes = {
        "leak": CandidateCause("leak", (group("N", LEAK, 0), group("N m", LEAK, 1))),
        "wheel": CandidateCause("wheel", (group("wheel", WHEEL, 0),)),
        "body": CandidateCause("body", (group("wheel", body, 0),), others=((group("wheel", body, 0, 1),),)),
    }
    for name, prior, part in (("leak", LEAK, slice(0, 6)), ("wheel", WHEEL, slice(6, 9)), ("body", body, slice(6, 9))):
        for size in (0.003, 0.03):
            readings = signals[:, part] @ (size * rng.normal(size=signals[:, part].shape[1])) + rng.normal(size=200)
            score = signals.T @ readings
            expected = SetEvidence(Gram(gram.matrix, score, gram.groups), [causes[name]]).log_evidence([name])
            own = gram.matrix[part, part]
            found = float(in_double_precision(log_evidence)(own, score[None, part], prior.grid)[0])
            assert found == pytest.approx(expected, abs=0.05), (name, size)


def test_the_prior_is_that_of_a_diagnosis():
    assert (MOMENT_REACHES, UNRESOLVED) == (REACHES, UNRESOLVED_GAIN)
    leak = RivalPrior.of(ThrusterLeak())
    assert leak.scale_of.tolist() == [0, 0, 0, 1, 1, 1]
    payload = RivalPrior.of(Payload("part"))
    units = [quantity.unit for quantity in Payload("part").amplitude_quantities]
    spreads = np.sqrt(moment_spreads(units, 3.0)) / 3.0 ** np.array([("kg", "kg m", "kg m2").index(u) for u in units])
    np.testing.assert_allclose(payload.spreads, spreads)
    information = np.diag([4.0, 9.0, 1.0, 400.0, 100.0, 1e-5])
    floors = relative_floors(leak, information)
    bounds = [AmplitudeGroup("N", 1.0), AmplitudeGroup("N m", 1.0)]
    np.testing.assert_allclose(floors[0], [range_of(*pair).low for pair in zip(bounds, (9.0, 400.0), strict=True)])


def test_drawn_amplitudes_are_log_uniform_in_scale_and_normal_in_direction():
    drawn = RivalDraws.independent([LEAK, WHEEL], 40_000, np.random.default_rng(2)).amplitudes[0]
    logs = np.log(np.linalg.norm(drawn[:, :3], axis=1))
    shift = 0.5 * (np.log(2.0) + digamma(1.5))  # mean logarithm of a chi of three degrees of freedom
    assert logs.mean() == pytest.approx(0.5 * np.log(1e-3) + shift, abs=0.05)
    directions = drawn[:, :3] / np.linalg.norm(drawn[:, :3], axis=1, keepdims=True)
    np.testing.assert_allclose(directions.T @ directions / len(drawn), np.eye(3) / 3.0, atol=0.01)


def reference_log_evidence(readings: np.ndarray, signals: np.ndarray, prior: RivalPrior, scales: int) -> np.ndarray:
    """The same from the covariance of the readings, on a fine grid of scales, relative to no signal."""
    axes = [np.geomspace(floor, 1.0, scales + 1) for floor in prior.floors[0]]
    centres = [np.sqrt(axis[1:] * axis[:-1]) for axis in axes]
    values = []
    for point in np.stack(np.meshgrid(*centres, indexing="ij"), axis=-1).reshape(-1, len(axes)):
        wide = signals * point[prior.scale_of]
        covariance = np.eye(len(signals)) + wide @ wide.T
        fitted = readings @ np.linalg.inv(covariance)
        half = 0.5 * np.linalg.slogdet(covariance)[1]
        values.append(0.5 * ((readings**2).sum(axis=1) - (fitted * readings).sum(axis=1)) - half)
    return logsumexp(values, axis=0) - np.log(len(values))


@pytest.mark.slow
def test_the_predicted_rate_is_that_of_decisions_on_simulated_readings():
    """Readings are drawn, whitened, beside two nuisances of standard normal prior that are marginalised."""
    rng = np.random.default_rng(11)
    signals, nuisance = columns(rng)[:40], 3.0 * rng.normal(size=(40, 2))
    one = RivalPrior(np.ones((1, 6)), np.zeros(6, dtype=int), np.array([[1e-3]]))
    white = np.linalg.cholesky(np.linalg.inv(np.eye(40) + nuisance @ nuisance.T)).T
    seen = white @ signals
    priors, parts = [one, WHEEL], [slice(0, 6), slice(6, 9)]
    predicted = decided_margins(seen.T @ seen, priors, RivalDraws.independent(priors, 8000, rng)) >= 0.0
    for index, (prior, part) in enumerate(zip(priors, parts, strict=True)):
        count = 3000
        scales = np.exp(np.log(prior.floors[0, 0]) * rng.uniform(size=(count, 1)))
        amplitudes = scales * rng.normal(size=(count, len(prior.scale_of)))
        readings = amplitudes @ signals[:, part].T + rng.normal(size=(count, 2)) @ nuisance.T
        readings = (readings + rng.normal(size=(count, 40))) @ white.T
        values = [
            reference_log_evidence(readings, seen[:, own], rival, 40) for rival, own in zip(priors, parts, strict=True)
        ]
        decided = values[index] - values[1 - index] >= np.log(9.0)
        left, right = DecisionRate.of(predicted[index]), DecisionRate.of(decided)
        assert 0.1 < right.rate < 0.95
        assert abs(left.rate - right.rate) < 3.0 * np.hypot(left.standard_error, right.standard_error)


@pytest.mark.slow
def test_the_blurred_rate_of_a_search_is_near_the_exact_one():
    signals = columns(np.random.default_rng(5))
    priors = [LEAK, WHEEL]
    exact = decided_margins(signals.T @ signals, priors, RivalDraws.independent(priors, 6000, np.random.default_rng(1)))
    even = decided_margins(signals.T @ signals, priors, RivalDraws.even(priors, 1024, np.random.default_rng(2)))
    blurred = np.asarray(in_double_precision(smooth_rates)(even))
    np.testing.assert_allclose(blurred, (exact >= 0.0).mean(axis=1), atol=0.025)


def test_rivals_that_act_alike_are_never_decided():
    signal = np.random.default_rng(1).normal(size=(50, 3))
    alike = np.hstack([signal, signal])
    margins = decided_margins(
        alike.T @ alike, [WHEEL, WHEEL], RivalDraws.independent([WHEEL, WHEEL], 500, np.random.default_rng(0))
    )
    np.testing.assert_allclose(margins, -np.log(9.0), atol=0.01)


class Bent(Effect):
    """A rate with an error that grows with its square, which only a manoeuvre brings out and no inertia imitates."""

    name = "bent"
    parameters = (Parameter("z", "s/rad", 1.0),)

    def read(self, values, readings):
        return readings.replace(rate=readings.rate + values[0] * readings.rate**2)


@pytest.fixture(scope="module")
def problem() -> Problem:
    own = plan(effects=(Steady(), Bent()))
    whole = Problem(own, Limits(joint_speed=0.5), (DOptimal(), Separation(("steady", "bent"))))
    return adapted_to_family(whole, np.random.default_rng(1))


@pytest.mark.slow
def test_the_gradient_is_that_of_finite_differences(problem: Problem):
    criterion = problem.criteria[1]
    rng = np.random.default_rng(6)
    for direction in rng.normal(size=(3, 4)):
        step = 1e-5 * direction
        slope = problem.cost(criterion, PARAMETERS)[1] @ direction
        ahead, behind = (problem.cost(criterion, PARAMETERS + sign * step)[0] for sign in (1.0, -1.0))
        assert abs(slope) > 1e-3
        assert slope == pytest.approx((ahead - behind) / 2e-5, rel=1e-4)


@pytest.mark.slow
def test_the_manoeuvre_is_never_worse_than_the_d_optimal_one(problem: Problem):
    both = design(problem, 3, {0: 1e-6}, Search(starts=1, iterations=8))
    costs = {item.criterion: item.costs["separation"] for item in both}
    assert costs["separation"] <= costs["d-optimal"]
    rates = [min(item.decisions.values()) for item in both]
    assert all(rate.draws == Separation.REPORTED for rate in rates)
    assert costs["separation"] < problem.cost(problem.criteria[1], problem.plan.family.centre)[0]


@pytest.mark.slow
def test_a_loop_never_plans_a_worse_manoeuvre_than_the_d_optimal_one(problem: Problem):
    alone = problem.judged_by(problem.criteria[1:])
    effort, store = Search(starts=1, iterations=8), Store.forgetful()
    (first, *_) = plan_to_go(alone, alone.criteria[0], np.random.SeedSequence(3), effort, store)
    seed = np.random.SeedSequence(3)
    seed.spawn(ATTEMPTS)
    (best,) = _best_by_others(alone, alone.criteria[0], seed, effort, store)
    assert first.optimum.cost <= problem.cost(problem.criteria[1], best)[0] + 1e-9


def test_the_d_optimal_manoeuvre_is_sought_where_only_separation_is_asked_for():
    own = plan(effects=(Steady(), Bent()))
    alone = Problem(own, Limits(joint_speed=0.5), (Separation(("steady", "bent")),))
    assert [criterion.name for criterion in with_starts(alone).criteria] == ["separation", "d-optimal"]
    assert with_starts(with_starts(alone)) == with_starts(alone)


@pytest.mark.slow
def test_the_information_is_what_other_unknowns_leave_in_units_of_the_largest_sizes():
    own = plan(effects=(Steady(), Growing()), unknown=False)
    criterion = Separation(("steady", "growing"))
    (information,) = in_double_precision(criterion.shown)(own, flown(own))
    signals = np.stack([np.ones(len(own.samples)), own.samples]) * 3e-3 / own.sigma[2]  # three prior deviations
    np.testing.assert_allclose(information, signals @ signals.T, rtol=1e-6)
    stated = replace(own, bounds={"steady": [PhysicalBound("rad/s", 6e-3, "Stated in the study.")]})
    (wider,) = in_double_precision(criterion.shown)(stated, flown(own))
    np.testing.assert_allclose(wider, information * np.array([[4.0, 2.0], [2.0, 1.0]]), rtol=1e-6)
    with pytest.raises(InputError, match="no effect 'slosh'"):
        Separation(("steady", "slosh")).shown(own, flown(own))
    with pytest.raises(InputError, match="adapted_to_family"):
        criterion.cost(own, flown(own))


@pytest.mark.slow
def test_a_payload_is_weighed_in_the_moments_in_which_it_is_linear():
    """The plan has it in log-Cholesky coordinates; in its moments the information is that of an effect with these."""
    payload = Payload("part").attach(plan().model.robot)
    bias = Steady()
    shown = []
    for effect in (payload, payload.in_amplitudes()):
        own = plan(effects=(bias, effect), unknown=False)
        shown.append(in_double_precision(Separation(("steady", "payload:part")).shown)(own, flown(own))[0])
    scale = np.sqrt(np.abs(np.diag(shown[1])) + 1e-3)
    np.testing.assert_allclose(shown[0] / np.outer(scale, scale), shown[1] / np.outer(scale, scale), atol=1e-3)
    assert np.diag(shown[0]).max() > 1.0


@pytest.mark.slow
def test_a_payload_is_weighed_while_a_search_is_traced():
    own = plan(effects=(Steady(), Payload("part").attach(plan().model.robot)), unknown=False)
    criterion = Separation(("steady", "payload:part"))
    change, _ = in_double_precision(criterion.coordinates)(own)
    traced = in_double_precision(jax.jit(lambda scale: scale * criterion.coordinates(own)[0]))(1.0)
    np.testing.assert_allclose(traced, change)
