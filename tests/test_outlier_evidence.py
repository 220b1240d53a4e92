"""Evidence of outliers: two garbled readings of an accelerometer against the formula by hand."""

from dataclasses import replace

import numpy as np
import pytest

from bayesid.diagnosis.noise.noise_model import NoiseModel
from bayesid.diagnosis.response.perturbed_model import PerturbedModel
from bayesid.inference.posterior import Posterior
from tests.conftest import SIGMA


@pytest.mark.slow
@pytest.mark.parametrize("size", [5.0, 8.0])
def test_outliers_cost_what_their_density_says(planar_case, size):
    """A reading that is left out gives up its Gaussian density for the fraction of outliers over the channel's range.

    Both are densities in the unit of the sensor, so that no unit is left in their ratio.
    """
    posterior = planar_case.posterior
    (manoeuvre,) = posterior.manoeuvres
    channels = dict(manoeuvre.recording.channels)
    rows = [20, 55]
    channels["accel.y"] = channels["accel.y"].copy()
    channels["accel.y"][rows] += size * SIGMA
    garbled = replace(manoeuvre, recording=replace(manoeuvre.recording, channels=channels))
    perturbed = PerturbedModel(Posterior.of(posterior.model, [garbled], step=posterior.step))
    fit = perturbed.fit()
    declared = NoiseModel((), perturbed, fit)
    found = declared.with_fault("outliers:accel", fit, fit.log_evidence)
    mask = found.perturbed.posterior.data.left_out[0]
    assert mask.sum() == 2
    gone = fit.residual.reshape(fit.posterior.residual_shape)[0, : len(mask)][mask]
    fraction, width = 2.0 / len(manoeuvre.recording.time), np.ptp(channels["accel.y"])
    kept = 3 * len(manoeuvre.recording.time) - 2
    gaussian = -0.5 * gone**2 - 0.5 * np.log(2.0 * np.pi) - np.log(SIGMA)
    uniform = np.log(fraction) - np.log(width)
    expected = (uniform - gaussian).sum() + kept * np.log1p(-fraction)
    size_known = np.log(np.sqrt(2.0 * np.pi) / (3.0 * np.log(10.0)) * found.faults[0].sd[0] / fraction)
    assert found.log_nothing - declared.log_nothing == pytest.approx(expected + min(size_known, 0.0), abs=1.0)
