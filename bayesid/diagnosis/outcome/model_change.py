"""What the named causes change: inertial parameters, and the errors of the simulation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.outcome.gain import Gain
from bayesid.diagnosis.search.fitted_set import Hypothesis
from bayesid.inference.body_quantities import BODY_QUANTITIES, bodies_of, half_range
from bayesid.inference.posterior import Posterior
from bayesid.inference.residual_view import by_recording
from bayesid.robot.inertial_parameters import mass_com_inertia
from bayesid.simulation.sensors import SensorKind

__all__ = ["ParameterChange", "SimulationError", "parameter_changes", "simulation_errors", "strongest_recording"]

PRIOR_DRAWS = 2000  # from which the width of the prior follows


@dataclass(frozen=True)
class ParameterChange:
    """One inertial parameter.

    Attributes
    ----------
    name, unit : str
    given, prior_sd : float
        Value in the study's files, and half the central 68 % of its prior.
    without, without_sd : float
        Fitted with the present model.
    fitted, fitted_sd : float
        Fitted with the named causes.
    shift : float
        From the one fit to the other, in the standard deviations of the first.
    """

    name: str
    unit: str
    given: float
    prior_sd: float
    without: float
    without_sd: float
    fitted: float
    fitted_sd: float
    shift: float

    def to_dict(self) -> dict[str, Any]:
        """Return the parameter in the form that it has in JSON."""
        return {
            "unit": self.unit,
            "given": self.given,
            "prior_sd": self.prior_sd,
            "before": {"mean": self.without, "sd": self.without_sd},
            "after": {"mean": self.fitted, "sd": self.fitted_sd},
            "shift_in_sd": self.shift,
        }


def parameter_changes(before: Hypothesis, gain: Gain) -> tuple[ParameterChange, ...]:
    """Return all inertial parameters of the identified bodies.

    Parameters
    ----------
    before : Hypothesis
        The present model.
    gain : Gain
        Its figures and those of the extended model.
    """
    posterior, first, second = before.fit.posterior, gain.before.bodies, gain.after.bodies
    if not first.names:
        return ()
    z = np.random.default_rng(0).normal(size=(PRIOR_DRAWS, posterior.size))
    widths = np.concatenate([half_range(body.values) for body in bodies_of(posterior, z).values()])
    given = np.concatenate([mass_com_inertia(prior.centre.vector) for prior in posterior.model.bodies])
    units = list(BODY_QUANTITIES.values()) * len(posterior.model.bodies)
    columns = (given, widths, first.mean, first.sd, second.mean, second.sd, gain.shift)
    rows = zip(first.names, units, *(column.tolist() for column in columns), strict=True)
    return tuple(ParameterChange(*row) for row in rows)


@dataclass(frozen=True)
class SimulationError:
    """Root mean square, over time, of the length of measured minus simulated of one sensor, in its unit.

    The residuals are those that were freed of their correlation, times the noise per sample.

    Attributes
    ----------
    kind : SensorKind
    before, after : float
        After is that of before where no cause is named.
    noise : float
        What the declared noise alone makes of it.
    """

    kind: SensorKind
    before: float
    after: float
    noise: float

    def to_dict(self) -> dict[str, Any]:
        """Return the error in the form that it has in JSON."""
        return {"unit": self.kind.unit, "before": self.before, "after": self.after, "noise": self.noise}


def simulation_errors(before: Hypothesis, after: Hypothesis, gain: Gain) -> tuple[SimulationError, ...]:
    """Return the errors of every sensor over all recordings, of the present model and the extended one.

    Parameters
    ----------
    before, after : Hypothesis
    gain : Gain
        Root mean squares of their residuals.
    """
    channels = before.fit.posterior.model.channels
    errors = []
    for kind in channels.kinds:
        names = channels.names[channels.of(kind)]
        sigmas = [_sigma(hypothesis.fit.posterior, kind) for hypothesis in (before, after)]
        rms = [np.array([figures.rms.get(name, 0.0) for name in names]) for figures in (gain.before, gain.after)]
        first, second = (float(np.linalg.norm(values * sigma)) for values, sigma in zip(rms, sigmas, strict=True))
        errors.append(SimulationError(kind, first, second, float(np.linalg.norm(sigmas[0]))))
    return tuple(errors)


def _sigma(posterior: Posterior, kind: SensorKind) -> Floats:
    """Root mean square over the recordings of the noise per sample of each axis."""
    widths = [posterior.data.sigma(index, kind) for index in range(len(posterior.manoeuvres))]
    return np.sqrt(np.mean(np.square(widths), axis=0))


def strongest_recording(before: Hypothesis, after: Hypothesis | None) -> int:
    """Return the recording whose chi-square decreases most, or is largest where there is no extended model.

    Parameters
    ----------
    before : Hypothesis
        The present model.
    after : Hypothesis or None
        The extended model.
    """
    hypotheses = [before] if after is None else [before, after]
    chi2 = [np.sum(by_recording(before.fit.posterior, model.fit.residual) ** 2, axis=1) for model in hypotheses]
    return int(np.argmax(chi2[0] - sum(chi2[1:])))
