"""A wheel that runs up and down unrecorded, against a step-by-step integration with Pinocchio."""

from __future__ import annotations

import numpy as np
import pytest

from bayesid._io.errors import InputError
from bayesid.diagnosis import Status
from bayesid.robot.robot import Robot
from bayesid.simulation.effects import WheelHistory, WheelMomentum, create
from bayesid.simulation.effects.wheel_history import KNOTS, RUN_UP
from bayesid.simulation.model import Model
from bayesid.simulation.sensors import Sensor, SensorKind, White
from studies.truth import mujoco as mj
from studies.truth import stepwise as ref
from studies.truth.bodies import SERVICER3
from studies.truth.hidden_causes.catalogue import hidden_case
from tests.hidden import diagnosed
from tests.simulated import simulated

END, TIMES = 46.0, np.arange(0.0, 60.01, 0.5)
TURNS = np.linspace(0.0, END, KNOTS)
MOMENTUM = np.random.default_rng(3).uniform(-0.6, 0.6, KNOTS)
PARAMETERS = np.concatenate([MOMENTUM[:1], np.diff(MOMENTUM) / TURNS[1]])
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
    found = simulated(robot, motion, TIMES, RATE0, POINT, WheelHistory(axis, end=END), PARAMETERS)
    without = simulated(robot, motion, TIMES, RATE0, POINT)
    for given, bare, exact in zip(found, without, (truth.rate, truth.accel, truth.attitude), strict=True):
        assert np.abs(given - exact).max() < 1e-5 * np.abs(bare - exact).max()


@pytest.mark.slow
def test_a_constant_history_is_a_wheel_momentum(formula_motion):
    robot = Robot.from_urdf(SERVICER3)
    motion = formula_motion(MOTION, SERVICER3, robot)
    history = simulated(robot, motion, TIMES, RATE0, POINT, WheelHistory("y"), np.array([0.4] + (KNOTS - 1) * [0.0]))
    constant = simulated(robot, motion, TIMES, RATE0, POINT, WheelMomentum(), np.array([0.0, 0.4, 0.0]))
    for left, right in zip(history, constant, strict=True):
        np.testing.assert_allclose(left, right, atol=1e-14)


def test_the_momenta_at_the_knots_are_reported():
    effect = WheelHistory("x", end=END)
    np.testing.assert_allclose(effect.report(PARAMETERS), MOMENTUM, atol=1e-12)
    assert [quantity.name for quantity in effect.quantities] == [f"momentum.{knot}" for knot in range(1, KNOTS + 1)]
    assert {quantity.unit for quantity in effect.quantities} == {"N m s"}


def test_bound_and_prior_are_those_of_a_wheel_and_of_its_motor():
    robot = Robot.from_urdf(SERVICER3)
    model = Model(robot, (Sensor(SensorKind.RATE, White(1e-5)),), ())
    momentum, torque = WheelHistory("x").physical_bounds(model)
    assert (momentum,) == WheelMomentum().physical_bounds(model)
    assert (torque.unit, torque.largest) == ("N m", momentum.largest / RUN_UP)
    assert WheelHistory("x").parameters[0].sigma == WheelMomentum().parameters[0].sigma
    assert [effect.label for effect in WheelHistory.instances(model)] == [f"wheel-history:{axis}" for axis in "xyz"]


@pytest.mark.slow
def test_a_wheel_that_hardly_changes_is_named(tmp_path):
    """It is charged for what it changes: with 24 independent values it was unknown, with 0.7."""

    def wandering(draw, strength):
        levels = 0.02 * strength * (1.0 + 0.5 * np.concatenate([[0.0], np.cumsum(draw.uniform(-1.0, 1.0, 3))]))
        wheel = mj.SpunWheel(np.array([0.0, 0.0, 1.0]), np.array([0.0, 60.0, 120.0, 200.0]), levels)
        return {"hidden": mj.Hidden(fields=[wheel])}

    verdict = diagnosed(hidden_case("wheel-history:z", wandering).make(tmp_path, 14)).verdict
    assert verdict.causes == ("wheel-history:z",)
    assert verdict.status is Status.EXPLAINED


def test_it_needs_an_axis_and_a_length():
    with pytest.raises(InputError, match="not an axis of the base"):
        create("wheel-history:link2").attach(Robot.from_urdf(SERVICER3))
    with pytest.raises(InputError, match="does not state its place"):
        create("wheel-history")
    with pytest.raises(InputError, match="last knot is at 0 s"):
        WheelHistory("x", end=0.0)
