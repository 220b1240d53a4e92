"""Repeated noise, and the errors that treatments leave of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from bayesid import MeasuredMotion, Recording
from bayesid._math.arrays import Floats
from studies.common.ets7 import ets7
from studies.sensors.linear import recording_of
from studies.sensors.setting import Flight, Noise, motion
from studies.sensors.treatments import Treatment

__all__ = ["Draws"]

FAMILIES = ("rate", "accel", "position")
"""Noisy signals, which `Flight` and `Noise` name alike."""


@dataclass(frozen=True)
class Draws:
    """N sets of noise about one flight.

    Parameters
    ----------
    flight : Flight
        True motion.
    unit : mapping of str to (N, T, n) array
        Noise of unit standard deviation by family of signals. All levels of noise share it, so that they differ by the
        level alone.
    kept : dict
        Signals that have been treated, by treatment, family and noise.
    """

    flight: Flight
    unit: Mapping[str, Floats]
    kept: dict[tuple[str, str, float], Floats] = field(default_factory=dict)

    @classmethod
    def of(cls, flight: Flight, count: int, rng: np.random.Generator) -> Draws:
        """Draw ``count`` sets of noise."""
        unit = {
            family: child.standard_normal((count, *getattr(flight, family).shape))
            for family, child in zip(FAMILIES, rng.spawn(len(FAMILIES)), strict=True)
        }
        return cls(flight, unit)

    def over(self, flight: Flight) -> Draws:
        """Return the same noise about another flight with the same joint motion."""
        return replace(
            self, flight=flight, kept={key: value for key, value in self.kept.items() if key[1] == "position"}
        )

    def raw(self, family: str, noise: Noise) -> Floats:
        """Return the errors of one family of signals, shape (N, T, n)."""
        errors: Floats = getattr(noise, family) * self.unit[family]
        return errors

    def treated(self, treatment: Treatment, family: str, noise: Noise) -> Floats:
        """Return the errors of treated values, and their two derivatives as treated, shape (N, 3, T, n)."""
        sigma: float = getattr(noise, family)
        key = treatment.title, family, sigma
        if key not in self.kept:
            truth = getattr(self.flight, family)
            samples = truth + self.raw(family, noise)
            treated = np.stack([treatment(self.flight.time, values, sigma) for values in samples])
            treated[:, 0] -= truth
            self.kept[key] = treated
        return self.kept[key]

    def joints(self, treatment: Treatment, noise: Noise) -> Floats:
        """Return the errors of joint positions, velocities and accelerations after a treatment, (N, 3, T, joints)."""
        errors = self.treated(treatment, "position", noise).copy()
        _, velocity, acceleration = motion().evaluate(self.flight.time)
        errors[:, 1] -= velocity
        errors[:, 2] -= acceleration
        return errors

    def exact_joints(self) -> Floats:
        """Return the errors of joints that are known exactly, (N, 3, T, joints)."""
        count, *shape = self.unit["position"].shape
        return np.zeros((count, 3, *shape))

    def recording(self, noise: Noise) -> Recording:
        """Return the first set of noise as a recording."""
        samples = (getattr(self.flight, family) + self.raw(family, noise)[0] for family in FAMILIES)
        return recording_of(self.flight.time, *samples)

    def measured_motion(self, noise: Noise) -> MeasuredMotion:
        """Return the joints of the first set of noise as the package smooths them."""
        return MeasuredMotion.from_recording(self.recording(noise), ets7(), sigma={0: noise.position})
