"""A jump of the base's moments: against Pinocchio, a closed form, and MuJoCo with a mass that really moves."""

from __future__ import annotations

from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pinocchio as pin
import pytest

from bayesid._io.errors import InputError
from bayesid.diagnosis import Status, diagnose
from bayesid.diagnosis.candidates.instant_cause import sample_intervals
from bayesid.diagnosis.response.perturbed_model import PerturbedModel
from bayesid.inference.posterior import Posterior
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.recording import Recording
from bayesid.report.diagnosis.diagnosis_sentences import action_sentence
from bayesid.robot.composite_tables import composite_rows
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.robot import Load, Robot
from bayesid.simulation.dynamics import composite
from bayesid.simulation.effects import MassShift, create
from bayesid.simulation.model import BodyPrior, Manoeuvre, Model
from bayesid.simulation.sensors import Sensor, SensorKind, White
from studies.truth import mujoco as mj
from studies.truth import stepwise as ref
from studies.truth.bodies import SERVICER3
from tests.simulated import simulated as predicted

POINT, RATE0 = (0.2, -0.1, 0.3), (0.02, -0.03, 0.015)
TIMES = np.arange(0.0, 40.01, 0.5)
INSTANT = 16.3
MOTION = mj.smooth_motion(3, 40.0, 5, amplitude=0.5, frequencies=(0.03, 0.06), ramp=10.0)
MASS, BEFORE, AFTER = 6.0, np.array([0.4, 0.1, -0.3]), np.array([-0.2, 0.5, 0.2])
SIX = ((0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2))
SECOND = MASS * (np.outer(AFTER, AFTER) - np.outer(BEFORE, BEFORE))
MOMENTS = np.concatenate([MASS * (AFTER - BEFORE), SECOND[SIX]])
"""Those of a part of 6 kg that moves by 0.9 m."""


def simulated(robot: Robot, motion, effect: MassShift | None = None, moments=MOMENTS, rate0=RATE0, **options):
    """Rate, accelerometer and rotation matrices of the package's simulation, each with the leading axis T."""
    return predicted(robot, motion, TIMES, rate0, POINT, effect, moments, **options)


def stepwise(moments: np.ndarray, step: float = 0.05, instant: float = INSTANT, motion=MOTION, rate0=RATE0):
    """The same by Pinocchio, which at the instant changes the base's body and keeps both momenta of the robot."""
    reference = ref.Reference(SERVICER3, motion, zenith=None, wheel=np.zeros(3), base_force=None, base_torque=None)
    state, time, rows = reference.initial_state(rate0, np.eye(3)), 0.0, []

    def momentum():
        q, v, _ = reference.configuration(time, state)
        pin.ccrba(reference.model, reference.data, q, v)
        return reference.data.Ag.copy(), reference.data.hg.vector.copy(), v

    for target in np.sort([*TIMES, instant]):
        for part in range(count := int(np.ceil((target - time) / step - 1e-9))):
            state = reference.advance(time + part * (target - time) / count, state, (target - time) / count)
        time = target
        if target != instant:
            rotation = pin.Quaternion(state[3:7] / np.linalg.norm(state[3:7])).toRotationMatrix()
            rows.append((state[10:].copy(), reference.accelerometer(time, state, np.array(POINT)), rotation))
            continue
        kept = momentum()[1]
        second = np.zeros((3, 3))
        second[SIX] = second[SIX[::-1]] = moments[3:]
        inertia = np.trace(second) * np.eye(3) - second
        change = np.concatenate([[0.0], moments[:3], inertia[(0, 0, 1, 0, 1, 2), (0, 1, 1, 2, 2, 2)]])
        base = reference.model.inertias[1].toDynamicParameters() + change
        reference.model.inertias[1] = pin.Inertia.FromDynamicParameters(base)
        matrix, _, v = momentum()
        state[7:] = np.linalg.solve(matrix[:, :6], kept - matrix[:, 6:] @ v[6:])
    return tuple(np.array(column) for column in zip(*rows, strict=True))


def largest_error(given, truth) -> list[float]:
    """Largest errors of rate [rad/s], acceleration [m/s2] and attitude [rad]."""
    return [float(np.abs(a - b).max()) for a, b in zip(given, truth, strict=True)]


@pytest.fixture(scope="module")
def motion(formula_motion):
    return formula_motion(MOTION, SERVICER3, Robot.from_urdf(SERVICER3))


@pytest.fixture(scope="module")
def truth():
    return stepwise(MOMENTS)


