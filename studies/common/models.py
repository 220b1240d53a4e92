"""The model with which studies identify the base of ETS-VII, and of other robots."""

from __future__ import annotations

from collections.abc import Mapping

from bayesid import BodyPrior, Model, Orbit, Robot, Sensor, SensorKind, White
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.simulation.effects import AccelBias, GravityGradient
from bayesid.simulation.model import RATE_SIGMA, spread_links
from studies.common.ets7 import ACCELEROMETER, BIAS, RADIUS, ets7

__all__ = ["ARM_SPREAD", "BASE_SPREAD", "base_model"]

BASE_SPREAD = 1.0
"""Relative width of the prior of the base: its mass is then uncertain by a factor of e²."""

ARM_SPREAD = 0.025
"""Relative width of a link's prior where the arm is not known exactly: its mass is then known to 5 %."""


def base_model(
    noise: Mapping[SensorKind, float],
    *,
    robot: Robot | None = None,
    centre: InertialParameters | None = None,
    base_spread: float = BASE_SPREAD,
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
    robot : Robot, optional
        Robot with its nominal arm, by default ETS-VII as shipped.
    centre : InertialParameters, optional
        Centre of the base's prior, by default the base of the robot.
    base_spread, arm_spread : float
        Relative widths of the priors of the base and of the links; the arm is known exactly where its width is 0.
    gradient : bool
        Whether the model has the gravity gradient.
    bias : float
        Prior standard deviation of the accelerometer's constant error [m/s2]; 0 where it has none.
    rate_sigma : float
        Prior standard deviation of the initial rate [rad/s]; 0 for a start at rest.
    """
    robot = ets7() if robot is None else robot
    centre = robot.link(robot.base).inertial if centre is None else centre
    return Model(
        robot=robot,
        sensors=tuple(
            Sensor(kind, White(sigma), position=ACCELEROMETER if kind is SensorKind.ACCEL else (0.0, 0.0, 0.0))
            for kind, sigma in noise.items()
        ),
        priors=(BodyPrior(robot.base, centre, base_spread), *spread_links(robot, arm_spread, (robot.base,))),
        orbit=Orbit(RADIUS),
        effects=(*([GravityGradient()] if gradient else []), *([AccelBias(bias)] if bias > 0.0 else [])),
        rate_sigma=rate_sigma,
    )
