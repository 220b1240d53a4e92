"""Signatures of hidden vibrations: the coupling of oscillators with the base, at frequencies of a grid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.candidates.catalogue_signatures import moment_spreads
from bayesid.diagnosis.candidates.signature_bank import SignatureBank, Signatures
from bayesid.diagnosis.evidence.body_evidence import MissingBody, outer_moments
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import PhysicalBound
from bayesid.simulation.effects.internal_effects import FlexibleAppendage, FuelSlosh

__all__ = [
    "DAMPING",
    "FREQUENCIES",
    "PAIRS",
    "coupling_matrix",
    "missing_body",
    "slosh_entries",
    "tone_couplings",
    "tone_forms",
    "tone_signature",
    "vibration_signatures",
]

PAIRS = [(i, j) for i in range(6) for j in range(i, 6)]
"""Entries of the symmetric coupling matrix: the base's acceleration by the spring's momentum, linear before angular."""

FREQUENCIES = (0.02, 0.027, 0.036, 0.048, 0.065, 0.087, 0.115, 0.155, 0.21, 0.28, 0.37, 0.5, 0.67, 0.9)
"""Frequencies of the grid [Hz]."""

DAMPING = 0.02
"""Damping of the grid relative to critical, so that a tone between two frequencies is seen at either."""

GRID = tuple((frequency, DAMPING) for frequency in FREQUENCIES)
"""Frequency and damping of every form."""


def vibration_signatures(
    perturbed: PerturbedModel,
    fit: Fit,
    effects: Sequence[Effect],
    bounds: Mapping[str, Sequence[PhysicalBound]],
    tones: Sequence[tuple[float, float]] = GRID,
) -> SignatureBank:
    """Return the bank of hidden vibrations, each of the catalogue's with one form per frequency.

    A set of oscillators of one frequency and damping couples the six accelerations of the base with its own momentum by
    a symmetric matrix, the sum over its modes of the outer products of `Modes.linear` and `Modes.angular`. Its 21
    entries are the amplitudes of an appendage. Those of a mass on equal springs along three axes have only ten free
    combinations: its mass, first and second moments.

    Parameters
    ----------
    perturbed : PerturbedModel
    fit : Fit
        About which the signatures are taken.
    effects : sequence of Effect
        Of which those that vibrate are taken.
    bounds : mapping of str to sequence of PhysicalBound
        Of each effect, by its label.
    tones : sequence of pairs of float
        Frequencies [Hz] and damping ratios of the grid.
    """
    wanted = [effect for effect in effects if effect.modes_count]
    signatures: list[Signatures] = []
    groups: dict[str, list[Signatures]] = {effect.label: [] for effect in wanted}
    for tone in tones if wanted else ():
        couplings = tone_couplings(perturbed, fit, tone)
        for effect in wanted:
            item = tone_signature(effect, tone, couplings)
            signatures.append(item)
            groups[effect.label].append(item)
    causes = []
    for effect in wanted:
        forms = [form for item in groups[effect.label] for form in tone_forms(effect, item.name, bounds[effect.label])]
        body = missing_body(effect, bounds[effect.label])
        causes.append(CandidateCause(effect.label, forms[0], others=tuple(forms[1:]), body=body))
    return SignatureBank(tuple(signatures), tuple(causes))


def tone_signature(effect: Effect, tone: tuple[float, float], couplings: Floats) -> Signatures:
    """Return the signatures of a vibration of one frequency [Hz] and damping, of those of its coupling (N, 21)."""
    name = f"{effect.label} at {tone[0]:.6g} Hz, damping {tone[1]:.3g}"
    columns = couplings @ slosh_entries() if isinstance(effect, FuelSlosh) else couplings
    return Signatures(name, columns, tone=tone)


def tone_forms(effect: Effect, name: str, bounds: Sequence[PhysicalBound]) -> list[tuple[AmplitudeGroup, ...]]:
    """Return the forms of a vibration at one tone, of which slosh has one for each of two reaches of the tank."""
    sizes = {bound.unit: bound.largest for bound in bounds}
    if isinstance(effect, FuelSlosh):
        units = ("kg", *("kg m",) * 3, *("kg m2",) * 6)
        spreads = moment_spreads(units, _reach(effect))[:2]
        return [(AmplitudeGroup(name, sizes["kg"], spread=own),) for own in spreads]
    if isinstance(effect, FlexibleAppendage):
        root = np.repeat([sizes["sqrt(kg)"], sizes["sqrt(kg) m"]], 3)
        return [(AmplitudeGroup(name, 1.0, spread=np.array([(root[i] * root[j]) ** 2 for i, j in PAIRS])),)]
    raise TypeError(f"{effect.label!r}: the coupling of this vibration has no bounds")


def missing_body(effect: Effect, bounds: Sequence[PhysicalBound]) -> MissingBody | None:
    """Return the body that swings, which for slosh is a point mass in the spacecraft; None for others."""
    if not isinstance(effect, FuelSlosh):
        return None
    (size,) = bounds
    return MissingBody(size.largest, _reach(effect), (0.0,), outer_moments)


def _reach(effect: Effect) -> float:
    """Return the largest distance of a tank from the base origin along an axis [m]."""
    return max(parameter.sigma + abs(parameter.mean) for parameter in effect.parameters[3:])


def coupling_matrix(entries: Floats) -> Floats:
    """Return the symmetric coupling matrix, (6, 6), of 21 entries in the order of `PAIRS`."""
    matrix = np.zeros((6, 6))
    for value, (i, j) in zip(entries, PAIRS, strict=True):
        matrix[i, j] = matrix[j, i] = value
    return matrix


def slosh_entries() -> Floats:
    """Return the 21 entries of the coupling, (21, 10), per mass, first moment x y z and second xx xy yy xz yz zz.

    With ``p`` the place of a mass ``m``, the matrix is ``m [[1, -[p]], [[p], [p][p]']]``, where ``[p]`` is the matrix
    of the cross product and ``[p][p]' = p'p 1 - p p'``.
    """
    matrices = np.zeros((10, 6, 6))
    matrices[0, :3, :3] = np.eye(3)
    for axis in range(3):
        cross = np.cross(np.eye(3)[axis], np.eye(3)).T  # maps v to axis x v
        matrices[1 + axis, 3:, :3] = cross
        matrices[1 + axis, :3, 3:] = cross.T
    for index, (i, j) in enumerate([(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)]):
        outer = np.zeros((3, 3))
        outer[i, j] = outer[j, i] = 1.0
        matrices[4 + index, 3:, 3:] = np.trace(outer) * np.eye(3) - outer
    return np.array([[matrix[i, j] for matrix in matrices] for i, j in PAIRS])


def tone_couplings(perturbed: PerturbedModel, fit: Fit, tone: tuple[float, float]) -> Floats:
    """Return the responses to unit entries of the coupling matrix at a frequency [Hz] and damping, (N, 21)."""
    rows = fit.operating.vibration.coupling_rows(*tone, PAIRS)
    perturbation = perturbed.perturbation(len(PAIRS), node_rows=rows[0], sample_rows=rows[1])
    return perturbed.respond(perturbation, fit.z, fit.data)
