"""The computation of all numbers of the study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from matplotlib.figure import Figure

from bayesid._math.arrays import Floats
from bayesid.inference import Identification
from bayesid.simulation.sensors import Kind, StarTracker
from studies.base_body import paper
from studies.base_body.information import ARM, STAR, Information
from studies.base_body.noise_free import NoiseFree, run_noise_free
from studies.base_body.readings import Reading, read_sigmas
from studies.base_body.sampled import encoder_grades, sample_posterior
from studies.base_body.setting import slowest
from studies.common.ets7 import INTERVAL, excitation
from studies.common.models import ARM_SPREAD
from studies.common.quantities import MASS

__all__ = ["GRADES", "BaseBody", "compute"]

GRADES = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
"""Noise per sample of the accelerometers of section 4.3 [m/s2]; its "10e-5" is read as 1e-5."""

DIFFERENCED = float(StarTracker(2.0).sigma(INTERVAL)[0])
"""Noise of the rate that is differenced from the star sensor's attitude [rad/s]."""


@dataclass(frozen=True)
class BaseBody:
    """Numbers and figures of the study.

    Attributes
    ----------
    noise_free : mapping of str to NoiseFree
        Identifications without noise: ``well``, ``poor``, ``well, no gradient`` and, in the full study, more.
    fast, slow : Information
        Information from the paper's manoeuvre, and from the same within the flight rules of ETS-VII; the latter in the
        full study only.
    grades : mapping of str to (5, 10) array
        Relative standard deviations per accelerometer of `GRADES` and quantity. ``exact`` and ``5 %`` say how the arm
        is known, with the star sensor's attitude; ``exact, differenced`` has the differenced rate instead, and
        ``exact, encoders`` has measured joints.
    readings : list of Reading
        Units that the paper's noise sigmas may have.
    slowness : float
        Factor by which the paper's manoeuvre must be slowed down for ETS-VII.
    sampled : mapping of str to Identification
        Sampled posteriors ``exact`` and ``5 %``, in the full study only.
    figures : mapping of str to Figure
        Figures of the report.
    """

    noise_free: Mapping[str, NoiseFree]
    fast: Information
    slow: Information | None
    grades: Mapping[str, Floats]
    readings: list[Reading]
    slowness: float
    sampled: Mapping[str, Identification]
    figures: dict[str, Figure] = field(default_factory=dict)

    @property
    def arm_ratio(self) -> float:
        """Ratio of the mass's standard deviation with the arm known to 5 % to that with the arm known exactly.

        Both are with the coarsest accelerometer.
        """
        return float(self.grades["5 %"][0, MASS] / self.grades["exact"][0, MASS])


def compute(*, full: bool, seed: int) -> BaseBody:
    """Compute all numbers."""
    fast = Information.of(excitation(paper.EXCITATION))
    slowness = slowest(paper.EXCITATION)
    grades = {
        "exact": _grades(fast, Kind.ATTITUDE, STAR, (ARM,)),
        "exact, differenced": _grades(fast, Kind.RATE, DIFFERENCED, (ARM,)),
        "5 %": _grades(fast, Kind.ATTITUDE, STAR, ()),
    }
    sampled = {}
    if full:
        grades["exact, encoders"] = np.array(encoder_grades(GRADES, seed))
        sampled = {"exact": sample_posterior(0.0, seed), "5 %": sample_posterior(ARM_SPREAD, seed)}
    return BaseBody(
        noise_free=run_noise_free(full=full),
        fast=fast,
        slow=Information.of(excitation(paper.EXCITATION, slowness), step=4.0) if full else None,
        grades=grades,
        readings=read_sigmas(fast),
        slowness=slowness,
        sampled=sampled,
    )


def _grades(information: Information, kind: Kind, sigma: float, known: tuple[str, ...]) -> Floats:
    return np.array([information.relative_sd({kind: sigma, Kind.ACCEL: grade}, known) for grade in GRADES])
