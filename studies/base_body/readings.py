"""What the paper's noise sigma of 0.04 and 0.009, printed without units, can and cannot mean."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesid.simulation.sensors import Kind
from studies.base_body.information import ACCEL_BIAS, ARM, TILT, UNIT, Information

__all__ = ["SIGMAS", "Reading", "read_sigmas"]

Floats = NDArray[np.float64]

SIGMAS = (0.04, 0.009)
"""Introduced into the simulated signals of the paper's reference [16], and found on the data of ETS-VII."""

CLAIM = 0.02
"""Error of the solution that the paper reports for sigma 0.04."""

UNITS = (
    ("rad/s", Kind.RATE, 1.0),
    ("deg/s", Kind.RATE, np.pi / 180.0),
    ("m/s2", Kind.ACCEL, 1.0),
    ("rad, of attitude", Kind.ATTITUDE, 1.0),
    ("deg, of attitude", Kind.ATTITUDE, np.pi / 180.0),
)


@dataclass(frozen=True)
class Reading:
    """One unit that a sigma may have.

    Attributes
    ----------
    sigma : float
        As printed.
    unit : str
    fraction : float
        Of the signal's peak that the noise of one sample is.
    mass, moment : float
        Relative sd of mass and of the worst principal moment without prior, from one manoeuvre.
    """

    sigma: float
    unit: str
    fraction: float
    mass: float
    moment: float

    @property
    def manoeuvres(self) -> float:
        """How many manoeuvres would have to be averaged for an error of 2 % in all of them."""
        return float(max(1.0, (max(self.mass, self.moment) / CLAIM) ** 2))


def read_sigmas(information: Information) -> list[Reading]:
    """Evaluate every reading; all sensors used get noise of the same fraction of their signals' peaks."""
    found = []
    for sigma in SIGMAS:
        for unit, kind, scale in UNITS:
            found.append(_reading(information, sigma, unit, sigma * scale / information.peak[kind], kind))
        found.append(_reading(information, sigma, "of the peak", sigma, Kind.RATE))
    return found


def _reading(information: Information, sigma: float, unit: str, fraction: float, kind: Kind) -> Reading:
    motion = Kind.ATTITUDE if kind is Kind.ATTITUDE else Kind.RATE
    peak = information.peak
    # computed where the prior does not matter, then scaled: widths are proportional to the noise
    small = UNIT / peak[motion]
    noise = {motion: small * peak[motion], Kind.ACCEL: small * peak[Kind.ACCEL]}
    width = information.relative_sd(noise, (ARM, TILT, ACCEL_BIAS)) * fraction / small
    return Reading(sigma, unit, fraction, float(width[0]), float(width[4:7].max()))
