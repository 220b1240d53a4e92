"""What the paper's noise sigma of 0.04 and 0.009, printed without units, can and cannot mean."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesid.simulation.sensors import SensorKind
from studies.base_body import paper
from studies.base_body.information import ACCEL_BIAS, ARM, TILT, UNIT, Information
from studies.common.quantities import MASS, MOMENTS

__all__ = ["CLAIM", "Reading", "read_sigmas"]

CLAIM = 0.02
"""Error of the solution that the paper reports for sigma 0.04."""

UNITS = (
    ("deg/s", SensorKind.RATE, np.pi / 180.0),
    ("rad/s", SensorKind.RATE, 1.0),
    ("m/s2", SensorKind.ACCEL, 1.0),
    ("rad, of attitude", SensorKind.ATTITUDE, 1.0),
    ("deg, of attitude", SensorKind.ATTITUDE, np.pi / 180.0),
)
"""Units that a sigma may have: name, sensor, and size in the SI unit; the first is the one that studies take."""


@dataclass(frozen=True)
class Reading:
    """Consequences of one unit that a sigma may have.

    Attributes
    ----------
    sigma : float
        Sigma as printed.
    unit : str
        Unit that is assumed.
    fraction : float
        Noise of one sample as a fraction of the signal's peak.
    mass, moment : float
        Relative standard deviation of the mass and of the worst moment of inertia, without prior, from one manoeuvre.
    """

    sigma: float
    unit: str
    fraction: float
    mass: float
    moment: float

    @property
    def manoeuvres(self) -> float:
        """Number of manoeuvres to average for an error of 2 % in the mass and all moments."""
        return float(max(1.0, (max(self.mass, self.moment) / CLAIM) ** 2))


def read_sigmas(information: Information) -> list[Reading]:
    """Evaluate every unit; all sensors used get noise of the same fraction of their signals' peaks."""
    readings = []
    for sigma in paper.SIGMAS:
        for unit, kind, scale in UNITS:
            readings.append(_reading(information, sigma, unit, sigma * scale / information.peak[kind], kind))
        readings.append(_reading(information, sigma, "of the peak", sigma, SensorKind.RATE))
    return readings


def _reading(information: Information, sigma: float, unit: str, fraction: float, kind: SensorKind) -> Reading:
    motion = SensorKind.ATTITUDE if kind is SensorKind.ATTITUDE else SensorKind.RATE
    peak = information.peak
    # computed where the prior does not matter, then scaled: standard deviations are proportional to the noise
    small = UNIT / peak[motion]
    noise = {motion: small * peak[motion], SensorKind.ACCEL: small * peak[SensorKind.ACCEL]}
    width = information.relative_sd(noise, (ARM, TILT, ACCEL_BIAS)) * fraction / small
    return Reading(sigma, unit, fraction, float(width[MASS]), float(width[MOMENTS].max()))
