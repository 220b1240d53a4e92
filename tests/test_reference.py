"""The reference simulator against conservation laws, against MuJoCo, and against recordings that somebody else made.

Reference and MuJoCo share the integration scheme but not the equations. With different steps (0.2 s and 0.1 s) they
must agree to the larger integration error; with equal steps to rounding.
"""

from __future__ import annotations

import csv
import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import make_lsq_spline

from studies.truth import mujoco as mj
from studies.truth.bodies import moving_joints
from studies.truth.orbit import Orbit as TrueOrbit
from studies.truth.stepwise import Response, simulate

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT.parent / "shared" / "examples"
ROBOTS = {
    "ets7": ROOT / "bayesid" / "robot" / "models" / "ets7.urdf",
    "planar": ROOT / "bayesid" / "robot" / "models" / "planar.urdf",
    "branched": ROOT / "studies" / "truth" / "robots" / "branched.urdf",
    "servicer4": ROOT / "studies" / "truth" / "robots" / "servicer4.urdf",
}
ATTITUDE = np.array([0.3, -0.5, 0.2, 0.8]) / np.linalg.norm([0.3, -0.5, 0.2, 0.8])
RATE = (0.004, -0.003, 0.005)
WHEEL = (0.5, -0.8, 0.3)
SENSOR = (0.2, 0.3, -0.4)
TIMES = np.arange(0.0, 61.0, 2.0)
# With steps of 0.2 s the integration error was measured at 1.8e-9 rad/s (of 4e-2) and 5e-11 m/s2 (of 8e-3) at most.
RATE_TOLERANCE, ACCEL_TOLERANCE = 5e-9, 2e-10


def motion_of(urdf: Path) -> mj.Motion:
    return mj.smooth_motion(len(moving_joints(urdf)), 60.0, seed=3, amplitude=0.6)


def differences(response: Response, truth: mj.Truth) -> tuple[float, float, float]:
    """Largest differences of rate, accelerometer and attitude."""
    x, y, z, w = truth.attitude.T
    third = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x**2 + y**2)], axis=1)
    return (
        np.abs(response.rate - truth.rate).max(),
        np.abs(response.accel - truth.accel).max(),
        np.abs(response.attitude[:, :, 2] - third).max(),
    )


# Conservation ---------------------------------------------------------------------------------------------------------


def spun_up(time: float) -> tuple[np.ndarray, np.ndarray]:
    """Wheels that take up momentum at a constant rate."""
    change = np.array([0.01, 0.0, -0.02])
    return WHEEL + change * time, change


@pytest.mark.parametrize("wheel", [WHEEL, spun_up], ids=["constant", "spun-up"])
@pytest.mark.parametrize("robot", ROBOTS)
def test_momentum_is_conserved_without_effects(robot, wheel):
    urdf = ROBOTS[robot]
    response = simulate(
        urdf, motion_of(urdf), TIMES[:16], 0.2, gradient=False, wheel=wheel, rate0=RATE, attitude0=ATTITUDE
    )
    momentum = response.angular_momentum
    assert np.abs(momentum - momentum[0]).max() < 3e-7 * np.abs(momentum[0]).max()
    assert np.abs(response.com_velocity).max() < 5e-8
    # not because nothing happens
    assert np.abs(response.rate - response.rate[0]).max() > 1e-3


def test_gradient_turns_but_does_not_push():
    urdf = ROBOTS["servicer4"]
    response = simulate(urdf, motion_of(urdf), TIMES[:16], 0.2, zenith=TrueOrbit(6.878e6).zenith, attitude0=ATTITUDE)
    assert np.abs(response.com_velocity).max() < 5e-8
    assert np.abs(response.angular_momentum[-1] - response.angular_momentum[0]).max() > 1e-3


def test_integration_is_of_fourth_order():
    urdf = ROBOTS["servicer4"]
    motion = motion_of(urdf)
    end = [
        simulate(urdf, motion, [20.0], step, zenith=TrueOrbit(6.878e6).zenith, wheel=WHEEL, rate0=RATE).rate[0]
        for step in (0.25, 0.5, 1.0)
    ]
    ratio = np.linalg.norm(end[2] - end[0]) / np.linalg.norm(end[1] - end[0])
    assert 14.0 < ratio < 20.0


