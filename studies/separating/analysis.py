"""The manoeuvres designed to distinguish two causes, and their rates of decisions, predicted and realised."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from bayesid import Manoeuvre, Model, Orbit
from bayesid._math.arrays import Floats, Integers
from bayesid._math.double_precision import in_double_precision
from bayesid.design import THOROUGH, DecisionRate, DOptimal, Problem, Search, Separation, Store, optimise
from bayesid.design.decision_rate import DECISION, RivalDraws, decided_margins, log_evidence
from bayesid.design.design_problem import Known
from bayesid.design.design_result import decisions
from bayesid.design.rival_prior import ScaleGrid, effect_of
from bayesid.design.search_starts import adapted_to_family
from bayesid.design.trajectories import ParameterisedMotion
from bayesid.inference.unknowns import Unknowns
from bayesid.recording.joint_motion import Motion
from studies.common import mission
from studies.common.ets7 import BIAS, RADIUS
from studies.common.models import ARM_SPREAD
from studies.common.monte_carlo import run_trials
from studies.common.repeated_fits import Reference
from studies.separating.pairs import INCLINATION, PAIRS, Cause, Pair

# stages of the study, with the manoeuvres that are fitted together in each
STAGES = {
    "first alone": ("first",),
    "first, d-optimal": ("first", "d-optimal"),
    "first, separating": ("first", "separation"),
}

LAST = "first, separating"  # stage with the separating manoeuvre

DIRECTIONS = ("stated", "random")  # direction of a hidden cause, whose size is the stated one in either case

SPREAD = 0.1  # relative width of the prior of the base

# rate of the base when a manoeuvre starts, 1.5 degrees in a minute [rad/s]; unknown to every fit
DRIFT = np.array([3e-4, -2e-4, 2.5e-4])

NEEDED = float(np.log(DECISION / (1.0 - DECISION)))  # log Bayes factor at a decision between two causes

PREDICTED = 20_000  # number of draws behind a predicted rate


def rival_model(pair: Pair, arm_spread: float = ARM_SPREAD) -> Model:
    """Return the mission's model with both causes."""
    model = mission.base_unknown(arm_spread, base_spread=SPREAD)
    model = replace(model, orbit=Orbit(RADIUS, inclination=INCLINATION))
    for cause in pair.causes:
        model = model.extend(cause.effect)
    return model


def drifting(unknowns: Unknowns) -> Floats:
    """Return the coordinates of the prior's centre, but with every manoeuvre starting at the rate `DRIFT`."""
    z = np.zeros(unknowns.size)
    z[unknowns.layout.all_rates] = np.tile(DRIFT / unknowns.rate_sigma, unknowns.recordings)
    return z


@dataclass(frozen=True)
class Linearised:
    """Manoeuvres linearised about the drifting base, in the unknowns of a model with both causes."""

    information: Floats  # (n, n): information in coordinates whose prior is standard normal, without that prior
    names: tuple[str, ...]  # names of the unknowns
    # (n,): Jacobian transposed times the whitened data, in coordinates counted from zero; zero where nothing was
    # recorded
    score: Floats

    @classmethod
    def of(cls, reference: Reference, manoeuvre: Manoeuvre | None = None) -> Linearised:
        """Linearise one manoeuvre about a plan, with what was recorded of it if it was flown."""
        jacobian = reference.jacobian[: -reference.posterior.size]
        score = np.zeros(reference.posterior.size)
        if manoeuvre is not None:
            residual = reference.given(manoeuvre).residuals(reference.z).ravel()
            score = jacobian.T @ (jacobian @ reference.z - residual)
        return cls(jacobian.T @ jacobian, reference.posterior.unknowns.names, score)

    def with_another(self, other: Linearised) -> Linearised:
        """Join two manoeuvres, which share all unknowns but the initial rates."""
        count = len(self.names)
        fresh = [index for index, name in enumerate(other.names) if name.startswith("initial-rate")]
        place = [count + fresh.index(index) if index in fresh else index for index in range(len(other.names))]
        total, score = np.pad(self.information, (0, len(fresh))), np.pad(self.score, (0, len(fresh)))
        total[np.ix_(place, place)] += other.information
        score[place] += other.score
        return Linearised(total, (*self.names, *(f"second {other.names[index]}" for index in fresh)), score)

    def left(self, change: Floats, amplitudes: Sequence[int]) -> tuple[Floats, Floats]:
        """Return information (K, K) and score (K,) that all other unknowns leave to the amplitudes of the causes.

        Parameters
        ----------
        change : (m, m) array; derivatives of the first m coordinates by amplitudes and other coordinates
        amplitudes : (K,) sequence of int; places of the amplitudes
        """
        whole = np.eye(len(self.names))
        whole[: len(change), : len(change)] = change
        total = whole.T @ (self.information + np.eye(len(whole))) @ whole
        order = [*np.setdiff1d(np.arange(len(whole)), amplitudes), *amplitudes]
        scale = np.sqrt(np.diag(total))[order]
        factor = scale[:, None] * np.linalg.cholesky(total[np.ix_(order, order)] / np.outer(scale, scale))
        last = factor[-len(amplitudes) :, -len(amplitudes) :]
        score = last @ np.linalg.solve(factor, (whole.T @ self.score)[order])[-len(amplitudes) :]
        prior = (change.T @ change)[np.ix_(amplitudes, amplitudes)]
        return last @ last.T - prior, score


