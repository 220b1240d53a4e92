"""Frequency and damping of a hidden vibration, found in Gram space between the tones of the grid.

A vibration of little damping is seen within a few per cent of its frequency only, and beside it the tones of the grid
earn what follows the base's acceleration anyway. All cells of the grid that earn much are therefore scanned in steps of
the width of a resonance, and the best tone is sought from there.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bayesid._math.arrays import Floats, log_sum
from bayesid.diagnosis.candidates.signature_bank import SignatureBank, Signatures
from bayesid.diagnosis.candidates.vibration_signatures import (
    DAMPING,
    FREQUENCIES,
    tone_couplings,
    tone_forms,
    tone_signature,
)
from bayesid.diagnosis.evidence.scale_integral import GroupSpectrum, log_evidences
from bayesid.diagnosis.evidence.scales import CandidateCause
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.diagnosis.search.linearisation import Linearisation, Remaining
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import PhysicalBound

__all__ = ["with_tuned_tones"]

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

Tone = tuple[float, float]
"""Frequency [Hz] and damping ratio."""


class _Tried(NamedTuple):
    """A tone that was tried.

    signature: its columns; log_evidence: beside the other causes, averaged over the forms at this tone.
    """

    signature: Signatures
    log_evidence: float


def with_tuned_tones(
    point: Linearisation,
    effects: Sequence[Effect],
    bounds: Mapping[str, Sequence[PhysicalBound]],
    beside: Mapping[str, Sequence[str]],
) -> Linearisation:
    """Return the linearisation with finer tones of some vibrations around their best ones.

    The cells of the grid that were scanned are replaced by the best of the tones tried in them, each with the share of
    the prior that it stands for: uniform in the logarithm of the frequency, and equal for four dampings. Tones that are
    far less probable are left out.

    Parameters
    ----------
    point : Linearisation
    effects : sequence of Effect
        Candidates of the catalogue.
    bounds : mapping of str to sequence of PhysicalBound
    beside : mapping of str to sequence of str
        Labels of the vibrations to tune, with the other causes of the set in which they are tuned.
    """
    couplings = _Couplings(point.perturbed, point.fit)
    bank = point.bank
    for effect in effects:
        if effect.label in beside:
            tuned = _tuned(point, effect, bounds[effect.label], list(beside[effect.label]), couplings)
            causes = tuple(cause for cause in bank.causes if cause.name != effect.label)
            bank = SignatureBank.joined([SignatureBank(bank.signatures, causes), tuned])
    return point.with_bank(bank)


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
            own = [groups[0] for groups in tone_forms(effect, item.name, bounds)]
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
        for groups in tone_forms(effect, item.name, bounds):
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
