"""Designs against closed forms on robots of one joint, finite differences and Pinocchio's own kinematics."""

from __future__ import annotations

from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pinocchio as pin
import pytest

from bayesid._io.errors import InputError
from bayesid.design import (
    AOptimal,
    BSplines,
    ConditionNumber,
    DOptimal,
    EOptimal,
    Fourier,
    InformationGain,
    Limits,
    Paper26,
    Paper26Intended,
    PaperExcitation,
    Plan,
    Problem,
    Search,
    Tip,
    TrajectoryFamily,
    design,
)
from bayesid.design.flight import Flight, Outcome
from bayesid.design.trajectory import Trajectory
from bayesid.recording.joint_motion import Motion
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.composite_tables import link_table
from bayesid.robot.inertial_parameters import InertialParameters, mass_com_inertia
from bayesid.robot.kinematics import configuration, kinematics
from bayesid.robot.log_cholesky import log_cholesky_vector
from bayesid.robot.regressors import balance_regressor
from bayesid.robot.robot import Robot
from bayesid.simulation.effects import Effect, Parameter
from bayesid.simulation.model import Model
from bayesid.simulation.sensors import Sensor, SensorKind, White

BASE_INERTIA, WHEEL_INERTIA, MASS, SLIDER = 3.0, 0.5, 20.0, 5.0
SIGMA = 1e-4


def robot(joint: str) -> Robot:
    """A base whose centre of mass is its origin, with one joint there: a flywheel about z, or a slider along x."""
    kind, axis = {"flywheel": ("revolute", "0 0 1"), "slider": ("prismatic", "1 0 0")}[joint]
    none = 'ixy="0" ixz="0" iyz="0"'
    return Robot.from_string(f"""<robot name="{joint}">
      <link name="body"><inertial><mass value="{MASS}"/><inertia ixx="2" iyy="2.5" izz="{BASE_INERTIA}" {none}/>
        </inertial></link>
      <link name="part"><inertial><mass value="{SLIDER}"/><inertia ixx="0.4" iyy="0.4" izz="{WHEEL_INERTIA}" {none}/>
        </inertial></link>
      <joint name="only" type="{kind}"><parent link="body"/><child link="part"/><axis xyz="{axis}"/>
        <limit lower="-1" upper="1.5" effort="1" velocity="2"/></joint></robot>""")


def plan(
    joint: str = "flywheel", effects: tuple[Effect, ...] = (), unknown: bool = True, duration: float = 10.0
) -> Plan:
    """Return a plan of quintic splines; only the rate is sensed and the base starts at rest."""
    own = robot(joint)
    priors = (BodyPrior("body", own.link("body").inertial, 0.5),) if unknown else ()
    model = Model(own, (Sensor(SensorKind.RATE, White(SIGMA)),), priors, effects=effects, rate_sigma=0.0)
    return Plan(model, BSplines([0.0], [0], duration, points=4), 0.5, Tip.of(own), step=0.5)


@pytest.fixture(scope="module")
def flywheel() -> Problem:
    criteria = (
        Paper26(),
        Paper26Intended(),
        ConditionNumber(),
        DOptimal(),
        AOptimal(),
        EOptimal(),
        InformationGain(draws=2),
    )
    limits = Limits(joint_speed=0.5, base_rotation=0.3, tip_rate=0.4, tip_speed=1.0, quiet_band=(0.8, 1.2))
    return Problem(plan(), limits, criteria)


PARAMETERS = np.array([0.6, -0.3, 0.4, 0.2])


def seen(own: Plan) -> np.ndarray:
    """The information, by hand: with w = -Iw theta' / Izz about z, moments dIxz, dIyz and dIzz turn the rate by
    -w (dIxz / Ixx, dIyz / Iyy, dIzz / Izz), the total inertia dividing."""
    speed = own.family.motion(PARAMETERS).evaluate(own.samples).velocity[:, 0]
    total = np.array([2.0, 2.5, BASE_INERTIA]) + np.array([0.4, 0.4, WHEEL_INERTIA])
    rate = -WHEEL_INERTIA * speed / total[2]

    def moments(z: jax.Array) -> jax.Array:
        return mass_com_inertia(log_cholesky_vector(own.model.priors[0].centre, 0.5 * z))[jnp.array([8, 9, 6])]

    slope = np.asarray(jax.jacfwd(moments)(jnp.zeros(10))) / total[:, None]
    return (rate**2).sum() / own.sigma[2] ** 2 * slope.T @ slope


