"""An experiment that could be made: manoeuvres, sensors and what else is known; and what it would tell."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.design.predicted_posterior import planned_posterior, simulated
from bayesid.identifiability.local_knowledge import Knowledge
from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.inference.noise_changes import with_manoeuvres, with_sensors
from bayesid.inference.posterior import Posterior
from bayesid.recording.recording import Recording
from bayesid.simulation.joint_torques import TorqueSensor
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Kind, Noise, Scaled, Sensor, White

__all__ = ["TYPICAL", "Experiment", "InformationPredictor", "blanked", "rescaled", "typical_torque"]

TYPICAL: dict[Kind, Sensor] = {
    Kind.RATE: Sensor(Kind.RATE, White(1e-5)),
    Kind.ACCEL: Sensor(Kind.ACCEL, White(1e-5)),
    Kind.ATTITUDE: Sensor(Kind.ATTITUDE, White(2.4e-5)),
}
"""Sensors that could be added: a gyro of 1e-5 rad/s, 1e-5 m/s2 (1 micro-g) at the base origin, 5 arcsec, per sample."""

TYPICAL_TORQUE = 0.1
"""Noise per sample of torque sensors that could be added to all joints [N m, N]."""

ABSENT, FINEST = 1e6, 0.1
"""Factors on the noise of a sensor that is not there, and of the best that is asked for."""


@dataclass(frozen=True)
class Experiment:
    """What a candidate may change.

    Attributes
    ----------
    manoeuvres : tuple of Manoeuvre
    sensors : tuple of Sensor
        Those that are there.
    torque : TorqueSensor, optional
        Of the joints, if there is one.
    weighed : mapping of str to float
        Relative standard deviation of bodies whose mass is known beyond the prior.
    times : int
        How often every manoeuvre is flown.
    """

    manoeuvres: tuple[Manoeuvre, ...]
    sensors: tuple[Sensor, ...]
    torque: TorqueSensor | None = None
    weighed: tuple[tuple[str, float], ...] = ()
    times: int = 1


class InformationPredictor:
    """Predict what experiments tell about a model at one point.

    All sensors are simulated in all experiments, those that are absent with enormous noise, so that experiments share
    one compiled Jacobian.

    Parameters
    ----------
    model : Model
    manoeuvres : sequence of Manoeuvre
        As flown or planned; sensors that are not recorded are read as often as the first that is.
    z : (N,) array
        Coordinates of the model's posterior.
    step : float
        Of the integration [s].
    """

    def __init__(self, model: Model, manoeuvres: tuple[Manoeuvre, ...], z: Floats, step: float) -> None:
        declared = {sensor.kind for sensor in model.sensors}
        self.z, self.step, self.flown = z, step, Experiment(manoeuvres, model.sensors, model.torque)
        everything = (*model.sensors, *(sensor for kind, sensor in TYPICAL.items() if kind not in declared))
        # the best sensors show most of the encoders' correlated noise and so set the length of the whitening
        self._torque = typical_torque(model) if model.torque is None else model.torque
        finest = None if self._torque is None else rescaled(self._torque, FINEST)
        self.model = replace(model, sensors=tuple(scaled(sensor, FINEST) for sensor in everything), torque=finest)
        self._plain = {sensor.kind: sensor for sensor in everything}

    @cached_property
    def posterior(self) -> Posterior:
        """Of the manoeuvres as flown, read by all sensors at their best."""
        return planned_posterior(self.model, self._read(self.flown.manoeuvres), z=self.z, step=self.step)

    def knowledge(self, experiment: Experiment) -> Knowledge:
        """Return what an experiment would tell."""
        posterior, there = self.posterior, {sensor.kind: sensor for sensor in experiment.sensors}
        if experiment.manoeuvres is not self.flown.manoeuvres:
            blank = with_manoeuvres(self.posterior, self._read(experiment.manoeuvres))
            # what is read changes the Jacobian of attitudes only
            posterior = blank if Kind.ATTITUDE not in there else simulated(blank, self.z)
        sensors = [there.get(kind) or scaled(sensor, ABSENT) for kind, sensor in self._plain.items()]
        torque = experiment.torque
        if torque is None and self._torque is not None:
            torque = rescaled(self._torque, ABSENT)
        posterior = with_sensors(posterior, sensors, self.z, like=self.posterior, torque=torque)
        known = Knowledge.at(posterior, self.z)
        known = _repeated(known, posterior.unknowns.names, experiment.times)
        for body, relative in experiment.weighed:
            mass = known.names.index(f"{body}.{next(iter(BODY_QUANTITIES))}")
            known = known.having(known.slope[mass : mass + 1] / (relative * known.values[mass]))
        return known

    def _read(self, manoeuvres: tuple[Manoeuvre, ...]) -> list[Manoeuvre]:
        return [blanked(manoeuvre, self.model.sensors, self.model.torque) for manoeuvre in manoeuvres]


def blanked(manoeuvre: Manoeuvre, sensors: tuple[Sensor, ...], torque: TorqueSensor | None = None) -> Manoeuvre:
    """Return a manoeuvre with blanks to be simulated for the sensors that its recording lacks."""
    recording = manoeuvre.recording
    present = [sensor.kind for sensor in sensors if has(recording, sensor.kind)]
    when = np.ones(len(recording.time), dtype=bool)
    if present:
        when = np.isfinite(recording.channels[present[0].columns[0]])
    channels = dict(recording.channels)
    for sensor in sensors:
        if sensor.kind not in present:
            for name, value in zip(sensor.kind.columns, sensor.kind.rest, strict=True):
                channels[name] = np.where(when, value, np.nan)
    for joint in () if torque is None else torque.joints:
        channels.setdefault(f"torque.{joint}", np.where(when, 0.0, np.nan))
    return replace(manoeuvre, recording=Recording(recording.name, recording.file, recording.time, channels))


def has(recording: Recording, kind: Kind) -> bool:
    """Whether a recording holds a sensor's channels."""
    return kind.columns[0] in recording.channels


def scaled(sensor: Sensor, factor: float) -> Sensor:
    """Return a sensor with its noise multiplied."""
    noise: Noise = Scaled(sensor.noise, (factor, factor, factor))
    return replace(sensor, noise=noise)


def typical_torque(model: Model) -> TorqueSensor | None:
    """Return the torque sensor that could be added; None where there are no joints or the model cannot follow it."""
    joints = tuple(joint.name for joint in model.robot.joints)
    if not joints or any(effect.uses("table") and effect.link is None for effect in model.effects):
        return None
    return TorqueSensor(joints, (TYPICAL_TORQUE,) * len(joints))


def rescaled(sensor: TorqueSensor, factor: float) -> TorqueSensor:
    """Return a torque sensor with its noise multiplied."""
    return replace(sensor, sigma=tuple(factor * sigma for sigma in sensor.sigma))


def _repeated(known: Knowledge, names: tuple[str, ...], times: int) -> Knowledge:
    """Let everything happen again, with initial values and effects of each recording unknown anew."""
    own = np.array(["[" in name for name in names])
    data, count = known.jacobian[: -len(names)], int(own.sum())
    shared = known.jacobian.shape[1] - count
    size = shared + times * count
    blocks = []
    for number in range(times):
        block = np.zeros((len(data), size))
        block[:, :shared] = data[:, ~own]
        block[:, shared + number * count : shared + (number + 1) * count] = data[:, own]
        blocks.append(block)
    slope = np.concatenate([known.slope[:, ~own], np.zeros((len(known.slope), times * count))], axis=1)
    return Knowledge(known.names, known.values, slope, np.concatenate([*blocks, np.eye(size)]))
