"""The models of a thrown body: rigid body with wheel, and the same with what is known to be missing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bayesid import (
    BodyPrior,
    InertialParameters,
    Manoeuvre,
    MeasuredMotion,
    Model,
    Recording,
    Robot,
    Sensor,
    SensorKind,
    White,
)
from studies.throws.data import WHEEL_COUNT, WHEEL_INERTIA
from studies.throws.effects import AirDrag, GyroCross, SmoothForce, SmoothTorque, ThrowBias, WheelDelay, WheelTilt
from studies.throws.noise import quiet_noise

__all__ = ["KNOTS", "TORQUE", "extended", "is_calibration", "is_fitted", "is_own", "is_rigid", "manoeuvres", "rigid"]

Floats = NDArray[np.floating]

URDF = """<robot name="thrown"><link name="base_link"><inertial><origin xyz="{com}"/><mass value="{mass}"/>
<inertia ixx="{0}" ixy="{1}" ixz="{2}" iyy="{3}" iyz="{4}" izz="{5}"/></inertial></link></robot>"""

KNOTS = 16
"""Of the unexplained torque, over the flight: 32 ms apart."""

TORQUE = 100.0 * WHEEL_INERTIA
"""Width of the unexplained torque that estimates of a body's own start from [N m]."""

DRAG = 20.0 * WHEEL_INERTIA
"""Prior standard deviation of the drag coefficients [N m s]."""

BIAS = 0.1
"""Prior standard deviation of the accelerometer's constant error in a throw [m/s2]."""

RESOLUTION = WHEEL_COUNT / np.sqrt(12.0)
"""Least noise of the wheel's recorded speed, that of its counts [rad/s]: the gyro sees it through the inertia."""

RATE = 150.0
"""Prior standard deviation of the initial rate [rad/s], wide enough for any throw."""


def rigid(centre: InertialParameters, spread: float, recordings: Sequence[Recording]) -> Model:
    """Return a rigid body with a recorded wheel; every throw has an initial rate and an accelerometer bias of its own.

    Parameters
    ----------
    centre, spread
        Of the body's prior.
    recordings : sequence of Recording
        Whose quiet stretches give the noise.
    """
    inertia = centre.inertia
    upper = inertia[np.triu_indices(3)]
    robot = Robot.from_string(URDF.format(*upper, com=" ".join(map(str, centre.com)), mass=centre.mass))
    rate = quiet_noise(recordings, "rate")
    momentum = max(quiet_noise(recordings, "wheel_momentum")[2], WHEEL_INERTIA * RESOLUTION)
    rate[2] = np.hypot(rate[2], momentum / inertia[2, 2])
    sensors = (
        Sensor(SensorKind.RATE, _white(rate)),
        Sensor(SensorKind.ACCEL, _white(quiet_noise(recordings, "accel"))),
    )
    return Model(robot, sensors, (BodyPrior("base_link", centre, spread),), effects=(ThrowBias(BIAS),), rate_sigma=RATE)


def extended(centre: InertialParameters, recordings: Sequence[Recording], duration: float) -> Model:
    """Return the same with the device's errors, drag and unexplained torque, and a body that is hardly known."""
    model = rigid(centre, 1.0, recordings)
    smooth = SmoothTorque(duration, KNOTS, TORQUE), SmoothForce(duration, KNOTS, BIAS)
    for effect in (GyroCross(), WheelTilt(), WheelDelay(), AirDrag(DRAG), *smooth):
        model = model.extend(effect)
    return model


def manoeuvres(model: Model, recordings: Sequence[Recording]) -> list[Manoeuvre]:
    """Return the recordings as manoeuvres of a body without joints."""
    return [Manoeuvre(recording, MeasuredMotion.from_recording(recording, model.robot)) for recording in recordings]


def _white(sigma: Floats) -> White:
    return White((float(sigma[0]), float(sigma[1]), float(sigma[2])))


def is_own(name: str) -> bool:
    """Whether an unknown belongs to one throw alone."""
    return "[" in name


def is_rigid(name: str) -> bool:
    """Whether an unknown is one of the rigid model: body, initial rate and accelerometer bias, mass known."""
    return is_fitted(name) and ("base_link" in name or name.startswith(("initial-rate", "throw-bias")))


def is_fitted(name: str) -> bool:
    """Whether an unknown is one of the extended model: all but the mass, which the scales know."""
    return not name.endswith(".alpha")


def is_calibration(name: str) -> bool:
    """Whether an unknown is one of the device's, the same on all bodies."""
    return name.startswith(("gyro-cross", "wheel-tilt", "wheel-delay"))
