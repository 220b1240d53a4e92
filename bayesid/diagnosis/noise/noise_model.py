"""The present model under some faults of its noise, fitted, with what the freedom of the faults costs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesid.diagnosis.noise.encoder_fault import ENCODER_NOISE
from bayesid.diagnosis.noise.noise_faults import FittedFault, noise_fault, refined
from bayesid.diagnosis.noise.noise_tests import ON_LATTICE
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.diagnosis.settings import DEFAULT_SETTINGS, DiagnosisSettings
from bayesid.inference.posterior import Posterior
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.simulation.sensors import SensorKind

__all__ = ["NoiseModel", "fault_names"]

DECADES = 3.0
"""Decades over which the size of a fault is log-uniform beforehand, and the correlation time of coloured noise."""

SAME = 0.2
"""Difference of the logarithms of two estimates of a fault's size, from different residuals, that leads to one end."""

REFITS = 3
"""Steps of the fit that tells what a fault is worth beside the causes that a residual's fit holds."""


def fault_names(posterior: Posterior) -> tuple[str, ...]:
    """Return the names of all faults of the noise of a model's sensors and encoders."""
    kinds = [sensor.kind.value for sensor in posterior.model.sensors]
    names = [
        name
        for kind in kinds
        for name in (f"{kind}-noise", f"coloured-noise:{kind}", f"outliers:{kind}", f"quantisation:{kind}")
    ]
    measured = any(isinstance(item.motion, MeasuredMotion) for item in posterior.manoeuvres)
    return (*names, ENCODER_NOISE) if measured else tuple(names)


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
        behind the best explanation, or if the fault is known with this size.

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
        fault = noise_fault(label, residual, least - residual.log_evidence, settings)
        if fault is None or (known is not None and _alike(fault, known)):
            return None
        perturbed = self.perturbed.with_posterior(fault.posterior)
        beside = perturbed.fit(residual.effects, residual.coordinates, z=residual.z, iterations=REFITS)
        if beside.log_evidence + _log_charge(fault) < least:
            return None
        if label.startswith("coloured-noise"):
            fault = refined(fault, perturbed, residual)
            perturbed = perturbed.with_posterior(fault.posterior)
        fit = perturbed.fit(z=self.fit.z)
        model = NoiseModel(
            (*self.faults, fault), perturbed, fit, self.log_charge + _log_charge(fault), self.bodies_fixed
        )
        far_behind = model.log_nothing < best - settings.fault_alone_far_behind
        return None if residual is self.fit and far_behind else model


def _alike(fault: FittedFault, known: NoiseModel) -> bool:
    """Return whether a known fit has a fault of about the same size."""
    other = next((own for own in known.faults if own.label == fault.label), None)
    return other is not None and bool((np.abs(np.log(fault.mean / other.mean)) < SAME).all())


def _log_charge(fault: FittedFault) -> float:
    """Return the logarithm of posterior over prior width of a fault's size, and what its samples say by themselves."""
    width = DECADES * np.log(10.0)
    name, _, place = fault.label.partition(":")
    if name == "quantisation":  # that values fall on a lattice by chance
        return -float(np.log(2.0 * ON_LATTICE)) * fault.posterior.samples / 3.0
    relative = np.maximum(fault.sd / np.maximum(fault.mean, np.finfo(float).tiny), 1e-6)
    charge = float(np.minimum(np.log(np.sqrt(2.0 * np.pi) * relative / width), 0.0).sum()) + fault.log_gain
    if name == "outliers":
        charge += _contamination(fault, SensorKind.of(place))
    return charge


def _contamination(fault: FittedFault, kind: SensorKind) -> float:
    """Return the logarithm of the probability density of the samples that count as outliers.

    A sample is contaminated with the probability that the fault states, and then uniform over the range of the readings
    of its channel; it does not count as certain.
    """
    posterior, fraction = fault.posterior, float(fault.mean[0])
    columns = posterior.model.channels.of(kind)
    total = 0.0
    for r, gone in enumerate(posterior.data.left_out):
        mask = gone[:, columns]
        span = np.ptp(posterior.data.measured(r, kind)[1], axis=0)[: mask.shape[1]]
        width = np.maximum(span, posterior.data.sigma(r, kind))
        total += float((mask.sum(axis=0) * (np.log(max(fraction, 1e-9)) - np.log(width))).sum())
        kept = int((~mask & posterior.whitenings[r].outputs[:, columns]).sum())
        total += kept * float(np.log1p(-min(fraction, 0.5)))
    return total