@pytest.mark.slow
def test_optimality_of_the_posterior_in_closed_form(flywheel: Problem) -> None:
    costs, information = flywheel.costs(PARAMETERS), seen(flywheel.plan)
    variances = 0.25 / (1.0 + np.linalg.eigvalsh(information))  # of log-Cholesky coordinates, whose prior has sd 0.5
    assert variances.min() < 1e-4
    assert costs["d-optimal"] == pytest.approx(0.5 * np.log(variances).sum(), rel=1e-6)
    assert costs["a-optimal"] == pytest.approx(0.5 * np.log(variances.mean()), rel=1e-6)
    assert costs["e-optimal"] == pytest.approx(np.log(0.5), rel=1e-6)  # seven of ten directions are not seen
    assert costs["information-gain"] == pytest.approx(0.5 * np.log(variances / 0.25).sum(), rel=1e-6)


@pytest.mark.slow
def test_the_information_gain_is_averaged_over_the_prior(flywheel: Problem) -> None:
    criterion = flywheel.criteria[-1]
    points = flywheel.points(criterion, np.random.default_rng(0))
    single = [flywheel.cost(criterion, PARAMETERS, [point])[0] for point in points]
    assert len(points) == 2
    assert single[0] != pytest.approx(single[1])
    assert flywheel.cost(criterion, PARAMETERS, points)[0] == pytest.approx(np.mean(single))


@pytest.mark.slow
def test_base_motion_of_a_flywheel_in_closed_form(flywheel: Problem) -> None:
    trajectory = flywheel.trajectory(PARAMETERS)
    state = flywheel.plan.family.motion(PARAMETERS).evaluate(np.asarray(trajectory.time))
    share = WHEEL_INERTIA / (BASE_INERTIA + WHEEL_INERTIA)
    # 2e-8: between the nodes of the integration the attitude is interpolated
    np.testing.assert_allclose(trajectory.excursion[:, 5], -share * state.position[:, 0], atol=2e-8)
    np.testing.assert_allclose(trajectory.excursion[:, :5], 0.0, atol=1e-9)
    np.testing.assert_allclose(trajectory.rotation, share * np.abs(state.position[:, 0]), atol=2e-8)
    np.testing.assert_allclose(trajectory.tip_rate, np.abs(state.velocity[:, 0]), atol=1e-9)  # more than in space
    costs = flywheel.costs(PARAMETERS)
    largest = (share * np.abs(state.position[:, 0]).max()) ** 2
    assert costs["paper-26"] == pytest.approx(-3.0 * largest, rel=0.01)  # the coarse grid may miss the peak
    assert costs["paper-26-intended"] == pytest.approx(largest, rel=0.01)


@pytest.mark.slow
def test_base_motion_of_a_slider_in_closed_form() -> None:
    own = plan("slider")
    trajectory = jax.jit(lambda p: Flight(own, p, jnp.zeros(own.unknowns.size)).trajectory())(PARAMETERS)
    state = own.family.motion(PARAMETERS).evaluate(np.asarray(trajectory.time))
    share = SLIDER / (MASS + SLIDER)
    np.testing.assert_allclose(trajectory.excursion[:, 0], -share * state.position[:, 0], atol=1e-9)
    np.testing.assert_allclose(trajectory.tip_speed, np.abs(state.velocity[:, 0]), atol=1e-9)
    np.testing.assert_allclose(trajectory.acceleration[:, 0], -share * state.acceleration[:, 0], atol=1e-9)


def outcome(**parts: np.ndarray) -> SimpleNamespace:
    """An outcome with given parts."""
    empty = Trajectory(*([np.zeros((1, 3))] * len(Trajectory._fields)))
    trajectory = empty._replace(excursion=jnp.asarray(parts.get("excursion", np.zeros((1, 6)))))
    return SimpleNamespace(trajectory=trajectory, regressor=jnp.asarray(parts["regressor"]))


def flown(own: Plan) -> Outcome:
    """The outcome of a plan along `PARAMETERS`, without what is not asked for."""
    flight = Flight(own, jnp.asarray(PARAMETERS), jnp.zeros(own.unknowns.size))
    return Outcome(flight, jax.jit(lambda p: Flight(own, p, flight.z).information())(PARAMETERS))


