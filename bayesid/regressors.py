"""Equations of motion as numbers times inertial parameters."""

from __future__ import annotations

import jax
import jax.numpy as jnp
from jax import Array

from bayesid.tables import ENTRIES

__all__ = ["balance_regressor"]


def balance_regressor(tables: Array, rate: Array, rate_change: Array, acceleration: Array) -> Array:
    """Regressor of the base's force balance, the paper's (19): force and torque about the base origin, base axes.

    Parameters
    ----------
    tables : (T, 28, p) array
        Of the bodies, see `bayesid.tables`.
    rate, rate_change : (T, 3) arrays
        Angular velocity of the base and its derivative, base axes [rad/s, rad/s2].
    acceleration : (T, 3) array
        Of the base origin, non-gravitational, base axes [m/s2].

    Returns
    -------
    (T, 6, p) array
        What multiplies the p inertial parameters to give the wrench that moves the bodies so [N, N m]; summed over all
        bodies of the robot it is the external wrench. The gravity gradient is left out.
    """
    column = jax.vmap(_wrench, (1, None, None, None), 1)
    return jax.vmap(column)(tables, rate, rate_change, acceleration)


def _wrench(row: Array, rate: Array, rate_change: Array, acceleration: Array) -> Array:
    """Force and torque of one table row."""
    entry = {name: row[columns] for name, columns in ENTRIES.items()}
    first, flow = entry["first"], entry["first_rate"]
    inertia, inertia_rate = _trace_less(entry["second"]), _trace_less(entry["second_rate"])
    force = (
        entry["mass"] * acceleration
        + entry["first_acceleration"]
        + 2.0 * jnp.cross(rate, flow)
        + jnp.cross(rate_change, first)
        + jnp.cross(rate, jnp.cross(rate, first))
    )
    momentum = inertia @ rate + entry["spin"]
    torque = (
        inertia @ rate_change
        + inertia_rate @ rate
        + entry["spin_rate"]
        + jnp.cross(rate, momentum)
        + jnp.cross(first, acceleration)
    )
    return jnp.concatenate([force, torque])


def _trace_less(entries: Array) -> Array:
    """Inertia tensor of second moments xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = entries
    rows = [[yy + zz, -xy, -xz], [-xy, xx + zz, -yz], [-xz, -yz, xx + yy]]
    return jnp.stack([jnp.stack(row) for row in rows])
