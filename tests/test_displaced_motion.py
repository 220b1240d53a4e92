"""Effects that displace links, against MuJoCo with a load that is far heavier than its prior."""

from __future__ import annotations

from pathlib import Path

import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.ndimage import gaussian_filter1d

from bayesid.recording.joint_motion import Motion
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.joint_state import JointState
from bayesid.robot.robot import Load, Robot
from bayesid.simulation.effects import Effect, EncoderOffset, JointBacklash, JointFlexibility, JointLatency, Parameter
from bayesid.simulation.model import Model
from bayesid.simulation.sensors import Sensor, SensorKind, White
from bayesid.simulation.simulator import ModelConstants, Simulator, Values
from bayesid.simulation.time_grid import build_grid, pad_grids
from studies.truth import mujoco as mj
from studies.truth.bodies import BRANCHED, link_body

SERVICER = Path(__file__).resolve().parents[1] / "studies" / "truth" / "robots" / "servicer3.urdf"
POINT = (0.2, -0.1, 0.3)
RATE0 = (0.004, -0.003, 0.002)
TIMES = np.arange(0.0, 40.01, 0.5)
HEAVY, COM = 370.0, np.array([1.4, 0.1, 0.05])
INERTIA = np.array([[60.0, 4.0, -2.0], [4.0, 75.0, 3.0], [-2.0, 3.0, 50.0]])
GUESSED = 10.0
"""Mass of the load in the robot, a thirty-seventh of the truth [kg]."""

WIDTH = 3.0
"""Of the bumps that the joints' positions follow [s]: without a kink that would make a spring ring."""
START = np.array([0.5, -0.8, 1.4])
"""Posture at both ends [rad]."""

SIZES, CENTRES = np.array([[0.4, -0.5, 0.6], [-0.3, 0.5, 0.2]]), np.array([[17.0, 19.0, 16.0], [23.0, 22.0, 24.0]])


