"""Readings of each sensor beside those that the model predicts, with the whitened residuals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import predicted_readings
from bayesid.simulation.sensors import SensorKind

__all__ = ["SensorFit", "TorqueFit", "sensor_fits", "torque_fits"]


@dataclass(frozen=True)
class SensorFit:
    """Readings of one sensor in one recording, measured and predicted.

    Attributes
    ----------
    time, measured, predicted : (n,), (n, k), (n, k) array
        Times [s] and readings as they are drawn (`SensorKind.shown`), in sensor axes. An attitude is the rotation
        vector from the first sample, in base axes.
    residual_time, residual : (m,), (m, k) array
        Times [s] and whitened residuals, which are independent and of unit variance if the model is right; NaN where
        an axis has no sample.
    """

    kind: SensorKind
    time: Floats
    measured: Floats
    predicted: Floats
    residual_time: Floats
    residual: Floats

    @property
    def chi2(self) -> float:
        """Sum of squares of the whitened residuals."""
        return float(np.nansum(self.residual**2))

    @property
    def samples(self) -> int:
        """Number of scalar residuals."""
        return int(np.isfinite(self.residual).sum())


def sensor_fits(posterior: Posterior, z: Floats) -> list[list[SensorFit]]:
    """Return measured and predicted readings at coordinates ``z`` (n,): a list per recording, an entry per sensor."""
    predictions, residuals = predicted_readings(posterior, z), posterior.residuals(z)
    result = []
    for index, (predicted, whitening) in enumerate(zip(predictions, posterior.whitenings, strict=True)):
        grid = posterior.data.times(index)
        whitened = np.where(whitening.outputs, residuals[index, : len(whitening.rows)], np.nan)
        fits = []
        for sensor in posterior.model.sensors:
            time, measured = posterior.data.measured(index, sensor.kind)
            simulated = predicted.channels[sensor.kind][np.searchsorted(grid, time)]
            measured, simulated = (sensor.kind.shown(values, measured[0]) for values in (measured, simulated))
            residual = whitened[:, posterior.model.channels.of(sensor.kind)]
            kept = np.isfinite(residual).any(axis=1)
            fits.append(SensorFit(sensor.kind, time, measured, simulated, grid[whitening.rows][kept], residual[kept]))
        result.append(fits)
    return result


@dataclass(frozen=True)
class TorqueFit:
    """Torque of one joint in one recording, measured and predicted.

    Attributes
    ----------
    joint, unit : str
    time, measured, predicted : (n,) array
        Times [s] and torques [N m], or forces [N] of a prismatic joint.
    residual_time, residual : (m,) array
        Times [s] and whitened residuals of the samples that the likelihood uses.
    """

    joint: str
    unit: str
    time: Floats
    measured: Floats
    predicted: Floats
    residual_time: Floats
    residual: Floats


def torque_fits(posterior: Posterior, z: Floats) -> list[list[TorqueFit]]:
    """Return measured and predicted torques at the coordinates ``z`` (n,): a list per recording, an entry per joint."""
    sensor, robot = posterior.model.torque, posterior.model.robot
    if sensor is None:
        return [[] for _ in posterior.manoeuvres]
    predictions, residuals = predicted_readings(posterior, z), posterior.residuals(z)
    first, result = posterior.model.channels.torques.start, []
    for index, (predicted, whitening) in enumerate(zip(predictions, posterior.whitenings, strict=True)):
        time, measured = posterior.data.torques(index)
        grid = posterior.data.times(index)
        simulated = predicted.torque[np.searchsorted(grid, time)]
        fits = []
        for column, joint in enumerate(sensor.joints):
            used = whitening.outputs[:, first + column]
            residual = residuals[index, : len(used), first + column][used]
            unit = "N" if robot.joints[robot.joint_index(joint)].kind == "prismatic" else "N m"
            rows = grid[whitening.rows][used]
            fits.append(TorqueFit(joint, unit, time, measured[:, column], simulated[:, column], rows, residual))
        result.append(fits)
    return result
