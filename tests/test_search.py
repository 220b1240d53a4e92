"""The search for a manoeuvre: sensitivities against other routes, self-consistency, encoder noise, cautious plans."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from search_robots import search_problem
from test_design import PARAMETERS
from test_design import plan as flywheel_plan

from bayesid._math.arrays import Floats
from bayesid.design import DOptimal, Fourier, Limits, Problem, Search, Store, optimise
from bayesid.design.design_result import sample_times
from bayesid.design.encoder_information import encoder_directions
from bayesid.design.flight import Flight
from bayesid.design.go_no_go import plan_to_go
from bayesid.design.predicted_posterior import planned_manoeuvre, planned_posterior, predict
from bayesid.design.refine import Shared, Task, fitted_to_fine_limits, refine
from bayesid.design.search_starts import exchanged, random_start
from bayesid.robot.composite_tables import composite_rows, row_sensitivity, screws
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics


@pytest.fixture(scope="module")
def planar() -> Problem:
    """A short manoeuvre of two joints by four functions each."""
    return search_problem("planar", points=3, duration=30.0)


def test_rows_change_with_the_joints_as_by_finite_differences() -> None:
    robot = search_problem("four").plan.model.robot
    rng, step = np.random.default_rng(0), 1e-6
    state = JointState(*rng.normal(size=(3, 2, 4)))
    moved = kinematics(robot, state)
    slopes = np.asarray(row_sensitivity(robot, moved, screws(robot, moved), {}))
    for derivative in range(3):
        for joint in range(4):
            pair = []
            for sign in (1.0, -1.0):
                changed = [part.copy() for part in state]
                changed[derivative][:, joint] += sign * step
                pair.append(composite_rows(robot, kinematics(robot, JointState(*changed))))
            difference = (pair[0] - pair[1]) / (2.0 * step)
            np.testing.assert_allclose(slopes[derivative, :, joint], difference, rtol=1e-6, atol=1e-6)


@pytest.mark.usefixtures("slow")
def test_the_information_is_that_of_the_likelihood(planar: Problem) -> None:
    """A plan that simulates every sample, against the Jacobian of the whitened residual."""
    plan = replace(planar.plan, thinning=1)
    parameters = 0.3 * np.random.default_rng(1).normal(size=plan.family.size)
    time = sample_times(plan.family.duration, plan.interval)
    information = np.asarray(jax.jit(lambda p, z: Flight(plan, p, z).information())(parameters, jnp.zeros(16)))
    motion = plan.family.motion(parameters)
    manoeuvre = planned_manoeuvre(plan.model, motion, time, "own", {0: 1e-9}, plan.attitude)
    predicted = predict(planned_posterior(plan.model, [manoeuvre]))
    left = np.linalg.inv(information + np.eye(16))[:10, :10]
    np.testing.assert_allclose(np.sqrt(np.diag(0.01 * left) / np.diag(predicted.relative)), 1.0, atol=2e-3)


def test_errors_of_an_encoder_hide_a_swinging_rate_in_closed_form() -> None:
    """A flywheel's speed error turns the base by its share: a cosine of the position is a sine of the rate."""
    plan = replace(flywheel_plan(), encoder_sigma=(3e-4,))
    explained = encoder_directions(plan, PARAMETERS, np.zeros((len(plan.samples), 3)))
    share, end = 0.5 / 3.5, plan.family.duration
    for periods in (2, 3, 4):
        w = 2.0 * np.pi * periods / end
        signal = np.zeros((len(plan.samples), 3))
        signal[:, 2] = np.sin(w * plan.samples) / plan.sigma[2]
        hidden = explained.T @ signal.ravel()
        left = signal.ravel() @ signal.ravel() - hidden @ hidden
        expected = 0.5 * (len(plan.samples) - 1) / (plan.sigma[2] ** 2 + (share * w * 3e-4) ** 2)
        assert left == pytest.approx(expected, rel=0.05)  # the ends count double in the encoders' cosines


@pytest.mark.slow
def test_a_search_is_the_same_in_threads_and_keeps_every_limit(planar: Problem) -> None:
    search, criterion = Search(starts=6, iterations=12, exchanges=3, loosened=3.0), planar.criteria[0]
    alone = optimise(planar, criterion, np.random.default_rng(2), search)
    with ThreadPoolExecutor(2) as executor:
        threads = replace(search, executor=executor)
        together = optimise(planar, criterion, np.random.default_rng(2), threads)
    np.testing.assert_array_equal(alone.parameters, together.parameters)
    assert all(item.kept for item in planar.reached(alone.parameters))
    family = planar.plan.family
    finer = family.motion(alone.parameters).evaluate(np.linspace(0.0, family.duration, 5000))
    for index, joint in enumerate(planar.plan.model.robot.joints):
        assert finer.position[:, index].min() >= joint.lower
        assert finer.position[:, index].max() <= joint.upper
        assert np.abs(finer.velocity[:, index]).max() <= joint.velocity * (1.0 + 1e-9)


