"""How sensors, priors and the knowledge of the arm determine the width of the posterior, from one Jacobian.

With white noise, a sensor's rows of the whitened Jacobian are inversely proportional to its noise. The Jacobian is
computed once with everything unknown. Rescaled rows then answer for any grade of sensor, and left-out columns for any
unknown that is taken as known.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.identifiability.local_knowledge import Knowledge, triangular
from bayesid.inference.body_quantities import linearise
from bayesid.inference.noise_changes import with_manoeuvres
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import PredictedReadings, predicted_readings
from bayesid.inference.simulated_recordings import simulate_recordings
from bayesid.recording.joint_motion import Excitation
from bayesid.simulation.sensors import ARCSEC, SensorKind
from studies.base_body import paper
from studies.base_body.noise_free import STEP
from studies.base_body.setting import planned
from studies.common.models import ARM_SPREAD, base_model

__all__ = ["ACCEL_BIAS", "ARM", "INITIAL_RATE", "STAR", "TILT", "Information"]

KINDS = (SensorKind.RATE, SensorKind.ACCEL, SensorKind.ATTITUDE)
"""Sensors whose information is computed."""

UNIT = 1e-5
"""Standard deviation for which the information of each sensor is computed [rad/s, m/s2, rad]."""

STAR = 2.0 * ARCSEC
"""Standard deviation of the star sensor's error per axis and sample [rad]."""

ARM, INITIAL_RATE, TILT, ACCEL_BIAS = "arm", "initial rate", "initial attitude", "accelerometer bias"
"""Groups of unknowns that a question may take as known."""

GROUPS = {"link": ARM, "initial-rate": INITIAL_RATE, "initial-attitude": TILT, "accel-bias": ACCEL_BIAS}
"""First part of an unknown's name -> its group."""


@dataclass(frozen=True)
class Information:
    """Information that one manoeuvre gives about the base, linearised at the truth.

    Attributes
    ----------
    by_sensor : mapping of SensorKind to (n, n) array
        Rows equivalent to the whitened Jacobian of each sensor with a noise of `UNIT` per sample.
    prior : Knowledge
        Knowledge of the base's quantities before the manoeuvre.
    names : tuple of str
        Names of the n unknowns.
    truth : PredictedReadings
        Readings of the sensors without noise.
    """

    by_sensor: Mapping[SensorKind, Floats]
    prior: Knowledge
    names: tuple[str, ...]
    truth: PredictedReadings

    @classmethod
    def of(cls, motion: Excitation, step: float = STEP) -> Information:
        """Compute the information of a manoeuvre with an integration step [s]."""
        model = base_model(dict.fromkeys(KINDS, UNIT), centre=paper.body(paper.TRUTH), arm_spread=ARM_SPREAD)
        manoeuvre = replace(planned(model, motion), attitude_sigma=STAR)
        simulator = Posterior.of(model, [manoeuvre], step=step, flat_prior=True)
        z = np.zeros(simulator.size)
        recording = simulate_recordings(simulator, z=z)[0]
        posterior = with_manoeuvres(simulator, [replace(manoeuvre, recording=recording)])
        jacobian = posterior.jacobian(z).reshape(-1, len(KINDS), 3, posterior.size)
        rows = {kind: triangular(jacobian[:, index].reshape(-1, posterior.size)) for index, kind in enumerate(KINDS)}
        prior = Knowledge(*linearise(posterior, z), np.eye(posterior.size))
        return cls(rows, prior, posterior.unknowns.names, predicted_readings(simulator, z)[0])

    def relative_sd(self, sigma: Mapping[SensorKind, float], known: Collection[str] = ()) -> Floats:
        """Return the posterior standard deviations of the base's quantities relative to the truth, shape (10,).

        Parameters
        ----------
        sigma : mapping of SensorKind to float
            Standard deviation per sample of the sensors used.
        known : collection of str
            Groups of unknowns that are known exactly: `ARM`, `INITIAL_RATE`, `TILT`, `ACCEL_BIAS`.
        """
        rows = [self.by_sensor[kind] * (UNIT / value) for kind, value in sigma.items()]
        exact = [
            index
            for index, name in enumerate(self.names)
            if any(name.startswith(start) and group in known for start, group in GROUPS.items())
        ]
        return self.prior.having(np.concatenate(rows)).fixing(exact).sd / np.abs(paper.TRUTH)

    @property
    def peak(self) -> dict[SensorKind, float]:
        """Largest rate [rad/s], acceleration [m/s2] and rotation since the start [rad] about any axis."""
        turned = 2.0 * self.truth.attitude[:, :3]
        values = {SensorKind.RATE: self.truth.rate, SensorKind.ACCEL: self.truth.accel, SensorKind.ATTITUDE: turned}
        return {kind: float(np.abs(reading).max()) for kind, reading in values.items()}
