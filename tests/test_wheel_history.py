"""A wheel that runs up and down unrecorded, against a step-by-step integration with Pinocchio."""

from __future__ import annotations

import numpy as np
import pytest

from bayesid._io.errors import InputError
from bayesid.robot.robot import Robot
from bayesid.simulation.effects import WheelHistory, WheelMomentum, create
from bayesid.simulation.effects.wheel_history import KNOTS
from bayesid.simulation.model import Model
from bayesid.simulation.sensors import Sensor, SensorKind, White
from studies.truth import mujoco as mj
from studies.truth import stepwise as ref
from studies.truth.bodies import SERVICER3
from tests.simulated import simulated

END, TIMES = 46.0, np.arange(0.0, 60.01, 0.5)
TURNS = np.linspace(0.0, END, KNOTS)
MOMENTUM = np.random.default_rng(3).uniform(-0.6, 0.6, KNOTS)
POINT, RATE0 = (0.2, -0.1, 0.3), (0.02, -0.03, 0.015)
MOTION = mj.smooth_motion(3, 60.0, 5, amplitude=0.5, frequencies=(0.03, 0.06), ramp=10.0)


@pytest.mark.slow
@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_the_history_is_that_of_pinocchio(axis, formula_motion):
    """The error is below 1e-5 of what the wheel does; the momentum stays constant after the last knot."""
    unit = np.eye(3)["xyz".index(axis)]

    def wheel(time: float) -> tuple[np.ndarray, np.ndarray]:
        piece = np.searchsorted(TURNS, time, side="right") - 1
        slope = np.diff(MOMENTUM)[piece] / TURNS[1] if piece < KNOTS - 1 else 0.0
        return np.interp(time, TURNS, MOMENTUM) * unit, slope * unit

    options = {"rate0": RATE0, "accel_position": POINT, "gradient": False}
    truth = ref.simulate(SERVICER3, MOTION, TIMES, 0.05, wheel=wheel, **options)
    robot = Robot.from_urdf(SERVICER3)
    motion = formula_motion(MOTION, SERVICER3, robot)
    found = simulated(robot, motion, TIMES, RATE0, POINT, WheelHistory(axis, end=END), MOMENTUM)
    without = simulated(robot, motion, TIMES, RATE0, POINT)
    for given, bare, exact in zip(found, without, (truth.rate, truth.accel, truth.attitude), strict=True):
        assert np.abs(given - exact).max() < 1e-5 * np.abs(bare - exact).max()


@pytest.mark.slow
def test_a_constant_history_is_a_wheel_momentum(formula_motion):
    robot = Robot.from_urdf(SERVICER3)
    motion = formula_motion(MOTION, SERVICER3, robot)
    history = simulated(robot, motion, TIMES, RATE0, POINT, WheelHistory("y"), np.full(KNOTS, 0.4))
    constant = simulated(robot, motion, TIMES, RATE0, POINT, WheelMomentum(), np.array([0.0, 0.4, 0.0]))
    for left, right in zip(history, constant, strict=True):
        np.testing.assert_allclose(left, right, atol=1e-14)


def test_bound_and_prior_are_those_of_a_wheel():
    robot = Robot.from_urdf(SERVICER3)
    model = Model(robot, (Sensor(SensorKind.RATE, White(1e-5)),), ())
    assert WheelHistory("x").physical_bounds(model) == WheelMomentum().physical_bounds(model)
    assert {p.sigma for p in WheelHistory("x").parameters} == {p.sigma for p in WheelMomentum().parameters}
    assert [effect.label for effect in WheelHistory.instances(model)] == [f"wheel-history:{axis}" for axis in "xyz"]


def test_it_needs_an_axis_and_a_length():
    with pytest.raises(InputError, match="not an axis of the base"):
        create("wheel-history:link2").attach(Robot.from_urdf(SERVICER3))
    with pytest.raises(InputError, match="does not state its place"):
        create("wheel-history")
    with pytest.raises(InputError, match="last knot is at 0 s"):
        WheelHistory("x", end=0.0)
