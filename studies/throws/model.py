"""The models of a thrown body: rigid with its wheel, and with what acts on the device beyond, written as a user would.

All sizes are those of a small flight controller with one reaction wheel along z, thrown by hand in air.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.typing import ArrayLike

from bayesid import (
    BodyPrior,
    InertialParameters,
    Manoeuvre,
    MeasuredMotion,
    Model,
    Recording,
    Robot,
    Sensor,
    SensorKind,
    White,
)
from bayesid._math.arrays import Floats
from bayesid.simulation.effects import Effect, Instant, Parameter, Readings, SensorBias, Situation, Wrench
from bayesid.simulation.effects.effect_parameters import PhysicalBound
from studies.throws.data import INTERVAL, SMOOTH, WHEEL_INERTIA, quiet_noise
from studies.throws.raw import Timing

STEP = 0.0025  # longest integration step [s], half of the interval between samples


class GyroCross(Effect):
    """Cross-axis sensitivity of the gyro, a symmetric matrix without diagonal: the scale factors stay one."""

    name = "gyro-cross"
    summary = "Each gyro axis senses a small part of the other two."

    def __init__(self, sigma: float = 0.01) -> None:
        self.parameters = tuple(Parameter(axes, "1", sigma) for axes in ("xy", "xz", "yz"))

    def read(self, values: Array, readings: Readings) -> Readings:
        """Mix the axes."""
        xy, xz, yz = values
        one = jnp.ones(())
        matrix = jnp.stack([jnp.stack([one, xy, xz]), jnp.stack([xy, one, yz]), jnp.stack([xz, yz, one])])
        return readings.replace(rate=readings.rate @ matrix)


class GSensitivity(Effect):
    """Gyro that reads a little of the specific force: a full matrix, whose rows are the gyro's axes."""

    name = "g-sensitivity"
    summary = "The gyro senses a small part of the specific force."

    def __init__(self, sigma: float = 2e-4) -> None:
        self.parameters = tuple(Parameter(a + b, "rad s/m", sigma) for a in "xyz" for b in "xyz")

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the sensitivity of a poor micromechanical gyro."""
        return (PhysicalBound("rad s/m", 6e-4, "Micromechanical gyros read up to 0.3 degree per second and g."),)

    def read(self, values: Array, readings: Readings) -> Readings:
        """Add a share of the specific force."""
        return readings.replace(rate=readings.rate + readings.accel @ values.reshape(3, 3).T)


class WheelTilt(Effect):
    """The wheel's axis is not quite the gyro's z axis: its recorded momentum has components along x and y."""

    name = "wheel-tilt"
    summary = "The wheel is mounted at a small angle."

    def __init__(self, sigma: float = 0.05) -> None:
        self.parameters = tuple(Parameter(axis, "rad", sigma) for axis in "xy")

    def momentum(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return what the recorded momentum lacks, and its derivative."""
        tilt = jnp.concatenate([values, jnp.zeros(1)])
        return tilt * instant.environment.wheel_momentum[2], tilt * instant.environment.wheel_torque[2]


class WheelDelay(Effect):
    """The recorded momentum of the wheel is late: the true one is ahead by its slope times the delay.

    The second derivative, which only an accelerometer would see where the wheel's torque jumps, is left out.
    """

    name = "wheel-delay"
    summary = "The recorded speed of the wheel is late."

    def __init__(self, sigma: float = 0.002) -> None:
        self.parameters = (Parameter("delay", "s", sigma),)

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the time of one reading of the wheel at its lowest speed."""
        return (PhysicalBound("s", 0.006, "A reading is an average over an electrical period, up to 6 ms here."),)

    def momentum(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return the missing momentum."""
        return values[0] * instant.environment.wheel_torque, jnp.zeros(3)


