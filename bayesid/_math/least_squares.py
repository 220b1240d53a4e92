"""Nonlinear least squares by Levenberg-Marquardt (MINPACK through SciPy), refusing steps to where nothing is finite."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from bayesid._math.arrays import Floats

__all__ = ["levenberg_marquardt"]

HUGE = 1e12
"""Value that stands for residuals that are not finite, so that the step to them is refused."""


def levenberg_marquardt(
    residual: Callable[[Floats], Floats],
    jacobian: Callable[[Floats], Floats],
    start: Floats,
    tolerance: float,
    at_most: int | None = None,
) -> OptimizeResult:
    """Minimise half the sum of squared residuals from one point.

    Parameters
    ----------
    residual, jacobian : callable
        Coordinates (n,) to residuals (m,) and to their derivative (m, n).
    start : (n,) array
        Coordinates to start from.
    tolerance : float
        Relative change of cost, of coordinates, and cosine of the gradient at which the search ends.
    at_most : int, optional
        Largest number of evaluations of the residuals; by default a hundred for each coordinate.

    Returns
    -------
    scipy.optimize.OptimizeResult
        Solution as `scipy.optimize.least_squares` describes it.
    """

    def finite(z: Floats) -> Floats:
        values = residual(z)
        return np.where(np.isfinite(values), values, HUGE)

    return least_squares(
        finite,
        start,
        jacobian,
        method="lm",
        x_scale="jac",
        ftol=tolerance,
        xtol=tolerance,
        gtol=tolerance,
        max_nfev=at_most,
    )
