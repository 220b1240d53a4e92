"""Faults of a sensor's noise: understated, coloured, with outliers, quantised.

Coloured noise is estimated by Whittle's likelihood (Whittle 1953, Estimation and information in stationary time
series, Arkiv för Matematik 2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.optimize import minimize

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid._math.chi_square import log_tail
from bayesid.diagnosis.noise.noise_fault import (
    FitResidual,
    FittedFault,
    SensorFault,
    SensorResidual,
    Sizes,
    number_of,
    register_fault,
)
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.diagnosis.settings import DEFAULT_SETTINGS, DiagnosisSettings
from bayesid.inference.noise_changes import leaving_out, without_left_out
from bayesid.inference.posterior import Posterior
from bayesid.recording.lattice import ON_LATTICE, lattice_step
from bayesid.simulation.effects.effect_parameters import Quantity
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Coloured, Quantised, Scaled, Sensor, SensorKind

__all__ = ["ColouredNoise", "Outliers", "Quantisation", "UnderstatedNoise", "is_event"]


@register_fault
class UnderstatedNoise(SensorFault):
    """Noise of a sensor that is larger than declared by one factor."""

    name = "noise"
    summary = "The sensor is noisier than its data sheet: every sample's error is larger by one factor."
    parameters = "factor [1]: ratio of the noise to the declared noise"

    @property
    def entry(self) -> str:
        """Name in the list of the catalogue."""
        return self.label

    @property
    def label(self) -> str:
        """Name in the catalogue, such as ``rate-noise``."""
        return f"{self.kind.value}-noise"

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Factor on sigma."""
        return (Quantity("factor", "1"),)

    def log_p_of(self, residual: SensorResidual, posterior: Posterior) -> float:
        """Return the logarithm of the p-value of the declared variance against more."""
        return float(log_tail(residual.energy, residual.degrees))

    def measured(self, fit: Fit, least: float = -np.inf, settings: DiagnosisSettings = DEFAULT_SETTINGS) -> FittedFault:
        """Return the factor that the sum of squares gives, with its standard deviation."""
        residual = FitResidual(fit).by_sensor[self.kind]
        factor = float(np.sqrt(residual.energy / residual.degrees))
        sd = factor / np.sqrt(2.0 * residual.degrees)
        return FittedFault(self, np.array([factor]), np.array([sd]), self.in_noise(fit, [factor]))

    def changed(self, sensor: Sensor, sizes: Sizes) -> Sensor:
        """Return the sensor with its white noise times the factor."""
        return replace(sensor, noise=Scaled(sensor.noise, _per_axis(sizes[0], self.kind)))


