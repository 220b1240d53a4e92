"""A fault of the noise: one class says how it shows, how large it is, what it changes, and how a study states it.

A fault of one's own is a subclass of `SensorFault`, decorated with `register_fault`, in a plugin of the study.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, NamedTuple, TypeVar

import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.diagnosis.settings import DEFAULT_SETTINGS, DiagnosisSettings
from bayesid.inference.noise_changes import with_sensors
from bayesid.inference.posterior import Posterior
from bayesid.inference.residual_view import ResidualView
from bayesid.simulation.effects.effect_parameters import Quantity
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Sensor, SensorKind

__all__ = [
    "FitResidual",
    "FittedFault",
    "NoiseFault",
    "SensorFault",
    "SensorResidual",
    "noise_faults",
    "number_of",
    "register_fault",
]

DECADES = 3.0  # over which the size of a fault is log-uniform beforehand

Sizes = Sequence[float | Sequence[float] | Floats]
"""A value of each quantity of a fault, or one for each component of the sensor."""


class SensorResidual(NamedTuple):
    """Whitened residual of one sensor.

    Attributes
    ----------
    energy : float
        Sum of squares.
    degrees : float
        Number of samples less what the fit has taken.
    pieces : list of (n,) array
        Of each recording and axis, every sample over the standard deviation that the fit leaves it.
    """

    energy: float
    degrees: float
    pieces: list[Floats]

    @property
    def scale(self) -> float:
        """Standard deviation, at least that of the declared noise."""
        return float(np.sqrt(max(self.energy / self.degrees, 1.0)))


@dataclass(frozen=True)
class FitResidual:
    """Whitened residual of a fit, with the share of its variance that the fit has taken."""

    fit: Fit

    @cached_property
    def share(self) -> ResidualView:
        """Share of each sample's variance that the fit has taken: its leverage."""
        return ResidualView.of(self.fit.posterior, (self.fit.block.share(self.fit.known.T) ** 2).sum(axis=0))

    @cached_property
    def by_sensor(self) -> dict[SensorKind, SensorResidual]:
        """Residual of each sensor."""
        return {kind: self._of(kind) for kind in self.fit.view.kinds}

    def _of(self, kind: SensorKind) -> SensorResidual:
        pairs = list(zip(self.fit.view.each(kind), self.share.each(kind), strict=True))
        return SensorResidual(
            sum(float((residual**2).sum()) for residual, _ in pairs),
            sum(len(residual) - float(share.sum()) for residual, share in pairs),
            [residual / np.sqrt(np.maximum(1.0 - share, 0.05)) for residual, share in pairs],
        )


@dataclass(frozen=True)
class FittedFault:
    """A fault of the noise with its size, estimated from a residual.

    Attributes
    ----------
    fault : NoiseFault
    mean, sd : arrays
        Of the fault's quantities.
    posterior : Posterior
        With the fault in its noise.
    log_gain : float
        What the fault adds to the log likelihood of samples that the posterior does not hold: the joints'.
    """

    fault: NoiseFault
    mean: Floats
    sd: Floats
    posterior: Posterior
    log_gain: float = 0.0

    @property
    def label(self) -> str:
        """Name in the catalogue."""
        return self.fault.label

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Quantities that have a mean and a standard deviation."""
        return self.fault.quantities

    @property
    def statement(self) -> str:
        """Line of a study file's section ``[model.noise]`` that puts the fault into the model."""
        sizes = (f"{quantity.name} = {value:.4g}" for quantity, value in zip(self.quantities, self.mean, strict=True))
        return f'"{self.label}" = {{ {", ".join(sizes)} }}'

    @property
    def log_charge(self) -> float:
        """Logarithm of what the freedom of the fault costs, and of what its samples say by themselves."""
        return self.fault.log_charge(self)


