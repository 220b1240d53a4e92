"""Unknowns of an identification, as one vector of coordinates whose prior is standard normal.

Bodies have log-Cholesky coordinates ``theta`` relative to the prior's centre (`bayesid.robot.log_cholesky`), of which
every value is a physical body. Independent bodies have ``theta = spread z`` each; bodies that the prior correlates, as
the posterior of an earlier study does, have ``theta = mixing z`` all together. The layout of the vector decides the
operations and is a key of compiled code; the numbers of the prior are arguments of that code, so that another centre or
width of the prior needs no new compilation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Floats, Integers, Traceable
from bayesid._math.kept_jit import kept_jit
from bayesid._math.on_device import on_device
from bayesid.robot.body_prior import BodyPrior, Mixing, coordinates_of
from bayesid.robot.inertial_parameters import PARAMETERS, InertialParameters
from bayesid.robot.log_cholesky import (
    LOG_CHOLESKY,
    SLOPE,
    absolute,
    central,
    from_central,
    log_volume,
    log_volume_of_central,
    relative,
    upper_cholesky,
    vector_from_factor,
)
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import Prior
from bayesid.simulation.simulator import Values

__all__ = ["EffectLayout", "Layout", "PriorNumbers", "Unknowns", "part_of_prior"]

MAPPED = 256
"""Number of points that are mapped together, so that one compilation serves any number of points."""


@dataclass(frozen=True)
class Unknowns:
    """Unknowns with their prior, and the map from coordinates to physical values.

    Parameters
    ----------
    bodies : sequence of BodyPrior
        Priors of the unknown bodies.
    effects : sequence of Effect
        All effects of the model, with or without parameters.
    recordings : int
        Number of recordings.
    rate_sigma : float
        Prior standard deviation of the initial rate [rad/s]; 0 for a start at rest. The initial rate is the one that
        belongs to the joints as smoothed: an error of a smoothed joint speed at time 0 moves it, and its posterior
        leaves that out, unless such errors are unknowns themselves (``speed_sigma``).
    tilt_sigma : (R,) tuple
        Prior standard deviation of the initial attitude of each recording [rad]; 0 if it is exact.
    mixing : (10 B, 10 B) tuple of tuples, optional
        Lower-triangular factor of the joint prior covariance of the log-Cholesky coordinates of all B bodies, which by
        default are independent, each with the spread of its body.
    speed_sigma : (R,) tuple of (J,) tuples
        Standard deviation of the error of each joint's smoothed speed at time 0 [rad/s or m/s]; empty where the model
        has no such errors (`Model.has_speed_errors`).
    joints : (J,) tuple of str
        Names of the joints with such errors.
    rigid : bool
        Whether the robot has no joints, so that its motion determines centres of mass and not masses.
    """

    bodies: tuple[BodyPrior, ...]
    effects: tuple[Effect, ...]
    recordings: int
    rate_sigma: float
    tilt_sigma: tuple[float, ...]
    mixing: Mixing | None = None
    speed_sigma: tuple[tuple[float, ...], ...] = ()
    joints: tuple[str, ...] = ()
    rigid: bool = False

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of all coordinates."""
        recordings = range(self.recordings)
        names = [f"{body.name}.{key}" for body in self.bodies for key in LOG_CHOLESKY]
        names += [f"initial-rate[{i}].{axis}" for i in recordings if self.layout.rates for axis in "xyz"]
        names += [f"initial-attitude[{i}].{axis}" for i in self.layout.tilts for axis in "xyz"]
        names += [f"initial-speed[{i}].{joint}" for i in recordings for joint in self.joints]
        for effect in self.effects:
            copies = [f"{effect.label}[{i}]" for i in recordings] if effect.per_recording else [effect.label]
            names += [f"{copy}.{parameter.name}" for copy in copies for parameter in effect.parameters]
        return tuple(names)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.layout.size

    @cached_property
    def layout(self) -> Layout:
        """Layout of the coordinates."""
        return Layout(
            bodies=len(self.bodies),
            recordings=self.recordings,
            rates=self.rate_sigma > 0.0,
            tilts=tuple(index for index, sigma in enumerate(self.tilt_sigma) if sigma > 0.0),
            joints=len(self.joints),
            rigid=self.rigid,
            effects=tuple(
                EffectLayout(
                    tuple(parameter.prior for parameter in effect.parameters), effect.per_recording, effect.is_body
                )
                for effect in self.effects
            ),
        )

    @cached_property
    def numbers(self) -> PriorNumbers:
        """Centres and widths of the prior."""
        mixing = self.widths
        per_theta = np.kron(np.eye(len(self.bodies)), SLOPE)
        # for correlated bodies, a slope of the same determinant as the mixing
        slope = mixing if self.mixing is None else per_theta @ mixing @ np.linalg.inv(per_theta)
        factors = [upper_cholesky(body.centre.pseudo_inertia) for body in self.bodies]
        tilts = list(self.layout.tilts)
        return PriorNumbers(
            factor=np.array(factors).reshape(-1, 4, 4),
            mixing=mixing,
            inverse_mixing=np.linalg.inv(mixing),
            slope=slope,
            inverse_slope=np.linalg.inv(slope),
            rate=np.array(self.rate_sigma),
            tilt=np.array(self.tilt_sigma)[tilts],
            speed=np.array(self.speed_sigma).reshape(self.recordings, len(self.joints)),
            effects=tuple(
                (np.array([p.mean for p in effect.parameters]), np.array([p.sigma for p in effect.parameters]))
                for effect in self.effects
            ),
        )

    @property
    def widths(self) -> Floats:
        """Derivative of the log-Cholesky coordinates of all bodies by z, shape (10 B, 10 B)."""
        if self.mixing is None:
            return np.diag(np.repeat([body.spread for body in self.bodies], PARAMETERS))
        return np.array(self.mixing)

    # ---- maps ----

    def values(self, z: Array) -> Values:
        """Return the physical values of coordinates z (size,), in a function that JAX traces."""
        return self.layout.values(self.numbers, z)

    def values_at(self, z: Floats) -> Values:
        """Return the physical values at one point."""
        return jax.tree.map(lambda x: x[0], self.values_of(np.asarray(z)[None]))

    def values_of(self, z: Floats) -> Values:
        """Return the physical values at many points (n, size), each array with a leading axis n."""
        return self._mapped(_values, z)

    def inertials(self, z: Floats) -> list[InertialParameters]:
        """Return the inertial parameters of the bodies at one point."""
        vectors = self.values_at(z).inertial.reshape(-1, PARAMETERS)
        return [InertialParameters.from_vector(row) for row in vectors]

    def to_linear(self, z: Floats) -> Floats:
        """Return `Layout.to_linear` at many points, shape (n, size)."""
        return self._mapped(_to_linear, z)

    def from_linear(self, y: Floats) -> Floats:
        """Return `Layout.from_linear` at many points, shape (n, size)."""
        return self._mapped(_from_linear, y)

    def log_volume(self, z: Floats) -> Floats:
        """Return `Layout.log_volume` at many points, shape (n, size) -> (n,)."""
        return self._mapped(_log_volume, z)

    def linear_slope(self, z: Floats) -> Floats:
        """Return the Jacobian of `to_linear` at one point, shape (size, size)."""
        return np.asarray(_linear_slope(self.layout, self.numbers, on_device(z)))

    def inertial_slope(self, z: Floats) -> Floats:
        """Return the derivatives of the linear parameters of all bodies at one point, shape (10 B, size)."""
        return np.asarray(_inertial_slope(self.layout, self.numbers, on_device(z)))

    def coordinates(self, inertials: Sequence[InertialParameters], rate: Floats | None = None) -> Floats:
        """Return the coordinates of given bodies and initial rates (R, 3), with all others at the prior's centre.

        Parameters
        ----------
        inertials : sequence of InertialParameters
            One for each body.
        rate : (R, 3) array, optional
            Initial rates [rad/s].
        """
        z = np.zeros(self.size)
        theta = [
            body.spread * coordinates_of(body, inertial) for body, inertial in zip(self.bodies, inertials, strict=True)
        ]
        if theta:
            z[self.layout.all_bodies] = np.linalg.solve(self.widths, np.concatenate(theta))
        if rate is not None and self.layout.rates:
            z[self.layout.all_rates] = (rate / self.rate_sigma).ravel()
        return z

    def body_indices(self, *, nuisance: bool = False) -> list[int]:
        """Return the indices of the coordinates of the bodies to identify, with those of marginalised ones if asked."""
        slices = [self.layout.body(index) for index, body in enumerate(self.bodies) if nuisance or not body.nuisance]
        return [index for part in slices for index in range(part.start, part.stop)]

    def effect_indices(self, label: str) -> list[int]:
        """Return the indices of the coordinates of an effect, none where the model lacks it."""
        parts = [self.layout.effect(i) for i, effect in enumerate(self.effects) if effect.label == label]
        return [index for part in parts for index in range(part.start, part.stop)]

    def _mapped(self, function: Callable[..., Any], z: Floats) -> Any:
        """Apply a compiled function to the points in batches of one length, so that it is compiled once."""
        z = np.asarray(z)
        padded = np.concatenate([z, np.repeat(z[-1:], -len(z) % MAPPED, axis=0)])
        batches = [padded[i : i + MAPPED] for i in range(0, len(padded), MAPPED)]
        parts = [function(self.layout, self.numbers, batch) for batch in batches]
        return jax.tree.map(lambda *x: np.concatenate([np.asarray(part) for part in x])[: len(z)], *parts)


