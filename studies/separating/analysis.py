"""The rivals, the manoeuvres designed to tell them apart, and Bayes factors between them, expected and realised."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from bayesid import Effect, Manoeuvre, Model
from bayesid._math.arrays import Floats
from bayesid.design import THOROUGH, DOptimal, Problem, Search, Separation, Store, optimise
from bayesid.design.design_problem import Known
from bayesid.design.search_starts import adapted_to_family
from bayesid.design.trajectories import ParameterisedMotion
from bayesid.inference.unknowns import Unknowns
from bayesid.recording.joint_motion import Motion
from bayesid.simulation.effects import ThrusterLeak, WheelMomentum
from studies.common import mission
from studies.common.ets7 import BIAS
from studies.common.flight import light_wheel
from studies.common.models import ARM_SPREAD
from studies.common.monte_carlo import run_trials
from studies.common.repeated_fits import Reference
from studies.truth.mujoco import Truth, leak

# the two causes with the widths of their priors; the leak is a small one, of half a millinewton
CANDIDATES: tuple[Effect, ...] = (WheelMomentum(1.0), ThrusterLeak(5e-4, 5e-4))

# momentum left in the wheels [N m s] and torque of the leak [N m], base axes, of which one is hidden
TRUTHS: dict[str, Floats] = {
    "wheel-momentum": np.array([-0.6, 0.35, 0.7]),
    "thruster-leak": np.array([-3e-4, 1.8e-4, 3.6e-4]),
}

RIVALS = tuple(TRUTHS)  # labels of the two rivals

# stages of the study, with the manoeuvres that are fitted together in each
STAGES = {
    "first alone": ("first",),
    "first, d-optimal": ("first", "d-optimal"),
    "first, separating": ("first", "separation"),
}

SPREAD = 0.1  # relative width of the prior of the base

# rate of the base when a manoeuvre starts, about a degree in a minute [rad/s]; unknown to every fit
DRIFT = np.array([3e-4, -2e-4, 2.5e-4])


def rival_of(label: str) -> str:
    """Return the label of the other rival."""
    return next(other for other in RIVALS if other != label)


def rival_model(labels: Sequence[str], arm_spread: float = ARM_SPREAD) -> Model:
    """Return the mission's model with some of the candidates, given by their labels."""
    model = mission.base_unknown(arm_spread, base_spread=SPREAD)
    return replace(model, effects=(*model.effects, *(effect for effect in CANDIDATES if effect.label in labels)))


def amplitude(label: str) -> Floats:
    """Return the hidden amplitude of a rival in standard deviations of its prior; a leak has no force."""
    effect = next(effect for effect in CANDIDATES if effect.label == label)
    sigma = np.array([parameter.sigma for parameter in effect.parameters])
    return np.pad(TRUTHS[label], (len(sigma) - 3, 0)) / sigma


def drifting(unknowns: Unknowns) -> Floats:
    """Return the coordinates of the prior's centre, but with every manoeuvre starting at the rate `DRIFT`."""
    z = np.zeros(unknowns.size)
    z[unknowns.layout.all_rates] = np.tile(DRIFT / unknowns.rate_sigma, unknowns.recordings)
    return z


@dataclass(frozen=True)
class Designed:
    """A designed manoeuvre."""

    costs: dict[str, float]  # values of both criteria by name
    largest: dict[str, float]  # largest values of the limited quantities by name
    motion: ParameterisedMotion  # motion of the joints
    # number of directions in which no manoeuvre shows a rival and which the criterion leaves out, by its label
    left_out: dict[str, int]


def separating_problem(points: int = mission.POINTS) -> Problem:
    """Return the problem: six joints on B-splines within the flight's rule, separation and volume as criteria.

    Manoeuvres start at the rate that the first manoeuvre has shown.
    """
    problem = mission.problem(rival_model(RIVALS), mission.splines(points), DOptimal(), Separation(RIVALS))
    unknowns = problem.plan.unknowns
    return problem.knowing(Known(drifting(unknowns), np.eye(unknowns.size)))


def design_both(
    problem: Problem, seed: int, search: Search, store: Store, progress: Callable[[str], None]
) -> dict[str, Designed]:
    """Design by both criteria from the same random starts, the second also from the first's best."""
    problem = adapted_to_family(problem, np.random.default_rng(seed))
    optima: list[np.ndarray] = []
    for criterion in problem.criteria:
        kept = store.of(criterion.name)
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
    return {
        criterion.name: Designed(
            costs=problem.costs(best),
            largest={limit.name: limit.largest for limit in problem.reached(best)},
            motion=problem.plan.family.motion(best),
            left_out=dict(criterion.unseen),
        )
        for criterion, best in zip(problem.criteria, optima, strict=True)
    }


