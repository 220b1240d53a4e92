"""Sections of a study file on its sensors."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import model_validator

from bayesid._io.errors import InputError
from bayesid.app.schema.value_types import (
    ANGLE_SIGMA,
    Decimation,
    Name,
    Number,
    Numbers,
    PerAxis,
    PerName,
    Position,
    Positive,
    Quaternion,
    Section,
    Vector,
    no_less_than,
    no_more_than,
)

if TYPE_CHECKING:
    from bayesid.simulation.sensors import Noise


Arcseconds = Annotated[Positive, no_less_than(1e-3, "arcsec, not rad?"), no_more_than(36000.0, "Is it in arcsec?")]


class SampledSensor(Section):
    """Keys for a sensor whose recorded values have other axes, signs, units or columns than the format.

    Parameters
    ----------
    missing : float or list of float, optional
        Values that stand for missing readings.
    native_rate : float, optional
        Rate of new readings if values in between are repeated or interpolated [Hz].
    latency : float, optional
        Delay of the time stamps of the readings, negative if they are early [s].
    """

    missing: Numbers = ()
    native_rate: Positive | None = None
    latency: Number = 0.0


class FilteredSensor(SampledSensor):
    """Keys of every sensor of the base.

    Parameters
    ----------
    low_pass : float, optional
        Cut-off frequency of a low-pass filter, applied to samples and prediction [Hz].
    decimate : int, optional
        Decimation factor n: only every n-th sample is used, in samples and prediction.
    """

    NOISE: ClassVar[tuple[str, ...]] = ()
    """Keys for the noise; exactly one must be given."""

    low_pass: Positive | None = None
    decimate: Decimation = 1

    @model_validator(mode="after")
    def _check_noise(self) -> FilteredSensor:
        given = [key for key in self.NOISE if getattr(self, key) is not None]
        if self.NOISE and len(given) != 1:
            problem = f"{' and '.join(given)} are given together" if given else "the noise is not given"
            raise InputError(problem, remedy=f"Give exactly one of {', '.join(self.NOISE)}")
        return self


class MountedSensor(FilteredSensor):
    """Keys for a sensor whose axes may differ from those of the base.

    Parameters
    ----------
    mounting : (4,), optional
        Quaternion from sensor to base axes.
    reflected : bool, optional
        Whether the axes of the readings are left-handed: the sign of all readings is reversed before mounting.
    scale : float, optional
        Factor from the readings, such as counts, to their unit.
    """

    mounting: Quaternion = (0.0, 0.0, 0.0, 1.0)
    reflected: bool = False
    scale: Positive = 1.0


class RateSensor(MountedSensor):
    """Section ``[sensors.rate]``, a sensor of the base's angular velocity.

    Exactly one of the first three keys defines the noise.

    Parameters
    ----------
    sigma : float or (3,)
        Standard deviation of white noise per sample [rad/s].
    angle_random_walk : float
        Angle random walk from a gyro's data sheet [rad/sqrt(s)]. Divided by the square root of the sample interval it
        gives the noise per sample. 1 deg/sqrt(h) is 2.909e-4 rad/sqrt(s).
    attitude_arcsec : float
        Accuracy per sample of a star tracker whose attitude was differenced to give the rate [arcsec]. Because two
        samples enter, the noise is sqrt(2) times the angle divided by the sample interval.
    bias_sigma : float or (3,), optional
        Prior standard deviation of a constant bias [rad/s]; by default the model has no bias.
    unit : str, optional
        Unit of the readings, such as "deg/s", by default "rad/s"; noise and bias are always in rad/s.
    """

    NOISE = ("sigma", "angle_random_walk", "attitude_arcsec")

    sigma: Annotated[PerAxis, no_more_than(0.1, "rad/s, not arcsec/s or degrees/s?")] | None = None
    angle_random_walk: (
        Annotated[Positive, no_more_than(0.01, "rad/sqrt(s), not deg/sqrt(h)? Multiply that by 2.909e-4")] | None
    ) = None
    attitude_arcsec: Arcseconds | None = None
    bias_sigma: PerAxis | None = None
    unit: Literal["rad/s", "deg/s", "mdeg/s", "mrad/s", "arcsec/s", "rev/s", "deg/h", "rpm"] = "rad/s"

    @property
    def noise(self) -> Noise:
        """Noise of the recorded samples, before any filter."""
        from bayesid.simulation.sensors import AngleRandomWalk, StarTracker, White

        if self.sigma is not None:
            return White(self.sigma)
        if self.angle_random_walk is not None:
            return AngleRandomWalk(self.angle_random_walk)
        return StarTracker(self.attitude_arcsec or math.nan)


class AccelSensor(MountedSensor):
    """Section ``[sensors.accel]``, a sensor of the non-gravitational acceleration at one point of the base.

    Exactly one of the first two keys defines the noise.

    Parameters
    ----------
    sigma : float or (3,)
        Standard deviation of white noise per sample [m/s2].
    noise_density : float
        One-sided noise density from a data sheet [m/s2/sqrt(Hz)]. Multiplied by the square root of the Nyquist
        frequency it gives the noise per sample. 1 micro-g/sqrt(Hz) is 9.80665e-6 m/s2/sqrt(Hz).
    position : (3,)
        Position from the base origin, base axes [m].
    bias_sigma : float or (3,), optional
        Prior standard deviation of a constant bias [m/s2]; by default the model has no bias.
    unit : str, optional
        Unit of the readings, such as "g", by default "m/s2"; noise and bias are always in m/s2.
    gravity : (3,), optional
        Constant that gravity adds to readings on the ground, which is what the sensor reads at rest (+9.81 along the
        upward axis), in sensor axes at the first instant; it is subtracted [m/s2].
    gravity_fixed_in : {"sensor", "space"}, optional
        Whether gravity is constant in the sensor axes or in space, by default in the sensor axes.
    """

    NOISE = ("sigma", "noise_density")

    sigma: Annotated[PerAxis, no_more_than(1.0, "m/s2, not milli-g or micro-g?")] | None = None
    noise_density: (
        Annotated[Positive, no_more_than(0.1, "m/s2/sqrt(Hz), not micro-g/sqrt(Hz)? Multiply that by 9.80665e-6")]
        | None
    ) = None
    position: Position
    bias_sigma: PerAxis | None = None
    unit: Literal["m/s2", "g", "mg", "ug", "mm/s2", "cm/s2"] = "m/s2"
    gravity: Vector | None = None
    gravity_fixed_in: Literal["sensor", "space"] = "sensor"

    @property
    def noise(self) -> Noise:
        """Noise of the recorded samples, before any filter."""
        from bayesid.simulation.sensors import NoiseDensity, White

        return White(self.sigma) if self.sigma is not None else NoiseDensity(self.noise_density or math.nan)


class AttitudeSensor(FilteredSensor):
    """Section ``[sensors.attitude]``, a star tracker that measures the attitude from base to orbit axes.

    Exactly one of the first two keys defines the noise.

    Parameters
    ----------
    sigma : float or (3,)
        Standard deviation of white noise per sample, as a small rotation in base axes [rad].
    arcsec : float
        Standard deviation of white noise per sample [arcsec].
    order : {"xyzw", "wxyz"}, optional
        Order of the components of the readings.
    inverse : bool, optional
        Whether the readings are quaternions from orbit to base axes.
    frame : {"orbit", "inertial", "rotating"}, optional
        Reference axes of the readings: those of the orbit at time 0; other fixed axes, so that only the change from
        the recording's initial attitude is used; or axes that rotate with the orbit.
    """

    NOISE = ("sigma", "arcsec")

    sigma: Annotated[PerAxis, ANGLE_SIGMA] | None = None
    arcsec: Arcseconds | None = None
    order: Literal["xyzw", "wxyz"] = "xyzw"
    inverse: bool = False
    frame: Literal["orbit", "inertial", "rotating"] = "orbit"

    @property
    def noise(self) -> Noise:
        """Noise of the recorded samples, before any filter."""
        from bayesid.simulation.sensors import ARCSEC, White

        return White(self.sigma if self.sigma is not None else (self.arcsec or math.nan) * ARCSEC)


class EncoderSensor(SampledSensor):
    """Section ``[sensors.encoder]``, the measurements of the joints.

    Parameters
    ----------
    sigma, velocity_sigma, acceleration_sigma : float or table of joint to float, optional
        Standard deviations of white noise per sample of position [rad, or m for prismatic joints], velocity and
        acceleration, by default estimated from the data.
    unit : str, optional
        Unit of the angles in the readings, such as "deg", by default "rad"; noise is always in rad.
    scale : float, optional
        Factor from all readings of angles, such as counts, to that unit.
    """

    sigma: Annotated[PerName, ANGLE_SIGMA] | None = None
    velocity_sigma: Annotated[PerName, no_more_than(1.0, "rad/s, not degrees/s?")] | None = None
    acceleration_sigma: PerName | None = None
    unit: Literal["rad", "deg", "mrad", "arcsec", "rev"] = "rad"
    scale: Positive = 1.0

    def sigma_of(self, family: Literal["position", "velocity", "acceleration"], joint: str) -> float | None:
        """Return the noise per sample of one joint's position, velocity or acceleration, None if not given.

        Parameters
        ----------
        family : {"position", "velocity", "acceleration"}
        joint : str
            Name of the joint.
        """
        level = {"position": self.sigma, "velocity": self.velocity_sigma, "acceleration": self.acceleration_sigma}
        given = level[family]
        return given.get(joint) if isinstance(given, Mapping) else given


class TorqueSection(Section):
    """Section ``[sensors.torque]``, the sensors of the joint torques.

    Parameters
    ----------
    sigma : float or table of joint to float
        Standard deviation of white noise per sample [N m, or N for prismatic joints]. One number applies to every
        moving joint; a table names the joints that have a sensor.
    """

    sigma: Annotated[PerName, no_more_than(1e4, "N m")]


class OtherSensor(MountedSensor):
    """Section ``[sensors.other.NAME]``, a sensor of a kind that a plugin registers with `SensorKind.register`.

    Parameters
    ----------
    sigma : float or list of float
        Standard deviation of white noise per sample, for all columns or for each, in the kind's unit.
    position : (3,)
        Position from the base origin, base axes [m].
    """

    sigma: Positive | tuple[Positive, ...]
    position: Position = (0.0, 0.0, 0.0)


class SensorsSection(Section):
    """Section ``[sensors]``, all sensors, with at least one of the base.

    Parameters
    ----------
    rate, accel, attitude : optional
        Sensors of the base; a sensor that is not declared is not used, even if it was recorded.
    torque : optional
        Sensors of the joint torques; by default recorded torques are not used.
    encoder : EncoderSensor
        Sensors of the joint motion.
    other : table of OtherSensor
        Further sensors of the base by the names of their kinds.
    """

    rate: RateSensor | None = None
    accel: AccelSensor | None = None
    attitude: AttitudeSensor | None = None
    torque: TorqueSection | None = None
    encoder: EncoderSensor = EncoderSensor()
    other: Mapping[Name, OtherSensor] = {}

    @model_validator(mode="after")
    def _check_information(self) -> SensorsSection:
        if self.rate is None and self.accel is None and self.attitude is None and not self.other:
            problem = "no sensor of the base is declared"
            raise InputError(problem, remedy="Add at least one of [sensors.rate], [sensors.accel], [sensors.attitude]")
        if self.rate is not None and self.rate.attitude_arcsec is not None and self.attitude is not None:
            problem = "a rate differenced from the attitude (rate.attitude_arcsec) is not an independent sensor"
            raise InputError(problem, remedy="Declare either [sensors.rate] or [sensors.attitude]")
        return self
