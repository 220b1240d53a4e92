"""Orbit of the robot: zenith, gravity gradient, velocity and Sun in the orbit axes of a recording.

Orbit axes do not rotate: x is the zenith at time 0 of the recording, z the orbit normal, y along-track. The paper notes
that its equations (14)-(16) hold for any eccentricity; it changes only the zenith's angle and the radius over time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats

__all__ = ["EARTH", "EARTH_RADIUS", "Orbit", "OrbitState"]

EARTH = 3.986004418e14
"""Earth's gravitational parameter [m3/s2]."""

EARTH_RADIUS = 6.378137e6
"""Earth's radius at the equator [m], where the ground is nearest to an orbit."""


class OrbitState(NamedTuple):
    """State of the orbit at T times, with vectors in orbit axes.

    Attributes
    ----------
    zenith : (T, 3) array
        Unit vectors from the Earth's centre.
    gradient : (T,) array
        Gravity gradient mu / r^3 [1/s2].
    velocity : (T, 3) array
        Unit vectors along the direction of motion.
    sun : (T, 3) array
        Unit vectors to the Sun, zero where its direction is unknown.
    argument_of_latitude : (T,) array
        Argument of latitude [rad].
    north : (T, 3) array
        Unit vectors along the Earth's axis to the north, zero where the inclination is unknown.
    """

    zenith: Floats
    gradient: Floats
    velocity: Floats
    sun: Floats
    argument_of_latitude: Floats
    north: Floats


@dataclass(frozen=True)
class Orbit:
    """Kepler orbit around the Earth.

    Parameters
    ----------
    radius : float
        Semi-major axis [m].
    eccentricity : float
        Eccentricity, from 0 to less than 1.
    inclination : float, optional
        Inclination against the equator [rad].
    argument_of_perigee : float
        Argument of perigee [rad].
    sun : (3,) array_like, optional
        Unit vector to the Sun in Earth-centred axes: ascending node, along-orbit, normal.
    """

    radius: float
    eccentricity: float = 0.0
    inclination: float | None = None
    argument_of_perigee: float = 0.0
    sun: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        if not self.radius > 6.3e6:
            raise InputError(
                f"orbit radius {self.radius:g} m lies inside the Earth",
                remedy="Give it in metres, from the Earth's centre",
            )
        if not 0.0 <= self.eccentricity < 1.0:
            raise InputError(f"eccentricity {self.eccentricity:g} is not in [0, 1)", remedy="Give a closed orbit")

    @property
    def mean_motion(self) -> float:
        """Mean angular rate [rad/s]."""
        return float(np.sqrt(EARTH / self.radius**3))

    @property
    def perigee_altitude(self) -> float:
        """Smallest altitude above the equatorial radius [m]."""
        return self.radius * (1.0 - self.eccentricity) - EARTH_RADIUS

    @property
    def perigee_speed(self) -> float:
        """Largest speed along the orbit [m/s]."""
        return float(np.sqrt(EARTH / self.radius * (1.0 + self.eccentricity) / (1.0 - self.eccentricity)))

    def state(self, time: ArrayLike, argument_of_latitude: float = 0.0) -> OrbitState:
        """Return the state of the orbit.

        Parameters
        ----------
        time : (T,) array_like
            Times since the start of the recording [s].
        argument_of_latitude : float
            Argument of latitude at time 0 [rad].
        """
        t = np.asarray(time, dtype=float)
        anomaly_start = argument_of_latitude - self.argument_of_perigee
        anomaly = self._true_anomaly(t, anomaly_start)
        angle = anomaly - anomaly_start
        e = self.eccentricity
        distance = self.radius * (1.0 - e**2) / (1.0 + e * np.cos(anomaly))
        zeros = np.zeros_like(t)
        zenith = np.stack([np.cos(angle), np.sin(angle), zeros], axis=-1)
        radial, along = e * np.sin(anomaly), 1.0 + e * np.cos(anomaly)
        transverse = np.stack([-np.sin(angle), np.cos(angle), zeros], axis=-1)
        velocity = (radial[..., None] * zenith + along[..., None] * transverse) / np.hypot(radial, along)[..., None]
        return OrbitState(
            zenith=zenith,
            gradient=EARTH / distance**3,
            velocity=velocity,
            sun=np.broadcast_to(self._sun(argument_of_latitude), zenith.shape),
            argument_of_latitude=argument_of_latitude + angle,
            north=np.broadcast_to(self._north(argument_of_latitude), zenith.shape),
        )

    def _true_anomaly(self, t: Floats, start: float) -> Floats:
        e = self.eccentricity
        if e == 0.0:
            return start + self.mean_motion * t
        half = np.sqrt((1.0 - e) / (1.0 + e))
        turns = np.round(start / (2.0 * np.pi)) * 2.0 * np.pi
        eccentric_start = 2.0 * np.arctan(half * np.tan((start - turns) / 2.0)) + turns
        mean = eccentric_start - e * np.sin(eccentric_start) + self.mean_motion * t
        eccentric = mean + e * np.sin(mean)
        for _ in range(50):  # Newton's iteration on Kepler's equation
            step = (eccentric - e * np.sin(eccentric) - mean) / (1.0 - e * np.cos(eccentric))
            eccentric = eccentric - step
            if np.abs(step).max() < 1e-15 * (1.0 + np.abs(eccentric).max()):
                break
        turns = np.round(eccentric / (2.0 * np.pi)) * 2.0 * np.pi
        return 2.0 * np.arctan(np.tan((eccentric - turns) / 2.0) / half) + turns

    def _sun(self, argument_of_latitude: float) -> Floats:
        return np.zeros(3) if self.sun is None else _from_node(np.asarray(self.sun), argument_of_latitude)

    def _north(self, argument_of_latitude: float) -> Floats:
        i = self.inclination
        return np.zeros(3) if i is None else _from_node(np.array([0.0, np.sin(i), np.cos(i)]), argument_of_latitude)


def _from_node(vector: Floats, argument_of_latitude: float) -> Floats:
    """Return a direction in axes (ascending node, along-orbit, normal) as a unit vector in orbit axes."""
    cos, sin = np.cos(argument_of_latitude), np.sin(argument_of_latitude)
    node, along, normal = vector / np.linalg.norm(vector)
    return np.array([cos * node + sin * along, -sin * node + cos * along, normal])
