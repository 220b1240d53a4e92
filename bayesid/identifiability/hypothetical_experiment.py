"""Prediction of what an experiment would tell, given its manoeuvres, its sensors and what else is known."""

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
from bayesid.simulation.sensors import Noise, Scaled, Sensor, SensorKind, White

__all__ = [
    "FINEST",
    "TYPICAL",
    "Experiment",
    "InformationPredictor",
    "blanked",
    "has",
    "rescaled",
    "scaled",
    "typical_torque",
]

TYPICAL: dict[SensorKind, Sensor] = {
    SensorKind.RATE: Sensor(SensorKind.RATE, White(1e-5)),
    SensorKind.ACCEL: Sensor(SensorKind.ACCEL, White(1e-5)),
    SensorKind.ATTITUDE: Sensor(SensorKind.ATTITUDE, White(2.4e-5)),
}
"""Sensors that could be added, with typical noise per sample: 1e-5 rad/s, 1e-5 m/s2 (1 micro-g) and 5 arcsec."""

TYPICAL_TORQUE = 0.1  # typical noise per sample of torque sensors that could be added to all joints [N m, N]
# factors on the noise of a sensor that stand for an absent sensor, and for the best sensor that is considered
ABSENT, FINEST = 1e6, 0.1


@dataclass(frozen=True)
class Experiment:
    """Properties of an experiment that a candidate may change."""

    manoeuvres: tuple[Manoeuvre, ...]  #: manoeuvres of the experiment
    sensors: tuple[Sensor, ...]  #: sensors that are present
    torque: TorqueSensor | None = None  #: torque sensor of the joints, None where there is none
    #: names of bodies whose mass is known beyond the prior, with the relative standard deviations of their masses
    weighed: tuple[tuple[str, float], ...] = ()
    times: int = 1  #: number of times that every manoeuvre is flown


class InformationPredictor:
    """Predictor of what experiments tell about a model, linearised at one point.

    All sensors are simulated in all experiments, absent ones with enormous noise, so that experiments share one
    compiled Jacobian.

    Parameters
    ----------
    model : Model
        Model with the sensors that are present.
    manoeuvres : sequence of Manoeuvre
        Manoeuvres as flown or planned; sensors that are not recorded are sampled as often as the first that is.
    z : (N,) array
        Coordinates of the linearisation point in the model's posterior.
    step : float
        Step of the integration [s].
    """

    def __init__(self, model: Model, manoeuvres: tuple[Manoeuvre, ...], z: Floats, step: float) -> None:
        declared = {sensor.kind for sensor in model.sensors}
        self.z, self.step, self.flown = z, step, Experiment(manoeuvres, model.sensors, model.torque)
        everything = (*model.sensors, *(sensor for kind, sensor in TYPICAL.items() if kind not in declared))
        # the best sensors are the most sensitive to the encoders' correlated noise, so they set the whitening's length
        self._torque = typical_torque(model) if model.torque is None else model.torque
        finest = None if self._torque is None else rescaled(self._torque, FINEST)
        self.model = replace(model, sensors=tuple(scaled(sensor, FINEST) for sensor in everything), torque=finest)
        self._plain = {sensor.kind: sensor for sensor in everything}

    @cached_property
    def posterior(self) -> Posterior:
        """Posterior of the manoeuvres as flown, measured by all sensors with their lowest noise."""
        return planned_posterior(self.model, self._read(self.flown.manoeuvres), z=self.z, step=self.step)

    def knowledge(self, experiment: Experiment) -> Knowledge:
        """Return the knowledge that an experiment would give."""
        posterior, there = self.posterior, {sensor.kind: sensor for sensor in experiment.sensors}
        if experiment.manoeuvres is not self.flown.manoeuvres:
            blank = with_manoeuvres(self.posterior, self._read(experiment.manoeuvres))
            # the Jacobian depends on the readings only for attitudes
            posterior = blank if SensorKind.ATTITUDE not in there else simulated(blank, self.z)
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
    """Return a manoeuvre with placeholder samples for the sensors that its recording lacks, to be simulated.

    Parameters
    ----------
    manoeuvre : Manoeuvre
    sensors : tuple of Sensor
        Sensors that the manoeuvre is to have.
    torque : TorqueSensor, optional
        Torque sensor that it is to have.
    """
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


def has(recording: Recording, kind: SensorKind) -> bool:
    """Return whether a recording holds the channels of a kind of sensor.

    Parameters
    ----------
    recording : Recording
    kind : SensorKind
        Kind of the sensor.
    """
    return kind.columns[0] in recording.channels


def scaled(sensor: Sensor, factor: float) -> Sensor:
    """Return a sensor with its noise multiplied by a factor.

    Parameters
    ----------
    sensor : Sensor
    factor : float
        Factor on the standard deviation of the noise.
    """
    noise: Noise = Scaled(sensor.noise, (factor, factor, factor))
    return replace(sensor, noise=noise)


def typical_torque(model: Model) -> TorqueSensor | None:
    """Return the torque sensor that could be added, None without joints or where the model cannot predict torques."""
    joints = tuple(joint.name for joint in model.robot.joints)
    if not joints or any(effect.uses("table") and effect.link is None for effect in model.effects):
        return None
    return TorqueSensor(joints, (TYPICAL_TORQUE,) * len(joints))


def rescaled(sensor: TorqueSensor, factor: float) -> TorqueSensor:
    """Return a torque sensor with its noise multiplied by a factor.

    Parameters
    ----------
    sensor : TorqueSensor
    factor : float
        Factor on the standard deviation of the noise.
    """
    return replace(sensor, sigma=tuple(factor * sigma for sigma in sensor.sigma))


def _repeated(known: Knowledge, names: tuple[str, ...], times: int) -> Knowledge:
    """Return the knowledge after every manoeuvre is flown ``times`` times.

    Initial values and effects of each recording are new unknowns in every repetition.
    """
    local = np.array(["[" in name for name in names])  # unknowns of one recording carry its name in brackets
    data, count = known.jacobian[: -len(names)], int(local.sum())
    shared = known.jacobian.shape[1] - count
    size = shared + times * count
    blocks = []
    for number in range(times):
        block = np.zeros((len(data), size))
        block[:, :shared] = data[:, ~local]
        block[:, shared + number * count : shared + (number + 1) * count] = data[:, local]
        blocks.append(block)
    slope = np.concatenate([known.slope[:, ~local], np.zeros((len(known.slope), times * count))], axis=1)
    return Knowledge(known.names, known.values, slope, np.concatenate([*blocks, np.eye(size)]))
