"""What nobody listed: disturbing torques and forces, errors of sensors, pulses of torque, and bursts of a sensor."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from bayesid._math.arrays import Floats, Integers
from bayesid.diagnosis.candidates.cause_kind import Bounds, CauseKind
from bayesid.diagnosis.candidates.linear_model import SignatureBank, Signatures
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.inference.posterior import Posterior
from bayesid.inference.residual_view import ResidualView, by_recording
from bayesid.robot.robot_size import RobotSize
from bayesid.simulation.effects.effect import Effect

__all__ = ["FORCE", "TORQUE", "WAVES", "GenericCause", "burst_signatures", "error_signatures", "generic_signatures"]

TORQUE, FORCE = "disturbing torque", "disturbing force"
"""Names of the smooth disturbances."""

WAVES = 40
"""Cosines in time of a disturbing torque or force, per axis and recording."""

ERROR_WAVES = 40
"""Cosines in time of an error of a sensor, per channel and recording."""

CORNERS = (2.0, 7.0, 25.0)
"""Numbers of half waves in a recording up to which a smooth disturbance has its variance, equally probable."""

ROLL = 4.0
"""Power with which the variance falls beyond."""

BANDS = (4.0, 5.4, 7.3, 9.8, 13.0, 18.0, 24.0, 32.0)
"""Half waves in a recording about which a disturbance that swings has its variance; all bands together are as probable
as all corners."""

WIDTH = 0.2
"""Half width of a band relative to its middle."""

ABSENT = 0.03
"""Variance relative to the largest below which a cosine is left out of a band."""

INSTANTS = 20
"""Instants per recording at which something may happen."""

ACCELERATION = 0.01
"""Largest acceleration by an unknown force [m/s2]: that of a thruster for attitude control; assumed."""

ERROR = 1000.0
"""Largest unknown error of a sensor, in standard deviations of its noise; assumed."""

LENGTH = 5
"""Samples of a burst."""

STRONGEST = 6
"""Places of a burst per sensor that are weighed; at the others it has no evidence."""

LARGEST = 1000.0
"""Largest error in a burst, in standard deviations of the noise; assumed."""


class GenericCause(CauseKind):
    """Candidates that name nothing: what the catalogue lacks, and bursts where the residual shows some."""

    name = "generic"

    def signatures(
        self, perturbed: PerturbedModel, fit: Fit, effects: Sequence[Effect], bounds: Bounds
    ) -> SignatureBank:
        """Return the bank of smooth disturbances, pulses, and errors of sensors."""
        return generic_signatures(perturbed, fit)

    def suggested(self, perturbed: PerturbedModel, fit: Fit) -> SignatureBank:
        """Return the bank of bursts."""
        return burst_signatures(perturbed, fit)


def generic_signatures(perturbed: PerturbedModel, fit: Fit) -> SignatureBank:
    """Return the bank of candidates that name nothing.

    - disturbing torque and force: smooth courses in base axes, whose cosines have variances that fall beyond a corner,
      or on both sides of a band where it swings; the force acts through the centre of mass;
    - pulse of torque: at one instant of one recording, about any axis;
    - error of each sensor: smooth courses of its channels.
    """
    posterior = perturbed.posterior
    kinds, size = posterior.model.channels.kinds, RobotSize.of(posterior.model.robot)
    force = ACCELERATION * size.mass
    torque = force * size.radius
    banks = [
        _smooth(perturbed, fit, TORQUE, 3, torque),
        *([_smooth(perturbed, fit, FORCE, 0, force)] if any(kind.feels_force for kind in kinds) else []),
        _pulses(perturbed, fit, torque),
        *(error_signatures(posterior, f"error of {kind.value}", posterior.model.channels.of(kind)) for kind in kinds),
    ]
    return SignatureBank.joined(banks)


def _smooth(perturbed: PerturbedModel, fit: Fit, name: str, first: int, high: float) -> SignatureBank:
    """Return the bank of a smooth torque (first = 3) or force (0) in base axes."""

    def waves(time: Floats, end: float) -> Floats:
        return np.cos(np.pi * np.arange(WAVES)[:, None] * time / end)

    columns = _wrenches(perturbed, fit, WAVES, waves, first)
    recordings = len(columns)
    signatures = tuple(Signatures(name, own, r) for r, own in enumerate(columns))
    spreads = [np.tile(np.repeat(own, 3), recordings) for own in _courses(WAVES)]
    return SignatureBank(signatures, (_cause(name, high, spreads),))


def _cause(name: str, high: float, spreads: Sequence[Floats]) -> CandidateCause:
    """Return the candidate with one form for each course, corners and bands with half of the prior each."""
    forms = [(AmplitudeGroup(name, high, spread=own),) for own in spreads]
    bands = len(forms) - len(CORNERS)
    shares = [(0.5 if bands else 1.0) / len(CORNERS)] * len(CORNERS) + [0.5 / max(bands, 1)] * bands
    return CandidateCause(name, forms[0], True, tuple(forms[1:]), tuple(shares))


def _courses(waves: int) -> list[Floats]:
    """Return the variances of cosines, whose sum is one, for every corner and for every band within their number."""
    number = np.arange(waves)
    found = [1.0 / (1.0 + (number / corner) ** ROLL) for corner in CORNERS]
    for middle in BANDS:
        if middle * (1.0 + WIDTH) < waves:
            band = 1.0 / (1.0 + (np.abs(number - middle) / (WIDTH * middle)) ** ROLL)
            found.append(np.where(band >= ABSENT * band.max(), band, 0.0))
    return [own / own.sum() for own in found]


def _pulses(perturbed: PerturbedModel, fit: Fit, high: float) -> SignatureBank:
    """Return the bank of one pulse of torque at an instant of a recording."""

    def pulses(time: Floats, end: float) -> Floats:
        centres = end * (np.arange(INSTANTS)[:, None] + 0.5) / INSTANTS
        return np.maximum(1.0 - np.abs(time - centres) * INSTANTS / end, 0.0)

    signatures = []
    for r, columns in enumerate(_wrenches(perturbed, fit, INSTANTS, pulses, 3)):
        for k in range(INSTANTS):
            name = f"pulse of torque {k + 1} of recording {r + 1}"
            signatures.append(Signatures(name, columns[:, 3 * k : 3 * k + 3], r))
    forms = [(AmplitudeGroup(item.name, high),) for item in signatures]
    return SignatureBank(tuple(signatures), (CandidateCause("pulse of torque", forms[0], True, tuple(forms[1:])),))


def _wrenches(
    perturbed: PerturbedModel, fit: Fit, count: int, courses: Callable[[Floats, float], Floats], first: int
) -> list[Floats]:
    """Return the responses of each recording to ``count`` courses in time of a torque or force: (rows, 3 count).

    The recordings are independent given the unknowns, so that one push acts on all of them at once.
    """
    moments = (fit.operating.node, fit.operating.sample)
    times = [np.asarray(instant.environment.time) for instant in moments]
    wrenches = []
    for instant, time in zip(moments, times, strict=True):
        wrench = np.zeros((count, 3, *time.shape, 6))
        for r, end in enumerate(times[0].max(axis=1)):
            course = courses(time[r], float(end))
            for axis in range(3):
                wrench[:, axis, r, :, first + axis] = course
        if first == 0:
            wrench[..., 3:] = np.cross(np.asarray(instant.body.com), wrench[..., :3])
        wrenches.append(wrench.reshape(3 * count, *time.shape, 6))
    push = perturbed.perturbation(3 * count, node_wrench=wrenches[0], sample_wrench=wrenches[1])
    return list(by_recording(fit.posterior, perturbed.respond(push, fit.z, fit.data)))


def error_signatures(posterior: Posterior, name: str, channels: slice) -> SignatureBank:
    """Return the bank of smooth errors of some channels of the residual, in standard deviations of their samples.

    Parameters
    ----------
    posterior : Posterior
    name : str
        Name of the candidate.
    channels : slice
        Columns of the residual, which have one variance.
    """
    _, outputs, width = posterior.residual_shape
    signatures, waves = [], []
    for r, item in enumerate(posterior.whitenings):
        for channel in range(channels.start, channels.stop):
            there = np.flatnonzero(item.outputs[:, channel])
            waves.append(min(ERROR_WAVES, len(there) // 3))
            own = np.zeros((outputs, width, waves[-1]))
            place = (np.arange(len(there)) + 0.5) / max(len(there), 1)
            own[there, channel] = np.cos(np.pi * np.arange(waves[-1]) * place[:, None])
            signatures.append(Signatures(name, own.reshape(outputs * width, -1), r))
    if not sum(waves):
        return SignatureBank()
    each = [_courses(count) for count in waves if count]
    spreads = [np.concatenate(parts) for parts in zip(*each, strict=False)]  # bands that all channels can show
    return SignatureBank(tuple(signatures), (_cause(name, ERROR, spreads),))


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
