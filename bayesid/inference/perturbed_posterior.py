"""Simulation, residual and derivatives of a posterior whose data may be perturbed from outside its model.

Responses to small perturbations follow from the linear time-varying motion about a fit. The state of the composite body
is small, so that the derivatives of every integration step fit into a few small matrices. They are computed once per
fit; a perturbation then costs a few products with them, a small part of what it costs to differentiate the simulation
along it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import jax
import numpy as np

from bayesid._math.arrays import Floats
from bayesid._math.device import device
from bayesid._math.on_device import on_device
from bayesid._math.resampling import hermite_weights
from bayesid._math.runge_kutta import STAGE_TIMES, TABLEAU
from bayesid.inference import compiled
from bayesid.inference.compiled import Arrays, Numbers, Perturbation, Structure, Traced, perturbed
from bayesid.inference.posterior import COPIES, Posterior
from bayesid.inference.unknowns import part_of_prior
from bayesid.robot.composite_tables import WIDTH
from bayesid.simulation.dynamics import LinearMotion
from bayesid.simulation.time_grid import Grid

__all__ = ["Arrays", "LinearResponses", "Perturbation", "Traced", "jacobian_of", "perturbed", "residual_of", "trace"]


def trace(posterior: Posterior, z: Floats, arrays: Arrays) -> Traced:
    """Return the simulated motion, readings and residual at ``z`` for arrays that may be `perturbed`.

    Parameters
    ----------
    posterior : Posterior
    z : (size,) array
        Coordinates.
    arrays : Arrays
        Data, which may be `perturbed`.
    """
    return compiled.traced(posterior.structure, posterior.numbers, on_device(z), arrays)


def residual_of(posterior: Posterior, z: Floats, arrays: Arrays) -> Floats:
    """Return the whitened residual (R, O, C) at ``z`` for arrays that may be `perturbed`.

    Parameters
    ----------
    posterior : Posterior
    z : (size,) array
        Coordinates.
    arrays : Arrays
        Data, which may be `perturbed`.
    """
    return np.asarray(compiled.residuals(posterior.structure, posterior.numbers, on_device(z), arrays))


def jacobian_of(posterior: Posterior, z: Floats, arrays: Arrays) -> Floats:
    """Return the derivatives of the whitened residual in ``z``, (R, O, C, size), for arrays that may be `perturbed`.

    Parameters
    ----------
    posterior : Posterior
    z : (size,) array
        Coordinates.
    arrays : Arrays
        Data, which may be `perturbed`.
    """
    slopes = compiled.jacobian(posterior.structure, posterior.numbers, on_device(z), arrays)
    return np.moveaxis(np.asarray(slopes), 0, -1)


BATCH, FEWEST = 32, 8
"""Largest and smallest number of perturbations that a processor treats together."""

CACHED = 8e6
"""Memory of what is between perturbations and readings of one recording [bytes], which a processor keeps near."""


@dataclass(frozen=True)
class LinearResponses:
    """Responses about one point.

    Attributes
    ----------
    structure : Structure
        Without joint torques.
    numbers : Numbers
    z : (size,) array
        Coordinates.
    arrays : Arrays
        Data, which may be `perturbed`.
    motion : LinearMotion
        Derivatives of the simulation there, leading axis R.
    maps : StepMaps
        The same by whole steps.
    """

    structure: Structure
    numbers: Numbers
    z: Floats
    arrays: Arrays
    motion: LinearMotion
    maps: StepMaps

    @classmethod
    def about(cls, posterior: Posterior, z: Floats, arrays: Arrays) -> LinearResponses:
        """Linearise the simulation about coordinates and data.

        Parameters
        ----------
        posterior : Posterior
        z : (size,) array
            Coordinates.
        arrays : Arrays
            Data, which may be `perturbed`.
        """
        motion = compiled.linearised(posterior.structure, posterior.numbers, on_device(z), arrays)
        motion = jax.tree.map(np.asarray, motion)
        return cls(posterior.structure, posterior.numbers, z, arrays, motion, StepMaps.of(motion, arrays.grid))

    def part(self, recordings: Sequence[int]) -> LinearResponses:
        """Return the responses of some of the recordings, which are independent given the unknowns.

        Parameters
        ----------
        recordings : sequence of int
            Numbers of the recordings, in increasing order.
        """
        whole, rows = self.structure.layout, np.asarray(recordings)
        layout, coordinates = whole.part(recordings)
        arrays, motion, maps = jax.tree.map(lambda x: np.asarray(x)[rows], (self.arrays, self.motion, self.maps))
        numbers = self.numbers._replace(prior=part_of_prior(whole, self.numbers.prior, recordings))
        structure = replace(self.structure, layout=layout)
        return LinearResponses(structure, numbers, self.z[coordinates], jax.tree.map(on_device, arrays), motion, maps)

    def along(self, perturbations: Perturbation) -> Floats:
        """Return the derivatives of the whitened residual along n stacked perturbations, shape (n, R, O, C)."""
        return self.whitened(*self.changes(perturbations))

    def changes(self, perturbations: Perturbation) -> tuple[Floats, Floats]:
        """Return what n stacked perturbations change in the raw readings, (n, R, T, q), and beyond, (n, R, T, C)."""
        count = len(perturbations.reading)
        raw = np.zeros((count, *self.motion.reading.shape))
        if any(part.any() for part in perturbations[:4]):  # others are faults of sensors
            together = int(np.clip(CACHED / (8.0 * self.maps.between), FEWEST, BATCH))
            for recording in range(raw.shape[1]):
                for some in (slice(first, first + together) for first in range(0, count, together)):
                    given = (part[some, recording] for part in perturbations[:4])
                    raw[some, recording] = self._raw(recording, *given)
        return raw, perturbations.reading

    def whitened(self, raw: Floats, offset: Floats) -> Floats:
        """Return the derivatives of the whitened residual along such changes, shape (n, R, O, C).

        Parameters
        ----------
        raw : (n, R, T, q) array
        offset : (n, R, T, C) array
        """
        at = (self.structure, self.numbers, on_device(self.z), self.arrays)
        shape = (len(self.arrays.start), self.arrays.start.shape[1], self.arrays.weights.shape[2])
        parts = [np.zeros((0, *shape))]
        size = COPIES * 8.0 * (np.prod(raw.shape[1:]) + np.prod(offset.shape[1:]) + np.prod(shape))
        batch = device().batch(len(offset), size, BATCH)
        for first in range(0, len(offset), batch):
            given = [x[first : first + batch] for x in (raw, offset)]
            missing = batch - len(given[0])
            padded = [np.concatenate([x, np.zeros((missing, *x.shape[1:]))]) for x in given]
            parts.append(np.asarray(compiled.read_out(*at, self.motion.reading, *padded))[: batch - missing])
        return np.concatenate(parts)

    def _raw(
        self, recording: int, node_rows: Floats, sample_rows: Floats, node_wrench: Floats, sample_wrench: Floats
    ) -> Floats:
        """Return the derivatives of the raw readings of one recording, shape (n, T, q)."""
        motion, maps = (jax.tree.map(lambda x: x[recording], each) for each in (self.motion, self.maps))
        steps, count = maps.carried.shape[:2]
        forced: Floats = np.zeros((steps, len(node_rows), 3 * count))
        for place, inputs in enumerate(maps.forced):
            there = slice(place, place + 2 * steps - 1, 2)
            _add_changes(forced, inputs, node_rows[:, there], node_wrench[:, there])
        ends: Floats = np.empty((steps, len(node_rows), 4 * count))  # both states, and what is forced of both slopes
        ends[..., 2 * count :] = forced[..., count:]
        state: Floats = np.zeros((len(node_rows), count))
        _add_changes(state, motion.initial.T, node_rows[:, 0], node_wrench[:, 0])
        for k in range(steps):
            ends[k, :, :count] = state
            state = state @ maps.carried[k] + forced[k, :, :count]
            ends[k, :, count : 2 * count] = state
        readings = ends[np.asarray(self.arrays.grid.step_of)[recording]] @ maps.readings
        _add_changes(readings, np.swapaxes(motion.reading_input, -1, -2), sample_rows, sample_wrench)
        return np.swapaxes(readings, 0, 1)


class StepMaps(NamedTuple):
    """What the inputs and the state at the ends of a step do, with all stages of the step eliminated.

    Perturbations are rows here, so that they are multiplied from the right.

    Attributes
    ----------
    carried : (R, K, n, n) array
        From the state at the beginning of each step to that at its end.
    forced : tuple of three (R, K, 34, 3 n) arrays
        From the inputs at the beginning, middle and end of each step to the state at its end, and to the slopes at both
        ends, times the length of the step, where the state at the beginning is zero.
    readings : (R, T, 4 n, q) array
        From both states of the step of each sample, and what is forced of both slopes, to the raw readings.
    """

    carried: Floats
    forced: tuple[Floats, Floats, Floats]
    readings: Floats

    @property
    def between(self) -> int:
        """Size of all that is computed between one perturbation of a recording and its readings."""
        _, steps, _, inputs_of_ends = self.forced[0].shape
        _, samples, ends, _ = self.readings.shape
        return steps * (inputs_of_ends + ends) + samples * ends

    @classmethod
    def of(cls, motion: LinearMotion, grid: Grid) -> StepMaps:
        """Eliminate the stages.

        Parameters
        ----------
        motion : LinearMotion
            Leading axis R.
        grid : Grid
        """
        size, samples = np.asarray(grid.step)[..., None, None], np.asarray(grid.step_of)
        state, inputs = np.swapaxes(motion.state, -1, -2), np.swapaxes(motion.input, -1, -2)
        count = state.shape[-1]
        first, last, carried = _stages(state, size, np.eye(count), [np.zeros((1, 1))] * len(TABLEAU))
        forced = []
        for place in range(3):
            acting = [
                inputs[:, :, stage] if time == place else np.zeros((1, 1)) for stage, time in enumerate(STAGE_TIMES)
            ]
            slopes = _stages(state, size, np.zeros((1, count)), acting)
            whole = np.zeros((*inputs.shape[:2], inputs.shape[-2], 3 * count))
            for part, value in enumerate((slopes[2], size * slopes[0], size * slopes[1])):
                whole[..., part * count : (part + 1) * count] = value
            forced.append(whole)
        weights = hermite_weights(np.asarray(grid.fraction)[..., None, None])
        row = np.arange(len(samples))[:, None]
        left = weights[0] * np.eye(count) + weights[2] * (size * first)[row, samples]
        left = left + weights[3] * (size * last)[row, samples]
        ends = (left, *(weight * np.eye(count) for weight in weights[1:]))
        read = np.swapaxes(motion.reading_state, -1, -2)
        return cls(carried, (forced[0], forced[1], forced[2]), np.concatenate([end @ read for end in ends], axis=-2))


def _add_changes(changes: Floats, derivatives: Floats, rows: Floats, wrench: Floats) -> None:
    """Add what perturbations (n, ..., 28) and (n, ..., 6) change by derivatives (..., 34, m), to (..., n, m)."""
    for part, slopes in ((rows, derivatives[..., :WIDTH, :]), (wrench, derivatives[..., WIDTH:, :])):
        if part.any():  # most perturbations have one of them
            changes += np.moveaxis(part, 0, -2) @ slopes


def _stages(state: Floats, size: Floats, start: Floats, acting: Sequence[Floats]) -> tuple[Floats, Floats, Floats]:
    """Return the slopes at the first and last stage of each step, and the state at its end, rows of states.

    Parameters
    ----------
    state : (R, K, 5, n, n) array
        From the state at each stage to the slope there.
    size : (R, K, 1, 1) array
    start : (m, n) array
        State at the beginning of each step.
    acting : sequence of five (..., m, n) arrays
        What inputs add to the slope at each stage.
    """
    here = start
    slopes: list[Floats] = []
    for stage, weights in enumerate(TABLEAU):
        terms = (weight * slope for weight, slope in zip(weights, slopes, strict=False) if weight)
        here = start + size * sum(terms)
        slopes.append(here @ state[:, :, stage] + acting[stage])
    return slopes[0], slopes[-1], here
