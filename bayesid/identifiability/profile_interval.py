"""Profile intervals: how far one quantity can move when all other unknowns adapt to it.

The posterior is maximised over all other unknowns while the quantity is held (Raue et al., Bioinformatics 2009; the
prior counts as a measurement). An interval contains the values whose maximum log density is less than half a chi-square
quantile below that of the mode. A strong penalty holds the quantity. Whatever the strength of the penalty, the result
of the penalised fit is the constrained optimum for the value that the quantity has there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from bayesid._math.arrays import Floats
from bayesid._math.least_squares import levenberg_marquardt

__all__ = ["Profile", "Target", "profile"]

Vector = Callable[[Floats], Floats]  # function of the coordinates (n,) that returns an array
# square roots of the chi-square quantiles of one degree of freedom, by the level of the interval
LEVELS = {"68 %": 1.0, "95 %": 1.959963984540054}
STEP = 0.5  # intended change of that square root from one point of a profile to the next
# residual that the penalty adds per standard deviation between the quantity and the value at which it is held
STIFF = 30.0
MOST = 24  # largest number of refits on each side of the mode, which bounds the run time
TOLERANCE = 1e-8  # relative tolerance of a refit on its cost, coordinates and gradient
# step, in standard deviations, below which a jump of the profile is accepted instead of refined further
SHORTEST = 1e-3
GROWTH = 3.0  # largest factor by which the expected step grows from one point to the next


class Target(NamedTuple):
    """A scalar function of the coordinates with its gradient (n,)."""

    value: Callable[[Floats], float]
    gradient: Vector


@dataclass(frozen=True)
class Profile:
    """Profile of one quantity."""

    values: Floats  #: (k,) values of the quantity, increasing
    #: (k,) signed square roots of twice the loss of log posterior density; they are -1 and 1 at the ends of the 68 %
    #: interval, and linear in the values for a normal posterior
    roots: Floats

    def interval(self, root: float) -> tuple[float | None, float | None]:
        """Return the ends of the interval between minus and plus a root, None where the profile does not reach it."""
        curve = PchipInterpolator(self.roots, self.values)
        return tuple(  # type: ignore[return-value]
            float(curve(end)) if self.roots[0] <= end <= self.roots[-1] else None for end in (-root, root)
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the intervals by level as they stand in identifiability.json."""
        return {level: list(self.interval(root)) for level, root in LEVELS.items()}


def profile(residual: Vector, jacobian: Vector, mode: Floats, covariance: Floats, target: Target) -> Profile:
    """Compute the profile of a quantity about the mode.

    Parameters
    ----------
    residual : callable
        Function of the coordinates (n,) that returns residuals (m,); half their sum of squares is minus the log
        posterior density, up to a constant.
    jacobian : callable
        Function of the coordinates that returns the derivative of the residuals, shape (m, n).
    mode : (n,) array
        Coordinates of the mode.
    covariance : (n, n) array
        Covariance of the normal approximation, which sets the first step and the strength of the penalty.
    target : Target
        Quantity to profile.
    """
    fit = _ConstrainedFit(residual, jacobian, mode, covariance, target)
    points = [*fit.march(-1.0)[::-1], _Point(target.value(mode), 0.0, mode), *fit.march(1.0)]
    for root in (sign * level for level in LEVELS.values() for sign in (-1.0, 1.0)):
        curve = _curve(_increasing(points))
        if curve.x[0] < root < curve.x[-1]:  # one more fit where the interval ends, to place the end accurately
            nearest = points[int(np.argmin([abs(point.root - root) for point in points]))]
            points = sorted([*points, fit.at(float(curve(root)), nearest.z)], key=lambda point: point.value)
    values, roots, _ = zip(*_increasing(points), strict=True)
    return Profile(np.array(values), np.array(roots))


class _Point(NamedTuple):
    value: float
    root: float
    z: Floats


class _ConstrainedFit:
    """Maximisation of the posterior with a quantity held by a penalty."""

    def __init__(self, residual: Vector, jacobian: Vector, mode: Floats, covariance: Floats, target: Target) -> None:
        self.residual, self.jacobian, self.mode, self.target = residual, jacobian, mode, target
        slope = target.gradient(mode)
        self.sd = float(np.sqrt(slope @ covariance @ slope))
        self.along = covariance @ slope / self.sd**2
        self.centre, self.best = target.value(mode), float((residual(mode) ** 2).sum())

    def at(self, prescribed: float, start: Floats) -> _Point:
        """Return the fit with the quantity held near a value."""
        stiffness = STIFF / self.sd

        def penalised(z: Floats) -> Floats:
            return np.append(self.residual(z), stiffness * (self.target.value(z) - prescribed))

        def slope(z: Floats) -> Floats:
            return np.vstack([self.jacobian(z), stiffness * self.target.gradient(z)])

        z = np.asarray(levenberg_marquardt(penalised, slope, start, TOLERANCE).x)
        value, loss = self.target.value(z), float((self.residual(z) ** 2).sum()) - self.best
        return _Point(value, float(np.sign(value - self.centre) * np.sqrt(max(loss, 0.0))), z)

    def march(self, sign: float) -> list[_Point]:
        """Return the points from the mode to one side, up to the first one beyond the 95 % interval."""
        last, step = _Point(self.centre, 0.0, self.mode), STEP * self.sd
        points: list[_Point] = []
        for _ in range(MOST):
            start = last.z + sign * step * self.along
            point = self.at(last.value + sign * step, start)
            gained = abs(point.root) - abs(last.root)
            if not np.isfinite(point.root) or sign * (point.value - last.value) <= 0.0:
                break
            if gained > 2.0 * STEP and step > SHORTEST * self.sd:
                step *= 0.5
                continue
            points.append(point)
            if abs(point.root) >= max(LEVELS.values()):
                break
            step = abs(point.value - last.value) * min(STEP / max(gained, STEP / GROWTH), GROWTH)
            last = point
        return points


def _increasing(points: Sequence[_Point]) -> list[_Point]:
    """Return the points without those that do not increase, whose refits ended at the level of rounding."""
    kept = [points[0]]
    for point in points[1:]:
        if point.value > kept[-1].value and point.root > kept[-1].root:
            kept.append(point)
    return kept


def _curve(points: Sequence[_Point]) -> PchipInterpolator:
    return PchipInterpolator([point.root for point in points], [point.value for point in points])
