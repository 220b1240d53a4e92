"""Candidates: an effect needs its class alone, rows say what the data say where it is absent, limits, power."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest
from bayesid.diagnosis.cause_search import CauseSearch
from bayesid.diagnosis.detection_power import average_power, detection_power
from bayesid.diagnosis.score_tests import DRAWS, Score
from scipy import stats

from bayesid.diagnosis import candidates
from bayesid.diagnosis.candidate_table import candidate_table, magnitude_limit
from bayesid.inference.posterior import Posterior
from bayesid.report.sentences.next_experiment import advice
from bayesid.report.tables.diagnosis_tables import candidate_rows, prior_texts
from bayesid.simulation.effects import AerodynamicDrag, Effect, Parameter, Wrench, create, known_effects, register
from bayesid.simulation.effects.register import _REGISTER

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
def search(planar_case, restless) -> CauseSearch:
    """Two recordings in which nothing is hidden; the candidates are drag and the effect of this file."""
    model, manoeuvre = planar_case.posterior.model, planar_case.posterior.manoeuvres[0]
    again = replace(manoeuvre, recording=replace(manoeuvre.recording, name="again"))
    posterior = Posterior.of(model, [manoeuvre, again], step=planar_case.posterior.step)
    chosen = [effect for effect in candidates(model) if effect.label in ("aerodynamic-drag", restless)]
    assert [effect.label for effect in chosen] == ["aerodynamic-drag", restless]
    return CauseSearch(posterior, (), chosen, 0)


@pytest.fixture(scope="module")
def rows(search):
    return {row.name: row for row in candidate_table(search)}


def test_an_effect_joins_the_catalogue_and_the_candidates_by_its_class_alone(restless, planar_case):
    assert restless in known_effects()
    assert isinstance(create(restless), RestlessTorque)
    model = planar_case.posterior.model
    assert restless in [effect.label for effect in candidates(model)]
    assert restless not in [effect.label for effect in candidates(replace(model, orbit=None, effects=()))]
    assert restless not in [effect.label for effect in candidates(model.extend(RestlessTorque()))]


def test_it_joins_the_simulation(search):
    model, before = search.base.fit.posterior.model, search.base.fit.posterior
    posterior = Posterior.of(model.extend(create("restless-torque")), before.manoeuvres, step=before.step)
    assert posterior.unknowns.names[-6:] == tuple(f"restless-torque[{r}].{axis}" for r in range(2) for axis in "xyz")
    without = np.concatenate([search.base.fit.z, np.zeros(6)])
    change = posterior.residuals(without + np.eye(len(without))[-3]) - posterior.residuals(without)
    assert np.abs(change[0]).max() == 0.0
    assert np.abs(change[1]).max() > 1.0


def test_it_joins_the_tables_of_reports(rows):
    (row,) = candidate_rows([rows["restless-torque"]], 0.01)
    assert row[0] == "restless-torque"
    assert row[4].startswith("x < ")
    assert row[4].endswith(" N m")
    assert float(row[5]) > 0.9
    assert row[6] == "linear"
    assert prior_texts(RestlessTorque())[0] == "0 ± 1 × 10⁻³"
    assert advice("restless-torque") == RestlessTorque.separated_by


def test_candidates_of_each_recording_are_fitted_as_they_are_tested(search, rows):
    """Two recordings, so three columns each; the linear row is the fit where the effect is absent."""
    linear = rows["restless-torque"]
    assert search.suite.effects["restless-torque"].shape[1] == 6
    assert search.base.outcome.scores["restless-torque"].degrees == 6
    fitted = search.extend(search.base, "restless-torque")
    assert fitted is not None
    assert len(fitted.fit.coordinates[0]) == 6
    spread = np.sqrt(np.diag(fitted.fit.covariance)[-6:-3]) * 1e-3
    np.testing.assert_allclose(linear.sd, spread, rtol=0.02)
    np.testing.assert_allclose(linear.mean, fitted.fit.coordinates[0][:3] * 1e-3, atol=0.05 * spread.max())


# an effect that is absent ---------------------------------------------------------------------------------------------


def test_drag_that_is_absent_is_reported_as_none(rows):
    """The prior's median is 5 mN, far more than these data leave open."""
    row = rows["aerodynamic-drag"]
    assert [name for name, _ in row.quantities] == ["force", *(f"force-lever.{axis}" for axis in "xyz")]
    assert (np.abs(row.mean) < 4.0 * row.sd).all()
    assert row.sd[0] < 1e-3
    assert row.upper_limit[0] < 2.5e-3
    assert row.log_bayes_factor < 0.0


