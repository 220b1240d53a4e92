"""Directions of the parameter space, from worst to best known relative to the prior.

In coordinates in which the prior is standard normal the posterior covariance of the bodies has orthogonal eigenvectors:
in one direction the data tell most, in another least or nothing. Carried over to physical quantities each is a
combination ``v`` of them, with standard deviation ``sqrt(v' C v)``, and a displacement: the change of all of them by
one standard deviation of that combination, all other combinations unchanged.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.identifiability.local_knowledge import Knowledge
from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.inference.contraction import ContractionVerdict

__all__ = ["Direction", "common_factor", "directions"]

UNTOLD = 0.01
"""Directions of less shrinkage are all the same to the data, and any basis of their space is as good."""

TURNS = 200
"""Iterations of the rotation of that basis, at most."""


@dataclass(frozen=True)
class Direction:
    """One combination of the bodies' quantities, and what is known of it.

    Attributes
    ----------
    names : tuple of str
        n quantities.
    weights : (n,) array
        The combination, scaled so that the largest weight times the prior sd of its quantity is one; so the
        combination itself is a pure number.
    displacement : (n,) array
        Change of every quantity, in its unit, by one posterior sd of the combination.
    prior_sd : float
        Of the combination.
    sd : float
        Of the combination.
    """

    names: tuple[str, ...]
    weights: Floats
    displacement: Floats
    prior_sd: float
    sd: float

    @property
    def shrinkage(self) -> float:
        """One minus the ratio of posterior to prior standard deviation."""
        return 1.0 - self.sd / self.prior_sd

    @property
    def verdict(self) -> ContractionVerdict:
        """Whether the data told of it."""
        return ContractionVerdict.of(self.shrinkage)

    def to_dict(self) -> dict[str, Any]:
        """Form in JSON."""
        return {
            "sd": self.sd,
            "prior_sd": self.prior_sd,
            "shrinkage": self.shrinkage,
            "verdict": self.verdict.value,
            "combination": dict(zip(self.names, self.weights.tolist(), strict=True)),
            "displacement": dict(zip(self.names, self.displacement.tolist(), strict=True)),
        }


def directions(knowledge: Knowledge) -> list[Direction]:
    """Return n directions, from the worst known to the best relative to the prior.

    Those of which the data tell less than 1 % have no order of their own. The common factor of all bodies comes first
    if it is among them; the others are turned so that each moves few quantities (varimax, Kaiser 1958).
    """
    # rows of D = L Q with orthonormal Q are the prior's own axes: z along them is standard normal
    lower = knowledge.prior_factor
    own = np.linalg.solve(lower, knowledge.factor)
    axes, ratios, _ = np.linalg.svd(own, full_matrices=False)
    axes = _readable(axes, ratios, knowledge)
    scale = knowledge.prior_sd
    found = []
    for axis in axes.T:
        weights, sd = np.linalg.solve(lower.T, axis), float(np.linalg.norm(axis @ own))
        displacement = lower @ (own @ (axis @ own)) / sd
        sign = np.sign(displacement[np.argmax(np.abs(displacement) / scale)])
        unit = float(np.abs(weights * scale).max())
        found.append(Direction(knowledge.names, sign * weights / unit, sign * displacement, 1.0 / unit, sd / unit))
    return found


def common_factor(names: tuple[str, ...], values: Floats) -> Floats:
    """Return the change of all quantities as masses and inertias grow in proportion, shape (n,)."""
    fixed = np.array([name.split(".")[-2] == "com" for name in names])
    return np.where(fixed, 0.0, values)


def _readable(axes: Floats, ratios: Floats, knowledge: Knowledge) -> Floats:
    """Turn the basis of what the data do not tell."""
    count = int((ratios > 1.0 - UNTOLD).sum())
    if count == 0:
        return axes
    space, rest = axes[:, :count], axes[:, count:]
    scale = np.linalg.solve(knowledge.prior_factor, common_factor(knowledge.names, knowledge.values))
    inside = space.T @ (scale / np.linalg.norm(scale))
    first = np.zeros((len(axes), 0))
    bodies = len(knowledge.names) // len(BODY_QUANTITIES)
    if bodies > 1 and np.linalg.norm(inside) > 1.0 - UNTOLD:
        basis = np.linalg.qr(np.column_stack([inside, np.eye(count)]))[0]
        first, space = space @ basis[:, :1], space @ basis[:, 1:count]
    moved = knowledge.prior_factor / knowledge.prior_sd[:, None]
    return np.concatenate([first, space @ _varimax(moved @ space), rest], axis=1)


def _varimax(loadings: Floats) -> Floats:
    """Return the rotation that makes the squares in each column of loadings (n, k) as unequal as possible, (k, k)."""
    turn = np.eye(loadings.shape[1])
    before = 0.0
    for _ in range(TURNS if loadings.shape[1] > 1 else 0):
        turned = loadings @ turn
        target = turned**3 - turned * (turned**2).mean(axis=0)
        left, size, right = np.linalg.svd(loadings.T @ target)
        turn = left @ right
        if size.sum() < before * (1.0 + 1e-10):
            break
        before = size.sum()
    return turn
