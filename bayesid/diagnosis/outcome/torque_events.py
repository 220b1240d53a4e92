"""Events of a disturbing torque: what sets in at one instant and dies away or stays.

A smooth torque has one variance per frequency, with which a jump cannot be drawn. Events are chosen one by one: each is
the one with the largest evidence beside those before, averaged over its size, and is kept while that exceeds what its
freedom to be any of the candidates costs (J. J. Kormylo and J. M. Mendel, Maximum likelihood detection and estimation
of Bernoulli-Gaussian processes, IEEE Transactions on Information Theory 28, 1982).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy.linalg as sla
from scipy.special import logsumexp

from bayesid._math.arrays import Floats, Integers
from bayesid.diagnosis.evidence.gram import GaussianBlock
from bayesid.diagnosis.search.fitted_set import Hypothesis
from bayesid.inference.residual_view import by_recording

__all__ = ["ChosenEvents", "EventCandidates", "Taken", "torque_responses"]

INSTANTS = 80  # per recording, at which a torque may set in
DECAYS = (1.0 / 160.0, 1.0 / 40.0, 1.0 / 10.0, np.inf)
"""Times in which it falls to 1/e, relative to the length of the recording; the last stays."""

GRID = np.array([(k / INSTANTS, decay) for decay in DECAYS for k in range(INSTANTS)])
"""Instant and decay of every event of a recording, relative to its length."""

FINER, REFINED = 4, 8
"""Parts into which the interval of the grid is divided about the chosen events, and how many of these are refined."""

MOST = 30  # events of all recordings
ANOTHER = 0.5  # prior probability of one more event
DECADES = 4.0  # over which the size of an event is log-uniform below its bound
NODES = 25  # of the average over the size


class Taken(NamedTuple):
    """What columns that are part of the disturbance already take of the candidates' information and score.

    They do so at the most probable deviations of their amplitudes (`GaussianBlock`).

    Attributes
    ----------
    share : (h, c) array
        Root of what is taken of the information on the candidates' amplitudes: ``share' share``.
    pull : (h,) array
        What is taken of the candidates' score: ``share' pull``.
    """

    share: Floats
    pull: Floats

    @staticmethod
    def nothing(columns: int) -> Taken:
        """Return what nothing takes of a number of candidates' columns."""
        return Taken(np.zeros((0, columns)), np.zeros(0))


@dataclass(frozen=True)
class ChosenEvents:
    """Events that were chosen.

    Attributes
    ----------
    places : tuple of int
        Which of the candidates, in the order of their choice.
    deviations : (3 n,) array
        Most probable standard deviations of their amplitudes.
    log_evidence : float
        What they add to the log evidence, after the cost of their choice.
    """

    places: tuple[int, ...]
    deviations: Floats
    log_evidence: float

    @property
    def columns(self) -> Integers:
        """Indices of their columns, (3 n,)."""
        return (3 * np.array(self.places, dtype=int)[:, None] + np.arange(3)).ravel()


