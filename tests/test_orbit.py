"""Orbits against closed forms, against Newton's law integrated, and against what the paper says of its torque."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bayesid._io.errors import InputError
from bayesid._math.small_matrices import rotation
from bayesid.robot.composite_tables import link_table
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.robot import Robot
from bayesid.simulation.dynamics import composite
from bayesid.simulation.effects import GravityGradient
from bayesid.simulation.instant import Environment, Instant
from bayesid.simulation.orbit import EARTH, Orbit
from studies.truth.orbit import Orbit as TrueOrbit
from studies.truth.stepwise import Reference

TIME = np.linspace(0.0, 6000.0, 41)


def test_zenith_of_a_circular_orbit():
    orbit = Orbit(6.916e6)
    n = np.sqrt(EARTH / 6.916e6**3)
    assert orbit.mean_motion == pytest.approx(n, rel=1e-15)
    state = orbit.state(TIME, 1.1)
    zeros = np.zeros_like(TIME)
    np.testing.assert_allclose(state.zenith, np.stack([np.cos(n * TIME), np.sin(n * TIME), zeros], 1), atol=1e-13)
    np.testing.assert_allclose(state.velocity, np.stack([-np.sin(n * TIME), np.cos(n * TIME), zeros], 1), atol=1e-13)
    np.testing.assert_allclose(state.gradient, EARTH / 6.916e6**3, rtol=1e-14)
    np.testing.assert_allclose(state.argument_of_latitude, 1.1 + n * TIME, rtol=1e-14)


@pytest.mark.parametrize("argument_of_latitude", [-2.0, 0.3, 3.1, 5.9, 40.0])
@pytest.mark.parametrize("eccentricity", [0.01, 0.3, 0.7])
def test_an_elliptic_orbit_obeys_newtons_law(eccentricity, argument_of_latitude):
    """Start on the ellipse (vis-viva, from the perigee's angle), integrate r'' = -mu r / r^3 to 1e-12, compare."""
    perigee, axis = 0.8, 2.4e7
    anomaly = argument_of_latitude - perigee
    semi_latus = axis * (1.0 - eccentricity**2)
    distance = semi_latus / (1.0 + eccentricity * np.cos(anomaly))
    speed = np.sqrt(EARTH / semi_latus)
    start = [distance, 0.0, speed * eccentricity * np.sin(anomaly), speed * (1.0 + eccentricity * np.cos(anomaly))]

    def newton(_, y):
        pull = -EARTH / np.hypot(y[0], y[1]) ** 3
        return [y[2], y[3], pull * y[0], pull * y[1]]

    truth = solve_ivp(newton, (0.0, TIME[-1]), start, t_eval=TIME, rtol=1e-12, atol=1e-6, method="DOP853").y
    state = Orbit(axis, eccentricity, argument_of_perigee=perigee).state(TIME, argument_of_latitude)
    radius = np.hypot(truth[0], truth[1])
    np.testing.assert_allclose((EARTH / state.gradient) ** (1.0 / 3.0), radius, rtol=1e-9)
    np.testing.assert_allclose(state.zenith[:, :2].T, truth[:2] / radius, atol=1e-8)
    np.testing.assert_allclose(state.velocity[:, :2].T, truth[2:] / np.hypot(truth[2], truth[3]), atol=1e-8)
    angle = np.unwrap(np.arctan2(truth[1], truth[0]))
    np.testing.assert_allclose(state.argument_of_latitude - argument_of_latitude, angle, atol=1e-8)
    assert not state.zenith[:, 2].any()


@pytest.mark.parametrize("eccentricity", [0.0, 0.4])
def test_the_period(eccentricity):
    """After a period all is as before, whatever the eccentricity; after half of one, from perigee, it is opposite."""
    orbit = Orbit(1.2e7, eccentricity, argument_of_perigee=0.5)
    period = 2.0 * np.pi * np.sqrt(1.2e7**3 / EARTH)
    state = orbit.state([0.0, 0.5 * period, period, 3.0 * period], 0.5)
    np.testing.assert_allclose(state.zenith[:, 0], [1.0, -1.0, 1.0, 1.0], atol=1e-10)
    np.testing.assert_allclose(
        state.argument_of_latitude, 0.5 + np.array([0.0, np.pi, 2.0 * np.pi, 6.0 * np.pi]), atol=1e-9
    )
    distance = (EARTH / state.gradient) ** (1.0 / 3.0)
    expected = 1.2e7 * np.array([1 - eccentricity, 1 + eccentricity, 1 - eccentricity, 1 - eccentricity])
    np.testing.assert_allclose(distance, expected, rtol=1e-9)


def test_the_sun_in_orbit_axes():
    """At latitude 0 the zenith is the node; a quarter of an orbit later x is along-orbit and y is minus the node."""
    sun = (0.6, 0.0, 0.8)
    orbit = Orbit(7e6, sun=sun)
    np.testing.assert_allclose(orbit.state([0.0, 50.0], 0.0).sun, [sun, sun], atol=1e-15)
    np.testing.assert_allclose(orbit.state([0.0], 0.5 * np.pi).sun, [[0.0, -0.6, 0.8]], atol=1e-15)
    assert not Orbit(7e6).state([0.0]).sun.any()
    # the angle between zenith and Sun does not depend on which axes are used
    n, argument_of_latitude = orbit.mean_motion, 0.7
    state = orbit.state([300.0], argument_of_latitude)
    zenith = np.array([np.cos(argument_of_latitude + n * 300.0), np.sin(argument_of_latitude + n * 300.0), 0.0])
    assert state.zenith[0] @ state.sun[0] == pytest.approx(zenith @ sun, abs=1e-12)


def test_a_sun_of_any_length_is_a_direction():
    assert np.linalg.norm(Orbit(7e6, sun=(3.0, 4.0, 0.0)).state([0.0], 0.3).sun) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("radius", "eccentricity", "message"),
    [
        (6916.0, 0.0, "6916 m lies inside the Earth"),
        (7e6, 1.0, r"eccentricity 1 is not in \[0, 1\)"),
        (7e6, -0.1, "eccentricity -0.1"),
    ],
)
def test_impossible_orbits(radius, eccentricity, message):
    with pytest.raises(InputError, match=message):
        Orbit(radius, eccentricity)