# limits ---------------------------------------------------------------------------------------------------------------


def test_the_limit_is_the_quantile_of_the_magnitude():
    assert magnitude_limit(0.0, 2.0) == pytest.approx(2.0 * stats.norm.ppf(0.975))
    assert magnitude_limit(-50.0, 2.0) == pytest.approx(50.0 + 2.0 * stats.norm.ppf(0.95))
    assert magnitude_limit(1e12, 1.0) == pytest.approx(1e12)
    assert magnitude_limit(-3.0, 0.0) == 3.0
    for mean in (0.1, 0.7, 1.5, 3.0):
        assert stats.foldnorm.cdf(magnitude_limit(mean, 1.0), mean) == pytest.approx(0.95)


def test_the_limit_covers_what_it_says():
    """Amplitudes from the prior, measured with noise; three standard deviations of 4000 draws are 0.01."""
    rng, noise = np.random.default_rng(0), 1.7
    amplitude = rng.normal(size=4000)
    shrink = 1.0 / (1.0 + noise**2)
    mean, sd = shrink * (amplitude + noise * rng.normal(size=4000)), np.sqrt(1.0 - shrink)
    limits = np.array([magnitude_limit(m, sd) for m in mean])
    assert np.mean(np.abs(amplitude) < limits) == pytest.approx(0.95, abs=0.0105)


# power ----------------------------------------------------------------------------------------------------------------

LOCAL = 1e-4
"""Local p-value at which the alarm is raised."""


def alarm() -> SimpleNamespace:
    return SimpleNamespace(
        seed=0, suite=SimpleNamespace(calibration=SimpleNamespace(smallest=np.full(DRAWS, np.log(LOCAL))))
    )


class Plain(Effect):
    name = "plain"

    def __init__(self, count: int) -> None:
        self.parameters = tuple(Parameter(f"k{i}", "1", 3.0) for i in range(count))


def test_power_is_averaged_over_the_prior():
    """One amplitude in closed form: the statistic is chi-square times one more than the information."""
    for information in (3.0, 20.0, 400.0):
        item = Score("plain", np.zeros((5, 1)), 0.0, np.array([[np.sqrt(information)]]))
        exact = stats.chi2.sf(stats.chi2.isf(LOCAL, 1) / (1.0 + information), 1)
        assert average_power(Plain(1), item, alarm()) == pytest.approx(exact, abs=0.01)
    assert detection_power(1, 400.0, alarm()) > 0.999  # what it would be for every effect of the mean information
    assert average_power(Plain(1), item, alarm()) < 0.86


def test_power_is_that_of_brute_force():
    """Against drawn effects and drawn noise, 200,000 of them."""
    rng = np.random.default_rng(1)
    response = np.array([[4.0, 1.0, -2.0], [0.5, 9.0, 3.0]])
    found = rng.normal(size=(200_000, 3)) @ response.T + rng.normal(size=(200_000, 2))
    exact = np.mean((found**2).sum(axis=1) > stats.chi2.isf(LOCAL, 2))
    assert average_power(Plain(3), Score("plain", np.zeros((5, 2)), 0.0, response), alarm()) == pytest.approx(
        exact, abs=0.01
    )


def test_power_of_drag_is_that_of_its_own_prior():
    """Its force is log-normal: against draws of it, with columns of force alone."""
    drag = AerodynamicDrag()
    response = np.array([[2.0, 0.0, 0.0, 0.0]])
    rng = np.random.default_rng(2)
    force = 5e-3 * np.exp(1.5 * rng.normal(size=200_000)) / drag.in_amplitudes().parameters[0].sigma
    found = 2.0 * force + rng.normal(size=len(force))
    exact = np.mean(found**2 > stats.chi2.isf(LOCAL, 1))
    item = Score("drag", np.zeros((5, 1)), 0.0, response)
    assert average_power(drag, item, alarm()) == pytest.approx(exact, abs=0.01)
