"""Sensors on the base: the quantity that each kind measures, and the mounting and noise of a sensor.

A kind of sensor is one class, which defines its channels in recordings, its reading at an instant of the simulation,
and the residual of a measured and a predicted reading. `SensorKind.register` makes it known by its channels' name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats, Integers
from bayesid.recording.recording import declare_family
from bayesid.simulation.sensor_noise import (
    ARCSEC,
    AngleRandomWalk,
    Coloured,
    Filter,
    Noise,
    NoiseDensity,
    Quantised,
    Scaled,
    StarTracker,
    White,
)

if TYPE_CHECKING:
    from jax import Array

    from bayesid.simulation.instant import Instant

__all__ = [
    "ARCSEC",
    "AngleRandomWalk",
    "Channels",
    "Coloured",
    "Filter",
    "Instrument",
    "Noise",
    "NoiseDensity",
    "Quantised",
    "Scaled",
    "Sensed",
    "Sensor",
    "SensorKind",
    "StarTracker",
    "White",
]


class Sensed(NamedTuple):
    """One instant of the simulation, from which a sensor takes its reading.

    Attributes
    ----------
    instant : Instant
        Motion of the robot.
    quaternion : (4,) array
        Attitude x, y, z, w from base to orbit axes.
    point : (3,) array
        Mounting point of the sensor in the base [m].
    specific_force : (3,) array
        Specific force that effects add at this point, base axes [m/s2].
    """

    instant: Instant
    quaternion: Array
    point: Array
    specific_force: Array


class Poorest(NamedTuple):
    """Constant error [unit of the sensor] of instruments of the poorest grade, what these are called, and in words.

    Those of the package are the largest of the grades in El-Sheimy and Youssef, Inertial sensors technologies for
    navigation applications, Satellite Navigation 1:2, 2020, table 1.
    """

    error: float
    instruments: str
    words: str


class Instrument(NamedTuple):
    """Properties of the instruments of a kind, which determine the names, priors and bounds of its faults.

    Attributes
    ----------
    name : str
        Name of an instrument, by default the kind's name and "sensor".
    measures, idle : str
        Quantity to which the readings are proportional, and condition under which they should be zero.
    bias_sigma : float
        Standard deviation of the prior of a constant error, in the kind's unit.
    drift_sigma : float, optional
        That of an error that grows with time, per second; by default the constant error within a minute.
    poorest : Poorest, optional
        Largest plausible constant error, by default three standard deviations.
    """

    name: str = ""
    measures: str = "what it measures"
    idle: str = "in addition to what it measures"
    bias_sigma: float = 0.03
    drift_sigma: float | None = None
    poorest: Poorest | None = None


class SensorKind:
    """Kind of sensor. To add one, subclass it, set the attributes, define `read`, and apply `SensorKind.register`.

    Attributes
    ----------
    value : str
        Name of the family of its channels in recordings, whose columns are ``value.axis``.
    unit : str
        Unit of the residual.
    axes : tuple of str
        Names of the recorded components.
    rest : tuple of float
        Recorded components of a base at rest in orbit axes.
    mounted : bool
        Whether the readings are vectors in sensor axes, which the mounting turns.
    feels_force : bool
        Whether the sensor reads the specific forces that effects add.
    frame : str
        Meaning and axes of the reading, in the files of results.
    slip : str
        Unit that users most often give by mistake.
    instrument : Instrument
        Properties of its instruments, which determine the systematic faults of the sensor.
    """

    value: ClassVar[str]
    unit: ClassVar[str]
    axes: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    rest: ClassVar[tuple[float, ...]] = (0.0, 0.0, 0.0)
    mounted: ClassVar[bool] = True
    feels_force: ClassVar[bool] = False
    frame: ClassVar[str] = ""
    slip: ClassVar[str] = "another unit"
    instrument: ClassVar[Instrument] = Instrument()

    size: ClassVar[int] = 3
    """Number of components of the residual."""

    RATE: ClassVar[SensorKind]
    ACCEL: ClassVar[SensorKind]
    ATTITUDE: ClassVar[SensorKind]

    _known: ClassVar[dict[str, SensorKind]] = {}

    @staticmethod
    def register(kind: type[K]) -> type[K]:
        """Make a kind known by the family of its channels; a class decorator."""
        known = SensorKind._known.get(kind.value)
        if known is not None and type(known).__qualname__ != kind.__qualname__:
            raise InputError(f"two kinds of sensor are named {kind.value!r}", remedy="Give each different channels")
        declare_family(kind.value, kind.axes)
        SensorKind._known[kind.value] = kind()
        return kind

    @staticmethod
    def of(value: str) -> SensorKind:
        """Return the registered kind whose channels have this name."""
        if value not in SensorKind._known:
            raise InputError(f"unknown sensor {value!r}", remedy=f"Choose from {', '.join(sorted(SensorKind._known))}")
        return SensorKind._known[value]

    @staticmethod
    def known() -> tuple[SensorKind, ...]:
        """Return all registered kinds, in the order of registration."""
        return tuple(SensorKind._known.values())

    @property
    def section(self) -> str:
        """Section of a study file that declares a sensor of this kind."""
        shipped = type(self).__module__ == __name__
        return f"sensors.{self.value}" if shipped else f"sensors.other.{self.value}"

    @property
    def is_difference(self) -> bool:
        """Whether the residual is the difference of the readings, component by component."""
        return type(self).residual is SensorKind.residual and len(self.axes) == self.size

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the channels."""
        return tuple(f"{self.value}.{axis}" for axis in self.axes)

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the components of the residual."""
        return tuple(f"{self.value}.{axis}" for axis in self.axes[: self.size])

    def read(self, sensed: Sensed) -> Array:
        """Return the true reading in base axes, shape (axes,)."""
        raise NotImplementedError

    def residual(self, measured: Array, predicted: Array) -> Array:
        """Return a measured less a predicted reading, shape (size,).

        Parameters
        ----------
        measured, predicted : (axes,) array
            Readings at one instant, in the unit of the kind.
        """
        return measured - predicted

    def noisy(self, readings: Floats, noise: Floats) -> Floats:
        """Return readings (..., axes) with noise (..., size) of the residual added.

        Parameters
        ----------
        readings : (..., axes) array
            Readings without noise.
        noise : (..., size) array
            Noise of the residual.
        """
        return readings + noise

    def mean(self, readings: Floats, weight: Floats, first: Integers) -> Floats:
        """Return weighted means of successive readings, (b, axes).

        Parameters
        ----------
        readings : (n, axes) array
            Readings of one sensor.
        weight : (n,) array
            Their weights, which sum to one for each mean.
        first : (b,) integer array
            Number of the first reading of each mean.
        """
        return np.asarray(np.add.reduceat(weight[:, None] * readings, first, axis=0))

    def shown(self, readings: Floats, reference: Floats) -> Floats:
        """Return readings (n, axes) as figures draw them, (n, size), some relative to a reference reading (axes,).

        Parameters
        ----------
        readings : (n, axes) array
            Readings of one sensor.
        reference : (axes,) array
            Reading to which some kinds refer the others.
        """
        return readings

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other)

    def __hash__(self) -> int:
        return hash(type(self))

    def __repr__(self) -> str:
        return f"SensorKind.of({self.value!r})"


K = TypeVar("K", bound=SensorKind)


@SensorKind.register
class AngularRate(SensorKind):
    """Angular velocity of the base relative to inertial space."""

    value, unit = "rate", "rad/s"
    frame = "angular velocity of the base relative to inertial space, sensor axes"
    slip = "degrees per second"
    # ten degrees per hour, and a tenth of a degree per second
    instrument = Instrument(
        "rate sensor",
        "the rate",
        "when the base is at rest",
        bias_sigma=5.0e-5,
        drift_sigma=1.0e-6,
        poorest=Poorest(1.745e-3, "Gyroscopes of the poorest grade", "0.1 degree per second"),
    )

    def read(self, sensed: Sensed) -> Array:
        """Return the angular velocity of the base."""
        return sensed.instant.rate


@SensorKind.register
class SpecificForce(SensorKind):
    """Specific force (non-gravitational acceleration) at the mounting point."""

    value, unit = "accel", "m/s2"
    feels_force = True
    frame = "non-gravitational acceleration of the mounting point, sensor axes"
    slip = "mm/s2 or micro-g"
    # ten micro-g, and five milli-g
    instrument = Instrument(
        "accelerometer",
        "the acceleration",
        "in free fall",
        bias_sigma=1.0e-4,
        drift_sigma=2.0e-6,
        poorest=Poorest(0.049, "Accelerometers of the poorest grade", "5 milli-g"),
    )

    def read(self, sensed: Sensed) -> Array:
        """Return the specific force at the base origin, with the parts that rotation and effects add at the point."""
        from bayesid._math.small_matrices import cross

        instant, point = sensed.instant, sensed.point
        rotating = cross(instant.rate_change, point) + cross(instant.rate, cross(instant.rate, point))
        return instant.acceleration + rotating + sensed.specific_force


@SensorKind.register
class StarAttitude(SensorKind):
    """Attitude of the base as a quaternion x, y, z, w from base to orbit axes, whose residual is a small rotation."""

    value, unit = "attitude", "rad"
    axes, rest = ("x", "y", "z", "w"), (0.0, 0.0, 0.0, 1.0)
    mounted = False
    frame = "quaternion x, y, z, w, base axes to orbit axes"

    def read(self, sensed: Sensed) -> Array:
        """Return the unit quaternion."""
        return sensed.quaternion

    def residual(self, measured: Array, predicted: Array) -> Array:
        """Return the small rotation, base axes, from the predicted to the measured attitude."""
        from bayesid._math.small_matrices import rotation_between

        return rotation_between(predicted, measured)

    def noisy(self, readings: Floats, noise: Floats) -> Floats:
        """Return the attitudes turned by small rotations in base axes."""
        half = 0.5 * noise
        vector = readings[..., 3:] * half + np.cross(readings[..., :3], half)
        scalar = readings[..., 3] - (readings[..., :3] * half).sum(axis=-1)
        turned = np.concatenate([readings[..., :3] + vector, scalar[..., None]], axis=-1)
        return turned / np.linalg.norm(turned, axis=-1, keepdims=True)

    def mean(self, readings: Floats, weight: Floats, first: Integers) -> Floats:
        """Return the attitudes from which the rotations to those of each mean add up to zero, to third order."""
        begin = np.repeat(readings[first], np.diff(np.append(first, len(readings))), axis=0)
        alike = np.where((readings * begin).sum(axis=1) < 0.0, -weight, weight)  # q and -q are one attitude
        total = super().mean(readings, alike, first)
        return total / np.linalg.norm(total, axis=1, keepdims=True)

    def shown(self, readings: Floats, reference: Floats) -> Floats:
        """Return the rotation vectors from the reference, in its axes [rad]."""
        from scipy.spatial.transform import Rotation

        return (Rotation.from_quat(reference).inv() * Rotation.from_quat(readings)).as_rotvec()


SensorKind.RATE, SensorKind.ACCEL, SensorKind.ATTITUDE = (
    SensorKind.of("rate"),
    SensorKind.of("accel"),
    SensorKind.of("attitude"),
)


@dataclass(frozen=True)
class Sensor:
    """Sensor on the base.

    Parameters
    ----------
    kind : SensorKind
    noise : Noise
        White noise.
    mounting : (4,) array_like
        Quaternion x, y, z, w that turns sensor axes into base axes.
    position : (3,) array_like
        Mounting point in the base [m].
    filter : Filter
        Filter of the samples, by default none.
    coloured : Coloured, optional
        Correlated noise in addition to the white noise.
    outliers : float
        Fraction of the readings that are lost or corrupted, and are omitted.
    """

    kind: SensorKind
    noise: Noise
    mounting: ArrayLike = (0.0, 0.0, 0.0, 1.0)
    position: ArrayLike = (0.0, 0.0, 0.0)
    filter: Filter = field(default_factory=Filter)
    coloured: Coloured | None = None
    outliers: float = 0.0

    @property
    def rotation(self) -> Floats:
        """Rotation matrix from sensor to base axes, shape (3, 3)."""
        from scipy.spatial.transform import Rotation  # imported here, so that study files are checked without SciPy

        return Rotation.from_quat(np.asarray(self.mounting, dtype=float)).as_matrix()


@dataclass(frozen=True)
class Channels:
    """Columns of the residual: the components of each sensor, one sensor after the other, then the joint torques.

    Parameters
    ----------
    kinds : tuple of SensorKind
        Kinds of the sensors.
    joints : tuple of str
        Names of the joints whose torque is measured.
    """

    kinds: tuple[SensorKind, ...]
    joints: tuple[str, ...] = ()

    def of(self, kind: SensorKind) -> slice:
        """Return the columns of one kind of sensor."""
        first = 0
        for other in self.kinds:
            if other == kind:
                return slice(first, first + other.size)
            first += other.size
        raise KeyError(kind)

    @property
    def torques(self) -> slice:
        """Columns of the joint torques."""
        first = sum(kind.size for kind in self.kinds)
        return slice(first, first + len(self.joints))

    @property
    def count(self) -> int:
        """Number of columns."""
        return self.torques.stop

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all columns, as in recordings."""
        sensors = [name for kind in self.kinds for name in kind.components]
        return (*sensors, *(f"torque.{joint}" for joint in self.joints))

    @property
    def units(self) -> tuple[str, ...]:
        """Units of all columns."""
        sensors = [kind.unit for kind in self.kinds for _ in range(kind.size)]
        return (*sensors, *("N m or N" for _ in self.joints))

    def groups(self) -> Sequence[tuple[str, slice]]:
        """Return the name and columns of every sensor, with all joint torques as one group."""
        groups = [(kind.value, self.of(kind)) for kind in self.kinds]
        return [*groups, ("torque", self.torques)] if self.joints else groups