def formula(time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, speeds and accelerations of the joints, at rest at the ends."""
    away = (time - CENTRES) / WIDTH
    bump = SIZES * np.exp(-0.5 * away**2)
    parts = bump, -bump * away / WIDTH, bump * (away**2 - 1.0) / WIDTH**2
    position, speed, acceleration = (part.sum(axis=0) for part in parts)
    return START + position, speed, acceleration


def robot(mass: float = GUESSED) -> Robot:
    """The robot with the load's true shape and some mass."""
    load = InertialParameters(mass, COM, INERTIA * mass / HEAVY)
    return Robot.from_urdf(SERVICER).with_load(Load("target", "link3", load))


class Recorded(Motion):
    """What encoders show of the formula's motion: joint positions with an offset, late by some time."""

    def __init__(self, offset: tuple[float, ...] = (0.0, 0.0, 0.0), delay: float = 0.0) -> None:
        self.offset, self.delay = np.array(offset), delay

    def evaluate(self, time):
        state = np.array([formula(float(t) - self.delay) for t in time]).transpose(1, 0, 2)
        return JointState(state[0] + self.offset, state[1], state[2])


def truth(**options) -> np.ndarray:
    """Rate and acceleration that MuJoCo gives the robot with the heavy load, (T, 6)."""
    carrying = mj.join(link_body(SERVICER, "link3"), mj.Body(HEAVY, COM, INERTIA))
    model = mj.TruthModel(SERVICER, accel_position=POINT, changed={"link3": carrying}, **options)
    run = model.run(formula, TIMES, rate0=RATE0, step=0.05)
    return np.concatenate([run.rate, run.accel], axis=1)


def simulated(
    motion: Motion, effect: Effect | None = None, values: tuple[float, ...] = (), mass: float = GUESSED
) -> np.ndarray:
    """Rate and acceleration where the load is unknown, ``mass`` in the robot, and gets its true parameters, (T, 6)."""
    sensors = (Sensor(SensorKind.RATE, White(1e-5)), Sensor(SensorKind.ACCEL, White(1e-5), position=POINT))
    carrier = robot(mass)
    prior = BodyPrior("target", carrier.link("target").inertial, 1.0)
    model = Model(carrier, sensors, (prior,), effects=() if effect is None else (effect,))
    grid = pad_grids([build_grid(carrier, ("target",), motion, TIMES, 0.25, effects=model.effects)])
    heavy = jnp.asarray(InertialParameters(HEAVY, COM, INERTIA).vector)
    present = tuple(jnp.asarray(values) for _ in model.effects)
    unknown = Values(heavy, jnp.asarray([RATE0]), jnp.zeros((1, 3)), jnp.zeros((1, 0)), present)
    attitude = jnp.asarray([[0.0, 0.0, 0.0, 1.0]])
    readings = Simulator.of(model).readings(ModelConstants.of(model), unknown, grid, attitude)[0]
    return np.concatenate([readings.rate[0], readings.accel[0]], axis=1)


def share(truth: np.ndarray, without: np.ndarray, carried: np.ndarray) -> float:
    """Error of a prediction that carries the effect, relative to that of one that does not; rate and acceleration."""
    parts = [slice(0, 3), slice(3, 6)]
    return max(np.linalg.norm((carried - truth)[:, p]) / np.linalg.norm((without - truth)[:, p]) for p in parts)


@pytest.mark.slow
def test_the_rigid_robot_is_that_of_mujoco():
    exact, error = truth(), simulated(Recorded()) - truth()
    assert np.abs(error[:, :3]).max() < 1e-6 * np.abs(exact[:, :3]).max()
    assert np.abs(error[:, 3:]).max() < 1e-5 * np.abs(exact[:, 3:]).max()


@pytest.mark.slow
def test_an_encoder_offset_displaces_the_unknown_load():
    shown = Recorded(offset=(0.0, 0.02, 0.0))
    assert share(truth(), simulated(shown), simulated(shown, EncoderOffset("joint2"), (0.02,))) < 1e-4


def test_the_offset_of_a_slide_is_in_metres():
    carrier = Robot.from_urdf(BRANCHED)
    model = Model(carrier, (Sensor(SensorKind.RATE, White(1e-5)),), (), effects=(EncoderOffset("slide", 0.01),))
    (effect,) = model.effects
    assert effect.parameters == (Parameter("offset", "m", 0.01),)
    assert [bound.unit for bound in effect.physical_bounds(model)] == ["m"]
    units = {item.label: item.amplitude_units for item in EncoderOffset.instances(model)}
    assert units["encoder-offset:slide"] == ("m",)
    assert all(unit == ("rad",) for label, unit in units.items() if label != "encoder-offset:slide")


@pytest.mark.slow
def test_a_late_joint_record_displaces_the_unknown_load():
    shown = Recorded(delay=0.2)
    assert share(truth(), simulated(shown), simulated(shown, JointLatency(), (0.2,))) < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("joint", ["joint1", "joint2", "joint3"])
def test_a_flexible_joint_has_one_stiffness_whatever_the_posture_at_the_start(joint):
    """The stiffness is that at zero, where no joint ever is; the robot's load is the true one."""
    bent = truth(flexible=[mj.Flexibility(joint, 1.5)])
    carried = simulated(Recorded(), JointFlexibility(joint), (1.5, 0.02), mass=HEAVY)
    assert share(bent, simulated(Recorded()), carried) < 0.15


def test_a_flexible_joint_is_bent_in_recordings_of_any_length():
    """In half a second the deflection is that of a recording of four seconds, but for the finer instants."""
    whole, short = np.linspace(0.0, 4.0, 33), np.linspace(0.0, 0.5, 5)
    carrier, effect = robot(), JointFlexibility("joint2")
    long_table = effect.table(carrier, Recorded(delay=-17.0), whole)[: len(short)]
    short_table = effect.table(carrier, Recorded(delay=-17.0), short)
    np.testing.assert_allclose(short_table[..., 0], long_table[..., 0], atol=0.02 * np.abs(long_table[..., 0]).max())


def played(gap: float, joint: int) -> np.ndarray:
    """Rate and acceleration in MuJoCo of the robot whose link coasts across the gap of one joint, (T, 6).

    The torque that MuJoCo transmits without play says to which side the link is pressed. Between the sides it lacks
    the acceleration that this torque would give it; the impact is inelastic and lasts a tenth of a second.
    """
    carrying = mj.join(link_body(SERVICER, "link3"), mj.Body(HEAVY, COM, INERTIA))
    model = mj.TruthModel(SERVICER, accel_position=POINT, changed={"link3": carrying})
    fine = np.arange(0.0, 40.001, 0.02)
    torque = model.run(formula, fine, rate0=RATE0, step=0.05).torque[:, joint]
    mass, mobility = np.zeros((model.model.nv, model.model.nv)), []
    free = [*range(6), int(model.driven_v[joint])]  # the other joints are driven
    for time in fine:
        model.data.qpos[model.driven_q] = formula(time)[0]
        mujoco.mj_fwdPosition(model.model, model.data)
        mujoco.mj_fullM(model.model, model.data, mass)
        mobility.append(np.linalg.inv(mass[np.ix_(free, free)])[6, 6])
    lacking = -torque * mobility
    loaded = np.abs(torque) > 1e-3 * np.abs(torque).max()
    place = [-0.5 * gap * np.sign(torque[np.argmax(loaded)])]
    speed = 0.0
    for acceleration in lacking[1:]:
        speed += 0.02 * acceleration
        there = place[-1] + 0.02 * speed
        if abs(there) >= 0.5 * gap:
            there, speed = 0.5 * gap * np.sign(there), 0.0
        place.append(there)
    return displaced_in_mujoco(model, joint, fine, np.array(place))


def displaced_in_mujoco(model: mj.TruthModel, joint: int, times: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Rate and acceleration of a robot one of whose links lies off its joint's position at some times, (T, 6)."""
    curve = make_interp_spline(times, gaussian_filter1d(place, 0.1 / 0.02), k=5)

    def moved(time: float) -> tuple[np.ndarray, ...]:
        state = [part.copy() for part in formula(time)]
        for order, part in enumerate(state):
            part[joint] += float(curve(np.clip(time, 0.0, 40.0), nu=order))
        return tuple(state)

    run = model.run(moved, TIMES, rate0=RATE0, step=0.02)
    return np.concatenate([run.rate, run.accel], axis=1)


@pytest.mark.slow
def test_a_link_coasts_across_the_play_of_its_joint():
    """While it does its speed depends on the torque, not on the gap: the time is right for a gap of 1e-3 rad."""
    shown = Recorded()
    without = simulated(shown, mass=HEAVY)
    with_play = simulated(shown, JointBacklash("joint2"), (1e-3, 0.0, 0.0, 0.0, 0.0), mass=HEAVY)
    changed, carried = played(1e-3, 1) - without, with_play - without
    rates = changed[:, :3].ravel(), carried[:, :3].ravel()
    assert np.corrcoef(*rates)[0, 1] > 0.85
    # between the crossings, whose impacts are left out, the link lies at one side
    lying = np.abs(changed[:, 3:]).max(axis=1) < 5e-5
    assert lying.sum() > 60
    assert np.abs(carried - changed)[lying, :3].max() < 0.1 * np.abs(changed)[lying, :3].max()


@pytest.mark.slow
def test_a_link_with_friction_waits_until_its_joint_has_crossed_the_gap():
    """The link's place is that of a play operator: it stays where it is while the motor moves within the gap."""
    carrying = mj.join(link_body(SERVICER, "link3"), mj.Body(HEAVY, COM, INERTIA))
    model = mj.TruthModel(SERVICER, accel_position=POINT, changed={"link3": carrying})
    fine, gap = np.arange(0.0, 40.001, 0.02), 1e-3
    motor = np.array([formula(time)[0][1] for time in fine])
    link = [motor[0] - 0.5 * gap * np.sign(motor[-1] - motor[0] + motor[len(motor) // 2] - motor[0])]
    for place in motor[1:]:
        link.append(np.clip(link[-1], place - 0.5 * gap, place + 0.5 * gap))
    shown = Recorded()
    without = simulated(shown, mass=HEAVY)
    changed = displaced_in_mujoco(model, 1, fine, np.array(link) - motor) - without
    carried = simulated(shown, JointBacklash("joint2"), (0.0, gap, 0.0, 0.0, 0.0), mass=HEAVY) - without
    assert np.corrcoef(changed[:, :3].ravel(), carried[:, :3].ravel())[0, 1] > 0.95