@kept_jit(static=1)
def _values(layout: Layout, numbers: PriorNumbers, z: Array) -> Values:
    return jax.vmap(partial(layout.values, numbers))(z)


@kept_jit(static=1)
def _to_linear(layout: Layout, numbers: PriorNumbers, z: Array) -> Array:
    return jax.vmap(partial(layout.to_linear, numbers))(z)


@kept_jit(static=1)
def _from_linear(layout: Layout, numbers: PriorNumbers, y: Array) -> Array:
    return jax.vmap(partial(layout.from_linear, numbers))(y)


@kept_jit(static=1)
def _log_volume(layout: Layout, numbers: PriorNumbers, z: Array) -> Array:
    return jax.vmap(partial(layout.log_volume, numbers))(z)


@kept_jit(static=1)
def _linear_slope(layout: Layout, numbers: PriorNumbers, z: Array) -> Array:
    return jax.jacfwd(partial(layout.to_linear, numbers))(z)


@kept_jit(static=1)
def _inertial_slope(layout: Layout, numbers: PriorNumbers, z: Array) -> Array:
    return jax.jacfwd(lambda z: layout.values(numbers, z).inertial)(z)


def part_of_prior(layout: Layout, numbers: PriorNumbers, recordings: Sequence[int]) -> PriorNumbers:
    """Return the numbers of the prior of some of the recordings.

    Parameters
    ----------
    layout : Layout
        Of all recordings.
    numbers : PriorNumbers
    recordings : sequence of int
        Numbers of the recordings, in increasing order.
    """
    tilts = [place for place, recording in enumerate(layout.tilts) if recording in recordings]
    return numbers._replace(tilt=np.asarray(numbers.tilt)[tilts], speed=np.asarray(numbers.speed)[list(recordings)])


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
    rigid : bool
        As for `Unknowns`.
    """

    bodies: int
    recordings: int
    rates: bool
    tilts: tuple[int, ...]
    joints: int
    effects: tuple[EffectLayout, ...]
    rigid: bool = False

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

    @cached_property
    def owner(self) -> Integers:
        """Recording in which each coordinate acts alone, -1 for those that act in all, shape (size,)."""
        owner, recordings = np.full(self.size, -1), np.arange(self.recordings)
        owner[self.all_rates] = np.repeat(recordings, 3)[: self.all_rates.stop - self.all_rates.start]
        owner[self.all_tilts] = np.repeat(self.tilts, 3)
        owner[self.all_speeds] = np.repeat(recordings, self.joints)
        for index, effect in enumerate(self.effects):
            if effect.per_recording:
                owner[self.effect(index)] = np.repeat(recordings, len(effect.priors))
        return owner

    @cached_property
    def packed(self) -> Integers:
        """Column of each coordinate where those that act alone in different recordings share columns, shape (size,).

        The derivatives of R recordings then take as many columns as those of one.
        """
        column = np.zeros(self.size, dtype=int)
        shared = np.flatnonzero(self.owner < 0)
        column[shared] = np.arange(len(shared))
        for recording in range(self.recordings):
            alone = np.flatnonzero(self.owner == recording)
            column[alone] = len(shared) + np.arange(len(alone))
        return column

    def part(self, recordings: Sequence[int]) -> tuple[Layout, Integers]:
        """Return the layout of some of the recordings, and the indices of its coordinates among these.

        Parameters
        ----------
        recordings : sequence of int
            Numbers of the recordings, in increasing order.
        """
        tilts = tuple(place for place, recording in enumerate(recordings) if recording in self.tilts)
        indices = np.flatnonzero((self.owner < 0) | np.isin(self.owner, recordings))
        return replace(self, recordings=len(recordings), tilts=tilts), indices

    def unpacked(self, packed: Floats) -> Floats:
        """Return derivatives in all coordinates, (size, R, ...), from those in packed columns, (columns, R, ...).

        Parameters
        ----------
        packed : (columns, R, ...) array
        """
        whole = np.zeros((self.size, *packed.shape[1:]))
        for place, (column, owner) in enumerate(zip(self.packed, self.owner, strict=True)):
            part = slice(None) if owner < 0 else owner
            whole[place, part] = packed[column, part]
        return whole

    def _count(self, effect: EffectLayout) -> int:
        return len(effect.priors) * (self.recordings if effect.per_recording else 1)

    # ---- maps, traced ----

    def values(self, numbers: PriorNumbers, z: Array) -> Values:
        """Return the physical values of standard-normal coordinates, shape (size,).

        Parameters
        ----------
        numbers : PriorNumbers
        z : (size,) array
            Coordinates.
        """
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
        """Return the coordinates in which ridges of the posterior are straight.

        They are the entries of each body's relative pseudo-inertia, less the identity, scaled so that near the centre
        they are z itself, and so for a body that an effect changes. All other unknowns keep their coordinates. The
        dynamics determines linear combinations of inertial parameters sharply up to a common factor. Where the robot
        has no joints, it determines centre of mass and inertia about it; then these and the log mass are coordinates.

        Parameters
        ----------
        numbers : PriorNumbers
        z : (size,) array
            Coordinates.
        """
        entries = jax.vmap(central if self.rigid else relative)(self._theta(numbers, z)).ravel()
        y = jnp.concatenate([numbers.inverse_slope @ entries, z[self.all_bodies.stop :]])
        for index, part in self.changed_bodies:
            sigma = numbers.effects[index][1]
            y = y.at[part].set(relative(sigma * z[part]) / sigma)
        return y

    def from_linear(self, numbers: PriorNumbers, y: Array) -> Array:
        """Return the inverse of `to_linear`, which is NaN where no physical body has these coordinates.

        Parameters
        ----------
        numbers : PriorNumbers
        y : (size,) array
            Linear coordinates.
        """
        entries = numbers.slope @ y[self.all_bodies]
        inverse = from_central if self.rigid else absolute
        theta = jax.vmap(inverse)(entries.reshape(self.bodies, PARAMETERS)).ravel()
        z = jnp.concatenate([numbers.inverse_mixing @ theta, y[self.all_bodies.stop :]])
        for index, part in self.changed_bodies:
            sigma = numbers.effects[index][1]
            z = z.at[part].set(absolute(sigma * y[part]) / sigma)
        return z

    def log_volume(self, numbers: PriorNumbers, z: Array) -> Array:
        """Return the logarithm of the determinant of d to_linear / d z.

        Parameters
        ----------
        numbers : PriorNumbers
        z : (size,) array
            Coordinates.
        """
        changed = sum(log_volume(numbers.effects[index][1] * z[part]) for index, part in self.changed_bodies)
        volume = log_volume_of_central if self.rigid else log_volume
        return jax.vmap(volume)(self._theta(numbers, z)).sum() + changed

    def _theta(self, numbers: PriorNumbers, z: Array) -> Array:
        """Return the log-Cholesky coordinates of each body relative to its centre, shape (B, 10)."""
        return (numbers.mixing @ z[self.all_bodies]).reshape(self.bodies, PARAMETERS)
