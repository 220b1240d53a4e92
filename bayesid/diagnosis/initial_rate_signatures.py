"""Signatures of a base that was turning when a recording began although the study takes it to be at rest."""

from __future__ import annotations

import numpy as np

from bayesid.diagnosis.perturbed_fit import Engine, Fit
from bayesid.diagnosis.scale_prior import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.signature_bank import SignatureBank, Signatures

__all__ = ["INITIAL_RATE", "initial_rate_signatures"]

INITIAL_RATE = "initial-rate"
"""Name of the cause."""

LARGEST = 0.1
"""Largest rate that passes for rest [rad/s], six degrees per second; assumed, since anyone would see more."""


def initial_rate_signatures(engine: Engine, fit: Fit) -> SignatureBank:
    """Return the bank of the initial rates that the study takes to be zero; an empty one where they are unknown."""
    frozen = engine.frozen
    if not len(frozen):
        return SignatureBank()
    unit = np.zeros((len(frozen), engine.posterior.size))
    unit[np.arange(len(frozen)), frozen] = 1.0 / engine.posterior.unknowns.rate_sigma
    columns = engine.respond(engine.perturbation(len(frozen), z=unit), fit.z, engine.data_of(fit))
    cause = CandidateCause(INITIAL_RATE, (AmplitudeGroup(INITIAL_RATE, LARGEST),))
    return SignatureBank((Signatures(INITIAL_RATE, columns),), (cause,))
