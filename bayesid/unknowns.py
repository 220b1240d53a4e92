"""The unknowns of an identification: one vector of coordinates whose prior is standard normal.

Inertial parameters are log-Cholesky coordinates relative to the prior's centre: ``J = U0 U(spread z) U(spread z)' U0'``
with ``U0`` the factor of the given pseudo-inertia, so that every value of z is a physical body.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid.arrays import Floats
from bayesid.effects.base import Effect
from bayesid.errors import InputError
from bayesid.inertia import (
    LOG_CHOLESKY,
    InertialParameters,
    log_cholesky_factor,
    log_cholesky_vector,
    upper_cholesky,
)

__all__ = ["BodyPrior", "Unknowns", "Values", "draw_inertial"]


@dataclass(frozen=True)
class BodyPrior:
    """Prior of one body's inertial parameters.

    Parameters
    ----------
    name : str
        Link or load.
    centre : InertialParameters
    spread : float
        Standard deviation of each log-Cholesky coordinate relative to the centre's pseudo-inertia. The mass is then
        log-normal with twice that relative width.
    nuisance : bool
        Whether the body is marginalised only because it is not known exactly.
    """

    name: str
    centre: InertialParameters
    spread: float
    nuisance: bool = False

    def __post_init__(self) -> None:
        if not self.spread > 0.0:
            raise InputError(
                f"spread {self.spread:g} of {self.name} is not positive", remedy="Give the prior's relative width"
            )
        if not self.centre.is_extended:
            raise InputError(
                f"the prior of {self.name} centres on a body without extent (mass {self.centre.mass:g} kg)",
                place=f"link {self.name}",
                remedy="Give mass and inertia of a body with volume, or leave it out of the unknowns",
            )


class Values(NamedTuple):
    """Physical values of the unknowns.

    inertial (10 bodies,) linear parameters body after body; rate (R, 3) initial rates; tilt (R, 3) small rotation
    of the initial attitude, base axes; effects: per effect (n,) or, per recording, (R, n).
    """

    inertial: Array
    rate: Array
    tilt: Array
    effects: tuple[Array, ...]


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
    """

    bodies: tuple[BodyPrior, ...]
    effects: tuple[Effect, ...]
    recordings: int
    rate_sigma: float
    tilt_sigma: tuple[float, ...]

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

        inertial = [_inertial(body, take(10)) for body in self.bodies]
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
        bodies = [_relative(body, z[start : start + 10]) for start, body in self._starts]
        return jnp.concatenate([*bodies, z[10 * len(self.bodies) :]])

    def from_linear(self, y: Array) -> Array:
        """Inverse of `to_linear`; not a number where no physical body has these coordinates."""
        bodies = [_absolute(body, y[start : start + 10]) for start, body in self._starts]
        return jnp.concatenate([*bodies, y[10 * len(self.bodies) :]])

    def log_volume(self, z: Array) -> Array:
        """Logarithm of the determinant of d to_linear / d z."""
        return sum((_log_volume(body, z[start : start + 10]) for start, body in self._starts), jnp.zeros(()))

    @property
    def _starts(self) -> list[tuple[int, BodyPrior]]:
        return [(10 * index, body) for index, body in enumerate(self.bodies)]

    def coordinates(self, inertials: Sequence[InertialParameters], rate: Floats | None = None) -> Floats:
        """Coordinates of given bodies and initial rates, everything else at its prior mean."""
        z = np.zeros(self.size)
        for index, (body, inertial) in enumerate(zip(self.bodies, inertials, strict=True)):
            z[10 * index : 10 * index + 10] = coordinates_of(body, inertial)
        if rate is not None and self._rates:
            first = 10 * len(self.bodies)
            z[first : first + 3 * self.recordings] = (rate / self.rate_sigma).ravel()
        return z


def _inertial(body: BodyPrior, z: Array) -> Array:
    return log_cholesky_vector(body.centre, body.spread * z)


_ROW, _COLUMN = np.triu_indices(4)


def _relative(body: BodyPrior, z: Array) -> Array:
    factor = log_cholesky_factor(body.spread * z)
    return ((factor @ factor.T) - jnp.eye(4))[_ROW, _COLUMN] / body.spread


def _absolute(body: BodyPrior, y: Array) -> Array:
    upper = jnp.zeros((4, 4)).at[_ROW, _COLUMN].set(body.spread * y)
    matrix = jnp.eye(4) + upper + upper.T - jnp.diag(jnp.diag(upper))
    u = _upper_factor(matrix)
    unit = u / u[3, 3]
    d = jnp.log(jnp.diag(unit)[:3])
    rest = jnp.stack([unit[0, 1], unit[1, 2], unit[0, 2], unit[0, 3], unit[1, 3], unit[2, 3]])
    return jnp.concatenate([jnp.log(u[3, 3])[None], d, rest]) / body.spread


def _upper_factor(matrix: Array) -> Array:
    """Upper-triangular U with ``U U' = matrix`` (4, 4), not a number where there is none.

    Written out: thousands of factorisations of this size in one call to LAPACK can block the processor's threads.
    """
    u = [[jnp.zeros(()) for _ in range(4)] for _ in range(4)]
    for k in (3, 2, 1, 0):
        u[k][k] = jnp.sqrt(matrix[k, k] - sum(u[k][j] ** 2 for j in range(k + 1, 4)))
        for i in range(k):
            u[i][k] = (matrix[i, k] - sum(u[i][j] * u[k][j] for j in range(k + 1, 4))) / u[k][k]
    return jnp.stack([jnp.stack(row) for row in u])


def _log_volume(body: BodyPrior, z: Array) -> Array:
    # |d(U U')/dU| = 2^4 prod u_ii^i for upper-triangular U, times |dU/dtheta| = u_11 u_22 u_33 u_44 u_44^6
    alpha, d = body.spread * z[0], body.spread * z[1:4]
    logs = jnp.concatenate([alpha + d, alpha[None]])
    return 4.0 * jnp.log(2.0) + (jnp.arange(1.0, 5.0) @ logs) + logs.sum() + 6.0 * alpha


def coordinates_of(body: BodyPrior, inertial: InertialParameters) -> Floats:
    """Standard-normal coordinates of a body under its prior, shape (10,)."""
    relative = np.linalg.solve(upper_cholesky(body.centre.pseudo_inertia), upper_cholesky(inertial.pseudo_inertia))
    alpha = np.log(relative[3, 3])
    u = relative / relative[3, 3]
    d = np.log(np.diag(u)[:3])
    return np.array([alpha, *d, u[0, 1], u[1, 2], u[0, 2], u[0, 3], u[1, 3], u[2, 3]]) / body.spread


def draw_inertial(centre: InertialParameters, spread: float, rng: np.random.Generator) -> InertialParameters:
    """Draw a body from the log-Cholesky prior about a centre."""
    vector = _inertial(BodyPrior("link", centre, spread), jnp.asarray(rng.normal(size=10)))
    return InertialParameters.from_vector(np.asarray(vector))
