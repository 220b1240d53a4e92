"""Gram matrix of candidate signatures after the fitted unknowns have taken their share.

With the whitened residual ``r`` of the present model, the derivatives ``X`` of the residual in its fitted unknowns,
whose prior is standard normal, and the signatures ``S`` of whatever the model may lack, the residual with amplitudes
``a`` is ``r + S a + X dz``. Once the unknowns are integrated out, the data speak on the amplitudes through

    A = S'S - S'X (X'X + 1)^-1 X'S,    g = S'r - S'X (X'X + 1)^-1 (X'r + z)

alone: the likelihood of ``a`` relative to that of ``a = 0`` is ``exp(-g'a - a'A a / 2)``. At the mode of the present
model ``X'r + z = 0``, and the score ``g`` is ``S'r``. The step is the linear model with some of its coefficients
integrated out (C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine Learning, 2006, section 2.7).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.linalg as sla
from scipy.linalg.blas import dtrmm

from bayesid._math.arrays import Floats, Integers
from bayesid._math.threads import several_threads

__all__ = ["GaussianBlock", "Gram", "covariance_roots", "independent_directions"]

LOST = 1e-10  # share of a column's length below which what the unknowns leave of it is rounding
DEPENDENT = 1e-10  # share of the largest eigenvalue, of columns of unit length, below which a direction is dependent
JITTER = 1e-10  # share of the diagonal that makes a singular matrix of columns of unit length definite


def independent_directions(matrix: Floats) -> Floats:
    """Return combinations of columns that are orthonormal in a Gram matrix, one for each independent direction.

    Parameters
    ----------
    matrix : (m, m) array
        Positive semidefinite matrix.

    Returns
    -------
    (m, k) array
        Matrix ``W`` with ``W' matrix W = 1``, where ``k`` is the numerical rank, judged after each column has been
        brought to unit length, so that units do not matter.
    """
    _, inverse = _lengths(matrix)
    values, vectors = np.linalg.eigh(inverse[:, None] * matrix * inverse)
    kept = values > DEPENDENT * max(values.max(initial=0.0), np.finfo(float).tiny)
    return inverse[:, None] * vectors[:, kept] / np.sqrt(values[kept])


def _lengths(matrix: Floats) -> tuple[Floats, Floats]:
    """Return the lengths of the columns behind a Gram matrix, and their inverses, zero for columns of no length."""
    length = np.sqrt(np.diag(matrix))
    return length, np.divide(1.0, length, out=np.zeros_like(length), where=length > 0.0)


def _scaled_factor(information: Floats, deviations: Floats) -> Floats:
    """Return the Cholesky factor of ``1 + D A D``, whose eigenvalues are at least one, shape (..., m, m)."""
    return np.linalg.cholesky(
        deviations[..., :, None] * information * deviations[..., None, :] + np.eye(deviations.shape[-1])
    )


def covariance_roots(information: Floats, deviations: Floats) -> tuple[Floats, Floats]:
    """Return roots of the posterior covariances of amplitudes, one for each of several priors.

    Parameters
    ----------
    information : (m, m) array
    deviations : (t, m) array
        Prior standard deviations, one row for each combination of scales.

    Returns
    -------
    roots : (t, m, m) array
        ``L^-1 D`` in the words of `GaussianBlock`; the covariance is the transpose times the matrix itself.
    half_log_det : (t,) array
        Half of the logarithm of the determinant of ``1 + D A D``.
    """
    lower = _scaled_factor(information, deviations)
    roots = np.linalg.solve(lower, np.eye(len(information)) * deviations[:, None, :])
    return roots, np.log(np.diagonal(lower, axis1=1, axis2=2)).sum(axis=1)


@dataclass(frozen=True)
class GaussianBlock:
    """Amplitudes with a normal prior, which the data inform on, and which are integrated out.

    With the information ``A`` on them, the diagonal ``D`` of their prior deviations and the Cholesky factor ``L`` of
    ``1 + D A D``, their posterior covariance is ``D (1 + D A D)^-1 D``. Of columns that have the products ``C`` with
    theirs they take the share ``S'S`` of the information and ``S'p`` of the score, where ``S = L^-1 D C`` and
    ``p = L^-1 D g``: what is left is the Schur complement.

    Attributes
    ----------
    lower : (m, m) array
        Cholesky factor ``L``.
    deviations : (m,) array
    """

    lower: Floats
    deviations: Floats

    @staticmethod
    def of(information: Floats, deviations: Floats | None = None) -> GaussianBlock:
        """Return the block of some amplitudes.

        Parameters
        ----------
        information : (m, m) array
        deviations : (m,) array, optional
            Prior standard deviations, by default one.
        """
        deviations = np.ones(len(information)) if deviations is None else deviations
        return GaussianBlock(_scaled_factor(information, deviations), deviations)

    def share(self, products: Floats) -> Floats:
        """Return ``L^-1 D C`` for products with the amplitudes' columns, such as their score, (m,) or (m, c)."""
        scale = self.deviations if products.ndim == 1 else self.deviations[:, None]
        return np.asarray(sla.solve_triangular(self.lower, scale * products, lower=True))

    def mean(self, score: Floats) -> Floats:
        """Return the posterior mean of the amplitudes, shape (m,), given their score, (m,)."""
        return -self.deviations * sla.solve_triangular(self.lower, self.share(score), trans=1, lower=True)

    @property
    def covariance(self) -> Floats:
        """Posterior covariance of the amplitudes, shape (m, m)."""
        root = self.share(np.eye(len(self.lower)))
        return root.T @ root

    @property
    def half_log_det(self) -> float:
        """Half of the logarithm of the determinant of ``1 + D A D``."""
        return float(np.log(np.diag(self.lower)).sum())