@dataclass(frozen=True)
class Expected:
    """Expectations for one truth and a set of manoeuvres."""

    alone: float  # noncentrality lambda of the effect against a model without it, everything else marginalised
    apart: float  # noncentrality lambda (1 - rho^2) against a model with the rival in its place
    log_factor: float  # mean log Bayes factor of the truth against the rival, what each prior costs included

    @property
    def sd(self) -> float:
        """Standard deviation of the log Bayes factor, from noise alone."""
        return float(np.sqrt(self.apart))

    def exceeding(self, limit: float) -> float:
        """Return the share of flights whose log Bayes factor exceeds a limit, taken as normal about its mean."""
        return float(stats.norm.sf(limit, self.log_factor, self.sd)) if self.sd else float(self.log_factor > limit)

    @property
    def energy(self) -> float:
        """Half of `apart`."""
        return 0.5 * self.apart


def unexplained_information(information: Floats, group: Sequence[int], rest: Sequence[int]) -> Floats:
    """Return the information about a group of unknowns that the rest cannot imitate, shape (group, group).

    Parameters
    ----------
    information : (n, n) array; information about all unknowns, without their prior
    group, rest : sequences of int; unknowns of interest, and those to be marginalised with a standard normal prior
    """
    inner = information[np.ix_(rest, rest)] + np.eye(len(rest))
    cross = information[np.ix_(rest, group)]
    return np.asarray(information[np.ix_(group, group)] - cross.T @ np.linalg.solve(inner, cross))


@dataclass(frozen=True)
class Linearised:
    """Manoeuvres linearised about the drifting base, in the unknowns of a model with both rivals."""

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

    def group(self, label: str) -> list[int]:
        """Return the indices of an effect's unknowns."""
        return [index for index, name in enumerate(self.names) if name.startswith(f"{label}.")]

    def without(self, labels: Sequence[str]) -> list[int]:
        """Return the indices of all unknowns but those of some effects."""
        gone = {index for label in labels for index in self.group(label)}
        return [index for index in range(len(self.names)) if index not in gone]

    def expect(self, truth: str, amplitude: Floats) -> Expected:
        """Return the expectations where one of the rivals acts with an amplitude, in prior standard deviations."""
        hidden, rival = self.group(truth), self.group(rival_of(truth))
        rest = self.without([truth, rival_of(truth)])
        signal = self.information[:, hidden] @ amplitude
        mean = [self._expected_evidence([*rest, *rows], signal) for rows in (hidden, rival)]
        alone, apart = (
            float(amplitude @ unexplained_information(self.information, hidden, known) @ amplitude)
            for known in (rest, [*rest, *rival])
        )
        return Expected(alone, apart, mean[0] - mean[1])

    def log_evidence(self, rows: Sequence[int]) -> float:
        """Return the log evidence of the model with some unknowns given what was recorded, up to a common constant."""
        total, score = self.information[np.ix_(rows, rows)] + np.eye(len(rows)), self.score[list(rows)]
        return float(0.5 * score @ np.linalg.solve(total, score) - 0.5 * np.linalg.slogdet(total)[1])

    def _expected_evidence(self, rows: list[int], signal: Floats) -> float:
        """Return the mean log evidence of the model with some unknowns, up to what all models share."""
        within = self.information[np.ix_(rows, rows)]
        total = within + np.eye(len(rows))
        fitted = signal[rows] @ np.linalg.solve(total, signal[rows]) + np.trace(np.linalg.solve(total, within))
        return float(0.5 * fitted - 0.5 * np.linalg.slogdet(total)[1])


DIRECTIONS = 200  # number of random directions of an effect for which the separation is computed


@dataclass(frozen=True)
class Realised:
    """Log Bayes factors over flights where one rival is hidden."""

    truth: str  # label of the hidden rival
    detected: Floats  # (S,): log Bayes factors of the truth against no cause at all, from the first manoeuvre alone
    factors: Mapping[str, Floats]  # log Bayes factors of the truth against its rival, by stage


def references(motions: Mapping[str, Motion], arm_spread: float = ARM_SPREAD) -> dict[str, Reference]:
    """Return the manoeuvres linearised about the drifting base, with both rivals as unknowns.

    Parameters
    ----------
    motions : mapping of str to Motion
    arm_spread : float; relative width of the links' priors
    """
    model = rival_model(RIVALS, arm_spread)
    z = drifting(mission.problem(model, mission.splines()).plan.unknowns)
    return {name: Reference.of(model, motion, z) for name, motion in motions.items()}


def joined(single: Mapping[str, Linearised], names: Sequence[str]) -> Linearised:
    """Return the manoeuvres of a stage, fitted together."""
    first, *others = names
    total = single[first]
    for name in others:
        total = total.with_another(single[name])
    return total


