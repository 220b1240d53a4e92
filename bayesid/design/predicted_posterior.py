"""Posterior that planned manoeuvres would lead to, with the noise of all sensors and encoders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.design.encoder_information import Encoder
from bayesid.inference.body_quantities import linearise
from bayesid.inference.noise_changes import relinearised, with_manoeuvres
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import blank_channels, simulate_recordings
from bayesid.recording.joint_motion import MeasuredMotion, Motion, sample_joints
from bayesid.recording.recording import Recording
from bayesid.recording.wheel_motion import WheelMotion
from bayesid.simulation.model import Manoeuvre, Model

__all__ = ["Encoder", "Predicted", "describe", "planned_manoeuvre", "planned_posterior", "predict", "simulated"]


@dataclass(frozen=True)
class Predicted:
    """Predicted posterior of the bodies to identify, the Laplace approximation at a linearisation point."""

    names: tuple[str, ...]  #: names of the n quantities, as in identification.json
    mean: Floats  #: (n,) values of the quantities at the linearisation point, in SI units
    covariance: Floats  #: (n, n) covariance of the quantities, in SI units
    relative: Floats  #: (n, n) covariance of the bodies' log-Cholesky coordinates, which are relative [1]

    @property
    def sd(self) -> Floats:
        """Standard deviations of the quantities, shape (n,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def log_det(self) -> float:
        """Logarithm of the determinant of `covariance`, in SI units."""
        scale = self.sd
        return float(np.linalg.slogdet(self.covariance / np.outer(scale, scale))[1] + 2.0 * np.log(scale).sum())

    @property
    def worst(self) -> float:
        """Standard deviation of the log-Cholesky coordinates along the worst direction."""
        return float(np.sqrt(np.linalg.eigvalsh(self.relative)[-1]))

    @property
    def geometric_mean(self) -> float:
        """Geometric mean of the standard deviations; it mixes units, so that only ratios of it have a meaning."""
        return float(np.exp(np.log(self.sd).mean()))


def planned_manoeuvre(
    model: Model,
    motion: Motion,
    time: Floats,
    name: str,
    encoder: Encoder,
    attitude: Floats | None = None,
    wheels: WheelMotion | None = None,
    **start: float,
) -> Manoeuvre:
    """Return a manoeuvre with joints as recorded without noise, and placeholder samples of the sensors.

    Parameters
    ----------
    model : Model
        Robot and sensors.
    motion : Motion
        Planned joint motion.
    time : (T,) array
        Times of all samples [s].
    name : str
        Name of the manoeuvre.
    encoder : Encoder
        Noise of the joints' encoders, which the smoothing assumes.
    attitude : (4,) array, optional
        Initial attitude, a quaternion x, y, z, w from base to orbit axes; by default the two agree.
    wheels : WheelMotion, optional
        Motion of the wheels, by default at rest.
    **start : float
        Parameters ``attitude_sigma`` and ``argument_of_latitude`` of `Manoeuvre`.
    """
    spun = wheels or WheelMotion.planned(model.robot.wheels)
    planned = {**sample_joints(motion, model.robot, time), **spun.speed_channels(time)}
    recording = Recording(name, None, time, {**planned, **blank_channels(model.sensors, len(time), model.torque)})
    measured = MeasuredMotion.from_recording(recording, model.robot, sigma=encoder)
    begin = np.array([0.0, 0.0, 0.0, 1.0]) if attitude is None else np.asarray(attitude)
    return Manoeuvre(recording, measured, begin, **start)


def planned_posterior(
    model: Model, manoeuvres: Sequence[Manoeuvre], z: Floats | None = None, step: float | None = None
) -> Posterior:
    """Return the posterior of planned manoeuvres whose sensors read what a point of the unknowns predicts.

    Parameters
    ----------
    model : Model
        Model of the posterior.
    manoeuvres : sequence of Manoeuvre
        Planned manoeuvres.
    z : (n,) array, optional
        Coordinates of the point, by default the prior's centre.
    step : float, optional
        Step of the integration [s], by default chosen from the accuracy of the sensors.
    """
    blank = Posterior.of(model, manoeuvres, step=step)
    return simulated(blank, np.zeros(blank.size) if z is None else z)


def simulated(posterior: Posterior, z: Floats) -> Posterior:
    """Return the posterior with readings that some coordinates predict, without noise.

    Parameters
    ----------
    posterior : Posterior
        Posterior whose readings are replaced.
    z : (n,) array
        Coordinates of the unknowns.
    """
    recordings = simulate_recordings(posterior, z=z)
    return with_manoeuvres(
        posterior,
        [
            replace(manoeuvre, recording=recording)
            for manoeuvre, recording in zip(posterior.manoeuvres, recordings, strict=True)
        ],
    )


def predict(posterior: Posterior) -> Predicted:
    """Return the predicted posterior of planned manoeuvres if the prior's centre is the truth."""
    z = np.zeros(posterior.size)
    jacobian = relinearised(posterior, z).jacobian(z)
    return describe(posterior, z, np.linalg.inv(jacobian.T @ jacobian))


def describe(posterior: Posterior, z: Floats, coordinates: Floats) -> Predicted:
    """Return the reported quantities at ``z`` with the covariance that follows from that of the coordinates.

    Parameters
    ----------
    posterior : Posterior
    z : (n,) array
        Linearisation point.
    coordinates : (n, n) array
        Covariance of the coordinates.
    """
    names, values, slope = linearise(posterior, z)
    widths = np.asarray(posterior.unknowns.widths)[posterior.unknowns.body_indices()]
    count = widths.shape[1]
    return Predicted(
        names=names,
        mean=values,
        covariance=slope @ coordinates @ slope.T,
        relative=widths @ coordinates[:count, :count] @ widths.T,
    )
