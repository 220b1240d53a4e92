"""Inertial parameters against Pinocchio, and every inequality a body must satisfy."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from bayesid._io.errors import InputError
from bayesid.robot.inertial_parameters import BASIS, InertialParameters, parameters_from_pseudo_inertia
from bayesid.robot.log_cholesky import log_cholesky_factor, upper_cholesky

SEEDS = range(5)


def random_body(seed: int) -> InertialParameters:
    """Ten point masses: physical by construction, far from symmetric."""
    rng = np.random.default_rng(seed)
    mass, point = rng.uniform(0.1, 5.0, 10), rng.normal(size=(10, 3))
    com = mass @ point / mass.sum()
    arm = point - com
    tensor = sum(m * (a @ a * np.eye(3) - np.outer(a, a)) for m, a in zip(mass, arm, strict=True))
    return InertialParameters(mass.sum(), com, tensor)


def as_pinocchio(body: InertialParameters) -> pin.Inertia:
    return pin.Inertia(body.mass, body.com, body.inertia)


# against Pinocchio: the same algebra in double precision, so agreement to rounding -----------------------------------


@pytest.mark.parametrize("seed", SEEDS)
def test_vector_is_pinocchios_dynamic_parameters(seed):
    body = random_body(seed)
    np.testing.assert_allclose(body.vector, as_pinocchio(body).toDynamicParameters(), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_pseudo_inertia_is_pinocchios(seed):
    body = random_body(seed)
    expected = pin.PseudoInertia.FromInertia(as_pinocchio(body)).toMatrix()
    np.testing.assert_allclose(body.pseudo_inertia, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_log_cholesky_coordinates_are_pinocchios(seed):
    theta = np.random.default_rng(seed).normal(size=10)
    factor = np.asarray(log_cholesky_factor(theta))
    expected = pin.LogCholeskyParameters(theta)
    np.testing.assert_allclose(factor @ factor.T, expected.toPseudoInertia().toMatrix(), rtol=1e-12, atol=1e-12)
    vector = np.asarray(parameters_from_pseudo_inertia(factor @ factor.T))
    np.testing.assert_allclose(vector, expected.toDynamicParameters(), rtol=1e-12, atol=1e-12)


def test_zero_coordinates_give_the_identity():
    np.testing.assert_array_equal(np.asarray(log_cholesky_factor(np.zeros(10))), np.eye(4))


@pytest.mark.parametrize("seed", SEEDS)
def test_upper_cholesky_is_upper_and_a_factor(seed):
    pseudo = random_body(seed).pseudo_inertia
    factor = upper_cholesky(pseudo)
    assert np.array_equal(factor, np.triu(factor))
    assert (np.diag(factor) > 0.0).all()
    np.testing.assert_allclose(factor @ factor.T, pseudo, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_vector_and_pseudo_inertia_invert(seed):
    body = random_body(seed)
    again = InertialParameters.from_vector(body.vector)
    assert again.mass == body.mass
    np.testing.assert_allclose(again.com, body.com, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(again.inertia, body.inertia, rtol=1e-12, atol=1e-12)
    back = np.asarray(parameters_from_pseudo_inertia(body.pseudo_inertia))
    np.testing.assert_allclose(back, body.vector, rtol=1e-12, atol=1e-12)


def test_basis_is_locked_and_symmetric():
    np.testing.assert_array_equal(BASIS, np.swapaxes(BASIS, 1, 2))
    with pytest.raises(ValueError, match="read-only"):
        BASIS[0, 0, 0] = 1.0


def test_arrays_are_copied_and_locked():
    com, tensor = np.zeros(3), np.eye(3)
    body = InertialParameters(1.0, com, tensor)
    com[0], tensor[0, 0] = 9.0, 9.0
    assert body.com[0] == 0.0
    assert body.inertia[0, 0] == 1.0
    for array in (body.com, body.inertia):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


# what no body can be --------------------------------------------------------------------------------------------------

NOT_SYMMETRIC = np.array([[1.0, 0.1, 0.0], [0.2, 1.0, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize(
    ("mass", "com", "tensor", "message"),
    [
        (-1.0, np.zeros(3), np.eye(3), r"mass >= 0 fails: mass = -1 kg"),
        (0.0, np.zeros(3), np.eye(3), r"mass > 0 fails for a body with inertia 1 kg m2"),
        (1.0, np.zeros(3), np.diag([-0.5, 1.0, 1.0]), r"principal moments >= 0 fails: the smallest is -0.5 kg m2"),
        (1.0, np.zeros(3), np.diag([3.5, 1.0, 2.0]), r"I1 \+ I2 >= I3 .* fails: 1 \+ 2 < 3.5 kg m2"),
        (1.0, np.zeros(3), NOT_SYMMETRIC, r"not symmetric"),
        (np.nan, np.zeros(3), np.eye(3), r"not finite"),
        (1.0, [np.inf, 0.0, 0.0], np.eye(3), r"not finite"),
        (1.0, np.zeros(3), np.diag([np.nan, 1.0, 1.0]), r"not finite"),
        (1.0, np.zeros(2), np.eye(3), r"shapes \(2,\) and \(3, 3\)"),
        (1.0, np.zeros(3), np.ones(6), r"shapes \(3,\) and \(6,\)"),
    ],
)
def test_an_impossible_body_is_refused_with_its_inequality(mass, com, tensor, message):
    with pytest.raises(InputError, match=message):
        InertialParameters(mass, com, tensor)


def test_the_triangle_inequality_is_about_principal_moments():
    """The diagonal satisfies it, the principal moments do not."""
    rotation = pin.rpy.rpyToMatrix(0.5, 0.6, 0.7)
    turned = rotation @ np.diag([1.0, 2.0, 3.2]) @ rotation.T
    low, middle, high = np.sort(np.diag(turned))
    assert low + middle > high
    with pytest.raises(InputError, match="triangle inequality"):
        InertialParameters(1.0, np.zeros(3), turned)


@pytest.mark.parametrize(
    ("body", "extended"),
    [
        (InertialParameters(2.0, np.zeros(3), np.diag([1.0, 1.5, 2.0])), True),
        (InertialParameters(2.0, np.ones(3), np.diag([0.0, 1.0, 1.0])), False),  # a rod
        (InertialParameters(2.0, np.ones(3), np.diag([1.0, 1.0, 2.0])), False),  # a plate
        (InertialParameters(2.0, np.ones(3), np.zeros((3, 3))), False),  # a point
        (InertialParameters(0.0, np.zeros(3), np.zeros((3, 3))), False),  # nothing
    ],
    ids=["solid", "rod", "plate", "point", "nothing"],
)
def test_the_limits_of_physical_bodies_are_allowed_and_known_to_be_limits(body, extended):
    assert body.is_extended is extended
