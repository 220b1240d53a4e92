"""Readings that a posterior predicts at given coordinates, without or with the sensors' noise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bayesid._math.arrays import Floats
from bayesid._math.on_device import on_device
from bayesid.inference import compiled
from bayesid.inference.compiled import Simulated
from bayesid.inference.data import grids_of
from bayesid.inference.integration_step import integration_error, simulate_padded
from bayesid.inference.posterior import Posterior
from bayesid.simulation.sensors import Coloured, Sensor, SensorKind

__all__ = [
    "PredictedReadings",
    "integration_error_at",
    "noise_of",
    "noisy",
    "predicted_readings",
    "readings_at_start",
]


class PredictedReadings(NamedTuple):
    """Predicted readings of the sensors in one recording, in sensor axes.

    Attributes
    ----------
    time : (T,) array
        Sample times of all sensors [s].
    channels : dict of SensorKind to (T, axes) array
        Readings of each sensor.
    torque : (T, n) array
        Torques of the n joints that have a torque sensor [N m], or forces of prismatic joints [N].
    """

    time: Floats
    channels: dict[SensorKind, Floats]
    torque: Floats

    def __getattr__(self, family: str) -> Floats:
        """Return the readings of one sensor by the family of its channels, such as ``predicted.rate``."""
        for kind, values in () if family.startswith("_") else self.channels.items():
            if kind.value == family:
                return values
        raise AttributeError(f"no sensor {family!r} is declared")


def predicted_readings(posterior: Posterior, z: Floats) -> list[PredictedReadings]:
    """Return the readings of each recording that are predicted at the coordinates ``z`` (size,)."""
    arrays = posterior.data.arrays
    simulated = compiled.simulated(posterior.structure, posterior.numbers, on_device(z), arrays.grid, arrays.attitude)
    return _by_recording(posterior, simulated)


def readings_at_start(posterior: Posterior) -> list[PredictedReadings]:
    """Return the readings that are predicted at the starting point, by the code that has chosen the step."""
    grids = grids_of(posterior.model, posterior.manoeuvres, posterior.data.recorded, posterior.step)
    at = (posterior.structure, posterior.numbers, posterior.starting_point())
    return _by_recording(posterior, simulate_padded(posterior.manoeuvres, *at, grids))


def _by_recording(posterior: Posterior, simulated: Simulated) -> list[PredictedReadings]:
    model, readings = posterior.model, simulated.readings
    torque = np.asarray(readings.torque)
    if model.torque is not None:
        torque = torque[..., model.torque.columns(model.robot)]
    channels = {kind: np.asarray(readings.channels[kind.value]) for kind in model.channels.kinds}
    result = []
    for index, samples in enumerate(posterior.data.recorded):
        count = len(samples.time)
        own = {kind: values[index, :count] for kind, values in channels.items()}
        result.append(PredictedReadings(samples.time, own, torque[index, :count]))
    return result


def noisy(
    posterior: Posterior, index: int, predicted: PredictedReadings, rng: np.random.Generator
) -> PredictedReadings:
    """Return the predicted readings of one recording with fresh white and coloured noise of the sensors.

    The error of a prediction that is due to the encoders' noise is left out.
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
    """Draw a sensor's noise at times (T,), white of ``sigma`` (size,) and coloured where declared; shape (T, size)."""
    noise = sigma * rng.normal(size=(len(time), sensor.kind.size))
    return noise if sensor.coloured is None else noise + _coloured(sensor.coloured, time, rng)


def _coloured(noise: Coloured, time: Floats, rng: np.random.Generator) -> Floats:
    """Draw a stationary Ornstein-Uhlenbeck process at the given times, by its exact transition."""
    unit = rng.normal(size=(len(time), len(noise.sigma)))
    kept = np.exp(-np.diff(time, prepend=-np.inf) / noise.time)
    state, values = np.zeros(len(noise.sigma)), np.zeros_like(unit)
    for row, share in enumerate(kept):
        state = share * state + np.sqrt(1.0 - share**2) * unit[row]
        values[row] = state
    return values * np.asarray(noise.sigma)


def integration_error_at(posterior: Posterior, z: Floats) -> float:
    """Return the largest error of any sample due to the integration step at ``z``, in its standard deviations."""
    data = posterior.data
    return integration_error(
        data.model, data.manoeuvres, data.recorded, posterior.structure, posterior.numbers, z, data.step
    )