@dataclass(frozen=True)
class Gram:
    """All that the data say about the amplitudes of candidate signatures.

    Attributes
    ----------
    matrix : (m, m) array
        Information ``A`` on the amplitudes, per product of their units.
    score : (m,) array
        Derivative ``g`` of half of chi-square in the amplitudes, where all are zero. The likelihood is largest at the
        amplitudes ``-A^-1 g``.
    groups : mapping of str to (k,) arrays of int
        Indices of the columns of each group, by name.
    """

    matrix: Floats
    score: Floats
    groups: Mapping[str, Integers]

    def __post_init__(self) -> None:
        for name in ("matrix", "score"):
            given = getattr(self, name)
            if not isinstance(given, np.ndarray) or given.flags.writeable or given.dtype != float:
                object.__setattr__(self, name, _locked(name, np.array(given, dtype=float)))
        size = len(self.score)
        if self.matrix.shape != (size, size):
            raise ValueError(f"a score of length {size} needs a matrix of that size, received {self.matrix.shape}")
        object.__setattr__(
            self, "groups", {name: np.array(columns, dtype=int) for name, columns in self.groups.items()}
        )

    @staticmethod
    def owning(matrix: Floats, score: Floats, groups: Mapping[str, Integers]) -> Gram:
        """Return the Gram of arrays that nobody else keeps: they are locked instead of copied.

        Parameters
        ----------
        matrix : (m, m) array
        score : (m,) array
        groups : mapping of str to (k,) arrays of int
        """
        return Gram(_locked("matrix", matrix), _locked("score", score), groups)

    @staticmethod
    def of(columns: Mapping[str, Floats], residual: Floats, fitted: Floats, coordinates: Floats | None = None) -> Gram:
        """Return the Gram of signatures beside a fitted model.

        The signatures are projected off the fitted columns, with the unknowns' prior as further rows, before any
        product is formed: differences of large products would lose signatures that the unknowns imitate closely.

        Parameters
        ----------
        columns : mapping of str to (N, k) arrays
            Derivatives of the whitened residual in the amplitudes of each group.
        residual : (N,) array
            Whitened residual of the present model.
        fitted : (N, n) array
            Derivatives of the residual in the fitted unknowns, each with a standard normal prior.
        coordinates : (n,) array, optional
            Values of the unknowns, in prior standard deviations. Where they are left out, the model is at its mode.
        """
        rows, unknowns = fitted.shape
        z = -fitted.T @ residual if coordinates is None else coordinates
        basis = np.linalg.qr(np.concatenate([fitted, np.eye(unknowns)]))[0]
        groups = _side_by_side({name: array.shape[1] for name, array in columns.items()})
        left = np.empty((rows + unknowns, sum(map(len, groups.values()))))
        for name, array in columns.items():
            share = basis[:rows].T @ array
            part = np.concatenate([array - basis[:rows] @ share, -basis[rows:] @ share])
            part[:, np.linalg.norm(part, axis=0) <= LOST * np.linalg.norm(array, axis=0)] = 0.0
            left[:, groups[name]] = part
        return Gram.owning(left.T @ left, left.T @ np.concatenate([residual, z]), groups)

    def keeping(self, names: Iterable[str]) -> Gram:
        """Return the Gram of some of the groups, in the order of the names."""
        names = list(names)
        columns = self.columns(names)
        groups = _side_by_side({name: len(self.groups[name]) for name in names})
        return Gram.owning(self.matrix[np.ix_(columns, columns)], self.score[columns], groups)

    def conditioned(self, columns: Integers, deviations: Floats, names: Iterable[str] | None = None) -> Gram:
        """Return the Gram of some groups after other columns have taken their share (`GaussianBlock`).

        Parameters
        ----------
        columns : (k,) array of int
            Columns that are integrated out.
        deviations : (k,) array
            Prior standard deviations of their amplitudes.
        names : iterable of str, optional
            Groups that are kept; by default all.
        """
        part = self if names is None else self.keeping(names)
        kept = np.arange(len(self.score)) if names is None else self.columns(part.groups)
        block = GaussianBlock.of(self.matrix[np.ix_(columns, columns)], deviations)
        share, pull = block.share(self.matrix[np.ix_(columns, kept)]), block.share(self.score[columns])
        return Gram.owning(part.matrix - share.T @ share, part.score - share.T @ pull, part.groups)

    def columns(self, names: Iterable[str]) -> Integers:
        """Return the columns of some groups, one group after another."""
        return np.concatenate([np.zeros(0, dtype=int), *(self.groups[name] for name in names)])

    def cosines(self, first: str, second: str) -> Floats:
        """Return the canonical correlations of two groups after projection, shape (k,), the largest first.

        The largest says how well some change by the one group can imitate some change by the other; only where the
        smallest is near one, too, can the groups imitate each other altogether. ``k`` is the smaller of their ranks.
        Source: H. Hotelling, Relations between two sets of variates, Biometrika 28, 1936.

        Parameters
        ----------
        first, second : str
            Names of the groups.
        """
        columns, others = self.groups[first], self.groups[second]
        left = independent_directions(self.matrix[np.ix_(columns, columns)])
        right = independent_directions(self.matrix[np.ix_(others, others)])
        correlations = np.linalg.svd(left.T @ self.matrix[np.ix_(columns, others)] @ right, compute_uv=False)
        return np.minimum(correlations, 1.0)

    def signal_to_noise(self, *names: str) -> float:
        """Return the root of the improvement of chi-square by groups, fitted jointly with the unknowns, less its rank.

        The improvement includes that of the unknowns' prior. Where it is below the rank, the ratio is zero.
        """
        columns = self.columns(names)
        fitted = independent_directions(self.matrix[np.ix_(columns, columns)]).T @ self.score[columns]
        return float(np.sqrt(max(float(fitted @ fitted) - len(fitted), 0.0)))

    def null_scores(self, rng: np.random.Generator, draws: int) -> Floats:
        """Draw scores of a model that lacks nothing, shape (draws, m): normal with covariance ``A``.

        Write the truth as the unknowns ``t``, drawn from their prior, and the noise ``e``. At the mode the residual
        and the unknowns, ``[r; z]``, are what the projection off ``[X; 1]`` leaves of ``[e; t]``, whose elements are
        independent and standard normal. The score is the product of that with the projected signatures, so that its
        covariance is the products of the projected signatures with one another, which is ``A``. No simulation is
        needed where the model is linear over its posterior.

        Parameters
        ----------
        rng : Generator
        draws : int
        """
        drawn = rng.normal(size=(draws, len(self.score)))
        root = self._root()
        with several_threads(len(self.score)):  # a triangular product takes half of the operations of a full one
            return np.asarray(dtrmm(1.0, root.T, drawn.T, lower=0, trans_a=1, overwrite_b=1).T)

    def _root(self) -> Floats:
        """Return the lower triangle, (m, m), whose product with its transpose is ``A`` up to 1e-10 of its diagonal.

        Columns that are small differences of large ones leave ``A`` slightly indefinite by rounding; the product is
        then the nearest matrix that is not. One thread factorises: two lose several times what they gain as soon as
        another process keeps one of the cores busy.
        """
        length, inverse = _lengths(self.matrix)
        scaled = inverse[:, None] * self.matrix
        scaled *= inverse
        scaled[np.diag_indices(len(length))] += JITTER
        try:
            root = np.linalg.cholesky(scaled)
        except np.linalg.LinAlgError:
            values, vectors = np.linalg.eigh(scaled)
            root = np.transpose(np.linalg.qr((vectors * np.sqrt(np.maximum(values - JITTER, 0.0))).T, mode="r"))
        root *= length[:, None]
        return root


def _locked(name: str, array: Floats) -> Floats:
    """Lock an array of a Gram, which must be finite."""
    if not np.isfinite(array).all():
        raise ValueError(f"the {name} of a Gram must be finite; a signature or the residual is not")
    array.setflags(write=False)
    return array


def _side_by_side(sizes: Mapping[str, int]) -> dict[str, Integers]:
    """Return the columns of groups of some sizes, one group after another."""
    ends = np.cumsum([0, *sizes.values()])
    return {name: np.arange(*pair) for name, pair in zip(sizes, pairwise(ends), strict=True)}
