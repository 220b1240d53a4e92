"""Readings that a posterior predicts: bare, with noise as a recording, and beside the measured ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from bayesid._math.arrays import Floats
from bayesid._math.on_device import on_device
from bayesid.inference import compiled
from bayesid.inference.compiled import Simulated
from bayesid.inference.data import grids_of
from bayesid.inference.integration_step import integration_error, simulate_padded
from bayesid.inference.posterior import Posterior
from bayesid.recording.joint_motion import Motion, sample_joints
from bayesid.recording.recording import Recording
from bayesid.recording.wheel_motion import WheelMotion
from bayesid.simulation.joint_torques import TorqueSensor
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Coloured, Sensor, SensorKind

__all__ = [
    "PredictedReadings",
    "SensorFit",
    "TorqueFit",
    "WhitenedFit",
    "blank_channels",
    "integration_error_at",
    "noise_of",
    "noisy",
    "predicted_readings",
    "readings_at_start",
    "sensor_fits",
    "simulate_manoeuvre",
    "simulate_recordings",
    "torque_fits",
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
    """Return the readings of each recording that are predicted at the coordinates ``z`` (size,).

    Parameters
    ----------
    posterior : Posterior
    z : (size,) array
        Coordinates.
    """
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
        count = len(samples.nodes)
        predicted = {kind: samples.averaged(each[index, :count], kind.value, kind) for kind, each in channels.items()}
        torques = samples.averaged(torque[index, :count], None if model.torque is None else "torque")
        result.append(PredictedReadings(samples.time, predicted, torques))
    return result


def noisy(
    posterior: Posterior, index: int, predicted: PredictedReadings, rng: np.random.Generator
) -> PredictedReadings:
    """Return the predicted readings of one recording with fresh white and coloured noise of the sensors.

    The error of a prediction that is due to the encoders' noise is left out.

    Parameters
    ----------
    posterior : Posterior
    index : int
        Number of the recording.
    predicted : PredictedReadings
    rng : numpy.random.Generator
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
    """Draw a sensor's noise at times (T,), white of ``sigma`` (size,) and coloured where declared; shape (T, size).

    Parameters
    ----------
    sensor : Sensor
    time : (T,) array
        Times [s].
    sigma : (size,) array
        Of the white noise, in the sensor's unit.
    rng : numpy.random.Generator
    """
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
    """Return the largest error of any sample due to the integration step at ``z``, in its standard deviations.

    Parameters
    ----------
    posterior : Posterior
    z : (size,) array
        Coordinates.
    """
    data = posterior.data
    return integration_error(
        data.model, data.manoeuvres, data.recorded, posterior.structure, posterior.numbers, z, data.step
    )


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
    z = posterior.starting_point() if z is None else z
    if any(samples.reduced for samples in posterior.data.recorded):
        whole = [replace(manoeuvre, blocks_per_second=0.0) for manoeuvre in posterior.manoeuvres]
        unreduced = Posterior.of(posterior.model, whole, step=posterior.step, window=0)
        posterior = replace(unreduced, unknowns=posterior.unknowns)
    predictions = predicted_readings(posterior, z)
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
    wheels: WheelMotion | None = None,
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
    wheels : WheelMotion, optional
        Motion of the wheels, by default at rest.
    """
    joints, spun = sample_joints(motion, model.robot, time), wheels or WheelMotion.planned(model.robot.wheels)
    channels = {**joints, **spun.speed_channels(time), **blank_channels(model.sensors, len(time), model.torque)}
    planned = Recording(name, None, time, channels)
    start = np.array([0.0, 0.0, 0.0, 1.0]) if attitude is None else np.asarray(attitude, dtype=float)
    posterior = Posterior.of(model, [Manoeuvre(planned, motion, start, argument_of_latitude=argument_of_latitude)])
    recording = simulate_recordings(posterior, rng, np.zeros(posterior.size))[0]
    if rng is None or encoder_sigma == 0.0:
        return recording
    noisy = {key: recording.channels[key] + encoder_sigma * rng.normal(size=len(time)) for key in joints}
    return Recording(name, None, time, {**recording.channels, **noisy})


def blank_channels(sensors: Sequence[Sensor], count: int, torque: TorqueSensor | None = None) -> dict[str, Floats]:
    """Return channels of the sensors at rest, which stand in a recording that is to be simulated.

    Parameters
    ----------
    sensors : sequence of Sensor
    count : int
        Number of samples.
    torque : TorqueSensor, optional
    """
    joints = () if torque is None else torque.joints
    return {
        name: np.full(count, value)
        for sensor in sensors
        for name, value in zip(sensor.kind.columns, sensor.kind.rest, strict=True)
    } | {f"torque.{joint}": np.zeros(count) for joint in joints}


class WhitenedFit:
    """What whitened residuals say, NaN where there is no sample."""

    residual: Floats

    @property
    def chi2(self) -> float:
        """Sum of squares of the whitened residuals."""
        return float(np.nansum(self.residual**2))

    @property
    def samples(self) -> int:
        """Number of scalar residuals."""
        return int(np.isfinite(self.residual).sum())

    @property
    def chi2_per_sample(self) -> float:
        """Mean square of the residuals, one if only noise is left."""
        return self.chi2 / max(self.samples, 1)

    @property
    def chi2_sd(self) -> float:
        """Standard deviation that noise alone gives to chi-square per sample."""
        return float(np.sqrt(2.0 / max(self.samples, 1)))

    @property
    def largest_residual(self) -> float:
        """Largest size of a residual, zero without samples."""
        return float(np.nanmax(np.abs(self.residual), initial=0.0))

    def misfit_dict(self) -> dict[str, Any]:
        """Return the misfit in the form that it has in JSON."""
        return {
            "samples": self.samples,
            "chi2_per_sample": self.chi2_per_sample,
            "expected_sd": self.chi2_sd,
            "largest_residual": self.largest_residual,
        }


@dataclass(frozen=True)
class SensorFit(WhitenedFit):
    """Readings of one sensor in one recording, measured and predicted.

    Attributes
    ----------
    time, measured, predicted : (n,), (n, k), (n, k) array
        Times [s] and readings as they are drawn (`SensorKind.shown`), in sensor axes. An attitude is the rotation
        vector from the first sample, in base axes.
    residual_time, residual : (m,), (m, k) array
        Times [s] and whitened residuals, which are independent and of unit variance if the model is right; NaN where
        an axis has no sample.
    """

    kind: SensorKind
    time: Floats
    measured: Floats
    predicted: Floats
    residual_time: Floats
    residual: Floats


def sensor_fits(posterior: Posterior, z: Floats) -> list[list[SensorFit]]:
    """Return measured and predicted readings at coordinates ``z`` (n,): a list per recording, an entry per sensor.

    Parameters
    ----------
    posterior : Posterior
    z : (size,) array
        Coordinates.
    """
    predictions, residuals = predicted_readings(posterior, z), posterior.residuals(z)
    result = []
    for index, (predicted, whitening) in enumerate(zip(predictions, posterior.whitenings, strict=True)):
        grid = posterior.data.times(index)
        whitened = np.where(whitening.outputs, residuals[index, : len(whitening.rows)], np.nan)
        fits = []
        for sensor in posterior.model.sensors:
            time, measured = posterior.data.measured(index, sensor.kind)
            simulated = predicted.channels[sensor.kind][np.searchsorted(grid, time)]
            measured, simulated = (sensor.kind.shown(values, measured[0]) for values in (measured, simulated))
            residual = whitened[:, posterior.model.channels.of(sensor.kind)]
            kept = np.isfinite(residual).any(axis=1)
            fits.append(SensorFit(sensor.kind, time, measured, simulated, grid[whitening.rows][kept], residual[kept]))
        result.append(fits)
    return result


@dataclass(frozen=True)
class TorqueFit(WhitenedFit):
    """Torque of one joint in one recording, measured and predicted.

    Attributes
    ----------
    joint, unit : str
    time, measured, predicted : (n,) array
        Times [s] and torques [N m], or forces [N] of a prismatic joint.
    residual_time, residual : (m,) array
        Times [s] and whitened residuals of the samples that the likelihood uses.
    """

    joint: str
    unit: str
    time: Floats
    measured: Floats
    predicted: Floats
    residual_time: Floats
    residual: Floats


def torque_fits(posterior: Posterior, z: Floats) -> list[list[TorqueFit]]:
    """Return measured and predicted torques at the coordinates ``z`` (n,): a list per recording, an entry per joint.

    Parameters
    ----------
    posterior : Posterior
    z : (size,) array
        Coordinates.
    """
    sensor, robot = posterior.model.torque, posterior.model.robot
    if sensor is None:
        return [[] for _ in posterior.manoeuvres]
    predictions, residuals = predicted_readings(posterior, z), posterior.residuals(z)
    first, result = posterior.model.channels.torques.start, []
    for index, (predicted, whitening) in enumerate(zip(predictions, posterior.whitenings, strict=True)):
        time, measured = posterior.data.torques(index)
        grid = posterior.data.times(index)
        simulated = predicted.torque[np.searchsorted(grid, time)]
        fits = []
        for column, joint in enumerate(sensor.joints):
            used = whitening.outputs[:, first + column]
            residual = residuals[index, : len(used), first + column][used]
            unit = "N" if robot.joints[robot.joint_index(joint)].kind == "prismatic" else "N m"
            rows = grid[whitening.rows][used]
            fits.append(TorqueFit(joint, unit, time, measured[:, column], simulated[:, column], rows, residual))
        result.append(fits)
    return result
