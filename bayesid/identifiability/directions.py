"""Directions of the parameter space, from worst to best known relative to the prior, and their description in words.

In coordinates in which the prior is standard normal, the posterior covariance of the bodies has orthogonal
eigenvectors: along one of them the data tell most, along another least or nothing. In physical quantities each
eigenvector is a combination ``v`` with standard deviation ``sqrt(v' C v)``, and a displacement: the change of all
quantities by one standard deviation of that combination, with all other combinations unchanged. The words say the
pattern that the numbers of a direction show, and no more.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from bayesid._io.words import abridged, joined
from bayesid._math.arrays import Floats
from bayesid.identifiability.local_knowledge import Knowledge
from bayesid.inference.body_quantities import BODY_QUANTITIES, ContractionVerdict
from bayesid.inference.identification import Identification
from bayesid.inference.posterior import Posterior

__all__ = ["Direction", "Part", "covers_all", "describe", "directions", "subject", "unidentifiable_sentences"]

# shrinkage below which the data do not distinguish directions, so that any basis of their space is as good
UNTOLD = 0.01
TURNS = 200  # largest number of iterations in the rotation of that basis; it usually converges much earlier
ALIKE = 0.95  # cosine between displacement and pattern, in prior standard deviations, above which the pattern is named
NEGLIGIBLE = 0.25  # size relative to the largest part below which a part is left out of the words
NAMED = 3  # largest number of parts named, so that the words remain readable
# nouns in sentences by the first part of a quantity's name
NOUNS = {"mass": "mass", "com": "centre of mass", "inertia": "inertia"}


@dataclass(frozen=True)
class Direction:
    """One combination of the bodies' quantities, and what is known of it."""

    names: tuple[str, ...]  #: names of the n quantities
    #: (n,) weights of the quantities in the combination, scaled so that the largest product of a weight and the prior
    #: standard deviation of its quantity is one; the combination is therefore a pure number
    weights: Floats
    #: (n,) change of every quantity, in its unit, when the combination changes by one posterior standard deviation
    displacement: Floats
    prior_sd: float  #: prior standard deviation of the combination [1]
    sd: float  #: posterior standard deviation of the combination [1]

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


def _common_factor(names: tuple[str, ...], values: Floats) -> Floats:
    """Return the change of all quantities when masses and inertias grow in proportion, shape (n,)."""
    fixed = np.array([name.split(".")[-2] == "com" for name in names])
    return np.where(fixed, 0.0, values)


def _readable(axes: Floats, ratios: Floats, knowledge: Knowledge) -> Floats:
    """Rotate the axes along which the data tell nothing, so that each of them moves few quantities."""
    count = int((ratios > 1.0 - UNTOLD).sum())
    if count == 0:
        return axes
    space, rest = axes[:, :count], axes[:, count:]
    scale = np.linalg.solve(knowledge.prior_factor, _common_factor(knowledge.names, knowledge.values))
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


class Part(Enum):
    """Sign of a part's change relative to the largest part."""

    WITH = "with"
    AGAINST = "against"


def describe(direction: Direction, values: Floats, prior_sd: Floats, whole: bool = True) -> str:
    """Describe a direction, and how much of the prior's width the data left in it.

    Parameters
    ----------
    direction : Direction
        Direction over n quantities.
    values, prior_sd : (n,) array
        Values and prior standard deviations of these quantities, each in its unit.
    whole : bool
        True if the quantities are those of all bodies that are not known exactly.
    """
    what, ratio = subject(direction, values, prior_sd, whole), direction.sd / direction.prior_sd
    verdict = direction.verdict
    if verdict is ContractionVerdict.NOT:
        shared = "cannot be distinguished" if " against " in what else "not learnt"
        return f"{what}: {shared}, {_percent(ratio)} of the prior's width remains"
    if verdict is ContractionVerdict.WEAKLY:
        return f"{what}: weakly learnt, {_percent(ratio)} of the prior's width remains"
    return f"{what}: learnt, {_percent(ratio)} of the prior's width remains"


