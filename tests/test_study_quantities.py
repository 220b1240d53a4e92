"""Errors in standard deviations, a helper of several studies."""

from __future__ import annotations

import numpy as np
import pytest

from studies.common.quantities import squared_distances


def test_distances_are_those_of_the_inverse_covariance_whatever_the_units():
    rng = np.random.default_rng(1)
    factor = rng.normal(size=(3, 3)) + 3.0 * np.eye(3)
    errors = rng.normal(size=(5, 3))
    expected = ((errors @ np.linalg.inv(factor).T) ** 2).sum(axis=1)
    units = np.array([1e-6, 1.0, 1e6])
    covariance = np.outer(units, units) * (factor @ factor.T)
    np.testing.assert_allclose(squared_distances(units * errors, covariance), expected, rtol=1e-10)
    assert squared_distances(units * errors[0], covariance) == pytest.approx(expected[0])
