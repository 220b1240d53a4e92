"""What an effect sees of an instant of the simulation, and what it may give back."""

from __future__ import annotations

from typing import NamedTuple

from jax import Array

from bayesid._math.arrays import Floats, Traceable

__all__ = ["Composite", "Environment", "Instant", "Modes", "Readings", "Resonance", "Wrench"]


class Composite(NamedTuple):
    """The whole system seen as one body, in base axes; derivatives are relative to the base.

    ``com`` is the centre of mass with two derivatives; inertia, second moment and spin (angular momentum relative to
    the base) are about it.
    """

    mass: Array
    com: Array
    com_rate: Array
    com_acceleration: Array
    inertia: Array
    inertia_rate: Array
    inverse: Array
    second_moment: Array
    spin: Array
    spin_rate: Array


class Environment(NamedTuple):
    """What is known of an instant beforehand. Orbit vectors are in orbit axes, zero away from orbit."""

    time: Traceable
    zenith: Traceable
    gradient: Traceable  # mu / r^3 [1/s2]
    velocity: Traceable
    sun: Traceable
    argument_of_latitude: Traceable  # argument of latitude [rad]
    north: Traceable  # direction of the Earth's north pole
    wheel_momentum: Traceable  # recorded [N m s]
    wheel_torque: Traceable  # its derivative
    wrench: Traceable  # known force and torque about the base origin, base axes (6,)


class Instant(NamedTuple):
    """One instant of a simulation, as an effect sees it.

    ``attitude`` rotates base axes to orbit axes. ``rate`` is zero while momenta are being summed: it follows from
    them. ``rate_change`` and ``acceleration`` (of the base origin, non-gravitational) are known to
    `Effect.specific_force` only.
    """

    environment: Environment
    body: Composite
    attitude: Array
    rate: Array
    rate_change: Array
    acceleration: Array

    def to_base(self, vector: Array) -> Array:
        """Rotate a vector from orbit axes to base axes."""
        return self.attitude.T @ vector


class Wrench(NamedTuple):
    """An external force and its torque about the base origin."""

    force: Array
    torque: Array


class Modes(NamedTuple):
    """Vibration modes of parts that move in the base, in mass-normalised (hybrid) coordinates (Likins 1970).

    Mode i follows ``q'' + 2 damping omega q' + omega^2 q = -linear . a - angular . dw/dt - moment : (w w' - w^2 1)``
    with ``a`` the acceleration of the base origin, and has the momentum ``linear q'`` and, about the base origin,
    ``angular q'``. With ``phi(r)`` the displacement of unit amplitude, ``linear`` is the integral of phi over the mass,
    ``angular`` that of r x phi and ``moment`` that of the outer product of phi and r.
    omega (n,) [rad/s], damping (n,), linear (n, 3) [sqrt(kg)], angular (n, 3) and moment (n, 3, 3) [sqrt(kg) m].
    """

    omega: Array
    damping: Array
    linear: Array
    angular: Array
    moment: Array


class Readings(NamedTuple):
    """What the sensors read at their sample times (T,), sensor axes.

    ``channels`` holds the readings (T, axes) of every declared sensor by the family of its channels, and
    ``readings.rate`` is ``readings.channels["rate"]``; ``torque`` (T, n) has a column for every joint of the robot, or
    none where no torque is measured.
    """

    time: Array
    channels: dict[str, Array]
    torque: Array

    def __getattr__(self, family: str) -> Array:
        """Return the readings of one sensor."""
        if family.startswith("_") or family not in self.channels:
            raise AttributeError(f"no sensor {family!r} is declared")
        return self.channels[family]

    def replace(self, **changed: Array) -> Readings:
        """Return the readings with those of some sensors changed."""
        return self._replace(channels={**self.channels, **changed})


class Resonance(NamedTuple):
    """A frequency at which a residual asks for a hidden vibration.

    frequency [Hz]; coupling (6, 6), the sum over the modes of the outer products of linear and angular momentum per
    modal speed [sqrt(kg), sqrt(kg) m] that fits best, no matter whether any mode can have it.
    """

    frequency: float
    coupling: Floats
