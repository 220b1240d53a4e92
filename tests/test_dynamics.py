"""The simulation against a step-by-step Pinocchio reference, MuJoCo, conservation laws and a closed form."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pinocchio as pin
import pytest
from scipy.linalg import expm

from bayesid.recording.actions import Actions
from bayesid.recording.recording import Recording
from bayesid.robot.robot import Robot
from bayesid.simulation.dynamics import Start, simulate
from bayesid.simulation.effects import GravityGradient, Readings, WheelMomentum
from bayesid.simulation.orbit import Orbit
from bayesid.simulation.time_grid import build_grid, pad_grids
from studies.truth import mujoco as mj
from studies.truth import stepwise as ref
from studies.truth.bodies import moving_joints
from tests.sensed import read

ROOT = Path(__file__).resolve().parents[1]
ROBOTS = {
    "ets7": ROOT / "bayesid" / "robot" / "models" / "ets7.urdf",
    "planar": ROOT / "bayesid" / "robot" / "models" / "planar.urdf",
    "branched": ROOT / "studies" / "truth" / "robots" / "branched.urdf",
    "servicer4": ROOT / "studies" / "truth" / "robots" / "servicer4.urdf",
}
ATTITUDE = np.array([0.3, -0.5, 0.2, 0.8]) / np.linalg.norm([0.3, -0.5, 0.2, 0.8])
RATE = np.array([0.004, -0.003, 0.005])
WHEEL = np.array([0.5, -0.8, 0.3])
POINT = np.array([0.2, 0.3, -0.4])
DURATION = 30.0
TIMES = np.arange(0.0, DURATION + 0.1, 1.5)
STEP, REFERENCE_STEP = 0.25, 0.05
"""With these, halving them changes the package's rate by 4e-11 rad/s and the reference's by 3e-10 rad/s (servicer4)."""

SIMULATE = jax.jit(simulate, static_argnums=3)


def motion_of(urdf: Path) -> mj.Motion:
    return mj.smooth_motion(len(moving_joints(urdf)), 60.0, seed=3, amplitude=0.6)


def run(robot, motion, times, step, *, effects=(), values=(), unknown=(), rate=RATE, attitude=ATTITUDE, **options):
    """Simulate with numpy in and out; ``options`` are those of `build_grid`.

    Grids are padded to a multiple of 256 steps, so that few shapes are compiled; `test_padding_changes_nothing`.
    """
    grid = build_grid(robot, unknown, motion, times, step, **options)
    grid = jax.tree.map(lambda x: x[0], pad_grids([grid], -(-len(grid.step) // 256) * 256))
    inertial = [robot.link(name).inertial.vector for name in unknown]
    vector = jnp.asarray(np.concatenate(inertial) if inertial else np.zeros(0))
    start = Start(jnp.asarray(attitude), jnp.asarray(rate))
    samples = SIMULATE(grid, vector, start, tuple(effects), tuple(map(jnp.asarray, values)), jnp.asarray([POINT]))
    return SimpleNamespace(**{key: np.asarray(value) for key, value in vars(read(samples, POINT)).items()})


def matrices(quaternions: np.ndarray) -> np.ndarray:
    return np.array([pin.Quaternion(q.copy()).toRotationMatrix() for q in quaternions])


# one instance each: effects are static arguments of the compiled function
GRADIENT, WHEELS = GravityGradient(), WheelMomentum()


# against the reference ------------------------------------------------------------------------------------------------

FORCE_TIMES = np.array([3.0, 9.0, 18.0])
FORCES = np.array([[0.5, -0.2, 0.1], [-0.3, 0.4, 0.0], [0.0, 0.0, 0.0]])
TORQUE_TIMES = np.array([4.5, 12.0])
TORQUES = np.array([[0.02, 0.0, -0.05], [0.0, -0.03, 0.01]])


def zero_order_hold(times: np.ndarray, values: np.ndarray):
    def value(time: float) -> np.ndarray:
        index = np.searchsorted(times, time, side="right") - 1
        return values[index] if index >= 0 else np.zeros(3)

    return value


def ramped_wheel(time: float) -> tuple[np.ndarray, np.ndarray]:
    change = np.array([0.01, -0.02, 0.015])
    return WHEEL + change * time, change


def action_recording() -> Recording:
    """Force, torque and a linearly varying wheel momentum, each sampled at times of its own."""
    time = np.arange(0.0, DURATION + 0.1, 1.5)
    channels = {}
    for family, times, values in (("base_force", FORCE_TIMES, FORCES), ("base_torque", TORQUE_TIMES, TORQUES)):
        for index, axis in enumerate("xyz"):
            column = np.full(len(time), np.nan)
            column[np.searchsorted(time, times)] = values[:, index]
            channels[f"{family}.{axis}"] = column
    wheel = np.array([ramped_wheel(t)[0] for t in time])
    channels |= {f"wheel_momentum.{axis}": wheel[:, index] for index, axis in enumerate("xyz")}
    channels["position.unused"] = np.zeros_like(time)
    return Recording("actions", None, time, channels)


ORBITS = {
    "ets7": mj.Orbit(6.916e6),
    "branched": mj.Orbit(2.0e7, 0.6, 0.4, 0.9),
    "servicer4": mj.Orbit(6.878e6),
}


@pytest.mark.parametrize(
    "name", ["ets7", *(pytest.param(name, marks=pytest.mark.slow) for name in ("branched", "servicer4"))]
)
def test_agrees_with_the_reference(name, tmp_path, formula_motion):
    """Perturbed links, orbit (elliptic for one), initial rate, held force and torque, a varying wheel momentum."""
    robot, rng = Robot.from_urdf(ROBOTS[name]), np.random.default_rng(7)
    for link in [key for key, value in robot.links.items() if value.inertial.mass > 0.0]:
        robot = robot.perturbed(link, 0.15, rng)
    file = tmp_path / "robot.urdf"
    robot.write_urdf(file)
    truth, motion = ORBITS[name], motion_of(file)
    expected = ref.simulate(
        file,
        motion,
        TIMES,
        REFERENCE_STEP,
        zenith=truth.zenith,
        wheel=ramped_wheel,
        rate0=RATE,
        attitude0=ATTITUDE,
        accel_position=POINT,
        base_force=zero_order_hold(FORCE_TIMES, FORCES),
        base_torque=zero_order_hold(TORQUE_TIMES, TORQUES),
    )
    orbit = Orbit(truth.radius, truth.eccentricity, argument_of_perigee=truth.argument_of_perigee)
    options = {"orbit": orbit, "argument_of_latitude": truth.argument_of_latitude}
    options["actions"] = Actions.from_recording(action_recording())
    given = formula_motion(motion, file, robot)
    found = run(robot, given, TIMES, STEP, effects=(GRADIENT,), values=(np.zeros(0),), **options)
    differences = (
        np.abs(found.rate - expected.rate).max(),
        np.abs(found.accel - expected.accel).max(),
        np.abs(matrices(found.attitude) - expected.attitude).max(),
    )
    assert differences[0] < 1e-9
    assert differences[1] < 1e-8
    assert differences[2] < 1e-8
    # not because nothing happens
    assert np.abs(expected.rate - expected.rate[0]).max() > 1e-3
    assert np.abs(expected.accel).max() > 1e-4

    # tables of unknown links give what the same links give when they are known
    names = tuple(key for key, value in robot.links.items() if value.inertial.mass > 0.0)[::2]
    again = run(robot, given, TIMES, STEP, effects=(GRADIENT,), values=(np.zeros(0),), unknown=names, **options)
    np.testing.assert_allclose(again.rate, found.rate, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(again.accel, found.accel, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(again.attitude, found.attitude, rtol=0.0, atol=1e-12)


def test_a_constant_wheel_is_the_same_as_effect_and_as_recording(formula_motion):
    urdf = ROBOTS["servicer4"]
    robot = Robot.from_urdf(urdf)
    motion = formula_motion(motion_of(urdf), urdf, robot)
    effect = run(robot, motion, TIMES, STEP, effects=(WHEELS,), values=(WHEEL,))
    actions = Actions(np.zeros(0), np.zeros((0, 6)), TIMES, np.tile(WHEEL, (len(TIMES), 1)))
    recorded = run(robot, motion, TIMES, STEP, actions=actions)
    np.testing.assert_allclose(effect.rate, recorded.rate, atol=1e-14)
    expected = ref.simulate(
        urdf, motion_of(urdf), TIMES, REFERENCE_STEP, gradient=False, wheel=WHEEL, rate0=RATE, attitude0=ATTITUDE
    )
    assert np.abs(effect.rate - expected.rate).max() < 1e-9


def test_two_samples_of_a_wheels_momentum_are_joined_by_a_line():
    first, second = np.array([0.1, -0.2, 0.3]), np.array([0.5, 0.2, 0.1])
    actions = Actions(np.zeros(0), np.zeros((0, 6)), np.array([2.0, 6.0]), np.stack([first, second]))
    momentum, torque = actions.wheels(np.array([0.0, 2.0, 3.0, 6.0, 9.0]))
    np.testing.assert_allclose(momentum, [first, first, 0.75 * first + 0.25 * second, second, second], atol=1e-15)
    slope = (second - first) / 4.0
    np.testing.assert_allclose(torque, [0.0 * slope, slope, slope, slope, 0.0 * slope], atol=1e-15)


def test_a_curved_wheel_momentum_is_interpolated(formula_motion):
    """Sampled at 2 Hz; the interpolant of a sine of 0.05 Hz errs by less than 1e-3 of its amplitude."""
    urdf = ROBOTS["planar"]
    robot, omega, size = Robot.from_urdf(urdf), 2.0 * np.pi * 0.05, np.array([0.3, -0.2, 0.1])

    def wheel(time: float) -> tuple[np.ndarray, np.ndarray]:
        return size * np.sin(omega * time), size * omega * np.cos(omega * time)

    time = np.arange(0.0, DURATION + 0.1, 0.5)
    actions = Actions(np.zeros(0), np.zeros((0, 6)), time, np.array([wheel(t)[0] for t in time]))
    inside = TIMES[2:-2]
    found = run(robot, formula_motion(motion_of(urdf), urdf, robot), inside, STEP, actions=actions)
    expected = ref.simulate(
        urdf, motion_of(urdf), inside, 0.15, gradient=False, wheel=wheel, rate0=RATE, attitude0=ATTITUDE
    )
    # a momentum h turns the 3 kg m2 base at h / 3
    assert np.abs(found.rate - expected.rate).max() < 1e-3 * 0.3 / 3.0
    assert np.abs(expected.rate - RATE).max() > 0.05


def test_actions_before_their_first_sample_are_zero_and_held_after_the_last():
    actions = Actions.from_recording(action_recording())
    wrench = actions.zero_order_hold(np.array([0.0, 2.9, 3.0, 4.4, 4.5, 8.9, 9.0, 29.0]))
    force = [FORCES[i] if i >= 0 else np.zeros(3) for i in (-1, -1, 0, 0, 0, 0, 1, 2)]
    torque = [TORQUES[i] if i >= 0 else np.zeros(3) for i in (-1, -1, -1, -1, 0, 0, 0, 1)]
    np.testing.assert_array_equal(wrench, np.concatenate([force, torque], axis=1))


def test_steps_end_where_a_held_action_changes(formula_motion):
    """A torque step within a long step would be missed: with steps of 2 s and a step at 3.1 s nothing is."""
    urdf = ROBOTS["planar"]
    robot = Robot.from_urdf(urdf)
    actions = Actions(np.array([3.1]), np.array([[0.0, 0, 0, 0.0, 0.0, 0.01]]), np.zeros(0), np.zeros((0, 3)))
    still = formula_motion(lambda _: (np.zeros(2), np.zeros(2), np.zeros(2)), urdf, robot)
    found = run(robot, still, np.array([0.0, 3.0, 3.1, 5.3, 10.0]), 2.0, rate=np.zeros(3), actions=actions)
    # the planar robot at rest has a constant inertia; it only spins up about an axis close to z
    slope = (found.rate[4] - found.rate[2]) / 6.9
    assert slope[2] > 1e-4
    np.testing.assert_allclose(found.rate[:3], 0.0, atol=1e-15)
    np.testing.assert_allclose(found.rate[3], slope * 2.2, rtol=1e-3)


# against MuJoCo -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["ets7", "servicer4"])
def test_agrees_with_mujoco(name, tmp_path, formula_motion):
    """To 5e-9 rad/s and 2e-10 m/s2: twice MuJoCo's own error with steps of 0.1 s (test_reference)."""
    urdf, orbit = ROBOTS[name], mj.Orbit(6.916e6)
    model = mj.TruthModel(urdf, orbit=orbit, rotor=mj.Rotor(tuple(WHEEL)), accel_position=POINT)
    truth = model.run(motion_of(urdf), TIMES, rate0=RATE, attitude0=ATTITUDE, step=0.1)
    mj.write_urdf(urdf, tmp_path / "robot.urdf", model.base)  # the rotor at rest is part of the base
    robot = Robot.from_urdf(tmp_path / "robot.urdf")
    found = run(
        robot,
        formula_motion(motion_of(urdf), urdf, robot),
        TIMES,
        STEP,
        effects=(GRADIENT, WHEELS),
        values=(np.zeros(0), WHEEL),
        orbit=Orbit(orbit.radius),
    )
    differences = (
        np.abs(found.rate - truth.rate).max(),
        np.abs(found.accel - truth.accel).max(),
        np.abs(matrices(found.attitude) - matrices(truth.attitude)).max(),
    )
    assert differences[0] < 5e-9
    assert differences[1] < 2e-10
    assert differences[2] < 5e-8


