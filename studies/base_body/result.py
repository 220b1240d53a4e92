"""The computation of all numbers of the study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.inference import Identification
from bayesid.simulation.sensors import SensorKind, StarTracker
from studies.base_body import paper
from studies.base_body.information import ARM, STAR, Information
from studies.base_body.noise_free import NoiseFree, run_noise_free
from studies.base_body.readings import Reading, read_sigmas
from studies.base_body.sampled import encoder_grades, sample_posterior
from studies.base_body.setting import slowest
from studies.common.ets7 import INTERVAL, excitation
from studies.common.models import ARM_SPREAD

__all__ = ["GRADES", "BaseBody", "compute"]

GRADES = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
"""Noise per sample of the accelerometers of section 4.3 [m/s2]; its "10e-5" is read as 1e-5."""

DIFFERENCED = float(StarTracker(2.0).sigma(INTERVAL)[0])
"""Noise of the rate that is differenced from the star sensor's attitude [rad/s]."""


@dataclass(frozen=True)
class BaseBody:
    """Numbers of the study.

    Attributes
    ----------
    noise_free : mapping of str to NoiseFree
        Identifications without noise: ``well``, ``poor``, ``well, no gradient`` and, in the full study, more.
    fast, slow : Information
        Information from the paper's manoeuvre, and from the same within the flight rules of ETS-VII.
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
    """

    noise_free: Mapping[str, NoiseFree]
    fast: Information
    slow: Information
    grades: Mapping[str, Floats]
    readings: list[Reading]
    slowness: float
    sampled: Mapping[str, Identification]

    @property
    def precision(self) -> dict[str, Floats]:
        """Relative standard deviations (10,) by speed and knowledge of the arm, with the coarsest accelerometer."""
        sigma = {SensorKind.ATTITUDE: STAR, SensorKind.ACCEL: GRADES[0]}
        return {
            f"{speed}, arm {arm}": information.relative_sd(sigma, known)
            for speed, information in (("permitted", self.slow), ("faster", self.fast))
            for arm, known in (("exact", (ARM,)), ("5 %", ()))
        }


def compute(*, full: bool, seed: int) -> BaseBody:
    """Compute all numbers."""
    fast = Information.of(excitation(paper.EXCITATION))
    slowness = slowest(paper.EXCITATION)
    grades = {
        "exact": _grades(fast, SensorKind.ATTITUDE, STAR, (ARM,)),
        "exact, differenced": _grades(fast, SensorKind.RATE, DIFFERENCED, (ARM,)),
        "5 %": _grades(fast, SensorKind.ATTITUDE, STAR, ()),
    }
    sampled = {}
    if full:
        grades["exact, encoders"] = np.array(encoder_grades(GRADES, seed))
        sampled = {"exact": sample_posterior(0.0, seed), "5 %": sample_posterior(ARM_SPREAD, seed)}
    return BaseBody(
        noise_free=run_noise_free(full=full),
        fast=fast,
        slow=Information.of(excitation(paper.EXCITATION, slowness), step=4.0),
        grades=grades,
        readings=read_sigmas(fast),
        slowness=slowness,
        sampled=sampled,
    )


def _grades(information: Information, kind: SensorKind, sigma: float, known: tuple[str, ...]) -> Floats:
    return np.array([information.relative_sd({kind: sigma, SensorKind.ACCEL: grade}, known) for grade in GRADES])