def test_paper_26_as_printed_reduces_to_signed_squares() -> None:
    rng = np.random.default_rng(4)
    excursion = rng.normal(size=(9, 6))
    y = np.abs(excursion).max(axis=0) ** 2
    own = outcome(excursion=excursion, regressor=np.zeros((1, 1)))
    printed = sum(-a + b + 3.0 * c for a, b, c in (y[:3], y[3:]))
    assert Paper26().cost(plan(), own) == pytest.approx(-printed)
    balanced = sum(3.0 * s[0] + s[1] - s[2] for s in (np.sort(y[:3]), np.sort(y[3:])))
    assert Paper26Intended().cost(plan(), own) == pytest.approx(-balanced)


def test_condition_number_is_that_of_the_singular_values() -> None:
    rng = np.random.default_rng(5)
    left, right = (np.linalg.qr(rng.normal(size=(size, 10)))[0] for size in (60, 10))
    regressor = left * np.geomspace(1.0, 40.0, 10) @ right.T
    assert ConditionNumber().cost(plan(), outcome(regressor=regressor)) == pytest.approx(np.log(40.0))


class Steady(Effect):
    """A rate read too large by a constant, about z."""

    name = "steady"
    parameters = (Parameter("z", "rad/s", 1e-3),)

    def read(self, values, readings):
        return readings.replace(rate=readings.rate + jnp.array([0.0, 0.0, 1.0]) * values[0])


class Growing(Steady):
    """The same, growing with time."""

    name = "growing"

    def read(self, values, readings):
        return readings.replace(rate=readings.rate + readings.time[:, None] * jnp.array([0.0, 0.0, 1.0]) * values[0])


@pytest.mark.slow
def test_gradients_are_those_of_finite_differences(flywheel: Problem) -> None:
    rng = np.random.default_rng(6)
    direction, step = rng.normal(size=4), 1e-5
    ahead, behind = PARAMETERS + step * direction, PARAMETERS - step * direction
    for criterion in flywheel.criteria:
        slope = flywheel.cost(criterion, PARAMETERS)[1] @ direction
        difference = (flywheel.cost(criterion, ahead)[0] - flywheel.cost(criterion, behind)[0]) / (2.0 * step)
        assert slope == pytest.approx(difference, rel=1e-4, abs=1e-6), criterion.name
    slopes = flywheel.fractions(PARAMETERS)[1] @ direction
    differences = (flywheel.fractions(ahead)[0] - flywheel.fractions(behind)[0]) / (2.0 * step)
    np.testing.assert_allclose(slopes, differences, rtol=1e-4, atol=1e-6)


@pytest.mark.usefixtures("slow")  # the command's tests check limits by independent kinematics
def test_designs_keep_the_limits_between_the_optimisers_instants(flywheel: Problem) -> None:
    found = design(flywheel, 3, {0: 1e-6}, Search(starts=1, iterations=8))
    family, own = flywheel.plan.family, flywheel.plan.model.robot
    times = np.linspace(0.0, family.duration, 40 * 50)
    spins = {item.criterion: item for item in found}
    for item in found:
        state = item.motion.evaluate(times)
        assert np.abs(state.velocity).max() <= 0.4 * (1 + 1e-9)  # tip_rate, by hand
        assert state.position.min() >= -1.0
        assert state.position.max() <= 1.5
        np.testing.assert_allclose(state.velocity[[0, -1]], 0.0, atol=1e-12)
        np.testing.assert_allclose(state.acceleration[[0, -1]], 0.0, atol=1e-12)
        assert all(reached.kept for reached in item.reached)
        assert quiet(item.trajectory, (0.8, 1.2)) < 1.02e-3
        assert own.name == "flywheel"
    # what is optimal by a criterion is best by it
    for name, item in spins.items():
        assert item.costs[name] == min(other.costs[name] for other in found), name
    active = [reached.name for reached in spins["d-optimal"].reached if reached.active]
    assert active, "a faster motion tells more: some limit must hold it back"
    assert spins["d-optimal"].predicted.sd[6] < 0.5 * BASE_INERTIA


def quiet(trajectory: Trajectory, band: tuple[float, float]) -> float:
    """Part of the angular acceleration's power within a band, by a discrete Fourier transform."""
    signal = np.asarray(trajectory.rate_change)[:, 2]
    interval = trajectory.time[1]
    spectrum = np.abs(np.fft.rfft(signal, 16 * len(signal))) ** 2
    frequency = np.fft.rfftfreq(16 * len(signal), interval)
    inside = (frequency >= band[0]) & (frequency <= band[1])
    return float(spectrum[inside].sum() / spectrum.sum())