# MuJoCo ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("robot", ["ets7", "branched", "servicer4"])
def test_agrees_with_mujoco(robot, tmp_path):
    urdf, orbit = ROBOTS[robot], mj.Orbit(6.916e6)
    model = mj.TruthModel(urdf, orbit=orbit, rotor=mj.Rotor(WHEEL), accel_position=SENSOR)
    truth = model.run(motion_of(urdf), TIMES, rate0=RATE, attitude0=ATTITUDE, step=0.1)
    # the rotor at rest is part of the base
    with_rotor = tmp_path / "with-rotor.urdf"
    mj.write_urdf(urdf, with_rotor, model.base)
    response = simulate(
        with_rotor,
        motion_of(urdf),
        TIMES,
        0.2,
        wheel=WHEEL,
        rate0=RATE,
        attitude0=ATTITUDE,
        accel_position=SENSOR,
        zenith=TrueOrbit(orbit.radius).zenith,
    )
    rate, accel, attitude = differences(response, truth)
    assert rate < RATE_TOLERANCE
    assert accel < ACCEL_TOLERANCE
    assert attitude < 5e-8


def test_engines_agree_to_rounding_at_equal_steps():
    urdf, orbit = ROBOTS["branched"], mj.Orbit()
    truth = mj.TruthModel(urdf, orbit=orbit, accel_position=SENSOR).run(motion_of(urdf), TIMES[:6], step=0.2)
    response = simulate(
        urdf, motion_of(urdf), TIMES[:6], 0.2, accel_position=SENSOR, zenith=TrueOrbit(orbit.radius).zenith
    )
    rate, accel, _ = differences(response, truth)
    assert rate < 1e-14
    assert accel < 1e-14


def test_thrust_and_eccentric_orbit_agree_with_mujoco():
    urdf = ROBOTS["servicer4"]
    orbit = mj.Orbit(7.5e6, eccentricity=0.1, argument_of_perigee=0.4, argument_of_latitude=1.1)
    thrusts = (mj.Thrust(4.0, 12.0, force=(0.3, -0.1, 0.2)), mj.Thrust(10.0, 20.0, torque=(0.02, 0.0, -0.03)))
    model = mj.TruthModel(urdf, orbit=orbit, thrusts=thrusts, accel_position=SENSOR)
    truth = model.run(motion_of(urdf), TIMES[:16], rate0=RATE, attitude0=ATTITUDE, step=0.1)
    response = simulate(
        urdf,
        motion_of(urdf),
        TIMES[:16],
        0.2,
        rate0=RATE,
        attitude0=ATTITUDE,
        accel_position=SENSOR,
        base_force=lambda time: model.thrust(time)[0],
        base_torque=lambda time: model.thrust(time)[1],
        zenith=orbit.zenith,
    )
    rate, accel, _ = differences(response, truth)
    assert rate < RATE_TOLERANCE
    assert accel < ACCEL_TOLERANCE
    assert np.abs(response.com_velocity[-1]).max() > 1e-3


def test_stiff_appendage_is_part_of_the_base(tmp_path):
    urdf = ROBOTS["servicer4"]
    panel = mj.Body(12.0, np.array([0.0, 2.0, 0.1]), np.diag([6.0, 1.0, 6.5]))
    appendage = mj.Appendage(panel, hinges=[(1.0, 0.0, 0.0)], anchor=(0.0, 0.6, 0.1), frequency=2.0, damping=0.5)
    model = mj.TruthModel(urdf, appendages=[appendage])
    truth = model.run(motion_of(urdf), TIMES[:11], step=0.02)
    rigid = tmp_path / "rigid.urdf"
    mj.write_urdf(urdf, rigid, model.base)
    response = simulate(rigid, motion_of(urdf), TIMES[:11], 0.2, gradient=False)
    # it bends quasi-statically: by the squared ratio of the motion's frequency to its own, times its share of inertia
    assert 1e-9 < differences(response, truth)[0] < 2e-3 * np.abs(response.rate).max()


