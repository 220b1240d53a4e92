"""Whitened residuals of a hypothesis by recording and sensor axis, ready to be drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis import Hypothesis
from bayesid.inference.posterior import Posterior
from bayesid.simulation.sensors import Kind

__all__ = ["Residuals"]


@dataclass(frozen=True)
class Residuals:
    """Whitened residuals: independent and of unit variance if the hypothesis is right.

    Attributes
    ----------
    posterior : Posterior
        Whose noise whitened them.
    values : (R, O, C) array
    """

    posterior: Posterior
    values: Floats

    @classmethod
    def of(cls, hypothesis: Hypothesis) -> Residuals:
        """Take the residuals of a hypothesis at its mode."""
        posterior = hypothesis.fit.posterior
        return cls(posterior, hypothesis.fit.residual.reshape(posterior.residual_shape))

    @property
    def kinds(self) -> list[Kind]:
        """Sensors, in the order of the channels."""
        return [sensor.kind for sensor in self.posterior.model.sensors]

    @property
    def recordings(self) -> int:
        """Number of recordings."""
        return len(self.posterior.manoeuvres)

    def channel(self, recording: int, channel: int) -> tuple[Floats, Floats]:
        """Return times [s] and residuals of one sensor axis in one recording, where it has samples."""
        item = self.posterior.whitenings[recording]
        there = np.flatnonzero(item.outputs[:, channel])
        time = self.posterior.data.times(recording)[item.rows[there]]
        return time, self.values[recording, there, channel]