@dataclass(frozen=True)
class EventCandidates:
    """All events that a torque may consist of, three columns each, about the axes of the base.

    Attributes
    ----------
    recording : (e,) array of int
        Of each event.
    shapes : (k, 2) array
        Instant and decay of the events of each recording, relative to its length.
    course : tuple of (S,) arrays
        Course in time of each event at the integration nodes of its recording.
    matrix : (3 e, 3 e) array
        Information on the amplitudes beside all that is fitted.
    shared : (3 e, s) array
        Information shared with the columns of a smooth disturbance.
    score : (3 e,) array
    largest : float
        Largest plausible torque [N m].
    among : int
        Number of events that are equally probable beforehand; those about the chosen ones are a part of a finer grid.
    """

    recording: Integers
    shapes: Floats
    course: tuple[Floats, ...]
    matrix: Floats
    shared: Floats
    score: Floats
    largest: float
    among: int

    @staticmethod
    def of(
        hypothesis: Hypothesis,
        smooth: Floats,
        largest: float,
        recordings: Sequence[int],
        finer: Floats | None = None,
    ) -> EventCandidates:
        """Compute the responses to all events about a fit.

        Parameters
        ----------
        hypothesis : Hypothesis
        smooth : (n, s) array
            Columns of a smooth disturbance in the rows of the recordings.
        largest : float
            Largest plausible torque [N m].
        recordings : sequence of int
            Numbers of those that are looked at; events count them from zero.
        finer : (k, 2) array, optional
            Instants and decays, relative to the length of each recording, of a part of a finer grid (`nearby`); by
            default the grid.
        """
        shapes = GRID if finer is None else finer
        perturbed, fit = hypothesis.perturbed, hypothesis.fit
        looked_at = list(recordings)
        moments = (fit.operating.node, fit.operating.sample)
        times = [np.asarray(instant.environment.time)[looked_at] for instant in moments]
        ends = times[0].max(axis=1)
        count = len(shapes)
        # between two nodes of the integration a jump would be lost: there it is averaged over a step
        longest = np.asarray(perturbed.posterior.data.arrays.grid.step)[looked_at].max(axis=1)
        torques = []
        for time, width in zip(times, (longest, np.zeros(len(ends))), strict=True):
            courses = np.stack([_courses(*row, shapes) for row in zip(time, ends, width, strict=True)], axis=1)
            about_axes = courses[:, None, ..., None] * np.eye(3)[:, None, None]  # (k, 3, R, S, 3)
            torques.append(about_axes.reshape(3 * count, *time.shape, 3))
        blocks = torque_responses(hypothesis, recordings, *torques)
        known, residual = (by_recording(fit.posterior, x)[looked_at] for x in (fit.known, fit.residual))
        apart = smooth.reshape(len(ends), -1, smooth.shape[1])
        cross = np.concatenate([part.T @ block for part, block in zip(known, blocks, strict=True)], axis=1)
        taken = fit.block.share(cross)
        of_smooth = fit.block.share(known.reshape(len(smooth), -1).T @ smooth)
        return EventCandidates(
            np.repeat(np.arange(len(ends)), count),
            shapes,
            tuple(row for time, end in zip(times[0], ends, strict=True) for row in _courses(time, end, 0.0, shapes)),
            sla.block_diag(*(block.T @ block for block in blocks)) - taken.T @ taken,
            np.concatenate([block.T @ part for block, part in zip(blocks, apart, strict=True)]) - taken.T @ of_smooth,
            np.concatenate([(block.T @ part).ravel() for block, part in zip(blocks, residual, strict=True)]),
            largest,
            len(ends) * len(GRID) * (1 if finer is None else 2 * FINER * FINER),
        )

    def nearby(self, events: ChosenEvents) -> Floats:
        """Return the shapes of the chosen events, and of others between them and their neighbours on the grid."""
        places = np.array(events.places) % len(self.shapes)
        near = [tuple(shape) for shape in self.shapes[places]]
        near += [
            (min(max(instant + shift / INSTANTS, 0.0), 1.0), decay * factor)
            for instant, decay in self.shapes[np.unique(places[:REFINED])]
            for shift in np.linspace(-1.0, 1.0, 2 * FINER + 1)
            for factor in ((1.0,) if np.isinf(decay) else 2.0 ** np.linspace(-1.0, 1.0, FINER + 1))
        ]
        return np.unique(near, axis=0)

    def chosen(self, taken: Taken) -> ChosenEvents:
        """Choose events beside what is part of the disturbance already, one by one."""
        cost = float(np.log(self.among / ANOTHER))
        places: list[int] = []
        deviations: list[float] = []
        total = 0.0
        while len(places) < MOST:
            gain = self._gains(taken)[0]
            averaged = logsumexp(gain, axis=1) - np.log(NODES)
            averaged[places] = -np.inf
            best = int(np.argmax(averaged))
            if averaged[best] < cost:
                break
            deviation = float(self._scales[int(np.argmax(gain[best]))])
            taken = self._with(taken, best, deviation)
            places.append(best)
            deviations.append(deviation)
            total += float(averaged[best]) - cost
        return ChosenEvents(tuple(places), np.repeat(deviations, 3), total)

    def like(self, others: EventCandidates, events: ChosenEvents) -> ChosenEvents:
        """Return events that were chosen among other candidates by their places among these.

        Parameters
        ----------
        others : EventCandidates
            All of whose shapes are among these (`nearby`).
        events : ChosenEvents
        """
        within = len(others.shapes)
        places = []
        for place in events.places:
            alike = (self.shapes == others.shapes[place % within]).all(axis=1)
            places.append(int(others.recording[place]) * len(self.shapes) + int(np.flatnonzero(alike)[0]))
        return replace(events, places=tuple(places))

    def averaged(self, taken: Taken, events: ChosenEvents) -> list[tuple[int, Floats, Floats]]:
        """Average each of the chosen events over all shapes, the others as chosen.

        Parameters
        ----------
        taken : Taken
            By what is part of the disturbance beside the events.
        events : ChosenEvents

        Returns
        -------
        list of tuples of int, (S, 3) array and (S, 3) array
            Recording, torque, and its standard deviation over the shapes [N m].
        """
        averages = []
        for place in events.places:
            beside = taken
            for other, deviation in zip(events.places, events.deviations[::3], strict=True):
                if other != place:
                    beside = self._with(beside, other, float(deviation))
            gain, vectors, along, visible = self._gains(beside)
            rivals = np.flatnonzero(self.recording == self.recording[place])
            weights = np.exp(gain[rivals] - logsumexp(gain[rivals]))
            # along the eigenvectors, (k, t, 3)
            means = -along[rivals] / (1.0 + visible[rivals]) * self._scales[:, None]
            amplitudes = np.einsum("kt,kab,ktb->ka", weights, vectors[rivals], means)
            probability = weights.sum(axis=1)
            courses = np.stack([self.course[k] for k in rivals])
            torque = courses.T @ amplitudes
            each = np.divide(
                amplitudes, probability[:, None], out=np.zeros_like(amplitudes), where=probability[:, None] > 0
            )
            square = (courses.T**2) @ (probability[:, None] * each**2)
            averages.append((int(self.recording[place]), torque, np.sqrt(np.maximum(square - torque**2, 0.0))))
        return averages

    @property
    def _scales(self) -> Floats:
        return self.largest * 10.0 ** np.linspace(-DECADES, 0.0, NODES)

    def _gains(self, taken: Taken) -> tuple[Floats, Floats, Floats, Floats]:
        """Return the log evidence of each event at each scale, (e, t), and what its amplitudes' mean follows from."""
        part = taken.share.reshape(len(taken.share), len(self.recording), 3)
        values, vectors = np.linalg.eigh(self._blocks - np.einsum("hea,heb->eab", part, part))
        score = (self.score - taken.share.T @ taken.pull).reshape(-1, 3)
        visible = np.maximum(values, 0.0)[:, None] * self._scales[:, None] ** 2  # (e, t, 3)
        along = np.einsum("eab,ea->eb", vectors, score)[:, None] * self._scales[:, None]
        gain = 0.5 * (along**2 / (1.0 + visible) - np.log1p(visible)).sum(axis=-1)
        return gain, vectors, along, visible

    @cached_property
    def _blocks(self) -> Floats:
        """Information on the amplitudes of each event, (e, 3, 3)."""
        each = np.arange(len(self.recording))
        return self.matrix.reshape(len(each), 3, -1, 3)[each, :, each]

    def _with(self, taken: Taken, place: int, deviation: float) -> Taken:
        """Return what is taken with one more event."""
        columns = slice(3 * place, 3 * place + 3)
        rest = self.matrix[columns] - taken.share[:, columns].T @ taken.share
        score = self.score[columns] - taken.share[:, columns].T @ taken.pull
        block = GaussianBlock.of(rest[:, columns], np.full(3, deviation))
        return Taken(np.concatenate([taken.share, block.share(rest)]), np.concatenate([taken.pull, block.share(score)]))


