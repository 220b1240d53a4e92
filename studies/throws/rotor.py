"""The line with which an unbalanced wheel shakes the device, in the raw readings, and the phase it gives the wheel.

While the wheel coasts at speed, the raw readings are projected on harmonics of its recorded angle (order tracking: Fyfe
and Munck 1997). An imbalance gives a peak at the order of its turns, which is one unless the number of pole pairs is
wrong: where the line is at 6/7 of the recorded speed, a motor that was taken to have six pairs of poles has seven.

The angle of the wheel at the start of a throw is not recorded. The phase of the line gives it, up to an angle that all
throws of a body share.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np
from scipy.integrate import cumulative_trapezoid

from bayesid._math.arrays import Floats
from studies.throws.raw import RawThrow, Timing

ORDERS = np.arange(0.4, 3.601, 0.02)  # frequencies relative to the wheel's as it is recorded
TURN = 1.5  # order below which the wheel's own turn is looked for

FAST = 0.8  # share of a throw's highest wheel speed above which it is fast
# relative change of the wheel's speed in a second, up to which it coasts [1/s]: an eighth in the whole of it
STEADY = 1.5
SPAN = 0.005  # of the slope of the speed, longer than a reading is held [s]
# distance within which a loudest line counts as one of an order; the wheel coasts for some 0.09 s, which tells orders
# 0.05 apart
NEAR = 0.03
DEGREE = 3  # of the polynomial that the motion of the body is taken for while the wheel coasts


def lines_of(raw: RawThrow, timing: Timing, orders: Floats) -> Floats:
    """Return complex amplitudes (orders, 6) of readings at harmonics of the wheel's angle after the start of a flight.

    Parameters
    ----------
    raw : RawThrow
    timing : Timing
    orders : (n,) array; frequencies relative to that of the wheel
    """
    flight = (raw.clock > timing.start) & (raw.clock < timing.end)
    clock, readings = raw.clock[flight], raw.readings[flight]
    speed = np.abs(raw.wheel_speed(clock, timing))
    slope = np.abs(_speed_after(raw, clock, timing) - speed) / SPAN
    coasting = np.flatnonzero((speed > FAST * speed.max()) & (slope < STEADY * speed))
    rows = slice(coasting[0], coasting[-1] + 1)
    count = len(clock[rows])
    smooth = np.vander(np.linspace(-1.0, 1.0, count), DEGREE + 1)
    left = readings[rows] - smooth @ np.linalg.lstsq(smooth, readings[rows], rcond=None)[0]
    weight = np.hanning(count)
    turn = cumulative_trapezoid(speed, clock, initial=0)[rows]
    return np.asarray(np.exp(-1j * np.outer(orders, turn)) @ ((2.0 * weight / weight.sum())[:, None] * left))


def _speed_after(raw: RawThrow, clock: Floats, timing: Timing) -> Floats:
    return np.abs(raw.wheel_speed(clock + SPAN, timing))


def loudest_orders(amplitudes: Floats) -> Floats:
    """Return the order below 1.5 of the loudest line in each throw of a body, (throws,), on the axis shaken most.

    Parameters
    ----------
    amplitudes : (throws, orders, 6) array; at `ORDERS`
    """
    low = ORDERS < TURN
    axis = 3 + int(np.argmax(np.sqrt((amplitudes[:, low, 3:] ** 2).mean(axis=0)).max(axis=0)))
    return ORDERS[low][np.argmax(amplitudes[:, low, axis], axis=1)]


def pole_pairs(orders: Floats, timing: Timing) -> int:
    """Return the number of pole pairs with which the loudest lines of some throws, (throws,), are the wheel's turn."""
    return round(timing.pole_pairs / float(np.median(orders)))


def speed_ratio(orders: Floats, timing: Timing) -> Fraction:
    """Return the wheel's speed over the recorded one that the loudest lines of some throws say, such as 6/7."""
    return Fraction(timing.pole_pairs, pole_pairs(orders, timing))


def near(orders: Floats, order: float) -> int:
    """Return how many loudest lines, (throws,), are at an order."""
    return int((np.abs(orders - order) < NEAR).sum())


def rotor_phases(raws: Sequence[RawThrow], timing: Timing) -> Floats:
    """Return the angle of the wheel at the start of each flight of a body, (throws,) [rad], up to one that they share.

    The force of an imbalance shakes the axes of the accelerometer in the same proportions in all throws, those of the
    first singular vector of their lines.
    """
    lines = np.stack([lines_of(raw, timing, np.ones(1))[0, 3:] for raw in raws])
    shape = np.linalg.svd(lines)[2][0]
    shape = shape * np.exp(-1j * np.angle(shape[np.argmax(np.abs(shape))]))
    return np.angle(lines @ shape.conj())
