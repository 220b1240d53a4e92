"""Widths of the unexplained torque and force of each body, and of what no smooth function follows.

Their values at the knots are independent and normal with one width per body. Given the width, the posterior of
every value has a mean and a variance; the width that raises the marginal likelihood is the root mean square of the
values under it (expectation-maximisation: Dempster, Laird and Rubin 1977). The ratio of new to old width tends to one.

The noise that quiet stretches show is a lower bound: what vibrates too fast for the knots is in flight beside it. The
residuals say how much more there is, axis by axis, with the samples that a throw's own unknowns absorb counted out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studies.throws.effects import Smooth
from studies.throws.joint import Joint, Throw, maximise_jointly

__all__ = ["LARGEST", "SMOOTH", "SmoothWidth", "fit_widths", "noise_of", "width_of"]

Floats = NDArray[np.floating]

SMOOTH = ("smooth-torque", "smooth-force")

ITERATIONS = 15

SETTLED = 0.03
"""Relative change of every width at which the iteration ends."""

LARGEST = 1.3
"""Root mean square of the values found over their prior width beyond which a body's model is doubtful."""


@dataclass(frozen=True)
class SmoothWidth:
    """Width of the unexplained torque or force of one body.

    Attributes
    ----------
    sd : float
        Prior standard deviation of the values at the knots [N m or m/s2].
    factor : float
        By which one more step would change it.
    ratio : float
        Root mean square of the most probable values over ``sd``.
    """

    sd: float
    factor: float
    ratio: float

    @property
    def doubtful(self) -> bool:
        """Whether what was found is larger than its prior allows."""
        return self.ratio > LARGEST


def width_of(joint: Joint, body: str, effect: str) -> SmoothWidth:
    """Return the width under which a body was fitted, and what the fit says of it."""
    variance, mean, width, sigma = [], [], 1.0, 1.0
    for throw, own, spread in zip(joint.throws, joint.own, joint.own_variance, strict=True):
        if throw.body == body:
            here = _named(throw, effect)[own]
            value = throw.z[own[here]]
            variance += list(spread[here])
            mean += list(value**2)
            width = float(throw.width[own[here]][0])
            effects = throw.posterior.model.effects
            sigma = next(e.sigma for e in effects if isinstance(e, Smooth) and e.label == effect)
    ratio = float(np.sqrt(np.mean(mean))) / width
    factor = float(np.sqrt(np.mean(mean) + np.mean(variance))) / width
    return SmoothWidth(width * sigma, factor, ratio)


def noise_of(joint: Joint, body: str) -> Floats:
    """Return the noise of a body's samples relative to the quiet one, shape (6,) and one at least."""
    square, count = np.zeros(6), np.zeros(6)
    for throw, fitted in zip(joint.throws, joint.fitted, strict=True):
        if throw.body == body:
            square += (throw.residuals(throw.z) ** 2).sum(axis=0) * throw.noise**2
            count += throw.posterior.whitenings[0].outputs.sum(axis=0) - fitted
    return np.maximum(1.0, np.sqrt(square / count))


def fit_widths(throws: Sequence[Throw], free: Callable[[str], bool]) -> tuple[Throw, ...]:
    """Fit the throws of one body alone; return them at the mode, with the widths that they say."""
    joint = maximise_jointly(throws, free)
    for _ in range(ITERATIONS):
        factors = {effect: width_of(joint, throws[0].body, effect).factor for effect in SMOOTH}
        noise = noise_of(joint, throws[0].body)
        widened = [replace(_widened(throw, factors), noise=noise) for throw in joint.throws]
        joint = maximise_jointly(widened, free)
        if max(abs(factor - 1.0) for factor in factors.values()) < SETTLED:
            break
    return joint.throws


def _widened(throw: Throw, factors: dict[str, float]) -> Throw:
    width = throw.width.copy()
    for effect, factor in factors.items():
        width[_named(throw, effect)] *= factor
    return replace(throw, width=width)


def _named(throw: Throw, effect: str) -> NDArray[np.bool_]:
    return np.array([name.startswith(effect) for name in throw.posterior.unknowns.names])