# the paper, section 2.3: an error of 1 km in the orbit's radius changes the torque by the order of 1e-6 N m ---------


def base_moment(radius: float, quaternion: np.ndarray) -> Instant:
    """The base of ETS-VII alone on a circular orbit, as the package's effects see it."""
    robot = Robot.shipped("ets7")
    still = JointState(*np.zeros((3, 1, len(robot.joints))))
    row = link_table(robot, "base_link", kinematics(robot, still))[0] @ robot.link("base_link").inertial.vector
    state = Orbit(radius).state(np.zeros(1))
    known = (jnp.zeros(3), jnp.zeros(3), jnp.zeros(6))
    environment = Environment(jnp.zeros(()), *(jnp.asarray(field[0]) for field in state), *known)
    return Instant(environment, composite(jnp.asarray(row)), rotation(jnp.asarray(quaternion)), *jnp.zeros((3, 3)))


def reference_torque(radius: float, quaternion: np.ndarray, file) -> np.ndarray:
    """About the centre of mass, from the reference's body-by-body sum over the same base."""
    robot = Robot.shipped("ets7")
    body = robot.link("base_link").inertial
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = body.inertia
    file.write_text(
        '<robot name="base"><link name="base_link"><inertial>'
        f'<origin xyz="{" ".join(map(repr, map(float, body.com)))}"/>'
        f'<mass value="{body.mass!r}"/><inertia ixx="{float(xx)!r}" ixy="{float(xy)!r}" ixz="{float(xz)!r}" '
        f'iyy="{float(yy)!r}" iyz="{float(yz)!r}" izz="{float(zz)!r}"/></inertial></link></robot>'
    )
    reference = Reference(
        file,
        lambda _: (np.zeros(0), np.zeros(0), np.zeros(0)),
        zenith=TrueOrbit(radius).zenith,
        wheel=np.zeros(3),
        base_force=None,
        base_torque=None,
    )
    q, _, _ = reference.configuration(0.0, np.concatenate([np.zeros(3), quaternion, np.zeros(6)]))
    wrench = reference.gradient_wrench(0.0, q)
    assert np.abs(wrench[:3]).max() < 1e-12  # no resultant force
    return wrench[3:]


@pytest.mark.slow
def test_a_kilometre_of_radius_changes_the_torque_by_the_order_of_1e_6_newton_metres(tmp_path):
    """At most 3 mu / R^3 (I3 - I1) / 2 x 3 km / R = 3.2e-6 N m, of a largest torque of 7.3e-3 N m."""
    radii = (6.916e6, 6.917e6)
    sizes, changes = [], []
    for number, attitude in enumerate(np.random.default_rng(0).normal(size=(40, 4))):
        unit = attitude / np.linalg.norm(attitude)
        moments = [base_moment(radius, unit) for radius in radii]
        near, far = (np.asarray(GravityGradient().wrench(jnp.zeros(0), m, jnp.zeros(0)).torque) for m in moments)
        if number < 3:
            for torque, radius in zip((near, far), radii, strict=True):
                expected = reference_torque(radius, unit, tmp_path / "base.urdf")
                np.testing.assert_allclose(torque, expected, rtol=1e-9, atol=1e-14)
        sizes.append(np.linalg.norm(near))
        changes.append(np.linalg.norm(near - far))
    moments = np.linalg.eigvalsh(Robot.shipped("ets7").link("base_link").inertial.inertia)
    bound = 1.5 * EARTH / 6.916e6**3 * (moments[2] - moments[0])
    assert bound == pytest.approx(7.3e-3, rel=0.02)
    assert 0.7 * bound < max(sizes) <= bound
    assert max(changes) <= bound * 3.0 / 6916.0 < 3.3e-6
    assert np.median(changes) > 1e-6
