"""The present model under some faults of its noise, fitted, with what the freedom of the faults costs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesid.diagnosis.noise import noise_faults
from bayesid.diagnosis.noise.noise_fault import FittedFault
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.diagnosis.settings import DEFAULT_SETTINGS, DiagnosisSettings

__all__ = ["NoiseModel"]

SAME = 0.2
"""Difference of the logarithms of two estimates of a fault's size, from different residuals, that leads to one end."""

REFITS = 3
"""Steps of the fit that tells what a fault is worth beside the causes that a residual's fit holds."""


@dataclass(frozen=True)
class NoiseModel:
    """The present model, fitted without causes under some faults of its noise, or under none.

    Attributes
    ----------
    faults : tuple of FittedFault
    perturbed : PerturbedModel
    fit : Fit
    log_charge : float
        Logarithm of what the freedom of the faults costs.
    bodies_fixed : bool
        Whether the bodies are fixed, since the present model's fit diverged.
    """

    faults: tuple[FittedFault, ...]
    perturbed: PerturbedModel
    fit: Fit
    log_charge: float = 0.0
    bodies_fixed: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the faults, in order."""
        return tuple(sorted(fault.label for fault in self.faults))

    @property
    def log_nothing(self) -> float:
        """Logarithm of the evidence of the present model with these faults and no other cause."""
        return self.fit.log_evidence + self.log_charge

    def with_fault(
        self,
        label: str,
        residual: Fit,
        best: float,
        known: NoiseModel | None = None,
        settings: DiagnosisSettings = DEFAULT_SETTINGS,
    ) -> NoiseModel | None:
        """Return the model with one fault more, whose size is estimated from a residual.

        It is None if the residual shows no such fault, if the fault beside what the residual's fit holds would be far
        behind the best explanation, if the fault is known with this size, or if no fit has finite derivatives under it.

        Parameters
        ----------
        label : str
            Name of the fault.
        residual : Fit
            From whose residual the fault is estimated.
        best : float
            Log evidence of the best explanation so far.
        known : NoiseModel, optional
            With a fault of this name, estimated from another residual.
        settings : DiagnosisSettings, optional
        """
        least = best - self.log_charge - settings.fault_estimate_far_behind
        fault = noise_faults(self.fit.view.kinds)[label].measured(residual, least - residual.log_evidence, settings)
        if fault is None or (known is not None and known.has(fault)):
            return None
        perturbed = self.perturbed.with_posterior(fault.posterior)
        beside = perturbed.fit(residual.effects, residual.coordinates, z=residual.z, iterations=REFITS)
        if beside.log_evidence + fault.log_charge < least:
            return None
        fault = fault.fault.refined(fault, perturbed, residual)
        perturbed = perturbed.with_posterior(fault.posterior)
        charge = self.log_charge + fault.log_charge
        model = NoiseModel((*self.faults, fault), perturbed, perturbed.fit(z=self.fit.z), charge, self.bodies_fixed)
        far_behind = residual is self.fit and model.log_nothing < best - settings.fault_alone_far_behind
        return None if far_behind or not np.isfinite(model.fit.cost) else model

    def has(self, fault: FittedFault) -> bool:
        """Return whether there is a fault of this name and about this size."""
        same = next((other for other in self.faults if other.label == fault.label), None)
        return same is not None and bool((np.abs(np.log(fault.mean / same.mean)) < SAME).all())
