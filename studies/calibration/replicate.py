"""Replicates: a truth, its recording, its posterior by all methods, and whether the truth ranks evenly among draws.

If the whole chain is right, the rank of the truth among draws of the posterior is uniform, for every function of
unknowns and data (Talts et al. 2018; Modrák et al. 2023 for the log likelihood). Around one data set, the truth is
drawn from its posterior and the replicate's posterior is that of both data sets (Säilynoja et al. 2025).
"""

from __future__ import annotations

import time
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cache, cached_property
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from scipy import stats

from bayesid import Manoeuvre, Posterior
from bayesid._math.arrays import Floats, Integers
from bayesid.inference.body_quantities import BODY_QUANTITIES, bodies_of
from bayesid.inference.ensemble import sample
from bayesid.inference.importance import choose_parameterisation, weighted_draws
from bayesid.inference.mode import Optimum, maximise
from studies.calibration.data import REPLICATES, Case, Truth, draw_truth, model_of, point, record
from studies.common.monte_carlo import read_store

DRAWS = 499  # number of posterior draws among which the truth is ranked

# number of draws of importance sampling; the package's default of 4,000 gives the same ranks at a higher price
WEIGHTED = 1500

EFFECTIVE = 1000.0  # effective samples of emcee

# of so many replicates of a case, emcee samples the posterior of one; none of the whole system, where each would take
# four minutes and more
EVERY = 20

ARMS = (Case.ARM, Case.WHOLE)  # cases with an unknown arm
SMALL = (Case.EXACT, Case.MUJOCO)  # cases of the small plan
FIRST_SEED = 20_000  # seed of the data set around which replicates are drawn
LOG_LIKELIHOOD = "log likelihood"


class Method(StrEnum):
    """Method by which the posterior is described."""

    LAPLACE = "Laplace"
    IMPORTANCE = "importance sampling"
    EMCEE = "emcee"


@dataclass(frozen=True)
class Plan:
    """One replicate to be made: its case, and whether emcee samples its posterior too."""

    case: Case
    sampled: bool = False


def make(plan: Plan, rng: np.random.Generator) -> dict[str, Any]:
    """Make one replicate.

    Returns
    -------
    dict
        Ranks of the truth in (0, 1) by method and unknown; chi-square of the data at the truth with its number of
        samples, by sensor; by how many stated standard deviations the initial rate of the smoothed joints differs from
        the base's own; Pareto k-hat and effective samples of the weights; whether the search for the mode and emcee
        converged; processor time [s].
    """
    began = time.process_time()
    truth, manoeuvres, own_rate = _data(plan.case, rng)
    posterior = Posterior.of(model_of(plan.case), manoeuvres)
    z = point(posterior, truth)
    refined, optimum = maximise(posterior, rng)
    parameterisation = choose_parameterisation(refined, optimum, rng)
    weighted = weighted_draws(parameterisation, optimum, rng, WEIGHTED)
    laplace = rng.multivariate_normal(optimum.z, optimum.covariance, DRAWS, method="cholesky")
    draws = {
        Method.LAPLACE: laplace,
        Method.IMPORTANCE: weighted.z[rng.choice(len(weighted.z), DRAWS, p=weighted.weights)],
    }
    chains = None
    if plan.sampled:
        seed = np.random.SeedSequence(int(rng.integers(2**31)))
        chains = sample(parameterisation, optimum, seed, effective_samples=EFFECTIVE)
        draws[Method.EMCEE] = rng.choice(chains.flat, DRAWS)
    return {
        "ranks": {method: _ranks(refined, z, points, rng) for method, points in draws.items()},
        "rate_shift": _rate_shift(refined, optimum, truth.rates[-1] - own_rate),
        "chi2": _chi_squares(refined, z),
        "pareto_k": round(weighted.pareto_k, 3),
        "effective": round(weighted.effective_samples, 1),
        "converged": optimum.converged,
        "emcee_converged": None if chains is None else chains.converged,
        "seconds": round(time.process_time() - began, 2),
    }


