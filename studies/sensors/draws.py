"""Repeated noise, and the errors that treatments leave of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesid import MeasuredMotion, Recording
from studies.common.ets7 import ets7
from studies.sensors.linear import recording_of
from studies.sensors.setting import Flight, Noise, motion
from studies.sensors.treatments import Treatment

__all__ = ["Draws"]

Floats = NDArray[np.floating]


class Draws:
    """N sets of noise about one flight; what a treatment made of them is kept.

    Parameters
    ----------
    flight : Flight
    count : int
        N.
    seed : int
        Levels of noise share the underlying unit noise, so that they differ by the level alone.
    """

    def __init__(self, flight: Flight, count: int, seed: int) -> None:
        self.flight, self.count = flight, count
        self._truth = {"rate": flight.rate, "accel": flight.accel, "encoder": flight.position}
        rngs = [np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(3)]
        self._unit = {
            family: rng.standard_normal((count, *values.shape))
            for rng, (family, values) in zip(rngs, self._truth.items(), strict=True)
        }
        self._kept: dict[tuple[str, str, float], Floats] = {}

    def over(self, flight: Flight) -> Draws:
        """Return the same noise about another flight with the same joint motion."""
        new = object.__new__(Draws)
        new.__dict__.update(self.__dict__)
        new.flight = flight
        new._truth = {"rate": flight.rate, "accel": flight.accel, "encoder": flight.position}
        new._kept = {key: value for key, value in self._kept.items() if key[1] == "encoder"}
        return new

    def raw(self, family: str, noise: Noise) -> Floats:
        """Return the errors of one field of `Noise`, shape (N, T, n)."""
        errors: Floats = getattr(noise, family) * self._unit[family]
        return errors

    def measured(self, family: str, noise: Noise) -> Floats:
        """Return the samples of one field of `Noise`, shape (N, T, n)."""
        samples: Floats = self._truth[family] + self.raw(family, noise)
        return samples

    def treated(self, treatment: Treatment, family: str, noise: Noise) -> Floats:
        """Return treated values less the true values, and two derivatives as treated, shape (N, 3, T, n)."""
        sigma: float = getattr(noise, family)
        key = treatment.title, family, sigma
        if key not in self._kept:
            found = np.stack([treatment(self.flight.time, own, sigma) for own in self.measured(family, noise)])
            found[:, 0] -= self._truth[family]
            self._kept[key] = found
        return self._kept[key]

    def joints(self, treatment: Treatment, noise: Noise) -> Floats:
        """Return the errors of joint positions, velocities and accelerations after a treatment, (N, 3, T, joints)."""
        errors = self.treated(treatment, "encoder", noise).copy()
        _, velocity, acceleration = motion().evaluate(self.flight.time)
        errors[:, 1] -= velocity
        errors[:, 2] -= acceleration
        return errors

    def exact_joints(self) -> Floats:
        """Return the errors of joints that are known exactly."""
        return np.zeros((self.count, 3, *self.flight.position.shape))

    def measured_motion(self, noise: Noise, index: int = 0) -> MeasuredMotion:
        """Return the package's smoothed joints of one draw."""
        return MeasuredMotion.from_recording(self.recording(noise, index), ets7(), sigma={0: noise.encoder})

    def recording(self, noise: Noise, index: int = 0) -> Recording:
        """Return one draw as a recording."""
        values = [self.measured(family, noise)[index] for family in ("rate", "accel", "encoder")]
        return recording_of(self.flight.time, *values)
