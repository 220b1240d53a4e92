"""One fit over many throws: what they share, with the unknowns of single throws eliminated.

Every throw has a posterior of its own (`bayesid.Posterior`). The joint posterior is their product with each shared
prior counted once. Its Gauss-Newton equations couple throws through the shared unknowns only, so that the unknowns of a
throw are eliminated throw by throw (Schur complement): the same mode and Laplace approximation as one large fit, at a
cost that grows linearly with the number of throws.

The values of the unexplained torque and force at their knots are independent and normal with one width per body. Given
the width, the posterior of every value has a mean and a variance; the width that raises the marginal likelihood is the
root mean square of the values under it (expectation-maximisation: Dempster, Laird and Rubin 1977). The ratio of new to
old width tends to one. The noise that quiet stretches show is a lower bound: what vibrates too fast for the knots is in
flight beside it. The residuals say how much more there is, axis by axis, with the samples that a throw's own unknowns
absorb counted out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesid import Posterior
from bayesid._math.arrays import Floats
from studies.throws.model import Smooth, is_calibration, is_fitted, is_local

ITERATIONS = 40
HALVINGS = 12
PRECISION = 1e-7  # relative fall of the cost at which the fit ends


@dataclass(frozen=True)
class Throw:
    """One throw of a body: its posterior, and a point to start from or that was found."""

    body: str
    posterior: Posterior
    z: Floats  # (size,)
    width: Floats  # (size,): factor on the prior standard deviation of each unknown of the throw's own
    noise: Floats  # (6,): factor on the noise of each axis of gyro and accelerometer

    def residuals(self, z: Floats) -> Floats:
        """Return the whitened residuals, shape (samples, 6)."""
        return self.posterior.residuals(z)[0, : self.posterior.whitenings[0].outputs.shape[0]] / self.noise

    def jacobian(self, z: Floats) -> Floats:
        """Return the derivative of the flattened residuals, shape (6 samples, size)."""
        samples = self.posterior.whitenings[0].outputs.shape[0]
        return self.posterior.jacobian(z)[: 6 * samples] / np.tile(self.noise, samples)[:, None]

    @property
    def name(self) -> str:
        """Name of the recording."""
        return self.posterior.manoeuvres[0].recording.name

    def shared(self) -> dict[str, int]:
        """Global names of the unknowns this throw shares, with their place in its own vector."""
        names = enumerate(self.posterior.unknowns.names)
        return {name if is_calibration(name) else f"{self.body}:{name}": i for i, name in names if not is_local(name)}


@dataclass(frozen=True)
class Joint:
    """Mode and Laplace approximation of a joint fit."""

    names: tuple[str, ...]  # of the free shared unknowns; those of a body are written ``body:name``
    value: Floats
    covariance: Floats  # (n, n): of the shared unknowns, all others marginalised
    throws: tuple[Throw, ...]  # with the unknowns found
    information: Floats  # (throws, n, n)
    pull: Floats  # (throws, n): each throw's own part of the normal equations at the mode, its own unknowns eliminated
    local_variance: tuple[Floats, ...]  # of each throw's free own unknowns, in the order of its posterior
    evidence: Floats  # (throws,): log density at the mode, each throw's own unknowns marginalised, up to its noise's
    fitted: Floats  # (throws, 6): number of samples of each axis that the throw's own unknowns absorb
    local: tuple[NDArray[np.intp], ...]  # which unknowns of each throw these are
    converged: bool

    def draw(self, count: int, rng: np.random.Generator) -> Floats:
        """Draw shared unknowns from the Laplace approximation, shape (count, n)."""
        factor = np.linalg.cholesky(self.covariance)
        return self.value + rng.normal(size=(count, len(self.value))) @ factor.T

    def without(self, index: int) -> Floats:
        """Shared unknowns, shape (n,), had one throw not been made, to first order."""
        precision = np.linalg.inv(self.covariance) - self.information[index]
        return self.value + np.linalg.solve(precision, self.pull[index])

    def left_out_scores(self) -> Floats:
        """Return the log density of each throw given the others, (throws,) [nats], to second order about the mode.

        A constant of each throw's noise is left out, which models that share the noise have in common.
        """
        hessian = np.linalg.inv(self.covariance)
        scores = []
        for information, pull, evidence in zip(self.information, self.pull, self.evidence, strict=True):
            others = hessian - information
            narrowed = np.linalg.slogdet(hessian)[1] - np.linalg.slogdet(others)[1]
            scores.append(evidence - 0.5 * (narrowed + pull @ np.linalg.solve(others, pull)))
        return np.array(scores)

    def body_coordinates(self, body: str, values: Floats) -> Floats:
        """Log-Cholesky coordinates of one body among shared unknowns (m, n): shape (m, 10)."""
        columns = [i for i, name in enumerate(self.names) if name.startswith(f"{body}:base_link.")]
        mass = next(throw.z[0] for throw in self.throws if throw.body == body)
        return np.column_stack([np.full(len(values), mass), values[:, columns]])


class _System:
    """Normal equations of many throws, and where the unknowns of each are in the vector of shared ones."""

    def __init__(self, throws: Sequence[Throw], free: Callable[[str], bool]) -> None:
        shared = [throw.shared() for throw in throws]
        self.throws = throws
        self.names = tuple(dict.fromkeys(name for names in shared for name in names if free(name)))
        place = {name: i for i, name in enumerate(self.names)}
        self.places = [np.array([place[name] for name in names if name in place]) for names in shared]
        self.columns = [np.array([i for name, i in names.items() if name in place]) for names in shared]
        self.local = [
            np.array([i for i, name in enumerate(throw.posterior.unknowns.names) if is_local(name) and free(name)])
            for throw in throws
        ]

    def with_shared(self, points: Sequence[Floats], value: Floats) -> list[Floats]:
        """Return the unknowns of each throw with others of the shared ones."""
        points = [z.copy() for z in points]
        for z, places, columns in zip(points, self.places, self.columns, strict=True):
            z[columns] = value[places]
        return points

    def cost(self, points: Sequence[Floats], value: Floats) -> float:
        """Return the sum of squares of residuals and coordinates."""
        total = float(value @ value)
        for throw, z, local in zip(self.throws, points, self.local, strict=True):
            total += float((throw.residuals(z) ** 2).sum() + ((z[local] / throw.width[local]) ** 2).sum())
        return total if np.isfinite(total) else np.inf

    def normal_equations(self, points: Sequence[Floats], value: Floats) -> tuple[list[_Block], Floats, Floats]:
        """Return the blocks of the throws, Hessian and gradient of the shared unknowns."""
        each = zip(self.throws, points, self.local, self.columns, strict=True)
        blocks = [_eliminate(throw, z, local, columns) for throw, z, local, columns in each]
        hessian, gradient = np.eye(len(value)), value.copy()
        for block, places in zip(blocks, self.places, strict=True):
            hessian[np.ix_(places, places)] += block.information
            gradient[places] += block.pull
        return blocks, hessian, gradient

    def search(
        self, points: list[Floats], value: Floats, blocks: Sequence[_Block], step: Floats, cost: float
    ) -> tuple[list[Floats], Floats, float]:
        """Halve the step until the cost falls; where it never does, stay."""
        for size in 0.5 ** np.arange(HALVINGS):
            trial = self.with_shared(points, value + size * step)
            for z, block, local, places in zip(trial, blocks, self.local, self.places, strict=True):
                z[local] += size * (block.local_step + block.local_response @ step[places])
            lower = self.cost(trial, value + size * step)
            if lower < cost:
                return trial, value + size * step, lower
        return points, value, cost


def maximise_jointly(throws: Sequence[Throw], free: Callable[[str], bool] = is_fitted) -> Joint:
    """Find the mode over all throws by Gauss-Newton steps with halving.

    Parameters
    ----------
    free : callable
        Which unknowns are fitted; the others stay where ``throws`` has them. Left out, all but the first
        log-Cholesky coordinate, which is the mass: the scales know it and torque-free motion does not tell it.
    """
    system = _System(throws, free)
    value: Floats = np.zeros(len(system.names))
    for throw, places, columns in zip(throws, system.places, system.columns, strict=True):
        value[places] = throw.z[columns]
    points = system.with_shared([throw.z for throw in throws], value)
    cost, converged = system.cost(points, value), False
    for _ in range(ITERATIONS):
        blocks, hessian, gradient = system.normal_equations(points, value)
        step = -np.linalg.solve(hessian, gradient)
        points, value, lower = system.search(points, value, blocks, step, cost)
        converged, cost = cost - lower < PRECISION * cost, lower
        if converged:
            break
    blocks, hessian, _ = system.normal_equations(points, value)
    information = np.zeros((len(throws), len(value), len(value)))
    pull, covariance, variance = np.zeros(information.shape[:2]), np.linalg.inv(hessian), []
    for index, (block, places) in enumerate(zip(blocks, system.places, strict=True)):
        information[index][np.ix_(places, places)], pull[index, places] = block.information, block.pull
        response = block.local_response
        variance.append(block.local_variance + ((response @ covariance[np.ix_(places, places)]) * response).sum(axis=1))
    return Joint(
        names=system.names,
        value=value,
        covariance=covariance,
        throws=tuple(replace(throw, z=z) for throw, z in zip(throws, points, strict=True)),
        information=information,
        pull=pull,
        local_variance=tuple(variance),
        evidence=np.array([block.evidence for block in blocks]),
        fitted=np.stack([block.fitted for block in blocks]),
        local=tuple(system.local),
        converged=converged,
    )


class _Block(NamedTuple):
    """Normal equations of one throw with its own unknowns eliminated, and how those follow the shared ones."""

    information: Floats
    pull: Floats
    local_step: Floats
    local_response: Floats
    local_variance: Floats
    evidence: float
    fitted: Floats


def _eliminate(throw: Throw, z: Floats, local: NDArray[np.intp], columns: NDArray[np.intp]) -> _Block:
    residual, jacobian, precision = throw.residuals(z).ravel(), throw.jacobian(z), throw.width[local] ** -2
    a, b = jacobian[:, columns], jacobian[:, local]
    factor = np.linalg.cholesky(b.T @ b + np.diag(precision))
    half = np.linalg.solve(factor, np.column_stack([b.T @ a, b.T @ residual + precision * z[local]]))
    mixed, pulled = half[:, :-1], half[:, -1]
    back = np.linalg.solve(factor.T, half)
    variance = (np.linalg.inv(factor) ** 2).sum(axis=0)
    pull = a.T @ residual - mixed.T @ pulled
    fitted = (np.linalg.solve(factor, b.T) ** 2).sum(axis=0).reshape(-1, 6).sum(axis=0)
    cost = float(residual @ residual + z[local] @ (precision * z[local]))
    evidence = -0.5 * cost - float(np.log(np.diag(factor)).sum()) + 0.5 * float(np.log(precision).sum())
    return _Block(a.T @ a - mixed.T @ mixed, pull, -back[:, -1], -back[:, :-1], variance, evidence, fitted)


def losses(joint: Joint, effect: str, free: Callable[[str], bool]) -> Floats:
    """Return by how much worse each throw is predicted from the others without an effect, (throws,) [nats].

    Parameters
    ----------
    joint : Joint; of the model with the effect
    effect : str; its label
    free : callable; which unknowns were fitted
    """
    without = [replace(throw, z=np.where(_named(throw, effect), 0.0, throw.z)) for throw in joint.throws]
    dropped = maximise_jointly(without, lambda name: free(name) and not name.rpartition(":")[2].startswith(effect))
    return joint.left_out_scores() - dropped.left_out_scores()


SMOOTH = ("smooth-torque", "smooth-force")

WIDENINGS = 15

SETTLED = 0.03  # relative change of every width at which the iteration ends
LARGEST = 1.3  # root mean square of the values found over their prior width beyond which a body's model is doubtful


@dataclass(frozen=True)
class SmoothWidth:
    """Width of the unexplained torque or force of one body."""

    sd: float  # prior standard deviation of the values at the knots [N m or m/s2]
    factor: float  # by which one more step would change it
    ratio: float  # root mean square of the most probable values over ``sd``

    @property
    def doubtful(self) -> bool:
        """Whether what was found is larger than its prior allows."""
        return self.ratio > LARGEST


def width_of(joint: Joint, body: str, effect: str) -> SmoothWidth:
    """Return the width under which a body was fitted, and what the fit says of it."""
    variance, mean, width, sigma = [], [], 1.0, 1.0
    for throw, local, spread in zip(joint.throws, joint.local, joint.local_variance, strict=True):
        if throw.body == body:
            here = _named(throw, effect)[local]
            value = throw.z[local[here]]
            variance += list(spread[here])
            mean += list(value**2)
            width = float(throw.width[local[here]][0])
            effects = throw.posterior.model.effects
            sigma = next(e.sigma for e in effects if isinstance(e, Smooth) and e.label == effect)
    ratio = float(np.sqrt(np.mean(mean))) / width
    factor = float(np.sqrt(np.mean(mean) + np.mean(variance))) / width
    return SmoothWidth(width * sigma, factor, ratio)


def noise_of(joint: Joint, body: str) -> Floats:
    """Return the noise of a body's samples relative to the quiet one, shape (6,) and one at least."""
    square, count = np.zeros(6), np.zeros(6)
    for throw, fitted in zip(joint.throws, joint.fitted, strict=True):
        if throw.body == body:
            square += (throw.residuals(throw.z) ** 2).sum(axis=0) * throw.noise**2
            count += throw.posterior.whitenings[0].outputs.sum(axis=0) - fitted
    return np.maximum(1.0, np.sqrt(square / count))


def fit_widths(throws: Sequence[Throw], free: Callable[[str], bool]) -> tuple[Throw, ...]:
    """Fit the throws of one body alone; return them at the mode, with the widths that they say."""
    joint = maximise_jointly(throws, free)
    for _ in range(WIDENINGS):
        factors = {effect: width_of(joint, throws[0].body, effect).factor for effect in SMOOTH}
        noise = noise_of(joint, throws[0].body)
        widened = [replace(_widened(throw, factors), noise=noise) for throw in joint.throws]
        joint = maximise_jointly(widened, free)
        if max(abs(factor - 1.0) for factor in factors.values()) < SETTLED:
            break
    return joint.throws


def _widened(throw: Throw, factors: dict[str, float]) -> Throw:
    width = throw.width.copy()
    for effect, factor in factors.items():
        width[_named(throw, effect)] *= factor
    return replace(throw, width=width)


def _named(throw: Throw, effect: str) -> NDArray[np.bool_]:
    return np.array([name.startswith(effect) for name in throw.posterior.unknowns.names])
