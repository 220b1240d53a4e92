"""What the paper prints on problem 2 (section 4.2), and whether a rigid body can have these values."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesid._math.arrays import Floats
from studies.common.quantities import inertia_matrix

# true load: mass, centre of mass, inertia xx yy zz xy xz yz, in the order and units of
# `bayesid.inference.body_quantities.BODY_QUANTITIES`
TRUTH = np.array([370.0, 0.33, 0.50, 1.04, 700.0, 700.0, 700.0, 0.0, 0.0, 0.0])

# initial guess of the load, in the same order
GUESS = np.array([10.0, 0.1, 0.1, 0.1, 10.0, 10.0, 10.0, 1e-4, 1e-4, 1e-4])

# results after the first and the second iteration, in the same order
RESULTS = (
    np.array([377.90, 0.30, 0.51, 1.00, 721.6, 743.2, 710.9, 0.0, 0.0, 0.0]),
    np.array([370.12, 0.33, 0.50, 1.04, 700.3, 700.7, 700.2, 0.0, 0.0, 0.0]),
)

# scale of relative errors: the true values, and the true moments for the products of inertia, which are zero
SCALE = np.where(TRUTH == 0.0, TRUTH[4], TRUTH)


def errors(quantities: Floats) -> Floats:
    """Return the errors of ten quantities over `SCALE`, shape (10,)."""
    return (quantities - TRUTH) / SCALE


@dataclass(frozen=True)
class Reading:
    """The printed inertia taken about one point."""

    about: str  # point that the inertia is taken about, in words
    moments: Floats  # (3,): principal moments about the centre of mass, ascending [kg m2]

    @property
    def physical(self) -> bool:
        """True if a rigid body can have these moments: none negative, and none above the sum of the others."""
        return bool(self.moments[0] >= 0.0 and self.moments[0] + self.moments[1] >= self.moments[2] * (1.0 - 1e-12))


def readings(quantities: Floats) -> tuple[Reading, Reading]:
    """Return both readings of ten printed quantities: about the centre of mass, and about the link's origin."""
    mass, com = quantities[0], quantities[1:4]
    steiner = mass * (com @ com * np.eye(3) - np.outer(com, com))
    printed = inertia_matrix(quantities)
    return (
        Reading("the load's centre of mass", np.linalg.eigvalsh(printed)),
        Reading("the link's origin", np.linalg.eigvalsh(printed - steiner)),
    )
