"""Quantities of bodies from draws or linearised at a point, their form in JSON, and their contraction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._io.short_form import ShortForm, Summary, format_spread
from bayesid._math.arrays import Floats, Integers, Traceable
from bayesid._math.double_precision import in_double_precision
from bayesid._math.kept_jit import kept_jit
from bayesid._math.on_device import on_device
from bayesid.inference.posterior import Posterior
from bayesid.inference.unknowns import Layout, PriorNumbers, Unknowns
from bayesid.robot.inertial_parameters import mass_com_inertia
from bayesid.simulation.effects.effect import Effect

__all__ = [
    "BODY_QUANTITIES",
    "CONTRACTED",
    "PRIOR_ONLY",
    "BodyDraws",
    "CentreOfMass",
    "Contraction",
    "ContractionVerdict",
    "InertiaTensor",
    "Linearised",
    "QuantityDraws",
    "bodies_of",
    "body_dict",
    "compare",
    "half_range",
    "linearise",
    "quantities_at",
    "quantity",
    "quantity_slopes_at",
    "reported_effect",
]

BODY_QUANTITIES = {
    "mass": "kg",
    "com.x": "m",
    "com.y": "m",
    "com.z": "m",
    "inertia.xx": "kg m2",
    "inertia.yy": "kg m2",
    "inertia.zz": "kg m2",
    "inertia.xy": "kg m2",
    "inertia.xz": "kg m2",
    "inertia.yz": "kg m2",
}
"""Reported quantities of a body -> unit; the inertia is about the centre of mass, in the axes of the link."""


@dataclass(frozen=True, repr=False)
class QuantityDraws(ShortForm):
    """Draws of one quantity.

    Attributes
    ----------
    draws : (draws,) array
        Draws, in the unit.
    unit : str
        Unit of the quantity.
    """

    draws: Floats
    unit: str

    @property
    def mean(self) -> float:
        """Mean of the draws."""
        return float(self.draws.mean())

    @property
    def sd(self) -> float:
        """Standard deviation of the draws."""
        return float(self.draws.std(ddof=1))

    def interval(self, share: float = 0.95) -> tuple[float, float]:
        """Return the ends of the central interval that contains a share of the draws."""
        low, high = np.quantile(self.draws, [0.5 - 0.5 * share, 0.5 + 0.5 * share]).tolist()
        return low, high

    def to_dict(self) -> dict[str, Any]:
        """Return the quantity in the form that it has in JSON."""
        return quantity(self.mean, self.sd, self.unit)

    def summary(self) -> Summary:
        """Return mean and standard deviation."""
        return Summary([format_spread(self.mean, self.sd, self.unit)])


class CentreOfMass(NamedTuple):
    """Coordinates of a centre of mass in the axes of the link [m]."""

    x: QuantityDraws
    y: QuantityDraws
    z: QuantityDraws


class InertiaTensor(NamedTuple):
    """Entries of an inertia about the centre of mass, in the axes of the link [kg m2]."""

    xx: QuantityDraws
    yy: QuantityDraws
    zz: QuantityDraws
    xy: QuantityDraws
    xz: QuantityDraws
    yz: QuantityDraws


@dataclass(frozen=True, repr=False)
class BodyDraws(ShortForm):
    """Draws of the reported quantities of one body.

    Parameters
    ----------
    name : str
        Name of the link or load.
    values : (draws, 10) array
        Draws of the quantities, in the order and units of `BODY_QUANTITIES`.
    """

    name: str
    values: Floats

    @property
    def mean(self) -> Floats:
        """Mean of the draws, shape (10,)."""
        return self.values.mean(axis=0)

    @property
    def sd(self) -> Floats:
        """Standard deviation of the draws, shape (10,)."""
        return self.values.std(axis=0, ddof=1)

    def __getitem__(self, key: str) -> QuantityDraws:
        """Return a quantity by its name in `BODY_QUANTITIES`, such as ``"com.x"``."""
        return QuantityDraws(self.values[:, list(BODY_QUANTITIES).index(key)], BODY_QUANTITIES[key])

    @property
    def mass(self) -> QuantityDraws:
        """Mass [kg]."""
        return self["mass"]

    @property
    def com(self) -> CentreOfMass:
        """Centre of mass [m]."""
        return CentreOfMass(*(self[f"com.{axis}"] for axis in CentreOfMass._fields))

    @property
    def inertia(self) -> InertiaTensor:
        """Inertia about the centre of mass [kg m2]."""
        return InertiaTensor(*(self[f"inertia.{axes}"] for axes in InertiaTensor._fields))

    def summary(self) -> Summary:
        """Return mean and standard deviation of every quantity."""
        rows = [(f"{self.name}.{key}", str(self[key])) for key in BODY_QUANTITIES]
        return Summary([], ("quantity", "mean ± sd"), rows)


class Linearised(NamedTuple):
    """Reported quantities of all identified bodies, linearised at one point.

    Attributes
    ----------
    names : (n,) tuple of str
        Names of the quantities, such as ``"load.mass"``.
    values : (n,) array
        Values at the linearisation point.
    slope : (n, size) array
        Derivatives of the values by the coordinates.
    """

    names: tuple[str, ...]
    values: Floats
    slope: Floats


def linearise(posterior: Posterior, z: Floats) -> Linearised:
    """Linearise the reported quantities of the identified bodies at the coordinates ``z`` (size,).

    Parameters
    ----------
    posterior : Posterior
    z : (size,) array
        Coordinates.
    """
    names = tuple(f"{prior.name}.{key}" for prior in posterior.model.bodies for key in BODY_QUANTITIES)
    unknowns = posterior.unknowns
    return Linearised(names, quantities_at(unknowns, z), quantity_slopes_at(unknowns, z))


def quantities_at(unknowns: Unknowns, z: Floats) -> Floats:
    """Return the reported quantities of all identified bodies (n,) at coordinates (size,).

    Parameters
    ----------
    unknowns : Unknowns
    z : (size,) array
        Coordinates.
    """
    return np.asarray(_quantities(unknowns.layout, unknowns.numbers, _identified(unknowns), on_device(z)))


def quantity_slopes_at(unknowns: Unknowns, z: Floats) -> Floats:
    """Return their derivatives by the coordinates, shape (n, size).

    Parameters
    ----------
    unknowns : Unknowns
    z : (size,) array
        Coordinates.
    """
    return np.asarray(_quantity_slopes(unknowns.layout, unknowns.numbers, _identified(unknowns), on_device(z)))


def _identified(unknowns: Unknowns) -> Integers:
    return np.array([index for index, prior in enumerate(unknowns.bodies) if not prior.nuisance], dtype=int)


@kept_jit(static=1)
def _quantities(layout: Layout, numbers: PriorNumbers, identified: Traceable, z: Array) -> Array:
    vectors = layout.values(numbers, z).inertial.reshape(-1, len(BODY_QUANTITIES))
    return jnp.ravel(mass_com_inertia(vectors[identified]))


@kept_jit(static=1)
def _quantity_slopes(layout: Layout, numbers: PriorNumbers, identified: Traceable, z: Array) -> Array:
    return jax.jacfwd(lambda z: _quantities(layout, numbers, identified, z))(z)


def bodies_of(posterior: Posterior, z: Floats) -> dict[str, BodyDraws]:
    """Return the reported quantities of the identified bodies at coordinates of many draws, shape (draws, size).

    Parameters
    ----------
    posterior : Posterior
    z : (draws, size) array
        Coordinates.
    """
    inertial = np.asarray(posterior.unknowns.values_of(z).inertial).reshape(len(z), -1, 10)
    return {
        prior.name: BodyDraws(prior.name, mass_com_inertia(inertial[:, index]))
        for index, prior in enumerate(posterior.model.priors)
        if not prior.nuisance
    }


@in_double_precision
def reported_effect(effect: Effect, values: Floats) -> Floats:
    """Return the reported quantities of an effect (..., m) from values of its parameters (..., n).

    Parameters
    ----------
    effect : Effect
    values : (..., n) array
        Values of its parameters, in their units.
    """
    flat = on_device(values.reshape(-1, values.shape[-1]))
    return np.asarray(jax.vmap(effect.report)(flat)).reshape(*values.shape[:-1], len(effect.quantities))


def quantity(mean: float, sd: float, unit: str) -> dict[str, Any]:
    """Return a quantity in the form that all quantities have in JSON.

    Parameters
    ----------
    mean, sd : float
        In the unit.
    unit : str
        Unit of the quantity.
    """
    return {"mean": float(mean), "sd": float(sd), "unit": unit}


def body_dict(body: BodyDraws) -> dict[str, Any]:
    """Return a body in the form that it has in identification.json."""
    inertia = {axes: entry.to_dict() for axes, entry in body.inertia._asdict().items()}
    return {"mass": body.mass.to_dict(), "com": [entry.to_dict() for entry in body.com], "inertia": inertia}


CONTRACTED, PRIOR_ONLY = 0.5, 0.1
"""Shrinkage from which on a quantity counts as learnt, and below which its posterior is little more than the prior."""


class ContractionVerdict(Enum):
    """Verdict on the posterior contraction of one quantity."""

    CONTRACTED = "learnt"
    WEAKLY = "weakly"
    NOT = "not learnt"

    @classmethod
    def of(cls, shrinkage: float) -> ContractionVerdict:
        """Return the verdict on a shrinkage, by the thresholds `CONTRACTED` and `PRIOR_ONLY`."""
        if shrinkage >= CONTRACTED:
            return cls.CONTRACTED
        return cls.WEAKLY if shrinkage >= PRIOR_ONLY else cls.NOT


class Contraction(NamedTuple):
    """Posterior contraction of one quantity.

    Attributes
    ----------
    prior_sd : float
        Standard deviation of the prior, from its central 68 %, in the unit of the quantity.
    shrinkage : float
        One minus the ratio of posterior to prior width.
    """

    prior_sd: float
    shrinkage: float

    @property
    def verdict(self) -> ContractionVerdict:
        """Verdict on the shrinkage."""
        return ContractionVerdict.of(self.shrinkage)

    def to_dict(self) -> dict[str, Any]:
        """Return the contraction in the form that it has in JSON."""
        return {"prior_sd": self.prior_sd, "shrinkage": self.shrinkage, "verdict": self.verdict.value}


def compare(names: Sequence[str], prior: Floats, posterior: Floats) -> dict[str, Contraction]:
    """Compare draws of n quantities from prior and posterior, shapes (draws, n).

    A width is half the range of the central 68 %, which for a normal distribution is the standard deviation and is
    finite for every distribution.

    Parameters
    ----------
    names : (n,) sequence of str
        Names of the quantities.
    prior, posterior : (draws, n) arrays
        Draws, in the units of the quantities.
    """
    before, after = half_range(prior), half_range(posterior)
    return {
        name: Contraction(float(wide), float(1.0 - narrow / wide))
        for name, wide, narrow in zip(names, before, after, strict=True)
    }


def half_range(draws: Floats) -> Floats:
    """Return half the range of the central 68 % of the draws (m, n), shape (n,)."""
    low, high = np.quantile(draws, [0.16, 0.84], axis=0)
    return np.asarray(0.5 * (high - low))
