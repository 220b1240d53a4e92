"""Largest density of the upper atmosphere against altitude.

The table is that of Wertz and Larson (eds.), Space Mission Analysis and Design, 3rd edition, 1999, inside the rear
cover, for the maximum of the solar cycle. Geomagnetic storms and the bulge on the day side come on top of it (`SURGE`).
The exponential model of Vallado, Fundamentals of Astrodynamics and Applications, 4th edition, 2013, table 8-4, which
knows no solar cycle, is 1.3 times thinner at 200 km, 2.0 times at 400 km and 3.8 times at 800 km.
"""

from __future__ import annotations

import numpy as np

from bayesid.simulation.orbit import EARTH_RADIUS

__all__ = ["SURGE", "largest_density"]

SURGE = 2.0
"""Density that a spacecraft can meet relative to what a model states (ECSS-E-ST-10-04C, 2008, 7.2.1.2, note 1)."""

ALTITUDES = 1e3 * np.array(
    [100, 150, 200, 250, 300, 350, 400, 450, 500, 550, 600, 650, 700, 800, 900, 1000, 1250, 1500], dtype=float
)
"""Altitudes of the table [m]."""

DENSITIES = np.array(
    [
        *(5.10e-7, 2.04e-9, 3.52e-10, 1.06e-10, 3.96e-11, 1.66e-11, 7.55e-12, 3.61e-12, 1.80e-12),
        *(9.25e-13, 4.89e-13, 2.64e-13, 1.47e-13, 4.39e-14, 1.91e-14, 8.84e-15, 2.59e-15, 1.22e-15),
    ]
)
"""Densities at these altitudes at the maximum of the solar cycle [kg/m3]."""


def largest_density(altitude: float) -> float:
    """Return the largest density that a spacecraft can meet at an altitude [m], in kg/m3.

    Between the table's altitudes the logarithm is interpolated. Below 100 km, where no orbit is, the first density
    holds; above 1500 km the density falls as in an isothermal atmosphere under gravity of the inverse square.
    """
    log_density = float(np.interp(altitude, ALTITUDES, np.log(DENSITIES)))
    top, last = ALTITUDES[-1], np.log(DENSITIES[-2:])
    if altitude > top:
        decay = (last[0] - last[1]) / (top - ALTITUDES[-2])
        log_density -= decay * (altitude - top) * (EARTH_RADIUS + top) / (EARTH_RADIUS + altitude)
    return SURGE * float(np.exp(log_density))