# conservation and convergence ----------------------------------------------------------------------------------------


def orbit_momentum(robot: Robot, urdf: Path, motion: mj.Motion, found: Readings) -> np.ndarray:
    """Angular momentum about the centre of mass, orbit axes, from Pinocchio and what the sensors read."""
    reference = ref.Reference(urdf, motion, zenith=None, wheel=np.zeros(3), base_force=None, base_torque=None)
    rows = []
    for time, rate, attitude in zip(found.time, found.rate, found.attitude, strict=True):
        state = np.concatenate([np.zeros(3), attitude, np.zeros(3), rate])
        rows.append(reference.momentum(float(time), state)[2])
    return np.array(rows)


def test_momentum_is_conserved_without_effects_to_the_integrators_error(formula_motion):
    """The drift falls as the fourth power of the step, at nodes and between them; 10 to 24 allows for higher orders."""
    urdf = ROBOTS["servicer4"]
    robot, motion = Robot.from_urdf(urdf), motion_of(urdf)
    given = formula_motion(motion, urdf, robot)
    rate = np.array([0.02, -0.03, 0.04])
    drift = []
    for step in (3.0, 1.5, 0.75):
        found = run(robot, given, np.linspace(0.0, 30.0, 31), step, rate=rate)
        momentum = orbit_momentum(robot, urdf, motion, found)
        drift.append(np.abs(momentum - momentum[0]).max() / np.linalg.norm(momentum[0]))
    assert drift[2] < 1e-6
    assert 10.0 < drift[0] / drift[1] < 24.0
    assert 10.0 < drift[1] / drift[2] < 24.0


