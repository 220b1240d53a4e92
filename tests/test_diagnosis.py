"""Causes hidden in data of an independent simulator must be found, nothing hidden must raise no alarm."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from bayesid.assemble import load_manoeuvres, load_model
from bayesid.diagnosis import Diagnosis, Status, candidates, diagnose
from bayesid.diagnosis.diagnosis import extended_start
from bayesid.study import Study
from tests import hidden

CASES = {case.name: case for case in hidden.CASES}

FOUND = ("rate-drift", "payload:link3")
"""Hidden one by one here; the catalogue is in studies/blind_injections."""


def run(file: Path) -> Diagnosis:
    study = Study.load(file)
    model = load_model(study)
    knows = all(section.argument_of_latitude is not None for section in study.recordings)
    return diagnose(model, load_manoeuvres(study, model.robot), 0, knows_latitude=knows)


def right(result: Diagnosis, case: hidden.Case) -> bool:
    """Whether a named set is the hidden one, by any of its names."""
    names = set(case.causes) | set(case.accept)

    def matches(labels: tuple[str, ...]) -> bool:
        same = result.verdict.equivalents
        return len(labels) == len(case.causes) and all(
            label in names or set(same.get(label, ())) & names for label in labels
        )

    return any(matches(labels) for labels in (result.verdict.causes, *(r.labels for r in result.verdict.rivals)))


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Diagnosis:
    return run(CASES["wheel-momentum"].make(tmp_path_factory.mktemp("wheel"), 5))


@pytest.mark.parametrize("name", FOUND)
def test_a_hidden_cause_is_named(name, tmp_path):
    case = CASES[name]
    result = run(case.make(tmp_path, 5))
    assert result.verdict.status in (Status.EXPLAINED, Status.AMBIGUOUS)
    assert right(result, case), (result.verdict.causes, [r.labels for r in result.verdict.rivals])
    assert result.after.adequate


def test_a_hidden_wheel_is_named_and_measured(wheel):
    assert wheel.verdict.status is Status.EXPLAINED
    assert wheel.verdict.causes == ("wheel-momentum",)
    gain = wheel.gain
    assert gain.after.chi2_per_sample < 1.1 < gain.before.chi2_per_sample
    assert gain.after.held_out.sum() > gain.before.held_out.sum()


def test_the_extended_posterior_agrees_with_the_pushes(wheel):
    """The full simulation with the effect in it leaves the same residual as the pushes on the present model."""
    posterior = wheel.posterior
    z = extended_start(wheel.after, posterior)
    refined = posterior.at(z)
    chi2 = float((refined.residuals(z) ** 2).sum())
    assert abs(chi2 - wheel.after.fit.chi2) < 0.01 * np.sqrt(posterior.samples)


def test_the_contract_of_the_json(wheel):
    content = json.loads(json.dumps(wheel.to_dict()))
    assert content["status"] == "explained"
    assert content["causes"] == ["wheel-momentum"]
    keys = {"name", "signal_to_noise", "p_value", "p_value_adjusted", "log_bayes_factor", "amplitude"}
    for row in content["candidates"]:
        assert keys | {"upper_limit_95", "power"} <= set(row)
    best = next(row for row in content["candidates"] if row["name"] == "wheel-momentum")
    assert set(best["amplitude"]) == {"x", "y", "z"}
    assert set(best["amplitude"]["x"]) == {"mean", "sd", "unit"}
    assert set(content["unexplained"]) == {"file", "signal_to_noise", "fixed_in"}
    assert set(content["gain"]["chi2_per_sample"]) == {"before", "after"}


@pytest.mark.parametrize("name", ["null, gaps"])
def test_nothing_hidden_raises_no_alarm(name, tmp_path):
    result = run(CASES[name].make(tmp_path, 6))
    assert result.verdict.status is Status.ADEQUATE, result.before.outcome.worst
    assert result.verdict.causes == ()


def test_an_effect_of_the_user_becomes_a_candidate(tmp_path):
    study = Study.load(CASES["null, three joints"].make(tmp_path, 7))
    names = [effect.label for effect in candidates(load_model(study))]
    assert "wheel-momentum" in names
    assert "gravity-gradient" not in names  # it is in the model
    assert not any(name.endswith(":base_link") for name in names)  # unknown anyway
    assert any(name.startswith("payload:") for name in names)
