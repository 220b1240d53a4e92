"""Search of the mistakes that explain what readings as declared do not, one after the other, and their probabilities.

Sets of mistakes are weighed by their evidence under the balance of momentum and by the prior of their families (sets
grow from the best ones, as in a beam search). Nothing is named unless it explains several times more than the readings
as declared and leaves nothing: what a mistake only halves is an effect that imitates it. Nor is anything named of
sensors that read no motion, which fits whatever makes the motion vanish.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import log_sum
from bayesid.inference.conventions.mistake import LEVELS, Mistake, convention_families
from bayesid.inference.conventions.momentum_balance import BalanceFit, BalanceProblem, MomentumBalance
from bayesid.inference.conventions.readings_on_grid import ReadingsOnGrid
from bayesid.recording.convention import STATE_CONVENTIONS, Convention, ConventionError
from bayesid.recording.recorded_as import RecordedAs, SensorRecordedAs
from bayesid.recording.suspect_readings import suspect_readings
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import SensorKind

__all__ = ["find_conventions", "refuse_conventions"]

BELIEVED = 0.95  # probability that the named mistakes, or their equals, must hold together
MENTIONED = 0.04  # smallest probability of a mistake that is named beside its equals
GAIN = 6.0  # factor by which the mean square of what is unexplained must fall in a sensor
LEFT = 4.0  # largest mean square that is unexplained with a name, relative to that of any right simulation
FEWEST_NATS = 5.0  # gain of log probability for which one more mistake is worth trying
BEAM = 2  # number of sets from which larger ones are made
DEEPEST = 3  # largest number of mistakes at once
COARSE, FINE = 2, 10  # iterations of the fit that selects members, and of that which weighs them
LIKELY, KEPT = 10, 4  # numbers of members that are fitted well at these instants, and that are weighed
INSTANTS = 40  # number of instants by which members are selected
RECORDINGS = 2  # number of recordings that are looked at, as a mistake is in all of them


@dataclass(frozen=True)
class _MistakeSet:
    """Mistakes at once, and the fits of all recordings without them."""

    mistakes: tuple[Mistake, ...]
    fits: tuple[BalanceFit, ...]
    log_prior: float

    @property
    def log_weight(self) -> float:
        return self.log_prior + sum(fit.log_evidence for fit in self.fits)

    def hope(self, parts: Sequence[str] = ()) -> float:
        """Return the log evidence that a perfect explanation of some parts of the balance, or of all, would gain."""
        return float(sum(gain for fit in self.fits for name, gain in fit.gains.items() if not parts or name in parts))

    @property
    def made(self) -> list[Mistake]:
        """The mistakes one by one."""
        return [part for mistake in self.mistakes for part in mistake.parts or (mistake,)]

    @property
    def could_gain(self) -> bool:
        """Whether the misfit of some part of the balance could fall by as much as it must for a name."""
        return any(fit.misfit[name] > GAIN * floor for fit in self.fits for name, floor in fit.floors.items())

    @property
    def key(self) -> frozenset[str]:
        return frozenset(f"{mistake.name} {mistake.channel} {id(mistake)}" for mistake in self.mistakes)


class _Search:
    def __init__(self, model: Model, manoeuvres: Sequence[Manoeuvre]) -> None:
        known = {prior.name for prior in model.bodies}
        spreads = [prior.spread for prior in model.priors if prior.name not in known]
        self.balance = MomentumBalance(model.robot, model.bodies, model.rate_sigma, max(spreads, default=0.0))
        stated = np.array([manoeuvre.attitude for manoeuvre in manoeuvres])
        self.recorded = [ReadingsOnGrid.of(model, manoeuvre, stated) for manoeuvre in manoeuvres[:RECORDINGS]]
        self.few = [max(self.recorded, key=_motion).thinned(INSTANTS)]
        self.model = model
        self._problems: dict[tuple[int, bytes], BalanceProblem] = {}

    @cached_property
    def members(self) -> list[tuple[Mistake, float]]:
        """Members of all families, each with the logarithm of its prior."""
        return [
            (mistake, float(np.log(family.prior * mistake.share)))
            for family in convention_families()
            for mistake in family.members(self.model, self.recorded[0])
        ]

    def weigh(self, mistakes: Sequence[Mistake], log_prior: float, coarsely: int = 0) -> _MistakeSet:
        """Return a set with its fits.

        Parameters
        ----------
        mistakes : sequence of Mistake
        log_prior : float
        coarsely : int
            Iterations at a few instants of one recording, if those do.
        """
        ordered = tuple(sorted(mistakes, key=lambda mistake: mistake.rank))
        fits = []
        for recorded in self.few if coarsely else self.recorded:
            readings = recorded
            for mistake in ordered:
                readings = mistake.undo(readings)
            fits.append(self._problem(readings).fit(coarsely or FINE))
        return _MistakeSet(ordered, tuple(fits), log_prior)

    def _problem(self, readings: ReadingsOnGrid) -> BalanceProblem:
        """Return the problem, with the tables of others in which the joints move the same."""
        key = len(readings.time), readings.joints.position.tobytes()
        if key not in self._problems:
            self._problems[key] = self.balance.problem(readings)
        return replace(self._problems[key], readings=readings)

    def run(self) -> tuple[_MistakeSet, list[_MistakeSet]]:
        """Return the readings as declared, and all sets that were weighed."""
        declared = self.weigh((), 0.0)
        weighed = {declared.key: declared}
        beam = [declared] if declared.could_gain else []
        for _ in range(DEEPEST):
            grown: dict[frozenset[str], _MistakeSet] = {}
            for parent in beam:
                for considered in self._selected(parent):
                    fine = self._refined(self.weigh(considered.mistakes, considered.log_prior))
                    if fine.log_weight > parent.log_weight + FEWEST_NATS:
                        grown[fine.key] = fine
                if any(considered.hope() < FEWEST_NATS for considered in grown.values()):
                    break  # its rivals with one other mistake are there, and other first mistakes lead to the same sets
            weighed |= grown
            beam = sorted(grown.values(), key=lambda considered: -considered.log_weight)[:BEAM]
            if not beam or beam[0].hope() < FEWEST_NATS:
                break
        return declared, list(weighed.values())

    def _selected(self, parent: _MistakeSet) -> list[_MistakeSet]:
        """Return the most promising sets with one more mistake."""
        places = {mistake.place for mistake in parent.mistakes}
        sets = [
            self.weigh((*parent.mistakes, mistake), parent.log_prior + prior, COARSE)
            for mistake, prior in self.members
            if mistake.place not in places and parent.hope(mistake.seen_by) - FEWEST_NATS > -prior
        ]
        likely = sorted(sets, key=lambda considered: -considered.log_weight)[:LIKELY]
        fitted = [self.weigh(considered.mistakes, considered.log_prior, FINE) for considered in likely]
        return sorted(fitted, key=lambda considered: -considered.log_weight)[:KEPT]

    def _refined(self, considered: _MistakeSet) -> _MistakeSet:
        """Return the set with members of continuous families refined."""
        for level in range(LEVELS):
            for place, mistake in enumerate(considered.mistakes):
                others = considered.mistakes[:place], considered.mistakes[place + 1 :]
                sets = [
                    self.weigh((*others[0], near, *others[1]), considered.log_prior) for near in mistake.nearby(level)
                ]
                considered = max([considered, *sets], key=lambda one: one.log_weight)
        return considered


def _motion(readings: ReadingsOnGrid) -> float:
    return float(np.ptp(readings.joints.position, axis=0).sum())


def find_conventions(model: Model, manoeuvres: Sequence[Manoeuvre]) -> list[Convention]:
    """Return the wrong conventions of recordings, the most probable first; none where they are as declared.

    Readings that no sensor gives are looked for first, and left out of the balance of momentum.

    Parameters
    ----------
    model : Model
    manoeuvres : sequence of Manoeuvre
    """
    suspects = [suspect for manoeuvre in manoeuvres for suspect in suspect_readings(manoeuvre.recording)]
    repeated = {convention.remedy: convention for suspect in suspects if (convention := suspect.convention)}
    conventions = list(repeated.values())
    used = {"position", *(sensor.kind.value for sensor in model.sensors)}
    conventions = [convention for convention in conventions if convention.name.split(":")[2].partition(".")[0] in used]
    if any(suspect.convention and suspect.columns[0].startswith("position") for suspect in suspects):
        return conventions  # motion that is smoothed through such readings says nothing
    with np.errstate(all="ignore"):
        try:
            return conventions + _by_balance(model, [_without(manoeuvre, conventions) for manoeuvre in manoeuvres])
        except (InputError, np.linalg.LinAlgError):  # a sensor is not recorded, or nothing moves
            return conventions


def refuse_conventions(model: Model, manoeuvres: Sequence[Manoeuvre]) -> None:
    """Refuse recordings with wrong conventions.

    Parameters
    ----------
    model : Model
    manoeuvres : sequence of Manoeuvre

    Raises
    ------
    ConventionError
    """
    if conventions := find_conventions(model, manoeuvres):
        raise ConventionError(conventions, remedy=STATE_CONVENTIONS)


def _without(manoeuvre: Manoeuvre, conventions: Sequence[Convention]) -> Manoeuvre:
    """Return a recording without the readings that no sensor gives."""
    if not conventions:
        return manoeuvre
    recording, sensors = manoeuvre.recording, {}
    for suspect in suspect_readings(recording):
        if suspect.convention is not None:
            rate = 1.0 / suspect.interval if suspect.interval else 0.0
            sensors[suspect.columns[0].partition(".")[0]] = SensorRecordedAs(suspect.value, rate)
    return replace(manoeuvre, recording=recording.converted(RecordedAs(sensors=sensors)))


def _by_balance(model: Model, manoeuvres: Sequence[Manoeuvre]) -> list[Convention]:
    if not any(model.sensor(kind) for kind in (SensorKind.RATE, SensorKind.ACCEL, SensorKind.ATTITUDE)):
        return []
    search = _Search(model, manoeuvres)
    declared, weighed = search.run()
    if len(weighed) == 1:
        return []
    total = log_sum([considered.log_weight for considered in weighed])
    best = max(weighed, key=lambda considered: considered.log_weight)
    explained = [
        before.misfit[name] / after.misfit[name]
        for before, after in zip(declared.fits, best.fits, strict=True)
        for name in before.misfit
    ]
    leaves_nothing = all(fit.misfit[name] <= LEFT * fit.floors[name] for fit in best.fits for name in fit.misfit)
    sees_motion = any(fit.signals[name] > GAIN * fit.misfit[name] for fit in best.fits for name in fit.misfit)
    if np.exp(declared.log_weight - total) > 1.0 - BELIEVED or max(explained, default=0.0) < GAIN:
        return []
    if not (leaves_nothing and sees_motion) or any(mistake.effect for mistake in best.mistakes):
        return []
    conventions: list[tuple[Mistake, Convention]] = []
    for considered in sorted(weighed, key=lambda considered: -considered.log_weight):
        probability = float(np.exp(considered.log_weight - total))
        if probability < MENTIONED or any(mistake.effect for mistake in considered.mistakes):
            continue
        readings = search.recorded[0]
        for mistake in considered.made:
            remedy = mistake.remedy(readings)
            same = [
                k
                for k, (other, said) in enumerate(conventions)
                if other.is_like(mistake) or (said.name, said.remedy) == (mistake.name, remedy)
            ]
            if same:
                other, said = conventions[same[0]]
                conventions[same[0]] = other, replace(said, probability=said.probability + probability)
            else:
                text = mistake.text(readings)
                said = Convention(mistake.name, mistake.channel, remedy, text, probability)
                conventions.append((mistake, said))
            readings = mistake.undo(readings)
    return [convention for _, convention in conventions]
