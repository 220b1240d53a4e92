"""A base that was turning when a recording began although the study takes it to be at rest."""

from __future__ import annotations

from collections.abc import Sequence

from bayesid._math.arrays import Floats
from bayesid.diagnosis.candidates.cause_kind import Bounds, CauseAmplitude, CauseKind
from bayesid.diagnosis.candidates.linear_model import SignatureBank, Signatures
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.inference.perturbed_posterior import jacobian_of
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import Quantity

__all__ = ["InitialRate"]

LARGEST = 0.1
"""Largest rate that passes for rest [rad/s], six degrees per second; assumed, since anyone would see more."""


class InitialRate(CauseKind):
    """Initial rates that the study takes to be zero: unknowns that are frozen unless this cause is named."""

    name = "initial-rate"
    one_form = True
    summary = "The base was already turning when the recordings began, although the study assumes that it is at rest."
    advice = "It is present before the arm moves: record a period of rest before the motion."
    statement = "treat the initial rates as unknown"

    def signatures(
        self, perturbed: PerturbedModel, fit: Fit, effects: Sequence[Effect], bounds: Bounds
    ) -> SignatureBank:
        """Return the bank of the initial rates; an empty one where they are unknown."""
        if not len(perturbed.frozen):
            return SignatureBank()
        derivatives = jacobian_of(perturbed.posterior, fit.z, fit.data).reshape(-1, perturbed.posterior.size)
        columns = derivatives[:, perturbed.frozen] / perturbed.posterior.unknowns.rate_sigma
        cause = CandidateCause(self.name, (AmplitudeGroup(self.name, LARGEST),))
        return SignatureBank((Signatures(self.name, columns),), (cause,))

    def present(self, fit: Fit) -> dict[str, Floats]:
        """Return the rates at a fit, which are zero unless it released them."""
        return {self.name: fit.posterior.unknowns.rate_sigma * fit.z[fit.frozen]} if len(fit.frozen) else {}

    def prepared(self, perturbed: PerturbedModel, z: Floats, names: Sequence[str]) -> tuple[PerturbedModel, Floats]:
        """Return the model with the rates released, from where the first readings have them."""
        if self.name not in names:
            return perturbed, z
        released, start = perturbed.released(), z.copy()
        start[perturbed.frozen] = released.posterior.starting_point()[perturbed.frozen]
        return released, start

    def labels(self, fit: Fit) -> tuple[str, ...]:
        """Return the name where a fit released the rates."""
        return (self.name,) if len(fit.released) else ()

    def quantities(self, effects: Sequence[Effect]) -> dict[str, tuple[Quantity, ...]]:
        """Return the three rates."""
        return {self.name: tuple(Quantity(axis, "rad/s") for axis in "xyz")}

    def amplitudes(self, perturbed: PerturbedModel, fit: Fit, label: str) -> list[CauseAmplitude]:
        """Return the rates of every recording, as ``RECORDING.axis``."""
        if label != self.name:
            return []
        posterior, sigma = fit.posterior, fit.posterior.unknowns.rate_sigma
        free, spread = perturbed.free.tolist(), fit.covariance.diagonal() ** 0.5
        rates = posterior.unknowns.layout.all_rates
        amplitudes = []
        for index, place in enumerate(range(rates.start, rates.stop)):
            if place in free:
                recording, axis = divmod(index, 3)
                key = f"{posterior.manoeuvres[recording].recording.name}.{'xyz'[axis]}"
                mean, sd = sigma * fit.z[place], sigma * spread[free.index(place)]
                amplitudes.append(CauseAmplitude(Quantity(key, "rad/s"), float(mean), float(sd)))
        return amplitudes
