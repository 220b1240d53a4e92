"""The decision loop: linear model, fits of sets, vibrations corrected by fits, faults of the noise beside causes."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bayesid._io.errors import InputError
from bayesid.diagnosis.candidates.cause_kind import companies
from bayesid.diagnosis.evidence.cause_sets import CausePrior, CauseSet, SetProbabilities
from bayesid.diagnosis.noise import UnderstatedNoise
from bayesid.diagnosis.noise.noise_fault import FittedFault
from bayesid.diagnosis.noise.noise_model import NoiseModel
from bayesid.diagnosis.response.perturbed_model import PerturbedModel
from bayesid.diagnosis.search import model_search, relinearise
from bayesid.diagnosis.search.fitted_set import fit_hypothesis, fit_in_amplitudes
from bayesid.diagnosis.search.linearisation import Catalogue, linearise
from bayesid.diagnosis.search.model_search import ModelSearch
from bayesid.diagnosis.search.relinearise import SetSearch, plausible_vibrations, search_sets, with_fitted_vibrations
from bayesid.diagnosis.settings import DEFAULT_SETTINGS
from bayesid.inference.posterior import Posterior
from bayesid.simulation.effects import bounds_by_label, create
from bayesid.simulation.effects.mass_shift import MassShift
from bayesid.simulation.sensors import SensorKind
from tests.conftest import SIGMA

BIAS = np.array([3e-5, -2e-5, 4e-5])
"""Hidden bias of the accelerometer [m/s2]."""


@pytest.fixture(scope="module")
def biased(planar_case):
    """The small case with a hidden bias, beside one other candidate, and the fit of its present model."""
    posterior = planar_case.posterior
    (manoeuvre,) = posterior.manoeuvres
    channels = dict(manoeuvre.recording.channels)
    for axis, bias in zip("xyz", BIAS, strict=True):
        channels[f"accel.{axis}"] = channels[f"accel.{axis}"] + bias
    hidden = [replace(manoeuvre, recording=replace(manoeuvre.recording, channels=channels))]
    effects = tuple(create(name).attach(posterior.model.robot) for name in ("accel-bias", "wheel-momentum"))
    catalogue = Catalogue(effects, bounds_by_label(effects, posterior.model), CausePrior())
    perturbed = PerturbedModel(Posterior.of(posterior.model, hidden, step=posterior.step))
    fit = perturbed.fit()
    return SimpleNamespace(
        perturbed=perturbed, fit=fit, catalogue=catalogue, point=linearise(perturbed, fit, catalogue)
    )


def test_the_linear_model_has_the_evidence_of_the_fit_that_it_stands_on(biased):
    assert biased.point.log_nothing == pytest.approx(biased.fit.log_evidence, abs=0.05)
    assert biased.point.predicted_cost == pytest.approx(biased.fit.cost, abs=0.05)


def test_a_fit_in_amplitudes_ends_where_the_linear_model_says(biased):
    (effect, _) = biased.catalogue.effects
    fit, expected = fit_in_amplitudes(biased.point, [effect.label], biased.catalogue.effects)
    assert fit.cost == pytest.approx(expected, abs=DEFAULT_SETTINGS.agrees)
    assert fit.cost < biased.fit.cost - 20.0
    np.testing.assert_allclose(fit.values(0).ravel(), BIAS, atol=5.0 * SIGMA / np.sqrt(81))


def test_about_a_fit_with_a_cause_the_evidence_of_sets_is_the_same(biased):
    """Where the model is linear it does not matter about which fit it is linearised."""
    (effect, _) = biased.catalogue.effects
    fit, _ = fit_in_amplitudes(biased.point, [effect.label], biased.catalogue.effects)
    there = linearise(biased.perturbed, fit, biased.catalogue)
    names = ["accel-bias"]
    here = biased.point.log_nothing + biased.point.evidence.log_evidence(names)
    assert there.log_nothing + there.evidence.log_evidence(names) == pytest.approx(here, abs=0.5)


def test_a_search_names_the_cause_and_fits_it(biased):
    noise = NoiseModel((), biased.perturbed, biased.fit)
    search = search_sets(noise, biased.catalogue, biased.point)
    assert search.probabilities.sets[0].causes == ("accel-bias",)
    assert search.best.cost < biased.fit.cost - 20.0
    assert search.highest > search.log_nothing + 20.0
    hypothesis = search.fit(["accel-bias"], biased.catalogue.effects)
    assert hypothesis.labels == ("accel-bias",)
    np.testing.assert_allclose(hypothesis.fit.values(0).ravel(), BIAS, atol=5.0 * SIGMA / np.sqrt(81))


def test_a_set_without_any_motion_cannot_be_fitted(biased, monkeypatch):
    def diverges(*_, **__):
        raise InputError("no motion")

    monkeypatch.setattr(PerturbedModel, "fit", diverges)
    with pytest.raises(InputError, match="no motion"):
        fit_hypothesis(biased.point, (), ["accel-bias"], biased.catalogue.effects)


def sets(*items):
    """Probabilities of sets of causes a, b, and vibrations u, v."""
    every = [CauseSet((), None, 0.0), *(CauseSet(causes, generic, value) for causes, generic, value in items)]
    return SetProbabilities.of(every, ("a", "b", "u", "v"), ("anything",), CausePrior())


CATALOGUE = Catalogue(
    tuple(SimpleNamespace(label=label, cause_kind="vibration" if label in "uv" else "linear") for label in "abuv"),
    {},
    CausePrior(),
)
SETS = (
    (("a",), None, 20.0),
    (("a", "u"), None, 30.0),
    (("u",), None, 5.0),
    (("a", "v"), None, 22.0),
    (("v",), "anything", 28.0),
    (("u", "v"), None, 8.0),
    (("a", "u", "v"), None, 31.0),
)


def test_vibrations_are_fitted_in_their_best_company_where_one_is_plausible():
    assert plausible_vibrations(sets(*SETS), CATALOGUE)
    assert companies(sets(*SETS), CATALOGUE.weighed_by_fits) == {"u": ("a",), "v": ("a",)}
    assert not plausible_vibrations(sets((("a",), None, 40.0), *SETS[1:]), CATALOGUE)


def test_the_best_set_to_fit_has_one_form_and_nothing_generic():
    found = sets((("a", "b"), None, 30.0), (("a",), "anything", 40.0), (("u",), None, 20.0))
    assert relinearise._best_known(found, CATALOGUE) == ("a", "b")
    assert relinearise._best_known(sets(*SETS[1:]), CATALOGUE) == ()
    large = sets((("a",), None, 60.0), (("a", "u"), None, 70.0))
    assert relinearise._best_known(large, CATALOGUE) == ("a",)  # about its fit the vibration is weighed anew
    jump = MassShift((1.0,))
    found = SetProbabilities.of([CauseSet((jump.label,), None, 9.0)], (jump.label,), (), CausePrior())
    assert relinearise._best_known(found, replace(CATALOGUE, effects=(jump,))) == ()


def test_a_fitted_vibration_gains_once_in_every_set():
    gains, known = {"u": 6.0, "v": 1.0}, {("a", "u"): 30.0, ("a", "v"): 22.0, ("u",): 5.0, ("v",): 4.0}

    def corrected(*causes, generic=None, value=10.0):
        return relinearise._corrected(CauseSet(causes, generic, value), gains, known)

    assert corrected("a") == 10.0
    assert corrected("a", "u") == 16.0
    assert corrected("u", generic="anything") == 16.0
    assert corrected("a", "u", "v", value=31.0) == 36.0  # that of a and u fitted
    assert corrected("a", "u", "v", value=50.0) == 50.0  # the linear model's


def a_search(names=(), log_nothing=0.0, found=None, **parts):
    """A search under some faults, of which nothing but evidence is known."""
    faults = tuple(SimpleNamespace(label=name) for name in names)
    noise = NoiseModel(faults, None, SimpleNamespace(log_evidence=log_nothing), 0.0)
    point = SimpleNamespace(log_nothing=log_nothing, evidence=parts.pop("evidence", None))
    return SetSearch(noise, point, sets(*SETS) if found is None else found, parts.pop("best", None))


def test_evidence_of_vibrations_comes_from_their_fits(monkeypatch):
    fitted = []

    def fit(self, causes, effects, hopeless=np.inf):
        fitted.append((tuple(causes), hopeless))
        if "v" in causes:
            raise InputError("no motion")
        return SimpleNamespace(fit=SimpleNamespace(cost=12.0, log_evidence=136.0))

    monkeypatch.setattr(SetSearch, "fit", fit)
    search = with_fitted_vibrations(a_search(log_nothing=100.0), CATALOGUE)
    assert fitted == [(("a", "u"), np.inf), (("a", "v"), 12.0 + DEFAULT_SETTINGS.vibration_far_behind)]
    each = {item.names: item.log_evidence for item in search.probabilities.sets}
    assert each["a", "u"] == 36.0
    assert each["u",] == 11.0
    assert each["a", "v"] == 22.0
    assert search.best.cost == 12.0


def test_sets_come_from_the_fit_with_most_of_their_large_causes():
    along = relinearise._Near(SimpleNamespace(log_nothing=0.0), sets((("a",), None, 5.0), (("b",), None, 3.0)))
    near = {
        frozenset("a"): relinearise._Near(SimpleNamespace(log_nothing=10.0), sets((("a",), None, 7.0))),
        frozenset("ab"): relinearise._Near(SimpleNamespace(log_nothing=20.0), sets((("a", "b"), None, 9.0))),
    }
    found = relinearise._nearest(along, near, 10.0)
    each = {item.names: item.log_evidence for item in found.sets}
    assert each["a",] == 7.0
    assert each["b",] == -7.0
    assert each["a", "b"] == 19.0


def test_sets_under_all_noise_are_compared_with_the_declared_one():
    quiet, noisy = a_search(), a_search(["accel-noise"], 12.0, sets((("a",), None, 1.0)))
    found = model_search._joined([quiet, noisy], ["accel-noise", "rate-noise"])
    each = {item.names: item.log_evidence for item in found.sets}
    assert each["a",] == 20.0
    assert each["a", "accel-noise"] == 13.0
    assert each["accel-noise",] == 12.0
    assert {"accel-noise", "rate-noise"} <= set(found.causes)
    search = ModelSearch(None, None, (quiet, noisy), found)
    assert search.under(["a", "accel-noise"]) is noisy
    assert search.under(["a"]) is quiet
    assert search.under(["rate-noise"]) is quiet  # never weighed


@pytest.mark.parametrize(
    ("seen", "declared", "fixed", "expected"),
    [
        ([], {"accel-noise": -9.0}, False, [("accel-noise", "base")]),
        (["accel-noise"], {"accel-noise": -9.0}, False, [("accel-noise", "best")]),
        (
            ["coloured-noise:rate"],
            {"coloured-noise:rate": -9.0},
            False,
            [("coloured-noise:rate", "best"), ("coloured-noise:rate", "base")],
        ),
        ([], {"accel-noise": -9.0}, True, []),
        ([], {"variance by axis": -9.0, "accel-noise": -1.0}, False, []),
    ],
)
def test_a_fault_is_suspected_by_what_the_best_set_leaves_and_by_the_present_residual(
    seen, declared, fixed, expected, monkeypatch
):
    view = SimpleNamespace(kinds=(SensorKind.RATE, SensorKind.ACCEL))
    best, base = SimpleNamespace(view=view), SimpleNamespace(view=view)
    monkeypatch.setattr(model_search, "_seen", lambda *_: seen)
    first = SetSearch(NoiseModel((), None, base, 0.0, fixed), None, None, best)
    found = model_search._suspects(SimpleNamespace(noise=declared), first, np.log(1e-3))
    assert [(name, "best" if fit is best else "base") for name, fit in found] == expected


def test_faults_that_stay_behind_are_not_weighed(monkeypatch):
    """Beside a fault that explains much all sets are weighed, beside one that stays far behind none is."""
    values, weighed = {"rate-noise": 15.0, "accel-noise": -20.0}, []

    def with_fault(self, label, *_):
        return None if self.names else replace(a_search([label], values[label]).noise)

    def search(noise, catalogue, base=None):
        weighed.append(noise.names)
        return a_search(noise.names, noise.fit.log_evidence)

    monkeypatch.setattr(NoiseModel, "with_fault", with_fault)
    monkeypatch.setattr(model_search, "search_sets", search)
    monkeypatch.setattr(model_search, "_seen", lambda *_: [])
    monkeypatch.setattr(model_search, "_suspects", lambda *_: [(name, None) for name in values])
    found = model_search._with_faults(a_search(), None, CATALOGUE, lambda *_: None)
    assert weighed == [("rate-noise",)]
    assert [search.noise.names for search in found] == [(), ("rate-noise",)]


def test_a_size_that_is_known_is_not_weighed_again(planar_case):
    def fault(size):
        kind = UnderstatedNoise(SensorKind.RATE)
        return FittedFault(kind, np.array([size]), np.array([0.1]), planar_case.posterior)

    model = NoiseModel((fault(2.0),), None, None)
    assert model.has(fault(2.2))
    assert not model.has(fault(3.0))
