"""The arithmetic of the benchmark on its smallest cases; no time is compared with a limit."""

from __future__ import annotations

import numpy as np

from bayesid.inference.predicted_readings import integration_error_at
from studies.benchmark.cases import chain, posterior_of
from studies.benchmark.timing import seconds_per_evaluation


def test_chains_of_any_length_are_the_same_arm() -> None:
    short, long = chain(6), chain(60)
    assert len(long.joints) == 60
    np.testing.assert_allclose(short.mass, long.mass)


def test_an_evaluation_is_timed() -> None:
    posterior = posterior_of(chain(3), interval=2.0)
    assert 0.0 < seconds_per_evaluation(posterior, repeats=1) < 1.0
    assert integration_error_at(posterior, posterior.starting_point()) < 0.01