def subject(direction: Direction, values: Floats, prior_sd: Floats, whole: bool = True) -> str:
    """Name the quantities that a direction moves.

    Parameters
    ----------
    direction : Direction
    values, prior_sd : (n,) array
        Values and prior standard deviations of its quantities, each in its unit.
    whole : bool
        True if the quantities are those of all bodies that are not known exactly.
    """
    moved = direction.displacement / prior_sd
    bodies = list(dict.fromkeys(name.split(".")[0] for name in direction.names))
    owner = np.array([bodies.index(name.split(".")[0]) for name in direction.names])
    factor = _common_factor(direction.names, values)
    if len(bodies) > 1 and _cosine(moved, factor / prior_sd) > ALIKE:
        return "all masses and inertias in proportion (the scale)" if whole else f"{joined(bodies)} in proportion"
    for index, body in enumerate(bodies):
        if _cosine(moved, np.where(owner == index, factor, 0.0) / prior_sd) > ALIKE:
            return f"mass and inertia of {body} in proportion"
    phrases: list[str] = []
    for sign, name in _parts_of(direction, prior_sd):
        text = _noun(name, len(bodies) > 1)
        phrases.append(text if not phrases else f"{sign.value} {text}")
    return " ".join(phrases)


def _parts_of(direction: Direction, prior_sd: Floats) -> list[tuple[Part, str]]:
    """Return the largest parts of a displacement in units of the prior's widths, with signs relative to the first."""
    moved = direction.displacement / prior_sd
    order = np.argsort(-np.abs(moved))[:NAMED]
    kept = [k for k in order if abs(moved[k]) >= NEGLIGIBLE * abs(moved[order[0]])]
    return [(Part.WITH if moved[k] * moved[order[0]] > 0.0 else Part.AGAINST, direction.names[k]) for k in kept]


def _noun(name: str, several: bool) -> str:
    body, _, key = name.partition(".")
    family, _, axis = key.partition(".")
    text = f"{NOUNS[family]} {axis}".strip()
    return f"{text} of {body}" if several else text


def _cosine(first: Floats, second: Floats) -> float:
    size = float(np.linalg.norm(first) * np.linalg.norm(second))
    return float(abs(first @ second)) / size if size > 0.0 else 0.0


def _percent(ratio: float) -> str:
    value = 100.0 * ratio
    return f"{value:.0f} %" if value >= 1.0 else f"{value:.1g} %"


def covers_all(posterior: Posterior) -> bool:
    """Return whether every body of the robot that has mass is to be identified."""
    named = {body.name for body in posterior.model.bodies}
    return {name for name, link in posterior.model.robot.links.items() if link.inertial.mass > 0.0} <= named


def unidentifiable_sentences(result: Identification) -> list[str]:
    """Return sentences that name the quantities and directions in which the posterior is nearly the prior.

    The list is empty where there are none.
    """
    if not result.bodies:
        return []
    sentences = []
    if all(contraction.verdict is not ContractionVerdict.CONTRACTED for contraction in result.contraction.values()):
        sentences.append(f"These recordings do not determine {abridged(list(result.bodies))}.")
    for verdict, text in (
        (ContractionVerdict.NOT, "equals the prior"),
        (ContractionVerdict.WEAKLY, "depends more on the prior than on the data"),
    ):
        names = [name for name, contraction in result.contraction.items() if contraction.verdict is verdict]
        if names:
            sentences.append(f"The posterior of {abridged(names)} {text}.")
    knowledge = Knowledge.at(result.posterior, result.optimum.z)
    subjects = [
        subject(direction, knowledge.values, knowledge.prior_sd, covers_all(result.posterior))
        for direction in directions(knowledge)
        if direction.verdict is ContractionVerdict.NOT
    ]
    if subjects:
        sentences.append(f"The data do not determine these directions: {abridged(subjects, separator='; ')}.")
    return sentences
