"""Encoders that are noisier than declared: seen in the joints' samples, with the motion smoothed anew.

The noise is that of the samples' high differences (Tintner 1940, The Variate Difference Method).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import comb
from typing import NamedTuple

import numpy as np

from bayesid._math.arrays import Floats
from bayesid._math.chi_square import log_tail
from bayesid.diagnosis.noise.noise_fault import (
    FitResidual,
    FittedFault,
    NoiseFault,
    Sizes,
    number_of,
    register_fault,
)
from bayesid.diagnosis.response.perturbed_model import Fit
from bayesid.diagnosis.settings import DEFAULT_SETTINGS, DiagnosisSettings
from bayesid.inference.noise_changes import leaving_out, relinearised, with_manoeuvres
from bayesid.inference.posterior import Posterior
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.smoothing import JointSamples
from bayesid.simulation.effects.effect_parameters import Quantity
from bayesid.simulation.model import Manoeuvre, Model

__all__ = ["EncoderFault", "EncoderNoise", "encoder_noise", "noise_of", "with_encoder_noise"]

ORDERS = {6: 0.166, 8: 0.141, 10: 0.133}
"""Orders of the differences that leave noise and no motion, with the degrees of freedom of the median of their squares
per difference, from 6,000 draws of 480 samples: consecutive ones are correlated."""

MEDIAN = 0.454936  # of chi-square with one degree of freedom
EVEN = 0.02  # relative difference of sampling steps up to which they count as even
FEWEST = 15.0  # degrees of freedom of a series of samples below which it is not used


class EncoderNoise(NamedTuple):
    """Variance of the encoders' noise relative to the declared one, with its degrees of freedom."""

    ratio: float
    degrees: float

    @property
    def log_p(self) -> float:
        """Logarithm of the p-value of the declared noise against more."""
        return float(log_tail(self.ratio * self.degrees, self.degrees))

    def log_gain(self, factor: float) -> float:
        """Return what the variance seen gains in log likelihood by noise of a factor times the declared one.

        The likelihood of smoothing is no measure of that: its process takes much of the noise for motion.
        """
        return 0.5 * self.degrees * float(self.ratio * (1.0 - factor**-2) - 2.0 * np.log(factor))


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

    Parameters
    ----------
    series : sequence of JointSamples
    fewest : float
        Smallest number of degrees of freedom of a series that is used.
    jumps : sequence of (n, 2) arrays, optional
        Intervals of each series across which no difference is taken [s].
    """
    jumps = [np.zeros((0, 2))] * len(series) if jumps is None else jumps
    every = [_of(one, one.sigma, gaps) for one, gaps in zip(series, jumps, strict=True) if one.sigma is not None]
    used = [one for one in every if one.degrees >= fewest]
    if not used:
        return None
    # the median of many has 2 / pi of the degrees of freedom of the mean
    degrees = sum(one.degrees for one in used) * (1.0 if len(used) == 1 else 2.0 / np.pi)
    return EncoderNoise(float(np.median([one.ratio for one in used])), degrees)


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


@register_fault
class EncoderFault(NoiseFault):
    """Noise of all encoders that is larger than declared by one factor."""

    name = "encoder-noise"
    summary = "The encoders are noisier than their data sheet: every sample's error is larger by one factor."
    parameters = "factor [1]: ratio of the noise to the declared noise"
    needs = "sigma in [sensors.encoder]"
    in_residual = False

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Factor on sigma."""
        return (Quantity("factor", "1"),)

    def occurs(self, posterior: Posterior) -> bool:
        """Return whether the motion of any joint is measured."""
        return any(isinstance(manoeuvre.motion, MeasuredMotion) for manoeuvre in posterior.manoeuvres)

    def log_p(self, residual: FitResidual) -> float | None:
        """Return the logarithm of the p-value of the declared noise of all encoders; None where none is declared."""
        seen = encoder_noise(residual.fit.posterior)
        return None if seen is None else seen.log_p

    def measured(
        self, fit: Fit, least: float = -np.inf, settings: DiagnosisSettings = DEFAULT_SETTINGS
    ) -> FittedFault | None:
        """Return the factor that the samples' differences show, the joints' motion smoothed anew."""
        seen = encoder_noise(fit.posterior)
        if seen is None:
            return None
        factor, relative = float(np.sqrt(seen.ratio)), float(np.sqrt(0.5 / seen.degrees))
        posterior, size = with_encoder_noise(fit.posterior, factor, fit.z), np.array([factor])
        return FittedFault(self, size, size * relative, posterior, seen.log_gain(factor))

    def in_data(self, model: Model, manoeuvres: Sequence[Manoeuvre], sizes: Sizes) -> list[Manoeuvre]:
        """Return recordings whose joints' motion is smoothed with the declared noise times the factor."""
        return _smoothed(manoeuvres, number_of(sizes[0]))


def _smoothed(manoeuvres: Sequence[Manoeuvre], factor: float) -> list[Manoeuvre]:
    return [
        replace(manoeuvre, motion=manoeuvre.motion.with_noise(factor))
        if isinstance(manoeuvre.motion, MeasuredMotion)
        else manoeuvre
        for manoeuvre in manoeuvres
    ]


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
    again = with_manoeuvres(posterior, _smoothed(posterior.manoeuvres, factor))
    return relinearised(leaving_out(again, posterior.data.left_out), z)


def encoder_noise(posterior: Posterior) -> EncoderNoise | None:
    """Return the noise of all encoders of a posterior by one factor (`noise_of`)."""
    motions = [manoeuvre.motion for manoeuvre in posterior.manoeuvres if isinstance(manoeuvre.motion, MeasuredMotion)]
    series = [(one, joint.jump_intervals) for motion in motions for joint in motion.joints for one in joint.series]
    return noise_of([one.every_sample for one, _ in series], jumps=[intervals for _, intervals in series])
