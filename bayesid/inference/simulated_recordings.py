"""Simulated recordings: readings that the sensors of a model would give, with their declared noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import noisy, predicted_readings
from bayesid.recording.joint_motion import Motion, sample_joints
from bayesid.recording.recording import Recording
from bayesid.simulation.joint_torques import TorqueSensor
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Sensor

__all__ = ["blank_channels", "simulate_manoeuvre", "simulate_recordings"]


def simulate_recordings(
    posterior: Posterior, rng: np.random.Generator | None = None, z: Floats | None = None
) -> list[Recording]:
    """Simulate the recordings of a posterior, at the same times.

    Parameters
    ----------
    posterior : Posterior
    rng : numpy.random.Generator, optional
        Source of the sensors' noise; without it there is no noise.
    z : (size,) array, optional
        Coordinates at which the recordings are simulated, by default `Posterior.starting_point`.
    """
    predictions = predicted_readings(posterior, posterior.starting_point() if z is None else z)
    recordings = []
    for index, (manoeuvre, predicted) in enumerate(zip(posterior.manoeuvres, predictions, strict=True)):
        recording = manoeuvre.recording
        read = predicted if rng is None else noisy(posterior, index, predicted, rng)
        rows = np.searchsorted(recording.time, read.time)
        channels = dict(recording.channels)
        columns = {kind.columns: values for kind, values in read.channels.items()}
        if posterior.model.torque is not None:
            columns[tuple(f"torque.{joint}" for joint in posterior.model.torque.joints)] = read.torque
        for names, values in columns.items():
            for name, value in zip(names, values.T, strict=True):
                full = np.full(len(recording.time), np.nan)
                full[rows] = value
                channels[name] = np.where(np.isnan(recording.channels[name]), np.nan, full)
        recordings.append(Recording(recording.name, None, recording.time, channels))
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
    model : Model
    motion : Motion
        Planned motion of the joints.
    time : (T,) array
        Sample times of all sensors and joints [s].
    attitude : (4,) array, optional
        Quaternion x, y, z, w from base to orbit axes at time 0, by default the identity.
    argument_of_latitude : float
        Argument of latitude at time 0 [rad].
    rng : numpy.random.Generator, optional
        Source of the noise of sensors and encoders; without it there is no noise.
    encoder_sigma : float
        Standard deviation of the noise of the recorded joint positions [rad or m].
    """
    joints = sample_joints(motion, model.robot, time)
    planned = Recording(name, None, time, {**joints, **blank_channels(model.sensors, len(time), model.torque)})
    start = np.array([0.0, 0.0, 0.0, 1.0]) if attitude is None else np.asarray(attitude, dtype=float)
    posterior = Posterior.of(model, [Manoeuvre(planned, motion, start, argument_of_latitude=argument_of_latitude)])
    recording = simulate_recordings(posterior, rng, np.zeros(posterior.size))[0]
    if rng is None or encoder_sigma == 0.0:
        return recording
    noisy = {key: recording.channels[key] + encoder_sigma * rng.normal(size=len(time)) for key in joints}
    return Recording(name, None, time, {**recording.channels, **noisy})


def blank_channels(sensors: Sequence[Sensor], count: int, torque: TorqueSensor | None = None) -> dict[str, Floats]:
    """Return channels of the sensors at rest, which stand in a recording that is to be simulated."""
    joints = () if torque is None else torque.joints
    return {
        name: np.full(count, value)
        for sensor in sensors
        for name, value in zip(sensor.kind.columns, sensor.kind.rest, strict=True)
    } | {f"torque.{joint}": np.zeros(count) for joint in joints}
