"""What each sensor read and what the model says that it should have read, ready to be drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import predicted_readings
from bayesid.simulation.sensors import Kind, Sensor

__all__ = ["SensorFit", "TorqueFit", "sensor_fits", "sensor_sigma", "torque_fits"]


@dataclass(frozen=True)
class SensorFit:
    """One sensor in one recording.

    Attributes
    ----------
    time, measured, predicted : (n,), (n, 3), (n, 3) array
        In sensor axes; an attitude as its rotation vector from the first sample, base axes.
    residual_time, residual : (m,), (m, 3) array
        Whitened: independent and of unit variance if the model is right; NaN where an axis has no sample.
    """

    kind: Kind
    time: Floats
    measured: Floats
    predicted: Floats
    residual_time: Floats
    residual: Floats

    @property
    def chi2(self) -> float:
        """Square sum of the whitened residuals."""
        return float(np.nansum(self.residual**2))

    @property
    def samples(self) -> int:
        """Number of scalar residuals."""
        return int(np.isfinite(self.residual).sum())


def sensor_fits(posterior: Posterior, z: Floats) -> list[list[SensorFit]]:
    """Compare measured and simulated at ``z``: one list per recording, one entry per sensor."""
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
            own = whitened[:, posterior.model.channels.of(sensor.kind)]
            kept = np.isfinite(own).any(axis=1)
            fits.append(SensorFit(sensor.kind, time, measured, simulated, grid[whitening.rows][kept], own[kept]))
        result.append(fits)
    return result


@dataclass(frozen=True)
class TorqueFit:
    """One joint's torque sensor in one recording: (n,) arrays, and the (m,) whitened residuals of the samples used."""

    joint: str
    unit: str
    time: Floats
    measured: Floats
    predicted: Floats
    residual_time: Floats
    residual: Floats


def torque_fits(posterior: Posterior, z: Floats) -> list[list[TorqueFit]]:
    """Compare measured and simulated joint torques at ``z``: one list per recording, one entry per joint."""
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
            own = residuals[index, : len(used), first + column][used]
            unit = "N" if robot.joints[robot.joint_index(joint)].kind == "prismatic" else "N m"
            rows = grid[whitening.rows][used]
            fits.append(TorqueFit(joint, unit, time, measured[:, column], simulated[:, column], rows, own))
        result.append(fits)
    return result


def sensor_sigma(posterior: Posterior, sensor: Sensor) -> Floats:
    """Noise of a sensor per recording and axis, shape (R, 3)."""
    return np.stack([posterior.data.sigma(index, sensor.kind) for index in range(len(posterior.manoeuvres))])
