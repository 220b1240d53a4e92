"""Hidden vibrations: the coupling of oscillators with the base, at frequencies of a grid and then between them.

A set of oscillators of one frequency and damping couples the six accelerations of the base with its own momentum by a
symmetric matrix, the sum over its modes of the outer products of `Modes.linear` and `Modes.angular`. Its 21 entries are
the amplitudes of an appendage. Those of a mass on equal springs along three axes have only ten free combinations: its
mass, first and second moments.

A vibration of little damping is seen within a few per cent of its frequency only, and beside it the tones of the grid
earn what follows the base's acceleration anyway. All cells of the grid that earn much are therefore scanned in steps of
the width of a resonance, and the best tone is sought from there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from bayesid._math.arrays import Floats, log_sum
from bayesid._math.double_precision import in_double_precision
from bayesid.diagnosis.candidates.cause_kind import Bounds, CauseKind, companies
from bayesid.diagnosis.candidates.linear_cause import moment_spreads, not_weighable
from bayesid.diagnosis.candidates.linear_model import Linearisation, Remaining, SignatureBank, Signatures
from bayesid.diagnosis.evidence.body_evidence import MissingBody, outer_moments
from bayesid.diagnosis.evidence.cause_sets import SetProbabilities
from bayesid.diagnosis.evidence.scale_integral import GroupSpectrum, log_evidences
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.response.perturbation import physical
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import PhysicalBound
from bayesid.simulation.instant import Resonance

__all__ = ["PAIRS", "VibrationCause", "coupling_matrix", "slosh_entries"]

PAIRS = [(i, j) for i in range(6) for j in range(i, 6)]
"""Entries of the symmetric coupling matrix: the base's acceleration by the spring's momentum, linear before angular."""

FREQUENCIES = (0.02, 0.027, 0.036, 0.048, 0.065, 0.087, 0.115, 0.155, 0.21, 0.28, 0.37, 0.5, 0.67, 0.9)
"""Frequencies of the grid [Hz]."""

DAMPING = 0.02
"""Damping of the grid relative to critical, so that a tone between two frequencies is seen at either."""

DAMPINGS = (0.003, 0.008, DAMPING, 0.05)
"""Dampings that are equally probable beforehand."""

SCANNED = 0.5
"""Log evidence relative to that of the best tone of the grid from which the cell of a tone is scanned."""

RESONANCE = DAMPING
"""Step of the scan in the logarithm of the frequency: half of the width of a resonance of the grid's damping."""

POINTS = 5
"""Tones tried on either side of the best one in each of two finer grids."""

NEAR, MOST = 8.0, 10
"""Nats below the best tone down to which tones are kept as forms, and how many of them at most."""

LIGHTEST = 0.25
"""Smallest share of a mode's mass that the compliance of the base is taken to leave at the start of a fit."""

Tone = tuple[float, float]
"""Frequency [Hz] and damping ratio."""


class VibrationCause(CauseKind):
    """Vibrations, each with one form per tone; a mass that swings on equal springs has one per reach of its place, too.

    Those of a set are tuned in Gram space and then fitted: their frequencies are not linear.
    """

    name = "vibration"
    weighed_by_fits = True

    def check(self, effect: Effect) -> None:
        """Raise an `InputError` if an effect has no modes, or no bounds of their coupling."""
        known = ("kg",) if effect.reach_of_swing is not None else ("sqrt(kg)", "sqrt(kg) m")
        if not effect.modes_count or not set(known) <= set(effect.amplitude_units):
            problem = f"a vibration needs modes, and amplitudes in {' and '.join(known)}"
            raise not_weighable(effect, problem, "Derive it from FlexibleAppendage or FuelSlosh")

    def signatures(
        self, perturbed: PerturbedModel, fit: Fit, effects: Sequence[Effect], bounds: Bounds
    ) -> SignatureBank:
        """Return the bank of vibrations at the frequencies of the grid."""
        signatures: list[Signatures] = []
        forms: dict[str, list[tuple[AmplitudeGroup, ...]]] = {effect.label: [] for effect in effects}
        for frequency in FREQUENCIES if effects else ():
            tone = (frequency, DAMPING)
            couplings = tone_couplings(perturbed, fit, tone)
            for effect in effects:
                signatures.append(tone_signature(effect, tone, couplings))
                forms[effect.label] += _tone_forms(effect, signatures[-1].name, bounds[effect.label])
        causes = []
        for effect in effects:
            first, *others = forms[effect.label]
            body = _swinging_body(effect, bounds[effect.label])
            causes.append(CandidateCause(effect.label, first, others=tuple(others), body=body))
        return SignatureBank(tuple(signatures), tuple(causes))

    def plausible(self, found: SetProbabilities, effects: Sequence[Effect], least: float) -> dict[str, tuple[str, ...]]:
        """Return all vibrations where one is plausible, each with its company in its most probable set."""
        labels, inclusion = [effect.label for effect in effects], found.inclusion
        return companies(found, labels) if any(inclusion[label] > least for label in labels) else {}

    def refined(
        self, point: Linearisation, found: SetProbabilities, effects: Sequence[Effect], bounds: Bounds, least: float
    ) -> Linearisation:
        """Return the linear model with finer tones of plausible vibrations around their best ones.

        The cells of the grid that were scanned are replaced by the best of the tones tried in them, each with the share
        of the prior that it stands for: uniform in the logarithm of the frequency, and equal for four dampings. Tones
        that are far less probable are left out.
        """
        beside = self.plausible(found, effects, least)
        couplings = _Couplings(point.perturbed, point.fit)
        bank = point.bank
        for effect in effects:
            if effect.label in beside:
                tuned = _tuned(point, effect, bounds[effect.label], list(beside[effect.label]), couplings)
                causes = tuple(cause for cause in bank.causes if cause.name != effect.label)
                bank = SignatureBank.joined([replace(bank, causes=causes), tuned])
        return point.with_bank(bank) if beside else point

    def starts(self, effect: Effect, point: Linearisation, names: Sequence[str]) -> Sequence[Floats]:
        """Return the start at the most probable tone and coupling, its frequency that of the base held still."""
        amplitudes = point.mean_amplitudes(effect.label, names)
        entries = slosh_entries() @ amplitudes if effect.reach_of_swing is not None else amplitudes
        frequency, damping = point.most_probable_form(effect.label, names).tone or (0.1, 0.01)
        coupling = coupling_matrix(entries)
        (start,) = effect.starts_near([Resonance(frequency, coupling, damping)], False)
        clamped = frequency * _clamped_to_free(effect, start, point)
        return effect.starts_near([Resonance(clamped, coupling, damping)], False)