@register_fault
class ColouredNoise(SensorFault):
    """Exponentially correlated noise beside the white noise of a sensor."""

    name = "coloured-noise"
    summary = "The sensor's error at one sample resembles that at the next: it wanders in addition to its white noise."
    parameters = "sigma [unit of the sensor], time [s]: standard deviation and correlation time of the added noise"
    slow = True

    TIMES: ClassVar[tuple[float, ...]] = (2.0, 6.0, 20.0)  #: correlation times that it is looked for at, in samples
    LONGEST: ClassVar[float] = 0.05  #: longest correlation time, in lengths of a recording; beyond it is drift
    TRIALS: ClassVar[int] = 8  #: evaluations of the evidence in the search for its size
    REFITS: ClassVar[int] = 1  #: steps of the fit at each of them

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Standard deviation and correlation time."""
        return Quantity("sigma", self.kind.unit), Quantity("time", "s")

    def log_p_of(self, residual: SensorResidual, posterior: Posterior) -> float:
        """Return the logarithm of the p-value of more slow noise than declared, for the best of some correlation times.

        The score of coloured noise beside the declared one is the autocorrelation with its lag of zero: fast noise that
        is overstated, as that of a smoothed motion may be, makes neighbours alike without any noise that is not known.
        """
        pieces = [piece / residual.scale for piece in residual.pieces]
        lacking = 0.5 * sum(float(piece @ piece) - len(piece) for piece in pieces)
        best = 0.0
        for time in self.TIMES:
            rho = np.exp(-1.0 / time)
            lags = np.arange(1, int(3.0 * time) + 1)
            total, variance = min(lacking, 0.0), 0.0
            for piece in pieces:
                for lag in lags[lags < len(piece)]:
                    total += rho**lag * float(piece[lag:] @ piece[:-lag])
                    variance += rho ** (2 * lag) * (len(piece) - lag)
            best = min(best, float(stats.norm.logsf(total / np.sqrt(max(variance, 1e-300)))))
        return float(min(0.0, best + np.log(len(self.TIMES))))

    def measured(
        self, fit: Fit, least: float = -np.inf, settings: DiagnosisSettings = DEFAULT_SETTINGS
    ) -> FittedFault | None:
        """Return level and correlation time by Whittle's likelihood of the periodograms.

        The slowest waves have no part in it, since the fit may have taken some of them; they count for what the noise
        may gain at most.

        Parameters
        ----------
        fit : Fit
        least : float
            Log likelihood that it has to gain.
        settings : DiagnosisSettings
        """
        spectra = _Spectra.of(fit, self.kind)
        fast, slow = ~spectra.slow, spectra.slow
        shortest, longest = 0.2 * float(spectra.interval.min()), self._longest(fit)

        def density(x: Floats, part: NDArray[np.bool_]) -> Floats:
            time = np.clip(np.exp(x[1]), shortest, longest)
            rho = np.exp(-spectra.interval[part] / time)
            level = np.exp(2.0 * x[0]) * spectra.relative[part]
            return 1.0 + level * (1.0 - rho**2) / (1.0 - 2.0 * rho * np.cos(spectra.angle[part]) + rho**2)

        def whittle(x: Floats) -> float:
            expected = density(x, fast)
            return float((np.log(expected) + spectra.power[fast] / expected).sum())

        typical = float(np.median(spectra.interval))
        starts = [np.array([a, np.log(b * typical)]) for a in (-1.0, 0.5) for b in (3.0, 12.0)]
        best = min(
            (minimize(whittle, start, method="Nelder-Mead") for start in starts), key=lambda optimum: float(optimum.fun)
        )
        expected, power = density(best.x, slow), spectra.power[slow]
        slow_gain = float((power - power / expected - np.log(expected)).clip(min=0.0).sum())
        if float(spectra.power[fast].sum()) - best.fun + slow_gain < least:
            return None
        steps = 0.1 * np.eye(2)
        curvature = np.array([(whittle(best.x + h) - 2.0 * best.fun + whittle(best.x - h)) / 0.01 for h in steps])
        logs = np.array([best.x[0], np.log(np.clip(np.exp(best.x[1]), shortest, longest))])
        return self._at(fit, logs, 1.0 / np.sqrt(np.maximum(curvature, 1.0)))

    def refined(self, fitted: FittedFault, perturbed: PerturbedModel, fit: Fit) -> FittedFault:
        """Return the size at which the evidence of fits is largest.

        The first estimate comes from a residual out of which the fit has taken slow waves, and is too small.

        Parameters
        ----------
        fitted : FittedFault
        perturbed : PerturbedModel
        fit : Fit
            From whose residual the first estimate is.
        """
        first = np.log([fitted.mean[0] / fit.posterior.data.sigma(0, self.kind).mean(), fitted.mean[1]])
        longest = np.log(self._longest(fit))
        points, values = [], []

        def loss(logs: Floats) -> float:
            logs = np.array([logs[0], min(logs[1], longest)])
            posterior = self._at(fit, logs, np.zeros(2), fitted.posterior).posterior
            again = perturbed.with_posterior(posterior)
            refit = again.fit(fit.effects, fit.coordinates, z=fit.z, iterations=self.REFITS)
            points.append(logs)
            values.append(-refit.log_evidence)
            return values[-1]

        simplex = first + np.array([[0.0, 0.0], [0.15, 0.0], [0.0, 0.3]])
        options = {"initial_simplex": simplex, "maxfev": self.TRIALS, "xatol": 0.02, "fatol": 0.05}
        minimize(loss, first, method="Nelder-Mead", options=options)  # type: ignore[call-overload]
        spread = _spread(np.array(points), np.array(values), fitted.sd / fitted.mean)
        return self._at(fit, points[int(np.argmin(values))], spread, fitted.posterior)

    def changed(self, sensor: Sensor, sizes: Sizes) -> Sensor:
        """Return the sensor with coloured noise of a level per axis and one correlation time."""
        return replace(sensor, coloured=Coloured(_per_axis(sizes[0], self.kind), number_of(sizes[1])))

    def _at(self, fit: Fit, logs: Floats, relative: Floats, like: Posterior | None = None) -> FittedFault:
        """Return the fault with the logarithms of its level, in sigma, and of its correlation time."""
        level, time = np.exp(logs[0]) * fit.posterior.data.sigma(0, self.kind), float(np.exp(logs[1]))
        mean = np.array([float(level.mean()), time])
        return FittedFault(self, mean, mean * relative, self.in_noise(fit, [level, time], like))

    def _longest(self, fit: Fit) -> float:
        """Return the longest correlation time looked for [s]."""
        data, count = fit.posterior.data, len(fit.posterior.manoeuvres)
        return self.LONGEST * max(float(np.ptp(data.measured(r, self.kind)[0])) for r in range(count))


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
                samples = view.samples(r, channel)
                power = np.abs(np.fft.rfft(samples)[1:]) ** 2 / len(samples)
                angle = 2.0 * np.pi * np.fft.rfftfreq(len(samples))[1:]
                same = np.ones_like(power)
                rows.append((power, angle, interval * same, relative[axis] * same, np.arange(len(power)) < 3))
        return _Spectra(*(np.concatenate(column) for column in zip(*rows, strict=True)))


def _spread(points: Floats, values: Floats, otherwise: Floats) -> Floats:
    """Return standard deviations from a paraboloid through points (n, 2) of a loss, (n,), if it has a bowl."""
    if not np.isfinite(values).all():  # a fit failed
        return otherwise
    x, y = (points - points[np.argmin(values)]).T
    terms = np.stack([np.ones_like(x), x, y, 0.5 * x**2, x * y, 0.5 * y**2], axis=1)
    _, _, _, xx, xy, yy = np.linalg.lstsq(terms, values, rcond=None)[0]
    hessian = np.array([[xx, xy], [xy, yy]])
    if np.linalg.eigvalsh(hessian).min() <= 0.0:
        return otherwise
    return np.sqrt(np.diag(np.linalg.inv(hessian)))


@register_fault
class Outliers(SensorFault):
    """Readings that are lost or garbled, which the likelihood leaves out."""

    name = "outliers"
    summary = "Some samples deviate by far more than noise allows: lost or corrupted readings."
    advice = "They are single samples: inspect the readings themselves, and record at rest."
    parameters = "fraction [1]: fraction of the samples that are outliers"

    LEVEL: ClassVar[float] = 1e-3  #: probability of more outliers by chance than a study with a fraction allows
    ROUNDS: ClassVar[int] = 3  #: fits after which what is left out stands, where a study states a fraction

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Fraction of the samples."""
        return (Quantity("fraction", "1"),)

    def log_p_of(self, residual: SensorResidual, posterior: Posterior) -> float:
        """Return the logarithm of the p-value of the largest sample among all."""
        largest = max(float(np.abs(piece).max()) for piece in residual.pieces) / residual.scale
        count = sum(len(piece) for piece in residual.pieces)
        spikes = posterior.data.spikes(self.kind)
        if len(spikes):
            largest, count = max(largest, float(spikes.max())), self._every_sample(posterior)
        return float(min(0.0, np.log(count) + np.log(2.0) + stats.norm.logsf(largest)))

    def measured(
        self, fit: Fit, least: float = -np.inf, settings: DiagnosisSettings = DEFAULT_SETTINGS
    ) -> FittedFault | None:
        """Return the fraction of outliers, none of which is in the posterior; None where they are an event."""
        columns, values = fit.posterior.model.channels.of(self.kind), fit.view.values
        masks, outlying, measured = [], [], []
        for r, whitening in enumerate(fit.posterior.whitenings):
            mask = np.zeros_like(whitening.outputs)
            residual = values[r, : len(mask), columns]
            scale = max(1.0, float(np.median(np.abs(residual[whitening.outputs[:, columns]])) / 0.6745))
            mask[:, columns] = whitening.outputs[:, columns] & (np.abs(residual) > settings.outlying * scale)
            mask |= fit.posterior.data.left_out[r]
            masks.append(mask)
            times = fit.posterior.data.recorded[r].time[whitening.rows]
            outlying.append(times[mask[:, columns].any(axis=1)])
            measured.append(times[(whitening.outputs | mask)[:, columns].any(axis=1)])
        if is_event(outlying, measured, settings.event_level):
            return None
        count, total = sum(map(len, outlying)), sum(map(len, measured))
        spikes = fit.posterior.data.spikes(self.kind)
        if len(spikes):
            count, total = count + len(spikes), self._every_sample(fit.posterior) // self.kind.size
        fraction = count / max(total, 1)
        sd = np.sqrt(max(fraction * (1.0 - fraction), 1.0 / max(total, 1)) / max(total, 1))
        posterior = leaving_out(fit.posterior, masks)
        gain = self._gain_of_spikes(fit.posterior, spikes, fraction) if len(spikes) else 0.0
        return FittedFault(self, np.array([fraction]), np.array([sd]), posterior, gain)

    def _every_sample(self, posterior: Posterior) -> int:
        """Return the number of scalar samples of the sensor before any average."""
        recordings = range(len(posterior.manoeuvres))
        return self.kind.size * sum(len(posterior.data.samples_of(r, self.kind)[0]) for r in recordings)

    def _gain_of_spikes(self, posterior: Posterior, spikes: Floats, fraction: float) -> float:
        """Return what the fault gains in log likelihood by the spikes at the full rate, which no mean holds.

        They are uniform over the range of the readings under the fault, and normal noise without it.
        """
        data = posterior.data
        readings = np.concatenate([data.samples_of(r, self.kind)[1] for r in range(len(posterior.manoeuvres))])
        width = float(np.max(np.ptp(readings, axis=0) / data.sigma_per_sample(0, self.kind)))
        noise = 0.5 * spikes**2 + 0.5 * np.log(2.0 * np.pi)
        return float((noise + np.log(max(fraction, 1e-9)) - np.log(max(width, 1.0))).sum())

    def log_charge(self, fitted: FittedFault) -> float:
        """Return the charge of the fraction, and the log density of the samples that count as outliers.

        A sample is contaminated with the probability that the fault states, and then uniform over the range of the
        readings of its channel; it does not count as certain.
        """
        posterior, fraction = fitted.posterior, float(fitted.mean[0])
        columns = posterior.model.channels.of(self.kind)
        total = super().log_charge(fitted)
        for r, gone in enumerate(posterior.data.left_out):
            mask = gone[:, columns]
            span = np.ptp(posterior.data.measured(r, self.kind)[1], axis=0)[: mask.shape[1]]
            width = np.maximum(span, posterior.data.sigma(r, self.kind))
            total += float((mask.sum(axis=0) * (np.log(max(fraction, 1e-9)) - np.log(width))).sum())
            kept = int((~mask & posterior.whitenings[r].outputs[:, columns]).sum())
            total += kept * float(np.log1p(-min(fraction, 0.5)))
        return total

    def changed(self, sensor: Sensor, sizes: Sizes) -> Sensor:
        """Return the sensor with the fraction of its readings that are no measurement."""
        fraction = number_of(sizes[0])
        if fraction >= 1.0:
            raise InputError(f"got a fraction of {fraction:g}", remedy="Give the share of corrupted readings, below 1")
        return replace(sensor, outliers=fraction)

    def in_data(self, model: Model, manoeuvres: Sequence[Manoeuvre], sizes: Sizes) -> list[Manoeuvre]:
        """Return recordings without the readings of the sensor that are off a fit, unless they are an event.

        Parameters
        ----------
        model : Model
        manoeuvres : sequence of Manoeuvre
        sizes : sequence
            The stated fraction. Where more readings than it makes probable are off, none is left out: then it is the
            model that is off.
        """
        channels = {name for manoeuvre in manoeuvres for name in manoeuvre.recording.channels}
        if not channels >= {column for sensor in model.sensors for column in sensor.kind.columns}:
            return list(manoeuvres)  # planned motion, of which nothing is measured yet
        kept = list(manoeuvres)
        for _ in range(self.ROUNDS):
            posterior = Posterior.of(model, kept)
            fitted = self.measured(PerturbedModel(posterior).fit())
            if fitted is None or not fitted.mean[0]:
                break
            total = sum(len(posterior.data.measured(r, self.kind)[0]) for r in range(len(kept)))
            if stats.binom.sf(round(float(fitted.mean[0]) * total) - 1, total, number_of(sizes[0])) < self.LEVEL:
                break
            kept = without_left_out(fitted.posterior)
        return kept


