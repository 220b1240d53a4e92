"""The ten quantities of a body, in the order of `bayesid.inference.body_quantities.BODY_QUANTITIES`; their errors."""

from __future__ import annotations

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.report.numbers import format_unit
from bayesid.robot.inertial_parameters import InertialParameters

MASS, MOMENTS = 0, [4, 5, 6]  # indices of the mass and of the three moments of inertia
JUDGED = [MASS, *MOMENTS]  # indices of the quantities by which studies judge an identification; the others may be zero

# names in figures and tables, such as ``I xx``, and the same with units, such as ``I xx [kg m²]``
LABELS = [key.replace("inertia.", "I ").replace("com.", "c ") for key in BODY_QUANTITIES]
ROWS = [f"{label} [{format_unit(unit)}]" for label, unit in zip(LABELS, BODY_QUANTITIES.values(), strict=True)]

# names with units in the CSV files beside reports, by the keys of the package, such as ``inertia.xx [kg m²]``
HEADINGS = [f"{key} [{format_unit(unit)}]" for key, unit in BODY_QUANTITIES.items()]


def inertia_matrix(quantities: Floats) -> Floats:
    """Return the inertia matrix (3, 3) of ten quantities."""
    xx, yy, zz, xy, xz, yz = quantities[4:]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def body_of(quantities: Floats) -> InertialParameters:
    """Return the body with these ten quantities, whose inertia is about the centre of mass."""
    return InertialParameters(quantities[0], quantities[1:4], inertia_matrix(quantities))


def squared_distances(errors: Floats, covariance: Floats) -> Floats:
    """Return squared Mahalanobis distances, shape (...,), of errors, shape (..., n).

    Errors are divided by their standard deviations first, so that units of very different size cost no accuracy.
    """
    scale = np.sqrt(np.diag(covariance))
    scaled = errors / scale
    solved = np.linalg.solve(covariance / np.outer(scale, scale), scaled[..., None])[..., 0]
    return np.asarray((scaled * solved).sum(axis=-1))
