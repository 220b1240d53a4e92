"""The short sum of exponentials is SciPy's."""

import numpy as np
import pytest
from scipy.special import logsumexp

from bayesid._math.log_sum import log_sum


@pytest.mark.parametrize("shape", [(1,), (7,), (3, 4, 5)])
@pytest.mark.parametrize("offset", [-1e4, 0.0, 1e4])
def test_it_is_that_of_scipy(shape, offset):
    values = offset + np.random.default_rng(0).normal(size=shape)
    assert log_sum(values) == pytest.approx(float(logsumexp(values)), rel=1e-14)


def test_nothing_stays_nothing():
    assert log_sum([-np.inf, -np.inf]) == -np.inf
    assert log_sum([-np.inf, 2.0]) == 2.0
