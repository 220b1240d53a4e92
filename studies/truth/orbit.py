"""Kepler orbits: zenith, direction of flight, and the Earth's magnetic field along them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from studies.truth.numerics import Array

MU = 3.986004418e14  # gravitational parameter of the Earth [m3/s2]
EARTH_RADIUS = 6371.2e3  # radius of the magnetic field's reference sphere [m]
EARTH_FIELD = 3.12e-5  # magnetic field on the equator of that sphere [T]


@dataclass(frozen=True)
class Orbit:
    """A Kepler orbit; angles [rad], radius is the semi-major axis [m], sun is a unit vector (node, along, normal)."""

    radius: float = 6.878e6
    eccentricity: float = 0.0
    argument_of_perigee: float = 0.0
    argument_of_latitude: float = 0.0
    inclination: float | None = None
    sun: tuple[float, float, float] | None = None

    def _anomaly(self, time: float) -> tuple[float, float]:
        """Anomaly (true) [rad] and distance from the Earth's centre [m]."""
        start = self.argument_of_latitude - self.argument_of_perigee
        mean_motion = np.sqrt(MU / self.radius**3)
        if self.eccentricity == 0.0:
            return start + mean_motion * time, self.radius
        e, squash = self.eccentricity, np.sqrt((1.0 - self.eccentricity) / (1.0 + self.eccentricity))
        eccentric = 2.0 * np.arctan2(squash * np.sin(start / 2.0), np.cos(start / 2.0))
        mean = eccentric - e * np.sin(eccentric) + mean_motion * time
        eccentric = mean + e * np.sin(mean)
        for _ in range(20):
            eccentric -= (eccentric - e * np.sin(eccentric) - mean) / (1.0 - e * np.cos(eccentric))
        anomaly = 2.0 * np.arctan2(np.sin(eccentric / 2.0), squash * np.cos(eccentric / 2.0))
        return anomaly, self.radius * (1.0 - e * np.cos(eccentric))

    def zenith(self, time: float) -> tuple[Array, float]:
        """Zenith in orbit axes (x = zenith at time 0, z = orbit normal) and mu / R^3 [1/s2]."""
        anomaly, distance = self._anomaly(time)
        angle = anomaly - (self.argument_of_latitude - self.argument_of_perigee)
        return np.array([np.cos(angle), np.sin(angle), 0.0]), MU / distance**3

    def heading(self, time: float) -> Array:
        """Direction of the velocity in orbit axes."""
        anomaly, _ = self._anomaly(time)
        start = self.argument_of_latitude - self.argument_of_perigee
        # in the axes of the perigee the velocity is along (-sin, e + cos) of the true anomaly
        x, y = -np.sin(anomaly), self.eccentricity + np.cos(anomaly)
        c, s = np.cos(start), np.sin(start)
        return np.array([c * x + s * y, c * y - s * x, 0.0]) / np.hypot(x, y)

    def from_node(self, vector: ArrayLike) -> Array:
        """Turn a vector given along node, along-orbit, normal into orbit axes."""
        x, y, z = np.asarray(vector, dtype=float)
        c, s = np.cos(self.argument_of_latitude), np.sin(self.argument_of_latitude)
        return np.array([c * x + s * y, c * y - s * x, z])

    def magnetic_field(self, time: float) -> Array:
        """Field [T] of a centred dipole along the Earth's axis, orbit axes."""
        if self.inclination is None:
            raise ValueError("the magnetic field needs the orbit's inclination; give Orbit(inclination=...)")
        up, gradient = self.zenith(time)
        north = self.from_node([0.0, np.sin(self.inclination), np.cos(self.inclination)])
        size = EARTH_FIELD * EARTH_RADIUS**3 * gradient / MU
        return -size * (3.0 * (north @ up) * up - north)
