"""Signatures of a base that was turning when a recording began although the study takes it to be at rest."""

from __future__ import annotations

from bayesid.diagnosis.candidates.signature_bank import SignatureBank, Signatures
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.inference.perturbed_posterior import jacobian_of

__all__ = ["INITIAL_RATE", "initial_rate_signatures"]

INITIAL_RATE = "initial-rate"
"""Name of the cause."""

LARGEST = 0.1
"""Largest rate that passes for rest [rad/s], six degrees per second; assumed, since anyone would see more."""


def initial_rate_signatures(perturbed: PerturbedModel, fit: Fit) -> SignatureBank:
    """Return the bank of the initial rates that the study takes to be zero; an empty one where they are unknown."""
    frozen = perturbed.frozen
    if not len(frozen):
        return SignatureBank()
    derivatives = jacobian_of(perturbed.posterior, fit.z, fit.data).reshape(-1, perturbed.posterior.size)
    columns = derivatives[:, frozen] / perturbed.posterior.unknowns.rate_sigma
    cause = CandidateCause(INITIAL_RATE, (AmplitudeGroup(INITIAL_RATE, LARGEST),))
    return SignatureBank((Signatures(INITIAL_RATE, columns),), (cause,))
