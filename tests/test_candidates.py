"""Candidates: an effect needs its class alone, and rows say what the data say where it is absent."""

from __future__ import annotations

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from bayesid._io.errors import InputError
from bayesid.diagnosis import Diagnosis, candidates, diagnose
from bayesid.inference.posterior import Posterior
from bayesid.report.diagnosis.appendix import candidate_rows
from bayesid.report.diagnosis.diagnosis_sentences import advice
from bayesid.simulation.effects import (
    Effect,
    FlexibleAppendage,
    Parameter,
    Prior,
    Wrench,
    create,
    known_effects,
    register,
)
from bayesid.simulation.effects.register import _REGISTER
from bayesid.simulation.orbit import Orbit

# an effect of one class, with values for each recording ---------------------------------------------------------------


class RestlessTorque(Effect):
    """A torque that is another in every recording, where there is an orbit."""

    name = "restless-torque"
    summary = "Something turns the base steadily, otherwise in every recording."
    separated_by = "It changes from recording to recording: record twice."
    per_recording = True
    parameters = tuple(Parameter(axis, "N m", 1e-3) for axis in "xyz")

    @classmethod
    def instances(cls, model):
        return [cls()] if model.orbit is not None else []

    def wrench(self, values, instant, inner):
        return Wrench(jnp.zeros(3), values)


@pytest.fixture(scope="module")
def restless():
    register(RestlessTorque)
    yield "restless-torque"
    del _REGISTER["restless-torque"]


@pytest.fixture(scope="module")
def result(planar_case, restless) -> Diagnosis:
    """Two recordings in which nothing is hidden; the candidates are drag and the effect of this file."""
    model, manoeuvre = planar_case.posterior.model, planar_case.posterior.manoeuvres[0]
    again = replace(manoeuvre, recording=replace(manoeuvre.recording, name="again"))
    chosen = [effect for effect in candidates(model) if effect.label in ("aerodynamic-drag", restless)]
    assert [effect.label for effect in chosen] == ["aerodynamic-drag", restless]
    return diagnose(model, [manoeuvre, again], 0, effects=chosen)


@pytest.fixture(scope="module")
def rows(result):
    return {row.name: row for row in result.candidates}


def test_an_effect_joins_the_catalogue_and_the_candidates_by_its_class_alone(restless, planar_case):
    assert restless in known_effects()
    assert isinstance(create(restless), RestlessTorque)
    model = planar_case.posterior.model
    assert restless in [effect.label for effect in candidates(model)]
    assert restless not in [effect.label for effect in candidates(replace(model, orbit=None, effects=()))]
    assert restless not in [effect.label for effect in candidates(model.extend(RestlessTorque()))]


def test_in_an_eccentric_orbit_every_environment_is_a_candidate_only_where_its_place_is_known(planar_case):
    model = replace(planar_case.posterior.model, effects=())
    for eccentricity, known in ((0.0, True), (0.1, False)):
        placed = replace(model, orbit=Orbit(7.5e6, eccentricity))
        labels = [effect.label for effect in candidates(placed, knows_latitude=False)]
        assert ("aerodynamic-drag" in labels) == known
        assert "thruster-leak" in labels


class Breath(Effect):
    """A force of a size that is log-normal, of which no form in amplitudes is given."""

    name = "breath"
    parameters = (Parameter("force", "N", 1.0, 1e-3, Prior.LOG_NORMAL),)
    absent = np.zeros(1)


class Whip(Effect):
    """A vibration that is neither an appendage nor fuel."""

    name = "whip"
    parameters = (Parameter("size", "kg", 1.0),)
    modes_count = 1


class OwnAppendage(FlexibleAppendage):
    """An appendage of the user's own."""

    name = "own-appendage"


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        (Breath, r"test_candidates.py: effect 'breath': it is not linear in force, .* Override in_amplitudes"),
        (Whip, r"test_candidates.py: effect 'whip': a user-defined vibration has no bounds"),
        (OwnAppendage, None),
    ],
)
def test_what_could_not_be_weighed_is_no_candidate_and_is_named(kind, message, planar_case, monkeypatch):
    monkeypatch.setitem(_REGISTER, kind.name, kind)
    if message is None:
        assert kind.name in [effect.label for effect in candidates(planar_case.posterior.model)]
        return
    with pytest.raises(InputError, match=message):
        candidates(planar_case.posterior.model)


@pytest.mark.slow
def test_it_joins_the_simulation(result):
    fit = result.before.fit
    model, before = fit.posterior.model, fit.posterior
    posterior = Posterior.of(model.extend(create("restless-torque")), before.manoeuvres, step=before.step)
    assert posterior.unknowns.names[-6:] == tuple(f"restless-torque[{r}].{axis}" for r in range(2) for axis in "xyz")
    without = np.concatenate([fit.z, np.zeros(6)])
    change = posterior.residuals(without + np.eye(len(without))[-3]) - posterior.residuals(without)
    assert np.abs(change[0]).max() == 0.0
    assert np.abs(change[1]).max() > 1.0


@pytest.mark.slow
def test_it_joins_the_tables_of_reports(rows):
    (row,) = candidate_rows([rows["restless-torque"]], 0.01)
    name, probability, _, _, factor, size, power = row
    assert name == "restless-torque"
    assert float(probability.lstrip("<")) < 0.1
    assert factor.startswith("−")
    assert size.startswith("x < ")
    assert size.endswith(" N m")
    assert 0.0 < float(power) < 1.0
    assert advice("restless-torque") == RestlessTorque.separated_by


def test_candidates_of_each_recording_are_fitted_as_they_are_tested(result, rows):
    """Two recordings, so three columns each; at the width of the prior both are the same normal distribution."""
    evidence = result.evidence
    own = np.concatenate([evidence.gram.groups[group.name] for group in evidence.causes["restless-torque"].groups])
    assert len(own) == 6
    fitted = result.fitted(["restless-torque"])
    assert fitted.labels == ("restless-torque",)
    covariance = np.linalg.inv(evidence.gram.matrix[np.ix_(own, own)] + 1e6 * np.eye(6))
    mean, sd = -covariance @ evidence.gram.score[own], np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(sd, np.sqrt(np.diag(fitted.fit.covariance)[-6:]) * 1e-3, rtol=0.02)
    np.testing.assert_allclose(mean, fitted.fit.values(0).ravel(), atol=0.1 * sd.max())
    assert (rows["restless-torque"].sd < sd[:3]).all()  # its scale is unknown, and nothing asks for a large one


# an effect that is absent ---------------------------------------------------------------------------------------------


def test_drag_that_is_absent_is_reported_as_none(rows):
    """The bound at this altitude is far more than these data leave open."""
    row = rows["aerodynamic-drag"]
    assert [name for name, _ in row.quantities] == ["force", *(f"force-lever.{axis}" for axis in "xyz")]
    assert (np.abs(row.mean) < 4.0 * row.sd).all()
    assert row.sd[0] < 1e-3
    assert row.upper_limit[0] < 2.5e-3
    assert row.log_bayes_factor < 0.0


def test_generic_candidates_have_rows_without_amplitudes(result):
    generic = [row for row in result.candidates if row.generic]
    assert {row.name for row in generic} == set(result.probabilities.generics)
    assert all(row.quantities == () for row in generic)
