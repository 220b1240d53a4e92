"""Curves through samples: a modified Akima spline, a line between two samples, and a single sample held."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import Akima1DInterpolator, PPoly

from bayesid._math.arrays import Floats

__all__ = ["SampledCurve"]


@dataclass(frozen=True)
class SampledCurve:
    """Curve through samples, constant before the first and after the last of them.

    Parameters
    ----------
    time : (n,) array
        Increasing times of the samples [s].
    values : (n, k) array
        Samples; without any the curve is zero.
    """

    time: Floats
    values: Floats

    @cached_property
    def _pieces(self) -> PPoly:
        if len(self.time) == 2:
            slope = np.diff(self.values, axis=0) / np.diff(self.time)
            return PPoly(np.stack([slope, self.values[:1]]), self.time)
        return Akima1DInterpolator(self.time, self.values, method="makima")

    def at(self, time: Floats, order: int = 0) -> Floats:
        """Return a derivative of the curve, (T, k); order -1 is the integral from the first sample on.

        Parameters
        ----------
        time : (T,) array
            Times [s].
        order : int
            Order of the derivative.
        """
        if len(self.time) == 0:
            return np.zeros((len(time), self.values.shape[1]))
        inside = np.clip(time, self.time[0], self.time[-1])
        if order < 0:
            beyond = (time - inside)[:, None] * self.at(inside)
            if len(self.time) == 1:
                return beyond
            return np.asarray(self._pieces.antiderivative()(inside)) + beyond
        if len(self.time) == 1:
            return np.tile(self.values[0] if order == 0 else 0.0 * self.values[0], (len(time), 1))
        values = np.asarray(self._pieces.derivative(order)(inside) if order else self._pieces(inside))
        return values if order == 0 else np.where((time == inside)[:, None], values, 0.0)
