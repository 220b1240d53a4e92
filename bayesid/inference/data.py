"""Data of a likelihood: the samples of all recordings, their time grids and the whitening of their noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from bayesid._math.arrays import Floats
from bayesid._math.on_device import on_device
from bayesid.inference.compiled import Arrays
from bayesid.inference.recorded_samples import RecordedSamples, Series
from bayesid.inference.whitening import Whitening
from bayesid.recording.actions import Actions
from bayesid.simulation.dynamics import Grid
from bayesid.simulation.instant import Readings
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import SensorKind
from bayesid.simulation.time_grid import build_grid, lengthened, pad_grids, rounded

__all__ = ["Data", "attitudes_of", "grids_of", "stacked", "with_whitenings"]


@dataclass(frozen=True)
class Data:
    """Samples of R recordings with the noise that is assumed for them; immutable.

    Parameters
    ----------
    model : Model
        Model whose sensors made the recordings.
    manoeuvres : (R,) tuple of Manoeuvre
        Recorded manoeuvres.
    recorded : (R,) tuple of RecordedSamples
        Samples of each recording.
    whitenings : (R,) tuple of Whitening
        Whitening of each recording.
    left_out : (R,) tuple of (O, C) arrays of bool
        Masks of the whitened scalars that the likelihood leaves out.
    step : float
        Longest integration step [s].
    arrays : Arrays
        The same data in the form that compiled code takes.
    """

    model: Model
    manoeuvres: tuple[Manoeuvre, ...]
    recorded: tuple[RecordedSamples, ...]
    whitenings: tuple[Whitening, ...]
    left_out: tuple[NDArray[np.bool_], ...]
    step: float
    arrays: Arrays

    @property
    def samples(self) -> int:
        """Number of scalar samples that the likelihood uses."""
        return sum(item.samples for item in self.whitenings)

    @property
    def residual_shape(self) -> tuple[int, int, int]:
        """Shape (R, O, C) of the whitened residual."""
        return (len(self.manoeuvres), self.arrays.start.shape[1], self.arrays.weights.shape[2])

    def times(self, index: int) -> Floats:
        """Return the times at which any sensor of a recording was sampled, shape (T,) [s]."""
        return self.recorded[index].time

    def measured(self, index: int, kind: SensorKind) -> Series:
        """Return the recorded times and values of one sensor in one recording."""
        return self.recorded[index].series[kind]

    def torques(self, index: int) -> Series:
        """Return the recorded times (n,) and joint torques (n, joints) of one recording."""
        return self.recorded[index].torque

    def sigma(self, index: int, kind: SensorKind) -> Floats:
        """Return the standard deviations of the white noise of one sensor in one recording, shape (size,)."""
        return self.recorded[index].sigma(kind)

    def left_out_times(self, index: int) -> dict[SensorKind, Floats]:
        """Return, for each sensor, the times of the samples that the likelihood leaves out of one recording [s]."""
        mask, rows = self.left_out[index], self.whitenings[index].rows
        result = {}
        for kind in self.model.channels.kinds:
            gone = mask[:, self.model.channels.of(kind)].any(axis=1)
            if gone.any():
                result[kind] = self.recorded[index].time[rows[gone]]
        return result


def grids_of(
    model: Model, manoeuvres: Sequence[Manoeuvre], recorded: Sequence[RecordedSamples], step: float
) -> list[Grid]:
    """Return the grid of integration nodes and samples of every recording, for an integration step [s]."""
    grids = []
    for index, (manoeuvre, samples) in enumerate(zip(manoeuvres, recorded, strict=True)):
        effects = [effect.in_recording(index) for effect in model.effects]
        grids.append(
            build_grid(
                model.robot,
                tuple(prior.name for prior in model.priors),
                manoeuvre.motion,
                samples.time,
                step,
                orbit=model.orbit,
                argument_of_latitude=manoeuvre.argument_of_latitude,
                actions=Actions.from_recording(manoeuvre.recording),
                effects=effects,
                torques=model.torque is not None,
                speed_errors=model.has_speed_errors,
                jumps=[instant for effect in effects for instant in effect.jumps(float(samples.time[-1]))],
            )
        )
    return grids


def attitudes_of(manoeuvres: Sequence[Manoeuvre]) -> Floats:
    """Return the attitudes of the base at time 0 as quaternions x, y, z, w, shape (R, 4)."""
    return np.stack([np.asarray(manoeuvre.attitude, dtype=float) for manoeuvre in manoeuvres])


def stacked(
    model: Model,
    manoeuvres: Sequence[Manoeuvre],
    recorded: Sequence[RecordedSamples],
    grids: Sequence[Grid],
    whitenings: Sequence[Whitening],
) -> Arrays:
    """Stack all recordings, padded coarsely so that recordings of about the same length share compiled code."""
    steps, samples = max(len(grid.step) for grid in grids), max(len(grid.step_of) for grid in grids)
    grid = pad_grids(grids, rounded(steps), rounded(samples))
    count = grid.step_of.shape[1]

    def padded(values: Sequence[Floats]) -> jnp.ndarray:
        return on_device(np.stack([lengthened(item, count) for item in values]))

    measured = Readings(
        padded([item.time for item in recorded]),
        {kind.value: padded([item.gridded(kind) for item in recorded]) for kind in model.channels.kinds},
        padded([item.gridded_torque for item in recorded]),
    )
    offset = on_device(np.zeros((len(recorded), count, model.channels.count)))
    none = on_device(np.zeros(0))
    return with_whitenings(Arrays(grid, on_device(attitudes_of(manoeuvres)), measured, offset, none, none), whitenings)


def with_whitenings(arrays: Arrays, whitenings: Sequence[Whitening]) -> Arrays:
    """Return the arrays with another whitening."""
    outputs = rounded(max(len(item.start) for item in whitenings))
    width = max(item.weights.shape[2] for item in whitenings)
    channels = whitenings[0].weights.shape[1]
    weights = np.zeros((len(whitenings), outputs, channels, width, channels))
    start = np.zeros((len(whitenings), outputs), dtype=np.int32)
    for row, item in enumerate(whitenings):
        weights[row, : len(item.start), :, : item.weights.shape[2]] = item.weights
        start[row, : len(item.start)] = item.start
    return arrays._replace(weights=on_device(weights), start=on_device(start))
