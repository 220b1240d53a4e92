"""Quantities that effects receive at an instant of the simulation, and those that they return."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jax import Array

from bayesid._math.arrays import Floats, Traceable

__all__ = ["Composite", "Environment", "Instant", "Modes", "Readings", "Resonance", "Wrench"]


class Composite(NamedTuple):
    """Composite body of the whole system, in base axes, with derivatives relative to the base.

    Attributes
    ----------
    mass : scalar array
        Mass [kg].
    com, com_rate, com_acceleration : (3,) arrays
        Centre of mass and its two derivatives [m, m/s, m/s2].
    inertia, inertia_rate, inverse : (3, 3) arrays
        Inertia about the centre of mass, its derivative and its inverse [kg m2, kg m2/s, 1/(kg m2)].
    second_moment : (3, 3) array
        Second moment of mass about the centre of mass [kg m2].
    spin, spin_rate : (3,) arrays
        Angular momentum relative to the base about the centre of mass, and its derivative [N m s, N m].
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
    """Known quantities of an instant; those of the orbit are zero for a robot without an orbit.

    Attributes
    ----------
    time : scalar array
        Time since the start of the recording [s].
    zenith, velocity, sun, north : (3,) arrays
        Directions from the Earth's centre, of motion, to the Sun and of the Earth's north pole, orbit axes.
    gradient : scalar array
        Gravity gradient mu / r^3 [1/s2].
    argument_of_latitude : scalar array
        Argument of latitude [rad].
    wheel_momentum, wheel_torque : (3,) arrays
        Recorded momentum of the wheels and its derivative, base axes [N m s, N m].
    wrench : (6,) array
        Known force and torque about the base origin, base axes [N, N m].
    wheels : (W, 5) array
        Angle, speed and its three derivatives of each wheel whose speed is recorded
        (`bayesid.recording.wheel_motion.COURSE`).
    sampled : scalar array
        One where sensors are read; zero at the nodes of the integration, between which fast lines average out.
    recording : scalar array
        Number of the recording, from zero.
    """

    time: Traceable
    zenith: Traceable
    gradient: Traceable
    velocity: Traceable
    sun: Traceable
    argument_of_latitude: Traceable
    north: Traceable
    wheel_momentum: Traceable
    wheel_torque: Traceable
    wrench: Traceable
    wheels: Traceable = np.zeros((0, 5))
    sampled: Traceable = 1.0
    recording: Traceable = 0


class Instant(NamedTuple):
    """One instant of a simulation, as the hooks of effects receive it.

    Attributes
    ----------
    environment : Environment
        Known quantities of the instant.
    body : Composite
        Composite body.
    attitude : (3, 3) array
        Rotation from base to orbit axes.
    rate : (3,) array
        Angular velocity of the base [rad/s]; zero where `Effect.momentum` is asked for the momentum, from which it
        follows, but not where it is asked for its derivative.
    rate_change, acceleration : (3,) arrays
        Derivative of the rate, and specific force at the base origin [rad/s2, m/s2]; available to
        `Effect.specific_force` only.
    """

    environment: Environment
    body: Composite
    attitude: Array
    rate: Array
    rate_change: Array
    acceleration: Array

    def to_base(self, vector: Array) -> Array:
        """Return a vector in base axes from one in orbit axes."""
        return self.attitude.T @ vector


class Wrench(NamedTuple):
    """External force and its torque about the base origin, base axes [N, N m]."""

    force: Array
    torque: Array


class Modes(NamedTuple):
    """Vibration modes of parts that move in the base, n of them in mass-normalised coordinates (Likins 1970).

    Mode i follows ``q'' + 2 damping omega q' + omega^2 q = -linear . a - angular . dw/dt - moment : (w w' - w^2 1)``
    with ``a`` the acceleration of the base origin, and has the momentum ``linear q'`` and, about the base origin,
    ``angular q'``. With ``phi(r)`` the displacement of unit amplitude, ``linear`` is the integral of phi over the mass,
    ``angular`` that of r x phi and ``moment`` that of the outer product of phi and r.

    Attributes
    ----------
    omega : (n,) array
        Angular frequencies for a fixed base [rad/s].
    damping : (n,) array
        Damping ratios.
    linear : (n, 3) array
        Linear momenta of unit modal speed [sqrt(kg)].
    angular : (n, 3) array
        Angular momenta of unit modal speed about the base origin [sqrt(kg) m].
    moment : (n, 3, 3) array
        Moments that couple the modes to the centrifugal acceleration [sqrt(kg) m].
    """

    omega: Array
    damping: Array
    linear: Array
    angular: Array
    moment: Array


class Readings(NamedTuple):
    """Readings of the sensors at T sample times, in sensor axes.

    Attributes
    ----------
    time : (T,) array
        Sample times [s].
    channels : dict of str to (T, axes) array
        Readings of every declared sensor by the family of its channels; ``readings.rate`` is short for
        ``readings.channels["rate"]``.
    torque : (T, n) array
        Torques of all joints of the robot [N m or N]; n is 0 where no torque is measured.
    recording : scalar array
        Number of the recording, from zero.
    """

    time: Array
    channels: dict[str, Array]
    torque: Array
    recording: Traceable = 0

    def __getattr__(self, family: str) -> Array:
        """Return the readings of one sensor by the family of its channels."""
        if family.startswith("_") or family not in self.channels:
            raise AttributeError(f"no sensor {family!r} is declared")
        return self.channels[family]

    def replace(self, **changed: Array) -> Readings:
        """Return the readings with those of some sensors replaced."""
        return self._replace(channels={**self.channels, **changed})


class Resonance(NamedTuple):
    """Frequency at which a residual suggests a hidden vibration.

    Attributes
    ----------
    frequency : float
        Frequency [Hz].
    coupling : (6, 6) array
        Sum over the modes of the outer products of linear and angular momentum per modal speed [sqrt(kg), sqrt(kg) m]
        that fits the residual best, which need not be positive semidefinite.
    damping : float
        Damping ratio.
    """

    frequency: float
    coupling: Floats
    damping: float = 0.01
