"""Simulation, residual and derivatives of a posterior whose data may be perturbed from outside its model.

Responses to small perturbations follow from the linear time-varying motion about a fit. The state of the composite body
is small, so that the derivatives of every stage of every integration step fit into a few small matrices. They are
computed once per fit; a perturbation then costs a few products with them, about a quarter of what it costs to
differentiate the simulation along it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

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


BATCH = 32
"""Number of perturbations that a processor treats together."""


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
    """

    structure: Structure
    numbers: Numbers
    z: Floats
    arrays: Arrays
    motion: LinearMotion

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
        return cls(posterior.structure, posterior.numbers, z, arrays, jax.tree.map(np.asarray, motion))

    def part(self, recordings: Sequence[int]) -> LinearResponses:
        """Return the responses of some of the recordings, which are independent given the unknowns.

        Parameters
        ----------
        recordings : sequence of int
            Numbers of the recordings, in increasing order.
        """
        whole, rows = self.structure.layout, np.asarray(recordings)
        layout, coordinates = whole.part(recordings)
        arrays, motion = jax.tree.map(lambda x: np.asarray(x)[rows], (self.arrays, self.motion))
        numbers = self.numbers._replace(prior=part_of_prior(whole, self.numbers.prior, recordings))
        structure = replace(self.structure, layout=layout)
        return LinearResponses(structure, numbers, self.z[coordinates], jax.tree.map(on_device, arrays), motion)

    def along(self, perturbations: Perturbation) -> Floats:
        """Return the derivatives of the whitened residual along n stacked perturbations, shape (n, R, O, C)."""
        return self.whitened(*self.changes(perturbations))

    def changes(self, perturbations: Perturbation) -> tuple[Floats, Floats]:
        """Return what n stacked perturbations change in the raw readings, (n, R, T, q), and beyond, (n, R, T, C)."""
        batches = [
            self._raw(jax.tree.map(lambda x, i=first: x[i : i + BATCH], perturbations))
            for first in range(0, len(perturbations.reading), BATCH)
        ]
        return np.concatenate([np.zeros((0, *self.motion.reading.shape)), *batches]), perturbations.reading

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

    def _raw(self, perturbations: Perturbation) -> Floats:
        """Return the derivatives of the raw readings, shape (n, R, T, q)."""
        if not any(part.any() for part in perturbations[:4]):  # faults of sensors
            return np.zeros((len(perturbations.reading), *self.motion.reading.shape))
        grid, motion = self.arrays.grid, self.motion
        size, samples = np.asarray(grid.step)[..., None, None], np.asarray(grid.step_of)
        steps = size.shape[1]
        halves = [slice(time, time + 2 * steps - 1, 2) for time in STAGE_TIMES]
        forced = [
            _changed_by(
                motion.input[:, :, stage], perturbations.node_rows[:, :, half], perturbations.node_wrench[:, :, half]
            )
            for stage, half in enumerate(halves)
        ]
        slopes, moved = _stages(motion.state, size, forced)
        carried, turned = _stages(motion.state, size, None)
        state = _changed_by(motion.initial, perturbations.node_rows[:, :, 0], perturbations.node_wrench[:, :, 0])
        states = np.empty((steps + 1, *state.shape))
        for k in range(steps):
            states[k] = state
            state = state @ turned[:, k] + moved[:, k]
        states[steps] = state
        states = np.moveaxis(states, 0, 1)
        left, right = states[:, :-1], states[:, 1:]
        first, last = (size * (slopes[stage] + left @ carried[stage]) for stage in (0, -1))
        row = np.arange(len(samples))[:, None]
        fraction = np.asarray(grid.fraction)[..., None, None]
        there = np.zeros((*samples.shape, *states.shape[2:]))
        for part, weight in zip((left, right, first, last), hermite_weights(fraction), strict=True):
            at_samples = part[row, samples]
            there += np.multiply(at_samples, weight, out=at_samples)
        readings = there @ np.swapaxes(motion.reading_state, -1, -2)
        readings += _changed_by(motion.reading_input, perturbations.sample_rows, perturbations.sample_wrench)
        return np.moveaxis(readings, -2, 0)


def _changed_by(derivatives: Floats, rows: Floats, wrench: Floats) -> Floats:
    """Return what perturbations (n, ..., 28) and (n, ..., 6) change by derivatives (..., m, 34), (..., n, m)."""
    turned = np.swapaxes(derivatives, -1, -2)
    changed: Floats = np.zeros((*rows.shape[1:-1], len(rows), turned.shape[-1]))
    for part, slopes in ((rows, turned[..., :WIDTH, :]), (wrench, turned[..., WIDTH:, :])):
        if part.any():  # most perturbations have one of them
            changed += np.moveaxis(part, 0, -2) @ slopes
    return changed


def _stages(state: Floats, size: Floats, forced: list[Floats] | None) -> tuple[list[Floats], Floats]:
    """Return the slopes at the stages of each step, and the state at its end: (R, K, n, states), rows of states.

    They are those of forced slopes that start from zero, or without these of each unit state at the beginning.
    """
    turned = np.swapaxes(state, -1, -2)
    count = state.shape[-1]
    here = start = np.eye(count) if forced is None else np.zeros((1, count))
    slopes: list[Floats] = []
    for stage, weights in enumerate(TABLEAU):
        terms = (weight * slope for weight, slope in zip(weights, slopes, strict=False) if weight)
        here = start + size * sum(terms)
        slope = here @ turned[:, :, stage]
        slopes.append(slope if forced is None else slope + forced[stage])
    return slopes, here
