"""Swings to which the base reacts much: the reaction against Pinocchio and in closed form, the swing against others."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from search_robots import search_problem
from test_design import plan as flywheel_plan

from bayesid.design import DOptimal, Limits, PaperExcitation, Problem
from bayesid.design.search_starts import _chosen, _largest, base_rates, reacting_swing
from bayesid.robot.robot import Robot
from studies.truth.bodies import BRANCHED, SERVICER4


@pytest.mark.parametrize("file", [SERVICER4, BRANCHED], ids=["revolute", "slides and branches"])
def test_a_floating_base_keeps_both_momenta_zero(file) -> None:
    """Pinocchio's mass matrix of the free-flyer: the momenta of base and joints cancel."""
    robot = Robot.from_urdf(file)
    rng = np.random.default_rng(1)
    postures = rng.uniform(-0.5, 0.5, (3, len(robot.joints)))
    data = robot.model.createData()
    for posture, rates in zip(postures, base_rates(robot, postures), strict=True):
        whole = pin.integrate(robot.model, pin.neutral(robot.model), np.concatenate([np.zeros(6), posture]))
        matrix = pin.crba(robot.model, data, whole)
        matrix = np.triu(matrix) + np.triu(matrix, 1).T
        expected = -np.linalg.solve(matrix[:6, :6], matrix[:6, 6:])[3:]
        np.testing.assert_allclose(rates, expected, rtol=1e-9, atol=1e-12)


def test_a_flywheel_turns_its_base_back_by_its_share() -> None:
    robot = flywheel_plan().model.robot
    np.testing.assert_allclose(base_rates(robot, np.zeros((1, 1)))[0, :, 0], [0.0, 0.0, -0.5 / 3.5], atol=1e-12)


def test_no_other_joint_speeds_turn_the_base_more_within_the_same_limits() -> None:
    problem = search_problem("four")
    robot, limits = problem.plan.model.robot, problem.limits
    rng = np.random.default_rng(2)
    postures = rng.uniform(-1.5, 1.5, (4, 4))
    rates, speeds = _largest(problem, postures, np.arange(4))
    turned = base_rates(robot, postures)
    largest = np.array([joint.velocity for joint in robot.joints])
    frame = robot.model.getFrameId(problem.plan.tip.name)
    for posture, rate, speed, reaction in zip(postures, rates, speeds, turned, strict=True):
        # Pinocchio's Jacobian of the tip, the base held
        whole = pin.integrate(robot.model, pin.neutral(robot.model), np.concatenate([np.zeros(6), posture]))
        jacobian = pin.computeFrameJacobian(
            robot.model, robot.model.createData(), whole, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        )[:, 6:]
        scaled = np.concatenate(
            [jacobian[:3] / limits.tip_speed, jacobian[3:] / limits.tip_rate, np.diag(1.0 / largest)]
        )
        assert np.linalg.norm(scaled @ speed) == pytest.approx(1.0)
        assert np.linalg.norm(reaction @ speed) == pytest.approx(rate)
        others = rng.normal(size=(4, 2000))
        others /= np.linalg.norm(scaled @ others, axis=0)
        assert np.linalg.norm(reaction @ others, axis=0).max() <= rate * (1.0 + 1e-9)


def test_a_swing_begins_and_ends_at_rest_and_follows_from_its_seed() -> None:
    problem = search_problem("four")
    family = problem.plan.family
    parameters = reacting_swing(problem, np.random.default_rng(3))
    np.testing.assert_array_equal(parameters, reacting_swing(problem, np.random.default_rng(3)))
    ends = family.motion(parameters).evaluate(np.array([0.0, family.duration]))
    np.testing.assert_allclose(ends.position, np.tile([0.0, -0.6, 1.0, -0.4], (2, 1)), atol=1e-9)
    np.testing.assert_allclose(ends.velocity, 0.0, atol=1e-9)


def test_the_posture_is_one_of_the_few_where_the_base_turns_most() -> None:
    problem = search_problem("four")
    start = np.array([0.0, -0.6, 1.0, -0.4])
    chosen, speeds = _chosen(problem, start, np.arange(4), np.random.default_rng(3))
    others = start + 0.8 * np.random.default_rng(5).normal(size=(400, 4))
    (own, *drawn), (first, *_) = _largest(problem, np.vstack([chosen, np.clip(others, -2.0, 2.0)]), np.arange(4))
    np.testing.assert_allclose(np.abs(speeds), np.abs(first))
    assert own > np.quantile(drawn, 0.95)


def test_joints_that_the_family_holds_stay() -> None:
    """Without limits on the tip or on speeds, as on a robot that states none."""
    own = search_problem("four")
    family = PaperExcitation([0.0, -0.6, 1.0, -0.4], 60.0, (1, 3))
    held = Problem(own.plan.__class__(**{**vars(own.plan), "family": family}), Limits(), (DOptimal(),))
    motion = family.motion(reacting_swing(held, np.random.default_rng(4)))
    position = motion.evaluate(np.linspace(0.0, 60.0, 61)).position
    np.testing.assert_allclose(np.ptp(position[:, [0, 2]], axis=0), 0.0, atol=1e-12)
    assert np.ptp(position[:, [1, 3]], axis=0).min() > 1e-3
