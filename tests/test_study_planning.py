"""The planning study: a plan with the true base hits its target in the independent simulator, a wrong one misses."""

from __future__ import annotations

import numpy as np
import pytest

from bayesid.robot.robot import Robot
from studies.common.ets7 import BASE, START
from studies.planning.analysis import flight_of, plan, predictor_of
from studies.planning.calibration import calibrate
from studies.planning.world import Guess, Swing, fly, model_of

DURATION = 20.0
REACHED = START + np.array([0.4, -0.3, 0.2, 0.1, -0.2, 0.2])


@pytest.mark.slow
def test_a_plan_hits_with_the_true_base_and_misses_with_a_wrong_one():
    target = fly(Swing(START, REACHED, DURATION)).tip
    truth = Robot.shipped("ets7").link(BASE).inertial
    model = model_of(Guess("truth", truth, 0.01))
    predictor = predictor_of(model, Swing(START, START, DURATION))
    goal = plan(predictor, model, target, DURATION)
    np.testing.assert_allclose(goal, REACHED, atol=1e-6)
    flight = flight_of(goal, target, DURATION)
    assert flight.miss < 1e-6
    # the same path under another base: along the first coordinate, mass and inertia grow by e^0.4
    wrong = predictor.centre.copy()
    wrong[0] = 20.0
    _, tip = predictor_of(model, Swing(START, goal, DURATION), predictor).courses(wrong[None])
    assert np.linalg.norm(tip.position[0, -1] - target[0]) > 0.005
    assert predictor.posterior.unknowns.values_at(wrong).inertial[0] == pytest.approx(truth.mass * np.exp(0.4))


@pytest.mark.usefixtures("slow")
def test_regions_about_guesses_hold_the_truth_and_a_store_keeps_them(tmp_path):
    flight = flight_of(REACHED, fly(Swing(START, REACHED, DURATION)).tip, DURATION)
    options = {"guesses": 4, "draws": 40, "seed": 2, "store": tmp_path / "trials.jsonl"}
    (narrow,) = calibrate(flight, DURATION, [0.02], **options)
    assert all(held >= 2 for held in (*narrow.held["base"], *narrow.held["tip"]))
    lines = []
    assert calibrate(flight, DURATION, [0.02], **options, progress=lines.append) == (narrow,)
    assert lines == []
