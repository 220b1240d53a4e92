"""Hidden parts of a robot in MuJoCo, and force and torque fields on its base."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from studies.truth.bodies import Body
from studies.truth.numerics import Array, cross, quintic_step
from studies.truth.orbit import Orbit


@dataclass(frozen=True)
class Rotor:
    """A wheel in the base that spins at constant speed relative to it; at rest it counts as part of the base."""

    momentum: tuple[float, float, float]
    position: tuple[float, float, float] = (-0.3, 0.1, 0.4)
    mass: float = 6.0
    spin_inertia: float = 0.03

    @property
    def axis(self) -> Array:
        """Unit vector of the spin, base axes."""
        return np.array(self.momentum) / np.linalg.norm(self.momentum)

    @property
    def body(self) -> Body:
        """The rotor at rest, base axes."""
        across = 0.6 * self.spin_inertia
        tensor = across * np.eye(3) + (self.spin_inertia - across) * np.outer(self.axis, self.axis)
        return Body(self.mass, np.array(self.position), tensor)


@dataclass(frozen=True)
class DrivenWheel:
    """A wheel in the base whose angle, speed and acceleration relative to it are prescribed.

    At angle zero it counts as part of the base. An imbalance is given as it lies at angle zero, base axes: `static` is
    the first moment of mass about the axis [kg m], `dynamic` the momentum across the axis per speed [kg m2].
    """

    axis: tuple[float, float, float]
    spin_inertia: float
    course: Callable[[float], tuple[float, float, float]]
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    mass: float = 0.1
    static: tuple[float, float, float] = (0.0, 0.0, 0.0)
    dynamic: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def body(self) -> Body:
        """The wheel at angle zero, base axes."""
        axis, across = np.array(self.axis), 0.6 * self.spin_inertia
        tensor = across * np.eye(3) + (self.spin_inertia - across) * np.outer(axis, axis)
        tensor += np.outer(axis, self.dynamic) + np.outer(self.dynamic, axis)
        offset = np.array(self.static) / self.mass
        about_com = tensor - self.mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
        return Body(self.mass, np.array(self.position) + offset, about_com)


@dataclass(frozen=True)
class Appendage:
    """A body on the base with joints held by springs, which no recording shows: a solar panel, a tank of fuel."""

    body: Body  # in base axes; the centre of mass relative to the base origin
    # axes of its joints, base axes
    hinges: Sequence[ArrayLike] = ()
    slides: Sequence[ArrayLike] = ()
    anchor: tuple[float, float, float] = (0.0, 0.0, 0.0)  # (3,): point through which the hinges go, base frame [m]
    frequency: float = 0.2  # natural frequency of each joint with the base held and the other joints locked [Hz]
    damping: float = 0.01  # relative to critical


@dataclass(frozen=True)
class Thrust:
    """A constant force and torque at the base origin [N, N m], base axes, from `start` until `stop` [s]."""

    start: float
    stop: float
    force: tuple[float, float, float] = (0.0, 0.0, 0.0)
    torque: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Flexibility:
    """A spring and damper between a driven joint and what it carries; the recording shows the motor's side.

    The stiffness is J (2 pi frequency)^2, with J the inertia about the joint's axis of all that lies beyond it, the
    other joints locked, in the configuration the model is built with; the damping is relative to critical.
    """

    joint: str
    frequency: float
    damping: float = 0.02


@dataclass(frozen=True)
class Mover:
    """A body in the base that is moved by `travel` along `direction` (base axes) from `start` on, within `duration`.

    In a study, `starts` may hold the start of each recording in place of the one of all.
    """

    body: Body
    direction: tuple[float, float, float]
    travel: float
    start: float
    duration: float = 2.0
    starts: tuple[float, ...] = ()

    def in_recording(self, index: int) -> Mover:
        """Return the mover with the start of one recording."""
        return replace(self, start=self.starts[index], starts=()) if self.starts else self

    @property
    def moments(self) -> Array:
        """Changes of the base's first moments x, y, z [kg m] and second moments xx, yy, zz, xy, xz, yz [kg m2]."""
        travel = self.travel * np.asarray(self.direction)
        before, after = self.body.com, self.body.com + travel
        second = self.body.mass * (np.outer(after, after) - np.outer(before, before))
        return np.concatenate([self.body.mass * travel, second[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]])

    def motion(self, time: float) -> tuple[float, float, float]:
        """Position, speed and acceleration of a quintic step."""
        value, slope, bend = quintic_step((time - self.start) / self.duration)
        return self.travel * value, self.travel * slope / self.duration, self.travel * bend / self.duration**2


def slosh(mass: float, position: ArrayLike, frequency: float, damping: float = 0.02) -> Appendage:
    """Fuel as a small ball on three springs: mass [kg], position at rest in the base frame [m], frequency [Hz]."""
    body = Body(mass, np.asarray(position, dtype=float), 1e-4 * mass * np.eye(3))
    return Appendage(body, slides=list(np.eye(3)), frequency=frequency, damping=damping)


