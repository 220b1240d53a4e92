"""Profile intervals: how far one quantity can go if all other unknowns follow it.

The posterior is maximised over everything else with the quantity held (Raue et al., Bioinformatics 2009; the prior
counts as a measurement). An interval holds the values whose maximum is less than half a chi-square quantile below the
mode. A quantity is held by a strong penalty: where the penalised fit ends it has some value, and for that value this is
the constrained optimum, however strong the penalty was.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import least_squares

from bayesid.arrays import Floats

__all__ = ["Profile", "Target", "profile"]

Residual = Callable[[Floats], Floats]

LEVELS = {"68 %": 1.0, "95 %": 1.959963984540054}
"""Square roots of the chi-square quantiles of one degree of freedom."""

STEP = 0.5
"""Between points of a profile, in that square root."""

STIFF = 30.0
"""Of the penalty, per standard deviation of the quantity."""

MOST = 24
"""Points on each side."""

TOLERANCE = 1e-8
GROWTH = 3.0
"""By which a step at most grows or shrinks from one point to the next."""


class Target(NamedTuple):
    """A scalar function of the coordinates with its gradient (n,)."""

    value: Callable[[Floats], float]
    gradient: Callable[[Floats], Floats]


@dataclass(frozen=True)
class Profile:
    """Profile of one quantity.

    Attributes
    ----------
    values : (k,) array
        Of the quantity, increasing.
    roots : (k,) array
        Signed square root of twice the loss of log posterior density; minus and plus one are the ends of the 68 %
        interval, and for a normal posterior it is linear.
    """

    values: Floats
    roots: Floats

    def interval(self, root: float) -> tuple[float | None, float | None]:
        """Return the ends of the interval at a root, None where the profile does not reach it."""
        curve = PchipInterpolator(self.roots, self.values)
        return tuple(  # type: ignore[return-value]
            float(curve(end)) if self.roots[0] <= end <= self.roots[-1] else None for end in (-root, root)
        )

    def to_dict(self) -> dict[str, Any]:
        """Intervals, as in JSON."""
        return {level: list(self.interval(root)) for level, root in LEVELS.items()}


def profile(
    residual: Residual, jacobian: Callable[[Floats], Floats], mode: Floats, covariance: Floats, target: Target
) -> Profile:
    """Profile a quantity about the mode.

    Parameters
    ----------
    residual : callable
        Coordinates (n,) to residuals whose half square sum is minus the log posterior density, up to a constant.
    jacobian : callable
        Its derivative.
    mode : (n,) array
    covariance : (n, n) array
        Of the normal approximation; for the first step and the strength of the penalty.
    target : Target
    """
    best = 0.5 * float((residual(mode) ** 2).sum())
    sides = [_march(residual, jacobian, mode, covariance, target, best, sign) for sign in (-1.0, 1.0)]
    points = [*sides[0][::-1], (target.value(mode), 0.0), *sides[1]]
    kept = [points[0]]
    for point in points[1:]:  # refits that ended in rounding are no curve
        if point[0] > kept[-1][0] and point[1] > kept[-1][1]:
            kept.append(point)
    values, roots = np.array(kept).T
    return Profile(values, roots)


def _march(
    residual: Residual,
    jacobian: Callable[[Floats], Floats],
    mode: Floats,
    covariance: Floats,
    target: Target,
    best: float,
    sign: float,
) -> list[tuple[float, float]]:
    """Go from the mode to one side until the 95 % interval ends."""
    slope = target.gradient(mode)
    along = covariance @ slope
    sd = float(np.sqrt(slope @ along))
    stiffness = STIFF / sd
    z, value, root, step = mode, target.value(mode), 0.0, STEP * sd
    found: list[tuple[float, float]] = []
    while abs(root) < max(LEVELS.values()) and len(found) < MOST:
        wanted = value + sign * step
        z, moved = _refit(residual, jacobian, target, z + along * (sign * step / sd**2), wanted, stiffness), value
        value, before = target.value(z), root
        loss = 0.5 * float((residual(z) ** 2).sum()) - best
        root = sign * float(np.sqrt(max(2.0 * loss, 0.0)))
        if not np.isfinite(root) or sign * (value - moved) <= 0.0:
            break
        found.append((value, root))
        gained = max(abs(root - before), STEP / GROWTH)
        step = abs(value - moved) * min(STEP / gained, GROWTH)
    return found


def _refit(
    residual: Residual,
    jacobian: Callable[[Floats], Floats],
    target: Target,
    start: Floats,
    wanted: float,
    stiffness: float,
) -> Floats:
    def held(z: Floats) -> Floats:
        r = np.append(residual(z), stiffness * (target.value(z) - wanted))
        return np.where(np.isfinite(r), r, 1e12)

    def slope(z: Floats) -> Floats:
        return np.vstack([jacobian(z), stiffness * target.gradient(z)])

    solution = least_squares(
        held, start, slope, method="lm", x_scale="jac", ftol=TOLERANCE, xtol=TOLERANCE, gtol=TOLERANCE
    )
    return np.asarray(solution.x)