@in_double_precision
def _clamped_to_free(effect: Effect, start: Floats, point: Linearisation) -> float:
    """Return the frequency of a vibration with the base held, relative to the tone that is seen with the base free.

    The base yields to the spring, as if the modes were lighter by their coupling through the base's compliance.
    """
    modes = effect.modes(jnp.asarray(physical(effect, start)))
    coupling = np.concatenate([np.asarray(modes.linear), np.asarray(modes.angular)], axis=-1)
    compliance = point.fit.operating.vibration.compliance.mean(axis=(0, 1))
    lighter = np.linalg.eigvalsh(np.eye(len(coupling)) - coupling @ compliance @ coupling.T)
    return float(np.sqrt(np.clip(lighter, LIGHTEST, 1.0).mean()))


def tone_signature(effect: Effect, tone: tuple[float, float], couplings: Floats) -> Signatures:
    """Return the signatures of a vibration of one frequency [Hz] and damping, of those of its coupling (N, 21)."""
    name = f"{effect.label} at {tone[0]:.6g} Hz, damping {tone[1]:.3g}"
    columns = couplings @ slosh_entries() if effect.reach_of_swing is not None else couplings
    return Signatures(name, columns, tone=tone)


def _tone_forms(effect: Effect, name: str, bounds: Sequence[PhysicalBound]) -> list[tuple[AmplitudeGroup, ...]]:
    """Return the forms of a vibration at one tone, of which slosh has one for each of two reaches of the tank."""
    sizes = {bound.unit: bound.largest for bound in bounds}
    if effect.reach_of_swing is not None:
        units = ("kg", *("kg m",) * 3, *("kg m2",) * 6)
        spreads = moment_spreads(units, effect.reach_of_swing)[:2]
        return [(AmplitudeGroup(name, sizes["kg"], spread=spread),) for spread in spreads]
    root = np.repeat([sizes["sqrt(kg)"], sizes["sqrt(kg) m"]], 3)
    return [(AmplitudeGroup(name, 1.0, spread=np.array([(root[i] * root[j]) ** 2 for i, j in PAIRS])),)]


def _swinging_body(effect: Effect, bounds: Sequence[PhysicalBound]) -> MissingBody | None:
    """Return the point mass that swings, or None where the coupling is free."""
    if effect.reach_of_swing is None:
        return None
    (size,) = bounds
    return MissingBody(size.largest, effect.reach_of_swing, (0.0,), outer_moments)


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


class _Tried(NamedTuple):
    """A tone that was tried.

    signature: its columns; log_evidence: beside the other causes, averaged over the forms at this tone.
    """

    signature: Signatures
    log_evidence: float


class _Couplings:
    """Responses to the coupling entries of tones, each computed once for all vibrations."""

    def __init__(self, perturbed: PerturbedModel, fit: Fit) -> None:
        self._perturbed, self._fit = perturbed, fit
        self._known: dict[Tone, Floats] = {}

    def at(self, tone: Tone) -> Floats:
        """Return the columns of one tone, (N, 21)."""
        if tone not in self._known:
            self._known[tone] = tone_couplings(self._perturbed, self._fit, tone)
        return self._known[tone]


