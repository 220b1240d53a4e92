"""ETS-VII as all studies take it: robot, orbit, sensors, flight rule, and its manoeuvres.

Two versions of the flight's manoeuvre differ in their corners. The flight moved joints 2 to 4 out and back on linear
ramps of 22.6 s. `studies.ets7_drift` starts from joints at zero and makes each ramp one quintic (``corner=None``), with
a peak speed 1.875 times the flight's; `studies.common.mission` starts with the wrist extended and keeps the flight's
speed between corners of 4 s.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from bayesid.design import Limits
from bayesid.recording.joint_motion import Excitation, Motion
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.robot import Robot

Floats = NDArray[np.floating]

BASE, TIP = "base_link", "tip"  # links of the base body and of the end-effector
RADIUS = 6.916e6  # radius of the circular orbit, as the paper states it [m]
ACCELEROMETER = (0.4, 0.3, 0.8)  # mounting point of the accelerometer in the base [m]; no source states it

# noise per sample of rates, accelerations and joint positions: two seconds of arc per second, a good accelerometer,
# good encoders [rad/s, m/s2, rad]
RATE, ACCEL, ENCODER = 1e-5, 1e-5, 1e-6

INTERVAL = 0.5  # time between samples of all sensors [s]; assumed
BIAS = 1e-4  # standard deviation of the accelerometer's constant error [m/s2]
TIP_SPEED, TIP_RATE = 0.05, float(np.radians(5.0))  # rule of the experiments on ETS-VII for the tip [m/s, rad/s]
LIMITS = Limits(tip_speed=TIP_SPEED, tip_rate=TIP_RATE)  # the same rule as limits of a design
START = np.array([0.0, -0.6, 1.0, -0.4, 0.3, 0.0])  # joint positions before and after a manoeuvre [rad]; assumed

# excursion of the six joints between the flight's two ramps [rad]
EXCURSION = np.array([0.0, 0.264, -0.321, 0.057, 0.0, 0.0])

# start and end of the ramps out and back [s]: the flight's 682.5 to 705.1 s and 744.5 to 767.1 s, counted from a minute
# before them
RAMPS = ((60.0, 82.6), (122.0, 144.6))

# time within which a joint reaches its speed [s]; assumed, since a sharp corner would take an infinite torque
CORNER = 4.0

# period and ramp of the paper's excitation at its fastest [s], and its number of periods; the base then turns with 8
# mrad/s at most
PERIOD, RAMP, PERIODS = 30.0, 30.0, 2

# instants of this excitation with different poses [s]: at rest, and in half of an oscillation, which then goes back
POSES = np.array([0.0, RAMP, RAMP + 0.25 * PERIOD, RAMP + 0.5 * PERIOD])


@cache
def ets7() -> Robot:
    """Return ETS-VII as it is shipped."""
    return Robot.shipped("ets7")


@dataclass(frozen=True)
class FlightManoeuvre:
    """Manoeuvre that ETS-VII flew: joints 2 to 4 out and back; a `bayesid.recording.joint_motion.Motion`."""

    start: Floats  # (6,): joint positions before and after [rad]
    excursion: Floats = field(default_factory=lambda: EXCURSION)  # (6,): excursion between the ramps [rad]
    corner: float | None = CORNER  # length of the rounded corners of linear ramps [s]; None makes each ramp one quintic
    earlier: float = 0.0  # time by which all of it happens earlier than `RAMPS` [s]

    def evaluate(self, time: Floats) -> JointState:
        """Return the joint state at the times, shape (T,)."""
        time = np.asarray(time, dtype=float) + self.earlier
        share = np.zeros((3, len(time)))
        for sign, (begin, end) in zip((1.0, -1.0), RAMPS, strict=True):
            if self.corner is None:
                share += sign * _quintic((time - begin) / (end - begin), end - begin)
            else:
                bends = _bend(time - begin, self.corner) - _bend(time - end, self.corner)
                share += sign / (end - begin) * bends
        position, velocity, acceleration = share[:, :, None] * self.excursion
        return JointState(self.start + position, velocity, acceleration)


def _quintic(x: Floats, length: float) -> Floats:
    """Quintic from 0 to 1 between x of 0 and 1, and two derivatives by time if that takes a length [s]; (3, T)."""
    x = np.clip(x, 0.0, 1.0)
    value, slope = x**3 * (10.0 - 15.0 * x + 6.0 * x**2), 30.0 * x**2 * (1.0 - x) ** 2
    return np.stack([value, slope / length, 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / length**2])


def _bend(time: Floats, corner: float) -> Floats:
    """Zero, then a line of unit slope from time 0 on, the corner rounded by a sextic; and two derivatives, (3, T)."""
    x = np.clip(time / corner + 0.5, 0.0, 1.0)
    beyond = np.maximum(time - 0.5 * corner, 0.0)
    value, slope, _ = _quintic(x, corner)
    return np.stack([corner * x**4 * (2.5 - 3.0 * x + x**2) + beyond, value, slope])


@cache
def extended_wrist() -> tuple[float, float, float]:
    """Return joints 4 to 6 with the tip farthest from the elbow [rad]; of two mirror images the one nearer zero.

    The distance depends on neither shoulder nor elbow, nor on joint 6, whose axis goes through the tip.
    """

    def minus_reach(wrist: Floats) -> float:
        rest = np.array([[0.0, 0.0, 0.0, *wrist, 0.0]])
        joints = kinematics(ets7(), JointState(rest, 0.0 * rest, 0.0 * rest)).pose[0]
        return -float(np.linalg.norm(tip_of(joints[None])[0] - joints[2, :3, 3]))

    wrist = minimize(minus_reach, [-0.5, -0.4], method="Nelder-Mead", options={"xatol": 1e-8, "fatol": 1e-14}).x
    return float(wrist[0]), float(wrist[1]), 0.0


def excitation(q: Floats, slow: float = 1.0) -> Excitation:
    """Return the paper's excitation (27) of the first three joints with the wrist extended, ``slow`` times slower.

    Parameters
    ----------
    q : (6,) array; q1 and q2 of joint 1, of joint 2, of joint 3 [rad]
    """
    wrist = np.array(extended_wrist())
    return Excitation(
        offset=np.concatenate([q[0::2], wrist]),
        amplitude=np.concatenate([q[1::2], np.zeros(3)]),
        frequency=2.0 * np.pi / (slow * PERIOD),
        periods=PERIODS,
        ramp=slow * RAMP,
        start=np.concatenate([np.zeros(3), wrist]),
    )


def tip_of(pose: Floats) -> Floats:
    """Return the tip's position from poses of the joints (T, joints, 4, 4): 0.53 m along the axis of joint 6."""
    tip: Floats = pose[:, -1] @ np.array([0.0, 0.0, 0.53, 1.0])
    return tip[:, :3]


def tip_speed(motion: Motion, duration: float) -> tuple[float, float]:
    """Return the largest speed [m/s] and turning rate [rad/s] of the tip relative to the base during a motion."""
    moving = kinematics(ets7(), motion.evaluate(np.linspace(0.0, duration, 400)))
    speed = np.linalg.norm(tip_of(moving.rate), axis=1).max()
    # the derivative of a rotation matrix has twice the squared norm of the angular velocity
    rate = np.linalg.norm(moving.rate[:, -1, :3, :3], axis=(1, 2)).max() / np.sqrt(2.0)
    return float(speed), float(rate)
