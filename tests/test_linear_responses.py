"""Responses by the linear time-varying motion are the derivatives of the simulation itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.inference.perturbed_posterior import LinearResponses, Perturbation, perturbed, residual_of
from bayesid.inference.posterior import Posterior
from bayesid.simulation.effects import (
    FlexibleAppendage,
    FuelSlosh,
    SensorBias,
    SensorLatency,
    SensorScale,
    WheelMomentum,
    create,
)
from bayesid.simulation.sensors import SensorKind


def pushes_of(posterior: Posterior, rng: np.random.Generator, count: int) -> Perturbation:
    arrays = posterior.data.arrays
    node, sample = arrays.grid.node.known.shape, arrays.grid.sample.known.shape
    shapes = (node, sample, (*node[:2], 6), (*sample[:2], 6), arrays.offset.shape)
    return Perturbation(*(rng.normal(size=(count, *shape)) for shape in shapes))


def by_differences(posterior: Posterior, z: np.ndarray, arrays, push: Perturbation, size: float) -> np.ndarray:
    """Central differences of the whole simulation."""
    ends = [
        residual_of(posterior, z, perturbed(arrays, jax.tree.map(lambda x, s=s: jnp.asarray(s * x), push)))
        for s in (size, -size)
    ]
    return (ends[0] - ends[1]) / (2.0 * size)


@pytest.mark.slow
@pytest.mark.parametrize(
    "effects",
    [
        (),
        (
            WheelMomentum(),
            SensorBias.of(SensorKind.ACCEL)(1e-3),
            SensorScale.of(SensorKind.RATE)(),
            SensorLatency.of(SensorKind.ACCEL)(),
        ),
        (FuelSlosh(), FlexibleAppendage()),
    ],
    ids=["rigid", "sensors and wheels", "vibrations"],
)
def test_responses_are_derivatives_of_the_residual(planar_posterior: Callable[..., Posterior], effects):
    rng = np.random.default_rng(5)
    base = planar_posterior(rng, step=0.5)
    posterior = Posterior.of(replace(base.model, effects=(*base.model.effects, *effects)), base.manoeuvres, step=0.5)
    z = 0.3 * rng.normal(size=posterior.size)
    # about data that something acts on already, as a fit's effects do
    already = jax.tree.map(lambda x: jnp.asarray(1e-4 * x[0]), pushes_of(posterior, rng, 1))
    arrays = perturbed(posterior.data.arrays, already)
    pushes = pushes_of(posterior, rng, 34)  # more than a batch
    found = LinearResponses.about(posterior, z, arrays).along(pushes)
    for k in (0, 33):
        own = jax.tree.map(lambda x, k=k: x[k], pushes)
        expected = by_differences(posterior, z, arrays, own, 1e-6)
        np.testing.assert_allclose(found[k], expected, atol=2e-6 * np.abs(expected).max())


def test_each_part_of_a_push_alone_adds_up(planar_posterior: Callable[..., Posterior]):
    rng = np.random.default_rng(6)
    posterior = planar_posterior(rng, step=0.5)
    linear = LinearResponses.about(posterior, np.zeros(posterior.size), posterior.data.arrays)
    pushes = pushes_of(posterior, rng, 2)
    parts = [
        linear.along(Perturbation(*(x if i == k else 0.0 * x for i, x in enumerate(pushes))))
        for k in range(len(pushes))
    ]
    whole = linear.along(pushes)
    np.testing.assert_allclose(np.sum(parts, axis=0), whole, atol=1e-12 * np.abs(whole).max())
    assert all(np.abs(part).max() > 0.0 for part in parts)
    assert linear.along(jax.tree.map(lambda x: x[:0], pushes)).shape == (0, *posterior.residual_shape)


@pytest.mark.slow
def test_columns_of_effects_are_derivatives_of_the_simulation_that_has_them(planar_posterior: Callable[..., Posterior]):
    """Of a force, a table of the arm and an error of a sensor that is turned in the base."""
    base = planar_posterior(np.random.default_rng(7), step=0.5)
    turned = tuple(
        replace(sensor, mounting=(0.1, -0.4, 0.2, 0.889)) if sensor.kind is SensorKind.ACCEL else sensor
        for sensor in base.model.sensors
    )
    posterior = Posterior.of(replace(base.model, sensors=turned), base.manoeuvres, step=0.5)
    names = ("thruster-leak", "link-inertia:link2", "accel-position")
    effects = [create(name).attach(base.model.robot) for name in names]
    perturbed, z, data = PerturbedModel(posterior), np.zeros(posterior.size), posterior.data.arrays
    items = [(effect, np.zeros(len(effect.parameters))) for effect in effects]
    columns = perturbed.columns(items, perturbed.operating(z, ()), z, data)
    model = posterior.model
    for effect in effects:
        model = model.extend(effect)
    extended = Posterior.of(model, base.manoeuvres, step=0.5)
    steps = 1e-3 * np.eye(extended.size)[len(z) :]
    sides = [np.stack([extended.residuals(sign * step).ravel() for step in steps]) for sign in (1.0, -1.0)]
    expected = np.split((sides[0] - sides[1]).T / 2e-3, np.cumsum([own.shape[1] for own in columns])[:-1], axis=1)
    for name, own, differences in zip(names, columns, expected, strict=True):
        assert np.linalg.norm(own - differences) < 1e-3 * np.linalg.norm(differences), name


@pytest.mark.slow
def test_a_fit_ends_where_the_gradient_of_its_cost_vanishes(planar_posterior: Callable[..., Posterior]):
    """Under a prior that is narrower than its error, so that the data and it pull against each other."""
    fit = PerturbedModel(planar_posterior(np.random.default_rng(9), spread=3e-3, step=0.5)).fit()
    gradient = fit.own.T @ fit.residual + fit.own_coordinates
    assert np.abs(fit.own_coordinates).max() > 3.0
    assert gradient @ fit.covariance @ gradient < 1e-4


def test_a_fit_without_finite_derivatives_has_no_evidence(monkeypatch):
    """Its motion is unstable: it costs more than any other fit, and no hypothesis is chosen for it."""
    stub = SimpleNamespace(log_normalisation=np.zeros(1), size=2, data=SimpleNamespace(arrays=None))
    model, residual, columns = PerturbedModel(stub), np.zeros(5), np.ones((5, 2))
    monkeypatch.setattr(model, "residual", lambda z, data: residual)
    monkeypatch.setattr(model, "own_columns", lambda z, data: columns)
    evidences = []
    for cost in (0.0, np.inf):
        point = model._point([], [], np.zeros(2), None)
        assert point.cost == cost
        nothing = np.zeros(0, dtype=int)
        fit = Fit(stub, (), (), point.z, None, residual, columns, (), point.cost, None, True, nothing, nothing)
        evidences.append(fit.log_evidence)
        columns[2, 1] = np.nan
    assert np.isfinite(evidences[0])
    assert evidences[1] == -np.inf