def test_integration_is_of_fourth_order(formula_motion):
    """Rate at nodes and between them, and attitude: errors against a step of 0.12 s fall 16-fold per halving."""
    urdf = ROBOTS["ets7"]
    robot = Robot.from_urdf(urdf)
    given = formula_motion(motion_of(urdf), urdf, robot)
    times = np.array([0.0, 12.0, 24.0, 25.1, 26.7, 30.0])
    options = {"effects": (GRADIENT,), "values": (np.zeros(0),), "orbit": Orbit(6.9e6)}
    options["rate"] = np.array([0.03, -0.02, 0.04])
    exact = run(robot, given, times, 0.12, **options)
    coarse, fine = (run(robot, given, times, step, **options) for step in (3.0, 1.5))
    for field in ("rate", "attitude"):
        for rows in ([1, 2, 5], [3, 4]):
            left, right = (np.linalg.norm((getattr(x, field) - getattr(exact, field))[rows]) for x in (coarse, fine))
            assert 11.0 < left / right < 24.0


@pytest.mark.slow
def test_padding_changes_nothing(formula_motion):
    """Recordings of different lengths are simulated side by side; steps of no length must not matter."""
    urdf = ROBOTS["planar"]
    robot = Robot.from_urdf(urdf)
    motion = formula_motion(motion_of(urdf), urdf, robot)
    grids = [build_grid(robot, (), motion, times, 0.5) for times in (TIMES, TIMES[:9])]
    start = Start(jnp.asarray(ATTITUDE), jnp.asarray(RATE))
    call = lambda grid: SIMULATE(grid, jnp.zeros(0), start, (), (), jnp.asarray([POINT]))  # noqa: E731
    both = jax.vmap(call)(pad_grids(grids))
    for index, grid in enumerate(grids):
        alone = call(grid)
        count = len(grid.step_of)
        for key in ("rate", "rate_change", "acceleration"):
            one, other = getattr(alone.instant, key), getattr(both.instant, key)
            np.testing.assert_allclose(other[index, :count], one, atol=1e-15)


