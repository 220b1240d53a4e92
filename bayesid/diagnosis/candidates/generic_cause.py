"""What nobody listed: disturbing torques and forces, errors of sensors, pulses of torque, and bursts of a sensor."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from bayesid._math.arrays import Floats, Integers
from bayesid.diagnosis.candidates.axis_sizes import with_axis_sizes
from bayesid.diagnosis.candidates.cause_kind import Bounds, CauseKind
from bayesid.diagnosis.candidates.imitations import with_imitations
from bayesid.diagnosis.candidates.linear_model import Linearisation, SignatureBank, Signatures
from bayesid.diagnosis.candidates.motion_errors import motion_signatures
from bayesid.diagnosis.candidates.tones import with_tones
from bayesid.diagnosis.evidence.cause_sets import SetProbabilities
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.diagnosis.settings import FULL
from bayesid.inference.posterior import Posterior
from bayesid.inference.residual_view import ResidualView
from bayesid.robot.robot_size import RobotSize
from bayesid.simulation.effects.effect import Effect

__all__ = [
    "FEW",
    "FORCE",
    "TORQUE",
    "WAVES",
    "GenericCause",
    "burst_signatures",
    "course_groups",
    "error_signatures",
    "generic_columns",
    "generic_signatures",
    "instants_of_each",
    "smooth_signatures",
]

TORQUE, FORCE = "disturbing torque", "disturbing force"
"""Names of the smooth disturbances."""

WAVES = 40
"""Cosines in time of a disturbing torque or force, per axis and recording."""

ERROR_WAVES = 40
"""Cosines in time of an error of a sensor, per channel and recording."""

FEW = 3
"""Of more than `FULL` recordings, those in which courses of all speeds are weighed, spread evenly over them; in all
recordings only as many slow ones as these have fast ones together, so that the number of columns stays bounded."""

TOGETHER = 24
"""Courses whose responses are computed together."""

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

    def refined(
        self,
        point: Linearisation,
        probabilities: SetProbabilities,
        effects: Sequence[Effect],
        bounds: Bounds,
        least: float,
    ) -> Linearisation:
        """Return the linear model in which disturbances have tones and sizes of each axis, and imitate causes."""
        tones = with_tones(point, probabilities, TORQUE)
        return with_imitations(with_axis_sizes(tones, probabilities), probabilities)


def generic_signatures(perturbed: PerturbedModel, fit: Fit) -> SignatureBank:
    """Return the bank of candidates that name nothing.

    - disturbing torque and force: smooth courses in base axes, whose cosines have variances that fall beyond a corner,
      or on both sides of a band where it swings; the force acts through the centre of mass;
    - pulse of torque: at one instant of one recording, about any axis;
    - error of each sensor: smooth courses of its channels;
    - errors and torques that follow the motion instead of time (`bayesid.diagnosis.candidates.motion_errors`).
    """
    posterior = perturbed.posterior
    kinds = posterior.model.channels.kinds
    torque, _ = _largest(posterior)
    banks = [
        smooth_signatures(perturbed, fit),
        _pulses(perturbed, fit, torque),
        *(error_signatures(posterior, f"error of {kind.value}", posterior.model.channels.of(kind)) for kind in kinds),
        motion_signatures(perturbed, fit, ERROR, torque),
    ]
    return SignatureBank.joined(banks)


def smooth_signatures(perturbed: PerturbedModel, fit: Fit, recordings: Sequence[int] | None = None) -> SignatureBank:
    """Return the bank of a smooth torque, and of a smooth force where a sensor feels it.

    Parameters
    ----------
    perturbed : PerturbedModel
    fit : Fit
    recordings : sequence of int, optional
        Numbers of those in which they act in full, by default as `course_groups` says.
    """
    posterior = perturbed.posterior
    torque, force = _largest(posterior)
    banks = []
    for name, first, high in ((TORQUE, 3, torque), (FORCE, 0, force)):
        if first or any(kind.feels_force for kind in posterior.model.channels.kinds):
            groups = course_groups(name, len(posterior.manoeuvres), WAVES)
            chosen = groups if recordings is None else [(name, list(recordings), WAVES)]
            banks.append(_smooth(perturbed, fit, chosen, first, high))
    return SignatureBank.joined(banks)


def generic_columns(posterior: Posterior) -> int:
    """Return the number of columns of `generic_signatures` that change one recording each.

    Parameters
    ----------
    posterior : Posterior
    """
    recordings, kinds = len(posterior.manoeuvres), posterior.model.channels.kinds
    courses = sum(len(chosen) * count for _, chosen, count in course_groups("", recordings, WAVES))
    wrenches = 6 if any(kind.feels_force for kind in kinds) else 3
    pulses = 3 * recordings * instants_of_each(INSTANTS, recordings)
    return courses * (wrenches + posterior.model.channels.count) + pulses


def _largest(posterior: Posterior) -> tuple[float, float]:
    """Return the largest torque [N m] and force [N]."""
    size = RobotSize.of(posterior.model.robot)
    return ACCELERATION * size.mass * size.radius, ACCELERATION * size.mass


def _smooth(
    perturbed: PerturbedModel, fit: Fit, groups: Sequence[tuple[str, list[int], int]], first: int, high: float
) -> SignatureBank:
    """Return the bank of a smooth torque (first = 3) or force (0) in base axes, in groups of courses."""

    def waves(number: Integers, time: Floats, end: float) -> Floats:
        return np.cos(np.pi * number[:, None] * time / end)

    signatures: list[Signatures] = []
    spreads: dict[str, list[Floats]] = {}
    for group, chosen, count in groups:
        columns = _wrenches(perturbed, fit, count, waves, first, chosen)
        signatures += [Signatures(group, part, r) for r, part in zip(chosen, columns, strict=True)]
        spreads[group] = [np.tile(np.repeat(course, 3), len(chosen)) for course in _courses(count)]
    return SignatureBank(tuple(signatures), (_cause(groups[0][0], high, spreads),))


def course_groups(name: str, recordings: int, waves: int) -> list[tuple[str, list[int], int]]:
    """Return the groups of smooth courses of a candidate: name, recordings that have them, number of cosines in each.

    Parameters
    ----------
    name : str
        Name of the candidate.
    recordings, waves : int
        Number of recordings, and of cosines in one that is weighed in full.
    """
    every = list(range(recordings))
    if recordings <= FULL:
        return [(name, every, waves)]
    spread = [(2 * k + 1) * recordings // (2 * FEW) for k in range(FEW)]
    return [(name, every, max(waves * FEW // recordings, 1)), (f"{name}, fast", spread, waves)]


def _cause(name: str, high: float, spreads: Mapping[str, Sequence[Floats]]) -> CandidateCause:
    """Return the candidate with one form for each course of its groups, corners and bands with half of the prior each.

    Groups have equal parts of the prior.
    """
    forms, shares = [], list[float]()
    for group, courses in spreads.items():
        forms += [(AmplitudeGroup(group, high, spread=course),) for course in courses]
        bands = len(courses) - len(CORNERS)
        each = [(0.5 if bands else 1.0) / len(CORNERS)] * len(CORNERS) + [0.5 / max(bands, 1)] * bands
        shares += [share / len(spreads) for share in each]
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
    recordings = len(perturbed.posterior.manoeuvres)
    instants = instants_of_each(INSTANTS, recordings)

    def pulses(number: Integers, time: Floats, end: float) -> Floats:
        centres = end * (number[:, None] + 0.5) / instants
        return np.maximum(1.0 - np.abs(time - centres) * instants / end, 0.0)

    signatures = []
    for r, columns in enumerate(_wrenches(perturbed, fit, instants, pulses, 3, range(recordings))):
        for k in range(instants):
            name = f"pulse of torque {k + 1} of recording {r + 1}"
            signatures.append(Signatures(name, columns[:, 3 * k : 3 * k + 3], r))
    forms = [(AmplitudeGroup(item.name, high),) for item in signatures]
    return SignatureBank(tuple(signatures), (CandidateCause("pulse of torque", forms[0], True, tuple(forms[1:])),))


def instants_of_each(instants: int, recordings: int) -> int:
    """Return the instants in each recording: those of one that is weighed in full, or fewer where there are many.

    Parameters
    ----------
    instants, recordings : int
        Number of instants of a recording that is weighed in full, and of recordings.
    """
    return instants if recordings <= FULL else max(instants * FULL // recordings, 1)


def _wrenches(
    perturbed: PerturbedModel,
    fit: Fit,
    count: int,
    courses: Callable[[Integers, Floats, float], Floats],
    first: int,
    recordings: Sequence[int],
) -> list[Floats]:
    """Return the responses of some recordings to ``count`` courses in time of a torque or force: (rows, 3 count).

    The recordings are independent given the unknowns, so that one push acts on all of them at once.
    """
    chosen = list(recordings)
    moments = [(np.asarray(i.environment.time)[chosen], np.asarray(i.body.com)[chosen]) for i in fit.operating[1:3]]
    ends = moments[0][0].max(axis=1)
    parts = []
    together = min(count if len(chosen) <= FULL else TOGETHER, max(1, perturbed.most_pushes // 3))
    for numbers in (np.arange(start, min(start + together, count)) for start in range(0, count, together)):
        wrenches = []
        for time, com in moments:
            wrench = np.zeros((len(numbers), 3, *time.shape, 6))
            for r, end in enumerate(ends):
                course = courses(numbers, time[r], float(end))
                for axis in range(3):
                    wrench[:, axis, r, :, first + axis] = course
            if first == 0:
                wrench[..., 3:] = np.cross(com, wrench[..., :3])
            wrenches.append(wrench.reshape(3 * len(numbers), *time.shape, 6))
        given = {"node_wrench": wrenches[0], "sample_wrench": wrenches[1]}
        push = perturbed.perturbation(3 * len(numbers), len(chosen), **given)
        responses = perturbed.respond(push, fit.z, fit.data, chosen)
        parts.append(responses.reshape(len(chosen), -1, responses.shape[1]))
    return list(np.concatenate(parts, axis=2))


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
    signatures: list[Signatures] = []
    spreads: dict[str, list[Floats]] = {}
    for group, chosen, most in course_groups(name, len(posterior.whitenings), ERROR_WAVES):
        waves = []
        for r in chosen:
            outputs_of = posterior.whitenings[r].outputs
            for channel in range(channels.start, channels.stop):
                there = np.flatnonzero(outputs_of[:, channel])
                waves.append(min(most, len(there) // 3))
                cosines = np.zeros((outputs, width, waves[-1]))
                place = (np.arange(len(there)) + 0.5) / max(len(there), 1)
                cosines[there, channel] = np.cos(np.pi * np.arange(waves[-1]) * place[:, None])
                signatures.append(Signatures(group, cosines.reshape(outputs * width, -1), r))
        each = [_courses(count) for count in waves if count]
        if each:  # bands that all channels can show
            spreads[group] = [np.concatenate(parts) for parts in zip(*each, strict=False)]
    return SignatureBank(tuple(signatures), (_cause(name, ERROR, spreads),)) if spreads else SignatureBank()


def burst_signatures(perturbed: PerturbedModel, fit: Fit) -> SignatureBank:
    """Return the bank of one burst per sensor, at the places where the residual is largest.

    A burst may begin at every sample and has errors of any sign in all steps and channels of its length. All places and
    lengths are equally probable beforehand; only the strongest are evaluated, each with its share of the prior, so that
    the evidence is a lower bound. The choice depends on the residual: these candidates are no part of the alarm.
    """
    posterior = perturbed.posterior
    view = ResidualView.of(posterior, fit.residual)
    banks = []
    for kind in posterior.model.channels.kinds:
        columns = posterior.model.channels.of(kind)
        places = [place for r in range(view.recordings) for place in _places(view, r, columns)]
        if not places:
            continue
        name = f"burst of {kind.value}"
        chosen = _apart(sorted(places, key=lambda item: -item[0]))
        signatures = []
        for number, (_, r, rows) in enumerate(chosen):
            mask = np.zeros((*posterior.residual_shape[1:], LENGTH, columns.stop - columns.start))
            for step, c in np.ndindex(mask.shape[2:]):
                mask[rows[step], columns.start + c, step, c] = view.mask[r, rows[step], columns.start + c]
            signatures.append(Signatures(f"{name}, place {number + 1}", mask.reshape(len(mask) * mask.shape[1], -1), r))
        forms = [(AmplitudeGroup(item.name, LARGEST),) for item in signatures]
        shares = (1.0 / len(places),) * len(forms)
        cause = CandidateCause(name, forms[0], True, tuple(forms[1:]), shares)
        banks.append(SignatureBank(tuple(signatures), (cause,)))
    return SignatureBank.joined(banks)


def _places(view: ResidualView, recording: int, columns: slice) -> list[tuple[float, int, Integers]]:
    """Return all bursts in a recording: the energy of their steps' means, the recording, and rows (`LENGTH`, samples).

    The samples of a step are doubled until the burst is as long as a half wave of the fastest error.
    """
    there = np.flatnonzero(view.mask[recording, :, columns].any(axis=1))
    values, known = (part[recording, there, columns].astype(float) for part in (view.values, view.mask))
    sums, counts = (np.cumsum(np.concatenate([part[:1] * 0.0, part]), axis=0) for part in (values, known))
    places: list[tuple[float, int, Integers]] = []
    samples = 1
    while LENGTH * samples <= (len(there) if samples == 1 else len(there) // ERROR_WAVES):
        step, count = (each[samples:] - each[:-samples] for each in (sums, counts))
        energy = (step**2 / np.maximum(count, 1.0)).sum(axis=1)
        starts = len(there) - LENGTH * samples + 1
        whole = sum(energy[k * samples : k * samples + starts] for k in range(LENGTH))
        places += [
            (float(value), recording, there[start : start + LENGTH * samples].reshape(LENGTH, samples))
            for start, value in enumerate(np.atleast_1d(whole))
        ]
        samples *= 2
    return places


def _apart(places: list[tuple[float, int, Integers]]) -> list[tuple[float, int, Integers]]:
    """Return the strongest places that do not overlap."""
    chosen: list[tuple[float, int, Integers]] = []
    for value, r, rows in places:
        if all(r != other or rows[0, 0] > own[-1, -1] or rows[-1, -1] < own[0, 0] for _, other, own in chosen):
            chosen.append((value, r, rows))
        if len(chosen) == STRONGEST:
            break
    return chosen
