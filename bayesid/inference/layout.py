"""Layout of the vector of unknowns: the coordinates of each kind of unknown, and their map to physical values.

The layout decides the operations and is a key of compiled code; the numbers of the prior are arguments of that code, so
that another centre or width of the prior needs no new compilation.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Traceable
from bayesid.robot.inertial_parameters import PARAMETERS
from bayesid.robot.log_cholesky import absolute, log_volume, relative, vector_from_factor
from bayesid.simulation.effects.effect_parameters import Prior
from bayesid.simulation.simulator import Values

__all__ = ["EffectLayout", "Layout", "PriorNumbers"]


class EffectLayout(NamedTuple):
    """Layout of one effect.

    Attributes
    ----------
    priors : tuple of Prior
        Shape of the prior of each parameter.
    per_recording : bool
        Whether the parameters differ between recordings.
    is_body : bool
        Whether they are the log-Cholesky coordinates of a body.
    """

    priors: tuple[Prior, ...]
    per_recording: bool
    is_body: bool = False


class PriorNumbers(NamedTuple):
    """Centres and widths of the prior of B bodies, R recordings and J joints.

    Attributes
    ----------
    factor : (B, 4, 4) array
        Factors of the pseudo-inertias at the prior's centre (`upper_cholesky`).
    mixing, inverse_mixing : (10 B, 10 B) arrays
        Log-Cholesky coordinates per unit of z, and the inverse.
    slope, inverse_slope : (10 B, 10 B) arrays
        Entries of the relative pseudo-inertias per unit of the coordinates linear in them, and the inverse.
    rate : scalar array
        Standard deviation of the initial rates [rad/s].
    tilt : (K,) array
        Standard deviations of the K uncertain initial attitudes [rad].
    speed : (R, J) array
        Standard deviations of the joints' speeds at time 0 [rad/s or m/s].
    effects : tuple of pairs of (n,) arrays
        Mean and sigma of the prior of each parameter, by effect.
    """

    factor: Traceable
    mixing: Traceable
    inverse_mixing: Traceable
    slope: Traceable
    inverse_slope: Traceable
    rate: Traceable
    tilt: Traceable
    speed: Traceable
    effects: tuple[tuple[Traceable, Traceable], ...]


@dataclass(frozen=True)
class Layout:
    """Layout of the coordinates, in the order bodies, initial rates, initial attitudes, joint speeds, effects.

    Parameters
    ----------
    bodies, recordings : int
        Numbers of unknown bodies and of recordings.
    rates : bool
        Whether initial rates are unknown.
    tilts : tuple of int
        Recordings whose initial attitude is unknown.
    joints : int
        Number of joints whose speed at time 0 is uncertain; 0 where such errors do not matter.
    effects : tuple of EffectLayout
        Layout of every effect, with or without parameters.
    """

    bodies: int
    recordings: int
    rates: bool
    tilts: tuple[int, ...]
    joints: int
    effects: tuple[EffectLayout, ...]

    def body(self, index: int) -> slice:
        """Return the coordinates of one body."""
        return slice(PARAMETERS * index, PARAMETERS * (index + 1))

    @property
    def all_bodies(self) -> slice:
        """Coordinates of all bodies."""
        return slice(0, PARAMETERS * self.bodies)

    @property
    def all_rates(self) -> slice:
        """Coordinates of the initial rates, recording after recording."""
        first = self.all_bodies.stop
        return slice(first, first + (3 * self.recordings if self.rates else 0))

    @property
    def all_tilts(self) -> slice:
        """Coordinates of the unknown initial attitudes."""
        first = self.all_rates.stop
        return slice(first, first + 3 * len(self.tilts))

    @property
    def all_speeds(self) -> slice:
        """Coordinates of the joints' speeds at time 0, recording after recording."""
        first = self.all_tilts.stop
        return slice(first, first + self.recordings * self.joints)

    def effect(self, index: int) -> slice:
        """Return the coordinates of one effect, recording after recording where its parameters differ between them."""
        first = self.all_speeds.stop + sum(self._count(effect) for effect in self.effects[:index])
        return slice(first, first + self._count(self.effects[index]))

    @property
    def changed_bodies(self) -> tuple[tuple[int, slice], ...]:
        """Index and coordinates of each effect whose parameters are the log-Cholesky coordinates of a body."""
        return tuple((index, self.effect(index)) for index, effect in enumerate(self.effects) if effect.is_body)

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return self.all_speeds.stop + sum(self._count(effect) for effect in self.effects)

    def _count(self, effect: EffectLayout) -> int:
        return len(effect.priors) * (self.recordings if effect.per_recording else 1)

    # ---- maps, traced ----

    def values(self, numbers: PriorNumbers, z: Array) -> Values:
        """Return the physical values of standard-normal coordinates, shape (size,)."""
        vectors = jax.vmap(vector_from_factor)(numbers.factor, self._theta(numbers, z))
        rate = jnp.zeros((self.recordings, 3))
        if self.rates:
            rate = numbers.rate * z[self.all_rates].reshape(self.recordings, 3)
        tilt = jnp.zeros((self.recordings, 3))
        if self.tilts:
            small = numbers.tilt[:, None] * z[self.all_tilts].reshape(-1, 3)
            tilt = tilt.at[np.array(self.tilts)].set(small)
        speed = numbers.speed * z[self.all_speeds].reshape(self.recordings, self.joints)
        effects = []
        for index, (effect, (mean, sigma)) in enumerate(zip(self.effects, numbers.effects, strict=True)):
            count = len(effect.priors)
            part = z[self.effect(index)].reshape((self.recordings, count) if effect.per_recording else (count,))
            columns = [prior.physical(mean[k], sigma[k], part[..., k]) for k, prior in enumerate(effect.priors)]
            effects.append(jnp.stack(columns, axis=-1) if count else part)
        return Values(vectors.ravel(), rate, tilt, speed, tuple(effects))

    def to_linear(self, numbers: PriorNumbers, z: Array) -> Array:
        """Return the coordinates that are linear in the inertial parameters.

        They are the entries of each body's relative pseudo-inertia, less the identity, scaled so that near the centre
        they are z itself, and so for a body that an effect changes. All other unknowns keep their coordinates. The
        dynamics determines linear combinations of inertial parameters sharply up to a common factor, so that ridges of
        the posterior are straight here.
        """
        entries = jax.vmap(relative)(self._theta(numbers, z)).ravel()
        y = jnp.concatenate([numbers.inverse_slope @ entries, z[self.all_bodies.stop :]])
        for index, part in self.changed_bodies:
            sigma = numbers.effects[index][1]
            y = y.at[part].set(relative(sigma * z[part]) / sigma)
        return y

    def from_linear(self, numbers: PriorNumbers, y: Array) -> Array:
        """Return the inverse of `to_linear`, which is NaN where no physical body has these coordinates."""
        entries = numbers.slope @ y[self.all_bodies]
        theta = jax.vmap(absolute)(entries.reshape(self.bodies, PARAMETERS)).ravel()
        z = jnp.concatenate([numbers.inverse_mixing @ theta, y[self.all_bodies.stop :]])
        for index, part in self.changed_bodies:
            sigma = numbers.effects[index][1]
            z = z.at[part].set(absolute(sigma * y[part]) / sigma)
        return z

    def log_volume(self, numbers: PriorNumbers, z: Array) -> Array:
        """Return the logarithm of the determinant of d to_linear / d z."""
        changed = sum(log_volume(numbers.effects[index][1] * z[part]) for index, part in self.changed_bodies)
        return jax.vmap(log_volume)(self._theta(numbers, z)).sum() + changed

    def _theta(self, numbers: PriorNumbers, z: Array) -> Array:
        """Return the log-Cholesky coordinates of each body relative to its centre, shape (B, 10)."""
        return (numbers.mixing @ z[self.all_bodies]).reshape(self.bodies, PARAMETERS)
