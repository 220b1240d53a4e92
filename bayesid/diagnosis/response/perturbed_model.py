"""Fits of any set of effects through one compiled simulation.

The simulation of the present model is compiled once. Effects that it lacks act on it as pushes (`perturb`), evaluated
along the motion of the last fit; a few iterations make motion and pushes agree.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from threading import Lock
from typing import NamedTuple

import jax
import numpy as np
import scipy.linalg as sla
from numpy.typing import NDArray

from bayesid._math.arrays import Floats, Integers
from bayesid._math.threads import in_threads
from bayesid.diagnosis.evidence.gram import GaussianBlock
from bayesid.diagnosis.response.perturbation import (
    OperatingTrajectory,
    Table,
    coordinates_shape,
    linear_perturbation,
    operating_trajectory_of,
    perturb,
    physical,
    tables_of,
)
from bayesid.inference.perturbed_posterior import (
    Arrays,
    LinearResponses,
    Perturbation,
    jacobian_of,
    perturbed,
    residual_of,
    trace,
)
from bayesid.inference.posterior import Posterior
from bayesid.inference.residual_view import ResidualView
from bayesid.simulation.effects.effect import Effect

__all__ = ["Fit", "PerturbedModel"]

PUSHES = 2e8
"""Memory of the pushes whose responses are computed together, of which there are about two copies [bytes]."""

READ = 4
"""Number of pushes whose changes of the readings take as much memory as one push."""

TABLES = 6e8
"""Memory of the tables of effects that are kept; those used least recently are computed anew [bytes]."""

ITERATIONS = 25

PATIENCE = 8.0
"""Number of further steps as good as the last one that a fit may hope for."""

CLOSE = 0.02
"""Change of the cost at which a fit has converged."""


@dataclass(frozen=True)
class Fit:
    """A mode of the posterior with some effects added.

    Attributes
    ----------
    posterior : Posterior
        Whose noise whitened the residual.
    effects : tuple of Effect
    coordinates : tuple of arrays
        Of each effect, prior standard deviations.
    z : (size,) array
        The model's own unknowns.
    data : Arrays
        The data with the effects pushed.
    residual : (N,) array
        Whitened, all recordings.
    own : (N, n) array
        Derivatives of the residual in the model's free unknowns.
    added : tuple of (N, m) arrays
        And in each effect's coordinates.
    cost : float
        Half of chi-square and squared coordinates; infinite where residual or derivatives are not finite.
    operating : OperatingTrajectory
    converged : bool
    released : (k,) array of int
        Which of the model's unknowns the study takes to be zero and this fit does not.
    frozen : (l,) array of int
        Which of them are held at zero.
    """

    posterior: Posterior
    effects: tuple[Effect, ...]
    coordinates: tuple[Floats, ...]
    z: Floats
    data: Arrays
    residual: Floats
    own: Floats
    added: tuple[Floats, ...]
    cost: float
    operating: OperatingTrajectory
    converged: bool
    released: NDArray[np.intp]
    frozen: NDArray[np.intp]

    @property
    def own_coordinates(self) -> Floats:
        """The model's free unknowns in prior standard deviations, in the order of `own`."""
        return np.delete(self.z, self.frozen)

    @property
    def view(self) -> ResidualView:
        """The residual by recording, sensor and axis."""
        return ResidualView.of(self.posterior, self.residual)

    @property
    def chi2(self) -> float:
        """Chi-square of the data."""
        return float(self.residual @ self.residual)

    @cached_property
    def known(self) -> Floats:
        """Every fitted column, (N, n + m), each with a unit prior."""
        return np.concatenate([self.own, *self.added], axis=1)

    @cached_property
    def block(self) -> GaussianBlock:
        """All that is fitted, with the Gauss-Newton Hessian."""
        return GaussianBlock.of(self.known.T @ self.known)

    @property
    def covariance(self) -> Floats:
        """Of all that is fitted, in the order of `known`."""
        return self.block.covariance

    @cached_property
    def log_evidence(self) -> float:
        """Laplace approximation of the log evidence under all priors; minus infinity where nothing could be fitted."""
        if not np.isfinite(self.cost):
            return -np.inf
        return -self.cost - self.block.half_log_det + float(self.posterior.log_normalisation.sum())

    def project(self, columns: Floats, rows: Integers | None = None) -> Floats:
        """Inner products of columns after all that is fitted has taken its share, shape (n, n).

        Parameters
        ----------
        columns : (N, n) array
        rows : (N,) array of int, optional
            Rows of the residual outside which the columns are zero and left out.
        """
        share = self.block.share((self.known if rows is None else self.known[rows]).T @ columns)
        return columns.T @ columns - share.T @ share

    def values(self, index: int) -> Floats:
        """Physical values of one effect's parameters."""
        effect = self.effects[index]
        shape = coordinates_shape(effect, len(self.posterior.manoeuvres))
        return np.asarray(physical(effect, np.reshape(self.coordinates[index], shape)))