@in_double_precision
def _log_evidence(information: Floats, score: Floats, grid: ScaleGrid) -> float:
    return float(log_evidence(jnp.asarray(information), jnp.asarray(score), grid)[0])


class LogEvidence(NamedTuple):
    """Log evidences of both causes relative to none of them, in the order of the pair."""

    first: float
    second: float


@dataclass(frozen=True)
class Weighing:
    """What the readings of a stage say of a pair of causes, each with the prior of a diagnosis."""

    problem: Problem  # with the criterion `Separation`, adapted to its family, last
    change: Floats  # see `Linearised.left`
    amplitudes: Sequence[int]  # see `Linearised.left`

    @classmethod
    def of(cls, problem: Problem) -> Weighing:
        """Return the weighing with the rivals and the prior of a problem."""
        change, amplitudes = in_double_precision(cls._separation(problem).coordinates)(problem.plan)
        return cls(problem, np.asarray(change), list(map(int, amplitudes)))

    @staticmethod
    def _separation(problem: Problem) -> Separation:
        return next(criterion for criterion in problem.criteria if isinstance(criterion, Separation))

    @property
    def criterion(self) -> Separation:
        """Criterion whose prior is used."""
        return self._separation(self.problem)

    def evidence(self, readings: Linearised) -> LogEvidence:
        """Return the evidences from what was recorded."""
        information, score = readings.left(self.change, self.amplitudes)
        values, start = [], 0
        for prior in self.criterion.priors(self.problem.plan):
            part = slice(start, start := start + len(prior.scale_of))
            values.append(_log_evidence(information[part, part], score[None, part], prior.grid))
        return LogEvidence(*values)

    def relative(self, label: str, amplitudes: Floats) -> Floats:
        """Return amplitudes in SI units, (..., k), in units of their largest plausible sizes."""
        return np.asarray(amplitudes / effect_of(self.problem.plan, label)[1])

    def predict(self, plan: Linearised, amplitudes: Sequence[Floats], rng: np.random.Generator) -> list[DecisionRate]:
        """Return the rate of decisions for each cause with amplitudes (d, k), in units of their largest sizes."""
        information, _ = plan.left(self.change, self.amplitudes)
        draws = RivalDraws(amplitudes, rng.normal(size=(len(amplitudes[0]), len(information))))
        margins = decided_margins(information, self.criterion.priors(self.problem.plan), draws)
        return [DecisionRate.of(row >= 0.0) for row in margins]


@dataclass(frozen=True)
class Designed:
    """A designed manoeuvre."""

    costs: dict[str, float]  # values of both criteria by name
    largest: dict[str, float]  # largest values of the limited quantities by name
    motion: ParameterisedMotion  # motion of the joints
    rates: dict[str, DecisionRate]  # rates of decisions expected under the prior of each cause, by its label


def separating_problem(pair: Pair, points: int = mission.POINTS, arm_spread: float = ARM_SPREAD) -> Problem:
    """Return the problem: six joints on B-splines within the flight's rule, volume and separation as criteria.

    Manoeuvres start at the rate that the first manoeuvre has shown, and what the first manoeuvre says of all other
    unknowns is known.
    """
    model = rival_model(pair, arm_spread)
    problem = mission.problem(model, mission.splines(points), DOptimal(), Separation(pair.labels))
    unknowns = problem.plan.unknowns
    z = drifting(unknowns)
    first = Linearised.of(Reference.of(model, mission.flight_manoeuvre(), z))
    rates = np.arange(unknowns.size)[unknowns.layout.all_rates]
    shared = np.setdiff1d(np.arange(unknowns.size), rates)
    precision = np.eye(unknowns.size)
    precision[np.ix_(shared, shared)] += unexplained_information(first.information, shared, rates)
    return problem.knowing(Known(z, precision))


