"""New posteriors made from one with other noise, other samples or other recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayesid._math.arrays import Floats
from bayesid.inference.data import Data, grids_of, with_whitenings
from bayesid.inference.posterior import Posterior, whiten
from bayesid.inference.whitening import Whitening, Window
from bayesid.simulation.joint_torques import TorqueSensor
from bayesid.simulation.model import Manoeuvre
from bayesid.simulation.sensors import Sensor

__all__ = ["leaving_out", "relinearised", "with_manoeuvres", "with_sensors", "without_left_out"]


def relinearised(posterior: Posterior, z: Floats) -> Posterior:
    """Return the posterior with the encoders' noise linearised at the coordinates ``z`` (size,).

    Parameters
    ----------
    posterior : Posterior
    z : (size,) array
        Coordinates.
    """
    windows = [old.window for old in posterior.whitenings]
    return replace(posterior, data=_renoised(posterior.data, _whitened(posterior, posterior.data, z, windows)))


def with_sensors(
    posterior: Posterior,
    sensors: Sequence[Sensor],
    z: Floats,
    like: Posterior | None = None,
    torque: TorqueSensor | None = None,
) -> Posterior:
    """Return the posterior with other noise of the same sensors.

    Parameters
    ----------
    posterior : Posterior
    sensors : sequence of Sensor
        The same sensors with other noise.
    z : (size,) array
        Linearisation point of the encoders' noise.
    like : Posterior, optional
        Posterior whose whitening windows are taken. By default they are kept, or chosen anew if noise is coloured.
    torque : TorqueSensor, optional
        The same torque sensors with other noise, by default with the noise that they have.
    """
    torque = posterior.model.torque if torque is None else torque
    data = replace(
        posterior.data,
        model=replace(posterior.model, sensors=tuple(sensors), torque=torque),
        recorded=tuple(samples.with_sensors(sensors, torque) for samples in posterior.data.recorded),
    )
    search = like is None and any(sensor.coloured is not None for sensor in sensors)
    known = posterior.whitenings if like is None else like.whitenings
    windows = [None if search else old.window for old in known]
    return replace(posterior, data=_renoised(data, _whitened(posterior, data, z, windows)))


def leaving_out(posterior: Posterior, masks: Sequence[NDArray[np.bool_]]) -> Posterior:
    """Return the posterior without the whitened scalars that masks (O, C), one per recording, mark.

    Parameters
    ----------
    posterior : Posterior
    masks : (R,) sequence of (outputs, channels) arrays of bool
        Samples to leave out.
    """
    data = _renoised(posterior.data, _without(posterior.whitenings, masks))
    gone = tuple(np.logical_or(mask, old) for mask, old in zip(masks, posterior.data.left_out, strict=True))
    return replace(posterior, data=replace(data, left_out=gone))


def without_left_out(posterior: Posterior) -> list[Manoeuvre]:
    """Return the manoeuvres of a posterior without the samples that its likelihood leaves out."""
    manoeuvres = []
    for index, manoeuvre in enumerate(posterior.manoeuvres):
        recording = manoeuvre.recording
        channels = dict(recording.channels)
        for kind, times in posterior.data.left_out_times(index).items():
            gone = np.isin(recording.time, times)
            channels |= {column: np.where(gone, np.nan, channels[column]) for column in kind.columns}
        manoeuvres.append(replace(manoeuvre, recording=replace(recording, channels=channels)))
    return manoeuvres


def with_manoeuvres(posterior: Posterior, manoeuvres: Sequence[Manoeuvre]) -> Posterior:
    """Return the posterior of the same model and step given other manoeuvres, of which no sample is left out.

    Parameters
    ----------
    posterior : Posterior
    manoeuvres : sequence of Manoeuvre
    """
    return Posterior.of(posterior.model, manoeuvres, step=posterior.step, flat_prior=posterior.flat_prior)


def _whitened(posterior: Posterior, data: Data, z: Floats, windows: Sequence[Window | None]) -> list[Whitening]:
    """Return the whitenings of the noise at ``z``; what the data leave out stays left out."""
    grids = grids_of(data.model, data.manoeuvres, data.recorded, data.step)
    whitenings = whiten(
        data.model,
        data.recorded,
        grids,
        data.manoeuvres,
        posterior.unknowns,
        posterior.structure,
        posterior.numbers,
        z,
        windows,
    )
    return _without(whitenings, data.left_out)


def _without(whitenings: Sequence[Whitening], masks: Sequence[NDArray[np.bool_]]) -> list[Whitening]:
    return [
        whitening.without(mask) if mask.any() else whitening for whitening, mask in zip(whitenings, masks, strict=True)
    ]


def _renoised(data: Data, whitenings: Sequence[Whitening]) -> Data:
    return replace(data, whitenings=tuple(whitenings), arrays=with_whitenings(data.arrays, whitenings))
