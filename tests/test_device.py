"""Batches follow the device and its memory; here its description is made up, and once there is one it is measured."""

from __future__ import annotations

from collections.abc import Callable

import jax
import numpy as np
import pytest
from test_hidden_vibration import instants

from bayesid._math.device import Device, device
from bayesid.diagnosis.response import hidden_vibration
from bayesid.diagnosis.response.hidden_vibration import Vibration
from bayesid.inference import ensemble, perturbed_posterior, posterior
from bayesid.inference.perturbed_posterior import LinearResponses
from bayesid.inference.posterior import Posterior
from bayesid.simulation.effects import FuelSlosh

H100 = Device("gpu", 80e9)


def test_a_processor_takes_batches_that_fit_its_cache():
    for points in (1, 12, 13, 5000):
        assert Device("cpu").batch(points, 1e6) == 12
    assert ensemble._walkers(10) == 24
    assert ensemble._walkers(20) == 48


def test_another_device_takes_all_points_that_its_memory_holds():
    assert H100.batch(24, 1e6) == 32
    assert H100.batch(4000, 1e6) == 4096
    assert H100.batch(10**6, 1e6) == 8192
    for size in (1e6, 1e7, 3e8, 1e12):
        batch = H100.batch(10**6, size)
        assert batch == 1 or batch * size <= 0.5 * H100.memory
        assert batch == 8192 or 2 * batch * size > 0.5 * H100.memory
    assert H100.calls == 1


def test_the_likelihood_does_not_depend_on_the_batches(planar_case, monkeypatch):
    given: Posterior = planar_case.posterior
    z = given.starting_point() + 1e-3 * np.random.default_rng(0).normal(size=(21, given.size))
    expected = given.log_likelihoods(z)
    shapes = []
    chi2 = Posterior._chi2
    monkeypatch.setattr(Posterior, "_chi2", lambda self, part: (shapes.append(len(part)), chi2(self, part))[1])
    monkeypatch.setattr(posterior, "device", lambda: Device("gpu", 2.0 * 8.9 * given.bytes_per_point))
    np.testing.assert_allclose(given.log_likelihoods(z), expected, rtol=1e-12)
    assert shapes == [8, 8, 8]


def test_responses_do_not_depend_on_the_batches(planar_case, monkeypatch):
    given: Posterior = planar_case.posterior
    responses = LinearResponses.about(given, given.starting_point(), given.data.arrays)
    rng, readings = np.random.default_rng(1), responses.motion.reading.shape
    raw, offset = rng.normal(size=(21, *readings)), rng.normal(size=(21, *given.data.arrays.offset.shape))
    expected = responses.whitened(raw, offset)
    sizes = []
    read_out = perturbed_posterior.compiled.read_out
    monkeypatch.setattr(
        perturbed_posterior.compiled, "read_out", lambda *given: (sizes.append(len(given[-1])), read_out(*given))[1]
    )
    per_change = posterior.COPIES * 8.0 * (raw[0].size + offset[0].size + expected[0].size)
    monkeypatch.setattr(perturbed_posterior, "device", lambda: Device("gpu", 2.0 * 8.9 * per_change))
    np.testing.assert_allclose(responses.whitened(raw, offset), expected, rtol=1e-12, atol=1e-14)
    assert sizes == [8, 8, 8]
    monkeypatch.setattr(perturbed_posterior, "device", lambda: H100)
    responses.whitened(raw, offset)
    assert sizes[3:] == [32]


def test_vibrations_do_not_depend_on_the_batches(monkeypatch):
    node = instants(np.arange(0.0, 5.1, 0.5))
    vibration = Vibration.along(node, node)
    values = np.array([[3.0, 0.1 + 0.01 * number, 0.01, 0.0, 0.0, 0.0] for number in range(21)])
    expected = vibration.rows(FuelSlosh(), values)
    sizes = []
    oscillate = hidden_vibration._oscillate
    monkeypatch.setattr(
        hidden_vibration, "_oscillate", lambda *given: (sizes.append(len(given[0])), oscillate(*given))[1]
    )
    monkeypatch.setattr(hidden_vibration, "device", lambda: H100)
    for batched, alone in zip(vibration.rows(FuelSlosh(), values), expected, strict=True):
        np.testing.assert_allclose(batched, alone, rtol=1e-12, atol=1e-15)
    assert sizes == [32]


def test_the_sampler_offers_a_device_enough_points_at_once(monkeypatch):
    monkeypatch.setattr(ensemble, "device", lambda: H100)
    assert ensemble._walkers(10) == 2 * H100.fewest


def test_the_memory_of_a_point_is_what_xla_plans(planar_case):
    given: Posterior = planar_case.posterior
    points = 64

    def chi2(numbers, z, arrays):
        return posterior.compiled.chi2(given.structure, numbers, z, arrays)

    compiled = jax.jit(chi2).lower(given.numbers, np.zeros((points, given.size)), given.data.arrays).compile()
    planned = compiled.memory_analysis().temp_size_in_bytes / points
    assert 0.5 * planned < given.bytes_per_point < 3.0 * planned


def test_a_device_agrees_with_the_processor(planar_case, planar_posterior: Callable[..., Posterior]):
    if device().platform == "cpu":
        pytest.skip("JAX finds no device beside the processor here")
    given: Posterior = planar_case.posterior
    z = given.starting_point() + 1e-3 * np.random.default_rng(0).normal(size=(1000, given.size))
    with jax.default_device(jax.devices("cpu")[0]):
        expected = planar_posterior(np.random.default_rng(2), step=0.5).log_likelihoods(z)
    np.testing.assert_allclose(given.log_likelihoods(z), expected, rtol=1e-9)
