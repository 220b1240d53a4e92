"""Faults of the noise: understated, coloured, with outliers, quantised; found in the whitened residual."""

from __future__ import annotations

import numpy as np
from scipy import stats
from scipy.special import gammaln

from bayesid._math.arrays import Floats
from bayesid.diagnosis.response.perturbed_model import Fit
from bayesid.inference.posterior import Posterior
from bayesid.inference.residual_view import ResidualView
from bayesid.simulation.sensors import Quantised, SensorKind

__all__ = ["ON_LATTICE", "lattice", "leverage", "noise_tests", "variance_tests"]

CORRELATION = (2.0, 6.0, 20.0)
"""Correlation times that coloured noise is looked for at, in samples."""

CERTAIN = -1e3
"""Logarithm of a p-value that stands for zero: noise never falls on a lattice."""

COARSE = 0.4
"""Steps of a lattice, in sigma, below which rounding does no harm."""

ON_LATTICE = 0.02
"""Largest distance from a multiple of the step, in steps, for a value to be on the lattice."""


def noise_tests(posterior: Posterior, fit: Fit) -> dict[str, float]:
    """Logarithms of the p-values of the noise faults' tests, by the faults' names."""
    whole, taken = fit.view, ResidualView.of(posterior, leverage(fit))
    found = {}
    for sensor in posterior.model.sensors:
        name = sensor.kind.value
        energy, degrees, pieces = 0.0, 0.0, []
        for residual, share in zip(whole.each(sensor.kind), taken.each(sensor.kind), strict=True):
            energy += float((residual**2).sum())
            degrees += len(residual) - float(share.sum())
            pieces.append(residual / np.sqrt(np.maximum(1.0 - share, 0.05)))
        if degrees <= 0.0:
            continue
        found[f"{name}-noise"] = chi2_log_sf(energy, degrees)
        scale = np.sqrt(max(energy / degrees, 1.0))
        found[f"coloured-noise:{name}"] = _coloured([piece / scale for piece in pieces])
        largest = max(float(np.abs(piece).max()) for piece in pieces)
        count = sum(len(piece) for piece in pieces)
        tail = np.log(2.0) + stats.norm.logsf(largest / scale)
        found[f"outliers:{name}"] = float(min(0.0, np.log(count) + tail))
        if not isinstance(sensor.noise, Quantised) and lattice(posterior, sensor.kind) is not None:
            found[f"quantisation:{name}"] = CERTAIN
    return found


def _coloured(pieces: list[Floats]) -> float:
    """Log p-value of positive autocorrelation, for the best of some correlation times."""
    best = 0.0
    for time in CORRELATION:
        rho = np.exp(-1.0 / time)
        lags = np.arange(1, int(3.0 * time) + 1)
        total, variance = 0.0, 0.0
        for piece in pieces:
            for lag in lags[lags < len(piece)]:
                total += rho**lag * float(piece[lag:] @ piece[:-lag])
                variance += rho ** (2 * lag) * (len(piece) - lag)
        best = min(best, float(stats.norm.logsf(total / np.sqrt(max(variance, 1e-300)))))
    return float(min(0.0, best + np.log(len(CORRELATION))))


def lattice(posterior: Posterior, kind: SensorKind) -> Floats | None:
    """Step per axis of the lattice that a sensor's values lie on, (3,), or None where they lie on no coarse one."""
    if not kind.mounted:
        return None
    steps = []
    for axis in range(3):
        values = np.concatenate(
            [posterior.data.measured(i, kind)[1][:, axis] for i in range(len(posterior.manoeuvres))]
        )
        sigma = float(posterior.data.sigma(0, kind)[axis])
        distances = np.diff(np.unique(values))
        distances = distances[distances > 1e-9 * np.abs(values).max()]
        if len(distances) == 0:
            return None
        step = float(distances.min())
        ratio = (values - values.min()) / step
        off = np.abs(ratio - np.round(ratio)).max()
        if step < COARSE * sigma or off > ON_LATTICE or ratio.max() < 2.0:
            return None
        steps.append(step)
    return np.array(steps)


def leverage(fit: Fit) -> Floats:
    """Share of each scalar's variance that the fit has taken, (N,)."""
    return (fit.block.share(fit.known.T) ** 2).sum(axis=0)


def variance_tests(posterior: Posterior, fit: Fit) -> dict[str, float]:
    """Logarithms of p-values of the variance in each recording and sensor axis, pooled into one test."""
    whole, taken = fit.view, ResidualView.of(posterior, leverage(fit))
    smallest, count = 0.0, 0
    for recording, channel in np.argwhere(whole.mask.any(axis=1)).tolist():
        residual, share = whole.samples(recording, channel), taken.samples(recording, channel)
        degrees, energy = len(residual) - share.sum(), float((residual**2).sum())
        both = 2.0 * min(stats.chi2.sf(energy, degrees), stats.chi2.cdf(energy, degrees))
        smallest, count = min(smallest, float(np.log(max(both, 1e-300)))), count + 1
    # the smallest of n independent p-values
    return {"variance by axis": float(np.log(-np.expm1(count * np.log1p(-np.exp(smallest)))))} if smallest < 0.0 else {}


def chi2_log_sf(statistic: float, degrees: float) -> float:
    """Logarithm of the upper tail of chi-square; far out by a continued fraction, where it underflows."""
    value = float(stats.chi2.logsf(statistic, degrees))
    if np.isfinite(value):
        return value
    a, x = 0.5 * degrees, 0.5 * statistic
    return float(a * np.log(x) - x - np.log(x - a + 1.0) - gammaln(a))  # the first term of the continued fraction
