"""Amplitudes of one unit whose common scale is itself unknown: their prior, and nodes for averages over the scale.

The amplitudes of a group are normal, ``a ~ N(0, tau^2 Lambda)``, and their scale ``tau`` is log-uniform between a floor
below what the data can resolve and a physical bound. A Gaussian prior at the bound would charge a group with many small
amplitudes for every one of them; here the common scale is charged once. Every candidate has a prior of this one form,
so that their Occam factors are comparable (D. J. C. MacKay, Bayesian interpolation, Neural Computation 4, 1992). The
prior of a scale is H. Jeffreys', Theory of Probability, 1939.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from bayesid._math.arrays import Floats, Integers
from bayesid.diagnosis.evidence.body_evidence import MissingBody
from bayesid.diagnosis.evidence.gram import Gram

__all__ = [
    "AmplitudeGroup",
    "CandidateCause",
    "LogNodes",
    "ScaleRange",
    "Variant",
    "log_nodes",
    "log_nodes_of_many",
    "range_of",
    "scale_range",
    "thinning",
]

UNRESOLVED_GAIN = 0.01
"""Square of the scale times the information in the most visible direction, at the floor that the data set: there the
evidence differs from that of no amplitude at all by less than 0.01 per direction."""

PER_DECADE = 3.0
"""Nodes per decade of the scale where the data see no amplitude."""

PER_ROOT = 1.5
"""Nodes per decade and root of the number of amplitudes that the data see. The more there are, the better their common
scale is known, to ``1 / sqrt(2 m)`` in its logarithm. The log evidence of one group is then within 0.03 of the exact
integral, and mostly within 0.005."""

FINE = 97  # points from which the density of the nodes is integrated


@dataclass(frozen=True)
class AmplitudeGroup:
    """Amplitudes that share one unknown scale.

    Attributes
    ----------
    name : str
        Name of the group of columns in the Gram.
    high : float
        Physical bound of the scale, in the unit of the amplitudes.
    low : float, optional
        Smallest scale. Where it is left out, it is what the data cannot resolve (`scale_range`).
    spread : (k,) array, optional
        Variances of the amplitudes relative to the square of the scale, the diagonal of ``Lambda``; ones by default.
        Amplitudes of no variance are absent.
    """

    name: str
    high: float
    low: float | None = None
    spread: Floats | None = None

    def __post_init__(self) -> None:
        if not 0.0 < self.high < np.inf:
            raise ValueError(f"{self.name}: the bound of the scale must be positive and finite, received {self.high}")
        if self.low is not None and not 0.0 < self.low <= self.high:
            raise ValueError(f"{self.name}: the floor of the scale must lie in (0, {self.high}], received {self.low}")
        if self.spread is not None:
            spread = np.array(self.spread, dtype=float)
            if not ((spread >= 0.0) & np.isfinite(spread)).all() or not spread.any():
                raise ValueError(f"{self.name}: relative variances must be positive and finite, received {spread}")
            spread.setflags(write=False)
            object.__setattr__(self, "spread", spread)

    def columns(self, gram: Gram) -> Integers:
        """Return the columns of the Gram whose amplitudes are not absent, shape (k,)."""
        columns = gram.groups[self.name]
        if self.spread is None:
            return columns
        if self.spread.shape != columns.shape:
            raise ValueError(f"{self.name}: {len(columns)} amplitudes need so many variances, not {self.spread.shape}")
        return columns[self.spread > 0.0]

    def roots(self, gram: Gram) -> Floats:
        """Return the standard deviations relative to the scale of the amplitudes in `columns`, shape (k,)."""
        if self.spread is None:
            return np.ones(len(gram.groups[self.name]))
        return np.sqrt(self.spread[self.spread > 0.0])


class Variant(NamedTuple):
    """One of the forms that a cause may take, such as a vibration of one frequency or a jump at one instant.

    Attributes
    ----------
    groups : tuple of AmplitudeGroup
        Groups of amplitudes that come and go together, each with its own scale.
    log_weight : float
        Logarithm of the prior probability of this form, given that the cause is at work.
    """

    groups: tuple[AmplitudeGroup, ...]
    log_weight: float = 0.0


@dataclass(frozen=True)
class CandidateCause:
    """What the model may lack.

    Attributes
    ----------
    name : str
    groups : tuple of AmplitudeGroup
        Groups of amplitudes of a cause of one form, or of the first of its forms.
    generic : bool
        Whether it stands for something unknown, such as a disturbing torque, rather than for a cause of the catalogue.
    others : tuple of tuples of AmplitudeGroup
        Groups of further forms.
    shares : tuple of float
        Prior probabilities of all forms, given that the cause is at work; by default they are equal.
    body : MissingBody, optional
        Body of positive mass at a bounded place whose moments the amplitudes are.
    fixed : bool
        Whether the amplitudes are all exactly one, since physics leaves them no freedom; their scales do not matter.
    """

    name: str
    groups: tuple[AmplitudeGroup, ...]
    generic: bool = False
    others: tuple[tuple[AmplitudeGroup, ...], ...] = ()
    shares: tuple[float, ...] = ()
    body: MissingBody | None = None
    fixed: bool = False

    def __post_init__(self) -> None:
        if self.shares and (len(self.shares) != 1 + len(self.others) or not all(share > 0.0 for share in self.shares)):
            raise ValueError(f"{self.name!r}: every form needs a positive share, received {self.shares}")
        if self.fixed and (self.others or len(self.groups) != 1):
            raise ValueError(f"{self.name!r}: a cause of fixed size has one form with one group")

    @cached_property
    def variants(self) -> tuple[Variant, ...]:
        """All forms, with their prior probabilities."""
        forms = (self.groups, *self.others)
        shares = self.shares or (1.0 / len(forms),) * len(forms)
        return tuple(Variant(groups, float(np.log(share))) for groups, share in zip(forms, shares, strict=True))

    def in_forms(self, places: Sequence[int]) -> CandidateCause:
        """Return the cause with some of its forms, each with the share of the prior that it has among all.

        Parameters
        ----------
        places : sequence of int
            Places among the `variants`.
        """
        chosen = [self.variants[place] for place in places]
        shares = tuple(float(np.exp(variant.log_weight)) for variant in chosen)
        return replace(self, groups=chosen[0].groups, others=tuple(form.groups for form in chosen[1:]), shares=shares)

    def rescaled(self, gram: Gram, bound: float = 1.0, floor: float = 1.0) -> CandidateCause:
        """Return the cause with the bounds of its scales and the floors multiplied by factors.

        A floor that the data would set is written down first, so that it is multiplied, too. What physics fixes keeps
        its size.

        Parameters
        ----------
        gram : Gram
        bound, floor : float
            Factors.
        """
        if self.fixed:
            return self

        def moved(group: AmplitudeGroup) -> AmplitudeGroup:
            low = scale_range(group, gram).low if group.low is None and floor != 1.0 else group.low
            return replace(group, high=group.high * bound, low=None if low is None else low * floor)

        first, *others = (tuple(map(moved, variant.groups)) for variant in self.variants)
        body = None if self.body is None else replace(self.body, heaviest=self.body.heaviest * bound)
        return replace(self, groups=first, others=tuple(others), body=body)


@dataclass(frozen=True)
class ScaleRange:
    """Range of a log-uniform scale.

    The ends are in the unit of the amplitudes, and equal where the data cannot see the group within its bound.
    """

    low: float
    high: float
    visible: bool


def scale_range(group: AmplitudeGroup, gram: Gram) -> ScaleRange:
    """Return the range of a group's scale (`range_of`).

    Parameters
    ----------
    group : AmplitudeGroup
    gram : Gram
    """
    columns, root = group.columns(gram), group.roots(gram)
    values = np.linalg.eigvalsh(root[:, None] * gram.matrix[np.ix_(columns, columns)] * root)
    return range_of(group, float(values.max(initial=0.0)))


def range_of(group: AmplitudeGroup, largest: float) -> ScaleRange:
    """Return the range of a group's scale, given the largest eigenvalue of ``Lambda^1/2 A Lambda^1/2``.

    The floor that the data set is the scale whose square times that eigenvalue is 0.01. A group whose bound is below
    that floor is invisible: its evidence is that of nothing, whatever the data.

    Parameters
    ----------
    group : AmplitudeGroup
    largest : float
        The eigenvalue, per square of the unit of the amplitudes.
    """
    floor = np.sqrt(UNRESOLVED_GAIN / largest) if largest > 0.0 else np.inf
    low = min(floor, group.high) if group.low is None else group.low
    return ScaleRange(float(low), group.high, bool(floor <= group.high))


class LogNodes(NamedTuple):
    """Nodes of the trapezoidal rule in the logarithm of a scale, (t,), with the logarithms of their prior weights."""

    scales: Floats
    log_weights: Floats


def log_nodes(whole: ScaleRange, part: tuple[float, float], values: Floats, thinned: float = 1.0) -> LogNodes:
    """Return nodes over a part of a range; the first and the last weigh half.

    How well the data can tell scales apart, and so how near each other the nodes must be, depends on the number of
    amplitudes that they see: the sum of ``(v / (1 + v))^2`` over the eigenvalues ``v`` of the information at a scale,
    half of the Fisher information on its logarithm. The nodes are equally spaced in the integral of that density.

    Parameters
    ----------
    whole : ScaleRange
        Range over which the scale is log-uniform.
    part : pair of float
        Ends of the part.
    values : (k,) array
        Eigenvalues of the information on the amplitudes in units of the scale.
    thinned : float
        Factor on the number of nodes, at most 1.
    """
    if whole.low == whole.high:
        return LogNodes(np.array([whole.high]), np.zeros(1))
    scales, log_weights = _nodes(np.array([part]), np.array([np.log(whole.high / whole.low)]), values[None], thinned)
    return LogNodes(scales[0], log_weights[0])


def log_nodes_of_many(ranges: Sequence[ScaleRange], values: Floats) -> list[LogNodes]:
    """Return `log_nodes` over the whole ranges of groups of one size.

    Parameters
    ----------
    ranges : sequence of ScaleRange
    values : (n, k) array
        Eigenvalues of each group.
    """
    grids = [LogNodes(np.array([whole.high]), np.zeros(1)) for whole in ranges]
    several = [place for place, whole in enumerate(ranges) if whole.low < whole.high]
    if several:
        ends = np.array([(ranges[place].low, ranges[place].high) for place in several])
        rows = zip(*_nodes(ends, np.log(ends[:, 1] / ends[:, 0]), values[several], 1.0), strict=True)
        for place, (scales, log_weights) in zip(several, rows, strict=True):
            weighs = np.isfinite(log_weights)
            grids[place] = LogNodes(scales[weighs], log_weights[weighs])
    return grids


def _nodes(ends: Floats, widths: Floats, values: Floats, thinned: float) -> tuple[Floats, Floats]:
    """Return nodes between ends, (n, 2), of log-uniform priors of some widths, (n,).

    Rows with fewer nodes than others end with some of no weight.
    """
    first, last = np.log(ends).T
    logs = first[:, None] + (last - first)[:, None] * np.linspace(0.0, 1.0, FINE)
    density = _density(logs, values)
    covered = np.zeros_like(logs)
    np.cumsum(0.5 * (density[:, 1:] + density[:, :-1]), axis=1, out=covered[:, 1:])
    covered *= ((last - first) / (FINE - 1))[:, None]
    lasts = np.maximum(np.ceil(covered[:, -1] * thinned).astype(int), 2)  # place of the last node
    steps = (covered[:, -1] / lasts)[:, None]
    order = np.arange(lasts.max() + 1)
    at = np.minimum(order, lasts[:, None]) * steps
    places = np.stack([np.interp(*row) for row in zip(at, covered, logs, strict=True)])
    weights = steps / _density(places, values) / widths[:, None]
    rows = np.arange(len(ends))
    weights[:, 0] *= 0.5
    weights[rows, lasts] *= 0.5
    scales = np.exp(places)
    scales[rows, 0], scales[rows, lasts] = ends.T  # exactly
    with np.errstate(divide="ignore"):
        return scales, np.log(np.where(order > lasts[:, None], 0.0, weights))


def _density(logs: Floats, values: Floats) -> Floats:
    """Return the number of nodes per unit of the logarithm of a scale, at some of these logarithms, (n, t)."""
    visible = np.exp(2.0 * logs)[:, :, None] * values[:, None, :]
    visible /= 1.0 + visible
    seen = np.einsum("ntk,ntk->nt", visible, visible)
    return np.sqrt(PER_DECADE**2 + PER_ROOT**2 * seen) / np.log(10.0)


def thinning(counts: Sequence[int], limit: int) -> float:
    """Return the factor on the numbers of nodes at which their product stays about at a limit.

    Parameters
    ----------
    counts : sequence of int
    limit : int
    """
    several = [count for count in counts if count > 1]
    product = float(np.prod([float(count) for count in several]))
    return 1.0 if product <= limit else float((limit / product) ** (1.0 / len(several)))
