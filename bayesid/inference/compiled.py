"""Compiled functions of a model given data, shared by all models and recordings that need the same operations.

The operations depend on a `Structure` alone, which is the key of the compiled code; all numbers of the prior, the
sensors, the effects and the recordings are arguments. Another width of the prior, other noise or another recording of
about the same length therefore needs no new compilation. Whitening is compiled by itself, since noise that is
correlated over more samples needs another window.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Floats, Traceable
from bayesid._math.kept_jit import kept_jit
from bayesid._math.on_device import on_device
from bayesid.inference import whitening
from bayesid.inference.unknowns import Layout, PriorNumbers
from bayesid.simulation.dynamics import Grid, LinearMotion
from bayesid.simulation.instant import Instant, Readings
from bayesid.simulation.simulator import ModelConstants, Simulator

__all__ = [
    "Arrays",
    "Averaging",
    "Numbers",
    "Perturbation",
    "Simulated",
    "Structure",
    "Traced",
    "chi2",
    "jacobian",
    "linearised",
    "perturbed",
    "read_out",
    "residuals",
    "simulated",
    "traced",
]


@dataclass(frozen=True)
class Structure:
    """Static part of a problem, which decides the operations that are compiled.

    Parameters
    ----------
    simulator : Simulator
        Forward model.
    layout : Layout
        Map from coordinates to physical values.
    """

    simulator: Simulator
    layout: Layout


class Numbers(NamedTuple):
    """Numbers of the model and of the prior, which compiled code takes as arguments."""

    model: ModelConstants
    prior: PriorNumbers


class Averaging(NamedTuple):
    """Means of the samples over B blocks of time, (R, B, 2, C): two samples of each column, and their weights."""

    sample: Traceable
    weight: Traceable


class Arrays(NamedTuple):
    """Arrays of R recordings, stacked and padded: T samples, C columns of `Channels`, O whitened blocks.

    Where readings are means over blocks of time, the samples are the instants from which the model predicts these.

    Attributes
    ----------
    grid : Grid
        Integration nodes and samples, each array with the leading axis R.
    attitude : (R, 4) array
        Quaternions x, y, z, w of the base at time 0.
    measured : Readings
        Measured readings of the sensors, each array of shape (R, T, ...).
    offset : (R, T, C) array
        Readings from outside the model, which are added to the prediction.
    weights : (R, O, C, width, C) array
        Weights of the whitening (`bayesid.inference.whitening.Whitening`).
    start : (R, O) array
        First row of the residual that enters each whitened block.
    averaging : Averaging, optional
        Means of the samples that are the rows of the residual, None where every sample is a row of its own.
    """

    grid: Grid
    attitude: Array
    measured: Readings
    offset: Array
    weights: Array
    start: Array
    averaging: Averaging | None = None


class Perturbation(NamedTuple):
    """Perturbation of what acts on the robot and its sensors from outside the model.

    There are R recordings, S integration nodes, T samples and C columns of `Channels`.

    Attributes
    ----------
    node_rows, sample_rows : (R, S, 28) and (R, T, 28) arrays
        Change of the rows of the kinematic tables.
    node_wrench, sample_wrench : (R, S, 6) and (R, T, 6) arrays
        Force and torque on the base about its origin, base axes [N, N m].
    reading : (R, T, C) array
        Change of the sensors' readings, sensor axes.
    """

    node_rows: Traceable
    sample_rows: Traceable
    node_wrench: Traceable
    sample_wrench: Traceable
    reading: Traceable


class Traced(NamedTuple):
    """Simulated motion at nodes (R, S) and samples (R, T), readings (R, T) and whitened residual (R, O, C)."""

    node: Instant
    sample: Instant
    readings: Readings
    residual: Array


def perturbed(arrays: Arrays, perturbation: Perturbation) -> Arrays:
    """Return the arrays with a perturbation added to the known tables, wrenches and readings.

    Parameters
    ----------
    arrays : Arrays
        Data.
    perturbation : Perturbation
    """

    def sum_of(one: Traceable, other: Floats) -> Array:
        return on_device(np.asarray(one) + other)  # JAX would compile the addition for each shape

    node, sample = arrays.grid.node, arrays.grid.sample
    grid = arrays.grid._replace(
        node=node._replace(
            known=sum_of(node.known, perturbation.node_rows),
            environment=node.environment._replace(
                wrench=sum_of(node.environment.wrench, perturbation.node_wrench),
            ),
        ),
        sample=sample._replace(
            known=sum_of(sample.known, perturbation.sample_rows),
            environment=sample.environment._replace(
                wrench=sum_of(sample.environment.wrench, perturbation.sample_wrench),
            ),
        ),
    )
    return arrays._replace(grid=grid, offset=sum_of(arrays.offset, perturbation.reading))


class Simulated(NamedTuple):
    """Predicted readings of the sensors (R, T, ...), and the attitude (R, T, 4) and rate (R, T, 3) of the base."""

    readings: Readings
    quaternion: Array
    rate: Array


@kept_jit(static=1)
def simulated(structure: Structure, numbers: Numbers, z: Array, grid: Grid, attitude: Array) -> Simulated:
    """Simulate all recordings at the coordinates ``z`` (size,).

    Parameters
    ----------
    structure : Structure
    numbers : Numbers
    z : (size,) array
        Coordinates.
    grid : Grid
        Integration nodes and samples, leading axis R.
    attitude : (R, 4) array
        Attitudes at time 0, quaternions x, y, z, w.
    """
    values = structure.layout.values(numbers.prior, z)
    return Simulated(*structure.simulator.readings(numbers.model, values, grid, attitude))


def residuals(structure: Structure, numbers: Numbers, z: Array, arrays: Arrays) -> Array:
    """Return the whitened residual of all recordings, shape (R, O, C).

    Parameters
    ----------
    structure : Structure
    numbers : Numbers
    z : (size,) array
        Coordinates.
    arrays : Arrays
        Data, which may be `perturbed`.
    """
    return _whitened(arrays, _deviations(structure, numbers, z, _bare(arrays))[None])[0]


def jacobian(structure: Structure, numbers: Numbers, z: Array, arrays: Arrays) -> Floats:
    """Return the derivative of the whitened residual by forward-mode differentiation, shape (size, R, O, C).

    Parameters
    ----------
    structure : Structure
    numbers : Numbers
    z : (size,) array
        Coordinates.
    arrays : Arrays
        Data, which may be `perturbed`.
    """
    packed = _whitened(arrays, _slopes(structure, numbers, z, _bare(arrays)))
    return structure.layout.unpacked(np.asarray(packed))


@kept_jit(static=1)
def chi2(structure: Structure, numbers: Numbers, z: Array, arrays: Arrays) -> Array:
    """Return the chi-square of every recording at many points, shape (n, size) -> (n, R).

    Parameters
    ----------
    structure : Structure
    numbers : Numbers
    z : (n, size) array
        Coordinates.
    arrays : Arrays
        Data, which may be `perturbed`.
    """
    return jax.vmap(lambda z: jnp.sum(residuals(structure, numbers, z, arrays) ** 2, axis=(1, 2)))(z)


def traced(structure: Structure, numbers: Numbers, z: Array, arrays: Arrays) -> Traced:
    """Simulate all recordings and return the motion of the robot with the readings and the residual.

    Parameters
    ----------
    structure : Structure
    numbers : Numbers
    z : (size,) array
        Coordinates.
    arrays : Arrays
        Data, which may be `perturbed`.
    """
    node, sample, read, deviation = _traced(structure, numbers, z, _bare(arrays))
    return Traced(node, sample, read, _whitened(arrays, deviation[None])[0])


def linearised(structure: Structure, numbers: Numbers, z: Array, arrays: Arrays) -> LinearMotion:
    """Linearise the simulation of all recordings in what may act from outside the model, leading axis R.

    Parameters
    ----------
    structure : Structure
    numbers : Numbers
    z : (size,) array
        Coordinates.
    arrays : Arrays
        Data, which may be `perturbed`.
    """
    return _linearised(structure, numbers, z, _bare(arrays))


@kept_jit(static=1)
def _linearised(structure: Structure, numbers: Numbers, z: Array, arrays: Arrays) -> LinearMotion:
    values = structure.layout.values(numbers.prior, z)
    return structure.simulator.linearise(numbers.model, values, arrays.grid, arrays.attitude)


def read_out(
    structure: Structure,
    numbers: Numbers,
    z: Array,
    arrays: Arrays,
    raw: Traceable,
    along: Traceable,
    offset: Traceable,
) -> Array:
    """Return the derivatives of the whitened residual along n changes of the readings, shape (n, R, O, C).

    Parameters
    ----------
    structure, numbers, z, arrays
    raw : (R, T, q) array
        Readings of sensors without a fault.
    along : (n, R, T, q) array
        Changes of them.
    offset : (n, R, T, C) array
        Changes of the faulty readings.
    """
    changes = _read_out(structure, numbers, z, _bare(arrays), raw, along, offset)
    return _whitened(arrays, changes)


@kept_jit(static=1)
def _read_out(
    structure: Structure, numbers: Numbers, z: Array, arrays: Arrays, raw: Array, along: Array, offset: Array
) -> Array:
    values = structure.layout.values(numbers.prior, z)

    def deviation(raw: Array, offset: Array) -> Array:
        read = structure.simulator.faulty(numbers.model, values, arrays.grid, raw)
        return structure.simulator.residual(read, arrays.measured) - (arrays.offset + offset)

    at = (raw, jnp.zeros_like(arrays.offset))
    return jax.vmap(lambda *one: jax.jvp(deviation, at, one)[1])(along, offset)


@kept_jit(static=1)
def _deviations(structure: Structure, numbers: Numbers, z: Array, arrays: Arrays) -> Array:
    """Return measured minus predicted readings, shape (R, T, C)."""
    read = simulated(structure, numbers, z, arrays.grid, arrays.attitude).readings
    return structure.simulator.residual(read, arrays.measured) - arrays.offset


@kept_jit(static=1)
def _slopes(structure: Structure, numbers: Numbers, z: Array, arrays: Arrays) -> Array:
    """Return the derivatives of the deviations in packed columns (`Layout.packed`), shape (columns, R, T, C)."""
    column = structure.layout.packed
    steps = jnp.zeros(column.max(initial=-1) + 1)
    return jnp.moveaxis(jax.jacfwd(lambda s: _deviations(structure, numbers, z + s[column], arrays))(steps), -1, 0)


@kept_jit(static=1)
def _traced(
    structure: Structure, numbers: Numbers, z: Array, arrays: Arrays
) -> tuple[Instant, Instant, Readings, Array]:
    values = structure.layout.values(numbers.prior, z)
    node, sample, read = structure.simulator.trace(numbers.model, values, arrays.grid, arrays.attitude)
    return node, sample, read, structure.simulator.residual(read, arrays.measured) - arrays.offset


def _whitened(arrays: Arrays, deviations: Array) -> Array:
    """Average and whiten n deviations of all recordings, shape (n, R, T, C) -> (n, R, O, C)."""
    rows = deviations if arrays.averaging is None else _averaged(arrays.averaging, deviations)
    return _banded(arrays.weights, arrays.start, rows)


@kept_jit()
def _averaged(averaging: Averaging, deviations: Array) -> Array:
    """Return means of n deviations over blocks of time, (n, R, T, C) -> (n, R, B, C)."""
    first, second = (
        jax.vmap(lambda one, at=averaging.sample[:, :, side]: jnp.take_along_axis(one, at, 1))(deviations)
        for side in (0, 1)
    )
    return averaging.weight[:, :, 0] * first + averaging.weight[:, :, 1] * second


@kept_jit()
def _banded(weights: Array, start: Array, deviations: Array) -> Array:
    """Whiten the rows of n deviations, shape (n, R, T, C) -> (n, R, O, C)."""
    padded = jnp.pad(deviations, ((0, 0), (0, 0), (0, weights.shape[3]), (0, 0)))
    return jax.vmap(jax.vmap(whitening.apply), in_axes=(None, None, 0))(weights, start, padded)


def _bare(arrays: Arrays) -> Arrays:
    """Return the arrays without averaging and whitening, on which the simulation does not depend."""
    return arrays._replace(weights=_NONE, start=_NONE, averaging=None)


_NONE: Any = np.zeros(0)
