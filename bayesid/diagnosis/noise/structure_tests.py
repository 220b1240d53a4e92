"""Tests of a whitened residual for courses that no noise has: a period, or an event."""

from __future__ import annotations

import numpy as np
from scipy import stats

from bayesid._math.arrays import Floats
from bayesid.diagnosis.response.perturbed_model import Fit

__all__ = ["log_p_of_a_period", "log_p_of_an_event", "structure_tests"]

MOST_FREQUENCIES = 500
"""Largest number of frequencies of which a period is looked for, the lowest first."""

LONGEST_EVENT = 0.25
"""Longest event, as a fraction of the samples of a recording."""


def structure_tests(fit: Fit) -> dict[str, float]:
    """Logarithms of the p-values of a period and of an event in the residual of each sensor, by names.

    The residual of a model that holds is white with unit variance. A fit takes some of that, more at low frequencies,
    so that the p-values are at least as large as they should be.
    """
    found = {}
    for kind in fit.posterior.model.channels.kinds:
        view = fit.view
        parts = [view.complete(kind, recording) for recording in range(view.recordings)]
        pieces = [(time, residual) for time, residual in parts if len(time) > 4]
        if pieces:
            found[f"period in {kind.value}"] = log_p_of_a_period(pieces)
            found[f"event in {kind.value}"] = log_p_of_an_event([residual for _, residual in pieces])
    return found


def log_p_of_a_period(pieces: list[tuple[Floats, Floats]]) -> float:
    """Log p-value of the strongest period that all recordings share, with any size and phase in each axis of each.

    Parameters
    ----------
    pieces : list of ((n,) array, (n, axes) array)
        Times [s] and whitened residuals of each recording.

    Notes
    -----
    At every frequency the energy in phase and out of phase is chi-square; the smallest p-value counts as often as
    frequencies were tried (Lomb 1976, Astrophysics and Space Science 39; Scargle 1982, Astrophysical Journal 263).
    """
    longest = max(float(np.ptp(time)) for time, _ in pieces)
    interval = min(float(np.median(np.diff(time))) for time, _ in pieces)
    count = int(np.clip(longest / interval, 1, MOST_FREQUENCIES))
    energy, degrees = np.zeros(count), 0
    for time, residual in pieces:
        omega = 2.0 * np.pi * 0.5 * np.arange(1, count + 1) / longest
        # the shift that makes sine and cosine orthogonal at these instants
        twice = 2.0 * omega[:, None] * time
        shift = 0.5 * np.arctan2(np.sin(twice).sum(axis=1), np.cos(twice).sum(axis=1))
        phase = omega[:, None] * time - shift[:, None]
        for wave in (np.cos(phase), np.sin(phase)):
            norm = np.maximum((wave**2).sum(axis=1), 1e-9)
            energy += ((wave @ residual) ** 2).sum(axis=1) / norm
        degrees += 2 * residual.shape[1]
    return float(min(0.0, np.log(count) + stats.chi2.logsf(energy.max(), degrees)))


def log_p_of_an_event(residuals: list[Floats]) -> float:
    """Log p-value of the strongest shift of the mean in any stretch of any recording, of either sign in each axis.

    Parameters
    ----------
    residuals : list of (n, axes) array
        Whitened residuals of each recording.
    """
    strongest, tried, axes = 0.0, 0, residuals[0].shape[1]
    for residual in residuals:
        sums = np.concatenate([np.zeros((1, axes)), np.cumsum(residual, axis=0)])
        width = 2
        while width <= max(2, LONGEST_EVENT * len(residual)):
            energy = ((sums[width:] - sums[:-width]) ** 2).sum(axis=1) / width
            if len(energy):
                strongest, tried = max(strongest, float(energy.max())), tried + len(energy)
            width *= 2
    return float(min(0.0, np.log(max(tried, 1)) + stats.chi2.logsf(strongest, axes)))
