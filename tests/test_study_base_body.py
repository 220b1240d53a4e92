"""The study of section 4.1 in its small version, and its noise-free case on data of an independent simulator."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bayesid.design.design_result import sample_times
from bayesid.inference.posterior import Posterior
from bayesid.recording.recording import Recording
from bayesid.simulation.model import Manoeuvre
from bayesid.simulation.sensors import SensorKind
from studies import base_body
from studies.base_body import analysis, paper
from studies.base_body.report import STUDY, goals_of
from studies.common.ets7 import ACCELEROMETER, BASE, RADIUS, ets7, excitation, tip_speed
from studies.common.study import Verdict
from studies.truth import stepwise as reference
from studies.truth.orbit import Orbit
from tests.report_rules import broken_rules

GOAL = 1e-6
REFERENCE_STEP = 0.125
"""With twice that the reference's own error already reaches 3e-6 of a parameter [s]."""


pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def result() -> base_body.BaseBody:
    return base_body.run()


def test_every_parameter_is_identified_without_noise(result):
    for name in ("well", "poor"):
        assert result.noise_free[name].worst < GOAL, name
    assert np.abs(paper.RESULT_WELL / paper.TRUTH - 1.0).max() > 1e4 * result.noise_free["well"].worst


def test_data_of_an_independent_simulator_give_the_same(tmp_path: Path):
    robot, motion = ets7(), excitation(paper.EXCITATION)
    robot.write_urdf(tmp_path / "ets7.urdf")
    time = sample_times(motion.duration, 2.0)

    half = 0.5 * REFERENCE_STEP
    states = np.array(motion.evaluate(np.arange(0.0, motion.duration + half, half)))

    def at(instant: float):
        return states[:, round(instant / half)]

    truth = reference.simulate(
        tmp_path / "ets7.urdf",
        at,
        time,
        REFERENCE_STEP,
        accel_position=ACCELEROMETER,
        zenith=Orbit(RADIUS).zenith,
    )
    channels = {
        f"{kind}.{axis}": values[:, index]
        for kind, values in (("rate", truth.rate), ("accel", truth.accel))
        for index, axis in enumerate("xyz")
    }
    recording = Recording("reference", None, time, channels)
    posterior = Posterior.of(analysis.guess_model(), [Manoeuvre(recording, motion)], step=0.5, flat_prior=True)
    assert analysis.identify_exact(posterior).worst < GOAL


def test_the_poor_manoeuvre_hardly_excites_the_third_axis_and_costs_when_there_is_noise(result):
    well, poor = result.noise_free["well"], result.noise_free["poor"]
    assert poor.peak[2] < 0.15 * min(poor.peak[:2])
    assert well.peak[2] > 0.5 * min(well.peak[:2])
    assert poor.uncertainty[6] > 3.0 * well.uncertainty[6]


def test_the_base_turns_slower_than_a_hundredth_of_a_radian_per_second(result):
    assert result.fast.peak[SensorKind.RATE] < 0.01
    assert [joint for joint, _, _ in analysis.limits_broken()] == [1, 2]


def test_leaving_the_gravity_gradient_out_costs(result):
    blind = result.noise_free["well, no gradient"]
    assert 1e-3 < blind.worst < 0.1
    assert blind.worst > 1e4 * result.noise_free["well"].worst


def test_an_arm_known_to_five_percent_sets_the_scale(result):
    floor = result.grades["5 %"][:, 0]
    assert floor[0] > 5.0 * result.grades["exact"][0, 0]
    assert (floor > 0.015).all()
    assert floor[-1] == pytest.approx(floor[0], rel=0.05), "no accelerometer mends it"


def test_a_better_accelerometer_narrows_the_posterior_of_an_exact_arm(result):
    mass = result.grades["exact"][:, 0]
    assert (np.diff(mass) < 0.0).all()
    assert mass[0] < 0.002
    assert (result.grades["exact, differenced"][0] > result.grades["exact"][0]).all()


def test_sigma_in_radians_per_second_exceeds_the_signal(result):
    for sigma in (0.04, 0.009):
        reading = next(item for item in result.readings if (item.sigma, item.unit) == (sigma, "rad/s"))
        assert reading.fraction > 1.0
        assert reading.manoeuvres > 1.0


def test_a_slower_manoeuvre_keeps_the_limits_of_the_flight(result):
    motion = excitation(paper.EXCITATION, result.slowness)
    speed, rate = tip_speed(motion, motion.duration)
    assert speed == pytest.approx(0.05, rel=0.02) or rate == pytest.approx(np.radians(5.0), rel=0.02)
    assert speed < 0.0505
    assert rate < np.radians(5.05)


def test_the_arm_is_scaled_to_a_seventh():
    robot = analysis.heavy_arm(ets7())
    moving = sum(robot.link(f"link{index}").inertial.mass for index in range(2, 7))
    assert moving / robot.link(BASE).inertial.mass == pytest.approx(1.0 / 7.0)


def test_the_report_is_written(result, tmp_path: Path):
    STUDY.write(result, tmp_path / "base_body.pdf")
    assert broken_rules(tmp_path / "base_body.pdf", full=False) == []
    verdicts = [goal.verdict for goal in goals_of(result)]
    assert verdicts == [Verdict.PASS, Verdict.PASS, Verdict.NOT_TESTED]
