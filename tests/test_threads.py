"""Work in several threads or processes gives what one thread gives, in the same order, and hands on errors."""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Iterator

import numpy as np
import pytest
from test_cli import run

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


@pytest.mark.slow
def test_recordings_are_read_by_the_workers_of_a_scheduler(tmp_path):
    """Two processes with one recording each, and an error of one of them."""
    distributed = pytest.importorskip("distributed")
    study = shortened(next(case for case in hidden_causes.CASES if case.name == "accel-bias")).make(tmp_path / "a", 6)
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        spread = ("--scheduler", cluster.scheduler_address)
        for name, options in (("alone", ()), ("spread", spread)):
            assert run("check", study, "--output", tmp_path / name, *options)[0] == 0
        (study.parent / "manoeuvre-2.csv").write_text("time,rate.x\n0,1\n", encoding="utf-8")
        status, said = run("check", study, "--output", tmp_path / "wrong", *spread)
    assert (status, "manoeuvre-2.csv" in said, "Traceback" in said) == (2, True, False)
    alone, together = (json.loads((tmp_path / name / "check.json").read_text()) for name in ("alone", "spread"))
    assert alone == together