class _First(NamedTuple):
    """One data set with weighted draws of its posterior, and the prior's width of its initial rate."""

    manoeuvre: Manoeuvre
    z: Floats
    weights: Floats
    rate_sigma: float


@cache
def _first(case: Case) -> _First:
    rng, model = np.random.default_rng(FIRST_SEED), model_of(case)
    manoeuvre = record(case, draw_truth(model, rng), rng).manoeuvre
    posterior, optimum = maximise(Posterior.of(model, [manoeuvre]), rng)
    weighted = weighted_draws(choose_parameterisation(posterior, optimum, rng), optimum, rng, 20_000)
    return _First(manoeuvre, weighted.z, weighted.weights, posterior.unknowns.rate_sigma)


def _data(case: Case, rng: np.random.Generator) -> tuple[Truth, list[Manoeuvre], Floats]:
    """Return a truth, its recordings, and the base's own initial rate in the last [rad/s].

    Around one data set, that data set is the first of two recordings.
    """
    model = model_of(case)
    new = draw_truth(model, rng)
    if case is not Case.AROUND:
        recorded = record(case, new, rng)
        return replace(new, rates=recorded.rate[None]), [recorded.manoeuvre], new.rates[-1]
    first = _first(case)
    bodies, rate, bias = np.split(
        first.z[rng.choice(len(first.z), p=first.weights)], [10 * len(model.priors), 10 * len(model.priors) + 3]
    )
    recorded = record(case, Truth(bodies, bias, new.rates), rng)
    rates = np.stack([first.rate_sigma * rate, recorded.rate])
    return Truth(bodies, bias, rates), [first.manoeuvre, recorded.manoeuvre], new.rates[-1]


def _ranks(posterior: Posterior, truth: Floats, draws: Floats, rng: np.random.Generator) -> dict[str, float]:
    """Return the ranks of the truth among draws, spread evenly within (0, 1)."""
    values = _tested(posterior, np.concatenate([truth[None], draws]))
    share = rng.uniform(size=len(values))
    ranks = {
        name: (np.count_nonzero(column[1:] < column[0]) + u) / (len(draws) + 1.0)
        for (name, column), u in zip(values.items(), share, strict=True)
    }
    return {name: round(float(rank), 5) for name, rank in ranks.items()}


def _tested(posterior: Posterior, z: Floats) -> dict[str, Floats]:
    """Return what is ranked at points (n, size): quantities of identified bodies, other unknowns, log likelihood."""
    values: dict[str, Floats] = {}
    for body in bodies_of(posterior, z).values():
        values |= {f"{body.name}.{key}": body.values[:, index] for index, key in enumerate(BODY_QUANTITIES)}
    left = sorted(set(range(posterior.size)) - set(posterior.unknowns.body_indices()))
    values |= {posterior.unknowns.names[index]: z[:, index] for index in left}
    return values | {LOG_LIKELIHOOD: posterior.log_likelihoods(z).sum(axis=1)}


def _rate_shift(posterior: Posterior, optimum: Optimum, shift: Floats) -> list[float]:
    """Return a change of the last initial rate [rad/s] in stated standard deviations, none from rest."""
    rates = posterior.unknowns.layout.all_rates
    if rates.stop == rates.start:
        return []
    sd = posterior.unknowns.rate_sigma * np.sqrt(np.diag(optimum.covariance)[rates][-3:])
    return [round(float(value), 3) for value in shift / sd]


def _chi_squares(posterior: Posterior, z: Floats) -> dict[str, tuple[float, int]]:
    """Return chi-square and number of samples of each sensor, all recordings together."""
    squares = posterior.residuals(z) ** 2
    result = {}
    for kind in posterior.model.channels.kinds:
        columns = posterior.model.channels.of(kind)
        count = sum(int(whitening.outputs[:, columns].sum()) for whitening in posterior.whitenings)
        result[kind.value] = (round(float(squares[:, :, columns].sum()), 2), count)
    return result


