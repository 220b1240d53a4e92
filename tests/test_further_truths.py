"""Cases of the campaign beside the catalogue's: what they do to the data, and telemetry between flown instants."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studies.truth import mujoco as mj
from studies.truth.bodies import SERVICER3
from studies.truth.hidden_causes import CASES, FURTHER_CASES, NOW_LISTED, further
from studies.truth.motions import Manoeuvres
from studies.truth.numerics import Array
from studies.truth.recordings import Truth, by_axis

TIMES = np.arange(0.0, 150.5, 0.5)


@pytest.fixture(scope="module")
def truth() -> Truth:
    """A made-up motion."""
    swing = np.sin(0.05 * TIMES[:, None] + np.arange(3.0))
    zeros, attitude = np.zeros((len(TIMES), 3)), np.tile([0.0, 0.0, 0.0, 1.0], (len(TIMES), 1))
    return Truth(TIMES, swing, zeros, zeros, zeros, 2e-3 * swing, attitude, 1e-4 * swing, zeros, zeros)


def changed(build, truth: Truth, strength: float = 1.0) -> dict[str, Array]:
    """Changes of the columns that a cause makes, by channel."""
    table = by_axis("rate", "xyz", truth.rate) | by_axis("accel", "xyz", truth.accel)
    table |= {f"position.joint{number + 1}": truth.position[:, number].copy() for number in range(3)}
    before = {name: column.copy() for name, column in table.items()}
    build(np.random.default_rng(4), strength)["distort"](table, truth)
    return {name: table[name] - before[name] for name in table if (table[name] != before[name]).any()}


def test_names_are_unique_and_those_that_are_listed_now_have_their_cause():
    every = [case.name for case in (*CASES, *FURTHER_CASES)]
    assert len(set(every)) == len(every)
    listed = {case.name.removesuffix(", listed"): case for case in FURTHER_CASES if case.name.endswith(", listed")}
    assert set(listed) | {"pulse-train"} == set(NOW_LISTED)
    assert all(case.status == "effect" and case.causes for case in listed.values())
    outside = [case for case in (*CASES, *FURTHER_CASES) if case.status == "unknown" and case.name not in NOW_LISTED]
    assert len(outside) >= 10


def test_an_eccentric_encoder_errs_by_the_sine_of_twice_its_angle(truth):
    (change,) = changed(lambda *given: further.eccentric_encoder("joint2", *given), truth).values()
    angle = truth.position[:, 1]
    basis = np.stack([np.sin(2.0 * angle), np.cos(2.0 * angle)], axis=1)
    part, (left,) = np.linalg.lstsq(basis, change, rcond=None)[:2]
    assert left < 1e-20
    assert np.linalg.norm(part) == pytest.approx(2e-3)


def test_a_gyro_that_saturates_stays_within_its_limits_and_one_that_freezes_repeats_a_reading(truth):
    for name, change in changed(further.saturated_gyro, truth).items():
        true = truth.rate[:, "xyz".index(name[-1])]
        assert (true + change).max() == pytest.approx(true.max() - 6e-5)
        assert 0.0 < (change != 0.0).mean() < 0.4
    for name, change in changed(further.frozen_gyro, truth).items():
        true = truth.rate[:, "xyz".index(name[-1])]
        frozen = change != 0.0
        assert np.ptp((true + change)[frozen]) < 1e-15
        assert TIMES[frozen].max() - TIMES[frozen].min() < 2.0


def test_errors_of_gyro_and_accelerometer_follow_what_they_depend_on(truth):
    by_acceleration = np.stack(list(changed(further.g_sensitive_gyro, truth).values()), axis=1)
    factors = np.linalg.lstsq(truth.accel, by_acceleration, rcond=None)[0]
    assert np.abs(truth.accel @ factors - by_acceleration).max() < 1e-9 * np.abs(by_acceleration).max()
    for name, change in changed(further.curved_accelerometer, truth).items():
        squares = truth.accel[:, "xyz".index(name[-1])] ** 2
        assert np.corrcoef(change, squares)[0, 1] ** 2 == pytest.approx(1.0)
    assert set(changed(further.breathing_bias, truth)) == {"rate.x", "rate.y", "rate.z"}


def test_a_mass_that_swings_has_the_speed_and_acceleration_of_its_place():
    (mover,) = further.swinging_mass(np.random.default_rng(1), 1.0)["hidden"].movers
    fine = np.arange(0.0, 60.0, 0.01)
    place, speed, acceleration = np.array([mover.motion(time) for time in fine]).T
    assert np.allclose(np.gradient(place, fine)[1:-1], speed[1:-1], atol=1e-7)
    assert np.allclose(np.gradient(speed, fine)[1:-1], acceleration[1:-1], atol=1e-7)
    assert place[0] == speed[0] == 0.0
    assert np.ptp(place) == pytest.approx(2.0 * mover.travel, rel=1e-3)


def test_telemetry_between_flown_instants_is_that_of_instants_flown():
    motion = Manoeuvres().draw(["revolute"] * 3, np.random.default_rng(2))
    model = mj.TruthModel(SERVICER3)
    start = {"rate0": (1e-3, -2e-3, 1e-3), "attitude0": Rotation.random(random_state=1).as_quat()}
    asked = np.arange(1.0, 9.0, 0.01)
    flown = model.run(motion, asked, step=0.05, **start)
    between = model.run(motion, np.arange(0.0, 10.05, 0.05), step=0.05, **start).between(asked)
    for name, limit in (("rate", 1e-9), ("accel", 1e-8), ("position", 1e-9), ("attitude", 1e-9)):
        assert np.abs(getattr(between, name) - getattr(flown, name)).max() < limit, name
