"""The effect of integrating the accelerometer, in closed form: noise with one unknown, and errors that are not noise.

The velocity of the samples' white noise is a random walk. Let S be the integral of s and W the walk. Least squares that
take the walk for white noise estimate the size A of an acceleration A s(t) from v = A S + W. With
E[W(t) W(u)] = sigma^2 min(t, u) their variance is sigma^2 times the integral over t of (integral of S from t to the
end)^2, over (integral of S^2)^2. The full covariance of the walk gives sigma^2 over the integral of s^2, so nothing is
lost. The ratio of both variances is 3 for s = cos over whole periods, and 6/5 for a constant s. A bias b becomes a ramp
and changes the cosine's A by -2 b, while least squares on the acceleration itself are not affected.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesid._math.arrays import Floats
from studies.base_body import paper
from studies.common.ets7 import BIAS
from studies.sensors.linear import Linear
from studies.sensors.montecarlo import velocity_estimators
from studies.sensors.setting import Flight, Noise
from studies.sensors.weights import integral

__all__ = ["Falsified", "Scalar", "falsified", "scalars"]

PERIODS = 2
"""Number of periods of the cosine."""


@dataclass(frozen=True)
class Scalar:
    """Estimates of the unknown size of an acceleration of known shape.

    Attributes
    ----------
    name : str
        Shape of the acceleration.
    closed : float
        Standard deviation with velocities taken as white over that with accelerations, in closed form.
    matrices : float
        The same from the matrices of the samples.
    simulated, error : float
        The same by simulation, and its Monte-Carlo error.
    whole : float
        The same with the full covariance of the velocities, from the matrices.
    bias_closed, bias : float
        Error of the size per unit bias, in closed form and from the matrices.
    """

    name: str
    closed: float
    matrices: float
    simulated: float
    error: float
    whole: float
    bias_closed: float
    bias: float


def scalars(draws: int, rng: np.random.Generator, samples: int = 2401) -> list[Scalar]:
    """Compare closed form, matrices and simulation for a cosine and a constant.

    Parameters
    ----------
    draws : int
        Number of simulated sets of noise.
    rng : numpy.random.Generator
        Source of the noise.
    samples : int
        Number of samples, so large that sums are integrals.
    """
    phase = 2.0 * np.pi * PERIODS * np.linspace(0.0, 1.0, samples)
    rule = integral(phase)
    noise = rng.standard_normal((draws, samples))
    results = []
    for name, shape, closed, bias in (
        ("cosine over whole periods", np.cos(phase), np.sqrt(3.0), -2.0),
        ("constant", np.ones(samples), np.sqrt(1.2), 1.0),
    ):
        velocity = rule @ shape
        gain = velocity @ rule / (velocity @ velocity)
        best = 1.0 / np.linalg.norm(shape)
        simulated = (noise @ gain).std(ddof=1) / best
        factor = np.linalg.cholesky(rule @ rule.T)
        whole = 1.0 / np.linalg.norm(np.linalg.solve(factor, velocity))
        results.append(
            Scalar(
                name,
                float(closed),
                float(np.linalg.norm(gain) / best),
                float(simulated),
                float(simulated / np.sqrt(2.0 * (draws - 1))),
                float(whole / best),
                bias,
                float(gain.sum()),
            )
        )
    return results


@dataclass(frozen=True)
class Falsified:
    """Relative errors of the ten quantities without any noise.

    Attributes
    ----------
    bias : (10,) array
        Errors due to a constant error `BIAS` of the accelerometer on each axis.
    rule : (10,) array
        Errors due to integrating samples by the trapezoidal rule and comparing them with the exact velocity; zero where
        the accelerometer is not integrated.
    """

    bias: Floats
    rule: Floats


def falsified(flight: Flight, linear: Linear, noise: Noise) -> dict[str, Falsified]:
    """Return the errors that a bias and the rule of integration cause in every use of the accelerometer."""
    still, rule = np.zeros_like(flight.rate), integral(flight.time)
    # the acceleration errors whose trapezoidal integral is that of the rule
    missed = np.linalg.lstsq(rule, rule @ flight.accel - (flight.velocity[1:] - flight.velocity[0]))[0]
    exact = np.zeros((1, 3, *flight.position.shape))
    errors = [linear.residual(still[None], accel[None], exact) for accel in (still + BIAS, missed)]
    results = {}
    for name, estimator in velocity_estimators(linear, noise).items():
        bias, quadrature = (estimator.solve(residual)[0][0] / np.abs(paper.TRUTH) for residual in errors)
        results[name] = Falsified(bias, quadrature if name.startswith("velocity") else 0.0 * quadrature)
    return results
