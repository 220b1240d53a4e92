"""Disturbing torques that swing at one frequency, as by a body that moves to and fro.

The bands of the generic torque are as wide as what sloshes freely, and its phases and sizes differ between recordings.
A steady tone that starts with every manoeuvre has six numbers, so that pulses whose period fits it would be named for
want of such a form. A torque may therefore also be a tone, about any axes and alike in all recordings. The frequency
that gains most beside some causes is chosen, and its share of the prior makes the evidence that of an average over all
frequencies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayesid._math.arrays import Floats, log_sum
from bayesid.diagnosis.candidates.courses import CourseGram, half_chi2
from bayesid.diagnosis.candidates.further_forms import choices_beside, with_forms
from bayesid.diagnosis.candidates.linear_model import Linearisation, Signatures
from bayesid.diagnosis.evidence.cause_sets import SetProbabilities
from bayesid.diagnosis.evidence.scales import AmplitudeGroup
from bayesid.inference.residual_view import rows_of

__all__ = ["with_tones"]

SLOWEST, STEP = 3.0, 0.25
"""Fewest half waves of a tone in the longest recording, and the step of those that are tried."""


def with_tones(point: Linearisation, probabilities: SetProbabilities, torque: str) -> Linearisation:
    """Return the linear model in which a disturbing torque may also swing at one frequency.

    Parameters
    ----------
    point : Linearisation
    probabilities : SetProbabilities
    torque : str
        Name of the torque and of the group of its cosines in time.
    """
    if not probabilities.sets[0].names:
        return point
    high = next(cause.groups[0].high for cause in point.bank.causes if cause.name == torque)
    items: dict[str, Signatures] = {}
    forms: list[tuple[AmplitudeGroup, float]] = []
    for names in choices_beside(probabilities):
        courses = CourseGram.of(point, torque, names)
        if courses is None:
            return point
        longest = float(courses.ends.max())
        tried = np.arange(SLOWEST, courses.score.shape[1] - 1.0, STEP) / (2.0 * longest)
        if not len(tried):
            return point
        gains = _gains(courses, tried)
        frequency = float(tried[np.argmax(gains)])
        name = f"{torque} at {frequency:.6g} Hz"
        if name not in items:
            items[name] = Signatures(name, _columns(point, torque, courses, frequency))
            forms.append((AmplitudeGroup(name, high), log_sum(gains) - float(np.log(len(gains)) + gains.max())))
    causes = tuple(with_forms(one, forms) if one.name == torque else one for one in point.bank.causes)
    return point.with_bank(replace(point.bank, signatures=(*point.bank.signatures, *items.values()), causes=causes))


def _cosines(courses: CourseGram, recording: int, frequencies: Floats | Sequence[float]) -> Floats:
    """Return the cosines, (n, 2, W), of both phases of tones in one recording."""
    angle = 2.0 * np.pi * np.multiply.outer(np.asarray(frequencies), courses.times(recording))
    phases = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return courses.cosines(recording, phases.reshape(-1, angle.shape[1])).reshape(len(angle), 2, -1)


def _gains(courses: CourseGram, frequencies: Floats) -> Floats:
    """Return half of what chi-square decreases by a tone of each frequency, (n,)."""
    count = len(frequencies)
    matrix, score = np.zeros((count, 6, 6)), np.zeros((count, 6))
    for recording in range(len(courses.ends)):
        cosines = _cosines(courses, recording, frequencies)
        both = np.einsum("npw,waxb,nqx->npaqb", cosines, courses.matrix[recording], cosines, optimize=True)
        matrix += both.reshape(count, 6, 6)
        score += np.einsum("npw,wa->npa", cosines, courses.score[recording]).reshape(count, 6)
    return half_chi2(matrix, score)


def _columns(point: Linearisation, torque: str, courses: CourseGram, frequency: float) -> Floats:
    """Return what both phases of a tone about three axes would change, (N, 6)."""
    posterior = point.fit.posterior
    columns = np.zeros((len(point.fit.residual), 6))
    for wave in point.bank.signatures:
        if wave.name == torque and wave.recording is not None:
            cosines = _cosines(courses, wave.recording, [frequency])[0]
            each = wave.columns.reshape(len(wave.columns), -1, 3)
            columns[rows_of(posterior, wave.recording)] = np.einsum("nwa,pw->npa", each, cosines).reshape(-1, 6)
    return columns