@pytest.mark.parametrize(("eccentricity", "argument_of_latitude"), [(0.0, 0.0), (0.2, 2.5)])
def test_orbit_obeys_newton(eccentricity, argument_of_latitude):
    orbit = mj.Orbit(7.5e6, eccentricity, argument_of_perigee=0.7, argument_of_latitude=argument_of_latitude)

    def position(time):
        up, gradient = orbit.zenith(time)
        return up * (mj.MU / gradient) ** (1.0 / 3.0)

    for time in (0.0, 400.0, 3000.0):
        second = (position(time + 1.0) - 2.0 * position(time) + position(time - 1.0)) / 1.0**2
        assert second == pytest.approx(-orbit.zenith(time)[1] * position(time), abs=1e-5)
    assert orbit.zenith(0.0)[0] == pytest.approx([1.0, 0.0, 0.0])


# Studies --------------------------------------------------------------------------------------------------------------


def read_columns(file: Path) -> dict[str, np.ndarray]:
    with file.open() as stream:
        rows = list(csv.DictReader(stream))
    return {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}


def test_smooth_motion_is_its_own_derivative_and_rests_at_both_ends():
    motion = mj.smooth_motion(3, 50.0, seed=1, amplitude=[0.5, 0.2, 1.0], centre=[0.1, 0.0, -0.4])
    for time in (3.0, 25.0, 44.0):
        before, now, after = (motion(time + d) for d in (-1e-4, 0.0, 1e-4))
        assert (after[0] - before[0]) / 2e-4 == pytest.approx(now[1], abs=1e-7)
        assert (after[1] - before[1]) / 2e-4 == pytest.approx(now[2], abs=1e-7)
    for time in (0.0, 50.0):
        position, speed, acceleration = motion(time)
        assert position == pytest.approx([0.1, 0.0, -0.4])
        assert speed == pytest.approx(np.zeros(3), abs=1e-12)
        assert acceleration == pytest.approx(np.zeros(3), abs=1e-12)


def test_study_follows_the_contract(tmp_path):
    def bias(table, truth):
        table["accel.x"] += 1e-3

    study = mj.write_study(
        tmp_path,
        ROBOTS["branched"],
        np.random.default_rng(5),
        hidden=mj.Hidden(rotor=mj.Rotor((0.1, 0.2, -0.1)), thrusts=[mj.Thrust(10.0, 20.0, force=(0.1, 0.0, 0.0))]),
        sensors=mj.Sensors(attitude_period=2.0, encoder_period=0.25),
        manoeuvres=mj.Manoeuvres(count=1, duration=50.0),
        gaps={"rate": [(30.0, 40.0)]},
        distort=bias,
        step=0.125,
    )
    settings = tomllib.loads(study.file.read_text())
    assert settings["unknowns"]["bodies"] == ["bus"]
    assert settings["model"]["effects"] == ["gravity-gradient"]
    assert study.base.mass == 326.0

    columns, truth = read_columns(tmp_path / "manoeuvre-1.csv"), study.truths[0]
    times = columns["time"]
    gap = (times >= 30.0) & (times < 40.0)
    assert np.isnan(columns["rate.y"][gap]).all()
    assert np.isnan(columns["accel.y"][1::2]).all()
    rate = columns["rate.y"] - truth.rate[:, 1]
    assert np.nanstd(rate) == pytest.approx(1e-5, rel=0.3)
    assert np.nanmean(columns["accel.x"] - truth.accel[:, 0]) == pytest.approx(1e-3, rel=0.02)
    assert np.std(columns["position.hinge"] - truth.position[:, -1]) == pytest.approx(1e-6, rel=0.3)
    assert (columns["base_force.x"] == np.where((times >= 10.0) & (times < 20.0), 0.1, 0.0)).all()
    quaternion = np.stack([columns[f"attitude.{axis}"] for axis in "xyzw"], axis=1)
    turn = 2.0 * np.sqrt(1.0 - np.clip(np.nansum(quaternion * truth.attitude, axis=1)[::8] ** 2, 0.0, 1.0))
    assert np.sqrt(np.mean(turn**2)) == pytest.approx(np.sqrt(3.0) * 1e-5, rel=0.3)


