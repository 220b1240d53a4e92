"""Simulated recordings: what the sensors of a model would read, with their declared noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.inference.posterior import Posterior, Predictions
from bayesid.recording.joint_motion import Motion, sample_joints
from bayesid.recording.recording import Recording
from bayesid.simulation.joint_torques import TorqueSensor
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Kind, Sensor

__all__ = ["blank_channels", "simulate_manoeuvre", "simulate_recordings"]


def simulate_recordings(
    posterior: Posterior, rng: np.random.Generator | None = None, z: Floats | None = None
) -> list[Recording]:
    """Simulate the recordings of a posterior, at the same times.

    Parameters
    ----------
    rng : numpy.random.Generator, optional
        For the sensors' noise; none is added where left out.
    z : (size,) array, optional
        Point to simulate at; `Posterior.initial_point` where left out.
    """
    predictions = posterior.predict(posterior.initial_point() if z is None else z)
    recordings = []
    for index, (manoeuvre, predicted) in enumerate(zip(posterior.manoeuvres, predictions, strict=True)):
        channels = dict(manoeuvre.recording.channels)
        for sensor in posterior.model.sensors:
            values = np.asarray(getattr(predicted, sensor.kind.value))
            if rng is not None:
                values = _noisy(values, sensor.kind, posterior.sigma(index, sensor.kind), rng)
            for column, axis in enumerate("xyzw"[: values.shape[1]]):
                name = f"{sensor.kind.value}.{axis}"
                full = np.full(len(manoeuvre.recording.time), np.nan)
                full[np.searchsorted(manoeuvre.recording.time, predicted.time)] = values[:, column]
                channels[name] = np.where(np.isnan(manoeuvre.recording.channels[name]), np.nan, full)
        channels |= _torques(posterior, index, predicted, rng)
        recordings.append(Recording(manoeuvre.recording.name, None, manoeuvre.recording.time, channels))
    return recordings


def simulate_manoeuvre(
    model: Model,
    motion: Motion,
    time: Floats,
    *,
    name: str = "manoeuvre",
    attitude: Floats | None = None,
    argument_of_latitude: float = 0.0,
    rng: np.random.Generator | None = None,
    encoder_sigma: float = 0.0,
) -> Recording:
    """Simulate a planned manoeuvre with the bodies of a model at their prior's centre.

    Parameters
    ----------
    motion : Motion
    time : (T,) array
        Sample times of all sensors and joints [s].
    attitude : (4,) array, optional
        Base to orbit axes at time 0.
    latitude : float
        Argument of latitude at time 0 [rad].
    rng : numpy.random.Generator, optional
        For the noise of sensors and encoders.
    encoder_sigma : float
        Noise of the recorded joint positions [rad or m].
    """
    joints = sample_joints(motion, model.robot, time)
    planned = Recording(name, None, time, {**joints, **blank_channels(model.sensors, len(time), model.torque)})
    start = np.array([0.0, 0.0, 0.0, 1.0]) if attitude is None else np.asarray(attitude, dtype=float)
    posterior = Posterior(model, [Manoeuvre(planned, motion, start, argument_of_latitude=argument_of_latitude)])
    recording = simulate_recordings(posterior, rng, np.zeros(posterior.size))[0]
    if rng is None or encoder_sigma == 0.0:
        return recording
    noisy = {key: recording.channels[key] + encoder_sigma * rng.normal(size=len(time)) for key in joints}
    return Recording(name, None, time, {**recording.channels, **noisy})


def blank_channels(sensors: Sequence[Sensor], count: int, torque: TorqueSensor | None = None) -> dict[str, Floats]:
    """Return channels of sensors at rest, to be simulated: a posterior wants every sensor to have samples."""
    joints = () if torque is None else torque.joints
    return {
        f"{sensor.kind.value}.{axis}": np.full(count, 1.0 if axis == "w" else 0.0)
        for sensor in sensors
        for axis in ("xyzw" if sensor.kind is Kind.ATTITUDE else "xyz")
    } | {f"torque.{joint}": np.zeros(count) for joint in joints}


def _torques(
    posterior: Posterior, index: int, predicted: Predictions, rng: np.random.Generator | None
) -> dict[str, Floats]:
    """Simulate the joint torques of one recording, at the times of its samples."""
    sensor, time = posterior.model.torque, posterior.manoeuvres[index].recording.time
    if sensor is None:
        return {}
    sampled, _ = posterior.torques(index)
    values = predicted.torque[np.searchsorted(predicted.time, sampled)]
    if rng is not None:
        values = values + np.array(sensor.sigma) * rng.normal(size=values.shape)
    full = np.full((len(time), len(sensor.joints)), np.nan)
    full[np.searchsorted(time, sampled)] = values
    return {f"torque.{joint}": full[:, column] for column, joint in enumerate(sensor.joints)}


def _noisy(values: Floats, kind: Kind, sigma: Floats, rng: np.random.Generator) -> Floats:
    noise = sigma * rng.normal(size=(len(values), 3))
    if kind is not Kind.ATTITUDE:
        return values + noise
    w = values[:, 3]  # a small rotation in base axes, after the attitude
    half = 0.5 * noise
    vector = values[:, 3:] * half + np.cross(values[:, :3], half)
    turned = np.column_stack([values[:, :3] + vector, w - np.einsum("ij,ij->i", values[:, :3], half)])
    return turned / np.linalg.norm(turned, axis=1, keepdims=True)