def torque_responses(hypothesis: Hypothesis, recordings: Sequence[int], nodes: Floats, samples: Floats) -> Floats:
    """Return the responses of the whitened residual of some recordings to torques on the base, (r, N / R, k).

    Parameters
    ----------
    hypothesis : Hypothesis
    recordings : (r,) sequence of int
        Numbers of the recordings.
    nodes, samples : (k, r, S, 3) and (k, r, T, 3) arrays
        Torques in base axes at the nodes of the integration and at the samples [N m].
    """
    perturbed, fit = hypothesis.perturbed, hypothesis.fit
    node, sample = (np.concatenate([np.zeros_like(torque), torque], axis=-1) for torque in (nodes, samples))
    perturbation = perturbed.perturbation(len(node), len(recordings), node_wrench=node, sample_wrench=sample)
    responses = perturbed.respond(perturbation, fit.z, fit.data, recordings)
    return responses.reshape(len(recordings), -1, responses.shape[1])


def _courses(time: Floats, end: float, width: float, shapes: Floats) -> Floats:
    """Return the courses of events of given shapes at given times, or averaged over a width about these, (k, S)."""
    decay = end * shapes[:, 1:]
    since = time - end * shapes[:, :1]
    if not width:
        return (since >= 0.0) * np.exp(-np.maximum(since, 0.0) / decay)
    sums = [
        np.where(np.isinf(decay), begun, -np.minimum(decay, 1e9) * np.expm1(-begun / decay))
        for begun in (np.maximum(since + 0.5 * side * width, 0.0) for side in (-1.0, 1.0))
    ]
    return (sums[1] - sums[0]) / width
