"""Noise faults as extensions of a model: their size from the residual, and the posterior that has them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from bayesid._math.arrays import Floats
from bayesid.diagnosis.noise.encoder_fault import ENCODER_NOISE, encoder_noise, with_encoder_noise
from bayesid.diagnosis.noise.noise_tests import lattice, leverage
from bayesid.diagnosis.noise.outlier_pattern import is_event
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.diagnosis.settings import DEFAULT_SETTINGS, DiagnosisSettings
from bayesid.inference.noise_changes import leaving_out, with_sensors
from bayesid.inference.posterior import Posterior
from bayesid.inference.residual_view import ResidualView
from bayesid.simulation.effects.effect_parameters import Quantity
from bayesid.simulation.sensors import Coloured, Quantised, Scaled, Sensor, SensorKind

__all__ = ["SUMMARIES", "FittedFault", "noise_fault", "refined"]

LONGEST = 0.05
"""Longest correlation time of coloured noise, in lengths of a recording; beyond it is drift."""

TRIALS = 8
"""Evaluations of the evidence in the search for the size of coloured noise."""

REFITS = 1
"""Steps of the fit at each of them."""

SUMMARIES = {
    "noise": "The sensor is noisier than its data sheet: every sample's error is larger by one factor.",
    ENCODER_NOISE: "The encoders are noisier than their data sheet: every sample's error is larger by one factor.",
    "coloured-noise": "The sensor's error at one sample resembles that at the next: it wanders beside its white noise.",
    "initial-rate": "The base was already turning when the recording began; the model lets it start from rest.",
    "outliers": "Some samples are far off, more than noise allows: lost or garbled readings.",
    "quantisation": "The sensor reports multiples of a coarse step.",
}


@dataclass(frozen=True)
class FittedFault:
    """A fault of a sensor's noise, with its size estimated from a residual.

    Attributes
    ----------
    label : str
        Name of the catalogue: ``rate-noise``, ``outliers:accel``.
    quantities : tuple of Quantity
    mean, sd : arrays
        Of the quantities.
    posterior : Posterior
        With the fault in its noise.
    log_gain : float
        What the fault adds to the log likelihood of samples that the posterior does not hold: the joints'.
    """

    label: str
    quantities: tuple[Quantity, ...]
    mean: Floats
    sd: Floats
    posterior: Posterior
    log_gain: float = 0.0

    @property
    def summary(self) -> str:
        """What it is, for reports."""
        name = self.label.partition(":")[0]
        return SUMMARIES.get(name, SUMMARIES["noise"])


def noise_fault(
    label: str, fit: Fit, least: float = -np.inf, settings: DiagnosisSettings = DEFAULT_SETTINGS
) -> FittedFault | None:
    """Estimate a noise fault from the residual of a fit and put it into the fit's posterior; None if it is no such.

    Parameters
    ----------
    label : str
    fit : Fit
    least : float
        Log likelihood that coloured noise has to gain, by the spectrum of the residual, to be of interest.
    settings : DiagnosisSettings, optional
        With the thresholds of outliers.
    """
    name, _, place = label.partition(":")
    if name == "coloured-noise":
        return _coloured(label, SensorKind.of(place), fit, least)
    if name == "outliers":
        return _outliers(label, SensorKind.of(place), fit, settings)
    if name == "quantisation":
        return _quantisation(label, SensorKind.of(place), fit)
    if name == ENCODER_NOISE:
        return _encoders(fit)
    return _understated(label, SensorKind.of(name.removesuffix("-noise")), fit)


def _understated(label: str, kind: SensorKind, fit: Fit) -> FittedFault:
    residual, taken = fit.view.pooled(kind), ResidualView.of(fit.posterior, leverage(fit)).pooled(kind)
    energy, degrees = float((residual**2).sum()), float(len(residual) - taken.sum())
    factor = float(np.sqrt(energy / degrees))
    posterior = _with_sensor(fit, kind, lambda s: replace(s, noise=Scaled(s.noise, (factor,) * kind.size)))
    return FittedFault(
        label, (Quantity("factor", "1"),), np.array([factor]), np.array([factor / np.sqrt(2.0 * degrees)]), posterior
    )


def _encoders(fit: Fit) -> FittedFault | None:
    found = encoder_noise(fit.posterior)
    if found is None:
        return None
    factor, relative = float(np.sqrt(found.ratio)), float(np.sqrt(0.5 / found.degrees))
    posterior, size = with_encoder_noise(fit.posterior, factor, fit.z), np.array([factor])
    quantities = (Quantity("factor", "1"),)
    return FittedFault(ENCODER_NOISE, quantities, size, size * relative, posterior, found.log_gain(factor))


def _coloured(label: str, kind: SensorKind, fit: Fit, least: float) -> FittedFault | None:
    spectra = _Spectra.of(fit, kind)
    shortest, longest = 0.2 * float(spectra.interval.min()), _longest(fit, kind)

    def density(x: Floats, part: NDArray[np.bool_]) -> Floats:
        time = np.clip(np.exp(x[1]), shortest, longest)
        rho = np.exp(-spectra.interval[part] / time)
        level = np.exp(2.0 * x[0]) * spectra.relative[part]
        return 1.0 + level * (1.0 - rho**2) / (1.0 - 2.0 * rho * np.cos(spectra.angle[part]) + rho**2)

    fast, slow = ~spectra.slow, spectra.slow

    def whittle(x: Floats) -> float:
        expected = density(x, fast)
        return float((np.log(expected) + spectra.power[fast] / expected).sum())

    typical = float(np.median(spectra.interval))
    starts = [np.array([a, np.log(b * typical)]) for a in (-1.0, 0.5) for b in (3.0, 12.0)]
    best = min((minimize(whittle, start, method="Nelder-Mead") for start in starts), key=lambda found: float(found.fun))
    expected, power = density(best.x, slow), spectra.power[slow]
    slow_gain = float((power - power / expected - np.log(expected)).clip(min=0.0).sum())  # a fit may have taken some
    if float(spectra.power[fast].sum()) - best.fun + slow_gain < least:
        return None
    steps = 0.1 * np.eye(2)
    curvature = np.array([(whittle(best.x + h) - 2.0 * best.fun + whittle(best.x - h)) / 0.01 for h in steps])
    level, time = best.x[0], np.log(np.clip(np.exp(best.x[1]), shortest, longest))
    relative = 1.0 / np.sqrt(np.maximum(curvature, 1.0))
    return _coloured_at(label, kind, fit, np.array([level, time]), relative)


@dataclass(frozen=True)
class _Spectra:
    """Periodograms of the whitened residual of one sensor, all recordings and axes one after the other.

    Attributes
    ----------
    power : (n,) array
        One on average where the noise is as declared.
    angle : (n,) array
        Angular frequency times the interval of the samples [rad].
    interval : (n,) array
        Interval of the samples [s].
    relative : (n,) array
        Variance of the first recording's noise, in which levels are stated, over that of this one.
    slow : (n,) array of bool
        Whether it is among the three slowest waves, some of which may have gone into the fit.
    """

    power: Floats
    angle: Floats
    interval: Floats
    relative: Floats
    slow: NDArray[np.bool_]

    @staticmethod
    def of(fit: Fit, kind: SensorKind) -> _Spectra:
        view, data = fit.view, fit.posterior.data
        rows: list[tuple[NDArray[Any], ...]] = []
        for r in range(view.recordings):
            interval = float(np.median(np.diff(data.measured(r, kind)[0])))
            relative = (data.sigma(0, kind) / data.sigma(r, kind)) ** 2
            for axis, channel in enumerate(view.columns(kind)):
                own = view.samples(r, channel)
                power = np.abs(np.fft.rfft(own)[1:]) ** 2 / len(own)
                angle = 2.0 * np.pi * np.fft.rfftfreq(len(own))[1:]
                same = np.ones_like(power)
                rows.append((power, angle, interval * same, relative[axis] * same, np.arange(len(power)) < 3))
        return _Spectra(*(np.concatenate(column) for column in zip(*rows, strict=True)))


def _longest(fit: Fit, kind: SensorKind) -> float:
    """Longest correlation time looked for [s]."""
    return LONGEST * max(
        float(np.ptp(fit.posterior.data.measured(r, kind)[0])) for r in range(len(fit.posterior.manoeuvres))
    )


def _coloured_at(
    label: str, kind: SensorKind, fit: Fit, logs: Floats, relative: Floats, like: Posterior | None = None
) -> FittedFault:
    """Coloured noise with the logarithms of its level, in sigma, and of its correlation time."""
    level, time = np.exp(logs[0]) * fit.posterior.data.sigma(0, kind), float(np.exp(logs[1]))
    noise = Coloured(tuple(level.tolist()), time)
    posterior = _with_sensor(fit, kind, lambda s: replace(s, coloured=noise), like)
    mean = np.array([float(level.mean()), time])
    return FittedFault(label, (Quantity("sigma", kind.unit), Quantity("time", "s")), mean, mean * relative, posterior)


def refined(fault: FittedFault, perturbed: PerturbedModel, fit: Fit) -> FittedFault:
    """Maximise the evidence over the size of coloured noise; other faults are returned as they are.

    The first estimate comes from a residual out of which the fit has taken slow waves, and is too small.
    """
    name, _, place = fault.label.partition(":")
    if name != "coloured-noise":
        return fault
    kind = SensorKind.of(place)
    sigma = fit.posterior.data.sigma(0, kind)
    first = np.log([fault.mean[0] / sigma.mean(), fault.mean[1]])
    longest = np.log(_longest(fit, kind))
    points, values = [], []

    def loss(logs: Floats) -> float:
        logs = np.array([logs[0], min(logs[1], longest)])
        posterior = _coloured_at(fault.label, kind, fit, logs, np.zeros(2), fault.posterior).posterior
        again = perturbed.with_posterior(posterior).fit(fit.effects, fit.coordinates, z=fit.z, iterations=REFITS)
        points.append(logs)
        values.append(-again.log_evidence)
        return values[-1]

    simplex = first + np.array([[0.0, 0.0], [0.15, 0.0], [0.0, 0.3]])
    options = {"initial_simplex": simplex, "maxfev": TRIALS, "xatol": 0.02, "fatol": 0.05}
    minimize(loss, first, method="Nelder-Mead", options=options)  # type: ignore[call-overload]
    best = points[int(np.argmin(values))]
    spread = _spread(np.array(points), np.array(values), fault.sd / fault.mean)
    return _coloured_at(fault.label, kind, fit, best, spread, fault.posterior)


def _spread(points: Floats, values: Floats, otherwise: Floats) -> Floats:
    """Return standard deviations from a paraboloid through points (n, 2) of a loss, (n,), if it has a bowl."""
    x, y = (points - points[np.argmin(values)]).T
    terms = np.stack([np.ones_like(x), x, y, 0.5 * x**2, x * y, 0.5 * y**2], axis=1)
    _, _, _, xx, xy, yy = np.linalg.lstsq(terms, values, rcond=None)[0]
    hessian = np.array([[xx, xy], [xy, yy]])
    if np.linalg.eigvalsh(hessian).min() <= 0.0:
        return otherwise
    return np.sqrt(np.diag(np.linalg.inv(hessian)))


def _outliers(label: str, kind: SensorKind, fit: Fit, settings: DiagnosisSettings) -> FittedFault | None:
    slot, whole = fit.posterior.model.channels.of(kind), fit.view.values
    masks = []
    outlying: list[Floats] = []
    measured: list[Floats] = []
    for r, item in enumerate(fit.posterior.whitenings):
        mask = np.zeros_like(item.outputs)
        own = whole[r, : len(mask), slot]
        scale = max(1.0, float(np.median(np.abs(own[item.outputs[:, slot]])) / 0.6745))
        mask[:, slot] = item.outputs[:, slot] & (np.abs(own) > settings.outlying * scale)
        mask |= fit.posterior.data.left_out[r]
        masks.append(mask)
        times = fit.posterior.data.recorded[r].time[item.rows]
        outlying.append(times[mask[:, slot].any(axis=1)])
        measured.append(times[(item.outputs | mask)[:, slot].any(axis=1)])
    if is_event(outlying, measured, settings.event_level):
        return None
    count, total = sum(map(len, outlying)), sum(map(len, measured))
    fraction = count / max(total, 1)
    sd = np.sqrt(max(fraction * (1.0 - fraction), 1.0 / max(total, 1)) / max(total, 1))
    return FittedFault(
        label, (Quantity("fraction", "1"),), np.array([fraction]), np.array([sd]), leaving_out(fit.posterior, masks)
    )


def _quantisation(label: str, kind: SensorKind, fit: Fit) -> FittedFault:
    step = lattice(fit.posterior, kind)
    if step is None:
        raise ValueError(f"{label}: the values lie on no lattice")
    posterior = _with_sensor(fit, kind, lambda s: replace(s, noise=Quantised(s.noise, tuple(step.tolist()))))
    return FittedFault(label, (Quantity("step", kind.unit),), np.array([float(step.mean())]), np.zeros(1), posterior)


def _with_sensor(
    fit: Fit, kind: SensorKind, change: Callable[[Sensor], Sensor], like: Posterior | None = None
) -> Posterior:
    sensors = [change(sensor) if sensor.kind == kind else sensor for sensor in fit.posterior.model.sensors]
    return with_sensors(fit.posterior, sensors, fit.z, like)