class NoiseFault:
    """Fault of the noise.

    Attributes
    ----------
    name : str
        Name in the catalogue, without the sensor.
    summary : str
        What it is, in one sentence.
    parameters : str
        Its quantities with units, for the list of the catalogue.
    needs : str
        What a study must have for it to show.
    advice : str
        What to do to bring it out.
    in_residual : bool
        Whether it shows in the residual of a fit.
    slow : bool
        Whether causes that vary with time take part of it, so that its size is taken from the present model's residual
        as well as from that beside the most probable causes.
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    parameters: ClassVar[str]
    needs: ClassVar[str] = "the section of the sensor, such as [sensors.rate]"
    advice: ClassVar[str] = "It is present at rest: record the sensor with the arm at rest."
    in_residual: ClassVar[bool] = True
    slow: ClassVar[bool] = False

    @property
    def label(self) -> str:
        """Name in the catalogue."""
        return self.name

    @property
    def entry(self) -> str:
        """Name in the list of the catalogue, with SENSOR where it is of any."""
        return self.name

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """What is reported and stated of its size."""
        raise NotImplementedError

    def occurs(self, posterior: Posterior) -> bool:
        """Return whether the data of a posterior may have it."""
        return True

    def log_p(self, residual: FitResidual) -> float | None:
        """Return the logarithm of the p-value of the noise without this fault; None where it cannot be tested."""
        raise NotImplementedError

    def measured(
        self, fit: Fit, least: float = -np.inf, settings: DiagnosisSettings = DEFAULT_SETTINGS
    ) -> FittedFault | None:
        """Return the fault with its size from the residual of a fit; None if the residual shows no such fault.

        Parameters
        ----------
        fit : Fit
        least : float
            Log likelihood that it has to gain to be of interest.
        settings : DiagnosisSettings
            With the thresholds of outliers.
        """
        raise NotImplementedError

    def refined(self, fitted: FittedFault, perturbed: PerturbedModel, fit: Fit) -> FittedFault:
        """Return the fault with a better size, by fits like one that stands without it; by default as it is.

        Parameters
        ----------
        fitted : FittedFault
        perturbed : PerturbedModel
            Under the noise that has the fault.
        fit : Fit
            From whose residual the first estimate is.
        """
        return fitted

    def log_charge(self, fitted: FittedFault) -> float:
        """Return the logarithm of posterior over prior width of its size, and what its samples say by themselves."""
        relative = np.maximum(fitted.sd / np.maximum(fitted.mean, np.finfo(float).tiny), 1e-6)
        width = DECADES * np.log(10.0)
        return float(np.minimum(np.log(np.sqrt(2.0 * np.pi) * relative / width), 0.0).sum()) + fitted.log_gain

    def in_model(self, model: Model, sizes: Sizes) -> Model:
        """Return a model with the fault as a study states it; by default it is no matter of the model.

        Parameters
        ----------
        model : Model
        sizes : sequence
            Value of each quantity of the fault.
        """
        return model

    def in_data(self, model: Model, manoeuvres: Sequence[Manoeuvre], sizes: Sizes) -> list[Manoeuvre]:
        """Return recordings treated as the stated fault asks; by default as they are.

        Parameters
        ----------
        model : Model
        manoeuvres : sequence of Manoeuvre
        sizes : sequence
            Value of each quantity of the fault.
        """
        return list(manoeuvres)


class SensorFault(NoiseFault):
    """Fault of the noise of one sensor.

    Parameters
    ----------
    kind : SensorKind
    """

    def __init__(self, kind: SensorKind) -> None:
        self.kind = kind

    @property
    def label(self) -> str:
        """Name in the catalogue."""
        return f"{self.name}:{self.kind.value}"

    @property
    def entry(self) -> str:
        """Name in the list of the catalogue."""
        return f"{self.name}:SENSOR"

    def log_p(self, residual: FitResidual) -> float | None:
        """Return the logarithm of the p-value of the noise of the sensor without this fault."""
        of_sensor = residual.by_sensor[self.kind]
        return self.log_p_of(of_sensor, residual.fit.posterior) if of_sensor.degrees > 0.0 else None

    def log_p_of(self, residual: SensorResidual, posterior: Posterior) -> float | None:
        """Return the logarithm of the p-value, given the residual of the sensor; None where it cannot be tested.

        Parameters
        ----------
        residual : SensorResidual
        posterior : Posterior
        """
        raise NotImplementedError

    def changed(self, sensor: Sensor, sizes: Sizes) -> Sensor:
        """Return the sensor with the fault, given the value of each quantity.

        Parameters
        ----------
        sensor : Sensor
        sizes : sequence
            Value of each quantity of the fault.
        """
        raise NotImplementedError

    def in_model(self, model: Model, sizes: Sizes) -> Model:
        """Return a model with the fault in its sensor."""
        return replace(model, sensors=self._sensors(model, sizes))

    def in_noise(self, fit: Fit, sizes: Sizes, like: Posterior | None = None) -> Posterior:
        """Return the posterior of a fit with the fault in its sensor's noise.

        Parameters
        ----------
        fit : Fit
        sizes : sequence
            Value of each quantity.
        like : Posterior, optional
            As for `with_sensors`.
        """
        return with_sensors(fit.posterior, self._sensors(fit.posterior.model, sizes), fit.z, like)

    def _sensors(self, model: Model, sizes: Sizes) -> tuple[Sensor, ...]:
        return tuple(self.changed(one, sizes) if one.kind == self.kind else one for one in model.sensors)


_REGISTER: dict[str, type[NoiseFault]] = {}

F = TypeVar("F", bound=type[NoiseFault])


def register_fault(fault: F) -> F:
    """Make a fault of the noise known to diagnoses and study files; a class decorator."""
    known = _REGISTER.get(fault.name)
    if known is not None and known.__qualname__ != fault.__qualname__:
        raise InputError(f"two faults of the noise are named {fault.name!r}", remedy="Give each a different name")
    _REGISTER[fault.name] = fault
    return fault


def noise_faults(kinds: Iterable[SensorKind] | None = None) -> dict[str, NoiseFault]:
    """Return all faults by their labels: those of sensors, by default of all kinds, one by one, then those of none."""
    kinds = SensorKind.known() if kinds is None else kinds
    of_sensors = [kind for kind in _REGISTER.values() if issubclass(kind, SensorFault)]
    faults: list[NoiseFault] = [fault(kind) for kind in kinds for fault in of_sensors]
    faults += [fault() for fault in _REGISTER.values() if not issubclass(fault, SensorFault)]
    return {fault.label: fault for fault in faults}


def number_of(size: float | Sequence[float] | Floats) -> float:
    """Return the one number that a size is; raise a ValueError where it is several."""
    (number,) = np.atleast_1d(np.asarray(size, dtype=float)).tolist()
    return float(number)
