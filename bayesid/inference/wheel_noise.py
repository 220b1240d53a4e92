"""Errors of the recorded speeds of wheels, and how far the base seems to turn by them.

The speeds give the base's rate through the balance of momentum, and an error of a speed an error of the rate. Its
integral is an error of attitude, which turns the momentum that the base is taken to have: for slow wheels nothing, for
wheels that hold much momentum soon more than the error of the rate itself. The turn obeys

    turn' = -rate x turn + (change of the rate by the turn) turn + (change of the rate by the speeds) errors

and is integrated from sample to sample, along which the errors of the speeds add as the wheels' angles do.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from bayesid._math.arrays import Floats
from bayesid.inference.encoder_noise import WheelSensitivity
from bayesid.inference.whitening import WINDOWS, MotionErrors
from bayesid.recording.wheel_motion import WheelMotion

__all__ = ["wheel_errors"]

ANGLE, SPEED, ACCELERATION = range(3)  # of the covariances of a wheel's motion


def wheel_errors(wheels: WheelMotion, time: Floats, rate: Floats, slopes: WheelSensitivity, lags: int) -> MotionErrors:
    """Return the errors of the wheels' speed and acceleration and the turn of the base by them, which has three axes.

    Parameters
    ----------
    wheels : WheelMotion
    time : (T,) array
        Sample times [s].
    rate : (T, 3) array
        Rate of the base, base axes [rad/s].
    slopes : WheelSensitivity
    lags : int
        Number of earlier samples with which covariances are given.
    """
    reach = min(max(WINDOWS), len(time) - 1)  # samples over which errors of speeds are correlated
    known = wheels.lag_covariance(time, reach)
    carried, pushed = _steps(time, rate, slopes)
    with_motion, among = _turns(known, carried, pushed)
    covariance = np.zeros((len(known), lags + 1, len(time), 5, 5))
    covariance[..., :2, :2] = known[:, : lags + 1, :, SPEED:, SPEED:]
    for lag in range(lags + 1):
        late, early = slice(lag, None), slice(0, len(time) - lag)
        covariance[:, lag, late, 2:, :2] = with_motion[:, late, reach - lag, :, SPEED:]
        covariance[:, lag, late, :2, 2:] = with_motion[:, early, reach + lag, :, SPEED:].swapaxes(-1, -2)
        covariance[:, lag, late, 2:, 2:] = among[:, late, lag]
    of_turn = np.broadcast_to(slopes.of_turn, (len(known), *slopes.of_turn.shape))
    return MotionErrors(np.concatenate([slopes.readings, of_turn], axis=1), covariance)


def _steps(time: Floats, rate: Floats, slopes: WheelSensitivity) -> tuple[Floats, Floats]:
    """Return what carries a turn from sample to sample, (T - 1, 3, 3), and what a wheel's angle adds, (W, T - 1, 3)."""
    x, y, z = rate.T
    zero = np.zeros_like(x)
    crossed = np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), -1, 0)
    change = slopes.rate_of_turn - crossed
    mean, step = 0.5 * (change[1:] + change[:-1]), np.diff(time)[:, None, None]
    half = expm(0.5 * step * mean)
    return half @ half, np.einsum("tij,wtj->wti", half, 0.5 * (slopes.rate[:, 1:] + slopes.rate[:, :-1]))


def _turns(known: Floats, carried: Floats, pushed: Floats) -> tuple[Floats, Floats]:
    """Return the covariances of the turn by each wheel with that wheel's errors and with itself.

    Parameters
    ----------
    known : (W, lags + 1, T, 3, 3) array
        Covariances of angle, speed and acceleration with those at earlier samples.
    carried : (T - 1, 3, 3) array
    pushed : (W, T - 1, 3) array

    Returns
    -------
    with_motion : (W, T, 2 lags + 1, 3, 3) array
        Of the turn at a sample with the increment of the angle in the step after, the speed and the acceleration at
        the samples from ``lags`` before to ``lags`` after it.
    among : (W, T, lags + 1, 3, 3) array
        Of the turn at a sample with that at earlier ones.
    """
    count, reach = known.shape[2], known.shape[1] - 1
    steps = _of_steps(known)
    with_motion = np.zeros((len(known), count, 2 * reach + 1, 3, 3))
    among = np.zeros((len(known), count, reach + 1, 3, 3))
    for k in range(count - 1):
        gain = pushed[:, k, None, :, None]
        # the window of samples moves on by one: what was at place j is at j - 1
        moved = carried[k] @ with_motion[:, k, 1:]
        with_motion[:, k + 1, :-1] = moved + gain * steps[:, k, 1:, None, :]
        # increments with earlier turns, from the next sample's past to this one
        far = min(reach, k + 1)
        past = with_motion[..., ANGLE][:, np.arange(k, k - far, -1), np.arange(reach, reach + far)]
        among[:, k + 1, 1 : far + 1] = carried[k] @ among[:, k, :far] + gain * past[:, :, None, :]
        cross = carried[k] @ with_motion[:, k, reach, :, ANGLE, None] * pushed[:, k, None, :]
        added = steps[:, k, reach, ANGLE, None, None] * gain[:, 0] * pushed[:, k, None, :]
        among[:, k + 1, 0] = carried[k] @ among[:, k, 0] @ carried[k].T + cross + cross.swapaxes(1, 2) + added
    return with_motion, among


def _of_steps(known: Floats) -> Floats:
    """Return the covariance of the increment of each angle in a step with those in others, speed and acceleration.

    Returns
    -------
    (W, T, 2 lags + 1, 3) array
        Of the step after a sample with those at the samples from ``lags`` before to ``lags`` after it; zero where the
        errors are too far apart to be correlated.
    """
    wheels, many, count = known.shape[:3]
    reach = many - 1
    # angle at a sample with everything at the samples around it
    around = np.zeros((wheels, count, 2 * reach + 1, 3))
    for lag in range(many):
        around[:, lag:, reach - lag] = known[:, lag, lag:, ANGLE]
        around[:, : count - lag, reach + lag] = known[:, lag, lag:, :, ANGLE]
    result = np.zeros_like(around)
    result[:, :-1, 1:] = around[:, 1:, :-1] - around[:, :-1, 1:]
    # angles of the others become increments, too
    result[:, :-1, 1:-1, ANGLE] = _next(result[..., ANGLE])[:, :-1, 1:-1] - result[:, :-1, 1:-1, ANGLE]
    result[:, :, [0, -1]] = 0.0
    return result


def _next(values: Floats) -> Floats:
    """Return what stands one place later on the last axis, zero at its end."""
    return np.concatenate([values[..., 1:], np.zeros_like(values[..., :1])], axis=-1)
