"""Joint motions from rest to rest, each drawn from a seed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from studies.truth.numerics import Array, quintic_step

# time [s] -> positions, speeds, accelerations of the joints, each (joints,)
Motion = Callable[[float], tuple[Array, Array, Array]]


def smooth_motion(
    joints: int,
    duration: float,
    seed: int,
    *,
    amplitude: ArrayLike = 0.5,
    centre: ArrayLike = 0.0,
    frequencies: Sequence[float] = (0.02, 0.035, 0.06),
    ramp: float = 20.0,
) -> Motion:
    """Rest-to-rest motion: sines under a quintic ramp at both ends.

    Parameters
    ----------
    joints : int; number of joints
    duration : float; length of the motion [s]; the joints rest before and after it
    seed : int; seed of amplitudes, frequencies and phases
    amplitude, centre : (joints,) array_like or float
        Typical excursion and position at rest of each joint [rad, or m].
    frequencies : sequence of float; frequencies of the sines [Hz], each varied by up to 20 % from joint to joint
    ramp : float; length of each ramp [s]

    Returns
    -------
    callable
        Time -> positions, speeds, accelerations, each (joints,).
    """
    if 2.0 * ramp > duration:
        raise ValueError(f"two ramps of {ramp:g} s do not fit in {duration:g} s; shorten the ramp")
    generator = np.random.default_rng(seed)
    shape = (joints, len(frequencies))
    omega = 2.0 * np.pi * np.asarray(frequencies) * generator.uniform(0.8, 1.2, shape)
    size = generator.uniform(0.5, 1.0, shape) * np.broadcast_to(amplitude, joints)[:, None] / np.sqrt(shape[1])
    phase = generator.uniform(0.0, 2.0 * np.pi, shape)
    rest = np.broadcast_to(np.asarray(centre, dtype=float), joints)

    def window(time: float) -> Array:
        x, sign = (time, 1.0) if time < ramp else (duration - time, -1.0)
        value, slope, bend = quintic_step(x / ramp)
        return np.array([value, sign * slope / ramp, bend / ramp**2])

    def motion(time: float) -> tuple[Array, Array, Array]:
        s, ds, dds = window(time)
        angle = omega * time + phase
        f = (size * np.sin(angle)).sum(axis=1)
        df = (size * omega * np.cos(angle)).sum(axis=1)
        ddf = -(size * omega**2 * np.sin(angle)).sum(axis=1)
        return rest + s * f, ds * f + s * df, dds * f + 2.0 * ds * df + s * ddf

    return motion


@dataclass(frozen=True)
class Manoeuvres:
    """Joint motions of a study, one `smooth_motion` with another seed per recording.

    `amplitude` is that of rotating joints [rad]; prismatic ones move a third as far in metres. Initial rates are drawn
    with `rate_spread` [rad/s] per axis, initial attitudes from all rotations.
    """

    count: int = 3
    duration: float = 150.0
    amplitude: float = 0.6
    centre_spread: float = 0.6
    frequencies: Sequence[float] = (0.02, 0.035, 0.06)
    ramp: float = 20.0
    rate_spread: float = 5e-4

    def draw(self, kinds: Sequence[str], generator: np.random.Generator) -> Motion:
        """Motion of joints of these kinds, as the URDF names them."""
        scale = np.array([1.0 / 3.0 if kind == "prismatic" else 1.0 for kind in kinds])
        return smooth_motion(
            len(kinds),
            self.duration,
            int(generator.integers(2**31)),
            amplitude=self.amplitude * scale,
            centre=self.centre_spread * scale * generator.uniform(-1.0, 1.0, len(kinds)),
            frequencies=self.frequencies,
            ramp=self.ramp,
        )


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