def unexplained_information(information: Floats, group: Integers, rest: Integers) -> Floats:
    """Return the information about a group of unknowns that the rest cannot imitate, shape (group, group).

    Parameters
    ----------
    information : (n, n) array; information about all unknowns, without their prior
    group, rest : arrays of int; unknowns of interest, and those to be marginalised with a standard normal prior
    """
    inner = information[np.ix_(rest, rest)] + np.eye(len(rest))
    cross = information[np.ix_(rest, group)]
    return np.asarray(information[np.ix_(group, group)] - cross.T @ np.linalg.solve(inner, cross))


def design_both(
    problem: Problem, seed: int, search: Search, store: Store, progress: Callable[[str], None]
) -> tuple[Problem, dict[str, Designed]]:
    """Design by both criteria from the same random starts, the second also from the first's best.

    The problem is returned with its criteria adapted to what manoeuvres of the family resolve.
    """
    problem = adapted_to_family(problem, np.random.default_rng(seed))
    optima: list[np.ndarray] = []
    for criterion in problem.criteria:
        kept = store.of(" ".join((criterion.name, *Weighing.of(problem).criterion.rivals)))
        best = optimise(
            problem,
            criterion,
            np.random.default_rng(seed),
            search,
            first=optima,
            known=kept.known,
            keep=kept.keep,
            progress=lambda _, text: progress(text),
        )
        optima.append(best.parameters)
    return problem, {
        criterion.name: Designed(
            costs=problem.costs(best),
            largest={limit.name: limit.largest for limit in problem.reached(best)},
            motion=problem.plan.family.motion(best),
            rates=decisions(problem, best, np.random.default_rng(seed)),
        )
        for criterion, best in zip(problem.criteria, optima, strict=True)
    }


def references(pair: Pair, motions: Mapping[str, Motion], arm_spread: float = ARM_SPREAD) -> dict[str, Reference]:
    """Return the manoeuvres linearised about the drifting base, with both causes as unknowns.

    Parameters
    ----------
    pair : Pair
    motions : mapping of str to Motion
    arm_spread : float; relative width of the links' priors
    """
    model = rival_model(pair, arm_spread)
    z = drifting(mission.problem(model, mission.splines()).plan.unknowns)
    return {name: Reference.of(model, motion, z) for name, motion in motions.items()}


def joined(single: Mapping[str, Linearised], names: Sequence[str]) -> Linearised:
    """Return the manoeuvres of a stage, fitted together."""
    first, *others = names
    total = single[first]
    for name in others:
        total = total.with_another(single[name])
    return total


Case = tuple[str, str, str]  # label of the hidden cause, its direction of `DIRECTIONS`, and the stage


def predictions(pair: Pair, weighing: Weighing, known: Mapping[str, Reference], seed: int) -> dict[Case, DecisionRate]:
    """Predict the rates of decisions for causes of the stated size, in the stated and in random directions."""
    single = {name: Linearised.of(reference) for name, reference in known.items()}
    rng = np.random.default_rng(seed)
    predicted: dict[Case, DecisionRate] = {}
    for direction in DIRECTIONS:
        drawn = [np.array([_amplitudes(cause, direction, rng) for _ in range(PREDICTED)]) for cause in pair.causes]
        amplitudes = [
            weighing.relative(cause.label, cause.linear(values))
            for cause, values in zip(pair.causes, drawn, strict=True)
        ]
        for stage, names in STAGES.items():
            rates = weighing.predict(joined(single, names), amplitudes, rng)
            predicted |= {(label, direction, stage): rate for label, rate in zip(pair.labels, rates, strict=True)}
    return predicted


def _amplitudes(cause: Cause, direction: str, rng: np.random.Generator) -> Floats:
    return cause.amplitudes if direction == "stated" else cause.turned(rng)


@dataclass(frozen=True)
class Realised:
    """Log Bayes factors over flights with a hidden cause."""

    label: str  # of the cause
    direction: str  # one of `DIRECTIONS`
    detected: Floats  # (S,): log Bayes factors of the truth against neither cause, from the first manoeuvre alone
    factors: Mapping[str, Floats]  # log Bayes factors of the truth against its rival, by stage


