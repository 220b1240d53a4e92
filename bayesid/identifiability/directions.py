"""Directions of the parameter space, from worst to best known relative to the prior.

In coordinates in which the prior is standard normal, the posterior covariance of the bodies has orthogonal
eigenvectors: along one of them the data tell most, along another least or nothing. In physical quantities each
eigenvector is a combination ``v`` with standard deviation ``sqrt(v' C v)``, and a displacement: the change of all
quantities by one standard deviation of that combination, with all other combinations unchanged.
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

# shrinkage below which the data do not distinguish directions, so that any basis of their space is as good
UNTOLD = 0.01
TURNS = 200  # largest number of iterations in the rotation of that basis; it usually converges much earlier


@dataclass(frozen=True)
class Direction:
    """One combination of the bodies' quantities, and what is known of it.

    Attributes
    ----------
    names : tuple of str
        Names of the n quantities.
    weights : (n,) array
        Weights of the quantities in the combination, scaled so that the largest product of a weight and the prior
        standard deviation of its quantity is one; the combination is therefore a pure number.
    displacement : (n,) array
        Change of every quantity, in its unit, when the combination changes by one posterior standard deviation.
    prior_sd : float
        Prior standard deviation of the combination [1].
    sd : float
        Posterior standard deviation of the combination [1].
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
        """Verdict on how far the data contracted the prior of the combination."""
        return ContractionVerdict.of(self.shrinkage)

    def to_dict(self) -> dict[str, Any]:
        """Return the direction as it stands in identifiability.json."""
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

    Directions in which the data contract the prior by less than 1 % cannot be ordered by the data. If the common
    factor of all bodies lies among them, it comes first; the others are rotated so that each moves few quantities
    (varimax, Kaiser 1958).
    """
    # with the slope D = L Q and orthonormal rows of Q, z along these rows is standard normal under the prior
    lower = knowledge.prior_factor
    factor = np.linalg.solve(lower, knowledge.factor)
    axes, ratios, _ = np.linalg.svd(factor, full_matrices=False)
    axes = _readable(axes, ratios, knowledge)
    scale = knowledge.prior_sd
    result = []
    for axis in axes.T:
        weights, sd = np.linalg.solve(lower.T, axis), float(np.linalg.norm(axis @ factor))
        displacement = lower @ (factor @ (axis @ factor)) / sd
        sign = np.sign(displacement[np.argmax(np.abs(displacement) / scale)])
        unit = float(np.abs(weights * scale).max())
        result.append(Direction(knowledge.names, sign * weights / unit, sign * displacement, 1.0 / unit, sd / unit))
    return result


def common_factor(names: tuple[str, ...], values: Floats) -> Floats:
    """Return the change of all quantities when masses and inertias grow in proportion, shape (n,)."""
    fixed = np.array([name.split(".")[-2] == "com" for name in names])
    return np.where(fixed, 0.0, values)


def _readable(axes: Floats, ratios: Floats, knowledge: Knowledge) -> Floats:
    """Rotate the axes along which the data tell nothing, so that each of them moves few quantities."""
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
    """Return the rotation (k, k) that makes the squares in each column of the loadings (n, k) most unequal."""
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
