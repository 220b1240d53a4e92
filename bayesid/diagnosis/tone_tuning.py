"""Frequency and damping of a hidden vibration, found in Gram space between the tones of the grid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bayesid.diagnosis.catalogue_signatures import group_names
from bayesid.diagnosis.linearisation import Linearisation
from bayesid.diagnosis.scale_prior import CandidateCause
from bayesid.diagnosis.signature_bank import SignatureBank
from bayesid.diagnosis.vibration_signatures import DAMPING, FREQUENCIES, tone_forms, tone_signatures
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.physical_bound import PhysicalBound

__all__ = ["with_tuned_tones"]

DAMPINGS = (0.003, 0.008, DAMPING, 0.05)
"""Dampings that are equally probable beforehand."""

ROUNDS, POINTS = 2, 5
"""Grids of frequencies, each within the step of the one before, and points in each."""


def with_tuned_tones(
    point: Linearisation,
    effects: Sequence[Effect],
    bounds: Mapping[str, Sequence[PhysicalBound]],
    beside: Mapping[str, Sequence[str]],
) -> Linearisation:
    """Return the linearisation with finer tones of some vibrations around their best tone of the grid.

    The cell of the grid around the best tone is replaced by the tones tried in it, each with the share of the cell's
    prior that it stands for: uniform in the logarithm of the frequency, and equal for four dampings.

    Parameters
    ----------
    point : Linearisation
    effects : sequence of Effect
        Candidates of the catalogue.
    bounds : mapping of str to sequence of PhysicalBound
    beside : mapping of str to sequence of str
        Labels of the vibrations to tune, with the other causes of the set in which they are tuned.
    """
    bank = point.bank
    for effect in effects:
        if effect.label in beside:
            tuned = _tuned(point, effect, bounds[effect.label], list(beside[effect.label]))
            causes = tuple(cause for cause in bank.causes if cause.name != effect.label)
            bank = SignatureBank.joined([SignatureBank(bank.signatures, causes), tuned])
    return point.with_bank(bank)


def _tuned(
    point: Linearisation, effect: Effect, bounds: Sequence[PhysicalBound], others: Sequence[str]
) -> SignatureBank:
    """Return the bank of one vibration with the cell of its best tone resolved."""
    evidence, grid = point.evidence, len(FREQUENCIES)
    cause = evidence.causes[effect.label]
    per_tone = len(cause.variants) // grid
    cell = evidence.forms([*others, effect.label])[effect.label] // per_tone
    names = {group.name for name in others for form in evidence.causes[name].variants for group in form.groups}
    names |= {name for held in point.fit.effects for name in group_names(held).values()}  # whose amplitudes it needs
    rest = SignatureBank(
        tuple(item for item in point.bank.signatures if item.name in names), tuple(evidence.causes[n] for n in others)
    )
    tried: dict[tuple[float, float], tuple[SignatureBank, float]] = {}

    def value(frequency: float, damping: float) -> float:
        tone = (float(f"{frequency:.5g}"), damping)
        if tone not in tried:
            item = tone_signatures(point.engine, point.fit, [effect], tone)[effect.label]
            forms = tone_forms(effect, item.name, bounds)
            bank = SignatureBank((item,), (replace(cause, groups=forms[0], others=tuple(forms[1:]), shares=()),))
            both = point.with_bank(SignatureBank.joined([rest, bank]))
            tried[tone] = bank, both.evidence.log_evidence([*others, effect.label])
        return tried[tone][1]

    logs = np.log(FREQUENCIES)
    step = float(np.diff(logs).mean())
    centre, damping, reach = float(logs[cell]), DAMPING, 0.5 * step
    for _ in range(ROUNDS):
        points = centre + np.linspace(-reach, reach, POINTS)
        centre = float(max(points, key=lambda x: value(float(np.exp(x)), damping)))
        damping = max(DAMPINGS, key=lambda d: value(float(np.exp(centre)), d))
        reach = 2.0 * reach / (POINTS - 1)
    return _resolved(point.bank, cause, cell, per_tone, tried, float(logs[cell]), step)


def _resolved(
    bank: SignatureBank,
    cause: CandidateCause,
    cell: int,
    per_tone: int,
    tried: Mapping[tuple[float, float], tuple[SignatureBank, float]],
    middle: float,
    step: float,
) -> SignatureBank:
    """Return the bank of a vibration whose best cell is replaced by the tones tried in it."""
    grid, share = len(FREQUENCIES), 1.0 / len(cause.variants)
    kept = [form for form in range(len(cause.variants)) if form // per_tone != cell]
    forms = [cause.variants[form].groups for form in kept]
    shares = [share] * len(forms)
    signatures = [item for item in bank.signatures if item.name in {group.name for groups in forms for group in groups}]
    for damping in DAMPINGS:
        own = sorted(frequency for frequency, other in tried if other == damping)
        edges = np.clip(np.log(own), middle - 0.5 * step, middle + 0.5 * step)
        bounds = np.concatenate([[middle - 0.5 * step], 0.5 * (edges[1:] + edges[:-1]), [middle + 0.5 * step]])
        for frequency, width in zip(own, np.diff(bounds), strict=True):
            tuned = tried[frequency, damping][0]
            signatures += tuned.signatures
            for variant in tuned.causes[0].variants:
                forms.append(variant.groups)
                shares.append(max(float(width) / step, 1e-6) / (grid * len(DAMPINGS) * per_tone))
    return SignatureBank(
        tuple(signatures), (replace(cause, groups=forms[0], others=tuple(forms[1:]), shares=tuple(shares)),)
    )
