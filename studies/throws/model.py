"""The models of a thrown body: rigid body with wheel, and the same with what is known to be missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bayesid import BodyPrior, InertialParameters, Kind, Model, Robot, Sensor, White
from studies.throws.data import WHEEL_INERTIA
from studies.throws.effects import AirDrag, GyroCross, SmoothTorque, ThrowBias, WheelTilt

__all__ = [
    "STEP",
    "Settings",
    "build_model",
    "common_model",
    "is_calibration",
    "is_fitted",
    "is_own",
    "is_rigid",
    "noise_factors",
    "rough",
    "widths",
]

URDF = """<robot name="thrown"><link name="base_link"><inertial><origin xyz="0 0 0"/><mass value="{mass}"/>
<inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""

COMMON = "Empty"
"""The body whose rough numbers centre the prior that all bodies share in joint fits."""

ROUGH = {
    "cal_device": (0.1007, (3e-5, 7e-5, 8e-5), (0.0, 0.01, 0.01)),
    "cal_proof": (0.4467, (2e-4, 2e-4, 3e-4), (0.0, 0.01, 0.03)),
    "Empty": (0.2792, (2e-4, 4e-4, 5e-4), (0.0, 0.01, 0.03)),
    "A": (0.5596, (3e-4, 15e-4, 16e-4), (0.0, 0.01, 0.04)),
}
"""Mass of each body with the device, as weighed, and the centre of a prior of 100 % width, to one digit: inertia and
centre of mass from the sensor, in its axes."""

TORQUE = {"cal_device": 50.0, "cal_proof": 70.0, "Empty": 200.0, "A": 100.0}
"""Prior standard deviation of the unexplained torque [wheel inertias / s2]; large plates feel the air more."""

STEP = 0.004
"""Of the integration [s]; its error is a tenth of the declared noise at worst, in the throws of the device alone."""

WHEEL_NOISE = 1.5
"""Noise of the wheel's speed [rad/s], seen by the gyro through the body's inertia about the wheel's axis."""


@dataclass(frozen=True)
class Settings:
    """Choices of the extended model, gathered so that their influence can be tried.

    Parameters
    ----------
    knots : int
        Of the unexplained torque, over the flight.
    torque : mapping of str to float
        Its prior standard deviation per body [wheel inertias / s2].
    drag : float
        Prior standard deviation of the drag coefficients [wheel inertias / s].
    rate_sigma, accel_sigma : float
        Noise of the filtered samples [rad/s, m/s2]; errors of the sensors that are not white are counted in.
    bias_sigma : float
        Of the accelerometer in each throw [m/s2].
    """

    knots: int = 16
    torque: dict[str, float] = field(default_factory=lambda: dict(TORQUE))
    drag: float = 20.0
    rate_sigma: float = 0.007
    accel_sigma: float = 0.2
    bias_sigma: float = 0.1


def rough(body: str) -> InertialParameters:
    """Return what is known of a body with the device before any throw."""
    mass, moments, com = ROUGH[body]
    return InertialParameters(mass, np.array(com), np.diag(moments))


def build_model(body: str, settings: Settings, duration: float) -> Model:
    """Return the extended model of one body on the device."""
    mass, moments, _ = ROUGH[body]
    robot = Robot.from_string(URDF.format(mass=mass, xx=moments[0], yy=moments[1], zz=moments[2]))
    prior = BodyPrior("base_link", rough(body), 1.0)
    effects = (
        GyroCross(),
        WheelTilt(),
        AirDrag(settings.drag * WHEEL_INERTIA),
        SmoothTorque(duration, settings.knots, settings.torque[body] * WHEEL_INERTIA),
        ThrowBias(settings.bias_sigma),
    )
    noise = rate_noise(body, settings).tolist()
    rate = Sensor(Kind.RATE, White((noise[0], noise[1], noise[2])))
    accel = Sensor(Kind.ACCEL, White(settings.accel_sigma))
    # wide enough for any throw, and the same for all, so that they share what is compiled
    return Model(robot, (rate, accel), (prior,), effects=effects, rate_sigma=150.0)


def common_model(settings: Settings, duration: float) -> Model:
    """Return the extended model with one prior and one noise for all bodies, so that it compiles once.

    `widths` and `noise_factors` say what a body has instead.
    """
    model = build_model(COMMON, settings, duration)
    return replace(model, sensors=(replace(model.sensors[0], noise=White(settings.rate_sigma)), *model.sensors[1:]))


def widths(names: Sequence[str], body: str, settings: Settings) -> np.ndarray:
    """Width of a body's priors relative to those of `common_model`, one per unknown."""
    torque = settings.torque[body] / TORQUE[COMMON]
    return np.array([torque if name.startswith("smooth-torque") else 1.0 for name in names])


def noise_factors(body: str, settings: Settings) -> np.ndarray:
    """Noise of a body's recordings relative to `common_model`, shape (6,)."""
    factors = np.ones(6)
    factors[:3] = rate_noise(body, settings) / Settings().rate_sigma
    return factors


def rate_noise(body: str, settings: Settings) -> np.ndarray:
    """Noise of the gyro's axes, shape (3,) [rad/s]: about the wheel's axis its speed's noise is seen as well."""
    wheel = WHEEL_NOISE * WHEEL_INERTIA / ROUGH[body][1][2]
    return np.hypot(settings.rate_sigma, np.array([0.0, 0.0, wheel]))


def is_own(name: str) -> bool:
    """Whether an unknown belongs to one throw alone."""
    return "[" in name


def is_rigid(name: str) -> bool:
    """Whether an unknown is one of the plain model: rigid body, initial rate and accelerometer bias, mass known."""
    return (name.partition(":")[2].startswith("base_link") and not name.endswith(".alpha")) or name.startswith(_PLAIN)


_PLAIN = ("initial-rate", "throw-bias")


def is_fitted(name: str) -> bool:
    """Whether an unknown is one of the extended model: all but the mass, which the scales know."""
    return not name.endswith(".alpha")


def is_calibration(name: str) -> bool:
    """Whether an unknown is one of the device's, the same on all bodies."""
    return name.startswith(("gyro-cross", "wheel-tilt"))
