"""Kind of the cause that is a regular train of pulses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from bayesid._math.arrays import Floats, log_sum
from bayesid.diagnosis.candidates.cause_kind import Bounds, CauseAmplitude
from bayesid.diagnosis.candidates.courses import CourseGram, half_chi2
from bayesid.diagnosis.candidates.generic_cause import TORQUE
from bayesid.diagnosis.candidates.linear_model import Linearisation, SignatureBank
from bayesid.diagnosis.candidates.shaped_cause import ShapedCause, ShapeProposal, form_of, responses_of
from bayesid.diagnosis.evidence.scales import CandidateCause
from bayesid.diagnosis.response.perturbed_model import Fit, PerturbedModel
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import Quantity
from bayesid.simulation.effects.environment_effects import ThrusterLeak
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

WAYS = 2
"""Ways of beginning, equally probable: at one time of all recordings, where the train starts with what is recorded, or
in each at a time of its own."""

MOST_ON = 0.5
"""Largest share of the time that it fires; one that fires longer leaks with pauses."""

SHORTEST = 0.1
"""Shortest period of a train [s]: valves need some hundredths of a second to open and to close."""

DRIFT = 0.15
"""Step of the period, by which the last pulse in a recording moves so many periods."""

STEADY = (SHORTEST, SHORTEST)
"""Period and width of the average of fast trains: they thrust all the time."""

BEST = 3
"""Trains of the bank for each of which the whole is tuned: those that gain most."""


class PulsesCause(ShapedCause):
    """Trains of pulses: a period, a width and whether signs alternate, the same in all recordings, and first pulses."""

    name = "pulses"
    alone_as_well = True  # a leak with pulses of either sign equals pulses of one sign

    def signatures(
        self, perturbed: PerturbedModel, fit: Fit, effects: Sequence[Effect], bounds: Bounds
    ) -> SignatureBank:
        """Return the bank of a few slow trains, and of the average of those that are too fast for the readings.

        Pulses of one sign in quick succession act like a leak, so that both are one class of equivalents where the
        data prefer that form. Its share is that of such periods if the period is log-uniform, and half of the trains
        alternate; alternating pulses in quick succession move nothing.
        """
        bank = super().signatures(perturbed, fit, effects, bounds)
        longest = float(np.asarray(fit.operating.sample.environment.time).max())
        fast = np.log(longest / FINEST / SHORTEST) / np.log(longest / FEWEST / SHORTEST)
        share = 0.5 * float(fast)
        if not effects or share <= 0.0:
            return bank
        (columns,) = responses_of(perturbed, fit, [ThrusterLeak()])
        signatures, causes = list(bank.signatures), list[CandidateCause]()
        for effect, cause in zip(effects, bank.causes, strict=True):
            steady = _of(effect).with_train(PulseTrain(*STEADY, False, (0.0,)))
            items, groups = form_of(f"{effect.label}, fast", steady, columns, bounds[effect.label])
            signatures += items
            slow = (1.0 - share) / len(cause.variants)
            others = (*(variant.groups for variant in cause.variants[1:]), groups)
            causes.append(replace(cause, others=others, shares=(*[slow] * len(cause.variants), share)))
        return SignatureBank(tuple(signatures), tuple(causes))

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
        tried = [_phases(courses, *shape) for shape in shapes]
        mean = log_sum([log_mean for _, log_mean in tried]) - float(np.log(len(tried)))
        log_shapes = -float(np.log(len(shapes)) + np.log(WAYS))
        proposals = []
        for gain, train in (best for both, _ in tried for best in both):
            count = len(train.first)
            within = train.period * (2.0 if train.alternating else 1.0)
            widths = np.array([periods[0] - periods[-1], MOST_ON * train.period, *(within,) * count])
            log_prior = log_shapes - count * float(np.log(PHASES))
            log_share = -float(np.log(2.0) + np.log(WAYS))
            proposals.append(
                ShapeProposal(_of(effect).with_train(train), gain, log_prior, widths, log_share, mean - gain)
            )
        return sorted(proposals, key=lambda proposal: -proposal.worth)[:BEST]

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

    def instants(self, perturbed: PerturbedModel, fit: Fit, label: str) -> list[CauseAmplitude]:
        """Return the numbers of the train; none of one that is too fast for the readings to have any."""
        mine = (effect for effect in fit.effects if effect.cause_kind == self.name and effect.candidate == label)
        if any(_of(effect).train[:2] == STEADY for effect in mine):
            return []
        return super().instants(perturbed, fit, label)

    def shape_quantities(self, effect: Effect, names: Sequence[str]) -> list[Quantity]:
        """Return period, width, and the first pulse of each recording."""
        first = [f"{name}.first" for name in names] if len(_of(effect).train.first) > 1 else ["first"]
        return [Quantity(key, "s") for key in ("period", "width", *first)]


def _of(effect: Effect) -> ThrusterPulses:
    return cast(ThrusterPulses, effect)


def _phases(
    courses: CourseGram, period: float, duty: float, alternating: bool
) -> tuple[list[tuple[float, PulseTrain]], float]:
    """Return the trains of one shape whose first pulses gain most, with what they gain, and the mean over first pulses.

    The first pulse comes at the same time of all recordings, or in each at one of its own, sought one after another.
    With alternating signs it is sought within two periods, which gives either sign. The mean is the logarithm of that
    of the likelihoods, either way being as probable; first pulses of their own are averaged over a lattice of
    `COMBINED` of them.
    """
    turns = 2 if alternating else 1
    phases = period * np.arange(PHASES * turns) / PHASES
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
    matrix, score = np.stack(matrices, axis=1), np.stack(scores, axis=1)  # (phases, recordings, 3, 3), (..., 3)
    recordings = range(len(courses.ends))
    alike = half_chi2(matrix.sum(axis=1), score.sum(axis=1))
    best = np.full(len(recordings), int(np.argmax(alike)))
    trains = [(float(alike.max()), PulseTrain(period, duty * period, alternating, (float(phases[best[0]]),)))]
    if len(recordings) == 1:
        return trains, log_sum(alike) - float(np.log(len(phases)))
    for _ in range(2):
        for recording in recordings:
            others = [r for r in recordings if r != recording]
            gains = half_chi2(
                matrix[:, recording] + matrix[best[others], others].sum(axis=0),
                score[:, recording] + score[best[others], others].sum(axis=0),
            )
            best[recording] = int(np.argmax(gains))
    trains.append((float(gains.max()), PulseTrain(period, duty * period, alternating, tuple(phases[best].tolist()))))
    lattice = np.arange(COMBINED)[:, None] * (2 * np.arange(len(recordings)) + 1) % len(phases)
    apart = half_chi2(matrix[lattice, recordings].sum(axis=1), score[lattice, recordings].sum(axis=1))
    means = [log_sum(gains) - float(np.log(len(gains))) for gains in (alike, apart)]
    return trains, log_sum(means) - float(np.log(WAYS))