ONE_AT_A_TIME, TABLE_LOCK = Lock(), Lock()
"""Held while the simulation is linearised, and while tables come and go; they belong to no model, since models are sent
to other processes."""


class _Point(NamedTuple):
    """One point of a fit."""

    z: Floats
    data: Arrays
    coordinates: list[Floats]
    operating: OperatingTrajectory
    residual: Floats
    jacobian: Floats
    cost: float


class PerturbedModel:
    """Fits and responses for one model and its recordings.

    Parameters
    ----------
    posterior : Posterior
        The present model, with initial rates free.
    frozen : iterable of int
        Coordinates of the model that stay at zero: initial rates that the study takes to be zero.
    released : iterable of int
        Coordinates that the study takes to be zero, but that are free here.
    """

    def __init__(self, posterior: Posterior, frozen: Iterable[int] = (), released: Iterable[int] = ()) -> None:
        self.posterior = posterior
        self.frozen = np.array(sorted(frozen), dtype=int)
        self._released = np.array(sorted(released), dtype=int)
        self._tables: dict[tuple[str, tuple[float, ...]], Table] = {}
        self._linear: LinearResponses | None = None  # about the last point

    def with_posterior(self, posterior: Posterior) -> PerturbedModel:
        """Return the model for the same data under another noise; tables are shared where the motion is the same."""
        new = PerturbedModel(posterior, self.frozen, self._released)
        if all(a.motion is b.motion for a, b in zip(posterior.manoeuvres, self.posterior.manoeuvres, strict=True)):
            new._tables = self._tables
        return new

    @property
    def free(self) -> Integers:
        """Indices of the model's free coordinates."""
        return np.setdiff1d(np.arange(self.posterior.size), self.frozen)

    def released(self) -> PerturbedModel:
        """Return the model with nothing frozen."""
        new = PerturbedModel(self.posterior, released=self.frozen)
        new._tables = self._tables
        return new

    def start(self) -> Floats:
        """Return the model's starting point."""
        z = self.posterior.starting_point()
        z[self.frozen] = 0.0
        return z

    def compile(self) -> None:
        """Compile simulation and derivatives, side by side, those first that take longest."""
        z, data = self.start(), self.posterior.data.arrays
        parts: list[Callable[[], object]] = [
            lambda: self.respond(self.perturbation(1), z, data),
            lambda: jacobian_of(self.posterior, z, data),
            lambda: trace(self.posterior, z, data),
            lambda: residual_of(self.posterior, z, data),
        ]
        in_threads(lambda part: part(), parts)

    def fit(
        self,
        effects: Sequence[Effect] = (),
        coordinates: Sequence[Floats] | None = None,
        z: Floats | None = None,
        operating: OperatingTrajectory | None = None,
        iterations: int = ITERATIONS,
        hopeless: float = np.inf,
    ) -> Fit:
        """Fit the model with effects added (Levenberg-Marquardt).

        Parameters
        ----------
        effects : sequence of Effect
        coordinates : sequence of arrays, optional
            To start from; by default the first of each effect's `Effect.starts`.
        z : (size,) array, optional
            To start from.
        operating : OperatingTrajectory, optional
            Of an earlier fit nearby.
        iterations : int
            Most steps.
        hopeless : float
            Cost that a fit must promise to reach: one whose next steps will not, judged by the last one, is given up.
        """
        z = self.start() if z is None else np.array(z)
        chosen = [np.array(effect.starts[0]) for effect in effects] if coordinates is None else list(coordinates)
        chosen = [
            np.broadcast_to(c, coordinates_shape(e, len(self.posterior.manoeuvres))).ravel()
            if np.ndim(c) == 1 and e.per_recording and len(c) == len(e.parameters)
            else np.ravel(c)
            for c, e in zip(chosen, effects, strict=True)
        ]
        operating = self.operating(z, ()) if operating is None else operating
        sizes = [len(c) for c in chosen]
        ends = np.cumsum([len(self.free), *sizes])
        damping, cost, converged = 1e-3, np.inf, False
        best: _Point | None = None
        for _ in range(iterations):
            here = self._point(effects, chosen, z, operating)
            if not np.isfinite(here.cost):
                break
            if best is None or here.cost < best.cost:
                best = here
            parameters = np.concatenate([z[self.free], *chosen])
            hessian = here.jacobian.T @ here.jacobian + np.eye(len(parameters))
            gradient = here.jacobian.T @ here.residual + parameters
            unit: Floats = 1.0 / np.sqrt(np.diag(hessian))  # brings unknowns of very different sensitivities to one
            scaled = unit[:, None] * hessian * unit
            taken = False
            for _ in range(8):
                step = -unit * sla.solve(scaled + damping * np.eye(len(unit)), unit * gradient, assume_a="pos")
                trial = parameters + step
                new_z = z.copy()
                new_z[self.free] = trial[: ends[0]]
                new = [trial[a:b] for a, b in pairwise(ends)]
                with np.errstate(all="ignore"):
                    there = self._cost(effects, new, new_z, operating)
                if np.isfinite(there) and there <= here.cost + 1e-9 * abs(here.cost):
                    taken = True
                    break
                damping = max(damping, 1e-6) * 10.0
            if not taken:
                converged = True
                break
            z, chosen, damping = new_z, new, damping * 0.1
            operating = self.operating(z, self.pushes(effects, chosen, operating, vibrations=False))
            if abs(cost - there) < CLOSE and here.cost - there < CLOSE:
                converged = True
                break
            if there - PATIENCE * (here.cost - there) > hopeless:
                break
            cost = there
        last = self._point(effects, chosen, z, operating)
        if best is None or last.cost < best.cost + CLOSE:
            best = last  # unless motion and pushes came apart on the way
        counts = np.cumsum([len(self.free), *sizes])[:-1]
        own, *added = np.split(best.jacobian, counts, axis=1)
        return Fit(
            self.posterior,
            tuple(effects),
            tuple(best.coordinates),
            best.z,
            best.data,
            best.residual,
            own,
            tuple(added),
            best.cost,
            best.operating,
            converged,
            self._released,
            self.frozen,
        )

    def _point(
        self, effects: Sequence[Effect], coordinates: Sequence[Floats], z: Floats, operating: OperatingTrajectory
    ) -> _Point:
        """Residual and derivatives at one point."""
        data = self._pushed(self.pushes(effects, coordinates, operating))
        residual = self.residual(z, data)
        sized = [(effect, c) for effect, c in zip(effects, coordinates, strict=True) if len(c)]
        with np.errstate(over="ignore", invalid="ignore"):  # an unstable motion, whose cost says so
            columns = [self.own_columns(z, data), *self.columns(sized, operating, z, data)]
            jacobian = np.concatenate(columns, axis=1)
            cost = 0.5 * float(residual @ residual + z @ z + sum(c @ c for c in coordinates))
        if not (np.isfinite(cost) and np.isfinite(jacobian).all()):
            cost = np.inf
        return _Point(z, data, list(coordinates), operating, residual, jacobian, cost)

    def _cost(
        self, effects: Sequence[Effect], coordinates: Sequence[Floats], z: Floats, operating: OperatingTrajectory
    ) -> float:
        r = self.residual(z, self._pushed(self.pushes(effects, coordinates, operating)))
        return 0.5 * float(r @ r + z @ z + sum(c @ c for c in coordinates))

    def operating(self, z: Floats, perturbations: Sequence[Perturbation]) -> OperatingTrajectory:
        """Return the motion with the given pushes."""
        traced = trace(self.posterior, z, self._pushed(perturbations))
        return operating_trajectory_of(self.posterior, traced.node, traced.sample, traced.readings)

    def pushes(
        self,
        effects: Sequence[Effect],
        coordinates: Sequence[Floats],
        operating: OperatingTrajectory,
        vibrations: bool = True,
    ) -> list[Perturbation]:
        """Return what each effect does along a motion, with or without the vibrations."""
        return [
            perturb(effect, c, operating, self._table(effect))
            for effect, c in zip(effects, coordinates, strict=True)
            if vibrations or not effect.modes_count
        ]

    def residual(self, z: Floats, data: Arrays) -> Floats:
        """Return the whitened residual, (N,)."""
        return residual_of(self.posterior, z, data).ravel()

    def own_columns(self, z: Floats, data: Arrays) -> Floats:
        """Return derivatives of the residual in the model's free coordinates, (N, n)."""
        return jacobian_of(self.posterior, z, data).reshape(-1, self.posterior.size)[:, self.free]

    def columns(
        self, effects: Iterable[tuple[Effect, Floats]], operating: OperatingTrajectory, z: Floats, data: Arrays
    ) -> list[Floats]:
        """Return derivatives of the residual in the coordinates of each effect, (N, n).

        Where each recording has coordinates of its own, all are side by side, recording after recording.
        """
        effects = list(effects)
        columns = []
        for (effect, _), part in zip(effects, self.responses(effects, operating, z, data), strict=True):
            recordings, rows, count = part.shape
            if effect.per_recording:
                own = np.arange(recordings)
                whole = np.zeros((recordings, rows, recordings, count))
                whole[own, :, own] = part
                part = whole
            columns.append(part.reshape(recordings * rows, -1))
        return columns

    def responses(
        self, effects: Sequence[tuple[Effect, Floats]], operating: OperatingTrajectory, z: Floats, data: Arrays
    ) -> list[Floats]:
        """Return derivatives of the residual of each recording in the coordinates of each effect, (R, N / R, n).

        Where each recording has coordinates of its own, they are the derivatives in these. What all effects change is
        whitened together, in full batches.
        """
        if not effects:
            return []
        linear = self._about(z, data)

        def changes(item: tuple[Effect, Floats]) -> tuple[Floats, Floats]:
            return linear.changes(linear_perturbation(*item, operating, self._table(item[0])))

        responses: list[Floats] = []
        for some in self._shared_out(effects, READ * self.most_pushes):
            raw, offset = zip(*in_threads(changes, some), strict=True)
            ends = np.cumsum([len(part) for part in raw])[:-1]
            whitened = linear.whitened(np.concatenate(raw), np.concatenate(offset))
            parts = np.split(whitened.reshape(*whitened.shape[:2], -1), ends)
            responses += [np.moveaxis(part, 0, -1) for part in parts]
        return responses

    @staticmethod
    def _shared_out(effects: Sequence[tuple[Effect, Floats]], most: int) -> Iterator[Sequence[tuple[Effect, Floats]]]:
        """Yield effects in groups with about so many parameters in all."""
        count = max(1, most // max(len(effect.parameters) for effect, _ in effects))
        yield from (effects[first : first + count] for first in range(0, len(effects), count))

    def columns_together(
        self, effects: Sequence[tuple[Effect, Floats]], operating: OperatingTrajectory, z: Floats, data: Arrays
    ) -> list[Floats]:
        """Return the same as `columns` from large batches of pushes, for effects with few parameters each."""
        columns: list[Floats] = []
        for some in self._shared_out(effects, self.most_pushes):
            pushes = in_threads(lambda at: linear_perturbation(*at, operating, self._table(at[0])), some)
            whole = self.respond(jax.tree.map(lambda *parts: np.concatenate(parts), *pushes), z, data)
            columns += np.split(whole, np.cumsum([len(part.reading) for part in pushes])[:-1], axis=1)
        return columns

    def respond(
        self, perturbations: Perturbation, z: Floats, data: Arrays, recordings: Sequence[int] | None = None
    ) -> Floats:
        """Return derivatives of the residual along pushes with leading axis n, (N, n).

        Parameters
        ----------
        perturbations : Perturbation
        z : (size,) array
            Coordinates.
        data : Arrays
        recordings : sequence of int, optional
            Numbers of those to which pushes and residual belong, by default all.
        """
        linear = self._about(z, data)
        if recordings is not None and len(recordings) < len(self.posterior.manoeuvres):
            linear = linear.part(recordings)
        return linear.along(perturbations).reshape(len(perturbations.reading), -1).T

    def _about(self, z: Floats, data: Arrays) -> LinearResponses:
        """Return the responses about a point, kept until another is asked for."""
        with ONE_AT_A_TIME:  # threads that need the same derivatives wait for the first of them
            if self._linear is None or self._linear.arrays is not data or not np.array_equal(self._linear.z, z):
                self._linear = None  # it takes as much memory as the next one
                self._linear = LinearResponses.about(self.posterior, z, data)
            return self._linear

    def perturbation(self, count: int, recordings: int | None = None, **parts: Floats) -> Perturbation:
        """Return ``count`` pushes of all or so many recordings with the named parts, the others zero."""
        whole = self._push_shapes()
        empty = Perturbation(*(np.zeros((count, recordings or shape[0], *shape[1:])) for shape in whole))
        return empty._replace(**parts)

    @property
    def most_pushes(self) -> int:
        """Number of pushes that may be held at once."""
        return max(1, int(PUSHES / (8.0 * sum(map(np.prod, self._push_shapes())))))

    def _pushed(self, perturbations: Sequence[Perturbation]) -> Arrays:
        data = self.posterior.data.arrays
        if not perturbations:
            return data
        return perturbed(data, jax.tree.map(lambda *parts: sum(parts), *perturbations))

    def _push_shapes(self) -> list[tuple[int, ...]]:
        arrays = self.posterior.data.arrays
        node, sample = arrays.grid.node.known.shape, arrays.grid.sample.known.shape
        return [node, sample, (*node[:2], 6), (*sample[:2], 6), arrays.offset.shape]

    def _table(self, effect: Effect) -> Table | None:
        if not effect.uses("table"):
            return None
        key = effect.label, effect.instants  # a label has fewer digits
        with TABLE_LOCK:
            table = self._tables.pop(key, None)
        if table is None:
            table = tables_of(effect, self.posterior)
        with TABLE_LOCK:
            self._tables[key] = table  # the last is the one used most recently
            memory = sum(one.nbytes for one in self._tables.values())
            while memory > TABLES and len(self._tables) > 1:
                memory -= self._tables.pop(next(iter(self._tables))).nbytes
        return table
