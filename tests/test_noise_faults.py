"""Every fault of the noise is measured from a residual, goes into a model as stated, and is then no longer seen."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from bayesid._io.errors import InputError
from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_manoeuvres, load_model, load_posterior
from bayesid.app.study_to_noise import with_stated_noise, without_stated_faults
from bayesid.diagnosis import Status, diagnose
from bayesid.diagnosis.noise import SensorFault, noise_faults, register_fault
from bayesid.diagnosis.noise import noise_fault as registry
from bayesid.diagnosis.noise.family_alarm import noise_tests
from bayesid.diagnosis.noise.noise_fault import FitResidual, FittedFault
from bayesid.diagnosis.noise.noise_model import NoiseModel
from bayesid.diagnosis.response.perturbed_model import PerturbedModel
from bayesid.inference import identify
from bayesid.inference.noise_changes import without_left_out
from bayesid.inference.posterior import Posterior
from bayesid.recording.recording import _VECTOR_FAMILIES, Recording
from bayesid.report.diagnosis.decision_page import conditions_text
from bayesid.report.model_assumptions import model_sentences
from bayesid.simulation.effects import create
from bayesid.simulation.effects.effect_parameters import Quantity
from bayesid.simulation.model import Manoeuvre
from bayesid.simulation.sensors import Scaled, SensorKind
from tests.conftest import PLANAR, SIGMA

SUSPECT = np.log(1e-3)


def garbled(posterior, change):
    """The manoeuvre of the small case with changed readings of the accelerometer, (n, 3)."""
    (manoeuvre,) = posterior.manoeuvres
    names = [f"accel.{axis}" for axis in "xyz"]
    changed = change(np.stack([manoeuvre.recording.channels[name] for name in names], axis=1))
    channels = {**manoeuvre.recording.channels, **dict(zip(names, changed.T, strict=True))}
    return [replace(manoeuvre, recording=replace(manoeuvre.recording, channels=channels))]


def stated(text):
    """What a study says under [model.noise]."""
    return SimpleNamespace(model=SimpleNamespace(noise=tomllib.loads(text)))


def noisier(values, rng):
    return values + 2.0 * SIGMA * rng.normal(size=values.shape)


def coloured(values, rng):
    wander = np.zeros_like(values)
    for row in range(1, len(values)):
        wander[row] = 0.85 * wander[row - 1] + 1.5 * SIGMA * rng.normal(size=3)
    return values + wander


def with_outliers(values, rng):
    values = values.copy()
    values[[9, 33, 61], [0, 1, 2]] += 40.0 * SIGMA
    return values


def rounded(values, rng):
    return 4.0 * SIGMA * np.round(values / (4.0 * SIGMA))


@pytest.mark.parametrize(
    ("label", "spoil"),
    [
        ("accel-noise", noisier),
        ("quantisation:accel", rounded),
        pytest.param("coloured-noise:accel", coloured, marks=pytest.mark.slow),
        pytest.param("outliers:accel", with_outliers, marks=pytest.mark.slow),
    ],
)
def test_what_a_diagnosis_measures_a_study_states(label, spoil, planar_case):
    whole, rng = planar_case.posterior, np.random.default_rng(3)
    manoeuvres = garbled(whole, lambda values: spoil(values, rng))
    perturbed, fault = PerturbedModel(Posterior.of(whole.model, manoeuvres, step=whole.step)), noise_faults()[label]
    fit = perturbed.fit()
    assert noise_tests(FitResidual(fit))[label] < SUSPECT
    study = stated(fault.refined(fault.measured(fit), perturbed, fit).statement)
    model = with_stated_noise(study, whole.model)
    kept = without_stated_faults(study, model, manoeuvres)
    again = PerturbedModel(Posterior.of(model, kept, step=whole.step)).fit()
    assert noise_tests(FitResidual(again)).get(label, 0.0) > SUSPECT


def test_the_factor_on_a_sensor_s_noise_is_as_certain_as_a_root_of_chi_square(planar_case):
    whole, rng = planar_case.posterior, np.random.default_rng(3)
    manoeuvres = garbled(whole, lambda values: noisier(values, rng))
    fit = PerturbedModel(Posterior.of(whole.model, manoeuvres, step=whole.step)).fit()
    fitted = noise_faults()["accel-noise"].measured(fit)
    degrees = FitResidual(fit).by_sensor[SensorKind.ACCEL].degrees
    assert fitted.sd[0] / fitted.mean[0] == pytest.approx(stats.chi(degrees).std() / np.sqrt(degrees), rel=0.01)


def test_the_density_of_coloured_noise_is_that_of_what_is_simulated(planar_case):
    """Whittle's estimate from a wandering residual has its size and correlation time."""
    fit, rng = PerturbedModel(planar_case.posterior).fit(), np.random.default_rng(8)
    view, time = fit.view, 4.0
    interval = float(np.median(np.diff(planar_case.posterior.data.times(0))))
    rho = np.exp(-interval / time)
    wander = np.zeros((view.values.shape[1], view.values.shape[2]))
    for row in range(1, len(wander)):
        wander[row] = rho * wander[row - 1] + 3.0 * np.sqrt(1.0 - rho**2) * rng.normal(size=wander.shape[1])
    residual = (view.values[0] + np.where(view.values[0] != 0.0, wander, 0.0)).ravel()
    fitted = noise_faults()["coloured-noise:accel"].measured(replace(fit, residual=residual))
    assert fitted.mean[0] == pytest.approx(3.0 * SIGMA, rel=0.4)
    assert fitted.mean[1] == pytest.approx(time, rel=0.7)


