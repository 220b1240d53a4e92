"""Coordinates of the unknowns: every value is a physical body, and the prior is as wide as it says."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import ClassVar

import numpy as np
import pytest

from bayesid._io.errors import InputError
from bayesid.inference.unknowns import LOG_CHOLESKY, Unknowns
from bayesid.robot.body_prior import BodyPrior, check_mixing, coordinates_of, draw_inertial
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.simulation.effects import Effect, Parameter

CENTRE = InertialParameters(60.0, [0.05, -0.03, 0.1], [[2.4, 0.05, 0.1], [0.05, 2.6, -0.2], [0.1, -0.2, 2.8]])
OTHER = InertialParameters(5.0, [0.5, 0.0, 0.02], [[0.1, 0.0, 0.0], [0.0, 0.44, 0.01], [0.0, 0.01, 0.46]])


class Shared(Effect):
    name = "shared"
    parameters = (Parameter("x", "N", 2.0), Parameter("y", "N", 3.0, 7.0))


class Own(Effect):
    name = "own"
    per_recording: ClassVar[bool] = True
    parameters = (Parameter("delay", "s", 0.1),)


def unknowns(**changes) -> Unknowns:
    given = {
        "bodies": (BodyPrior("base_link", CENTRE, 0.3), BodyPrior("load", OTHER, 0.1)),
        "effects": (Shared(), Effect(), Own()),
        "recordings": 2,
        "rate_sigma": 0.01,
        "tilt_sigma": (0.0, 1e-3),
    }
    return Unknowns(**{**given, **changes})


def body_of(prior: BodyPrior, z: np.ndarray) -> InertialParameters:
    layout = Unknowns((prior,), (), 1, 0.0, np.zeros(1))
    return InertialParameters.from_vector(np.asarray(layout.values(z).inertial))


# bodies ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("spread", [0.05, 1.0])
def test_every_value_is_a_physical_body(spread):
    """At a spread of one, z of 3 changes scales by e^3; the pseudo-inertia relative to the centre stays positive."""
    rng = np.random.default_rng(1)
    prior = BodyPrior("base_link", CENTRE, spread)
    for z in rng.normal(size=(60, 10)) * 1.5:
        body = body_of(prior, z)  # raises where no body has these values
        assert body.mass > 0.0
        assert np.linalg.eigvalsh(body.pseudo_inertia)[0] > 0.0


def test_zero_is_the_centre():
    body = body_of(BodyPrior("base_link", CENTRE, 0.7), np.zeros(10))
    np.testing.assert_allclose(body.vector, CENTRE.vector, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("spread", [0.05, 1.0])
def test_coordinates_of_a_body_are_those_it_came_from(spread):
    prior = BodyPrior("base_link", CENTRE, spread)
    for z in np.random.default_rng(2).normal(size=(20, 10)):
        np.testing.assert_allclose(coordinates_of(prior, body_of(prior, z)), z, atol=1e-8)


def test_draws_have_the_stated_width():
    """Each coordinate of a draw is normal with the spread: mean and sd within four of their standard errors."""
    spread, count = 0.2, 800
    rng = np.random.default_rng(3)
    unit = BodyPrior("link", CENTRE, 1.0)
    theta = np.array([coordinates_of(unit, draw_inertial(CENTRE, spread, rng)) for _ in range(count)])
    assert np.abs(theta.mean(axis=0)).max() < 4.0 * spread / np.sqrt(count)
    assert np.abs(theta.std(axis=0) / spread - 1.0).max() < 4.0 / np.sqrt(2.0 * count)
    off_diagonal = np.corrcoef(theta.T)[~np.eye(10, dtype=bool)]
    assert np.abs(off_diagonal).max() < 4.5 / np.sqrt(count)


def test_the_mass_is_log_normal_with_twice_the_width():
    prior = BodyPrior("link", CENTRE, 0.1)
    z = np.zeros(10)
    z[0] = 1.3
    assert body_of(prior, z).mass == pytest.approx(CENTRE.mass * np.exp(2.0 * 0.1 * 1.3), rel=1e-12)


@pytest.mark.parametrize(("spread", "message"), [(0.0, "spread 0 of base_link"), (-1.0, "spread -1 of base_link")])
def test_a_prior_needs_a_width(spread, message):
    with pytest.raises(InputError, match=message):
        BodyPrior("base_link", CENTRE, spread)


def test_a_prior_needs_a_body_with_volume():
    rod = InertialParameters(2.0, np.zeros(3), np.diag([0.0, 1.0, 1.0]))
    with pytest.raises(InputError, match=r"rod: the prior of rod is centred on a body without extent \(mass 2 kg\)"):
        BodyPrior("rod", rod, 1.0)


# layout ---------------------------------------------------------------------------------------------------------------


def test_names_follow_the_layout():
    names = unknowns().names
    assert names[:10] == tuple(f"base_link.{key}" for key in LOG_CHOLESKY)
    assert names[10:20] == tuple(f"load.{key}" for key in LOG_CHOLESKY)
    assert names[20:26] == tuple(f"initial-rate[{i}].{axis}" for i in range(2) for axis in "xyz")
    assert names[26:29] == tuple(f"initial-attitude[1].{axis}" for axis in "xyz")
    assert names[29:] == ("shared.x", "shared.y", "own[0].delay", "own[1].delay")
    assert unknowns().size == len(names)


def test_each_coordinate_moves_only_what_its_name_says_by_one_sigma():
    layout = unknowns()
    zero = layout.values(np.zeros(layout.size))
    flat = [*np.asarray(zero.inertial), *np.ravel(zero.rate), *np.ravel(zero.tilt)]
    flat += [value for effect in zero.effects for value in np.ravel(effect)]
    assert flat[-4:] == [0.0, 7.0, 0.0, 0.0]  # the priors' means
    where = {  # coordinate -> (index in the flattened values, standard deviation)
        "initial-rate[0].x": (20, 0.01),
        "initial-rate[1].z": (25, 0.01),
        "initial-attitude[1].y": (30, 1e-3),
        "shared.y": (33, 3.0),
        "own[1].delay": (35, 0.1),
    }
    for name, (index, sigma) in where.items():
        z = np.zeros(layout.size)
        z[layout.names.index(name)] = 1.0
        moved = layout.values(z)
        other = [*np.asarray(moved.inertial), *np.ravel(moved.rate), *np.ravel(moved.tilt)]
        other += [value for effect in moved.effects for value in np.ravel(effect)]
        change = np.array(other) - np.array(flat)
        assert change[index] == pytest.approx(sigma, rel=1e-12), name
        assert np.count_nonzero(change) == 1, name
    for body in range(2):
        z = np.zeros(layout.size)
        z[10 * body : 10 * body + 10] = 0.5
        change = np.asarray(layout.values(z).inertial) - np.asarray(zero.inertial)
        assert (change[10 * body : 10 * body + 10] != 0.0).all()
        assert np.count_nonzero(change) == 10


def test_nothing_unknown_about_the_start_takes_no_coordinates():
    names = unknowns(rate_sigma=0.0, tilt_sigma=(0.0, 0.0)).names
    assert not [name for name in names if name.startswith("initial")]
    assert unknowns(bodies=(), effects=(), rate_sigma=0.0, tilt_sigma=(0.0, 0.0)).size == 0


def test_coordinates_invert_values():
    layout = unknowns()
    rate = np.array([[0.01, -0.02, 0.03], [0.0, 0.005, -0.01]])
    bodies = [draw_inertial(centre, 0.1, np.random.default_rng(4)) for centre in (CENTRE, OTHER)]
    values = layout.values(layout.coordinates(bodies, rate))
    np.testing.assert_allclose(values.rate, rate, rtol=1e-12)
    for (left, right), body in zip(pairwise((0, 10, 20)), bodies, strict=True):
        np.testing.assert_allclose(values.inertial[left:right], body.vector, rtol=1e-9, atol=1e-9)


# a joint prior --------------------------------------------------------------------------------------------------------


def mixed(seed: int = 5) -> Unknowns:
    """A lower-triangular factor whose widths span two decades."""
    rng = np.random.default_rng(seed)
    factor = np.tril(0.3 * rng.normal(size=(20, 20)), -1) + np.eye(20)
    factor *= 0.2 * np.logspace(-2.0, 0.0, 20)[:, None]
    return unknowns(mixing=tuple(tuple(row) for row in factor))


def test_a_diagonal_mixing_is_the_spreads():
    plain = unknowns()
    factor = tuple(tuple(row) for row in np.diag(np.repeat([0.3, 0.1], 10)))
    diagonal = replace(plain, mixing=factor)
    z = np.random.default_rng(6).normal(size=plain.size)
    np.testing.assert_allclose(diagonal.values(z).inertial, plain.values(z).inertial, rtol=1e-13)
    np.testing.assert_allclose(diagonal.to_linear(z[None]), plain.to_linear(z[None]), atol=1e-12)
    assert diagonal.log_volume(z[None])[0] == pytest.approx(float(plain.log_volume(z[None])[0]))
    assert diagonal != plain
    assert diagonal == replace(plain, mixing=tuple(map(tuple, factor)))
    assert diagonal != replace(plain, mixing=mixed().mixing)


def test_the_mixing_carries_coordinates_over():
    layout = mixed()
    z = np.random.default_rng(7).normal(size=layout.size)
    z[20:] = 0.0
    theta = np.array(layout.mixing) @ z[:20]
    unit = unknowns(bodies=(BodyPrior("base_link", CENTRE, 1.0), BodyPrior("load", OTHER, 1.0)))
    np.testing.assert_allclose(
        layout.values(z).inertial, unit.values(np.concatenate([theta, z[20:]])).inertial, rtol=1e-12, atol=1e-12
    )
    bodies = [InertialParameters.from_vector(row) for row in np.asarray(layout.values(z).inertial).reshape(2, 10)]
    np.testing.assert_allclose(layout.coordinates(bodies)[:20], z[:20], atol=1e-6)


class Changed(Effect):
    name = "changed"
    is_body = True
    parameters = tuple(Parameter(key, "1", 0.4) for key in LOG_CHOLESKY)


CHANGED = unknowns(effects=(Shared(), Changed(), Own()))


ONE = unknowns(bodies=(BodyPrior("base_link", CENTRE, 0.3),), rigid=True)  # a robot without joints


@pytest.mark.parametrize(
    "layout", [unknowns(), mixed(), CHANGED, ONE], ids=["spreads", "mixing", "effect on a body", "no joints"]
)
def test_linear_coordinates_invert_and_have_the_stated_volume(layout):
    z = 0.5 * np.random.default_rng(8).normal(size=layout.size)
    np.testing.assert_allclose(layout.from_linear(layout.to_linear(z[None]))[0], z, atol=1e-9)
    sign, log = np.linalg.slogdet(layout.linear_slope(z))
    assert abs(sign) == 1.0  # the order of the entries makes it negative for an odd number of bodies
    assert log == pytest.approx(float(layout.log_volume(z[None])[0]), abs=1e-8)


def test_without_joints_bodies_that_move_alike_differ_in_one_linear_coordinate():
    """Centre of mass and inertia about it are alike in both bodies, and masses are not."""
    heavy = InertialParameters(2.0 * CENTRE.mass, CENTRE.com, CENTRE.inertia)
    z = np.array([ONE.coordinates([body]) for body in (CENTRE, heavy)])
    light, other = ONE.to_linear(z)
    difference = np.abs(other - light)
    assert np.sum(difference > 1e-9) == 1
    assert difference.max() == pytest.approx(np.log(2.0) / 0.3)


def test_a_mixing_must_fit_the_bodies():
    with pytest.raises(InputError, match="joint prior of 2 bodies is not a lower-triangular factor with 20 rows"):
        check_mixing(((1.0,),), 2)
    with pytest.raises(InputError, match="joint prior of 1 bodies"):
        check_mixing(tuple(tuple(row) for row in np.ones((10, 10))), 1)
