"""Work in several threads gives what one thread gives, in the same order, and hands on errors."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator

import numpy as np
import pytest

from bayesid._math.threads import in_threads
from studies.truth import hidden_causes
from tests.hidden import diagnosed, shortened


@pytest.fixture
def all_cores() -> Iterator[None]:
    """Let this process use all cores, where those of other tests keep to one of them."""
    if not hasattr(os, "sched_setaffinity"):
        pytest.skip("cores cannot be chosen here")
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, range(os.cpu_count() or 1))
    if len(os.sched_getaffinity(0)) < 2:
        pytest.skip("needs two cores")
    yield
    os.sched_setaffinity(0, before)


def test_items_run_side_by_side_and_results_keep_their_order(all_cores):
    together = threading.Barrier(2, timeout=60.0)  # breaks unless two items wait for each other
    assert in_threads(lambda x: (together.wait(), x)[1] ** 2, [3, 1]) == [9, 1]


def test_an_error_in_a_thread_reaches_the_caller(all_cores):
    with pytest.raises(ZeroDivisionError):
        in_threads(lambda x: 1 / x, [1, 0, 2])


@pytest.mark.slow
def test_a_diagnosis_is_the_same_in_one_thread_and_in_several(all_cores, tmp_path):
    case = next(case for case in hidden_causes.CASES if case.name == "accel-bias")
    study = shortened(case).make(tmp_path, 6, 1.0)
    several = diagnosed(study)
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    one = diagnosed(study)
    assert one.verdict == several.verdict
    first, second = one.probabilities, several.probabilities
    assert first.sets[0].causes == second.sets[0].causes
    assert first.inclusion.keys() == second.inclusion.keys()
    for name, probability in first.inclusion.items():
        np.testing.assert_allclose(second.inclusion[name], probability, atol=1e-4)
