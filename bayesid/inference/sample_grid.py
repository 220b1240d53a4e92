"""The samples of one recording's sensors on one time grid, and the second moments of their errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.inference import whitening
from bayesid.inference.encoder_noise import joint_sensitivity
from bayesid.inference.whitening import NoiseChannel, NoiseModel
from bayesid.recording.joint_motion import MeasuredMotion, Motion
from bayesid.recording.recording import Recording
from bayesid.robot.robot import Robot
from bayesid.simulation.effects.joint_friction import STANDSTILL, JointFriction
from bayesid.simulation.joint_torques import TorqueSensor
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Filter, Kind, Sensor

__all__ = ["Samples"]

FEWEST = 4
"""Samples a sensor must have in a recording."""


class Samples:
    """Sensor samples of one recording on one time grid: every time at which some sensor was sampled.

    Parameters
    ----------
    model : Model
    manoeuvre : Manoeuvre

    Raises
    ------
    InputError
        Where a declared sensor was not recorded or hardly.
    """

    def __init__(self, model: Model, manoeuvre: Manoeuvre) -> None:
        recording = manoeuvre.recording
        self.motion = manoeuvre.motion
        self.sensors = model.sensors
        self.series = {}
        for sensor in model.sensors:
            axes = ("x", "y", "z", "w") if sensor.kind is Kind.ATTITUDE else ("x", "y", "z")
            self.series[sensor.kind] = _series(recording, sensor.kind.value, axes)
        self.torque: tuple[Floats, Floats] = (np.zeros(0), np.zeros((0, 0)))
        if model.torque is not None:
            self.torque = _series(recording, "torque", model.torque.joints)
        self.torque_sigma: tuple[float, ...] = () if model.torque is None else model.torque.sigma
        self.time = np.unique(np.concatenate([*(time for time, _ in self.series.values()), self.torque[0]]))
        self.rows = {kind: np.searchsorted(self.time, time) for kind, (time, _) in self.series.items()}
        rows, base = np.searchsorted(self.time, self.torque[0]), 3 * len(self.sensors)
        self.measured = np.zeros((len(self.time), base + len(self.torque_sigma)))
        self.measured[rows, base:] = self.torque[1]
        self.torque_rows = [rows[moving] for moving in _moving(model, self.motion, self.torque[0])]
        self.quaternion = np.tile([0.0, 0.0, 0.0, 1.0], (len(self.time), 1))
        for slot, sensor in enumerate(self.sensors):
            values = self.series[sensor.kind][1]
            if sensor.kind is Kind.ATTITUDE:
                self.quaternion[self.rows[sensor.kind]] = values
            else:
                self.measured[self.rows[sensor.kind], 3 * slot : 3 * slot + 3] = values

    def with_sensors(self, sensors: Sequence[Sensor], torque: TorqueSensor | None) -> Samples:
        """Return the samples of the same sensors with other noise."""
        new = object.__new__(Samples)
        new.__dict__.update(self.__dict__)
        new.sensors, new.torque_sigma = tuple(sensors), () if torque is None else torque.sigma
        return new

    @property
    def first_rate(self) -> Floats:
        """Rate at the start in base axes, from the first samples."""
        for sensor in self.sensors:
            if sensor.kind is Kind.RATE:
                return sensor.rotation @ self.series[sensor.kind][1][:3].mean(axis=0)
        return np.zeros(3)

    def interval(self, kind: Kind) -> float:
        """Median sampling interval of a sensor [s]."""
        return float(np.median(np.diff(self.series[kind][0])))

    def sigma(self, sensor: Sensor) -> Floats:
        """Noise per axis, shape (3,)."""
        return sensor.noise.sigma(self.interval(sensor.kind))

    def noise_model(self, model: Model, robot: Robot, rate: Floats) -> NoiseModel:
        """Return the second moments of the errors, the encoder noise seen through ``robot`` turning at ``rate``."""
        channels = [
            NoiseChannel(float(value), self.rows[sensor.kind], sensor.filter, coloured)
            for sensor in self.sensors
            for value, coloured in zip(self.sigma(sensor), _coloured(sensor), strict=True)
        ]
        channels += [
            NoiseChannel(sigma, rows, Filter()) for sigma, rows in zip(self.torque_sigma, self.torque_rows, strict=True)
        ]
        if not isinstance(self.motion, MeasuredMotion) or not robot.joints:
            empty = np.zeros((0, 3, len(self.time), len(channels)))
            return NoiseModel(self.time, channels, empty, np.zeros((0, 1, len(self.time), 3, 3)))
        torques = () if model.torque is None else model.torque.columns(robot)
        response = joint_sensitivity(robot, self.motion.evaluate(self.time), rate, model.point, torques)
        sensitivity = np.zeros((len(robot.joints), 3, len(self.time), len(channels)))
        for slot, sensor in enumerate(self.sensors):
            turn = np.eye(3) if sensor.kind is Kind.ATTITUDE else sensor.rotation
            sensitivity[..., 3 * slot : 3 * slot + 3] = getattr(response, sensor.kind.value) @ turn
        sensitivity[..., 3 * len(self.sensors) :] = response.torque
        covariance = self.motion.lag_covariance(self.time, min(max(whitening.WINDOWS), len(self.time) - 1))
        return NoiseModel(self.time, channels, sensitivity, covariance)


def _coloured(sensor: Sensor) -> list[tuple[float, float]]:
    noise = sensor.coloured
    return [(0.0, 1.0)] * 3 if noise is None else [(level, noise.time) for level in noise.sigma]


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


def _series(recording: Recording, family: str, axes: Sequence[str]) -> tuple[Floats, Floats]:
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
