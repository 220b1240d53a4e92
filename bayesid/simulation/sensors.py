"""Sensors on the base: what a kind of sensor measures, where one sits, how it is turned and how noisy it is.

A kind of sensor is one class: the channels it is recorded in, what it reads at an instant of the simulation, and how a
measured and a predicted reading differ. `Kind.register` makes it known by the name of its channels.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.recording.channel_families import declare_family
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

    from bayesid.simulation.effects.instant import Instant

__all__ = [
    "ARCSEC",
    "AngleRandomWalk",
    "Coloured",
    "Filter",
    "Kind",
    "Noise",
    "NoiseDensity",
    "Quantised",
    "Scaled",
    "Sensed",
    "Sensor",
    "StarTracker",
    "White",
]


class Sensed(NamedTuple):
    """One instant of the simulation as a sensor meets it.

    ``quaternion`` (4,) turns base to orbit axes; ``point`` (3,) is the sensor's mounting point in the base [m];
    ``specific_force`` (3,) is what effects add to an accelerometer there [m/s2], base axes.
    """

    instant: Instant
    quaternion: Array
    point: Array
    specific_force: Array


class Kind:
    """What a sensor measures. Subclass it, set the attributes, define `read`, and decorate it with `Kind.register`.

    Attributes
    ----------
    value : str
        Family of its channels in recordings, whose columns are ``value.axis``.
    unit : str
        Unit of the residual.
    axes : tuple of str
        Components as recorded.
    rest : tuple of float
        Reading, component by component, of a base at rest in orbit axes.
    mounted : bool
        Whether readings are vectors that the sensor's mounting turns.
    feels_force : bool
        Whether the specific forces that effects add reach it.
    frame : str
        What the reading is, and in which axes.
    slip : str
        The unit by which users most often mistake it.
    """

    value: ClassVar[str]
    unit: ClassVar[str]
    axes: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    rest: ClassVar[tuple[float, ...]] = (0.0, 0.0, 0.0)
    mounted: ClassVar[bool] = True
    feels_force: ClassVar[bool] = False
    frame: ClassVar[str] = ""
    slip: ClassVar[str] = "another unit"

    size: ClassVar[int] = 3
    """Components of the residual."""

    RATE: ClassVar[Kind]
    ACCEL: ClassVar[Kind]
    ATTITUDE: ClassVar[Kind]

    _known: ClassVar[dict[str, Kind]] = {}

    @staticmethod
    def register(kind: type[K]) -> type[K]:
        """Class decorator: make a kind known by the family of its channels."""
        known = Kind._known.get(kind.value)
        if known is not None and type(known).__qualname__ != kind.__qualname__:
            raise InputError(f"two kinds of sensor are named {kind.value!r}", remedy="Give each channels of its own")
        declare_family(kind.value, kind.axes)
        Kind._known[kind.value] = kind()
        return kind

    @staticmethod
    def of(value: str) -> Kind:
        """Return the registered kind whose channels have this name."""
        if value not in Kind._known:
            raise InputError(f"unknown sensor {value!r}", remedy=f"Choose from {', '.join(sorted(Kind._known))}")
        return Kind._known[value]

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of its channels."""
        return tuple(f"{self.value}.{axis}" for axis in self.axes)

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the components of its residual."""
        return tuple(f"{self.value}.{axis}" for axis in self.axes[: self.size])

    def read(self, sensed: Sensed) -> Array:
        """Return the true reading, base axes, shape (axes,)."""
        raise NotImplementedError

    def residual(self, measured: Array, predicted: Array) -> Array:
        """Return how a measured reading differs from a predicted one, shape (size,)."""
        return measured - predicted

    def noisy(self, readings: Floats, noise: Floats) -> Floats:
        """Return readings (..., axes) with noise (..., size) of the residual added."""
        return readings + noise

    def shown(self, readings: Floats, reference: Floats) -> Floats:
        """Return readings (n, axes) as they are drawn, (n, size), where need be relative to a reference (axes,)."""
        return readings

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other)

    def __hash__(self) -> int:
        return hash(type(self))

    def __repr__(self) -> str:
        return f"Kind.of({self.value!r})"


K = TypeVar("K", bound=Kind)


@Kind.register
class AngularRate(Kind):
    """Angular velocity of the base relative to inertial space."""

    value, unit = "rate", "rad/s"
    frame = "angular velocity of the base relative to inertial space, sensor axes"
    slip = "degrees per second"

    def read(self, sensed: Sensed) -> Array:
        """Return the base's angular velocity."""
        return sensed.instant.rate


