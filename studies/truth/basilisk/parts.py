"""Hidden parts of a robot in Basilisk: a hinged panel, fuel slosh, a balanced reaction wheel, a leak."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.truth.bodies import Body
from studies.truth.urdf import rotation_from_rpy

__all__ = ["BasiliskHidden", "Leak", "Panel", "Slosh", "Wheel"]


@dataclass(frozen=True)
class Panel:
    """A rigid panel hinged on the base and held by a spring; at rest at time 0.

    Parameters
    ----------
    mass : float
        Mass [kg].
    hinge : (3,) tuple
        A point of the hinge line, base frame [m].
    rpy : (3,) tuple
        Roll, pitch, yaw of the panel's axes at rest relative to the base; y is the hinge line.
    reach : float
        Distance of the centre of mass from the hinge, along the panel's -x [m].
    inertia : (3,) tuple
        Moments about the centre of mass in the panel's axes [kg m2].
    frequency : float
        With the base held [Hz].
    damping : float
        Relative to critical.
    """

    mass: float = 3.0
    hinge: tuple[float, float, float] = (-0.5, 0.1, 0.2)
    rpy: tuple[float, float, float] = (0.5, 0.3, -0.4)
    reach: float = 0.7
    inertia: tuple[float, float, float] = (0.31, 0.51, 0.8)
    frequency: float = 0.25
    damping: float = 0.01

    @property
    def body(self) -> Body:
        """The panel at rest, base axes."""
        axes = rotation_from_rpy(self.rpy)
        return Body(self.mass, np.array(self.hinge) - self.reach * axes[:, 0], axes @ np.diag(self.inertia) @ axes.T)


@dataclass(frozen=True)
class Slosh:
    """Three particles on springs at one point of the base, each free along one base axis; at rest at time 0.

    `mass` is that of each particle, which is the mass that sloshes along any direction: the `mass` of the contract's
    fuel-slosh. The two other particles move with the base along that direction, so that 3 `mass` is on board at rest.
    Against one particle free in all directions this differs by products of displacement and rate, both small.
    """

    mass: float = 2.0
    position: tuple[float, float, float] = (-0.2, 0.3, -0.4)
    frequency: float = 0.2
    damping: float = 0.01

    @property
    def body(self) -> Body:
        """The three particles at rest, base axes."""
        return Body(3.0 * self.mass, np.array(self.position), np.zeros((3, 3)))


@dataclass(frozen=True)
class Wheel:
    """A balanced wheel that spins freely, without motor torque.

    Its spin momentum relative to inertial space is constant; that relative to the base changes by `spin_inertia` times
    the change of the base's rate, hence the small default.
    """

    momentum: tuple[float, float, float] = (0.02, -0.03, 0.015)
    spin_inertia: float = 1e-4


@dataclass(frozen=True)
class Leak:
    """A constant force and torque at the base origin, base axes."""

    force: tuple[float, float, float] = (4e-4, -3e-4, 5e-4)
    torque: tuple[float, float, float] = (4e-5, 6e-5, -5e-5)


@dataclass(frozen=True)
class BasiliskHidden:
    """What the study's model does not know."""

    panel: Panel | None = None
    slosh: Slosh | None = None
    wheel: Wheel | None = None
    leak: Leak | None = None