def _tuned(
    point: Linearisation,
    effect: Effect,
    bounds: Sequence[PhysicalBound],
    others: Sequence[str],
    couplings: _Couplings,
) -> SignatureBank:
    """Return the bank of one vibration with the cells of its best tones resolved."""
    evidence = point.evidence
    cause, forms = evidence.causes[effect.label], evidence.forms(others)
    left = Remaining.of(point, others, forms)
    tried: dict[Tone, _Tried] = {}

    def value(log_frequency: float, damping: float) -> float:
        tone = (float(f"{np.exp(log_frequency):.5g}"), damping)
        if tone not in tried:
            item = tone_signature(effect, tone, couplings.at(tone))
            own = [groups[0] for groups in _tone_forms(effect, item.name, bounds)]
            spectra = GroupSpectrum.of(own, left.gram(item.columns, item.name))
            tried[tone] = _Tried(item, log_sum(log_evidences(spectra)) - float(np.log(len(own))))
        return tried[tone].log_evidence

    cells = _cells(evidence.gains_beside(others, forms, [effect.label])[effect.label], cause)
    scan = np.concatenate([_scan(cell) for cell in cells])
    best = float(max(scan, key=lambda log: value(log, DAMPING)))
    damping, reach = DAMPING, RESONANCE
    for _ in range(2):
        best = float(max(best + reach * np.linspace(-1.0, 1.0, 2 * POINTS + 1), key=lambda log: value(log, damping)))
        damping = max(DAMPINGS, key=lambda own: value(best, own))
        reach /= POINTS
    return _resolved(point.bank, effect, cause, cells, scan, tried, bounds)


def _edges(cell: int) -> tuple[float, float]:
    """Return the ends of a cell of the grid in the logarithm of the frequency."""
    logs = np.log(FREQUENCIES)
    middle = 0.5 * (logs[1:] + logs[:-1])
    ends = np.concatenate([[logs[0] - 0.5 * (logs[1] - logs[0])], middle, [logs[-1] + 0.5 * (logs[-1] - logs[-2])]])
    return float(ends[cell]), float(ends[cell + 1])


def _scan(cell: int) -> Floats:
    """Return logarithms of frequencies that cover a cell, each in the middle of its part."""
    low, high = _edges(cell)
    count = int(np.ceil((high - low) / RESONANCE))
    return low + (high - low) * (np.arange(count) + 0.5) / count


def _cells(gains: Mapping[int, float], cause: CandidateCause) -> list[int]:
    """Return the cells of the grid whose tones earn much."""
    per_tone = len(cause.variants) // len(FREQUENCIES)
    most = max(gains.values())
    return sorted({form // per_tone for form, gain in gains.items() if gain >= most - (1.0 - SCANNED) * abs(most)})


def _resolved(
    bank: SignatureBank,
    effect: Effect,
    cause: CandidateCause,
    cells: Sequence[int],
    scan: Floats,
    tried: Mapping[Tone, _Tried],
    bounds: Sequence[PhysicalBound],
) -> SignatureBank:
    """Return the bank of a vibration whose scanned cells are replaced by the best tones tried in them."""
    per_tone, share = len(cause.variants) // len(FREQUENCIES), 1.0 / len(cause.variants)
    kept = [form for form in range(len(cause.variants)) if form // per_tone not in cells]
    forms = [cause.variants[form].groups for form in kept]
    shares = [share] * len(forms)
    names = {group.name for groups in forms for group in groups}
    signatures = [item for item in bank.signatures if item.name in names]
    order = sorted(tried, key=lambda tone: (-tried[tone].log_evidence, tone))[:MOST]
    least = tried[order[0]].log_evidence - NEAR
    weights = _shares(scan, tried)
    for tone in order:
        if tried[tone].log_evidence < least:
            break
        item = tried[tone].signature
        signatures.append(item)
        for groups in _tone_forms(effect, item.name, bounds):
            forms.append(groups)
            shares.append(weights[tone] * len(cells) * share)
    return SignatureBank(
        tuple(signatures), (replace(cause, groups=forms[0], others=tuple(forms[1:]), shares=tuple(shares)),)
    )


def _shares(scan: Floats, tried: Mapping[Tone, _Tried]) -> dict[Tone, float]:
    """Return the part of the scanned cells that each tone stands for.

    Every step of the scan is shared equally among the dampings that were tried in it, and by each of these among the
    frequencies by the intervals that are nearest to them.
    """
    half = 0.5 * float(np.diff(scan).min(initial=RESONANCE))
    within: dict[int, dict[float, list[Tone]]] = {}
    for tone in sorted(tried):
        nearest = int(np.argmin(np.abs(scan - np.log(tone[0]))))
        within.setdefault(nearest, {}).setdefault(tone[1], []).append(tone)
    found: dict[Tone, float] = {}
    for step, by_damping in within.items():
        for tones in by_damping.values():
            logs = np.log([tone[0] for tone in tones])
            low, high = min(scan[step] - half, logs[0]), max(scan[step] + half, logs[-1])
            ends = np.concatenate([[low], 0.5 * (logs[1:] + logs[:-1]), [high]])
            widths = np.maximum(np.diff(ends) / (high - low), 1e-6) / len(by_damping) / len(scan)
            found |= dict(zip(tones, widths.tolist(), strict=True))
    return found