@Kind.register
class SpecificForce(Kind):
    """Non-gravitational acceleration of the mounting point."""

    value, unit = "accel", "m/s2"
    feels_force = True
    frame = "non-gravitational acceleration of the mounting point, sensor axes"
    slip = "mm/s2 or micro-g"

    def read(self, sensed: Sensed) -> Array:
        """Return the acceleration of the base origin, what rotation adds at the point, and what effects add."""
        from bayesid._math.small_matrices import cross

        instant, point = sensed.instant, sensed.point
        rotating = cross(instant.rate_change, point) + cross(instant.rate, cross(instant.rate, point))
        return instant.acceleration + rotating + sensed.specific_force


@Kind.register
class StarAttitude(Kind):
    """Attitude of the base, a quaternion x, y, z, w from base to orbit axes; its residual is a small rotation."""

    value, unit = "attitude", "rad"
    axes, rest = ("x", "y", "z", "w"), (0.0, 0.0, 0.0, 1.0)
    mounted = False
    frame = "quaternion x, y, z, w, base axes to orbit axes"

    def read(self, sensed: Sensed) -> Array:
        """Return the unit quaternion."""
        return sensed.quaternion

    def residual(self, measured: Array, predicted: Array) -> Array:
        """Return the small rotation, base axes, from the predicted to the measured attitude."""
        from bayesid._math.rotation import rotation_between

        return rotation_between(predicted, measured)

    def noisy(self, readings: Floats, noise: Floats) -> Floats:
        """Return attitudes turned by small rotations in base axes."""
        half = 0.5 * noise
        vector = readings[..., 3:] * half + np.cross(readings[..., :3], half)
        scalar = readings[..., 3] - (readings[..., :3] * half).sum(axis=-1)
        turned = np.concatenate([readings[..., :3] + vector, scalar[..., None]], axis=-1)
        return turned / np.linalg.norm(turned, axis=-1, keepdims=True)

    def shown(self, readings: Floats, reference: Floats) -> Floats:
        """Return rotation vectors from the reference [rad]."""
        from scipy.spatial.transform import Rotation

        return (Rotation.from_quat(reference).inv() * Rotation.from_quat(readings)).as_rotvec()


Kind.RATE, Kind.ACCEL, Kind.ATTITUDE = Kind.of("rate"), Kind.of("accel"), Kind.of("attitude")


@dataclass(frozen=True)
class Sensor:
    """A sensor on the base.

    Parameters
    ----------
    kind : Kind
    noise : Noise
    mounting : (4,) array_like
        Quaternion x, y, z, w that turns sensor axes into base axes.
    position : (3,) array_like
        Mounting point in the base [m].
    filter : Filter
    coloured : Coloured, optional
        Correlated noise beside the white one.
    """

    kind: Kind
    noise: Noise
    mounting: ArrayLike = (0.0, 0.0, 0.0, 1.0)
    position: ArrayLike = (0.0, 0.0, 0.0)
    filter: Filter = field(default_factory=Filter)
    coloured: Coloured | None = None

    @property
    def rotation(self) -> Floats:
        """Rotation matrix, sensor to base axes."""
        from scipy.spatial.transform import Rotation  # study files, which name a noise, are checked without SciPy

        return Rotation.from_quat(np.asarray(self.mounting, dtype=float)).as_matrix()