@register_fault
class Quantisation(SensorFault):
    """Readings on a lattice, whose step adds to the noise."""

    name = "quantisation"
    summary = "The sensor reports multiples of a coarse step."
    advice = "The readings lie on a grid: record at rest, and compare with the resolution in the data sheet."
    parameters = "step [unit of the sensor]"

    CERTAIN: ClassVar[float] = -1e3  #: logarithm of a p-value that stands for zero: noise never falls on a lattice
    COARSE: ClassVar[float] = 0.4  #: steps, in sigma, below which rounding does no harm

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Step."""
        return (Quantity("step", self.kind.unit),)

    def log_p_of(self, residual: SensorResidual, posterior: Posterior) -> float | None:
        """Return certainty where the readings lie on a lattice that is not declared."""
        sensor = posterior.model.sensor(self.kind)
        known = sensor is not None and isinstance(sensor.noise, Quantised)
        return None if known or self._lattice(posterior) is None else self.CERTAIN

    def measured(
        self, fit: Fit, least: float = -np.inf, settings: DiagnosisSettings = DEFAULT_SETTINGS
    ) -> FittedFault | None:
        """Return the step of the lattice, which is exact."""
        step = self._lattice(fit.posterior)
        if step is None:
            return None
        return FittedFault(self, np.array([float(step.mean())]), np.zeros(1), self.in_noise(fit, [step]))

    def log_charge(self, fitted: FittedFault) -> float:
        """Return what the lattice says by itself: the probability that values fall on it by chance."""
        return -float(np.log(2.0 * ON_LATTICE)) * fitted.posterior.samples / 3.0

    def changed(self, sensor: Sensor, sizes: Sizes) -> Sensor:
        """Return the sensor with the noise of rounding to a step per axis."""
        return replace(sensor, noise=Quantised(sensor.noise, _per_axis(sizes[0], self.kind)))

    def _lattice(self, posterior: Posterior) -> Floats | None:
        """Return the step per axis of the lattice that the readings lie on, or None where they lie on no coarse one."""
        if not self.kind.mounted:
            return None
        steps = []
        for axis in range(self.kind.size):
            count = len(posterior.manoeuvres)
            values = np.concatenate([posterior.data.samples_of(r, self.kind)[1][:, axis] for r in range(count)])
            step = lattice_step(values)
            if step is None or step < self.COARSE * float(posterior.data.sigma_per_sample(0, self.kind)[axis]):
                return None
            steps.append(step)
        return np.array(steps)


def _per_axis(value: float | Sequence[float] | Floats, kind: SensorKind) -> tuple[float, ...]:
    """Return one number for each component of a sensor's residual."""
    return tuple(np.broadcast_to(np.asarray(value, dtype=float), kind.size).tolist())