@pytest.mark.slow
def test_the_jump_is_that_of_pinocchio_with_momentum_conserved(truth, motion):
    """The jump changes rate, acceleration and attitude by 3e-4, 3e-5 and 5e-3; the largest error is 3e-5 of that."""
    robot = Robot.from_urdf(SERVICER3)
    error = largest_error(simulated(robot, motion, MassShift((INSTANT,))), truth)
    effect = largest_error(simulated(robot, motion), truth)
    assert effect[0] > 1e-4
    assert effect[1] > 1e-5
    assert effect[2] > 1e-3
    assert (np.array(error) < 1e-4 * np.array(effect)).all()


@pytest.mark.slow
def test_a_jump_at_the_end_of_a_step_costs_no_accuracy(truth, motion):
    """The error is that without a jump; in the midst of a step of 0.5 s it would be some thirty times larger."""
    robot, effect = Robot.from_urdf(SERVICER3), MassShift((INSTANT,))
    jumps = effect.jumps(TIMES[-1])
    error = largest_error(simulated(robot, motion, effect, step=0.5), truth)
    smooth = largest_error(simulated(robot, motion, step=0.5, jumps=jumps), stepwise(0.0 * MOMENTS))
    through = largest_error(simulated(robot, motion, effect, step=0.5, jumps=()), truth)
    np.testing.assert_allclose(error, smooth, rtol=0.1)
    assert (np.array(through) > 10.0 * np.array(error)).all()


