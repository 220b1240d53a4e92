"""Causes that are linear in amplitudes which are zero where they are absent: all but a few of the catalogue."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.diagnosis.candidates.cause_kind import Bounds, CauseKind
from bayesid.diagnosis.candidates.linear_model import Linearisation, SignatureBank, Signatures
from bayesid.diagnosis.evidence.body_evidence import MissingBody, rigid_moments
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.response.perturbation import tables_of
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import Quantity

__all__ = ["LinearCause", "amplitude_signatures", "group_names", "moment_spreads", "not_weighable"]

MOMENT_UNITS = ("kg", "kg m", "kg m2")
"""Units of mass, first and second moments, in which a body that is missing is linear."""

REACHES = (1.0, 0.25, 0.0625)
"""Distances of a missing body from the origin, relative to the longest, that are equally probable beforehand."""

RADII = (0.25, 0.0625, 0.015625)
"""Radii of gyration of a missing body relative to the longest distance, equally probable beforehand."""


class LinearCause(CauseKind):
    """Causes of one form, in which the residual is linear where they are small: neither a frequency nor an instant."""

    name = "linear"
    one_form = True

    def check(self, effect: Effect) -> None:
        """Raise an `InputError` if an effect vibrates, or has shapes besides its amplitudes."""
        if effect.modes_count:
            problem = "a user-defined vibration has no bounds from which its evidence could be computed"
            raise not_weighable(effect, problem, "Derive it from FlexibleAppendage or FuelSlosh")
        shapes = [parameter.name for parameter in effect.in_amplitudes().parameters if not parameter.is_amplitude]
        if shapes and effect.amplitude_units != MOMENT_UNITS:
            raise not_weighable(
                effect,
                f"it is not linear in {', '.join(shapes)}, whose prior is not a normal distribution about zero",
                "Override in_amplitudes and amplitudes with a form that has amplitudes alone",
            )

    def signatures(
        self, perturbed: PerturbedModel, fit: Fit, effects: Sequence[Effect], bounds: Bounds
    ) -> SignatureBank:
        """Return the bank of effects, in which links that may have a body of their own share a group of moments."""
        signatures: dict[str, list[Signatures]] = {}
        causes = []
        recordings = len(perturbed.posterior.manoeuvres)
        others = [effect.in_amplitudes() for effect in effects if effect.amplitude_units != MOMENT_UNITS]
        points = [(form, np.tile(form.starts[0], recordings if form.per_recording else 1)) for form in others]
        responses = iter(perturbed.responses(points, fit.operating, fit.z, fit.data))
        for effect in effects:
            sizes = {bound.unit: bound.largest for bound in bounds[effect.label]}
            if effect.amplitude_units == MOMENT_UNITS:
                name = group_names(effect)[MOMENT_UNITS[0]]
                if name not in signatures:
                    signatures[name] = [Signatures(name, _moments(perturbed, fit, effect))]
                reach = sizes["kg m"] / sizes["kg"]
                spreads = moment_spreads([quantity.unit for quantity in effect.amplitude_quantities], reach)
                groups = [(AmplitudeGroup(name, sizes["kg"], spread=spread),) for spread in spreads]
                body = None
                if effect.is_added_body:
                    radii = tuple(share * reach for share in RADII)
                    body = MissingBody(sizes["kg"], reach, radii, rigid_moments)
                causes.append(CandidateCause(effect.label, groups[0], others=tuple(groups[1:]), body=body))
                continue
            by_unit = _of_recordings(effect, next(responses))
            signatures |= {items[0].name: items for items in by_unit.values()}
            if sizes:
                first, *more = _forms(effect, by_unit, sizes)
                causes.append(CandidateCause(effect.label, first, others=tuple(more)))
            else:
                (items,) = by_unit.values()
                causes.append(CandidateCause(effect.label, (AmplitudeGroup(items[0].name, 1.0),), fixed=True))
        return SignatureBank(tuple(item for items in signatures.values() for item in items), tuple(causes))

    def present(self, fit: Fit) -> dict[str, Floats]:
        """Return the amplitudes of the fit's effects, of those that are there or not one."""
        found: dict[str, Floats] = {}
        for index, effect in enumerate(fit.effects):
            if effect.cause_kind != self.name:
                continue
            if not effect.parameters:
                found[effect.label] = np.ones(1)
                continue
            names, values = group_names(effect), fit.values(index).ravel()
            units = np.resize([parameter.unit for parameter in effect.parameters], len(values))
            for name in dict.fromkeys(names.values()):
                own = values[np.isin(units, [unit for unit, other in names.items() if other == name])]
                found[name] = found[name] + own if name in found else own
        return found

    def starts(self, effect: Effect, point: Linearisation, names: Sequence[str]) -> Sequence[Floats]:
        """Return the mean amplitudes by the linear model, recording after recording where each has its own."""
        if effect.in_amplitudes() is not effect or not effect.parameters:
            return effect.starts
        by_unit = point.mean_amplitudes(effect.label, names)
        sigma = np.resize([parameter.sigma for parameter in effect.parameters], by_unit.shape)
        units = np.resize([parameter.unit for parameter in effect.parameters], by_unit.shape)
        mean = np.zeros_like(by_unit)
        mean[np.concatenate([np.flatnonzero(units == unit) for unit in effect.amplitude_units])] = by_unit
        return [mean / sigma]

    def quantities(self, effects: Sequence[Effect]) -> dict[str, tuple[Quantity, ...]]:
        """Return the amplitudes of effects, those of one unit together."""
        return {
            effect.label: tuple(sorted(effect.amplitude_quantities, key=lambda item: units.index(item.unit)))
            for effect in effects
            for units in [effect.amplitude_units]
        }