class WheelImbalance(Effect):
    """Imbalance of the wheel, the same in all throws: its force, the torque of the force, and the dynamic part.

    A recording begins where the angle of the wheel is zero, so that the angle is the integral of the recorded speed.
    The force acts in the plane of rotation, beside the accelerometer. Its torque about the wheel's axis is that of its
    lever in this plane. The torques across the axis of its lever along the axis and of the dynamic imbalance both grow
    with the square of the speed and have one pair of amplitudes. The samples are filtered, and so is what turns.

    Parameters
    ----------
    static, dynamic : float; standard deviations of the imbalance [kg m, kg m2]
    """

    name = "wheel-imbalance"
    summary = "The wheel is out of balance and shakes the body once per turn."
    states = 1

    def __init__(self, static: float = 1e-7, dynamic: float = 3e-9) -> None:
        parts = ("static", "kg m", static), ("across", "kg m2", dynamic), ("about", "kg m2", dynamic)
        self.parameters = tuple(Parameter(f"{name}.{way}", unit, sd) for name, unit, sd in parts for way in ("c", "s"))

    def derivative(self, values: Array, instant: Instant, inner: Array) -> Array:
        """Return the speed of the wheel."""
        return self._speed(instant)[None]

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the force of the eccentric mass and the torques about the sensor."""
        static, across, about = values.reshape(3, 2)
        c, s = jnp.cos(inner[0]), jnp.sin(inner[0])
        torque = jnp.array([*_turned(across, c, s), about[0] * c + about[1] * s])
        size = self._gain(instant) * self._speed(instant) ** 2
        return Wrench(size * jnp.array([*_turned(static, c, s), 0.0]), size * torque)

    def _speed(self, instant: Instant) -> Array:
        return jnp.asarray(instant.environment.wheel_momentum[2] / WHEEL_INERTIA)

    def _gain(self, instant: Instant) -> Array:
        """Return the share of the line that the filter of the samples passes."""
        u = self._speed(instant) * SMOOTH
        return (1.0 + 0.5 * u**2) * jnp.exp(-0.5 * u**2)


def _turned(pair: Array, c: Array, s: Array) -> tuple[Array, Array]:
    """Return a vector across the axis after a turn by an angle with cosine and sine."""
    return pair[0] * c - pair[1] * s, pair[0] * s + pair[1] * c


class AirDrag(Effect):
    """Rotational drag of the air, linear in the rate: torque = -diag(values) rate."""

    name = "air-drag"
    summary = "Air slows the rotation."

    def __init__(self, sigma: float) -> None:
        self.parameters = tuple(Parameter(axis, "N m s", sigma) for axis in "xyz")

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the drag torque."""
        return Wrench(jnp.zeros(3), -values * instant.rate)


class Smooth(Effect):
    """Vector that nothing else explains: piecewise linear in time, with independent normal values at its knots."""

    per_recording = True
    unit: ClassVar[str]

    def __init__(self, duration: float, knots: int, sigma: float) -> None:
        self.knots, self.spacing, self.sigma = knots, duration / (knots - 1), sigma
        names = [f"{axis}{knot}" for knot in range(knots) for axis in "xyz"]
        self.parameters = tuple(Parameter(name, self.unit, sigma) for name in names)

    def course(self, values: ArrayLike, time: ArrayLike) -> Array:
        """Return the vector at times of any shape, given the values at the knots (knots * 3,): shape (..., 3)."""
        distance = jnp.abs(jnp.asarray(time)[..., None] / self.spacing - jnp.arange(self.knots))
        return jnp.maximum(0.0, 1.0 - distance) @ jnp.asarray(values).reshape(self.knots, 3)