def test_guess_is_wrong_and_physical():
    body = mj.TruthModel(ROBOTS["servicer4"]).base
    generator = np.random.default_rng(2)
    for _ in range(20):
        guess = mj.wrong_guess(body, generator)
        low, middle, high = np.linalg.eigvalsh(guess.inertia)
        assert low > 0.0
        assert low + middle > high
        assert 0.08 < abs(guess.mass / body.mass - 1.0) < 0.4


# Recordings by somebody else ------------------------------------------------------------------------------------------


def smoothed(times: np.ndarray, positions: np.ndarray) -> mj.Motion:
    """Joint motion from noisy encoders: a least-squares spline of degree five with a knot every second.

    Knots 1.5 s apart already leave twice the encoder's noise in these motions.
    """
    inner = np.arange(times[0] + 1.0, times[-1] - 0.5, 1.0)
    knots = np.concatenate([np.full(6, times[0]), inner, np.full(6, times[-1])])
    spline = make_lsq_spline(times, positions, knots, k=5)
    speed, acceleration = spline.derivative(1), spline.derivative(2)
    return lambda time: (spline(time), speed(time), acceleration(time))


@pytest.mark.skipif(not EXAMPLES.exists(), reason="the shared examples lie outside the repository and are not here")
@pytest.mark.parametrize(
    "name",
    ["nothing-hidden", *(pytest.param(name, marks=pytest.mark.slow) for name in ("wheel-momentum", "accel-position"))],
)
def test_leaves_only_noise_in_the_shared_examples(name, tmp_path):
    answer = json.loads((EXAMPLES / "answers.json").read_text())[name]
    settings = tomllib.loads((EXAMPLES / name / "study.toml").read_text())
    base, tensor = answer["base_true"], answer["base_true"]["inertia_about_com_kgm2"]
    inertia = np.array([[tensor["".join(sorted(i + j))] for j in "xyz"] for i in "xyz"])
    urdf = tmp_path / "robot.urdf"
    mj.write_urdf(EXAMPLES / name / "robot.urdf", urdf, mj.Body(base["mass_kg"], np.array(base["com_m"]), inertia))

    columns = read_columns(EXAMPLES / name / settings["recordings"][0]["file"])
    rate, accel = (np.stack([columns[f"{s}.{axis}"] for axis in "xyz"], axis=1) for s in ("rate", "accel"))
    positions = np.stack([columns[f"position.{joint}"] for joint in moving_joints(urdf)], axis=1)
    hidden = answer["true_parameters"]

    def response(rate0):
        return simulate(
            urdf,
            smoothed(columns["time"], positions),
            columns["time"],
            0.5,
            wheel=hidden.get("wheel_momentum_base_Nms", np.zeros(3)),
            rate0=rate0,
            attitude0=settings["recordings"][0]["attitude"],
            accel_position=hidden.get("position_true_m", settings["sensors"]["accel"]["position"]),
            zenith=TrueOrbit(settings["orbit"]["radius"]).zenith,
        )

    # the rate is nearly linear in its initial value: one Newton step from the first sample
    start, step = rate[0], 1e-4
    first = response(start)
    slopes = np.stack([(response(start + step * e).rate - first.rate).ravel() / step for e in np.eye(3)], axis=1)
    start = start + np.linalg.lstsq(slopes, (rate - first.rate).ravel(), rcond=None)[0]
    final = response(start)
    # a spline's second derivative is noisy at its ends, and the accelerometer shows it
    for measured, predicted, sensor in ((rate, final.rate, "rate"), (accel[2:-2], final.accel[2:-2], "accel")):
        residual = (measured - predicted) / settings["sensors"][sensor]["sigma"]
        assert 0.85 < np.mean(residual**2) < 1.15, sensor
