"""The wrench it would take: what a fit leaves, as force and torque on the base against time, and its frame.

Force and torque have Gaussian-process priors in a basis of cosines, their scales and corners at their most probable
values (C. E. Rasmussen and C. K. I. Williams, Gaussian Processes for Machine Learning, 2006, chapters 2 and 5).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from bayesid._io.files import write_text
from bayesid._math.arrays import Floats, Integers
from bayesid.diagnosis.candidates.generic_cause import FORCE, TORQUE, WAVES, smooth_signatures
from bayesid.diagnosis.candidates.linear_model import SignatureBank
from bayesid.diagnosis.evidence.gram import GaussianBlock, Gram
from bayesid.diagnosis.evidence.scales import CandidateCause
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.outcome.torque_events import ChosenEvents, EventCandidates, Taken, torque_responses
from bayesid.diagnosis.response.perturbed_model import Fit
from bayesid.diagnosis.search.fitted_set import Hypothesis
from bayesid.diagnosis.settings import DEFAULT_SETTINGS, FULL, DiagnosisSettings
from bayesid.inference.residual_view import by_recording, rows_of

__all__ = ["DisturbingWrench", "Frame", "TorqueCorrelation", "disturbing_wrench", "torque_correlations"]

ROUNDS = 15  # of the alternating least squares
MOST_CORRELATIONS = 12


class Frame(Enum):
    """Axes in which the direction of a disturbance may be fixed."""

    BASE = "base"
    ORBIT = "orbit"
    INERTIAL = "inertial"


@dataclass(frozen=True)
class DisturbingWrench:
    """A disturbing wrench.

    Attributes
    ----------
    signal_to_noise : float
    names : tuple of str
        Recordings in which it is reconstructed: all, or the ones with the largest residuals if there are many.
    recordings : tuple of int
        Their numbers.
    time : list of (S,) arrays
        Per recording [s].
    torque, force : dict of Frame to list of (S, 3) arrays
        Mean, about and through the common centre of mass [N m, N]; the force is not a number if no accelerometer
        observes it.
    torque_sd, force_sd : list of (S, 3) arrays
        Base axes.
    fixed_in : Frame or None
    log_bayes_factor : float
        Of a free torque and force in every recording against none: a named cause must exceed it.
    """

    signal_to_noise: float
    names: tuple[str, ...]
    recordings: tuple[int, ...]
    time: list[Floats]
    torque: dict[Frame, list[Floats]]
    force: dict[Frame, list[Floats]]
    torque_sd: list[Floats]
    force_sd: list[Floats]
    fixed_in: Frame | None
    log_bayes_factor: float

    def write(self, file: Path) -> None:
        """Write the wrench as CSV."""
        header = ["recording", "time"]
        header += [f"{frame.value}_{kind}.{axis}" for frame in Frame for kind in ("torque", "force") for axis in "xyz"]
        header += [f"base_{kind}_sd.{axis}" for kind in ("torque", "force") for axis in "xyz"]
        lines = [",".join(header)]
        for r, name in enumerate(self.names):
            blocks = [part[frame][r] for frame in Frame for part in (self.torque, self.force)]
            table = np.concatenate([self.time[r][:, None], *blocks, self.torque_sd[r], self.force_sd[r]], axis=1)
            lines += [",".join([name, *(f"{value:.6g}" for value in row)]) for row in table]
        write_text(file, "\n".join(lines) + "\n")


def disturbing_wrench(
    hypothesis: Hypothesis,
    bank: SignatureBank,
    name_frame: bool = True,
    settings: DiagnosisSettings = DEFAULT_SETTINGS,
) -> DisturbingWrench:
    """Reconstruct the disturbance that a fit leaves.

    Torque and force have the priors of the generic candidates: cosines in time whose variances fall beyond a corner,
    with corner and scale of either at their most probable values. Where the disturbance itself is the answer, the
    torque may hold events, too (`bayesid.diagnosis.outcome.torque_events`).

    Parameters
    ----------
    hypothesis : Hypothesis
    bank : SignatureBank
        Bank under the hypothesis' noise, with the responses to cosines of torque and force, or without any columns.
    name_frame : bool
        Whether the disturbance itself is the answer: its events and the axes that it is fixed in are looked for.
    settings : DiagnosisSettings, optional
        With the thresholds for naming these axes.
    """
    fit = hypothesis.fit
    recordings = _reconstructed(fit)
    count = len(recordings)
    if count < len(fit.posterior.manoeuvres) or not bank.memory:
        bank = smooth_signatures(hypothesis.perturbed, fit, recordings)
    rows = np.concatenate([np.arange(len(fit.residual))[rows_of(fit.posterior, r)] for r in recordings])
    times = np.asarray(fit.operating.node.environment.time)[recordings]
    rotations = _frames(hypothesis, recordings)
    names = [name for name in (TORQUE, FORCE) if name in {cause.name for cause in bank.causes}]
    parts = [_whole_columns(bank, name, recordings) for name in names]
    columns = np.concatenate(parts, axis=1)
    places = np.split(np.arange(columns.shape[1]), np.cumsum([part.shape[1] for part in parts])[:-1])
    gram = Gram(fit.project(columns, rows), columns.T @ fit.residual[rows], dict(zip(names, places, strict=True)))
    causes = [_of_courses(cause) for cause in bank.causes if cause.name in names]
    disturbance = _composed(hypothesis, gram, columns, causes, name_frame, recordings)
    smooth = disturbance.columns
    block = GaussianBlock.of(disturbance.matrix, disturbance.deviations)
    pull, posterior = block.share(disturbance.score), block.covariance
    cosines = 2 * 3 * WAVES * count  # of torque and force; those of no variance have none in the composition
    where = np.concatenate([smooth, cosines + np.arange(len(pull) - len(smooth))])
    size = cosines + len(pull) - len(smooth)
    amplitude, covariance = np.zeros(size), np.zeros((size, size))
    amplitude[where], covariance[np.ix_(where, where)] = block.mean(disturbance.score), posterior
    freedom = float(np.einsum("ij,ji->", posterior, disturbance.matrix))
    snr = float(np.sqrt(max(float(pull @ pull) - freedom, 0.0)))
    scale = float(disturbance.deviations[: len(smooth)][smooth < 3 * WAVES * count].max())  # of the torque's cosines

    fresh = [np.concatenate([[True], np.diff(time) > 0.0]) for time in times]  # shorter recordings end with one instant

    def course(r: int, first: int, events: Sequence[int]) -> tuple[Floats, Floats]:
        """Mean and standard deviation in one recording, (S, 3), of a group's cosines and some events."""
        waves = _waves(times[r][fresh[r]])
        courses = np.stack([*waves, *(disturbance.events[k][1][fresh[r]] for k in events)])
        even = np.arange(first + r * WAVES * 3, first + (r + 1) * WAVES * 3)
        block = np.concatenate([even, *(cosines + 3 * k + np.arange(3) for k in events)])
        spread = covariance[np.ix_(block, block)].reshape(len(courses), 3, len(courses), 3)
        mean = np.einsum("kt,ka->ta", waves, amplitude[even].reshape(WAVES, 3))
        variance = np.maximum(np.einsum("kt,kala,lt->ta", courses, spread, courses), 0.0)
        for k in events:
            _, event, over_shapes = disturbance.averaged[k]
            mean, variance = mean + event[fresh[r]], variance + over_shapes[fresh[r]] ** 2
        return mean, np.sqrt(variance)

    within = [[k for k, (recording, _) in enumerate(disturbance.events) if recording == r] for r in range(count)]
    torque, torque_sd = zip(*(course(r, 0, within[r]) for r in range(count)), strict=True)
    shown = 1.0 if FORCE in names else np.nan  # without an accelerometer nothing is known of the force
    force, force_sd = zip(*((shown * x for x in course(r, cosines // 2, ())) for r in range(count)), strict=True)

    def turned(series: Sequence[Floats]) -> dict[Frame, list[Floats]]:
        return {
            frame: [
                np.einsum("tba,tb->ta", turns[r][instants], value)
                for r, (instants, value) in enumerate(zip(fresh, series, strict=True))
            ]
            for frame, (turns, _) in rotations.items()
        }

    return DisturbingWrench(
        snr,
        tuple(fit.posterior.manoeuvres[r].recording.name for r in recordings),
        tuple(recordings),
        [time[instants] for time, instants in zip(times, fresh, strict=True)],
        turned(torque),
        turned(force),
        list(torque_sd),
        list(force_sd),
        _fixed_in(hypothesis, rotations, scale, settings, recordings) if name_frame and snr > 0.0 else None,
        disturbance.log_evidence,
    )


def _reconstructed(fit: Fit) -> list[int]:
    """Return the recordings whose disturbance is reconstructed: all, or of many those with the largest residuals."""
    energy = (by_recording(fit.posterior, fit.residual) ** 2).sum(axis=1)
    return sorted(np.argsort(-energy, kind="stable")[:FULL].tolist())


def _waves(time: Floats) -> Floats:
    return np.cos(np.pi * np.arange(WAVES)[:, None] * time / time[-1])


def _frames(hypothesis: Hypothesis, recordings: Sequence[int]) -> dict[Frame, tuple[Floats, Floats]]:
    """Rotations from each frame to the base at stages (R, S, 3, 3) and samples (R, T, 3, 3)."""
    operating = hypothesis.fit.operating
    result: dict[Frame, list[Floats]] = {frame: [] for frame in Frame}
    for instant in (operating.node, operating.sample):
        attitude = np.asarray(instant.attitude)[recordings]  # base to orbit axes
        to_base = np.swapaxes(attitude, -1, -2)
        zenith = np.asarray(instant.environment.zenith)[recordings]
        argument_of_latitude = np.asarray(instant.environment.argument_of_latitude)[recordings]
        in_orbit = np.linalg.norm(zenith, axis=-1).min() > 0.5
        normal = np.zeros_like(zenith) + np.array([0.0, 0.0, 1.0])
        local, start = np.eye(3) + 0.0 * attitude, np.zeros((len(attitude), 1))
        if in_orbit:
            local = np.stack([zenith, np.cross(normal, zenith), normal], axis=-1)
            start = argument_of_latitude[:, :1]
        cos, sin, zero = np.cos(start), np.sin(start), 0.0 * start
        # node axes seen in the recording's orbit axes
        rows = [np.stack(row, axis=-1) for row in ((cos, sin, zero), (-sin, cos, zero), (zero, zero, zero + 1.0))]
        node = np.broadcast_to(np.stack(rows, axis=-2), attitude.shape)
        result[Frame.BASE].append(np.broadcast_to(np.eye(3), attitude.shape))
        result[Frame.ORBIT].append(to_base @ local)
        result[Frame.INERTIAL].append(to_base @ node)
    return {frame: (parts[0], parts[1]) for frame, parts in result.items()}


@dataclass(frozen=True)
class _Composed:
    """Composition of a disturbance: columns of the smooth one, then three of each event.

    Attributes
    ----------
    columns : (h,) array of int
        Of the smooth disturbance.
    deviations : (h + 3 e,) array
        Most probable standard deviations of all amplitudes.
    matrix, score : arrays
        Information on them, and score.
    events : sequence of pairs of int and (S,) array
        Recording and course of each event.
    chosen : ChosenEvents or None
        The events among their candidates.
    log_evidence : float
        Relative to nothing.
    averaged : sequence of tuples of int, (S, 3) array and (S, 3) array
        Recording, torque and standard deviation over the shapes of each event (`EventCandidates.averaged`).
    """

    columns: Integers
    deviations: Floats
    matrix: Floats
    score: Floats
    events: Sequence[tuple[int, Floats]]
    chosen: ChosenEvents | None
    log_evidence: float
    averaged: Sequence[tuple[int, Floats, Floats]] = ()


def _composed(
    hypothesis: Hypothesis,
    gram: Gram,
    columns: Floats,
    causes: Sequence[CandidateCause],
    sudden: bool,
    recordings: Sequence[int],
) -> _Composed:
    """Return the most probable of a smooth disturbance, one with events beside it, and events with one beside them."""
    taken, deviations, log_evidence = _most_probable(gram, causes)
    matrix, score = gram.matrix[np.ix_(taken, taken)], gram.score[taken]
    smooth = _Composed(taken, deviations, matrix, score, (), None, log_evidence)
    largest = next((cause.groups[0].high for cause in causes if cause.name == TORQUE), 0.0)
    if not sudden or not largest:
        return smooth
    candidates = EventCandidates.of(hypothesis, columns, largest, recordings)
    best = max(_options(gram, smooth, candidates, causes), key=lambda option: option.log_evidence)
    if best.chosen is None:
        return best
    finer = EventCandidates.of(hypothesis, columns, largest, recordings, candidates.nearby(best.chosen))
    known = slice(0, len(best.columns))
    block = GaussianBlock.of(best.matrix[known, known], best.deviations[known])
    beside = Taken(block.share(finer.shared[:, best.columns].T), block.share(best.score[known]))
    return replace(best, averaged=finer.averaged(beside, finer.like(candidates, best.chosen)))


def _options(
    gram: Gram, smooth: _Composed, candidates: EventCandidates, causes: Sequence[CandidateCause]
) -> Iterator[_Composed]:
    """Yield a smooth disturbance, events beside it, and a smooth disturbance beside events."""
    yield smooth
    block = GaussianBlock.of(smooth.matrix, smooth.deviations)
    beside = candidates.chosen(Taken(block.share(candidates.shared[:, smooth.columns].T), block.share(smooth.score)))
    if beside.places:
        total = smooth.log_evidence + beside.log_evidence
        yield _joined(gram, smooth.columns, smooth.deviations, candidates, beside, total)
    alone = candidates.chosen(Taken.nothing(len(candidates.score)))
    if alone.places:
        events = alone.columns
        block = GaussianBlock.of(candidates.matrix[np.ix_(events, events)], alone.deviations)
        share, pull = block.share(candidates.shared[events]), block.share(candidates.score[events])
        left = Gram(gram.matrix - share.T @ share, gram.score - share.T @ pull, gram.groups)
        columns, deviations, more = _most_probable(left, causes)
        yield _joined(gram, columns, deviations, candidates, alone, alone.log_evidence + more)


def _joined(
    gram: Gram, columns: Integers, deviations: Floats, candidates: EventCandidates, events: ChosenEvents, total: float
) -> _Composed:
    added = events.columns
    shared = candidates.shared[np.ix_(added, columns)]
    whole = [[gram.matrix[np.ix_(columns, columns)], shared.T], [shared, candidates.matrix[np.ix_(added, added)]]]
    return _Composed(
        columns,
        np.concatenate([deviations, events.deviations]),
        np.block(whole),
        np.concatenate([gram.score[columns], candidates.score[added]]),
        [(int(candidates.recording[k]), candidates.course[k]) for k in events.places],
        events,
        total,
    )


def _most_probable(gram: Gram, causes: Sequence[CandidateCause]) -> tuple[Integers, Floats, float]:
    """Return the columns of smooth disturbances, their deviations at the most probable scales, and the log evidence.

    One disturbance is taken after the other, each beside those before at their most probable scales: to integrate over
    all scales at once would take minutes.
    """
    columns, deviations, total = np.zeros(0, dtype=int), np.zeros(0), 0.0
    left = gram
    for cause in causes:
        name = cause.groups[0].name
        evidence = SetEvidence(left.keeping([name]), [cause])
        forms = evidence.forms([cause.name])
        total += evidence.log_evidence([cause.name])
        where, sigma = evidence.most_probable([cause.name], forms)
        columns, deviations = np.concatenate([columns, gram.groups[name][where]]), np.concatenate([deviations, sigma])
        left = gram.conditioned(columns, deviations)
    return columns, deviations, total


def _of_courses(cause: CandidateCause) -> CandidateCause:
    """Return a disturbance in those of its forms that are courses in time alone."""
    names = [form.groups[0].name for form in cause.variants]
    return cause.in_forms([place for place, name in enumerate(names) if name == names[0]])


def _whole_columns(bank: SignatureBank, name: str, recordings: Sequence[int]) -> Floats:
    """Return the columns of a group that acts in each of some recordings by itself, (n, r k), zero in the others."""
    parts = {signature.recording: signature.columns for signature in bank.signatures if signature.name == name}
    return block_diag(*(parts[recording] for recording in recordings))


def _responses(hypothesis: Hypothesis, frames: Floats, samples: Floats, recordings: Sequence[int]) -> Floats:
    """Return the responses of some recordings to cosines of a torque along the axes of frames, (n, r WAVES 3)."""
    operating = hypothesis.fit.operating
    ends = np.asarray(operating.node.environment.time)[recordings].max(axis=1)
    torques = []
    for instant, axes in ((operating.node, frames), (operating.sample, samples)):
        time = np.asarray(instant.environment.time)[recordings]
        waves = np.cos(np.pi * np.arange(WAVES)[:, None, None] * time / ends[:, None])
        torques.append(np.einsum("krt,rtba->kartb", waves, axes).reshape(WAVES * 3, *time.shape, 3))
    return block_diag(*torque_responses(hypothesis, recordings, *torques))


def _fixed_in(
    hypothesis: Hypothesis,
    rotations: dict[Frame, tuple[Floats, Floats]],
    scale: float,
    settings: DiagnosisSettings,
    recordings: Sequence[int],
) -> Frame | None:
    """Return the frame in which a torque of one direction, with a free course, explains most; None if undecided."""
    fit = hypothesis.fit
    explained = {}
    whole = 0.0
    orbit = float(np.linalg.norm(np.asarray(fit.operating.node.environment.zenith)[0, 0])) > 0.5
    rows = np.concatenate([np.arange(len(fit.residual))[rows_of(fit.posterior, r)] for r in recordings])
    for frame in Frame if orbit else (Frame.BASE, Frame.INERTIAL):
        columns = _responses(hypothesis, *rotations[frame], recordings)
        gram, gradient = fit.project(columns, rows), columns.T @ fit.residual[rows]
        courses = gram.shape[0] // 3
        gram = gram.reshape(courses, 3, courses, 3)
        gradient = gradient.reshape(courses, 3)
        if frame is Frame.BASE:
            flat = gram.reshape(3 * courses, -1) + scale**-2 * np.eye(3 * courses)
            whole = float(gradient.ravel() @ np.linalg.solve(flat, gradient.ravel()))
        explained[frame] = max(_one_direction(gram, gradient, scale, d) for d in np.eye(3))
    ranked = sorted(explained, key=lambda frame: -explained[frame])
    best, second = ranked[0], ranked[1]
    undecided = explained[best] - explained[second] < settings.frame_advantage
    return None if undecided or explained[best] < settings.frame_share * whole else best


def _one_direction(gram: Floats, gradient: Floats, scale: float, direction: Floats) -> float:
    """Chi-square that a torque of one direction and a free course takes, by alternating least squares."""
    taken = 0.0
    for _ in range(ROUNDS):
        inner = np.einsum("kalb,a,b->kl", gram, direction, direction) + scale**-2 * np.eye(len(gram))
        trajectory = np.linalg.solve(inner, gradient @ direction)
        taken = float(gradient @ direction @ trajectory)
        quadratic = np.einsum("kalb,k,l->ab", gram, trajectory, trajectory)
        direction = np.linalg.solve(quadratic + 1e-9 * np.trace(quadratic) * np.eye(3), trajectory @ gradient)
        direction = direction / np.linalg.norm(direction)
    return taken


class TorqueCorrelation(NamedTuple):
    """Correlation of one component of the torque, in base axes, with a known series, all recordings pooled."""

    component: str
    series: str
    correlation: float


def torque_correlations(wrench: DisturbingWrench, hypothesis: Hypothesis) -> list[TorqueCorrelation]:
    """Return the largest correlations of the reconstructed torque with motion, orbit and clock, the largest first.

    Parameters
    ----------
    wrench : DisturbingWrench
    hypothesis : Hypothesis
        Hypothesis whose fit gives the motion of the joints and of the base.
    """
    torque = np.concatenate(wrench.torque[Frame.BASE])
    correlations = [
        TorqueCorrelation(f"torque {'xyz'[axis]}", name, float(np.corrcoef(torque[:, axis], series)[0, 1]))
        for name, series in _known_series(wrench, hypothesis)
        for axis in range(3)
        if np.std(series) > 0.0 and np.std(torque[:, axis]) > 0.0
    ]
    return sorted(correlations, key=lambda entry: -abs(entry.correlation))[:MOST_CORRELATIONS]


def _known_series(wrench: DisturbingWrench, hypothesis: Hypothesis) -> Iterator[tuple[str, Floats]]:
    posterior, node = hypothesis.fit.posterior, hypothesis.fit.operating.node
    states = [
        posterior.manoeuvres[r].motion.evaluate(time) for r, time in zip(wrench.recordings, wrench.time, strict=True)
    ]
    for order, kind in enumerate(("position", "speed", "acceleration")):
        for column, joint in enumerate(posterior.model.robot.joints):
            yield f"{kind} of {joint.name}", np.concatenate([state[order][:, column] for state in states])
    counts = [len(time) for time in wrench.time]
    for axis in range(3):
        rates = [np.asarray(node.rate)[r, :n, axis] for r, n in zip(wrench.recordings, counts, strict=True)]
        yield f"rate of the base about {'xyz'[axis]}", np.concatenate(rates)
    if posterior.model.orbit is not None:
        latitude = np.asarray(node.environment.argument_of_latitude)
        phase = np.concatenate([latitude[r, :n] for r, n in zip(wrench.recordings, counts, strict=True)])
        yield "cosine of the argument of latitude", np.cos(phase)
        yield "sine of the argument of latitude", np.sin(phase)
    yield "time", np.concatenate(wrench.time)
    yield "time squared", np.concatenate(wrench.time) ** 2
