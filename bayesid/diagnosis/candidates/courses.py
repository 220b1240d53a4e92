"""Courses in time of a torque or of a sensor's error, weighed in Gram space by the cosines of the generic candidates.

The bank holds the responses to cosines in time of any torque and of an error of each sensor. The response to a course
that acts at an instant, or in pulses, is a combination of them up to their resolution, so that thousands of instants
and periods are compared without a simulation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.candidates.linear_model import Linearisation

__all__ = ["CourseGram", "half_chi2"]

FINE = 400
"""Instants at which a course is sampled for its cosines."""


@dataclass(frozen=True)
class CourseGram:
    """What a set of causes leaves of the cosines of one group, in each recording.

    Attributes
    ----------
    matrix : (R, W, 3, W, 3) array
        Information on the amplitudes of W cosines about three axes.
    score : (R, W, 3) array
    ends : (R,) array
        Lengths of the recordings [s].
    """

    matrix: Floats
    score: Floats
    ends: Floats

    @staticmethod
    def of(point: Linearisation, group: str, causes: Sequence[str]) -> CourseGram | None:
        """Return the Gram of the cosines of a torque, or of an error of a sensor, beside some causes.

        Parameters
        ----------
        point : Linearisation
        group : str
            Name of the group of cosines.
        causes : sequence of str

        Returns
        -------
        CourseGram or None
            None where a recording has not all three axes.
        """
        ends = np.asarray(point.fit.operating.sample.environment.time).max(axis=1)
        waves = [wave for wave in point.bank.signatures if wave.name == group]
        if len(waves) not in (len(ends), 3 * len(ends)):
            return None
        evidence = point.evidence
        gram = evidence.beside(causes, evidence.forms(causes), [group])
        last = np.cumsum([wave.columns.shape[1] for wave in waves])
        parts = [gram.groups[group][end - wave.columns.shape[1] : end] for end, wave in zip(last, waves, strict=True)]
        if len(waves) == len(ends):
            places = np.stack([part.reshape(-1, 3) for part in parts])
        else:
            count = min(map(len, parts))
            places = np.moveaxis(np.stack([part[:count] for part in parts]).reshape(len(ends), 3, count), 1, 2)
        flat = places.reshape(len(ends), -1)
        shape = (*places.shape, *places.shape[1:])
        matrix = np.stack([gram.matrix[np.ix_(row, row)] for row in flat]).reshape(shape)
        return CourseGram(matrix, gram.score[places], ends)

    def cosines(self, recording: int, courses: Floats) -> Floats:
        """Return the cosines, (n, W), of courses that are sampled in the middles of `FINE` equal parts of a recording.

        Parameters
        ----------
        recording : int
        courses : (n, FINE) array
        """
        cosines = courses @ _waves(self.score.shape[1]) * (2.0 / FINE)
        cosines[:, 0] *= 0.5
        return cosines

    def times(self, recording: int) -> Floats:
        """Return the instants at which a course is sampled, (FINE,) [s]."""
        return self.ends[recording] * (np.arange(FINE) + 0.5) / FINE

    def information(self, recording: int, first: Floats, second: Floats) -> Floats:
        """Return the information on courses with one another, (n, 3, 3), by their cosines, (n, W) each or one (W,)."""
        size = first.shape[-1]
        count = len(first)
        mixed = (first @ self.matrix[recording].reshape(size, -1)).reshape(count, 3, size, 3)
        other = np.broadcast_to(np.atleast_2d(second), (count, size))
        return np.asarray(np.matmul(np.moveaxis(mixed, 2, 3), other[:, None, :, None])[..., 0])


@cache
def _waves(count: int) -> Floats:
    """Return cosines at the instants at which a course is sampled, (FINE, count)."""
    return np.cos(np.pi * np.arange(count) * ((np.arange(FINE) + 0.5) / FINE)[:, None])


def half_chi2(matrix: Floats, score: Floats) -> Floats:
    """Return half of what chi-square decreases by amplitudes without a prior, (...,).

    Parameters
    ----------
    matrix : (..., k, k) array
    score : (..., k) array
    """
    diagonal = np.einsum("...ii->...i", matrix)
    ridge = 1e-9 * np.maximum(diagonal.max(axis=-1, keepdims=True), 1e-300)[..., None] * np.eye(score.shape[-1])
    return 0.5 * np.einsum("...i,...i->...", score, np.linalg.solve(matrix + ridge, score[..., None])[..., 0])
