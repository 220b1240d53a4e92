"""Signatures of bursts: a few samples of one sensor, side by side, that are far off, as in a shock."""

from __future__ import annotations

import numpy as np

from bayesid._math.arrays import Integers
from bayesid.diagnosis.candidates.signature_bank import SignatureBank, Signatures
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.inference.residual_view import ResidualView

__all__ = ["burst_signatures"]

LENGTH = 5
"""Samples of a burst."""

STRONGEST = 6
"""Places of a burst per sensor that are weighed; at the others it has no evidence."""

LARGEST = 1000.0
"""Largest error in a burst, in standard deviations of the noise; assumed."""


def burst_signatures(perturbed: PerturbedModel, fit: Fit) -> SignatureBank:
    """Return the bank of one burst per sensor, at the places where the residual is largest.

    A burst may begin at every sample, and has errors of any sign in all samples and channels of its length. All places
    are equally probable beforehand; only the strongest are evaluated, each with its share of the prior, so that the
    evidence is a lower bound. The choice depends on the residual: these candidates are no part of the alarm.
    """
    posterior = perturbed.posterior
    view = ResidualView.of(posterior, fit.residual)
    banks = []
    for kind in posterior.model.channels.kinds:
        columns = posterior.model.channels.of(kind)
        places: list[tuple[float, int, Integers]] = []
        for r in range(view.recordings):
            there = np.flatnonzero(view.mask[r, :, columns].any(axis=1))
            if len(there) < LENGTH:  # a burst needs as many samples as it lasts
                continue
            energy = (view.values[r, there, columns] ** 2).sum(axis=1)
            sums = np.convolve(energy, np.ones(LENGTH), "valid")
            places += [(float(value), r, there[k : k + LENGTH]) for k, value in enumerate(sums)]
        if not places:
            continue
        name = f"burst of {kind.value}"
        chosen = _apart(sorted(places, key=lambda item: -item[0]))
        signatures = []
        for number, (_, r, rows) in enumerate(chosen):
            mask = np.zeros((*posterior.residual_shape[1:], len(rows), columns.stop - columns.start))
            for k, row in enumerate(rows):
                for c in range(columns.start, columns.stop):
                    mask[row, c, k, c - columns.start] = float(view.mask[r, row, c])
            signatures.append(Signatures(f"{name}, place {number + 1}", mask.reshape(len(mask) * mask.shape[1], -1), r))
        forms = [(AmplitudeGroup(item.name, LARGEST),) for item in signatures]
        shares = (1.0 / len(places),) * len(forms)
        cause = CandidateCause(name, forms[0], True, tuple(forms[1:]), shares)
        banks.append(SignatureBank(tuple(signatures), (cause,)))
    return SignatureBank.joined(banks)


def _apart(places: list[tuple[float, int, Integers]]) -> list[tuple[float, int, Integers]]:
    """Return the strongest places that do not overlap."""
    chosen: list[tuple[float, int, Integers]] = []
    for value, r, rows in places:
        if all(r != other or rows[0] > own[-1] or rows[-1] < own[0] for _, other, own in chosen):
            chosen.append((value, r, rows))
        if len(chosen) == STRONGEST:
            break
    return chosen