def plan(full: bool) -> list[Plan]:
    """Return the plans of all replicates: of the full plan, or one of every case that one compilation serves.

    Replicates of a case are independent, so that the first ones of a run that was stopped are a random sample. Cases
    advance in proportion to the root of their number, so that such a run has some of each.
    """
    counts = REPLICATES if full else dict.fromkeys(SMALL, 1)
    order = [(number / np.sqrt(count), case, number) for case, count in counts.items() for number in range(count)]
    return [
        Plan(case, full and case is not Case.WHOLE and number % EVERY == EVERY // 2)
        for _, case, number in sorted(order, key=lambda entry: entry[0])
    ]


K = TypeVar("K", bound=Hashable)

# points at which the distribution function of the ranks is compared with that of the uniform one
POINTS = np.arange(1, 20) / 20.0


def uniform_p_value(ranks: Floats) -> float:
    """Return the p-value of ranks (N,) in (0, 1) being uniform, exact and simultaneous over `POINTS`.

    The statistic is the smallest binomial tail of any count of ranks below a point (Säilynoja, Bürkner & Vehtari 2022);
    its distribution follows by recursion from point to point, since the counts are a Markov chain.
    """
    total = len(ranks)
    observed = np.searchsorted(np.sort(ranks), POINTS, side="right")
    least = min(np.minimum(stats.binom.cdf(observed, total, POINTS), stats.binom.sf(observed - 1, total, POINTS)))
    return 1.0 - _probability_inside(total, _counts_inside(total, least))


def uniform_band(total: int, probability: float) -> tuple[Floats, Floats]:
    """Return the ends at `POINTS` of the band that holds the distribution function of uniform ranks.

    Parameters
    ----------
    total : int; number of ranks
    probability : float; probability that the whole function is within the band, which has at least that
    """
    wide, narrow = -745.0, np.log(0.5)  # logarithms of the binomial tail that counts of the band exceed
    while narrow - wide > 1e-6:
        middle = 0.5 * (wide + narrow)
        enough = _probability_inside(total, _counts_inside(total, np.exp(middle))) >= probability
        wide, narrow = (middle, narrow) if enough else (wide, middle)
    inside = _counts_inside(total, np.exp(wide))
    low, high = (np.array([side(counts) for counts in inside]) / total for side in (np.min, np.max))
    return low, high


def _counts_inside(total: int, least: float) -> list[Integers]:
    """Return the counts below each of `POINTS` whose binomial tails exceed a probability."""
    every = np.arange(total + 1)
    tails = [np.minimum(stats.binom.cdf(every, total, p), stats.binom.sf(every - 1, total, p)) for p in POINTS]
    return [every[tail > least * (1.0 + 1e-9)] for tail in tails]


def _probability_inside(total: int, counts: Sequence[Integers]) -> float:
    """Return the probability that so many uniform ranks have one of these counts below each of `POINTS`."""
    before, probability, last = np.zeros(1, dtype=int), np.ones(1), 0.0
    for inside, here in zip(counts, POINTS, strict=True):
        step = stats.binom.pmf(inside - before[:, None], total - before[:, None], (here - last) / (1.0 - last))
        before, probability, last = inside, probability @ step, here
    return float(np.clip(probability.sum(), 0.0, 1.0))


def holm(p_values: Mapping[K, float]) -> dict[K, float]:
    """Return p-values corrected by Holm's method, which needs no independence."""
    ordered = sorted(p_values, key=lambda name: p_values[name])
    corrected: dict[K, float] = {}
    largest = 0.0
    for position, name in enumerate(ordered):
        largest = max(largest, min(1.0, (len(ordered) - position) * p_values[name]))
        corrected[name] = largest
    return corrected


def coverage(ranks: Floats, level: float) -> tuple[float, float]:
    """Return the share of truths within central intervals of a level, and its standard error.

    Parameters
    ----------
    ranks : (N, n) array; ranks of n unknowns in N replicates; those of one replicate may depend on one another
    level : float; level of the intervals
    """
    shares = (np.abs(2.0 * ranks - 1.0) < level).mean(axis=1)
    return float(shares.mean()), float(shares.std(ddof=1) / np.sqrt(len(shares)))


@dataclass(frozen=True)
class Replicates:
    """Replicates of one case that were made."""

    case: Case
    results: Sequence[Mapping[str, Any]]  # results of `studies.calibration.replicate.make`
    failures: Sequence[str]  # messages of the replicates that raised an error

    def ranks(self, method: Method = Method.IMPORTANCE) -> dict[str, Floats]:
        """Ranks of every unknown and of the log likelihood, each (N,), of the N replicates that have the method."""
        made = [result["ranks"][method] for result in self.results if method in result["ranks"]]
        return {name: np.array([ranks[name] for ranks in made]) for name in made[0]} if made else {}

    def bodies(self, method: Method = Method.IMPORTANCE) -> Floats:
        """Ranks of the reported quantities of all identified bodies, shape (N, n)."""
        columns = [
            values
            for name, values in self.ranks(method).items()
            if ".mass" in name or ".com." in name or ".inertia." in name
        ]
        return np.stack(columns, axis=1) if columns else np.zeros((0, 0))

    @cached_property
    def p_values(self) -> dict[str, float]:
        """P-value of the ranks by importance sampling of every unknown, and of the log likelihood."""
        return {name: uniform_p_value(values) for name, values in self.ranks().items()}

    def chi2(self, sensor: str) -> Floats:
        """Chi-square per sample of one sensor at the truth, shape (N,)."""
        return np.array([result["chi2"][sensor][0] / result["chi2"][sensor][1] for result in self.results])

    @property
    def rate_shift(self) -> float:
        """Root mean square difference of the base's own initial rate, in stated standard deviations; 0 from rest."""
        shifts = [shift for result in self.results for shift in result["rate_shift"]]
        return float(np.sqrt(np.mean(np.square(shifts)))) if shifts else 0.0

    def count(self, key: str, value: Any) -> int:
        """Return the number of replicates whose result has a value."""
        return sum(result[key] == value for result in self.results)


def read(store: Path) -> list[Replicates]:
    """Read a store; a case without any replicate is left out."""
    lines = {line["trial"]: line for line in read_store(store)}  # a trial that was repeated counts once
    replicates = []
    for case in Case:
        mine = [line for line in lines.values() if line["task"]["case"] == case]
        results = [line["result"] for line in mine if "result" in line]
        if mine:
            replicates.append(Replicates(case, results, [line["error"] for line in mine if "error" in line]))
    return replicates


ALL = "all cases"  # name of all cases together
LEVELS = (0.5, 0.9, 0.95)  # levels of the intervals whose coverage is counted


@dataclass(frozen=True)
class Coverage:
    """Share of truths within intervals of a level, with its standard error over replicates."""

    level: float
    share: float
    error: float

    @property
    def p_value(self) -> float:
        """Probability that the share lies as far from the level, on either side, where intervals are right."""
        distance = abs(self.share - self.level)
        if self.error == 0.0:
            return float(distance == 0.0)
        return float(2.0 * stats.norm.sf(distance / self.error))

    def __str__(self) -> str:
        return f"{100.0 * self.share:.1f} ± {100.0 * self.error:.1f} %"


def interval_coverage(cases: Sequence[Replicates]) -> dict[tuple[str, float], Coverage]:
    """Return the coverage by importance sampling, by the name of a case or `ALL` and by level."""
    ranks = {runs.case.label: runs.bodies() for runs in cases if len(runs.results) > 1}
    coverages = {
        (name, level): Coverage(level, *coverage(values, level)) for name, values in ranks.items() for level in LEVELS
    }
    if ranks:
        together = list(ranks.values())
        coverages |= {(ALL, level): Coverage(level, *pooled_coverage(together, level)) for level in LEVELS}
    return coverages


def pooled_coverage(ranks: Sequence[Floats], level: float) -> tuple[float, float]:
    """Return the coverage of replicates of several cases, each replicate with the same weight, and its error."""
    shares = np.concatenate([(np.abs(2.0 * of_case - 1.0) < level).mean(axis=1) for of_case in ranks])
    return float(shares.mean()), float(shares.std() / np.sqrt(len(shares)))
