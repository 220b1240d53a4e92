"""Whether the predicted widths are those of estimates from flights of an independent simulator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesid import Posterior
from bayesid.inference import maximise
from bayesid.inference.noise_changes import relinearised, with_manoeuvres
from bayesid.recording.joint_motion import Motion
from bayesid.robot.inertial_parameters import mass_com_inertia
from studies.base_body.physical import physical_sd, physical_slope
from studies.ets7_limits.flights import fly, record
from studies.ets7_limits.setting import model_of

__all__ = ["RATE_AT_START", "Check", "check"]

Floats = NDArray[np.floating]

RATE_AT_START = np.array([1e-4, -5e-5, 8e-5])
"""Rate of the base at the start in MuJoCo [rad/s]; unknown to the fits."""


@dataclass(frozen=True)
class Check:
    """Estimates beside their prediction.

    Attributes
    ----------
    truth, predicted : (10,) arrays
        Of the base's quantities, and their standard deviation.
    estimates : (N, 10) array
        At the mode of each posterior.
    chi2 : (N,) array
        Per scalar sample.
    """

    truth: Floats
    predicted: Floats
    estimates: Floats
    chi2: Floats

    @property
    def ratio(self) -> Floats:
        """Root mean square error over the predicted standard deviation, (10,)."""
        return np.asarray(np.sqrt(((self.estimates - self.truth) ** 2).mean(axis=0)) / self.predicted)

    @property
    def sampling_error(self) -> float:
        """Standard deviation of `ratio` where the prediction is right."""
        return float(1.0 / np.sqrt(2.0 * len(self.estimates)))

    @property
    def offset(self) -> Floats:
        """Mean error in its own standard deviations, (10,)."""
        return (self.estimates.mean(axis=0) - self.truth) / (self.predicted / np.sqrt(len(self.estimates)))


def check(motion: Motion, duration: float, noises: int, seed: int, progress: Callable[[str], None]) -> Check:
    """Fly a manoeuvre once, record it with many noises, and fit each; the arm is known exactly.

    Parameters
    ----------
    duration : float
        [s]
    noises : int
    seed : int
    """
    run = fly(motion, duration, RATE_AT_START)
    rng = np.random.default_rng(seed)
    posterior = Posterior.of(model_of(), [record(run, "flight", rng)])
    z = posterior.starting_point()
    jacobian = relinearised(posterior, z).jacobian(z)
    predicted = physical_sd(physical_slope(posterior, z), np.linalg.inv(jacobian.T @ jacobian))
    truth = np.asarray(mass_com_inertia(np.asarray(posterior.unknowns.values_at(z).inertial)))
    estimates, chi2 = [], []
    for number in range(noises):
        own = with_manoeuvres(posterior, [record(run, "flight", rng)])
        refined, optimum = maximise(own, rng)
        estimates.append(np.asarray(mass_com_inertia(np.asarray(refined.unknowns.values_at(optimum.z).inertial))))
        chi2.append(optimum.chi2 / refined.samples)
        progress(f"noise {number + 1}")
    return Check(truth, predicted, np.array(estimates), np.array(chi2))
