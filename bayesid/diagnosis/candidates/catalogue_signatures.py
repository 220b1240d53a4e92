"""Signatures of the catalogue's effects in amplitudes that are zero where the effect is absent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.candidates.signature_bank import SignatureBank, Signatures
from bayesid.diagnosis.evidence.body_evidence import MissingBody, rigid_moments
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.response.perturbation import tables_of
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.simulation.effects.arm_effects import Payload
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import PhysicalBound
from bayesid.simulation.effects.mass_shift import MassShift

__all__ = ["MOMENT_UNITS", "amplitude_signatures", "catalogue_signatures", "group_names", "moment_spreads"]

MOMENT_UNITS = ("kg", "kg m", "kg m2")
"""Units of mass, first and second moments, in which a body that is missing is linear."""

REACHES = (1.0, 0.25, 0.0625)
"""Distances of a missing body from the origin, relative to the longest, that are equally probable beforehand."""

RADII = (0.25, 0.0625, 0.015625)
"""Radii of gyration of a missing body relative to the longest distance, equally probable beforehand."""


def moment_spreads(units: Sequence[str], reach: float) -> list[Floats]:
    """Return variances of mass, first and second moments relative to the mass, for each of some reaches.

    A body within a distance ``l`` has moments of the order of its mass times ``l`` and ``l^2``.

    Parameters
    ----------
    units : sequence of str
        Unit of each amplitude.
    reach : float
        Longest distance [m].
    """
    powers = np.array([MOMENT_UNITS.index(unit) for unit in units])
    return [(share * reach) ** (2.0 * powers) for share in REACHES]


def catalogue_signatures(
    perturbed: PerturbedModel, fit: Fit, effects: Sequence[Effect], bounds: Mapping[str, Sequence[PhysicalBound]]
) -> SignatureBank:
    """Return the bank of the effects that have one form: neither a frequency nor an instant.

    Parameters
    ----------
    perturbed : PerturbedModel
    fit : Fit
        About which the signatures are taken.
    effects : sequence of Effect
    bounds : mapping of str to sequence of PhysicalBound
        Of each effect, by its label (`bounds_by_label`).
    """
    signatures: dict[str, Signatures] = {}
    causes = []
    wanted = [effect for effect in effects if not effect.modes_count and not isinstance(effect, MassShift)]
    others = [effect for effect in wanted if effect.amplitude_units != MOMENT_UNITS]
    columns = iter(_linear(perturbed, fit, others))
    for effect in wanted:
        sizes = {bound.unit: bound.largest for bound in bounds[effect.label]}
        if effect.amplitude_units == MOMENT_UNITS:
            name = group_names(effect)[MOMENT_UNITS[0]]
            if name not in signatures:
                signatures[name] = Signatures(name, _moments(perturbed, fit, effect))
            units = [quantity.unit for quantity in effect.amplitude_quantities]
            reach = sizes["kg m"] / sizes["kg"]
            groups = [(AmplitudeGroup(name, sizes["kg"], spread=own),) for own in moment_spreads(units, reach)]
            radii = tuple(share * reach for share in RADII)
            body = MissingBody(sizes["kg"], reach, radii, rigid_moments) if isinstance(effect, Payload) else None
            causes.append(CandidateCause(effect.label, groups[0], others=tuple(groups[1:]), body=body))
            continue
        found = amplitude_signatures(effect, next(columns), len(perturbed.posterior.manoeuvres))
        signatures |= {item.name: item for item in found.values()}
        if not sizes:
            (item,) = found.values()
            causes.append(CandidateCause(effect.label, (AmplitudeGroup(item.name, 1.0),), fixed=True))
        else:
            groups_of_units = tuple(AmplitudeGroup(item.name, sizes[unit]) for unit, item in found.items())
            causes.append(CandidateCause(effect.label, groups_of_units))
    return SignatureBank(tuple(signatures.values()), tuple(causes))


def _linear(perturbed: PerturbedModel, fit: Fit, effects: Sequence[Effect]) -> list[Floats]:
    """Return the derivatives of the residual in the coordinates of each effect in amplitudes, (N, n)."""
    points = [(effect.in_amplitudes(), _start(perturbed, effect.in_amplitudes())) for effect in effects]
    return perturbed.columns(points, fit.operating, fit.z, fit.data)


def _start(perturbed: PerturbedModel, linear: Effect) -> Floats:
    return np.tile(linear.starts[0], len(perturbed.posterior.manoeuvres) if linear.per_recording else 1)


def amplitude_signatures(effect: Effect, columns: Floats, recordings: int) -> dict[str, Signatures]:
    """Return the signatures of an effect by the unit of their amplitudes.

    Parameters
    ----------
    effect : Effect
    columns : (N, n) array
        Derivatives of the residual in the coordinates of the effect in amplitudes.
    recordings : int
        Number of recordings.
    """
    linear = effect.in_amplitudes()
    if not linear.parameters:
        return {"1": Signatures(effect.label, columns)}
    times = recordings if effect.per_recording else 1
    columns = columns / np.tile([parameter.sigma for parameter in linear.parameters], times)
    units = np.tile([parameter.unit for parameter in linear.parameters], times)
    return {unit: Signatures(name, columns[:, units == unit]) for unit, name in group_names(effect).items()}


def group_names(effect: Effect) -> dict[str, str]:
    """Return the names of an effect's groups in the Gram, by the unit of their amplitudes.

    The ten moments of a link are one group, whatever changes them.
    """
    units = effect.amplitude_units
    if units == MOMENT_UNITS:
        return dict.fromkeys(units, f"moments of {effect.link}")
    return {unit: f"{effect.label} [{unit}]" if len(units) > 1 else effect.label for unit in units}


def _moments(perturbed: PerturbedModel, fit: Fit, effect: Effect) -> Floats:
    """Return the signatures of the ten linear parameters of a link."""
    table = tables_of(effect, perturbed.posterior)
    rows, samples = np.moveaxis(table.node, -1, 0), np.moveaxis(table.sample, -1, 0)
    return perturbed.respond(perturbed.perturbation(len(rows), node_rows=rows, sample_rows=samples), fit.z, fit.data)
