"""Causes hidden in MuJoCo's data must be found, outside effects called unknown, and nothing hidden raise no alarm.

A part of the cases of `studies.truth.hidden_causes` runs by default, another with ``pytest --slow``, all of them with
``pytest --catalogue`` (half an hour). The same seed gives studies of one robot the same circumstances, so that they
share compiled functions; the campaign in studies/blind_injections varies them.
"""

from __future__ import annotations

import pytest

from bayesid.diagnosis import Diagnosis, Status
from studies.truth import hidden_causes
from tests.test_diagnosis import run

SEED = 5

FOUND = [
    "payload:link3",
    "wheel-momentum, accel-bias",
    "thermal-snap",
]
"""Cases that always run."""

FOUND_SLOWLY = [
    "aerodynamic-drag",
    "fuel-slosh",
    "link-inertia:link2",
    "link-inertia:link3",
    "joint-flexibility:joint2",
    "rate-scale",
    "accel-position",
    "joint-latency",
    "encoder-offset:joint3",
    "coloured-noise:rate",
    "rate-clock",
    "growing-torque",
    "backlash",
]
"""Cases that run with the slow tests."""


def right(result: Diagnosis, case: hidden_causes.Case) -> bool:
    """Whether a named set is the hidden one, by any of its names."""
    names = set(case.causes) | set(case.accept)

    def matches(labels: tuple[str, ...]) -> bool:
        same = result.verdict.equivalent_to
        return len(labels) == len(case.causes) and all(
            label in names or set(same.get(label, ())) & names for label in labels
        )

    return any(matches(labels) for labels in (result.verdict.causes, *result.verdict.ambiguous_with))


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    every = metafunc.config.getoption("--catalogue")
    known = {case.name: case for case in hidden_causes.CASES}
    later = [pytest.param(known[name], marks=pytest.mark.slow, id=name) for name in FOUND_SLOWLY]
    always = [pytest.param(known[name], id=name) for name in (known if every else FOUND)]
    metafunc.parametrize("case", always if every else always + later)


def test_what_is_hidden_is_said(case, tmp_path):
    result = run(case.make(tmp_path, SEED))
    verdict = result.verdict
    said = verdict, result.probabilities.sets[0], (result.alarm.loudest, result.alarm.p_value)
    if case.status == "effect":
        assert verdict.status in (Status.EXPLAINED, Status.AMBIGUOUS), said
        assert right(result, case), said
    elif case.status == "unknown" and verdict.causes:
        assert verdict.causes == case.accept, said
    else:
        assert verdict.status.value == case.status, said
