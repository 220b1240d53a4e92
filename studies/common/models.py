"""Models that studies state of ETS-VII: sensors, orbit, unknown base, and guesses about which priors are centred."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np

from bayesid import BodyPrior, Effect, InertialParameters, Model, Orbit, Robot, Sensor, SensorKind, White
from bayesid.robot.inertial_parameters import parameters_from_pseudo_inertia
from bayesid.robot.log_cholesky import log_cholesky_factor, upper_cholesky
from bayesid.simulation.effects import GravityGradient, SensorBias
from bayesid.simulation.model import RATE_SIGMA, spread_links
from studies.common.ets7 import ACCEL, ACCELEROMETER, BIAS, ENCODER, RADIUS, RATE, ets7

ARM_SPREAD = 0.025  # relative width of a link's prior where the arm is not known exactly: its mass is then known to 5 %

# family of channels -> noise per sample of a recording [rad, rad/s, m/s2], in the order in which it is drawn
NOISE = {"position": ENCODER, "rate": RATE, "accel": ACCEL}


def _sensors(noise: Mapping[SensorKind, float]) -> tuple[Sensor, ...]:
    """Return sensors with white noise per sample [rad/s, m/s2, rad]."""
    return tuple(
        Sensor(kind, White(sigma), position=ACCELEROMETER if kind is SensorKind.ACCEL else (0.0, 0.0, 0.0))
        for kind, sigma in noise.items()
    )


def orbiting_model(robot: Robot, priors: Sequence[BodyPrior], *effects: Effect, **options: Any) -> Model:
    """Return a model with rate sensor and accelerometer on the orbit of ETS-VII, gravity gradient included.

    Parameters
    ----------
    robot : Robot
    priors : sequence of BodyPrior
    *effects
        Effects beside the gravity gradient.
    **options
        Further arguments of `bayesid.Model`.
    """
    sensors = _sensors({SensorKind.RATE: RATE, SensorKind.ACCEL: ACCEL})
    return Model(robot, sensors, tuple(priors), Orbit(RADIUS), (GravityGradient(), *effects), **options)


def base_model(
    noise: Mapping[SensorKind, float],
    *,
    robot: Robot | None = None,
    centre: InertialParameters | None = None,
    base_spread: float = 1.0,
    arm_spread: float = 0.0,
    gradient: bool = True,
    bias: float = BIAS,
    rate_sigma: float = RATE_SIGMA,
) -> Model:
    """Return a model in which the base is to be identified.

    Parameters
    ----------
    noise : mapping of SensorKind to float
        Standard deviation of the white noise of each sensor, per sample [rad/s, m/s2, rad].
    robot : Robot, optional; robot with its nominal arm, by default ETS-VII as shipped
    centre : InertialParameters, optional; centre of the base's prior, by default the base of the robot
    base_spread, arm_spread : float
        Relative widths of the priors of the base, whose mass is by default uncertain by a factor of e², and of the
        links; the arm is known exactly where its width is 0.
    gradient : bool; whether the model has the gravity gradient
    bias : float; prior standard deviation of the accelerometer's constant error [m/s2]; 0 where it has none
    rate_sigma : float; prior standard deviation of the initial rate [rad/s]; 0 for a start at rest
    """
    robot = ets7() if robot is None else robot
    centre = robot.link(robot.base).inertial if centre is None else centre
    return Model(
        robot=robot,
        sensors=_sensors(noise),
        priors=(BodyPrior(robot.base, centre, base_spread), *spread_links(robot, arm_spread, (robot.base,))),
        orbit=Orbit(RADIUS),
        effects=(
            *([GravityGradient()] if gradient else []),
            *([SensorBias.of(SensorKind.ACCEL)(bias)] if bias > 0.0 else []),
        ),
        rate_sigma=rate_sigma,
    )


def guess_about(truth: InertialParameters, spread: float, rng: np.random.Generator) -> InertialParameters:
    """Draw a guess such that the truth is a draw of the prior about it.

    The prior multiplies the Cholesky factor of the guess's pseudo-inertia by a random factor; the guess is the truth
    with the inverse of such a factor.

    Parameters
    ----------
    truth : InertialParameters
    spread : float; relative width of the prior in log-Cholesky coordinates
    rng : numpy.random.Generator
    """
    factor = np.asarray(log_cholesky_factor(jnp.asarray(spread * rng.normal(size=10))))
    guess = upper_cholesky(truth.pseudo_inertia) @ np.linalg.inv(factor)
    return InertialParameters.from_vector(np.asarray(parameters_from_pseudo_inertia(jnp.asarray(guess @ guess.T))))