@pytest.mark.usefixtures("slow")  # the command's tests show the same
def test_limits_that_cannot_be_kept_are_named() -> None:
    problem = Problem(plan(duration=4.0), Limits(quiet_band=(0.0, 2.0)), (DOptimal(),))
    with pytest.raises(InputError, match="quiet_band"):
        design(problem, 0, {0: 1e-6}, Search(starts=1, iterations=3))


class Swing(TrajectoryFamily):
    """A user's own: one bump."""

    name = "bump"
    names = ("height",)
    duration = 10.0
    scale = np.array([0.5])
    centre = np.zeros(1)

    def position(self, parameters, time):
        return parameters * jnp.sin(jnp.pi * time / self.duration) ** 4


FAMILIES = (
    Swing(),
    BSplines([0.2], [0], 10.0, points=3),
    Fourier([0.2], [0], 10.0, harmonics=3),
    PaperExcitation([0.2], 10.0),
)


@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)
def test_families_are_smooth_and_start_and_end_at_rest(family: TrajectoryFamily) -> None:
    parameters = family.centre + family.scale * np.random.default_rng(7).normal(size=family.size)
    motion: Motion = family.motion(parameters)
    ends = motion.evaluate(np.array([0.0, family.duration]))
    np.testing.assert_allclose(ends.position[0], ends.position[1], atol=1e-12)
    np.testing.assert_allclose(ends.velocity, 0.0, atol=1e-12)
    np.testing.assert_allclose(ends.acceleration, 0.0, atol=1e-12)
    times, step = np.linspace(0.3, family.duration - 0.3, 23), 1e-5
    here, ahead, behind = (motion.evaluate(times + shift) for shift in (0.0, step, -step))
    np.testing.assert_allclose((ahead.position - behind.position) / (2 * step), here.velocity, atol=1e-7)
    np.testing.assert_allclose((ahead.velocity - behind.velocity) / (2 * step), here.acceleration, atol=1e-6)
    assert len(family.names) == family.size == len(parameters)


def test_the_force_balance_is_that_of_recursive_newton_euler() -> None:
    own = Robot.shipped("ets7")
    rng = np.random.default_rng(8)
    motion = BSplines(np.zeros(6), range(6), 20.0, points=3).motion(rng.normal(size=18))
    times = np.array([3.0, 8.0, 13.0])
    moved = kinematics(own, motion.evaluate(times))
    rate, change, acceleration = rng.normal(size=(3, 3, 3))
    tables = [link_table(own, name, moved) for name in own.links]
    wrench = sum(
        balance_regressor(jnp.asarray(table), rate, change, acceleration) @ link.inertial.vector
        for table, link in zip(tables, own.links.values(), strict=True)
    )
    state, data = motion.evaluate(times), own.model.createData()
    for row in range(3):
        q = configuration(own, state.position[row])
        v = np.concatenate([np.zeros(3), rate[row], state.velocity[row]])
        a = np.concatenate([acceleration[row], change[row], state.acceleration[row]])
        expected = pin.rnea(own.model, data, q, v, a)[:6]
        np.testing.assert_allclose(np.asarray(wrench)[row], expected, rtol=1e-10)


def test_a_plan_needs_a_frame_that_exists() -> None:
    with pytest.raises(InputError, match=r"no frame named 'hand'.*tip"):
        Tip.of(Robot.shipped("ets7"), "hand")
    assert Tip.of(Robot.shipped("ets7")).name == "tip"


@pytest.mark.slow
def test_bodies_marginalised_only_are_not_judged() -> None:
    own = robot("flywheel")
    wheel = BodyPrior("part", own.link("part").inertial, 0.1, nuisance=True)
    base = BodyPrior("body", own.link("body").inertial, 0.5)
    model = Model(own, (Sensor(SensorKind.RATE, White(SIGMA)),), (base, wheel), rate_sigma=0.0)
    shared = Plan(model, BSplines([0.0], [0], 10.0, points=4), 0.5, Tip.of(own), step=0.5)
    result = DOptimal().cost(shared, flown(shared))
    # of the ratio of both inertias only, which is as uncertain as the wheel's
    known = 10 * np.log(0.5) - 0.5 * np.log1p(np.linalg.eigvalsh(seen(plan()))).sum()
    assert known < float(result) < 10 * np.log(0.5)
    assert isinstance(base.centre, InertialParameters)
