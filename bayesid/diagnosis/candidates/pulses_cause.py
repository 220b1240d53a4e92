"""Kind of the cause that is a regular train of pulses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np

from bayesid._math.arrays import Floats, log_sum
from bayesid.diagnosis.candidates.courses import CourseGram, half_chi2
from bayesid.diagnosis.candidates.generic_cause import TORQUE
from bayesid.diagnosis.candidates.linear_model import Linearisation
from bayesid.diagnosis.candidates.shaped_cause import ShapedCause, ShapeProposal
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import Quantity
from bayesid.simulation.effects.thruster_pulses import PulseTrain, ThrusterPulses

__all__ = ["PulsesCause"]

DUTIES = (0.05, 0.3)
"""Widths relative to the period that are tried."""

PHASES = 12
"""First pulses that are tried in each recording, evenly within the first period."""

FEWEST, FINEST = 5.0, 20.0
"""Fewest pulses in the longest recording, since fewer are kicks of their own, and most, which the cosines of a torque
still resolve."""

COMBINED = 48
"""Combinations of first pulses over which the likelihood of a train is averaged."""

MOST_ON = 0.5
"""Largest share of the time that it fires; one that fires longer leaks with pauses."""

DRIFT = 0.15
"""Step of the period, by which the last pulse in a recording moves so many periods."""

BEST = 3
"""Trains of the bank for each of which the whole is tuned: those that gain most."""


class PulsesCause(ShapedCause):
    """Trains of pulses: a period, a width and whether signs alternate, the same in all recordings, and first pulses."""

    name = "pulses"

    def trials(self, effect: Effect, ends: Floats) -> list[tuple[Effect, bool]]:
        """Return a few trains that begin alike in all recordings."""
        longest = float(ends.max())
        periods = [(longest / 6.0, 0.3), (longest / 12.0, 0.3)]
        return [
            (_of(effect).with_train(PulseTrain(period, duty * period, sign, (phase * period,))), False)
            for period, duty in periods
            for sign in (False, True)
            for phase in (0.1, 0.6)
        ]

    def proposals(self, point: Linearisation, effect: Effect, causes: Sequence[str]) -> list[ShapeProposal]:
        """Return the trains that gain most."""
        courses = CourseGram.of(point, TORQUE, causes)
        if courses is None:
            return []
        longest = float(courses.ends.max())
        periods = [longest / FEWEST]
        while periods[-1] > longest / FINEST:
            periods.append(periods[-1] * (1.0 - DRIFT * periods[-1] / longest))
        shapes = [(period, duty, sign) for period in periods for duty in DUTIES for sign in (False, True)]
        tried = [_best_phases(courses, *shape) for shape in shapes]
        mean = log_sum([log_mean for _, _, log_mean in tried]) - float(np.log(len(tried)))
        ranked = sorted(((gain, train) for gain, train, _ in tried), key=lambda train: -train[0])
        log_prior = -float(np.log(len(shapes))) - len(courses.ends) * float(np.log(PHASES))
        proposals = []
        for gain, train in ranked[:BEST]:
            within = train.period * (2.0 if train.alternating else 1.0)
            first = np.full(len(courses.ends), within)
            widths = np.concatenate([[periods[0] - periods[-1], MOST_ON * train.period], first])
            proposals.append(
                ShapeProposal(_of(effect).with_train(train), gain, log_prior, widths, -float(np.log(2.0)), mean - gain)
            )
        return proposals

    def shape(self, effect: Effect) -> tuple[Floats, Floats]:
        """Return period, width and the first pulses."""
        train = _of(effect).train
        first = np.array(train.first)
        numbers = np.concatenate([[train.period, train.width], first])
        reach = [0.01 * train.period, 0.4 * train.width, *np.full(len(first), train.period / PHASES)]
        return numbers, np.array(reach)

    def with_shape(self, effect: Effect, numbers: Floats) -> Effect | None:
        """Return the train with other numbers, if it fires for at most `MOST_ON` of the time."""
        period, width, *first = map(float, numbers)
        if not 0.0 < width < MOST_ON * period:
            return None
        return _of(effect).with_train(PulseTrain(period, width, _of(effect).train.alternating, tuple(first)))

    def shape_quantities(self, effect: Effect, names: Sequence[str]) -> list[Quantity]:
        """Return period, width, and the first pulse of each recording."""
        first = [f"{name}.first" for name in names] if len(_of(effect).train.first) > 1 else ["first"]
        return [Quantity(key, "s") for key in ("period", "width", *first)]


def _of(effect: Effect) -> ThrusterPulses:
    return cast(ThrusterPulses, effect)


def _best_phases(courses: CourseGram, period: float, duty: float, alternating: bool) -> tuple[float, PulseTrain, float]:
    """Return the gain of a train with the best first pulse in each recording, sought one after another, and the train.

    The third number is the logarithm of the mean likelihood over first pulses, on a lattice of `COMBINED` of them.

    With alternating signs the first pulse is sought within two periods, which gives either sign.
    """
    within = period * (2.0 if alternating else 1.0)
    phases = within * np.arange(PHASES * (2 if alternating else 1)) / (PHASES * (2 if alternating else 1))
    matrices, scores = [], []
    for recording in range(len(courses.ends)):
        times = courses.times(recording)
        since = times - phases[:, None]
        number = np.floor(since / period)
        on = ((since - number * period < duty * period) & (since >= 0.0)).astype(float)
        signs = np.where(alternating & (np.mod(number, 2.0) > 0.5), -1.0, 1.0)
        cosines = courses.cosines(recording, on * signs)
        matrices.append(courses.information(recording, cosines, cosines))
        scores.append(cosines @ courses.score[recording])
    best = [int(np.argmax(half_chi2(matrix, score))) for matrix, score in zip(matrices, scores, strict=True)]
    for _ in range(2):
        for recording in range(len(best)):
            others = [r for r in range(len(best)) if r != recording]
            matrix = matrices[recording] + sum((matrices[r][best[r]] for r in others), np.zeros((3, 3)))
            score = scores[recording] + sum((scores[r][best[r]] for r in others), np.zeros(3))
            gains = half_chi2(matrix, score)
            best[recording] = int(np.argmax(gains))
    first = tuple(float(phases[place]) for place in best)
    lattice = np.arange(COMBINED)[:, None] * (2 * np.arange(len(best)) + 1) % len(phases)
    matrix = sum((matrices[r][lattice[:, r]] for r in range(len(best))), np.zeros((COMBINED, 3, 3)))
    score = sum((scores[r][lattice[:, r]] for r in range(len(best))), np.zeros((COMBINED, 3)))
    log_mean = log_sum(half_chi2(matrix, score)) - float(np.log(COMBINED))
    return float(gains[best[-1]]), PulseTrain(period, duty * period, alternating, first), log_mean
