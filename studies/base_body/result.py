"""What the study computes: numbers of all its parts in one place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bayesid.inference import Identification
from bayesid.simulation.sensors import Kind, StarTracker
from studies.base_body import paper
from studies.base_body.information import ARM, ARM_SPREAD, STAR, Information
from studies.base_body.noise_free import NoiseFree, run_noise_free
from studies.base_body.readings import Reading, read_sigmas
from studies.base_body.sampled import encoder_grades, sample_posterior
from studies.base_body.setting import INTERVAL, slowest
from studies.common.ets7 import excitation

__all__ = ["GRADES", "BaseBody", "compute"]

Floats = NDArray[np.float64]

GRADES = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
"""Accelerometers of section 4.3 [m/s2]; its "10e-5" is read as 1e-5."""

DIFFERENCED = float(StarTracker(2.0).sigma(INTERVAL)[0])
"""Rate noise from differencing the star sensor [rad/s]."""


@dataclass(frozen=True)
class BaseBody:
    """Numbers and figures of the study.

    Attributes
    ----------
    noise_free : mapping of str to NoiseFree
        ``well``, ``poor``, ``well, no gradient`` and, in the full study, more.
    fast, slow : Information
        Of the paper's manoeuvre, and of the same within the limits of ETS-VII; the latter in the full study only.
    grades : mapping of str to (5, 10) array
        Relative sd per accelerometer of `GRADES` and quantity: ``exact``, ``5 %`` (the arm), each with the star
        sensor's attitude; ``exact, differenced`` with the rate instead; ``exact, encoders`` with measured joints.
    readings : list of Reading
    slowness : float
        How many times slower the paper's manoeuvre must be for ETS-VII.
    sampled : mapping of str to Identification
        ``exact`` and ``5 %``, full study only.
    figures : mapping of str to Figure
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
        """Sd of the base's mass with the arm known to 5 % over that with the arm exact, coarsest accelerometer."""
        return float(self.grades["5 %"][0, 0] / self.grades["exact"][0, 0])


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
        sampled = {
            "exact": sample_posterior(0.0, seed),
            "5 %": sample_posterior(ARM_SPREAD, seed),
        }
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
