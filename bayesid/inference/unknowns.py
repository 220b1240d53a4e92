"""Unknowns of an identification, as one vector of coordinates whose prior is standard normal.

Bodies have log-Cholesky coordinates ``theta`` relative to the prior's centre (`bayesid.robot.log_cholesky`), of which
every value is a physical body. Independent bodies have ``theta = spread z`` each; bodies that the prior correlates, as
the posterior of an earlier study does, have ``theta = mixing z`` all together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import jax
import numpy as np
from jax import Array

from bayesid._math.arrays import Floats
from bayesid._math.kept_jit import kept_jit
from bayesid._math.on_device import on_device
from bayesid.inference.layout import EffectLayout, Layout, PriorNumbers
from bayesid.robot.body_prior import BodyPrior, Mixing, coordinates_of
from bayesid.robot.inertial_parameters import PARAMETERS, InertialParameters
from bayesid.robot.log_cholesky import LOG_CHOLESKY, SLOPE, upper_cholesky
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.simulator import Values

__all__ = ["Unknowns"]

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
    """

    bodies: tuple[BodyPrior, ...]
    effects: tuple[Effect, ...]
    recordings: int
    rate_sigma: float
    tilt_sigma: tuple[float, ...]
    mixing: Mixing | None = None
    speed_sigma: tuple[tuple[float, ...], ...] = ()
    joints: tuple[str, ...] = ()

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
        """Return the coordinates of given bodies and initial rates (R, 3), with all others at the prior's centre."""
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
