"""Encoders that are noisier than declared: seen in the joints' samples, with the motion smoothed anew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import comb
from typing import NamedTuple

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.noise.noise_tests import chi2_log_sf
from bayesid.inference.noise_changes import leaving_out, relinearised, with_manoeuvres
from bayesid.inference.posterior import Posterior
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.smoothing import JointSamples

__all__ = ["ENCODER_NOISE", "EncoderNoise", "encoder_noise", "encoder_test", "noise_of", "with_encoder_noise"]

ENCODER_NOISE = "encoder-noise"
"""Name of the fault in the catalogue."""

ORDERS = {6: 0.166, 8: 0.141, 10: 0.133}
"""Orders of the differences that leave noise and no motion, with the degrees of freedom of the median of their squares
per difference, from 6,000 draws of 480 samples: consecutive ones are correlated."""

MEDIAN = 0.454936
"""Median of chi-square with one degree of freedom."""

EVEN = 0.02
"""Relative difference of sampling steps up to which they count as even."""

FEWEST = 15.0
"""Degrees of freedom of a series of samples below which it is not used."""


class EncoderNoise(NamedTuple):
    """Variance of the encoders' noise relative to the declared one, with its degrees of freedom."""

    ratio: float
    degrees: float

    @property
    def log_p(self) -> float:
        """Logarithm of the p-value of the declared noise against more."""
        return chi2_log_sf(self.ratio * self.degrees, self.degrees)

    def log_gain(self, factor: float) -> float:
        """Return what the variance seen gains in log likelihood by noise of a factor times the declared one.

        The likelihood of smoothing is no measure of that: its process takes much of the noise for motion.
        """
        return 0.5 * self.degrees * float(self.ratio * (1.0 - factor**-2) - 2.0 * np.log(factor))


def encoder_noise(posterior: Posterior) -> EncoderNoise | None:
    """Estimate the noise of all encoders of a posterior by one factor (`noise_of`)."""
    motions = [item.motion for item in posterior.manoeuvres if isinstance(item.motion, MeasuredMotion)]
    series = [(one, joint.jump_intervals) for motion in motions for joint in motion.joints for one in joint.series]
    return noise_of([one for one, _ in series], jumps=[intervals for _, intervals in series])


def noise_of(
    series: Sequence[JointSamples], fewest: float = FEWEST, jumps: Sequence[Floats] | None = None
) -> EncoderNoise | None:
    """Estimate the noise of samples by one factor, from their high differences; None where none is declared.

    A difference of order k of white noise has ``comb(2k, k)`` times its variance. Unlike the likelihood of smoothing,
    it needs no model of the motion, which smoothing takes for integrated noise; and as motion only adds to it, the
    least of some orders is taken. The median over the samples leaves out where the motion is rough, and the median
    over the joints those of which other things are wrong. Differences across an instant of ``jumps``, intervals (n, 2)
    [s] for each series, are left out, as a profile of speed has many. Series of fewer degrees of freedom than
    ``fewest`` are not used.
    """
    jumps = [np.zeros((0, 2))] * len(series) if jumps is None else jumps
    every = [_of(one, one.sigma, own) for one, own in zip(series, jumps, strict=True) if one.sigma is not None]
    found = [own for own in every if own.degrees >= fewest]
    if not found:
        return None
    # the median of many has 2 / pi of the degrees of freedom of the mean
    degrees = sum(own.degrees for own in found) * (1.0 if len(found) == 1 else 2.0 / np.pi)
    return EncoderNoise(float(np.median([own.ratio for own in found])), degrees)


def _of(samples: JointSamples, sigma: float, jumps: Floats) -> EncoderNoise:
    """Return the variance of one series relative to the declared one, by the order of differences that gives least."""
    steps = np.diff(samples.time)
    even = np.abs(steps / np.median(steps) - 1.0) < EVEN
    begin, end = samples.time[:-1, None], samples.time[1:, None]
    even &= ~((begin < jumps[:, 1]) & (end > jumps[:, 0])).any(axis=1)
    best = EncoderNoise(np.inf, 0.0)
    for order, share in ORDERS.items():
        if len(steps) < order:
            break
        whole = np.lib.stride_tricks.sliding_window_view(even, order).all(axis=1)
        squares = np.diff(samples.value, n=order)[whole] ** 2
        if len(squares) == 0:
            continue
        ratio = float(np.median(squares)) / (MEDIAN * comb(2 * order, order) * sigma**2)
        if ratio < best.ratio:
            best = EncoderNoise(ratio, share * len(squares))
    return best


def encoder_test(posterior: Posterior) -> dict[str, float]:
    """Return the logarithm of the p-value of all encoders being noisier than declared; nothing where none is."""
    found = encoder_noise(posterior)
    return {} if found is None else {ENCODER_NOISE: found.log_p}


def with_encoder_noise(posterior: Posterior, factor: float, z: Floats) -> Posterior:
    """Return the posterior with the encoders' noise times a factor, the joints' motion smoothed anew.

    Samples that are left out stay so.

    Parameters
    ----------
    posterior : Posterior
    factor : float
    z : (size,) array
        Linearisation point of the encoders' noise.
    """
    manoeuvres = [
        replace(item, motion=item.motion.with_noise(factor)) if isinstance(item.motion, MeasuredMotion) else item
        for item in posterior.manoeuvres
    ]
    again = with_manoeuvres(posterior, manoeuvres)
    return relinearised(leaving_out(again, posterior.data.left_out), z)
