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
    amplitude, centre : (joints,) array_like or float; typical excursion and position at rest of each joint [rad, or m]
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
