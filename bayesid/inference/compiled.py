"""Compiled functions of a model given data, shared by every model and every recording that does the same operations.

What decides the operations is a `Structure`, a key of the compiled code; all numbers, of the prior, the sensors, the
effects and the recordings, are arguments. So another width of the prior, another noise or another recording of about
the same length compiles nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax import Array

from bayesid._math.arrays import Traceable
from bayesid.inference import whitening
from bayesid.inference.layout import Layout, PriorNumbers
from bayesid.simulation.dynamics import Grid
from bayesid.simulation.effects.instant import Instant, Readings
from bayesid.simulation.simulator import ModelConstants, Simulator

__all__ = [
    "Arrays",
    "Numbers",
    "Perturbation",
    "Simulated",
    "Structure",
    "Traced",
    "chi2",
    "jacobian",
    "perturbed",
    "residuals",
    "responses",
    "simulated",
    "traced",
]


@dataclass(frozen=True)
class Structure:
    """What decides the operations: the forward model's and those of the map from coordinates to physical values."""

    simulator: Simulator
    layout: Layout


class Numbers(NamedTuple):
    """Numbers of the model and of the prior."""

    model: ModelConstants
    prior: PriorNumbers


class Arrays(NamedTuple):
    """Arrays of all recordings, stacked and padded, leading axis R; C columns of `Channels`, O whitened blocks.

    attitude (R, 4) at time 0; measured: what the sensors read, (R, T, ...); offset (R, T, C): what is added to the
    prediction from outside the model; weights (R, O, C, width, C) and start (R, O): the whitening.
    """

    grid: Grid
    attitude: Array
    measured: Readings
    offset: Array
    weights: Array
    start: Array


class Perturbation(NamedTuple):
    """A change of the unknowns and of what acts on the robot, from outside the model; leading axis R but for ``z``.

    z (size,); rows of the kinematic tables (R, S, 28) and (R, T, 28); wrench on the base (R, S, 6) and (R, T, 6); what
    the sensors read (R, T, C), sensor axes; S integration nodes, T samples.
    """

    z: Traceable
    node_rows: Traceable
    sample_rows: Traceable
    node_wrench: Traceable
    sample_wrench: Traceable
    reading: Traceable


class Traced(NamedTuple):
    """A simulation: motion at nodes (R, S) and samples (R, T), readings (R, T), whitened residual (R, O, C)."""

    node: Instant
    sample: Instant
    readings: Readings
    residual: Array


def perturbed(arrays: Arrays, perturbation: Perturbation) -> Arrays:
    """Return the arrays with a perturbation added to what is known."""
    node, sample = arrays.grid.node, arrays.grid.sample
    grid = arrays.grid._replace(
        node=node._replace(
            known=node.known + perturbation.node_rows,
            environment=node.environment._replace(wrench=node.environment.wrench + perturbation.node_wrench),
        ),
        sample=sample._replace(
            known=sample.known + perturbation.sample_rows,
            environment=sample.environment._replace(wrench=sample.environment.wrench + perturbation.sample_wrench),
        ),
    )
    return arrays._replace(grid=grid, offset=arrays.offset + perturbation.reading)


class Simulated(NamedTuple):
    """What the sensors should read, (R, T, ...), and the base's attitude (R, T, 4) and rate (R, T, 3), base axes."""

    readings: Readings
    quaternion: Array
    rate: Array


@partial(jax.jit, static_argnums=0)
def simulated(structure: Structure, numbers: Numbers, z: Array, grid: Grid, attitude: Array) -> Simulated:
    """Simulate all recordings."""
    values = structure.layout.values(numbers.prior, z)
    return Simulated(*structure.simulator.readings(numbers.model, values, grid, attitude))


@partial(jax.jit, static_argnums=0)
def residuals(structure: Structure, numbers: Numbers, z: Array, arrays: Arrays) -> Array:
    """Return the whitened residual, (R, O, C)."""
    return _whitened(structure, simulated(structure, numbers, z, arrays.grid, arrays.attitude).readings, arrays)


@partial(jax.jit, static_argnums=0)
def jacobian(structure: Structure, numbers: Numbers, z: Array, arrays: Arrays) -> Array:
    """Return the derivative of the whitened residual by forward-mode differentiation, (R, O, C, size)."""
    return jax.jacfwd(lambda z: residuals(structure, numbers, z, arrays))(z)


@partial(jax.jit, static_argnums=0)
def chi2(structure: Structure, numbers: Numbers, z: Array, arrays: Arrays) -> Array:
    """Return chi-square of every recording at many points, (n, size) -> (n, R)."""
    return jax.vmap(lambda z: jnp.sum(residuals(structure, numbers, z, arrays) ** 2, axis=(1, 2)))(z)


@partial(jax.jit, static_argnums=0)
def traced(structure: Structure, numbers: Numbers, z: Array, arrays: Arrays) -> Traced:
    """Return the motion behind a simulation."""
    values = structure.layout.values(numbers.prior, z)
    node, sample, read = structure.simulator.trace(numbers.model, values, arrays.grid, arrays.attitude)
    return Traced(node, sample, read, _whitened(structure, read, arrays))


@partial(jax.jit, static_argnums=0)
def responses(structure: Structure, numbers: Numbers, z: Array, arrays: Arrays, along: Perturbation) -> Array:
    """Return derivatives of the whitened residual along perturbations with leading axis n, (n, R, O, C)."""

    def shifted(z: Array, perturbation: Perturbation) -> Array:
        return residuals(structure, numbers, z, perturbed(arrays, perturbation))

    at = jax.tree.map(lambda x: jnp.zeros(x.shape[1:]), along)
    return jax.vmap(lambda one: jax.jvp(shifted, (z, at), (one.z, one))[1])(along)


def _whitened(structure: Structure, read: Readings, arrays: Arrays) -> Array:
    residual = structure.simulator.residual(read, arrays.measured) - arrays.offset
    padded = jnp.pad(residual, ((0, 0), (0, arrays.weights.shape[3]), (0, 0)))
    return jax.vmap(whitening.apply)(arrays.weights, arrays.start, padded)
