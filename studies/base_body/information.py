"""What sensors, priors and the knowledge of the arm make of the posterior's width: one Jacobian, many questions.

With white noise every sensor's rows of the whitened Jacobian go with the inverse of its noise. Computed once with
everything unknown, the Jacobian answers any sensor grade by rescaling, and any "if that were known" by leaving out
columns.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesid.identifiability.local_knowledge import Knowledge, triangular
from bayesid.inference.body_quantities import linearise
from bayesid.inference.noise_changes import with_manoeuvres
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import PredictedReadings, predicted_readings
from bayesid.inference.simulated_recordings import simulate_recordings
from bayesid.recording.joint_motion import Excitation
from bayesid.robot.body_prior import BodyPrior
from bayesid.simulation.effects import AccelBias, GravityGradient
from bayesid.simulation.model import Manoeuvre, Model, spread_links
from bayesid.simulation.orbit import Orbit
from bayesid.simulation.sensors import ARCSEC, Kind, Sensor, White
from studies.base_body import paper
from studies.base_body.noise_free import ACCELEROMETER, STEP
from studies.base_body.setting import blank
from studies.common.ets7 import BASE, RADIUS, ets7

__all__ = ["ACCEL_BIAS", "ARM", "ARM_SPREAD", "BIAS", "RATE", "STAR", "TILT", "Information", "wide_model"]

Floats = NDArray[np.floating]

KINDS = (Kind.RATE, Kind.ACCEL, Kind.ATTITUDE)
UNIT = 1e-5
"""Sigma the information of each sensor is computed with [rad/s, m/s2, rad]."""

ARM_SPREAD = 0.025
"""Of a link's log-Cholesky coordinates: its mass is then known to 5 %, twice the coordinate's width."""

BIAS = 1e-4
"""Prior sd of the accelerometer's constant error [m/s2]."""

STAR = 2.0 * ARCSEC
"""Error of the star sensor per axis and sample [rad]."""

ARM, RATE, TILT, ACCEL_BIAS = "arm", "initial rate", "initial attitude", "accelerometer bias"


def wide_model() -> Model:
    """Return the model with everything unknown that a question may fix: arm, initial rate, accelerometer bias."""
    robot = ets7()
    base = BodyPrior(BASE, paper.body(paper.TRUTH), 1.0)
    return Model(
        robot=robot,
        sensors=(
            Sensor(Kind.RATE, White(UNIT)),
            Sensor(Kind.ACCEL, White(UNIT), position=ACCELEROMETER),
            Sensor(Kind.ATTITUDE, White(UNIT)),
        ),
        priors=(base, *spread_links(robot, ARM_SPREAD, (BASE,))),
        orbit=Orbit(RADIUS),
        effects=(GravityGradient(), AccelBias(BIAS)),
    )


@dataclass(frozen=True)
class Information:
    """What one manoeuvre tells of the base, linearised at the truth.

    Attributes
    ----------
    by_sensor : mapping of Kind to (n, n) array
        Rows equivalent to the whitened Jacobian of each sensor with a noise of `UNIT` per sample.
    prior : Knowledge
        The base's quantities before the manoeuvre.
    names : tuple of str
        Names of the n unknowns.
    truth : PredictedReadings
        What the sensors read.
    """

    by_sensor: Mapping[Kind, Floats]
    prior: Knowledge
    names: tuple[str, ...]
    truth: PredictedReadings

    @classmethod
    def of(cls, motion: Excitation, step: float = STEP) -> Information:
        """Compute the information of a manoeuvre."""
        model = wide_model()
        planned = Manoeuvre(blank(motion, KINDS), motion, attitude_sigma=STAR)
        simulator = Posterior.of(model, [planned], step=step, flat_prior=True)
        z = np.zeros(simulator.size)
        truth = predicted_readings(simulator, z)[0]
        recording = simulate_recordings(simulator, z=z)[0]
        posterior = with_manoeuvres(simulator, [replace(planned, recording=recording)])
        jacobian = posterior.jacobian(z).reshape(-1, len(KINDS), 3, posterior.size)
        rows = {kind: triangular(jacobian[:, index].reshape(-1, posterior.size)) for index, kind in enumerate(KINDS)}
        prior = Knowledge(*linearise(posterior, z), np.eye(posterior.size))
        return cls(rows, prior, posterior.unknowns.names, truth)

    def sd(self, sigma: Mapping[Kind, float], known: Collection[str] = ()) -> Floats:
        """Posterior standard deviation of the base's ten quantities.

        Parameters
        ----------
        sigma : mapping of Kind to float
            Of the sensors used, per sample.
        known : collection of str
            Of `ARM`, `RATE`, `TILT`, `ACCEL_BIAS`: what is known exactly.
        """
        rows = [self.by_sensor[kind] * (UNIT / value) for kind, value in sigma.items()]
        exact = [index for index, name in enumerate(self.names) if _group(name) in known]
        return self.prior.having(np.concatenate(rows)).fixing(exact).sd

    def relative_sd(self, sigma: Mapping[Kind, float], known: Collection[str] = ()) -> Floats:
        """`sd` over the true values."""
        return self.sd(sigma, known) / np.abs(paper.TRUTH)

    @property
    def peak(self) -> dict[Kind, float]:
        """Largest rate [rad/s], acceleration [m/s2] and rotation since the start [rad] of any axis."""
        vector = 2.0 * self.truth.attitude[:, :3]
        values = {Kind.RATE: self.truth.rate, Kind.ACCEL: self.truth.accel, Kind.ATTITUDE: vector}
        return {kind: float(np.abs(reading).max()) for kind, reading in values.items()}


def _group(name: str) -> str:
    for start, group in (("link", ARM), ("initial-rate", RATE), ("initial-attitude", TILT), ("accel-bias", ACCEL_BIAS)):
        if name.startswith(start):
            return group
    return BASE
