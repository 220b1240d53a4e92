"""Principal moments of one body, in single throws and jointly, against its geometry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

__all__ = ["BodyResult"]

Floats = NDArray[np.floating]


@dataclass(frozen=True)
class BodyResult:
    """Principal moments of one body without the device, ascending [kg m2].

    Attributes
    ----------
    throws : tuple of str
    moments, formal : (throws, 3) array
        Of single throws, with the posterior's standard deviation of each; device, wheel and drag as found jointly.
    joint, joint_formal, joint_jackknife : (3,) array
        Of all throws together; the jackknife takes whole throws out, calibration throws included.
    truth, truth_sd : (3,) array
    """

    name: str
    throws: tuple[str, ...]
    moments: Floats
    formal: Floats
    joint: Floats
    joint_formal: Floats
    joint_jackknife: Floats
    truth: Floats
    truth_sd: Floats

    @property
    def errors(self) -> Floats:
        """Of single throws against the truth [%], shape (throws, 3)."""
        return 100.0 * (self.moments / self.truth - 1.0)

    @property
    def joint_errors(self) -> Floats:
        """Of the joint fit against the truth [%], shape (3,)."""
        return 100.0 * (self.joint / self.truth - 1.0)

    @property
    def mean_error(self) -> float:
        """Mean size of the errors of single throws over throws and moments [%]."""
        return float(np.abs(self.errors).mean())

    @property
    def mean_error_sd(self) -> float:
        """Standard error of `mean_error`, from how throws differ [%]."""
        sizes = np.abs(self.errors).mean(axis=1)
        return float(sizes.std(ddof=1) / np.sqrt(len(sizes)))

    @property
    def largest_error(self) -> float:
        """Largest error of any moment in any throw [%]."""
        return float(np.abs(self.errors).max())

    @property
    def inflation(self) -> float:
        """Factor by which formal standard deviations of single throws are too small, from the throws' scatter alone."""
        freedom = len(self.throws) / (len(self.throws) - 1.0)
        return float(np.sqrt(freedom * (((self.moments - self.moments.mean(axis=0)) / self.formal) ** 2).mean()))

    def held(self, level: float, *, with_truth: bool = False) -> tuple[int, int]:
        """Return how many intervals of single throws hold the truth at a level, and of how many.

        With ``with_truth`` the interval counts what all throws share as well: the truth's own uncertainty, and that of
        the wheel and the device, for which the jackknife of the joint answer stands.
        """
        sd = np.sqrt(self.formal**2 + (self.truth_sd**2 + self.joint_jackknife**2 if with_truth else 0.0))
        inside = np.abs(self.moments - self.truth) < norm.ppf(0.5 + 0.5 * level) * sd
        return int(inside.sum()), inside.size

    @property
    def joint_distance(self) -> Floats:
        """Joint value less truth in units of jackknife and truth's uncertainty together, shape (3,)."""
        return (self.joint - self.truth) / np.hypot(self.joint_jackknife, self.truth_sd)
