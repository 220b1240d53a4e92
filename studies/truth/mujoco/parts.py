"""Hidden parts of a robot in MuJoCo: a wheel, appendages on springs, a moved mass, flexible joints, thrust."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from studies.truth.bodies import Body
from studies.truth.numerics import Array, quintic_step

__all__ = ["Appendage", "Flexibility", "Mover", "Rotor", "Thrust", "panel", "slosh"]


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
class Appendage:
    """A body on the base with joints held by springs, which no recording shows: a solar panel, a tank of fuel.

    Parameters
    ----------
    body : Body
        In base axes; the centre of mass relative to the base origin.
    hinges, slides : sequence of (3,) array_like
        Axes of its joints, base axes.
    anchor : (3,) array_like
        Point through which the hinges go, base frame [m].
    frequency : float
        Natural frequency of each joint with the base held and the other joints locked [Hz].
    damping : float
        Relative to critical.
    """

    body: Body
    hinges: Sequence[ArrayLike] = ()
    slides: Sequence[ArrayLike] = ()
    anchor: tuple[float, float, float] = (0.0, 0.0, 0.0)
    frequency: float = 0.2
    damping: float = 0.01


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
    mass : float
        Mass [kg].
    size : (length, width)
        Lengths of the edges [m]; the length points away from the base's origin.
    anchor : (3,) array_like
        Middle of the inner edge, base frame [m].
    hinge : (3,) array_like
        Axis of the hinge, base axes; the length is made perpendicular to it.
    frequency : float
        Natural frequency with the base held [Hz].
    damping : float
        Relative to critical.
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
