"""The short sum of exponentials is SciPy's."""

import numpy as np
import pytest
from scipy.special import logsumexp

from bayesid._math.arrays import log_sum, log_sums


@pytest.mark.parametrize("shape", [(1,), (7,), (3, 4, 5)])
@pytest.mark.parametrize("offset", [-1e4, 0.0, 1e4])
def test_it_is_that_of_scipy(shape, offset):
    values = offset + np.random.default_rng(0).normal(size=shape)
    assert log_sum(values) == pytest.approx(float(logsumexp(values)), rel=1e-14)


def test_nothing_stays_nothing():
    assert log_sum([-np.inf, -np.inf]) == -np.inf
    assert log_sum([-np.inf, 2.0]) == 2.0


def test_sums_of_rows_are_those_of_scipy_where_exponentials_would_overflow_or_vanish():
    values = np.random.default_rng(0).normal(scale=400.0, size=(50, 7))
    values[3, 2], values[4] = -np.inf, -np.inf
    np.testing.assert_allclose(log_sums(values), logsumexp(values, axis=1), rtol=1e-14)
    assert log_sums(values)[4] == -np.inf