class SmoothTorque(Smooth):
    """Unexplained torque on the body."""

    name = "smooth-torque"
    summary = "A smooth torque of unknown cause acts on the body, different in every throw."
    unit = "N m"

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the torque of the instant."""
        return Wrench(jnp.zeros(3), self.course(values, instant.environment.time))


class SmoothForce(Smooth):
    """Unexplained specific force that the accelerometer reads, such as the drag of the air on a moving plate."""

    name = "smooth-force"
    summary = "A smooth force of unknown cause acts on the body, different in every throw."
    unit = "m/s2"

    def specific_force(self, values: Array, instant: Instant, lever: Array) -> Array:
        """Return the force of the instant per mass."""
        return self.course(values, instant.environment.time)


class ThrowBias(SensorBias):
    """Constant error of the accelerometer, another one in every throw; it stands in for the drag force as well."""

    name = "throw-bias"
    summary = "The accelerometer reads a constant in free fall."
    sensor = SensorKind.ACCEL
    per_recording = True

    @property
    def longest_step(self) -> float:
        """Integration step that suits half a second [s]."""
        return STEP


URDF = """<robot name="thrown"><link name="base_link"><inertial><origin xyz="{com}"/><mass value="{mass}"/>
<inertia ixx="{0}" ixy="{1}" ixz="{2}" iyy="{3}" iyz="{4}" izz="{5}"/></inertial></link></robot>"""

KNOTS = 16  # of the unexplained torque, over the flight: 32 ms apart
TORQUE = 100.0 * WHEEL_INERTIA  # width of the unexplained torque that estimates of a body's own start from [N m]
DRAG = 20.0 * WHEEL_INERTIA  # prior standard deviation of the drag coefficients [N m s]
BIAS = 0.1  # prior standard deviation of the accelerometer's constant error in a throw [m/s2]

# least noise of the wheel's recorded speed, that of its counts [rad/s]: the gyro sees it through the inertia
RESOLUTION = Timing().wheel_count / np.sqrt(12.0)

RATE = 150.0  # prior standard deviation of the initial rate [rad/s], wide enough for any throw


def rigid(centre: InertialParameters, spread: float, recordings: Sequence[Recording]) -> Model:
    """Return a rigid body with a recorded wheel; every throw has an initial rate and an accelerometer bias of its own.

    Parameters
    ----------
    centre, spread : of the body's prior
    recordings : sequence of Recording; whose quiet stretches give the noise
    """
    inertia = centre.inertia
    upper = inertia[np.triu_indices(3)]
    robot = Robot.from_string(URDF.format(*upper, com=" ".join(map(str, centre.com)), mass=centre.mass))
    rate = quiet_noise(recordings, "rate")
    momentum = max(quiet_noise(recordings, "wheel_momentum")[2], WHEEL_INERTIA * RESOLUTION)
    rate[2] = np.hypot(rate[2], momentum / inertia[2, 2])
    sensors = (
        Sensor(SensorKind.RATE, _white(rate)),
        Sensor(SensorKind.ACCEL, _white(quiet_noise(recordings, "accel"))),
    )
    return Model(robot, sensors, (BodyPrior("base_link", centre, spread),), effects=(ThrowBias(BIAS),), rate_sigma=RATE)


NAMED = ("gyro-cross", "wheel-tilt", "wheel-delay", "air-drag", "wheel-imbalance")  # effects of the extended model


def extended(centre: InertialParameters, recordings: Sequence[Recording], duration: float) -> Model:
    """Return the same with the device's errors, drag and unexplained torque, and a body that is hardly known."""
    model = rigid(centre, 1.0, recordings)
    smooth = SmoothTorque(duration, KNOTS, TORQUE), SmoothForce(duration, KNOTS, BIAS)
    for effect in (GyroCross(), WheelTilt(), WheelDelay(), AirDrag(DRAG), WheelImbalance(), *smooth):
        model = model.extend(effect)
    return model


@dataclass(frozen=True)
class Unexplained:
    """What the throws of a body contain beside every cause, by marginal likelihood over all of them."""

    torque: float  # standard deviation of the unexplained torque at its knots [N m]
    force: float  # that of the unexplained specific force [m/s2]
    noise: Floats  # (6,): noise of gyro and accelerometer relative to that of quiet stretches


def with_unexplained(model: Model, unexplained: Unexplained, duration: float) -> Model:
    """Return a model with an unexplained torque and force in every throw and the noise of the flight."""
    rate, accel = (
        replace(sensor, noise=_white(sensor.noise.sigma(INTERVAL) * factor))
        for sensor, factor in zip(model.sensors, unexplained.noise.reshape(2, 3), strict=True)
    )
    for effect in (
        SmoothTorque(duration, KNOTS, unexplained.torque),
        SmoothForce(duration, KNOTS, unexplained.force),
    ):
        model = model.extend(effect)
    return replace(model, sensors=(rate, accel))


def manoeuvres(model: Model, recordings: Sequence[Recording]) -> list[Manoeuvre]:
    """Return the recordings as manoeuvres of a body without joints."""
    return [Manoeuvre(recording, MeasuredMotion.from_recording(recording, model.robot)) for recording in recordings]


def _white(sigma: Floats) -> White:
    return White((float(sigma[0]), float(sigma[1]), float(sigma[2])))


def is_local(name: str) -> bool:
    """Whether an unknown belongs to one throw alone."""
    return "[" in name


def is_rigid(name: str) -> bool:
    """Whether an unknown is one of the rigid model: body, initial rate and accelerometer bias, mass known."""
    return is_fitted(name) and ("base_link" in name or name.startswith(("initial-rate", "throw-bias")))


def is_fitted(name: str) -> bool:
    """Whether an unknown is one of the extended model: all but the mass, which the scales know."""
    return not name.endswith(".alpha")


def is_calibration(name: str) -> bool:
    """Whether an unknown is one of the device's, the same on all bodies."""
    return name.startswith(("gyro-cross", "wheel-tilt", "wheel-delay"))
