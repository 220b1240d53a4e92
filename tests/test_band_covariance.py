"""Covariances of nearby states against the inverse of the whole precision."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg as sla

from bayesid.recording.integrated_process import covariances_by_distance
from bayesid.recording.smoothing import JointSamples, smooth


def test_they_are_blocks_of_the_inverse():
    order, count = 3, 7
    rng = np.random.default_rng(1)
    lower = np.tril(rng.normal(size=(order * count,) * 2)) + 4.0 * np.eye(order * count)
    rows, columns = np.indices(lower.shape)
    lower[rows // order - columns // order > 1] = 0.0
    factor = np.zeros((2 * order, order * count))
    for j in range(order * count):
        end = min(j + 2 * order, order * count)
        factor[: end - j, j] = lower[j:end, j]
    inverse = np.linalg.inv(lower @ lower.T)
    for distance, blocks in enumerate(covariances_by_distance(factor, order)):
        assert len(blocks) == count - distance
        for i, block in enumerate(blocks):
            expected = inverse[order * i : order * (i + 1), order * (i + distance) : order * (i + distance + 1)]
            np.testing.assert_allclose(block, expected, atol=1e-12)


@pytest.mark.parametrize("lags", [0, 4, 40])
def test_errors_of_a_smoothed_joint_are_those_of_the_whole_inverse(lags):
    rng = np.random.default_rng(2)
    time = np.sort(rng.uniform(0.0, 20.0, 60))
    fit = smooth([JointSamples(0, time, np.sin(time) + 1e-3 * rng.normal(size=60), 1e-3)])
    asked = np.sort(rng.uniform(0.0, 20.0, 90))
    left, weights = fit._interpolation(asked)
    states = left[:, None] * fit.order + np.arange(2 * fit.order)
    inverse = sla.cho_solve_banded((fit.factor, True), np.eye(fit.states.size))
    found, sd = fit.lag_covariance(asked, lags), fit.standard_deviation(asked).T
    for lag in range(lags + 1):
        assert not found[lag, :lag].any()
        for i in range(lag, len(asked)):
            exact = weights[i] @ inverse[np.ix_(states[i], states[i - lag])] @ weights[i - lag].T
            assert (np.abs(found[lag, i] - exact) < 1e-8 * np.outer(sd[i], sd[i - lag])).all()