def panel(
    mass: float, size: Sequence[float], anchor: ArrayLike, hinge: ArrayLike, frequency: float, damping: float = 0.005
) -> Appendage:
    """Rectangular panel, 2 cm thick, on a sprung hinge.

    Parameters
    ----------
    mass : float; mass [kg]
    size : (length, width); lengths of the edges [m]; the length points away from the base's origin
    anchor : (3,) array_like; middle of the inner edge, base frame [m]
    hinge : (3,) array_like; axis of the hinge, base axes; the length is made perpendicular to it
    frequency : float; natural frequency with the base held [Hz]
    damping : float; relative to critical
    """
    length, width = size
    root, across = np.asarray(anchor, dtype=float), np.asarray(hinge, dtype=float) / np.linalg.norm(hinge)
    along = root - across * (across @ root)
    along /= np.linalg.norm(along)
    thickness = 0.02
    squares = np.array([length, width, thickness]) ** 2
    moments = mass / 12.0 * (squares.sum() - squares)
    axes = np.stack([along, across, np.cross(along, across)], axis=1)
    body = Body(mass, root + 0.5 * length * along, axes * moments @ axes.T)
    return Appendage(body, hinges=[across], anchor=tuple(root), frequency=frequency, damping=damping)


# time, rotation matrix base -> orbit axes, rate in base axes -> force and torque at the base origin, base axes
Field = Callable[[float, Array, Array], tuple[Array, Array]]


def _pushed(direction: Callable[[float], Array], force: float, cp: ArrayLike) -> Field:
    """Constant force along a direction given in orbit axes, at a point of the base."""
    point = np.asarray(cp, dtype=float)

    def push(time: float, attitude: Array, rate: Array) -> tuple[Array, Array]:
        vector = force * (attitude.T @ direction(time))
        return vector, cross(point, vector)

    return push


def drag(orbit: Orbit, force: float, cp: ArrayLike) -> Field:
    """Air drag: constant force [N] against the velocity at the centre of pressure [m, base frame]."""
    return _pushed(lambda time: -orbit.heading(time), force, cp)


def sunlight(orbit: Orbit, force: float, cp: ArrayLike) -> Field:
    """Solar pressure: constant force [N] away from the Sun at the centre of pressure [m, base frame]."""
    if orbit.sun is None:
        raise ValueError("solar pressure needs the Sun's direction; give Orbit(sun=...)")
    away = -orbit.from_node(orbit.sun)
    return _pushed(lambda time: away, force, cp)


def magnet(orbit: Orbit, moment: ArrayLike) -> Field:
    """Torque of a magnetic moment [A m2, base axes] in the Earth's field."""
    dipole = np.asarray(moment, dtype=float)
    return lambda time, attitude, rate: (np.zeros(3), cross(dipole, attitude.T @ orbit.magnetic_field(time)))


def leak(force: ArrayLike = (0.0, 0.0, 0.0), torque: ArrayLike = (0.0, 0.0, 0.0)) -> Field:
    """Constant force [N] and torque about the base origin [N m], base axes."""
    wrench = np.asarray(force, dtype=float), np.asarray(torque, dtype=float)
    return lambda time, attitude, rate: wrench


def braking(coefficients: ArrayLike) -> Field:
    """Torque against the rate, -coefficients * rate [N m s], base axes."""
    factor = np.asarray(coefficients, dtype=float)
    return lambda time, attitude, rate: (np.zeros(3), -factor * rate)


def pulses(
    torque: ArrayLike, *, every: float, length: float, start: float = 0.0, force: ArrayLike = (0.0, 0.0, 0.0)
) -> Field:
    """Pulses of torque, and of force at the base origin, base axes; their edges must be ends of integration steps."""
    on, off = (np.asarray(force, dtype=float), np.asarray(torque, dtype=float)), (np.zeros(3), np.zeros(3))

    def pulse(time: float, attitude: Array, rate: Array) -> tuple[Array, Array]:
        return on if time >= start and (time - start) % every < length else off

    return pulse


def snap(torque: ArrayLike, *, start: float, decay: float) -> Field:
    """Reaction of a panel that snaps at a sample time: its torque on the base, base axes, dies away within `decay` [s].

    The panel keeps the angular momentum that it takes from the base, and the base turns it with itself.
    """
    vector = np.asarray(torque, dtype=float)

    def react(time: float, attitude: Array, rate: Array) -> tuple[Array, Array]:
        left = np.exp((start - time) / decay) if time >= start else 1.0
        taken = -decay * (1.0 - left) * vector
        return np.zeros(3), (vector * left if time >= start else np.zeros(3)) - cross(rate, taken)

    return react


def outer_torque(history: Callable[[float], ArrayLike]) -> Field:
    """Torque of any history in orbit axes [N m], which do not rotate."""
    return lambda time, attitude, rate: (np.zeros(3), attitude.T @ np.asarray(history(time), dtype=float))


@dataclass(frozen=True)
class SpunWheel:
    """Reaction of a wheel whose momentum [N m s] along an axis of the base is piecewise linear in time; a `Field`."""

    axis: Array
    times: Array
    momentum: Array

    def __call__(self, time: float, attitude: Array, rate: Array) -> tuple[Array, Array]:
        """Return no force, and what the wheel takes from the base's momentum."""
        piece = min(max(int(np.searchsorted(self.times, time, side="right")) - 1, 0), len(self.times) - 2)
        slope = (self.momentum[piece + 1] - self.momentum[piece]) / (self.times[piece + 1] - self.times[piece])
        spin = self.momentum[piece] + slope * (time - self.times[piece])
        return np.zeros(3), -slope * self.axis - cross(rate, spin * self.axis)
