"""What integrating the accelerometer does, in closed form: one unknown, and errors that are not noise.

The velocity of the samples' white noise is a random walk. Least squares that take it for white estimate the size A of
an acceleration A s(t) from v = A S + W with S the integral of s and W the walk; with E[W(t) W(u)] = sigma^2 min(t, u)
their variance is sigma^2 times the integral over t of (integral of S from t to the end)^2, over (integral of S^2)^2.
The walk's whole covariance gives back sigma^2 over the integral of s^2: nothing is lost. For s = cos over whole periods
the ratio is 3, for a constant s it is 6/5. A bias b becomes a ramp and falsifies the cosine's A by -2 b, while least
squares on the acceleration itself do not feel it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studies.base_body import paper
from studies.common.ets7 import BIAS
from studies.sensors.linear import Linear
from studies.sensors.montecarlo import velocity_estimators
from studies.sensors.setting import Flight, Noise
from studies.sensors.weights import integral

__all__ = ["Falsified", "Scalar", "falsified", "scalars"]

Floats = NDArray[np.floating]

PERIODS = 2
"""Of the scalar signal."""


@dataclass(frozen=True)
class Scalar:
    """One unknown size of an acceleration of known shape.

    Attributes
    ----------
    name : str
    closed : float
        Standard deviation with velocities taken as white over that with accelerations, in closed form.
    matrices : float
        The same from the matrices of the samples.
    simulated, error : float
        The same by simulation, and its Monte-Carlo error.
    whole : float
        With the velocities' whole covariance, from the matrices.
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
        Of the simulation.
    samples : int
        So many that sums are integrals.
    """
    phase = 2.0 * np.pi * PERIODS * np.linspace(0.0, 1.0, samples)
    rule = integral(phase)
    noise = rng.standard_normal((draws, samples))
    found = []
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
        found.append(
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
    return found


@dataclass(frozen=True)
class Falsified:
    """Relative errors of the ten quantities, each (10,), without any noise.

    Attributes
    ----------
    bias : of a constant error `BIAS` of the accelerometer on each axis.
    rule : of integrating samples by the trapezoidal rule and comparing with the exact velocity; zero where it is not.
    """

    bias: Floats
    rule: Floats


def falsified(flight: Flight, linear: Linear, noise: Noise) -> dict[str, Falsified]:
    """Return what a bias and the rule of integration do to every use of the accelerometer."""
    still, rule = np.zeros_like(flight.rate), integral(flight.time)
    # the acceleration errors whose trapezoidal integral is that of the rule
    missed = np.linalg.lstsq(rule, rule @ flight.accel - (flight.velocity[1:] - flight.velocity[0]))[0]
    exact = np.zeros((1, 3, *flight.position.shape))
    errors = [linear.residual(still[None], own[None], exact) for own in (still + BIAS, missed)]
    found = {}
    for name, estimator in velocity_estimators(linear, noise).items():
        bias, quadrature = (estimator.solve(residual)[0][0] / np.abs(paper.TRUTH) for residual in errors)
        found[name] = Falsified(bias, quadrature if name.startswith("velocity") else 0.0 * quadrature)
    return found
