"""The unknowns of an identification: one vector of coordinates whose prior is standard normal.

Inertial parameters are log-Cholesky coordinates relative to the prior's centre (`bayesid.robot.log_cholesky`), so that
every value is a physical body. They are ``theta = spread z`` body by body, or ``theta = mixing z`` for all bodies
together where the prior correlates them, as the posterior of an earlier study does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Floats
from bayesid.robot.body_prior import BodyPrior, Mixing, coordinates_of
from bayesid.robot.inertial_parameters import LOG_CHOLESKY, InertialParameters, log_cholesky_vector
from bayesid.robot.log_cholesky import SLOPE, absolute, log_volume, relative
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.simulator import Values

__all__ = ["Unknowns"]


@dataclass(frozen=True)
class Unknowns:
    """Layout of the vector of unknowns and its map to physical values.

    Parameters
    ----------
    bodies : sequence of BodyPrior
    effects : sequence of Effect
        All effects of the model, with or without parameters.
    recordings : int
    rate_sigma : float
        Prior standard deviation of the initial rate [rad/s]; 0 for exactly zero.
    tilt_sigma : (R,) tuple
        Of the initial attitude [rad]; 0 for exact.
    mixing : (10 B, 10 B) tuple of tuples, optional
        Lower-triangular factor of the joint prior covariance of the log-Cholesky coordinates of all B bodies; left out,
        they are independent, each with its body's spread.
    """

    bodies: tuple[BodyPrior, ...]
    effects: tuple[Effect, ...]
    recordings: int
    rate_sigma: float
    tilt_sigma: tuple[float, ...]
    mixing: Mixing | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """One name per coordinate."""
        names = [f"{body.name}.{key}" for body in self.bodies for key in LOG_CHOLESKY]
        names += [f"initial-rate[{i}].{axis}" for i in self._rates for axis in "xyz"]
        names += [f"initial-attitude[{i}].{axis}" for i in self._tilts for axis in "xyz"]
        for effect in self.effects:
            copies = (
                [f"{effect.label}[{i}]" for i in range(self.recordings)] if effect.per_recording else [effect.label]
            )
            names += [f"{copy}.{parameter.name}" for copy in copies for parameter in effect.parameters]
        return tuple(names)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return len(self.names)

    @property
    def _rates(self) -> range:
        return range(self.recordings if self.rate_sigma > 0.0 else 0)

    @property
    def _tilts(self) -> list[int]:
        return [index for index, sigma in enumerate(self.tilt_sigma) if sigma > 0.0]

    def values(self, z: Array) -> Values:
        """Map standard-normal coordinates, shape (size,), to physical values."""
        cursor = 0

        def take(*shape: int) -> Array:
            nonlocal cursor
            count = int(np.prod(shape))
            cursor += count
            return z[cursor - count : cursor].reshape(shape)

        thetas = self._theta(take(10 * len(self.bodies)))
        inertial = [log_cholesky_vector(body.centre, theta) for body, theta in zip(self.bodies, thetas, strict=True)]
        rate = jnp.zeros((self.recordings, 3))
        if self._rates:
            rate = self.rate_sigma * take(self.recordings, 3)
        tilt = jnp.zeros((self.recordings, 3))
        if self._tilts:
            rows = np.array(self._tilts)
            tilt = tilt.at[rows].set(np.array(self.tilt_sigma)[rows][:, None] * take(len(rows), 3))
        effects = []
        for effect in self.effects:
            count = len(effect.parameters)
            own = take(self.recordings, count) if effect.per_recording else take(count)
            columns = [parameter.value(own[..., k]) for k, parameter in enumerate(effect.parameters)]
            effects.append(jnp.stack(columns, axis=-1) if count else own)
        return Values(jnp.concatenate(inertial) if inertial else jnp.zeros(0), rate, tilt, tuple(effects))

    def to_linear(self, z: Array) -> Array:
        """Coordinates linear in the inertial parameters: entries of each relative pseudo-inertia, less the identity.

        Whatever else is unknown keeps its coordinates. What the dynamics determines sharply are linear combinations of
        inertial parameters up to a common factor, so ridges of the posterior are straight here.
        """
        count = 10 * len(self.bodies)
        entries = self._each(relative, self._theta(z[:count]))
        if self.mixing is None:
            scaled = entries / self._widths
        else:  # near the centre these are then z itself, up to SLOPE
            scaled = jnp.asarray(np.linalg.inv(self._mixed_slope)) @ entries
        return jnp.concatenate([scaled, z[count:]])

    def from_linear(self, y: Array) -> Array:
        """Inverse of `to_linear`; not a number where no physical body has these coordinates."""
        count = 10 * len(self.bodies)
        if self.mixing is None:
            entries = y[:count] * self._widths
            return jnp.concatenate([self._each(absolute, _split(entries)) / self._widths, y[count:]])
        entries = jnp.asarray(self._mixed_slope) @ y[:count]
        theta = self._each(absolute, _split(entries))
        return jnp.concatenate([jnp.asarray(np.linalg.inv(np.array(self.mixing))) @ theta, y[count:]])

    def log_volume(self, z: Array) -> Array:
        """Logarithm of the determinant of d to_linear / d z."""
        return sum((log_volume(theta) for theta in self._theta(z[: 10 * len(self.bodies)])), jnp.zeros(()))

    def _theta(self, z: Array) -> list[Array]:
        """Log-Cholesky coordinates of each body relative to its centre."""
        if self.mixing is None:
            return [body.spread * part for body, part in zip(self.bodies, _split(z), strict=True)]
        return _split(jnp.asarray(np.array(self.mixing)) @ z)

    @property
    def widths(self) -> Floats:
        """Log-Cholesky coordinates of all bodies per unit of z, shape (10 B, 10 B)."""
        return np.diag(self._widths) if self.mixing is None else np.array(self.mixing)

    def _each(self, function: Callable[[Array], Array], parts: Sequence[Array]) -> Array:
        return jnp.concatenate([function(part) for part in parts]) if parts else jnp.zeros(0)

    @property
    def _widths(self) -> Floats:
        return np.repeat([body.spread for body in self.bodies], 10)

    @property
    def _mixed_slope(self) -> Floats:
        """Map from linear coordinates to entries of the relative pseudo-inertias; of the determinant of the mixing."""
        slope = np.kron(np.eye(len(self.bodies)), SLOPE)
        return slope @ np.array(self.mixing) @ np.linalg.inv(slope)

    def coordinates(self, inertials: Sequence[InertialParameters], rate: Floats | None = None) -> Floats:
        """Coordinates of given bodies and initial rates, everything else at its prior mean."""
        z = np.zeros(self.size)
        for index, (body, inertial) in enumerate(zip(self.bodies, inertials, strict=True)):
            z[10 * index : 10 * index + 10] = coordinates_of(body, inertial)
        if self.mixing is not None:
            count = 10 * len(self.bodies)
            z[:count] = np.linalg.solve(np.array(self.mixing), z[:count] * self._widths)
        if rate is not None and self._rates:
            first = 10 * len(self.bodies)
            z[first : first + 3 * self.recordings] = (rate / self.rate_sigma).ravel()
        return z


def _split(z: Array) -> list[Array]:
    return [z[start : start + 10] for start in range(0, len(z), 10)]
