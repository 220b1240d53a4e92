"""Another prior, another noise, another recording of about the same length: nothing is compiled anew."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import jax
import numpy as np
import pytest
from jax import monitoring

from bayesid._math.kept_jit import OBTAINED
from bayesid.inference.importance import importance_sample
from bayesid.inference.mode import maximise
from bayesid.inference.noise_changes import relinearised
from bayesid.inference.parameterisation import LinearParameterisation
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import predicted_readings
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.recording import Recording
from bayesid.simulation.effects import Payload, SensorBias
from bayesid.simulation.model import Manoeuvre
from bayesid.simulation.sensors import SensorKind, White

COMPILED = "/jax/core/compile/backend_compile_duration"


@contextmanager
def counted() -> Iterator[list[str]]:
    """Collect what XLA compiles meanwhile; functions kept on disk count too."""
    seen: list[str] = []

    def listen(event: str, duration: float, **_: object) -> None:
        if event == COMPILED:
            seen.append(event)

    def note(event: str, **_: object) -> None:
        if event == OBTAINED:
            seen.append(event)

    monitoring.register_event_duration_secs_listener(listen)
    monitoring.register_event_listener(note)
    try:
        yield seen
    finally:
        monitoring.unregister_event_duration_listener(listen)
        monitoring.unregister_event_listener(note)


def exercised(posterior: Posterior) -> None:
    """Fit, weigh and predict, as an identification does."""
    refined, optimum = maximise(posterior, np.random.default_rng(0))
    importance_sample(LinearParameterisation(refined), optimum, np.random.default_rng(1), draws=16)
    predicted_readings(refined, optimum.z)


@pytest.fixture(scope="module")
def compiled(planar_posterior: Callable[..., Posterior]) -> Posterior:
    """A posterior all of whose functions have been compiled.

    Its sensors' noise is four times that of the small case, in which the encoders' noise is just at the level from
    which readings are whitened by windows.
    """
    base = planar_posterior(np.random.default_rng(3), step=0.5)
    model = base.model.extend(SensorBias.of(SensorKind.ACCEL)(1e-4)).extend(Payload("link2", 0.2))
    model = replace(model, sensors=tuple(replace(sensor, noise=White(4e-5)) for sensor in model.sensors))
    posterior = Posterior.of(model, base.manoeuvres, step=0.5)
    with counted() as seen:
        exercised(posterior)
    assert seen  # the counter counts
    return posterior


@pytest.mark.slow
def test_another_prior_compiles_nothing(compiled):
    model = compiled.model
    wider = tuple(replace(prior, spread=1.7 * prior.spread) for prior in model.priors)
    effects = (*model.effects[:-2], SensorBias.of(SensorKind.ACCEL)(3e-4), Payload("link2", 0.1))
    with counted() as seen:
        other = Posterior.of(
            replace(model, priors=wider, rate_sigma=0.2, effects=effects), compiled.manoeuvres, step=0.5
        )
        exercised(other)
    assert seen == []
    assert np.abs(other.residuals(np.ones(other.size)) - compiled.residuals(np.ones(other.size))).max() > 0.1


@pytest.mark.slow
def test_another_noise_and_another_place_of_the_sensor_compile_nothing(compiled):
    rate, accel = compiled.model.sensors
    sensors = (replace(rate, noise=White(4.4e-5)), replace(accel, noise=White(4.4e-5), position=(0.3, 0.2, 0.1)))
    with counted() as seen:
        other = Posterior.of(replace(compiled.model, sensors=sensors), compiled.manoeuvres, step=0.5)
        z = np.zeros(other.size)
        other.jacobian(z)
        other.log_density(z)
        predicted_readings(relinearised(other, z), z)
    assert seen == []
    assert np.abs(other.residuals(z) - compiled.residuals(z)).max() > 0.1


@pytest.mark.slow
def test_another_recording_of_similar_length_compiles_nothing(compiled):
    manoeuvre = compiled.manoeuvres[0]
    whole = manoeuvre.recording
    kept = slice(0, len(whole.time) - 3)
    cut = Recording("cut", None, whole.time[kept], {key: values[kept] for key, values in whole.channels.items()})
    motion = MeasuredMotion.from_recording(cut, compiled.model.robot, sigma={0: 1e-6})
    with counted() as seen:
        exercised(Posterior.of(compiled.model, [Manoeuvre(cut, motion)], step=0.5))
    assert seen == []


@pytest.mark.slow
def test_another_effect_does_compile(compiled):
    model = compiled.model
    with counted() as seen:
        Posterior.of(replace(model, effects=model.effects[:-1]), compiled.manoeuvres, step=0.5).residuals(
            np.zeros(compiled.size - 10)
        )
    assert seen


def test_counting_stops_with_the_block():
    with counted() as seen:
        pass
    jax.jit(lambda x: x + 41.0)(1.0)
    assert seen == []
