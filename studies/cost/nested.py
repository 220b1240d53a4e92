"""Nested sampling of the extended model of one candidate, beside a diagnosis that weighs all of them."""

from __future__ import annotations

from importlib.util import find_spec
from typing import NamedTuple

import numpy as np

from bayesid.diagnosis import Diagnosis
from bayesid.inference import choose_parameterisation, maximise
from studies.peers.density import Target
from studies.peers.samplers import Budget, dynesty

__all__ = ["Nested", "nested"]


class Nested(NamedTuple):
    """What one run of dynesty took.

    Attributes
    ----------
    seconds : float
        Processor time [s].
    unknowns : int
        Number of unknowns of the extended model.
    done : bool
        Whether it ended by itself, before its limit of time.
    """

    seconds: float
    unknowns: int
    done: bool


def nested(diagnosis: Diagnosis, limit: float, seed: int) -> Nested | None:
    """Run dynesty on the likelihood of a diagnosis' extended model; None where dynesty is not installed.

    It gets coordinates in which the Laplace approximation at the mode is a standard normal, its best case.

    Parameters
    ----------
    diagnosis : Diagnosis
        With a named cause.
    limit : float
        Time at which it is stopped [s].
    seed : int
    """
    if find_spec("dynesty") is None:
        return None
    rng = np.random.default_rng(seed)
    posterior, optimum = maximise(diagnosis.posterior, rng, start=diagnosis.start)
    target = Target(choose_parameterisation(posterior, optimum, rng), optimum)
    reached = dynesty(target, Budget(effective_samples=4000.0, seconds=limit), rng)
    return Nested(reached.seconds, target.size, reached.finished)