def test_the_noise_of_the_encoders_is_stated_as_a_factor(planar_case):
    whole = planar_case.posterior
    (kept,) = without_stated_faults(stated('"encoder-noise" = { factor = 2.0 }'), whole.model, whole.manoeuvres)
    pairs = zip(kept.motion.joints, whole.manoeuvres[0].motion.joints, strict=True)
    assert all(after.series[0].sigma == pytest.approx(2.0 * before.series[0].sigma) for after, before in pairs)


def test_sizes_may_differ_between_axes(planar_case):
    study = stated('"accel-noise" = { factor = [1.0, 2.0, 3.0] }')
    sensor = with_stated_noise(study, planar_case.posterior.model).sensor(SensorKind.ACCEL)
    np.testing.assert_allclose(sensor.noise.sigma(1.0), SIGMA * np.array([1.0, 2.0, 3.0]))


@pytest.mark.parametrize(
    ("line", "problem", "remedy"),
    [
        ('"rate-nois" = { factor = 2.0 }', "unknown noise fault 'rate-nois'", "rate-noise"),
        ('"attitude-noise" = { factor = 2.0 }', "unknown noise fault 'attitude-noise'", "Choose from"),
        ('"coloured-noise:rate" = { sigma = 1e-5 }', "got sigma", "Give sigma and time"),
        ('"coloured-noise:rate" = { sigma = 1e-5, time = [1.0, 2.0] }', "got {", "Give a number"),
        ('"accel-noise" = { factor = [1.0, 2.0] }', "got {", "or one for each axis"),
        ('"outliers:rate" = { fraction = 1.5 }', "got a fraction of 1.5", "below 1"),
    ],
)
def test_what_cannot_be_stated_is_refused_with_a_remedy(line, problem, remedy, planar_case):
    with pytest.raises(InputError) as error:
        with_stated_noise(stated(line), planar_case.posterior.model)
    assert error.value.problem.startswith(problem)
    assert remedy in error.value.remedy
    assert error.value.place.startswith("model.noise.")


def test_a_model_that_is_off_loses_no_readings(planar_case):
    """More readings than the fraction allows stand out: a study that misses an effect is no matter of outliers."""
    whole = planar_case.posterior
    spread = [2, 9, 17, 24, 33, 41, 48, 55, 62, 70]

    def off(values):
        values = values.copy()
        values[spread] += 40.0 * SIGMA
        return values

    manoeuvres = garbled(whole, off)
    study = stated('"outliers:accel" = { fraction = 0.01 }')
    (kept,) = without_stated_faults(study, with_stated_noise(study, whole.model), manoeuvres)
    assert np.isfinite(kept.recording.channels["accel.x"]).all()


STUDY = """
title = "Noise as a diagnosis found it"
[robot]
urdf = "{urdf}"
[orbit]
radius = 6.878e6
[sensors.rate]
sigma = 1e-5
[sensors.accel]
sigma = 1e-5
position = [0.1, -0.15, 0.3]
[sensors.encoder]
sigma = 1e-6
[[recordings]]
file = "one.csv"
attitude = [0.0, 0.0, 0.0, 1.0]
[unknowns]
bodies = ["base_link"]
spread = 0.3
[model]
effects = ["gravity-gradient"]
"""


@pytest.mark.slow
def test_what_is_named_is_stated_and_then_nothing_is_missing(tmp_path, noisy, planar_case):
    """Coloured noise: `diagnose` names it; with its line in the study it finds nothing more, and `identify` runs."""
    recording, rng = noisy(np.random.default_rng(2)), np.random.default_rng(3)
    names = [f"accel.{axis}" for axis in "xyz"]
    readings = coloured(np.stack([recording.channels[name] for name in names], axis=1), rng)
    channels = {**recording.channels, **dict(zip(names, readings.T, strict=True))}
    replace(recording, channels=channels).write(tmp_path / "one.csv")
    file = tmp_path / "study.toml"

    def diagnosed():
        study = Study.load(file)
        model = load_model(study)
        effects = [create("accel-bias").attach(model.robot)]
        return study, diagnose(model, load_manoeuvres(study, model.robot), effects=effects)

    file.write_text(STUDY.format(urdf=PLANAR))
    _, found = diagnosed()
    assert found.verdict.causes == ("coloured-noise:accel",)
    (fault,) = found.after.faults
    file.write_text(f"{STUDY.format(urdf=PLANAR)}[model.noise]\n{fault.statement}\n")
    study, again = diagnosed()
    assert again.verdict.status is Status.ADEQUATE
    assert "coloured" in conditions_text(again.before)
    result = identify(load_posterior(study), seed=1, effective_samples=200)
    mass = result.bodies["base_link"]
    assert abs(mass.mean[0] - planar_case.truth.mass) < 5.0 * mass.sd[0]
    assert "coloured noise of" in " ".join(model_sentences(result.posterior, 0.0))


