"""Noise of the samples, measured where the wheel hardly accelerates.

There the motion of a rigid body follows a polynomial of degree five over a few hundredths of a second; what samples
leave about such a polynomial is noise of the sensors and vibration of the wheel's bearings.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bayesid import Recording
from studies.throws.data import INTERVAL, WHEEL_INERTIA, WHEEL_STEPS

__all__ = ["quiet_noise"]

Floats = NDArray[np.floating]

SPAN, DEGREE = 13, 5
"""Samples of one polynomial and its degree."""

QUIET = 2000.0
"""Wheel acceleration up to which the polynomial follows the motion [rad/s2], a tenth of the largest."""


def quiet_noise(recordings: Sequence[Recording], sensor: str) -> Floats:
    """Return the standard deviation of one sample of a sensor, shape (3,), from all quiet stretches of some recordings.

    Every stretch of thirteen samples gives one residual, that of its middle; its variance is that of a sample times one
    less the weight that the middle has in its own polynomial.
    """
    place = np.vander(np.linspace(-1.0, 1.0, SPAN), DEGREE + 1)
    leave = (np.eye(SPAN) - place @ np.linalg.pinv(place))[SPAN // 2]
    square: list[Floats] = []
    for recording in recordings:
        time, values = recording.vector(sensor)
        if sensor == "wheel_momentum":
            time, values = time[::WHEEL_STEPS], values[::WHEEL_STEPS]
        wheel_time, wheel = recording.vector("wheel_momentum")
        slope = np.abs(np.gradient(wheel[:, 2], wheel_time)) / WHEEL_INERTIA
        for first in range(len(time) - SPAN + 1):
            own = slice(first, first + SPAN)
            inside = (wheel_time >= time[own][0]) & (wheel_time <= time[own][-1])
            if time[own][-1] - time[own][0] < (SPAN - 0.5) * INTERVAL and slope[inside].max() < QUIET:
                square.append((leave @ values[own]) ** 2 / leave[SPAN // 2])
    return np.sqrt(np.mean(square, axis=0))