def expectations(
    known: Mapping[str, Reference], seed: int
) -> tuple[dict[tuple[str, str], Expected], dict[tuple[str, str], list[Expected]]]:
    """Expect the Bayes factors of all truths and stages, and for effects of the same size in random directions."""
    single = {name: Linearised.of(reference) for name, reference in known.items()}
    directions = np.random.default_rng(seed).normal(size=(DIRECTIONS, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    expected: dict[tuple[str, str], Expected] = {}
    turned: dict[tuple[str, str], list[Expected]] = {}
    for stage, names in STAGES.items():
        total = joined(single, names)
        for truth in RIVALS:
            hidden = amplitude(truth)
            expected[truth, stage] = total.expect(truth, hidden)
            others = np.pad(np.linalg.norm(hidden) * directions, ((0, 0), (len(hidden) - 3, 0)))
            turned[truth, stage] = [total.expect(truth, other) for other in others]
    return expected, turned


def flown(motion: Motion, truth: str, size: Floats, **options: Any) -> Truth:
    """Fly a manoeuvre of the drifting base with one of the rivals hidden.

    Parameters
    ----------
    motion : Motion; motion of the joints
    truth : str; label of the rival, or empty for none
    size : (3,) array; momentum of the wheels [N m s] or torque of the leak [N m], base axes
    **options
        Further arguments of `studies.common.mission.fly`.
    """
    hidden: dict[str, Any] = {}
    if truth == "wheel-momentum":
        hidden = {"rotor": light_wheel(size)}
    elif truth == "thruster-leak":
        hidden = {"fields": [leak((0.0, 0.0, 0.0), size)]}
    return mission.fly(motion, rate=DRIFT, **hidden, **options)


def realise(
    motions: Mapping[str, Motion],
    known: Mapping[str, Reference],
    noises: int,
    seed: int,
    store: Path | None = None,
    progress: Callable[[str], None] = lambda text: None,
    arm_spread: float = ARM_SPREAD,
) -> list[Realised]:
    """Fly all manoeuvres with each rival hidden, and compare the models; each time with another arm, bias and noise.

    Parameters
    ----------
    motions : mapping of str to Motion
    known : mapping of str to Reference; the same manoeuvres linearised, with the links' priors of the same width
    noises : int; number of sets of flights for each truth
    seed, store, progress
        See `studies.common.monte_carlo.run_trials`.
    arm_spread : float; relative width of the distribution from which the true arm is drawn
    """

    def compared(task: tuple[str, int], rng: np.random.Generator) -> dict[str, Any]:
        """Return the log Bayes factors of one truth from one set of flights."""
        truth, _ = task
        robot, bias = mission.true_arm(mission.published_robot(), rng, arm_spread), BIAS * rng.standard_normal(3)
        single = {}
        for name, motion in motions.items():
            run = flown(motion, truth, TRUTHS[truth], robot=robot)
            single[name] = Linearised.of(known[name], mission.recorded(run, rng, name, bias))
        detected = _evidence(single["first"], truth) - _evidence(single["first"], "")
        factors = []
        for names in STAGES.values():
            total = joined(single, names)
            values = {label: _evidence(total, label) for label in RIVALS}
            factors.append(2.0 * values[truth] - sum(values.values()))
        return {"detected": detected, "factors": factors}

    tasks = [(truth, number) for number in range(noises) for truth in RIVALS]
    outcomes = run_trials(compared, tasks, store, seed=seed, progress=lambda text: progress(f"flights: {text}"))
    results, rows = outcomes.complete(), []
    for index, truth in enumerate(RIVALS):
        part = results[index :: len(RIVALS)]
        factors = np.array([outcome["factors"] for outcome in part]).T
        detected = np.array([outcome["detected"] for outcome in part])
        rows.append(Realised(truth, detected, dict(zip(STAGES, factors, strict=True))))
    return rows


def _evidence(linearised: Linearised, label: str) -> float:
    """Return the log evidence of the model with one rival, or with neither where the label is empty."""
    return linearised.log_evidence(linearised.without([other for other in RIVALS if other != label]))


FLIGHTS = 400  # number of sets of flights for each cause in a full run
FULL, QUICK = THOROUGH, Search(starts=3, iterations=60)  # effort of each search of a full and of a quick run


@dataclass(frozen=True)
class Result:
    """Outcome of the study."""

    designs: Mapping[str, Designed]  # designed manoeuvres by their criterion
    motions: Mapping[str, Motion]  # all manoeuvres, the ``first`` among them
    expected: Mapping[tuple[str, str], Expected]  # expectations of linear theory
    # expectations for effects of the same size in random directions
    directions: Mapping[tuple[str, str], Sequence[Expected]]
    realised: Sequence[Realised]  # realised log Bayes factors, one for each truth
    search: Search  # effort of each search
    full: bool


def run(
    *,
    full: bool = False,
    seed: int = 1,
    points: int = mission.POINTS,
    search: Search | None = None,
    flights: int | None = None,
    store: Store | None = None,
    trials: Path | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> Result:
    """Run the study; arguments that are not described are options of the command.

    Parameters
    ----------
    points : int; number of free control points of every joint
    search : Search, optional; effort of each design
    """
    search = search or (FULL if full else QUICK)
    flights = (FLIGHTS if full else 40) if flights is None else flights
    designs = design_both(separating_problem(points), seed, search, store or Store.forgetful(), progress)
    motions: dict[str, Motion] = {"first": mission.flight_manoeuvre()}
    motions |= {name: design.motion for name, design in designs.items()}
    known = references(motions)
    expected, directions = expectations(known, seed)
    realised = realise(motions, known, flights, seed, trials, progress)
    return Result(designs, motions, expected, directions, realised, search, full and flights >= FLIGHTS)
