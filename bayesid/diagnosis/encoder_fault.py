"""Encoders that are noisier than declared: seen in the joints' samples, with the motion smoothed anew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import stats

from bayesid._math.arrays import Floats
from bayesid.inference.noise_changes import relinearised, with_manoeuvres
from bayesid.inference.posterior import Posterior
from bayesid.recording.joint_motion import MeasuredMotion

__all__ = ["ENCODER_NOISE", "encoder_ratios", "encoder_test", "with_encoder_noise"]

ENCODER_NOISE = "encoder-noise"
"""Name of the fault in the catalogue."""

FEWEST = 3
"""Fewest joints, counted in every recording anew, whose noise is compared with the declared one."""


def encoder_ratios(posterior: Posterior) -> Floats:
    """Return the logarithm of estimated over declared noise, of every declared encoder in every recording."""
    motions = [item.motion for item in posterior.manoeuvres if isinstance(item.motion, MeasuredMotion)]
    found = [joint.declared_noise_error() for motion in motions for joint in motion.joints]
    return np.concatenate([np.zeros(0), *found])


def encoder_test(posterior: Posterior) -> dict[str, float]:
    """Return the logarithm of the p-value of all encoders being noisier than declared by one factor.

    How far the estimates scatter about one factor is taken from themselves, by Student's t: a joint's motion is not the
    integrated noise that smoothing takes it for, which shifts the estimates more than their likelihood says. There is
    no test where nothing is declared or too few joints are recorded.
    """
    ratios = encoder_ratios(posterior)
    if len(ratios) < FEWEST:
        return {}
    error = max(float(ratios.std(ddof=1)), 1e-9) / np.sqrt(len(ratios))
    return {ENCODER_NOISE: float(stats.t.logsf(ratios.mean() / error, len(ratios) - 1))}


def with_encoder_noise(posterior: Posterior, factor: float, z: Floats) -> tuple[Posterior, float]:
    """Return the posterior with the encoders' noise times a factor, and what the joints' samples gain by it.

    Parameters
    ----------
    posterior : Posterior
    factor : float
    z : (size,) array
        Linearisation point of the encoders' noise.

    Returns
    -------
    posterior : Posterior
        With the joints' motion smoothed anew.
    gain : float
        Change of the log likelihood of the joints' samples.
    """
    manoeuvres, gain = [], 0.0
    for item in posterior.manoeuvres:
        if isinstance(item.motion, MeasuredMotion):
            motion = item.motion.with_noise(factor)
            gain += motion.log_likelihood - item.motion.log_likelihood
            item = replace(item, motion=motion)
        manoeuvres.append(item)
    return relinearised(with_manoeuvres(posterior, manoeuvres), z), gain
