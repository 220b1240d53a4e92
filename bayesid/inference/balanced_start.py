"""Starting point of a fit whose bodies follow from the balance of momentum, where the motion is too long to follow.

A fit from the centre of a wide prior compares motions that part by radians within minutes, and ends in one of many
local optima. The balance of momentum compares rates and accelerations at every instant, each by itself: nothing is
integrated but the attitude, and its fit has no such optima.
"""

from __future__ import annotations

import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.inference.conventions.momentum_balance import NUISANCES, MomentumBalance
from bayesid.inference.conventions.readings_on_grid import ReadingsOnGrid
from bayesid.inference.posterior import Posterior

__all__ = ["balanced_start"]

RECORDINGS = 4  # number of recordings whose balance is fitted, the first ones
ITERATIONS = 10  # of each fit


def balanced_start(posterior: Posterior) -> Floats | None:
    """Return the starting point with the bodies of the recording whose balance of momentum fits all recordings best.

    Parameters
    ----------
    posterior : Posterior

    Returns
    -------
    (size,) array or None
        None where no balance can be fitted: without unknown bodies, with too few readings, or where nothing moves.
    """
    model, manoeuvres, unknowns = posterior.model, posterior.manoeuvres, posterior.unknowns
    if not unknowns.bodies:
        return None
    balance = MomentumBalance(model.robot, unknowns.bodies, model.rate_sigma)
    spread = np.repeat([body.spread for body in unknowns.bodies], 10)
    starts = []
    with np.errstate(all="ignore"):
        for manoeuvre in manoeuvres[:RECORDINGS]:
            try:
                fit = balance.problem(ReadingsOnGrid.of(model, manoeuvre)).fit(ITERATIONS)
            except (InputError, np.linalg.LinAlgError):
                continue
            start = posterior.starting_point()
            start[unknowns.layout.all_bodies] = unknowns.numbers.inverse_mixing @ (spread * fit.z[:-NUISANCES])
            starts.append(start)
        costs = [float(np.square(posterior.least_squares(start)).sum()) for start in starts]
    return starts[int(np.nanargmin(costs))] if np.isfinite(costs).any() else None
