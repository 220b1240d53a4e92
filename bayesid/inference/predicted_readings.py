"""What a posterior's sensors should read at a point, and draws of it with the sensors' noise."""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from bayesid._math.arrays import Floats
from bayesid.inference import compiled
from bayesid.inference.integration_step import integration_error
from bayesid.inference.posterior import Posterior
from bayesid.simulation.sensors import Coloured, Kind, Sensor

__all__ = ["PredictedReadings", "integration_error_at", "noise_of", "noisy", "predicted_readings"]


class PredictedReadings(NamedTuple):
    """What one recording's sensors should read, sensor axes.

    time (T,); channels: readings (T, axes) by kind of sensor; torque (T, n) of the n joints of the torque sensor.
    """

    time: Floats
    channels: dict[Kind, Floats]
    torque: Floats

    def __getattr__(self, family: str) -> Floats:
        """Return the readings of one sensor by the family of its channels: ``predicted.rate``."""
        for kind, values in () if family.startswith("_") else self.channels.items():
            if kind.value == family:
                return values
        raise AttributeError(f"no sensor {family!r} is declared")


def predicted_readings(posterior: Posterior, z: Floats) -> list[PredictedReadings]:
    """Return what the sensors of each recording should read at ``z``."""
    arrays, model = posterior.data.arrays, posterior.model
    simulated = compiled.simulated(
        posterior.structure, posterior.numbers, jnp.asarray(z), arrays.grid, arrays.attitude
    ).readings
    torque = np.asarray(simulated.torque)
    if model.torque is not None:
        torque = torque[..., model.torque.columns(model.robot)]
    channels = {kind: np.asarray(simulated.channels[kind.value]) for kind in model.channels.kinds}
    result = []
    for index, samples in enumerate(posterior.data.recorded):
        count = len(samples.time)
        own = {kind: values[index, :count] for kind, values in channels.items()}
        result.append(PredictedReadings(samples.time, own, torque[index, :count]))
    return result


def noisy(
    posterior: Posterior, index: int, predicted: PredictedReadings, rng: np.random.Generator
) -> PredictedReadings:
    """Return predictions of one recording with fresh noise of the sensors, white and coloured.

    What the encoders' noise does to a prediction is no noise of the sensors and is left out.
    """
    channels = {}
    for sensor in posterior.model.sensors:
        sigma = posterior.data.sigma(index, sensor.kind)
        noise = noise_of(sensor, predicted.time, sigma, rng)
        channels[sensor.kind] = sensor.kind.noisy(predicted.channels[sensor.kind], noise)
    torque = predicted.torque
    if posterior.model.torque is not None:
        torque = torque + np.array(posterior.model.torque.sigma) * rng.normal(size=torque.shape)
    return PredictedReadings(predicted.time, channels, torque)


def noise_of(sensor: Sensor, time: Floats, sigma: Floats, rng: np.random.Generator) -> Floats:
    """Draw the noise of a sensor at some times: white of ``sigma`` (size,), and coloured where declared, (T, size)."""
    noise = sigma * rng.normal(size=(len(time), sensor.kind.size))
    return noise if sensor.coloured is None else noise + _coloured(sensor.coloured, time, rng)


def _coloured(noise: Coloured, time: Floats, rng: np.random.Generator) -> Floats:
    """Draw an Ornstein-Uhlenbeck process in its stationary state, exactly at the given times."""
    unit = rng.normal(size=(len(time), len(noise.sigma)))
    kept = np.exp(-np.diff(time, prepend=-np.inf) / noise.time)
    state, values = np.zeros(len(noise.sigma)), np.zeros_like(unit)
    for row, share in enumerate(kept):
        state = share * state + np.sqrt(1.0 - share**2) * unit[row]
        values[row] = state
    return values * np.asarray(noise.sigma)


def integration_error_at(posterior: Posterior, z: Floats) -> float:
    """Return the largest error of any sample from the integration step at ``z``, in its standard deviations."""
    data = posterior.data
    return integration_error(
        data.model, data.manoeuvres, data.recorded, posterior.structure, posterior.numbers, z, data.step
    )