def not_weighable(effect: Effect, problem: str, remedy: str) -> InputError:
    """Return the error of an effect of the user's own that a diagnosis could not weigh.

    Parameters
    ----------
    effect : Effect
    problem, remedy : str
        What is wrong with it, and what would mend it.
    """
    return InputError(
        problem,
        file=inspect.getsourcefile(type(effect)),
        place=f"effect {effect.label!r}",
        remedy=f"{remedy}, or let instances return none, so that it is no candidate",
    )


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


def _of_recordings(effect: Effect, responses: Floats) -> dict[str, list[Signatures]]:
    """Return the signatures of an effect by unit, of each recording by itself where each has its own amplitudes.

    Parameters
    ----------
    effect : Effect
    responses : (R, N / R, n) array
    """
    if not effect.per_recording:
        whole = amplitude_signatures(effect, responses.reshape(-1, responses.shape[-1]), 1)
        return {unit: [item] for unit, item in whole.items()}
    each = [amplitude_signatures(effect, part, 1) for part in responses]
    return {unit: [replace(of[unit], recording=r) for r, of in enumerate(each)] for unit in each[0]}


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


def _forms(
    effect: Effect, by_unit: Mapping[str, Sequence[Signatures]], sizes: Mapping[str, float]
) -> list[tuple[AmplitudeGroup, ...]]:
    """Return the groups of an effect in each form of its prior."""
    units = np.array([quantity.unit for quantity in effect.amplitude_quantities])
    forms = []
    for shape in np.array(effect.amplitude_shapes):
        groups = []
        for unit, items in by_unit.items():
            count = sum(item.columns.shape[1] for item in items)
            spread = np.resize(shape[units == unit] ** 2, count)
            groups.append(AmplitudeGroup(items[0].name, sizes[unit], spread=spread))
        forms.append(tuple(groups))
    return forms


def _moments(perturbed: PerturbedModel, fit: Fit, effect: Effect) -> Floats:
    """Return the signatures of the ten linear parameters of a link."""
    table = tables_of(effect, perturbed.posterior)
    rows, samples = np.moveaxis(table.node, -1, 0), np.moveaxis(table.sample, -1, 0)
    return perturbed.respond(perturbed.perturbation(len(rows), node_rows=rows, sample_rows=samples), fit.z, fit.data)
