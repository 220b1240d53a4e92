"""Data of a likelihood: the samples of all recordings, their time grids and the whitening of their noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats, Integers
from bayesid._math.on_device import on_device
from bayesid.inference import whitening
from bayesid.inference.compiled import Arrays
from bayesid.inference.encoder_noise import SampledMotion, joint_sensitivity
from bayesid.inference.whitening import NoiseChannel, SampleNoise, Whitening
from bayesid.recording.actions import Actions
from bayesid.recording.joint_motion import MeasuredMotion, Motion
from bayesid.recording.recording import Recording
from bayesid.recording.wheel_motion import WheelMotion, check_wheels
from bayesid.robot.robot import Robot
from bayesid.simulation.dynamics import Grid
from bayesid.simulation.effects.joint_friction import STANDSTILL, JointFriction
from bayesid.simulation.instant import Readings
from bayesid.simulation.joint_torques import TorqueSensor
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Filter, Sensor, SensorKind
from bayesid.simulation.time_grid import build_grid, lengthened, pad_grids, rounded

__all__ = ["Data", "RecordedSamples", "Series", "attitudes_of", "first_rate", "grids_of", "stacked", "with_whitenings"]


@dataclass(frozen=True)
class Data:
    """Samples of R recordings with the noise that is assumed for them; immutable.

    Parameters
    ----------
    model : Model
        Model whose sensors made the recordings.
    manoeuvres : (R,) tuple of Manoeuvre
        Recorded manoeuvres.
    recorded : (R,) tuple of RecordedSamples
        Samples of each recording.
    whitenings : (R,) tuple of Whitening
        Whitening of each recording.
    left_out : (R,) tuple of (O, C) arrays of bool
        Masks of the whitened scalars that the likelihood leaves out.
    step : float
        Longest integration step [s].
    arrays : Arrays
        The same data in the form that compiled code takes.
    """

    model: Model
    manoeuvres: tuple[Manoeuvre, ...]
    recorded: tuple[RecordedSamples, ...]
    whitenings: tuple[Whitening, ...]
    left_out: tuple[NDArray[np.bool_], ...]
    step: float
    arrays: Arrays

    @property
    def samples(self) -> int:
        """Number of scalar samples that the likelihood uses."""
        return sum(of_recording.samples for of_recording in self.whitenings)

    @property
    def residual_shape(self) -> tuple[int, int, int]:
        """Shape (R, O, C) of the whitened residual."""
        return (len(self.manoeuvres), self.arrays.start.shape[1], self.arrays.weights.shape[2])

    def times(self, index: int) -> Floats:
        """Return the times at which any sensor of a recording was sampled, shape (T,) [s]."""
        return self.recorded[index].time

    def measured(self, index: int, kind: SensorKind) -> Series:
        """Return the recorded times and values of one sensor in one recording.

        Parameters
        ----------
        index : int
            Number of the recording.
        kind : SensorKind
        """
        return self.recorded[index].series[kind]

    def torques(self, index: int) -> Series:
        """Return the recorded times (n,) and joint torques (n, joints) of one recording."""
        return self.recorded[index].torque

    def sigma(self, index: int, kind: SensorKind) -> Floats:
        """Return the standard deviations of the white noise of one sensor in one recording, shape (size,).

        Parameters
        ----------
        index : int
            Number of the recording.
        kind : SensorKind
        """
        return self.recorded[index].sigma(kind)

    def left_out_times(self, index: int) -> dict[SensorKind, Floats]:
        """Return, for each sensor, the times of the samples that the likelihood leaves out of one recording [s]."""
        mask, rows = self.left_out[index], self.whitenings[index].rows
        result = {}
        for kind in self.model.channels.kinds:
            gone = mask[:, self.model.channels.of(kind)].any(axis=1)
            if gone.any():
                result[kind] = self.recorded[index].time[rows[gone]]
        return result


def grids_of(
    model: Model, manoeuvres: Sequence[Manoeuvre], recorded: Sequence[RecordedSamples], step: float
) -> list[Grid]:
    """Return the grid of integration nodes and samples of every recording, for an integration step [s].

    Parameters
    ----------
    model : Model
    manoeuvres : sequence of Manoeuvre
    recorded : (R,) sequence of RecordedSamples
    step : float
        Integration step [s].
    """
    grids = []
    for index, (manoeuvre, samples) in enumerate(zip(manoeuvres, recorded, strict=True)):
        effects = [effect.in_recording(index) for effect in model.effects]
        grids.append(
            build_grid(
                model.robot,
                tuple(prior.name for prior in model.priors),
                manoeuvre.motion,
                samples.time,
                step,
                orbit=model.orbit,
                argument_of_latitude=manoeuvre.argument_of_latitude,
                actions=Actions.from_recording(manoeuvre.recording, model.robot.wheels),
                effects=effects,
                torques=model.torque is not None,
                speed_errors=model.has_speed_errors,
                jumps=[instant for effect in effects for instant in effect.jumps(float(samples.time[-1]))],
            )
        )
    return grids


def attitudes_of(manoeuvres: Sequence[Manoeuvre]) -> Floats:
    """Return the attitudes of the base at time 0 as quaternions x, y, z, w, shape (R, 4)."""
    return np.stack([np.asarray(manoeuvre.attitude, dtype=float) for manoeuvre in manoeuvres])


def stacked(
    model: Model,
    manoeuvres: Sequence[Manoeuvre],
    recorded: Sequence[RecordedSamples],
    grids: Sequence[Grid],
    whitenings: Sequence[Whitening],
) -> Arrays:
    """Stack all recordings, padded coarsely so that recordings of about the same length share compiled code.

    Parameters
    ----------
    model : Model
    manoeuvres : sequence of Manoeuvre
    recorded : (R,) sequence of RecordedSamples
    grids : (R,) sequence of Grid
    whitenings : (R,) sequence of Whitening
    """
    steps, samples = max(len(grid.step) for grid in grids), max(len(grid.step_of) for grid in grids)
    grid = pad_grids(grids, rounded(steps), rounded(samples))
    count = grid.step_of.shape[1]

    def padded(values: Sequence[Floats]) -> jnp.ndarray:
        return on_device(np.stack([lengthened(series, count) for series in values]))

    measured = Readings(
        padded([recording.time for recording in recorded]),
        {kind.value: padded([recording.gridded(kind) for recording in recorded]) for kind in model.channels.kinds},
        padded([recording.gridded_torque for recording in recorded]),
    )
    offset = on_device(np.zeros((len(recorded), count, model.channels.count)))
    none = on_device(np.zeros(0))
    return with_whitenings(Arrays(grid, on_device(attitudes_of(manoeuvres)), measured, offset, none, none), whitenings)


def with_whitenings(arrays: Arrays, whitenings: Sequence[Whitening]) -> Arrays:
    """Return the arrays with another whitening.

    Parameters
    ----------
    arrays : Arrays
    whitenings : (R,) sequence of Whitening
    """
    outputs = rounded(max(len(of_recording.start) for of_recording in whitenings))
    width = max(of_recording.weights.shape[2] for of_recording in whitenings)
    channels = whitenings[0].weights.shape[1]
    weights = np.zeros((len(whitenings), outputs, channels, width, channels))
    start = np.zeros((len(whitenings), outputs), dtype=np.int32)
    for row, of_recording in enumerate(whitenings):
        weights[row, : len(of_recording.start), :, : of_recording.weights.shape[2]] = of_recording.weights
        start[row, : len(of_recording.start)] = of_recording.start
    return arrays._replace(weights=on_device(weights), start=on_device(start))


FEWEST = 4
"""Smallest number of samples that a declared sensor must have in a recording."""

Series = tuple[Floats, Floats]
"""Times (n,) and values (n, axes) of one sensor."""


@dataclass(frozen=True)
class RecordedSamples:
    """Sensor samples of one recording on one grid of all times at which any sensor was sampled.

    Parameters
    ----------
    motion : Motion
        Motion of the joints.
    sensors : tuple of Sensor
    torque_sensor : TorqueSensor or None
    time : (T,) array
        Times of the grid [s].
    series : mapping of SensorKind to Series
        Recorded times and readings of each sensor.
    torque : Series
        Recorded times and torques of the joints that have a torque sensor.
    torque_rows : tuple of integer arrays
        Rows of the grid whose torque is used, for each of those joints; a joint with dry friction is left out while it
        stands still, when its friction is undetermined.
    wheels : WheelMotion
        Motion of the wheels.
    """

    motion: Motion
    sensors: tuple[Sensor, ...]
    torque_sensor: TorqueSensor | None
    time: Floats
    series: Mapping[SensorKind, Series]
    torque: Series
    torque_rows: tuple[Integers, ...]
    wheels: WheelMotion

    @classmethod
    def of(cls, model: Model, manoeuvre: Manoeuvre) -> RecordedSamples:
        """Return the samples of the sensors of a model in one recording.

        Parameters
        ----------
        model : Model
        manoeuvre : Manoeuvre

        Raises
        ------
        InputError
            If the recording lacks a declared sensor, has too few samples of it, or ends earlier for a joint.
        """
        recording = manoeuvre.recording
        check_wheels(recording, model.robot.wheels)
        series = {sensor.kind: _series(recording, sensor.kind.value, sensor.kind.axes) for sensor in model.sensors}
        torque: Series = (np.zeros(0), np.zeros((0, 0)))
        if model.torque is not None:
            torque = _series(recording, "torque", model.torque.joints)
        time = np.unique(np.concatenate([*(times for times, _ in series.values()), torque[0]]))
        if isinstance(manoeuvre.motion, MeasuredMotion):
            manoeuvre.motion.check_extent(float(time[-1]), recording.file or recording.name)
        rows = np.searchsorted(time, torque[0])
        used = tuple(rows[moving] for moving in _moving(model, manoeuvre.motion, torque[0]))
        wheels = WheelMotion.from_recording(recording, model.robot.wheels)
        return cls(manoeuvre.motion, model.sensors, model.torque, time, series, torque, used, wheels)

    def with_sensors(self, sensors: Sequence[Sensor], torque: TorqueSensor | None) -> RecordedSamples:
        """Return the same samples with other noise of the sensors.

        Parameters
        ----------
        sensors : sequence of Sensor
        torque : TorqueSensor or None
        """
        return replace(self, sensors=tuple(sensors), torque_sensor=torque)

    def rows(self, kind: SensorKind) -> Integers:
        """Return the rows of the grid at which a sensor was sampled."""
        return np.searchsorted(self.time, self.series[kind][0])

    def gridded(self, kind: SensorKind) -> Floats:
        """Return the readings of a sensor on the grid, (T, axes), with its reading at rest where it was not sampled."""
        values = np.tile(np.array(kind.rest), (len(self.time), 1))
        values[self.rows(kind)] = self.series[kind][1]
        return values

    @property
    def gridded_torque(self) -> Floats:
        """Torques on the grid, shape (T, n), zero where they were not sampled."""
        values = np.zeros((len(self.time), self.torque[1].shape[1]))
        values[np.searchsorted(self.time, self.torque[0])] = self.torque[1]
        return values

    @property
    def first_rate(self) -> Floats:
        """Rate of the base at the start from the first samples, base axes [rad/s]; zero if no rate is measured."""
        for sensor in self.sensors:
            if sensor.kind == SensorKind.RATE:
                return first_rate(sensor, self.series[SensorKind.RATE][1])
        return np.zeros(3)

    def sigma(self, kind: SensorKind) -> Floats:
        """Return the standard deviations of the white noise of a sensor, shape (size,)."""
        sensor = next(sensor for sensor in self.sensors if sensor.kind == kind)
        return sensor.noise.sigma(float(np.median(np.diff(self.series[kind][0]))))

    def noise_model(self, robot: Robot, seen: SampledMotion) -> SampleNoise:
        """Return the second moments of the errors.

        Parameters
        ----------
        robot : Robot
            Robot whose dynamics carries the encoders' noise to the sensors.
        seen : SampledMotion
            Motion of the base on the grid.
        """
        torque_sigma = () if self.torque_sensor is None else self.torque_sensor.sigma
        channels = [
            NoiseChannel(float(value), self.rows(sensor.kind), sensor.filter, coloured)
            for sensor in self.sensors
            for value, coloured in zip(self.sigma(sensor.kind), _coloured(sensor), strict=True)
        ]
        channels += [
            NoiseChannel(sigma, rows, Filter()) for sigma, rows in zip(torque_sigma, self.torque_rows, strict=True)
        ]
        measured = isinstance(self.motion, MeasuredMotion) and bool(robot.joints)
        if not measured and not robot.wheels:
            empty = np.zeros((0, 3, len(self.time), len(channels)))
            return SampleNoise(self.time, channels, empty, np.zeros((0, 1, len(self.time), 3, 3)))
        torques = () if self.torque_sensor is None else self.torque_sensor.columns(robot)
        sensitivity = joint_sensitivity(robot, self.motion.evaluate(self.time), seen, self.sensors, torques)
        lags = min(max(whitening.WINDOWS), len(self.time) - 1)
        covariance = self.wheels.lag_covariance(self.time, lags)
        if isinstance(self.motion, MeasuredMotion):
            covariance = np.concatenate([self.motion.lag_covariance(self.time, lags), covariance])
        return SampleNoise(self.time, channels, sensitivity[-len(covariance) :], covariance)


def first_rate(sensor: Sensor, values: Floats) -> Floats:
    """Return the mean of the first three samples (n, 3) of a rate sensor, base axes, as the rate at the start.

    Parameters
    ----------
    sensor : Sensor
    values : (n, 3) array
        Its readings [rad/s].
    """
    return np.asarray(sensor.rotation @ values[:3].mean(axis=0))


def _coloured(sensor: Sensor) -> list[tuple[float, float]]:
    noise = sensor.coloured
    return [(0.0, 1.0)] * sensor.kind.size if noise is None else [(level, noise.time) for level in noise.sigma]


def _moving(model: Model, motion: Motion, time: Floats) -> list[NDArray[np.bool_]]:
    """Return a mask of the samples of each torque sensor that are used, which leaves out dry friction at standstill."""
    if model.torque is None:
        return []
    state = motion.evaluate(time)
    rubbing = {effect.place for effect in model.effects if isinstance(effect, JointFriction)}
    speed = np.abs(state.velocity[:, model.torque.columns(model.robot)])
    return [
        speed[:, column] > (STANDSTILL if joint in rubbing else -1.0)
        for column, joint in enumerate(model.torque.joints)
    ]


def _series(recording: Recording, family: str, axes: Sequence[str]) -> Series:
    """Return the samples of a declared sensor, and raise an error if columns or samples are missing."""
    if absent := [axis for axis in axes if f"{family}.{axis}" not in recording.channels]:
        raise InputError(
            f"no column {family}.{'|'.join(absent)}, but the study declares the sensor",
            file=recording.file or recording.name,
            remedy="Record the sensor or take it out of [sensors]",
        )
    time, values = recording.vector(family, tuple(axes))
    if len(time) < FEWEST:
        raise InputError(
            f"only {len(time)} samples of {family}",
            file=recording.file or recording.name,
            remedy=f"Record at least {FEWEST}, or take the sensor out of [sensors]",
        )
    return time, values