def realise(
    pair: Pair,
    weighing: Weighing,
    motions: Mapping[str, Motion],
    known: Mapping[str, Reference],
    flights: int,
    seed: int,
    store: Path | None = None,
    progress: Callable[[str], None] = lambda text: None,
    arm_spread: float = ARM_SPREAD,
) -> list[Realised]:
    """Fly all manoeuvres with each cause hidden, and weigh both; each time with another arm, bias and noise.

    Parameters
    ----------
    pair : Pair
    weighing : Weighing
    motions : mapping of str to Motion
    known : mapping of str to Reference; the same manoeuvres linearised, with the links' priors of the same width
    flights : int; number of sets of flights for each cause and direction
    seed, store, progress
        See `studies.common.monte_carlo.run_trials`.
    arm_spread : float; relative width of the distribution from which the true arm is drawn
    """

    def compared(task: tuple[str, str, int], rng: np.random.Generator) -> dict[str, Any]:
        """Return the log Bayes factors of one truth from one set of flights."""
        label, direction, _ = task
        cause = pair.cause(label)
        robot, bias = mission.true_arm(mission.published_robot(), rng, arm_spread), BIAS * rng.standard_normal(3)
        robot, hidden = cause.hide(_amplitudes(cause, direction, rng), robot)
        single = {
            name: Linearised.of(
                known[name], mission.recorded(mission.fly(motion, robot, rate=DRIFT, **hidden), rng, name, bias)
            )
            for name, motion in motions.items()
        }
        true = pair.labels.index(label)
        factors = []
        for names in STAGES.values():
            evidence = weighing.evidence(joined(single, names))
            factors.append(evidence[true] - evidence[1 - true])
        return {"detected": weighing.evidence(single["first"])[true], "factors": factors}

    cases = [(label, direction) for direction in DIRECTIONS for label in pair.labels]
    tasks = [(*case, number) for number in range(flights) for case in cases]
    outcomes = run_trials(compared, tasks, store, seed=seed, progress=lambda text: progress(f"{pair.name}: {text}"))
    results, rows = outcomes.complete(), []
    for index, (label, direction) in enumerate(cases):
        part = results[index :: len(cases)]
        factors = np.array([outcome["factors"] for outcome in part]).T
        detected = np.array([outcome["detected"] for outcome in part])
        rows.append(Realised(label, direction, detected, dict(zip(STAGES, factors, strict=True))))
    return rows


FULL, QUICK = THOROUGH, Search(starts=2, iterations=40)  # effort of each search of a full and of a quick run


@dataclass(frozen=True)
class PairResult:
    """Outcome for one pair of causes."""

    pair: Pair
    designs: Mapping[str, Designed]  # designed manoeuvres by their criterion
    motions: Mapping[str, Motion]  # all manoeuvres, the ``first`` among them
    predicted: Mapping[Case, DecisionRate]  # predicted rates of decisions
    realised: Sequence[Realised]  # what was realised, one for each cause and direction

    def rate(self, realised: Realised, stage: str) -> DecisionRate:
        """Return the realised rate of decisions in a stage."""
        return DecisionRate.of(realised.factors[stage] >= NEEDED)

    def deviation(self, realised: Realised, stage: str) -> float:
        """Return the difference of the realised from the predicted rate, in its standard errors.

        The standard error is the one of as many flights as were made, where the prediction is right.
        """
        predicted = self.predicted[realised.label, realised.direction, stage]
        count = len(realised.factors[stage])
        middle = (predicted.rate * predicted.draws + 1.0) / (predicted.draws + 2.0)  # never zero or one
        error = np.sqrt(middle * (1.0 - middle) * (1.0 / count + 1.0 / predicted.draws))
        return float((self.rate(realised, stage).rate - predicted.rate) / error)


@dataclass(frozen=True)
class Result:
    """Outcome of the study."""

    pairs: Sequence[PairResult]
    search: Search  # effort of each search


def run(
    *,
    flights: Mapping[str, int],
    full: bool = False,
    seed: int = 1,
    points: int = mission.POINTS,
    search: Search | None = None,
    store: Store | None = None,
    trials: Path | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> Result:
    """Run the study; arguments that are not described are options of the command.

    Parameters
    ----------
    flights : mapping of str to int; number of sets of flights for each cause and direction, by the names of the pairs
    points : int; number of free control points of every joint
    search : Search, optional; effort of each design
    """
    search = search or (FULL if full else QUICK)
    store, results = store or Store.forgetful(), []
    for name, count in flights.items():
        pair = PAIRS[name]
        problem, designs = design_both(separating_problem(pair, points), seed, search, store, progress)
        motions: dict[str, Motion] = {"first": mission.flight_manoeuvre()}
        motions |= {name: design.motion for name, design in designs.items()}
        known, weighing = references(pair, motions), Weighing.of(problem)
        predicted = predictions(pair, weighing, known, seed)
        kept = (
            None if trials is None else trials.with_name(f"{trials.stem}-{pair.name.replace(' ', '-')}{trials.suffix}")
        )
        realised = realise(pair, weighing, motions, known, count, seed, kept, progress)
        results.append(PairResult(pair, designs, motions, predicted, realised))
    return Result(results, search)
