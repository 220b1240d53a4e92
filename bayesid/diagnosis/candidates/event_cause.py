"""Kind of the causes that are events, such as kicks, snaps of a panel and jumps of a sensor's bias.

Separate events have amplitudes of their own, which a cause with few amplitudes in all recordings, such as a leak, need
not pay for. In repeated flights events recur: a contact at the same posture, a snap at the edge of the shadow, a change
of range. They are therefore sought in a second way: at one instant of every recording, with the same amplitudes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.candidates.courses import FINE, CourseGram, half_chi2
from bayesid.diagnosis.candidates.generic_cause import TORQUE
from bayesid.diagnosis.candidates.linear_model import Linearisation
from bayesid.diagnosis.candidates.shaped_cause import ShapedCause, ShapeProposal
from bayesid.diagnosis.settings import FULL
from bayesid.simulation.effects.bias_jump import BiasJump
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import Quantity
from bayesid.simulation.effects.events import EVERY, Event, Events
from bayesid.simulation.effects.thermal_snap import ThermalSnap

__all__ = ["EventCause"]

INSTANTS = 6
"""Instants of the bank in each of up to `FULL` recordings; of more, fewer in each, and none is tuned."""

TRIED = 64
"""Instants in each recording that are compared in Gram space."""

MOST = 6
"""Most events of one cause."""

EARNED = 4.0
"""Nats that a further event must earn beyond the number of places where it could be."""

WAYS = 2
"""Ways in which events come, equally probable: each by itself, or alike in every recording."""


class EventCause(ShapedCause):
    """Causes that happen once or a few times in each recording, each time with amplitudes of their own or all alike."""

    name = "event"

    def trials(self, effect: Effect, ends: Floats) -> list[tuple[Effect, bool]]:
        """Return one event in each recording by itself, at the instants of a grid."""
        events = cast(Events, effect)
        count = INSTANTS if len(ends) <= FULL else max(INSTANTS * FULL // len(ends), 1)
        shape = events.trial_shapes[len(events.trial_shapes) // 2 - 1]
        return [
            (events.with_events([Event(r, float(end) * place, shape) for r, end in enumerate(ends)], one=True), True)
            for place in (np.arange(count) + 0.5) / count
        ]

    def of_recording(self, trial: Effect, recording: int) -> Effect:
        """Return the event of one recording."""
        events = cast(Events, trial)
        return events.with_events([event for event in events.events if event.recording == recording])

    def proposals(self, point: Linearisation, effect: Effect, causes: Sequence[str]) -> list[ShapeProposal]:
        """Return the events that earn their places, the best by itself and all together."""
        events = cast(Events, effect)
        group = f"error of {events.sensor.value}" if isinstance(events, BiasJump) else TORQUE
        courses = CourseGram.of(point, group, causes)
        if courses is None:
            return []
        recordings = range(len(courses.ends))
        apart = [event for recording in recordings for event in _events(courses, events, recording)]
        if len(recordings) == 1:
            return _proposals(events, apart, float(courses.ends.sum()), len(recordings), 0.0)
        alike = _events(courses, events, EVERY)
        return [
            *_proposals(events, apart, float(courses.ends.sum()), len(recordings), -float(np.log(WAYS))),
            *_proposals(events, alike, float(courses.ends.min()), 1, -float(np.log(WAYS))),
        ]

    def shape(self, effect: Effect) -> tuple[Floats, Floats]:
        """Return the instants of all events, then their decays."""
        events = cast(Events, effect)
        decays = events.shapes[:, 0] if events.shapes.size else np.zeros(0)
        return np.concatenate([events.times, decays]), np.concatenate([np.full(len(events.times), 2.5), 0.5 * decays])

    def with_shape(self, effect: Effect, numbers: Floats) -> Effect | None:
        """Return the effect with other instants and decays, of which none is negative."""
        events = cast(Events, effect)
        count = len(events.times)
        if (numbers[count:] <= 0.0).any():
            return None
        moved = [
            event._replace(time=float(numbers[k]), shape=(float(numbers[count + k]), *event.shape[1:]))
            if event.shape
            else event._replace(time=float(numbers[k]))
            for k, event in enumerate(events.events)
        ]
        changed = events.with_events(moved)
        changed.parameters = events.parameters
        return changed

    def with_names(self, effect: Effect, names: Sequence[str]) -> Effect:
        """Return the events with the names of their recordings."""
        events = cast(Events, effect)
        return events.with_events(events.events, names)

    def shape_quantities(self, effect: Effect, names: Sequence[str]) -> list[Quantity]:
        """Return the names of the instants, and of the decays."""
        events = cast(Events, effect)
        kinds = ("time", "decay") if events.shapes.size else ("time",)
        return [Quantity(f"{key}{kind}", "s") for kind in kinds for key in events.keys]


def _proposals(
    effect: Events, earned: Sequence[tuple[float, Event]], duration: float, recordings: int, log_way: float
) -> list[ShapeProposal]:
    """Return the best by itself and all together of events that may be anywhere in recordings of some duration [s]."""
    chosen = sorted(earned, key=lambda event: -event[0])[:MOST]
    each = float(np.log(TRIED * recordings * len(effect.trial_shapes)))
    decays = [shape[0] for shape in effect.trial_shapes if shape]
    result = []
    for count in sorted({1, len(chosen)} if chosen else ()):
        # so many events, in any order, with each number of them half as probable as one less
        log_share = log_way + float(np.log(np.arange(1, count + 1)).sum()) - count * float(np.log(2.0))
        widths = np.full(count, duration)
        if decays:  # kept or given back
            log_share -= count * float(np.log(2.0))
            widths = np.concatenate([widths, np.full(count, max(decays))])
        named = effect.with_events(sorted(event for _, event in chosen[:count]))
        gain = sum(gain for gain, _ in chosen[:count])
        result.append(ShapeProposal(named, gain, log_share - count * each, widths, log_share))
    return result


def _events(courses: CourseGram, effect: Events, recording: int) -> list[tuple[float, Event]]:
    """Return the events of one or of every recording that earn their places, one after another, and what each gains."""
    within = range(len(courses.ends)) if recording == EVERY else [recording]
    end = float(courses.ends[within].min())
    instants = end * (np.arange(TRIED) + 0.5) / TRIED
    tried = [Event(recording, float(time), shape) for shape in effect.trial_shapes for time in instants]
    cosines = [courses.cosines(r, np.stack([_course(effect, event, courses, r) for event in tried])) for r in within]
    own = list(zip(within, cosines, strict=True))
    matrix = sum((courses.information(r, part, part) for r, part in own), np.zeros(3))
    score = sum((part @ courses.score[r] for r, part in own), np.zeros(3))
    earned: list[tuple[float, Event]] = []
    while len(earned) < effect.most_in_recording:
        gains = half_chi2(matrix, score)
        best = int(np.argmax(gains))
        if not gains[best] > np.log(len(tried)) + EARNED:
            break
        earned.append((float(gains[best]), tried[best]))
        if len(earned) == effect.most_in_recording:
            break
        shared = sum((courses.information(r, part, part[best]) for r, part in own), np.zeros(3))
        kept = np.linalg.solve(matrix[best] + 1e-9 * np.trace(matrix[best]) * np.eye(3), np.eye(3))
        score = score - shared @ kept @ score[best]
        matrix = matrix - shared @ kept @ np.swapaxes(shared, 1, 2)
        near = np.abs(np.array([event.time for event in tried]) - tried[best].time) < end / TRIED
        score = np.where(near[:, None], 0.0, score)
        matrix = np.where(near[:, None, None], np.eye(3), matrix)
    return earned


def _course(effect: Events, event: Event, courses: CourseGram, recording: int) -> Floats:
    """Return the torque of unit amplitude, or the error of a sensor, at the instants of the courses, (FINE,)."""
    times = courses.times(recording)
    after = times > event.time
    if isinstance(effect, BiasJump):
        return after.astype(float)
    interval = float(courses.ends[recording]) / FINE
    blow = np.zeros(FINE)
    blow[min(int(event.time / interval), FINE - 1)] = 1.0 / interval
    if not isinstance(effect, ThermalSnap):
        return blow
    decay, kept = event.shape
    left = np.where(after, np.exp(-np.maximum(times - event.time, 0.0) / decay) / decay, 0.0)
    return -left if kept else left - blow