def is_event(
    outlying: Sequence[Floats], measured: Sequence[Floats], level: float = DEFAULT_SETTINGS.event_level
) -> bool:
    """Return whether outliers crowd together, or recur at the same time of every recording, more than chance allows.

    Garbled readings fall anywhere. Something that lasts, such as a mass that moves, spoils samples next to each other,
    and something that belongs to the manoeuvre spoils the same samples of its repetitions. The number of such pairs
    among independent outliers is nearly Poisson.

    Parameters
    ----------
    outlying : sequence of (k,) arrays
        Times of the outliers of each recording, increasing [s].
    measured : sequence of (n,) arrays
        Times of all its samples, the outliers among them [s].
    level : float
        Probability of as many pairs by chance, below which outliers are an event.
    """
    near = 3  # samples of one recording that are so few apart are near each other
    together = 1  # samples of two recordings whose times since the start are so few samples apart coincide
    pairs, chance = 0, 0.0
    interval = max((float(np.median(np.diff(times))) for times in measured if len(times) > 1), default=0.0)
    for instants, times in zip(outlying, measured, strict=True):
        places = np.searchsorted(times, instants)
        pairs += int((np.abs(np.subtract.outer(places, places)) <= near).sum() - len(instants)) // 2
        chance += near * len(instants) * (len(instants) - 1) / max(len(times), 1)
    for (first, its), (second, others) in combinations(zip(outlying, measured, strict=True), 2):
        apart = np.abs(first[:, None] - second[None, :])
        pairs += int((apart < (together + 0.5) * interval).sum())
        chance += (2 * together + 1) * len(first) * len(second) / max(len(its), len(others), 1)
    return bool(stats.poisson.sf(pairs - 1, chance) < level)