@pytest.fixture
def stuck(monkeypatch):
    """A fault of one's own in one class: readings that repeat the one before."""
    monkeypatch.setattr(registry, "_REGISTER", dict(registry._REGISTER))

    @register_fault
    class StuckReadings(SensorFault):
        name = "stuck"
        summary = "Some readings are those before them."
        parameters = "share [1]: of the samples"

        @property
        def quantities(self):
            return (Quantity("share", "1"),)

        def log_p_of(self, residual, posterior):
            repeats = self._repeats(posterior)
            return float(stats.binom.logsf(repeats.sum() - 1, repeats.size, 1e-6)) if repeats.any() else 0.0

        def measured(self, fit, *_):
            repeats = self._repeats(fit.posterior)
            if not repeats.any():
                return None
            share = repeats.mean()
            sd = np.sqrt(share * (1.0 - share) / repeats.size)
            return FittedFault(self, np.array([share]), np.array([sd]), self.in_noise(fit, [share]), 100.0)

        def changed(self, sensor, sizes):
            return replace(sensor, noise=Scaled(sensor.noise, (float(1.0 + sizes[0]),) * self.kind.size))

        def _repeats(self, posterior):
            return (np.diff(posterior.data.measured(0, self.kind)[1], axis=0) == 0.0).all(axis=1)

    return StuckReadings


def test_a_fault_of_ones_own_is_one_class(stuck, planar_case):
    """It is tested, weighed and named beside the others, listed in the catalogue, and stated in a study."""
    from bayesid.report.effect_catalogue import catalogue

    whole = planar_case.posterior
    assert "stuck:accel" in noise_faults(whole.model.channels.kinds)
    assert "stuck:SENSOR" in [entry.name for entry in catalogue()]

    def repeat(values):
        values = values.copy()
        values[20:22] = values[19]
        return values

    perturbed = PerturbedModel(Posterior.of(whole.model, garbled(whole, repeat), step=whole.step))
    fit = perturbed.fit()
    tests = noise_tests(FitResidual(fit))
    assert tests["stuck:accel"] < SUSPECT < tests["stuck:rate"]
    found = NoiseModel((), perturbed, fit).with_fault("stuck:accel", fit, fit.log_evidence)
    assert found.names == ("stuck:accel",)
    (fault,) = found.faults
    assert fault.mean == pytest.approx(2.0 / 80.0)
    assert found.log_nothing > fit.log_evidence
    assert found.has(fault)
    model = with_stated_noise(stated(fault.statement), whole.model)
    np.testing.assert_allclose(model.sensor(SensorKind.ACCEL).noise.sigma(1.0), 1.025 * SIGMA)


def test_two_faults_of_one_name_are_refused(stuck):
    with pytest.raises(InputError, match="two faults of the noise are named 'stuck'"):

        @register_fault
        class Another(SensorFault):
            name = "stuck"


def test_outliers_of_a_sensor_with_axes_of_its_own_are_left_out(monkeypatch):
    monkeypatch.setitem(_VECTOR_FAMILIES, "field", ("a", "b"))

    class Field(SensorKind):
        value, unit, axes = "field", "1", ("a", "b")

    time = np.arange(20.0)
    channels = dict.fromkeys(("field.a", "field.b", "rate.x", "rate.y", "rate.z"), time)
    manoeuvre = Manoeuvre(Recording("one", None, time, channels), motion=None)
    data = SimpleNamespace(left_out_times=lambda index: {Field(): np.array([2.0])})
    (kept,) = without_left_out(SimpleNamespace(manoeuvres=(manoeuvre,), data=data))
    for axis in "ab":
        np.testing.assert_array_equal(kept.recording.channels[f"field.{axis}"], np.where(time == 2.0, np.nan, time))
    assert np.isfinite(kept.recording.channels["rate.x"]).all()


def test_the_conditions_of_a_verdict_say_which_noise_is_coloured(planar_case):
    fault = noise_faults()["coloured-noise:accel"]
    model = fault.in_model(planar_case.posterior.model, [2e-5, 3.0])
    hypothesis = SimpleNamespace(fit=SimpleNamespace(posterior=SimpleNamespace(model=model)), faults=())
    assert "noise of accel coloured;" in conditions_text(hypothesis)
