"""Model of a robot with its sensors, effects and priors, and the manoeuvres that it was recorded in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bayesid._io.errors import InputError
from bayesid._io.short_form import ShortForm, Summary
from bayesid._math.arrays import Floats
from bayesid.recording.blocks import BLOCKS_PER_SECOND
from bayesid.recording.joint_motion import Motion
from bayesid.recording.recording import Recording
from bayesid.robot.body_prior import BodyPrior, Mixing, check_mixing
from bayesid.robot.robot import Robot
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.placed import OnJoint
from bayesid.simulation.joint_torques import TorqueSensor
from bayesid.simulation.orbit import Orbit
from bayesid.simulation.sensors import Channels, Sensor, SensorKind

__all__ = ["Manoeuvre", "Model", "spread_links"]

RATE_SIGMA = 0.1
"""Default prior standard deviation of an unknown initial rate [rad/s], wide for any spacecraft."""


@dataclass(frozen=True, repr=False)
class Manoeuvre(ShortForm):
    """A recorded (or planned) manoeuvre.

    Parameters
    ----------
    recording : Recording
        Readings of the sensors; a recording used only for simulation may lack them.
    motion : Motion
        Motion of the joints.
    attitude : (4,) array_like
        Quaternion x, y, z, w from base to orbit axes at time 0.
    attitude_sigma : float
        Standard deviation of this attitude per axis [rad]; 0 if it is exact.
    argument_of_latitude : float
        Argument of latitude at time 0 [rad].
    blocks_per_second : float
        Rate above which the samples of a sensor are averaged over blocks [1/s]; 0 disables averaging.
    """

    recording: Recording
    motion: Motion
    attitude: Floats = field(default_factory=lambda: np.array([0.0, 0.0, 0.0, 1.0]))
    attitude_sigma: float = 0.0
    argument_of_latitude: float = 0.0
    blocks_per_second: float = BLOCKS_PER_SECOND

    def summary(self) -> Summary:
        """Return what was recorded."""
        return self.recording.summary()


@dataclass(frozen=True, repr=False)
class Model(ShortForm):
    """Robot with its sensors, the effects of its simulation and the priors of its unknown bodies.

    Parameters
    ----------
    robot : Robot
    sensors : sequence of Sensor
        Sensors on the base, at most one of each kind.
    priors : sequence of BodyPrior
        Priors of the bodies to identify and of those to marginalise.
    orbit : Orbit, optional
        Orbit of the robot, None in a laboratory.
    effects : sequence of Effect
        Effects beyond the motion of rigid bodies.
    rate_sigma : float
        Prior standard deviation of the initial rate of each recording [rad/s]; 0 for a start at rest.
    mixing : (10 B, 10 B) tuple of tuples, optional
        Factor of the joint prior of all B ``priors`` about their centres (`Unknowns`), such as the posterior of an
        earlier study; by default bodies and coordinates are independent.
    torque : TorqueSensor, optional
        Sensors of the joint torques.
    speed_errors : bool, optional
        Whether the smoothed joint speeds at time 0 are uncertain; by default where the initial rate is zero.
    """

    robot: Robot
    sensors: tuple[Sensor, ...]
    priors: tuple[BodyPrior, ...]
    orbit: Orbit | None = None
    effects: tuple[Effect, ...] = ()
    rate_sigma: float = RATE_SIGMA
    mixing: Mixing | None = None
    torque: TorqueSensor | None = None
    speed_errors: bool | None = None

    def summary(self) -> Summary:
        """Return robot, sensors, bodies to identify and effects."""
        kinds = [sensor.kind.value for sensor in self.sensors]
        names = (kinds, [prior.name for prior in self.bodies], [effect.label for effect in self.effects])
        sensors, bodies, effects = (", ".join(part) or "none" for part in names)
        known = f"Sensors: {sensors}. Bodies to identify: {bodies}. Effects: {effects}."
        return Summary([*self.robot.summary().sentences, known])

    def __post_init__(self) -> None:
        if not self.sensors:
            raise InputError("no sensor is declared", remedy="Declare rate, accel or attitude")
        kinds = [sensor.kind for sensor in self.sensors]
        if len(set(kinds)) != len(kinds):
            raise InputError("two sensors of one kind are declared", remedy="Declare each kind once")
        for effect in self.effects:
            if (lacking := effect.lacks(self)) is not None:
                raise InputError(
                    f"effect {effect.label!r} requires {lacking}, which the study does not contain",
                    remedy=f"Give {lacking} or omit the effect",
                )
        object.__setattr__(self, "effects", tuple(effect.attach(self.robot) for effect in self.effects))
        labels = [effect.label for effect in self.effects]
        for label in labels:
            if labels.count(label) > 1:
                raise InputError(f"effect {label!r} is in the model twice", remedy="Name it once")
        for prior in self.priors:
            self.robot.link(prior.name)
        if self.mixing is not None:
            check_mixing(self.mixing, len(self.priors))
        self._check_torque()

    def _check_torque(self) -> None:
        measured = () if self.torque is None else self.torque.joints
        for effect in self.effects:
            if effect.uses("friction") and isinstance(effect, OnJoint) and effect.place not in measured:
                raise InputError(
                    f"effect {effect.label!r} affects only the joint's torque, which is not measured",
                    remedy="Add [sensors.torque] or omit the effect",
                )
        if self.torque is None:
            return
        self.torque.columns(self.robot)
        for effect in self.effects:
            if effect.uses("table") and effect.link is None:
                raise InputError(
                    f"effect {effect.label!r} is not modelled in the joint torques",
                    remedy="Omit [sensors.torque] or the effect",
                )

    @property
    def without_torque(self) -> Model:
        """The same model without torque sensors and without effects that only they measure."""
        rest = tuple(effect for effect in self.effects if not effect.uses("friction"))
        return self if self.torque is None and rest == self.effects else replace(self, torque=None, effects=rest)

    def extend(self, effect: Effect) -> Model:
        """Return the model with one more effect."""
        return replace(self, effects=(*self.effects, effect))

    @property
    def channels(self) -> Channels:
        """Layout of the residual's columns."""
        joints = () if self.torque is None else self.torque.joints
        return Channels(tuple(sensor.kind for sensor in self.sensors), joints)

    def sensor(self, kind: SensorKind) -> Sensor | None:
        """Return the sensor of a kind, or None if none is declared."""
        return next((sensor for sensor in self.sensors if sensor.kind == kind), None)

    @property
    def has_speed_errors(self) -> bool:
        """Whether errors of the smoothed joint speeds at time 0 are unknowns.

        By default they are unknowns if the initial rate is declared zero: the base then rests if the joints truly do,
        and an error of a smoothed speed would be taken for momentum. An unknown initial rate absorbs such errors.
        """
        return self.rate_sigma == 0.0 if self.speed_errors is None else self.speed_errors

    @property
    def bodies(self) -> tuple[BodyPrior, ...]:
        """Priors of the bodies to identify, without those that are marginalised."""
        return tuple(prior for prior in self.priors if not prior.nuisance)


def spread_links(robot: Robot, spread: float, known: Sequence[str]) -> tuple[BodyPrior, ...]:
    """Return priors of the given relative width for all links with mass except those in ``known``, to marginalise.

    Parameters
    ----------
    robot : Robot
    spread : float
        Relative width of the priors; there are none for zero.
    known : sequence of str
        Links that get no prior.
    """
    if spread <= 0.0:
        return ()
    return tuple(
        BodyPrior(name, link.inertial, spread, nuisance=True)
        for name, link in robot.links.items()
        if name not in known and link.inertial.mass > 0.0
    )
