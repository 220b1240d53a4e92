"""The samples of one recording's sensors on one time grid, and the second moments of their errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats, Integers
from bayesid.inference import whitening
from bayesid.inference.encoder_noise import SampledMotion, joint_sensitivity
from bayesid.inference.whitening import NoiseChannel, NoiseModel
from bayesid.recording.joint_motion import MeasuredMotion, Motion
from bayesid.recording.recording import Recording
from bayesid.robot.robot import Robot
from bayesid.simulation.effects.joint_friction import STANDSTILL, JointFriction
from bayesid.simulation.joint_torques import TorqueSensor
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Filter, Kind, Sensor

__all__ = ["RecordedSamples", "Series", "first_rate"]

FEWEST = 4
"""Samples a sensor must have in a recording."""

Series = tuple[Floats, Floats]
"""Times (n,) and values (n, axes) of one sensor."""


@dataclass(frozen=True)
class RecordedSamples:
    """Sensor samples of one recording on one time grid: every time at which some sensor was sampled.

    Parameters
    ----------
    motion : Motion
        Of the joints.
    sensors : tuple of Sensor
    torque_sensor : TorqueSensor or None
    time : (T,) array
        The grid [s].
    series : mapping of Kind to Series
        What each sensor read, as recorded.
    torque : Series
        Torques of the joints that are measured.
    torque_rows : tuple of integer arrays
        For each of those joints, the rows of the grid whose torque is used: dry friction at rest can be anything.
    """

    motion: Motion
    sensors: tuple[Sensor, ...]
    torque_sensor: TorqueSensor | None
    time: Floats
    series: Mapping[Kind, Series]
    torque: Series
    torque_rows: tuple[Integers, ...]

    @classmethod
    def of(cls, model: Model, manoeuvre: Manoeuvre) -> RecordedSamples:
        """Collect what the sensors of a model recorded.

        Raises
        ------
        InputError
            Where a declared sensor was not recorded or hardly.
        """
        recording = manoeuvre.recording
        series = {sensor.kind: _series(recording, sensor.kind.value, sensor.kind.axes) for sensor in model.sensors}
        torque: Series = (np.zeros(0), np.zeros((0, 0)))
        if model.torque is not None:
            torque = _series(recording, "torque", model.torque.joints)
        time = np.unique(np.concatenate([*(times for times, _ in series.values()), torque[0]]))
        rows = np.searchsorted(time, torque[0])
        used = tuple(rows[moving] for moving in _moving(model, manoeuvre.motion, torque[0]))
        return cls(manoeuvre.motion, model.sensors, model.torque, time, series, torque, used)

    def with_sensors(self, sensors: Sequence[Sensor], torque: TorqueSensor | None) -> RecordedSamples:
        """Return the samples of the same sensors with other noise."""
        return replace(self, sensors=tuple(sensors), torque_sensor=torque)

    def rows(self, kind: Kind) -> Integers:
        """Return the rows of the grid at which a sensor was sampled."""
        return np.searchsorted(self.time, self.series[kind][0])

    def gridded(self, kind: Kind) -> Floats:
        """Return what a sensor read on the grid, (T, axes); where it was not sampled, its reading at rest."""
        values = np.tile(np.array(kind.rest), (len(self.time), 1))
        values[self.rows(kind)] = self.series[kind][1]
        return values

    @property
    def gridded_torque(self) -> Floats:
        """Torques on the grid, (T, n); zero where not sampled."""
        values = np.zeros((len(self.time), self.torque[1].shape[1]))
        values[np.searchsorted(self.time, self.torque[0])] = self.torque[1]
        return values

    @property
    def first_rate(self) -> Floats:
        """Rate at the start, base axes, from the first samples; zero where no rate is measured."""
        for sensor in self.sensors:
            if sensor.kind == Kind.RATE:
                return first_rate(sensor, self.series[Kind.RATE][1])
        return np.zeros(3)

    def sigma(self, kind: Kind) -> Floats:
        """Return the white noise per component of a sensor, shape (size,)."""
        sensor = next(sensor for sensor in self.sensors if sensor.kind == kind)
        return sensor.noise.sigma(float(np.median(np.diff(self.series[kind][0]))))

    def noise_model(self, robot: Robot, seen: SampledMotion) -> NoiseModel:
        """Return the second moments of the errors.

        Parameters
        ----------
        robot : Robot
            Through which the encoders' noise is seen.
        seen : SampledMotion
            The base's motion on the grid.
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
        if not isinstance(self.motion, MeasuredMotion) or not robot.joints:
            empty = np.zeros((0, 3, len(self.time), len(channels)))
            return NoiseModel(self.time, channels, empty, np.zeros((0, 1, len(self.time), 3, 3)))
        torques = () if self.torque_sensor is None else self.torque_sensor.columns(robot)
        sensitivity = joint_sensitivity(robot, self.motion.evaluate(self.time), seen, self.sensors, torques)
        covariance = self.motion.lag_covariance(self.time, min(max(whitening.WINDOWS), len(self.time) - 1))
        return NoiseModel(self.time, channels, sensitivity, covariance)


def first_rate(sensor: Sensor, values: Floats) -> Floats:
    """Return the rate at the start, base axes, as the mean of a rate sensor's first three samples of (n, 3) values."""
    return np.asarray(sensor.rotation @ values[:3].mean(axis=0))


def _coloured(sensor: Sensor) -> list[tuple[float, float]]:
    noise = sensor.coloured
    return [(0.0, 1.0)] * sensor.kind.size if noise is None else [(level, noise.time) for level in noise.sigma]


def _moving(model: Model, motion: Motion, time: Floats) -> list[NDArray[np.bool_]]:
    """For each torque sensor, which of its samples dry friction leaves of use."""
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
    """Read a declared sensor, or say what is missing."""
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
