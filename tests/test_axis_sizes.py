"""Sizes of the axes of an unnamed disturbance against simulated amplitudes and a numerical integral."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import logsumexp

from bayesid.diagnosis.candidates.axis_sizes import axis_sizes

WAVES = 12
SPREAD = 1.0 / (1.0 + (np.arange(WAVES) / 4.0) ** 4)


def drawn(deviations, seed=0, rows=400):
    """Information and score of cosines about some axes, whose amplitudes have these deviations; the axis of each."""
    rng = np.random.default_rng(seed)
    count = len(deviations)
    axes, spread = np.tile(np.arange(count), WAVES), np.repeat(SPREAD, count)
    columns = rng.normal(size=(rows, len(axes)))
    amplitudes = np.sqrt(spread) * np.asarray(deviations)[axes] * rng.normal(size=len(axes))
    residual = rng.normal(size=rows) - columns @ amplitudes
    return columns.T @ columns, columns.T @ residual, spread, axes


def log_evidence(information, score, variances):
    """Logarithm of the evidence of amplitudes with these prior variances."""
    root = np.sqrt(variances)
    whole = np.eye(len(root)) + root[:, None] * information * root
    pull = root * score
    return 0.5 * float(pull @ np.linalg.solve(whole, pull)) - 0.5 * float(np.linalg.slogdet(whole)[1])


def test_sizes_are_those_of_the_amplitudes():
    ratios = np.array([axis_sizes(*drawn([0.1, 1.0, 0.3], seed)).ratios for seed in range(20)])
    np.testing.assert_allclose(np.exp(np.log(ratios).mean(axis=0)), [0.01, 1.0, 0.09], rtol=0.35)


def test_an_absent_axis_is_as_small_as_the_data_can_resolve():
    rows = 400
    assert np.median([axis_sizes(*drawn([0.0, 1.0], seed, rows)).ratios[0] for seed in range(20)]) < 1.0 / rows


@pytest.mark.slow
@pytest.mark.parametrize("deviations", [[0.2, 1.0], [1.0, 1.0], [0.03, 1.0]])
def test_the_charge_is_that_of_an_average_over_all_ratios(deviations):
    """The evidence at the sizes less the charge, beside the mean over uniform ratios of standard deviations."""
    for seed in range(5):
        information, score, spread, axes = drawn(deviations, seed)
        sizes = axis_sizes(information, score, spread, axes)
        largest = int(np.argmax(sizes.ratios))
        scales = np.exp(np.linspace(np.log(0.05), np.log(20.0), 60))
        ratios = (np.arange(200) + 0.5) / 200
        each = np.array(
            [
                [
                    log_evidence(information, score, spread * scale * np.where(axes == largest, 1.0, ratio**2))
                    for ratio in ratios
                ]
                for scale in scales
            ]
        )
        learnt = [log_evidence(information, score, spread * scale * sizes.ratios[axes]) for scale in scales]
        whole = logsumexp(each) - np.log(each.size)
        assert logsumexp(learnt) - np.log(len(learnt)) - sizes.charge == pytest.approx(whole, abs=0.7)