@pytest.mark.slow
def test_a_descent_may_be_sent_to_another_process(planar: Problem) -> None:
    start = random_start(planar, np.random.default_rng(3))
    content = pickle.dumps(Task(Shared(planar), planar.criteria[0], [], start, 3, 1e-5))
    task, again = pickle.loads(content), pickle.loads(content)
    assert "_fractions" not in task.shared.problem.__dict__
    np.testing.assert_array_equal(task.start, start)
    assert again.shared is task.shared  # it is compiled once


@pytest.mark.slow
def test_an_exchange_takes_whole_courses_of_few_joints(planar: Problem) -> None:
    rng = np.random.default_rng(11)
    motions = [random_start(planar, rng) for _ in range(2)]
    groups = planar.plan.family.groups
    assert [list(groups).count(joint) for joint in (0, 1)] == [len(groups) // 2] * 2
    whole = 0
    for _ in range(20):
        child = exchanged(planar, motions, rng)
        kept = [[bool((child == motion)[groups == joint].all()) for motion in motions] for joint in (0, 1)]
        assert sum(any(item) for item in kept) >= 1  # of two joints at most one is exchanged
        whole += sum(any(item) for item in kept) == 2
    assert whole > 0  # some take the other motion's course, the rest that of a random one


@pytest.mark.slow
def test_a_descent_within_loosened_limits_ends_within_the_limits(planar: Problem) -> None:
    start = random_start(planar, np.random.default_rng(12))
    task = Task(Shared(planar), planar.criteria[0], [], start, 10, 1e-3)
    plain, loosened = refine(task), refine(replace(task, loosened=3.0))
    assert planar.fractions(loosened.parameters)[0].max() <= 1.0 + 1e-5
    assert np.isfinite(loosened.cost)
    assert loosened.evaluations > plain.evaluations


@pytest.mark.slow
def test_exchanges_are_made_after_the_starts_and_the_best_three_of_all_are_followed(planar: Problem) -> None:
    criterion, kept = planar.criteria[0], {}
    search = Search(starts=2, iterations=8, exchanges=7)

    def keep(name: str, parameters: Floats, cost: float, evaluations: int) -> None:
        kept[name] = cost

    found = optimise(planar, criterion, np.random.default_rng(6), search, keep=keep)
    assert sorted(kept) == ["0.0", "0.1", *(f"1.{k}" for k in range(3)), *(f"2.{k}" for k in range(6)), "3.0"]
    assert np.all(np.diff(found.costs) > 0.0)  # two that end alike count as one
    assert found.cost < sorted(kept[name] for name in kept if name[0] != "1")[2]  # three were followed


def test_a_richer_family_begins_where_the_poorer_one_ends(planar: Problem) -> None:
    start, duration = np.array([0.0, -0.6]), 30.0
    poor, rich = (Fourier(start, (0, 1), duration, harmonics) for harmonics in (2, 4))
    parameters = 0.2 * np.random.default_rng(4).normal(size=poor.size)
    times = np.linspace(0.0, duration, 77)
    same = rich.motion(rich.nearest(poor.motion(parameters))).evaluate(times)
    for mine, theirs in zip(same, poor.motion(parameters).evaluate(times), strict=True):
        np.testing.assert_allclose(mine, theirs, atol=1e-10)


@pytest.mark.usefixtures("slow")
def test_a_search_finds_what_three_descents_from_other_starts_find() -> None:
    """Within 2 % per parameter, the geometric mean of the standard deviations, all limits kept between the instants."""
    own = search_problem("four")
    found = optimise(own, own.criteria[0], np.random.default_rng(0))
    assert all(item.kept for item in own.reached(found.parameters))
    rng, shared = np.random.default_rng(77), Shared(own)
    tasks = [Task(shared, own.criteria[0], [], random_start(own, rng), 400, 1e-3) for _ in range(3)]
    others = [fitted_to_fine_limits(replace(task, start=refine(task).parameters)) for task in tasks]
    assert np.exp((found.cost - min(other.cost for other in others)) / 10.0) < 1.02


@pytest.mark.usefixtures("slow")
def test_a_plan_is_made_smaller_until_it_may_be_flown(planar: Problem) -> None:
    """A wide prior and a limit on the base that any motion of the size of the others would break."""
    model = planar.plan.model
    wide = replace(model, priors=(replace(model.priors[0], spread=1.5),))
    limits = Limits(tip_speed=0.05, base_rotation=1e-3)
    own = Problem(replace(planar.plan, model=wide), limits, (DOptimal(),))
    attempts = plan_to_go(own, own.criteria[0], np.random.SeedSequence(6), Search(2, 2), Store.forgetful())
    last = attempts[-1]
    assert last.go
    assert not last.broken
    assert np.abs(last.optimum.parameters - own.plan.family.centre).max() > 0.0
