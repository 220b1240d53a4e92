"""Signatures of a mass that moves over inside the base, at instants of a grid in each recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.candidates.signature_bank import SignatureBank, Signatures
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.inference.residual_view import by_recording
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import PhysicalBound
from bayesid.simulation.effects.mass_shift import MassShift

__all__ = ["jump_signatures", "mass_shift_signatures", "sample_intervals", "shift_instants", "shift_spread"]

INSTANTS = 16
"""Instants of the grid in each recording."""


def shift_instants(end: float) -> Floats:
    """Return the instants of the grid in a recording of some length [s]."""
    return end * (np.arange(INSTANTS) + 0.5) / INSTANTS


def mass_shift_signatures(
    perturbed: PerturbedModel, fit: Fit, effects: Sequence[Effect], bounds: Mapping[str, Sequence[PhysicalBound]]
) -> SignatureBank:
    """Return the bank of jumps of the base's moments; an empty one where such a jump is no candidate.

    Its forms are one jump in one recording, at any instant of the grid. The recordings are independent given the
    unknowns, so that one push acts on all of them at once.

    Parameters
    ----------
    perturbed : PerturbedModel
    fit : Fit
        About which the signatures are taken.
    effects : sequence of Effect
        Candidates of the catalogue.
    bounds : mapping of str to sequence of PhysicalBound
        Of each candidate, by its label.
    """
    shift = next((effect for effect in effects if isinstance(effect, MassShift)), None)
    if shift is None:
        return SignatureBank()
    ends = np.asarray(fit.operating.node.environment.time).max(axis=1)
    grid = np.stack([shift_instants(float(end)) for end in ends])
    columns = jump_signatures(perturbed, fit, grid)
    size, spread = shift_spread(bounds[shift.label])
    signatures = [
        Signatures(
            f"{shift.label} at {instant:.5g} s in recording {r + 1}",
            columns[r, k],
            r,
            instants=tuple(float(instant) if other == r else np.inf for other in range(len(ends))),
        )
        for r, row in enumerate(grid)
        for k, instant in enumerate(row)
    ]
    forms = [(AmplitudeGroup(item.name, size, spread=spread),) for item in signatures]
    return SignatureBank(tuple(signatures), (CandidateCause(shift.label, forms[0], others=tuple(forms[1:])),))


def sample_intervals(fit: Fit) -> list[Floats]:
    """Return the intervals between the sampling times of each recording [s], without the copies that fill its grid."""
    steps = np.diff(np.asarray(fit.operating.sample.environment.time), axis=1)
    return [row[row > 0.0] for row in steps]


def shift_spread(bounds: Sequence[PhysicalBound]) -> tuple[float, Floats]:
    """Return the bound of the first moments [kg m], and the variances of all nine relative to its square."""
    sizes = {bound.unit: bound.largest for bound in bounds}
    return sizes["kg m"], np.repeat([1.0, (sizes["kg m2"] / sizes["kg m"]) ** 2], [3, 6])


def jump_signatures(perturbed: PerturbedModel, fit: Fit, instants: Floats) -> Floats:
    """Return the responses of each recording to unit moments that jump at some instants of its own.

    Parameters
    ----------
    perturbed : PerturbedModel
    fit : Fit
    instants : (R, K) array
        Instants in each recording [s]; infinite ones change nothing.

    Returns
    -------
    (R, K, rows, 9) array
    """
    tables = []
    for side in (fit.operating.node, fit.operating.sample):
        time = np.asarray(side.environment.time)
        own = [[MassShift.table_at(time[r], instant) for r, instant in enumerate(row)] for row in instants.T]
        tables.append(np.moveaxis(np.array(own), -1, 1))  # (K, 9, R, T, 28)
    some, count = tables[0].shape[:2]
    rows = [part.reshape(some * count, *part.shape[2:]) for part in tables]
    push = perturbed.perturbation(some * count, node_rows=rows[0], sample_rows=rows[1])
    found = by_recording(fit.posterior, perturbed.respond(push, fit.z, fit.data))
    return np.moveaxis(found.reshape(*found.shape[:2], some, count), 2, 1)
