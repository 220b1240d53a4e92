"""Tests that name no cause: smooth disturbing torques and forces, energy of the residual by band, its variance."""

from __future__ import annotations

import numpy as np
from scipy import stats

from bayesid._math.arrays import Floats
from bayesid.diagnosis.noise_tests import leverage
from bayesid.diagnosis.perturbed_fit import Engine, Fit

__all__ = ["PAIRS", "disturbances", "omnibus", "variance_tests", "vibrations"]

BANDS = {"slow": (0, 6), "middle": (6, 16), "fast": (16, 30)}
"""Cosines in time that disturbances and residuals are tested on."""

FREQUENCIES = (0.02, 0.03, 0.045, 0.065, 0.09, 0.12, 0.16, 0.22, 0.3, 0.42, 0.6, 0.85)
"""Frequencies at which a hidden vibration is looked for [Hz]."""

LIGHT = 0.01
"""Damping at which it is looked for, relative to critical."""

TORQUE, FORCE = 0.05, 0.05
"""Scale of disturbances [N m, N]."""

AMPLITUDE = 10.0
"""Scale of a residual's cosines, in standard deviations of all its samples together."""

MODAL = 5.0
"""Scale of a vibration's coupling [sqrt(kg) m and sqrt(kg)]."""


def omnibus(engine: Engine, fit: Fit) -> dict[str, Floats]:
    """Columns of the tests, by name: disturbing torque by axis and band, slow force, residual by channel and band."""
    found = {}
    most = max(high for _, high in BANDS.values())
    torque, force = (
        columns.reshape(len(columns), len(engine.posterior.manoeuvres), -1, 3)
        for columns in disturbances(engine, fit, most, BANDS["slow"][1])
    )
    for band, (low, high) in BANDS.items():
        for axis, name in enumerate("xyz"):
            found[f"{band} torque about {name}"] = torque[:, :, low:high, axis].reshape(len(torque), -1)
    for axis, name in enumerate("xyz"):
        found[f"slow force along {name}"] = force[..., axis].reshape(len(force), -1)
    names = engine.posterior.model.channels.names
    for band in ("slow", "middle"):
        for channel, name in enumerate(names):
            found[f"{band} residual of {name}"] = _cosines(engine, channel, *BANDS[band])
    return found


def disturbances(engine: Engine, fit: Fit, torques: int, forces: int) -> tuple[Floats, Floats]:
    """Responses to cosines in time of torque and force, base axes: (N, R * torques * 3) and (N, R * forces * 3).

    The force acts through the centre of mass.
    """
    data = engine.data_of(fit)
    recordings = len(engine.posterior.manoeuvres)
    moments = (fit.operating.node, fit.operating.sample)
    times = [np.asarray(instant.environment.time) for instant in moments]
    ends = times[0].max(axis=1)
    found = []
    for functions, first, scale in ((torques, 3, TORQUE), (forces, 0, FORCE)):
        count = recordings * functions * 3
        wrenches = []
        for instant, time in zip(moments, times, strict=True):
            wrench = np.zeros((recordings, functions, 3, *time.shape, 6))
            for r in range(recordings):
                waves = np.cos(np.pi * np.arange(functions)[:, None] * time[r] / ends[r])
                for axis in range(3):
                    wrench[r, :, axis, r, :, first + axis] = scale * waves
            if first == 0:
                wrench[..., 3:] = np.cross(np.asarray(instant.body.com), wrench[..., :3])
            wrenches.append(wrench.reshape(count, *time.shape, 6))
        found.append(
            engine.respond(engine.perturbation(count, node_wrench=wrenches[0], sample_wrench=wrenches[1]), fit.z, data)
        )
    return found[0], found[1]


def vibrations(engine: Engine, fit: Fit) -> dict[float, Floats]:
    """Responses to unit entries of a vibration's coupling matrix at some frequencies: 21 columns each."""
    data = engine.data_of(fit)
    vibration = fit.operating.vibration
    found = {}
    for frequency in FREQUENCIES:
        speed, change = vibration.responses(frequency, LIGHT)
        flow = np.zeros((21, *speed.shape))
        flow_rate = np.zeros_like(flow)
        for row, (i, j) in enumerate(PAIRS):
            for a, b in {(i, j), (j, i)}:
                flow[row, ..., a] += MODAL**2 * speed[..., b]
                flow_rate[row, ..., a] += MODAL**2 * change[..., b]
        rows = vibration.flow_rows(flow, flow_rate)
        perturbation = engine.perturbation(21, node_rows=rows[0], sample_rows=rows[1])
        found[frequency] = engine.respond(perturbation, fit.z, data)
    return found


PAIRS = [(i, j) for i in range(6) for j in range(i, 6)]
"""Entries of the symmetric coupling matrix, in the order of `vibrations`."""


def _cosines(engine: Engine, channel: int, low: int, high: int) -> Floats:
    """Cosines of one channel of the whitened residual, one column per function and recording."""
    columns = []
    for r, item in enumerate(engine.posterior.whitenings):
        there = np.flatnonzero(item.outputs[:, channel])
        place = (np.arange(len(there)) + 0.5) / max(len(there), 1)
        for k in range(low, min(high, len(there) // 3)):
            column = np.zeros(engine.posterior.residual_shape)
            column[r, there, channel] = AMPLITUDE * np.cos(np.pi * k * place) * np.sqrt(2.0 / len(there))
            columns.append(column.ravel())
    return np.array(columns).reshape(len(columns), int(np.prod(engine.posterior.residual_shape))).T


def variance_tests(engine: Engine, fit: Fit) -> dict[str, float]:
    """Logarithms of p-values of the variance in each recording and sensor axis, pooled into one test."""
    whole = fit.residual.reshape(engine.posterior.residual_shape)
    taken = leverage(fit).reshape(whole.shape)
    smallest, count = 0.0, 0
    for r, item in enumerate(engine.posterior.whitenings):
        for c in range(whole.shape[2]):
            there = np.flatnonzero(item.outputs[:, c])
            if len(there) == 0:
                continue
            degrees = len(there) - taken[r, there, c].sum()
            energy = float((whole[r, there, c] ** 2).sum())
            both = 2.0 * min(stats.chi2.sf(energy, degrees), stats.chi2.cdf(energy, degrees))
            smallest, count = min(smallest, float(np.log(max(both, 1e-300)))), count + 1
    # the smallest of n independent p-values
    return {"variance by axis": float(np.log(-np.expm1(count * np.log1p(-np.exp(smallest)))))} if smallest < 0.0 else {}