@pytest.mark.slow
def test_a_body_that_spins_about_a_principal_axis_turns_as_its_momentum_says(tmp_path, formula_motion):
    """The rate after the jump is the rate before times the ratio of inertias, for ever."""
    file = tmp_path / "body.urdf"
    file.write_text(
        '<robot name="r"><link name="b"><inertial><origin xyz="0 0 0"/><mass value="50"/><inertia ixx="8" iyy="9" '
        'izz="11" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>'
    )
    robot = Robot.from_urdf(file)
    nothing = formula_motion(lambda _: (np.zeros(0),) * 3, file, robot)
    # a ring of 2 kg m2 about z opens to 3.5: second moments of half of that along x and y, and the centre moves along z
    moments = np.array([0.0, 0.0, 5.0, 0.75, 0.75, 0.0, 0.0, 0.0, 0.0])
    rate, accel, _ = simulated(robot, nothing, MassShift(), moments, (0.0, 0.0, 0.3))
    spin = np.where(np.arange(len(TIMES)) > len(TIMES) // 2, 0.3 * 11.0 / 12.5, 0.3)
    np.testing.assert_allclose(rate[:, 2], spin, rtol=1e-12)
    np.testing.assert_allclose(rate[:, :2], 0.0, atol=1e-15)
    radial = -(spin[:, None] ** 2) * np.array(POINT[:2])
    np.testing.assert_allclose(accel[:, :2], radial, atol=1e-12)


def moved_in_mujoco(
    formula_motion, away: np.ndarray, travel: np.ndarray, rate0, duration: float
) -> tuple[Robot, mj.Truth, np.ndarray]:
    """The robot with a part at its centre of mass plus ``away``, MuJoCo's run in which it moves, and its moments."""
    robot, still = Robot.from_urdf(SERVICER3), lambda _: (np.zeros(3),) * 3
    rows = composite_rows(robot, kinematics(robot, formula_motion(still, SERVICER3, robot).evaluate(np.zeros(1))))[0]
    before = rows[1:4] / rows[0] + away
    body = mj.Body(MASS, before, 1e-3 * np.eye(3))
    length = float(np.linalg.norm(travel))
    path = mj.Mover(body, tuple(travel / length), length, INSTANT - duration / 2, duration)
    model = mj.TruthModel(SERVICER3, movers=[path], accel_position=POINT)
    run = model.run(still, TIMES, rate0=rate0, step=0.1 * duration)
    second = MASS * (np.outer(before + travel, before + travel) - np.outer(before, before))
    loaded = robot.with_load(Load("part", robot.base, InertialParameters(*body)))
    return loaded, run, np.concatenate([MASS * travel, second[SIX]])


@pytest.mark.slow
def test_a_mass_that_moves_through_the_centre_of_mass_is_a_jump(formula_motion):
    """What is left of the effect is 0.5 % if it moves in MuJoCo within 0.2 s, and a quarter of that within 0.05 s."""
    away, still = np.array([0.3, 0.4, -0.2]), lambda _: (np.zeros(3),) * 3
    left = []
    for duration in (0.2, 0.05):
        robot, run, moments = moved_in_mujoco(formula_motion, away, -1.8 * away, RATE0, duration)
        motion = formula_motion(still, SERVICER3, robot)
        found, without = simulated(robot, motion, MassShift((INSTANT,)), moments), simulated(robot, motion)
        triples = zip(found[:2], without[:2], (run.rate, run.accel), strict=True)
        left.append([np.linalg.norm(f - t) / np.linalg.norm(w - t) for f, w, t in triples])
    assert np.max(left[0]) < 0.006
    np.testing.assert_allclose(left[1], np.array(left[0]) / 4.0, rtol=0.05)


def test_a_mass_that_moves_elsewhere_turns_the_base_as_the_docstring_says(formula_motion):
    """A base at rest keeps the angle that the effect leaves out, however fast the mass moves."""
    away, travel = np.array([0.5, 0.0, 0.0]), np.array([0.0, 0.3, 0.0])
    robot, run, _ = moved_in_mujoco(formula_motion, away, travel, np.zeros(3), 0.2)
    np.testing.assert_allclose(run.rate[-1], 0.0, atol=1e-8)
    row = composite_rows(robot, kinematics(robot, JointState(*np.zeros((3, 1, len(robot.joints))))))[0]
    body = composite(jnp.asarray(row))
    turned = -np.asarray(body.inverse) @ np.cross(MASS * away, travel)
    np.testing.assert_allclose(2.0 * run.attitude[-1][:3], turned, atol=0.02 * np.abs(turned).max())


def test_the_true_rate_after_a_move_does_not_depend_on_when_it_is_read():
    """A step of the truth across the start or the end of the move gave the base a false kick of 1e-5 rad/s."""
    path = mj.Mover(mj.Body(MASS, np.array([0.4, 0.1, -0.3]), 1e-3 * np.eye(3)), (1.0, 0.0, 0.0), 0.3, 0.337, 0.1)
    ends = [
        mj.TruthModel(SERVICER3, movers=[path]).run(lambda _: (np.zeros(3),) * 3, times, rate0=RATE0).rate[-1]
        for times in ([0.337, 0.437, 0.6], [0.3312, 0.3377, 0.3991, 0.4353, 0.4409, 0.6])
    ]
    np.testing.assert_allclose(*ends, rtol=0.0, atol=1e-9)


def test_instants_are_those_of_each_recording(planar_case):
    posterior = planar_case.posterior
    model = posterior.model.extend(MassShift((10.0, np.inf, -1.0)))
    three = Posterior.of(model, posterior.manoeuvres * 3, step=0.5)
    grid = three.data.arrays.grid
    for part in (grid.node, grid.sample):
        time = np.asarray(part.environment.time)
        there = np.abs(np.asarray(part.unknown)[..., -9:]).sum(axis=(2, 3)) > 0.0
        np.testing.assert_array_equal(there[0], time[0] > 10.0)
        assert not there[1].any()
        assert there[2].all()


def test_columns_at_an_instant_are_the_table():
    robot, time = Robot.from_urdf(SERVICER3), np.linspace(0.0, 8.0, 17)
    columns = MassShift.table_at(time, 3.0)
    assert columns.shape == (17, 28, 9)
    np.testing.assert_array_equal(columns, MassShift((3.0,)).table(robot, None, time))
    np.testing.assert_array_equal(MassShift.table_at(time, 4.0), MassShift().table(robot, None, time))
    assert not columns[time <= 3.0].any()
    assert (np.abs(columns[time > 3.0]).sum(axis=1) == 1.0).all()


def test_instants_are_written_after_the_name():
    effect = create("mass-shift:12.5,inf")
    assert effect.instants == (12.5, np.inf)
    assert effect.label == "mass-shift:12.5,inf"
    assert create("mass-shift").label == "mass-shift"
    assert effect.in_recording(0).jumps(40.0) == (12.5,)
    assert effect.in_recording(0).jumps(12.0) == effect.in_recording(1).jumps(40.0) == ()
    assert MassShift().jumps(40.0) == (20.0,)
    with pytest.raises(InputError, match="there are more recordings"):
        effect.in_recording(2)
    with pytest.raises(InputError, match="no recording is named"):
        effect.jumps(40.0)
    with pytest.raises(InputError, match="not a list of instants"):
        create("mass-shift:link2")


def test_bounds_are_those_of_a_part_of_the_base():
    robot = Robot.from_urdf(SERVICER3)
    model = Model(robot, (Sensor(SensorKind.RATE, White(1e-5)),), ())
    first, second = MassShift().physical_bounds(model)
    assert np.abs(MOMENTS[:3]).max() < first.largest
    assert np.abs(MOMENTS[3:]).max() < second.largest


def flights_with_jumps(instants, ends, noise):
    """Recordings by Pinocchio of some lengths [s], in each of which the same part moves at an instant of its own."""
    rng, moments = np.random.default_rng(8), 0.3 * MOMENTS
    robot, recordings = Robot.from_urdf(SERVICER3), []
    for index, (instant, end) in enumerate(zip(instants, ends, strict=True)):
        motion = mj.smooth_motion(3, 40.0, 20 + index, amplitude=0.5, frequencies=(0.03, 0.06), ramp=10.0)
        rate, accel, _ = stepwise(moments, 0.1, instant, motion, np.roll(RATE0, index))
        rows = np.flatnonzero(end >= TIMES)
        columns = {f"rate.{axis}": rate[:, i] for i, axis in enumerate("xyz")}
        columns |= {f"accel.{axis}": accel[:, i] for i, axis in enumerate("xyz")}
        columns = {name: value[rows] + noise * rng.normal(size=len(rows)) for name, value in columns.items()}
        angles = np.array([motion(float(now))[0] for now in TIMES[rows]]) + 1e-6 * rng.normal(size=(len(rows), 3))
        columns |= {f"position.{joint.name}": angles[:, i] for i, joint in enumerate(robot.joints)}
        recordings.append(Recording(f"flight-{index + 1}", None, TIMES[rows], columns))
    guess = robot.perturbed("base_link", 0.1, np.random.default_rng(1))
    sensors = Sensor(SensorKind.RATE, White(noise)), Sensor(SensorKind.ACCEL, White(noise), position=POINT)
    model = Model(guess, sensors, (BodyPrior("base_link", guess.link("base_link").inertial, 0.3),))
    flights = [Manoeuvre(one, MeasuredMotion.from_recording(one, guess, sigma={0: 1e-6})) for one in recordings]
    return model, flights, moments


@pytest.mark.slow
def test_intervals_are_those_of_the_samples_and_not_of_their_padding():
    """One recording is four times as long as the others, whose grids are filled with copies of the last sample."""
    model, flights, _ = flights_with_jumps((16.3, 5.0, 5.0), (40.0, 10.0, 10.0), 1e-5)
    perturbed = PerturbedModel(Posterior.of(model, flights))
    z = perturbed.posterior.starting_point()
    fit = SimpleNamespace(operating=perturbed.operating(z, ()))
    for steps, flight in zip(sample_intervals(fit), flights, strict=True):
        np.testing.assert_allclose(steps, np.diff(flight.recording.time))


@pytest.mark.slow
def test_a_jump_is_found_beside_much_shorter_recordings():
    """More than half of the samples' grid is padding, which once left the search for the instant without an end."""
    model, flights, _ = flights_with_jumps((16.3, 4.2, 6.1), (40.0, 10.0, 10.0), 1e-5)
    result = diagnose(model, flights, 1)
    assert result.verdict.causes == ("mass-shift",)
    (row,) = [row for row in result.to_dict()["candidates"] if row["name"] == "mass-shift"]
    assert row["amplitude"]["flight-1.time"]["mean"] == pytest.approx(16.3, abs=0.6)
    (own,) = [row for row in result.to_dict()["sets"] if row["causes"] == ["mass-shift"] and not row["generic"]]
    assert own["refitted"]
    assert "mass-shift:" in action_sentence(result)


@pytest.mark.slow
def test_a_jump_in_every_recording_is_named_and_measured_with_its_instants():
    """Three recordings by Pinocchio, in each of which the same part moves at an instant of its own.

    With one recording and every fortieth part of it alone among the forms, two jumps in three were left without a name.
    """
    instants = (11.2, 16.3, 29.7)
    model, flights, moments = flights_with_jumps(instants, (40.0, 40.0, 40.0), 1e-5)
    result = diagnose(model, flights, 1)
    assert result.verdict.status is Status.EXPLAINED
    assert result.verdict.causes == ("mass-shift",)
    (row,) = [row for row in result.to_dict()["candidates"] if row["name"] == "mass-shift"]
    found = row["amplitude"]
    times = [found.pop(f"flight-{index + 1}.time") for index in range(3)]
    assert [item["mean"] for item in times] == pytest.approx(instants, abs=0.5)
    # no instant between two samples differs from another
    assert all(0.13 < item["sd"] < 0.5 and item["unit"] == "s" for item in times)
    error = [(item["mean"] - true) / item["sd"] for item, true in zip(found.values(), moments, strict=True)]
    error += [(item["mean"] - true) / item["sd"] for item, true in zip(times, instants, strict=True)]
    assert np.abs(error).max() < 4.0
    signal = [item["mean"] / item["sd"] for item in found.values()]
    assert np.abs(signal).max() > 5.0