# a closed form --------------------------------------------------------------------------------------------------------

TOP = """<robot name="top"><link name="base_link"><inertial><origin xyz="0.2 -0.1 0.3" rpy="0 0 0"/><mass value="50"/>
<inertia ixx="4" ixy="0" ixz="0" iyy="4" iyz="0" izz="6"/></inertial></link></robot>"""


def skew(v: np.ndarray) -> np.ndarray:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def test_a_torque_free_symmetric_top(formula_motion, tmp_path):
    """R(t) = exp(t [L / I1]) R0 exp(t (1 - I3 / I1) w3 [e3]); steps of 0.125 s err by some 1e-10 of the rate."""
    urdf = tmp_path / "top.urdf"
    urdf.write_text(TOP)
    robot = Robot.from_urdf(urdf)
    assert robot.joints == ()
    rate0, one, three = np.array([0.1, -0.05, 0.2]), 4.0, 6.0
    initial = pin.Quaternion(ATTITUDE.copy()).toRotationMatrix()
    momentum = initial @ (np.array([one, one, three]) * rate0)
    own = (1.0 - three / one) * rate0[2] * np.array([0.0, 0.0, 1.0])
    times = np.linspace(0.0, 40.0, 21)
    found = run(robot, formula_motion(lambda _: (), urdf, robot), times, 0.125, rate=rate0)
    lever = POINT - robot.link("base_link").inertial.com
    for row, time in enumerate(times):
        attitude = expm(time * skew(momentum / one)) @ initial @ expm(time * skew(own))
        rate = attitude.T @ momentum / one + own
        change = -np.cross(rate, np.array([one, one, three]) * rate) / np.array([one, one, three])
        np.testing.assert_allclose(found.rate[row], rate, atol=1e-9)
        np.testing.assert_allclose(matrices(found.attitude[row : row + 1])[0], attitude, atol=1e-8)
        accel = np.cross(change, lever) + np.cross(rate, np.cross(rate, lever))
        np.testing.assert_allclose(found.accel[row], accel, atol=1e-9)


# derivatives ----------------------------------------------------------------------------------------------------------


def test_the_jacobian_is_that_of_the_residual(planar_case):
    """Central differences with h = 1e-5: truncation h^2 and rounding 1e-11 / h, both below 1e-5 of the column."""
    posterior = planar_case.posterior
    z = posterior.starting_point() + 0.1 * np.random.default_rng(0).normal(size=posterior.size)
    exact = posterior.jacobian(z)
    h = 1e-5
    for column in range(posterior.size):
        shift = np.zeros(posterior.size)
        shift[column] = h
        difference = (posterior.least_squares(z + shift) - posterior.least_squares(z - shift)) / (2.0 * h)
        scale = np.abs(exact[:, column]).max()
        assert np.abs(difference - exact[:, column]).max() < 1e-5 * scale, posterior.unknowns.names[column]
