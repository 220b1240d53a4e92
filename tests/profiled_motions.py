"""Moves as a robot's controller makes them, one after another, with jumps of acceleration or jerk where they begin."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from studies.truth.motions import Manoeuvres, Motion
from studies.truth.numerics import Array


def trapezoid(time: float, length: float, ramp: float) -> tuple[float, float, float]:
    """Return distance, speed and acceleration of a move of one in a time, with even speed between two ramps."""
    speed = 1.0 / (length - ramp)
    slope = speed / ramp
    if time <= 0.0 or time >= length:
        return float(time >= length), 0.0, 0.0
    if time < ramp:
        return 0.5 * slope * time**2, slope * time, slope
    left = length - time
    if left < ramp:
        return 1.0 - 0.5 * slope * left**2, slope * left, -slope
    return speed * (time - 0.5 * ramp), speed, 0.0


@dataclass(frozen=True)
class ProfiledManoeuvres(Manoeuvres):
    """Moves one after another with rests between, as a robot's controller makes them.

    Each begins and ends at instants that are no sample times. With the trapezoidal profile of speed the accelerations
    jump where a joint begins or ends to speed up or to brake. `ramp` is the time of speeding up and of braking of that
    profile [s], and `amplitude` the longest move [rad]. `profile` returns distance, speed and acceleration of a move of
    one from time, length and ramp.
    """

    ramp: float = 6.0
    profile: Callable[[float, float, float], tuple[float, float, float]] = trapezoid

    def draw(self, kinds: Sequence[str], generator: np.random.Generator) -> Motion:
        """Motion of joints of these kinds, as the URDF names them."""
        scale = np.array([1.0 / 3.0 if kind == "prismatic" else 1.0 for kind in kinds])
        rest = self.centre_spread * scale * generator.uniform(-1.0, 1.0, len(kinds))
        moves: list[tuple[float, float, Array]] = []
        end = 7.0
        while True:
            begin, length = end + generator.uniform(1.0, 3.0), generator.uniform(20.0, 30.0)
            end = begin + length
            if end > self.duration - 2.0:
                break
            moves.append((begin, length, self.amplitude * scale * generator.uniform(-1.0, 1.0, len(kinds))))

        def motion(time: float) -> tuple[Array, Array, Array]:
            state = [rest.copy(), np.zeros(len(kinds)), np.zeros(len(kinds))]
            for begin, length, distance in moves:
                for part, value in zip(state, self.profile(time - begin, length, self.ramp), strict=True):
                    part += value * distance
            return state[0], state[1], state[2]

        return motion


def septic(time: float, length: float, ramp: float) -> tuple[float, float, float]:
    """Return the same of a move by a polynomial of seventh degree, which begins without a jump of the jerk."""
    x = min(max(time / length, 0.0), 1.0)
    left = x * (1.0 - x)
    return (
        x**4 * (35.0 - 84.0 * x + 70.0 * x**2 - 20.0 * x**3),
        140.0 * left**3 / length,
        420.0 * left**2 * (1.0 - 2.0 * x) / length**2,
    )


def cycloid(time: float, length: float, ramp: float) -> tuple[float, float, float]:
    """Return the same of a move with one period of a sine as its acceleration, whose jerk jumps at both ends."""
    x = 2.0 * np.pi * min(max(time / length, 0.0), 1.0)
    rate = 2.0 * np.pi / length
    return (x - np.sin(x)) / (2.0 * np.pi), (1.0 - np.cos(x)) / length, rate * np.sin(x) / length
