"""Samplers on one density: what each takes to a number of effective samples, and the evidence where it gives one.

Everything that only has to be compiled once is compiled before the clock runs. The clock is that of the processor. The
package stops by its own rule; its peers stop as soon as they have the effective samples, or at a limit of time, and
looking whether they may stop is not counted against them. Effective samples of all chains are counted by one estimator,
ArviZ's for the bulk, with each walker of an ensemble as a chain; those of weighted draws by Kish's formula.

The reference is long chains, and the log evidence by bridge sampling between them and a Student-t (Meng and Wong,
"Simulating ratios of normalizing constants", 1996, with the optimal bridge), which needs no proposal that covers the
posterior, unlike importance sampling. The Student-t is fitted to one half of the ensembles and bridged to the other
half, and the other way round.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

import emcee
import jax
import jax.numpy as jnp
import numpy as np
from emcee.moves import DEMove, DESnookerMove, StretchMove
from scipy.special import logsumexp

from bayesid._math.arrays import Floats
from bayesid.inference import Chains, Evidence, importance_sample, sample
from bayesid.inference.parameterisation import StudentT
from studies.peers.density import Target

# width of the normal prior that nested sampling starts from, in standard deviations of the Laplace approximation
BROAD = 3.0

CHAINS = 8  # number of chains of NUTS, evaluated together: a point then costs less than half of what it costs alone
ADAPTATION = 100  # number of steps in which NUTS finds its step size
NUTS_BLOCK = 10  # number of steps of NUTS between two looks at the clock
BLOCK = 100  # number of steps of an ensemble between two looks at the clock
LOWEST = -1e300  # log likelihood outside the support, for nested samplers that refuse infinite ones
PACE = 200  # number of evaluations that are timed to turn the limit of time into one of evaluations
LIVE = 500  # number of live points of dynesty, its own default


class Sampler(StrEnum):
    """Samplers that compete."""

    OURS = "bayesid"
    NUTS = "NUTS (NumPyro)"
    DE = "emcee, DE moves"
    STRETCH = "emcee, default"
    NAUTILUS = "nautilus"
    DYNESTY = "dynesty"


@dataclass(frozen=True)
class Budget:
    """When a sampler may stop."""

    effective_samples: float  # wanted number
    seconds: float  # limit of processor time [s]


@dataclass(frozen=True)
class Reached:
    """What a sampler reached."""

    seconds: float  # processor time for samples and evidence [s]
    evaluations: int  # number of evaluations of the log density
    gradients: int  # number of them that gave the gradient too
    effective_samples: float  # the smallest number of any coordinate
    finished: bool  # whether it stopped by its rule and not at the limit of time
    # where the sampler gives them
    log_evidence: float | None = None
    log_evidence_error: float | None = None
    # mean of the whitened coordinates, to compare with the reference; empty where there are no samples
    mean: list[float] = field(default_factory=list)


class _Clock:
    """Processor time since the start, less what was spent while it stood."""

    def __init__(self) -> None:
        self._began = time.process_time()
        self._stood = 0.0

    @property
    def seconds(self) -> float:
        return time.process_time() - self._began - self._stood

    def aside(self, function: Callable[[Floats], float], argument: Floats) -> float:
        """Return what a function returns, with its time not counted."""
        began = time.process_time()
        try:
            return function(argument)
        finally:
            self._stood += time.process_time() - began


class _Expired(Exception):  # noqa: N818 - it ends a sampler and is no error
    """The limit of time is reached."""


class _Counted:
    """Log density that counts its evaluations; with a clock, it raises `_Expired` when that says so."""

    def __init__(self, function: Callable[[Floats], Any], expired: Callable[[], bool] = lambda: False) -> None:
        self._function, self._expired = function, expired
        self.evaluations = 0

    def __call__(self, x: Floats) -> Any:
        if self._expired():
            raise _Expired
        self.evaluations += 1 if x.ndim == 1 else len(x)
        return self._function(x)


def _sampled(target: Target, budget: Budget, rng: np.random.Generator) -> tuple[Evidence, Chains]:
    """Sample as `bayesid.identify` does once it has the mode: importance sampling, then emcee with its own moves."""
    evidence, effective = importance_sample(target.parameterisation, target.optimum, rng), budget.effective_samples
    seed, trusted = int(rng.integers(2**31)), evidence.trusted
    return evidence, sample(target.parameterisation, target.optimum, seed, effective_samples=effective, trusted=trusted)


def ours(target: Target, budget: Budget, rng: np.random.Generator) -> Reached:
    """Sample with the package's own moves."""
    import arviz_stats.base  # noqa: F401 - imported before the clock runs, as every peer is

    target.log_density(np.zeros((1, target.size)))
    clock = _Clock()
    evidence, chains = _sampled(target, budget, rng)
    seconds = clock.seconds
    x = target.whitened(chains.y.reshape(-1, target.size)).reshape(len(chains.y), -1, chains.walkers, target.size)
    return Reached(
        seconds=seconds,
        evaluations=evidence.evaluations + chains.evaluations,
        gradients=0,
        effective_samples=effective_samples(np.concatenate(x, axis=1)),
        finished=chains.converged,
        log_evidence=evidence.value,
        log_evidence_error=evidence.error,
        mean=x.mean(axis=(0, 1, 2)).tolist(),
    )


def ensemble(moves: list[tuple[Any, float]]) -> Callable[[Target, Budget, np.random.Generator], Reached]:
    """Return the sampler that runs one ensemble of emcee with these moves, from the Laplace approximation on."""

    def run(target: Target, budget: Budget, rng: np.random.Generator) -> Reached:
        walkers = 16 * int(np.ceil((2 * target.size + 2) / 16))
        start = rng.standard_normal((4 * walkers, target.size))
        start = start[np.isfinite(target.log_density(start))][:walkers]
        clock = _Clock()
        density = _Counted(target.log_density)
        sampler = emcee.EnsembleSampler(walkers, target.size, density, moves=moves, vectorize=True)
        sampler.random_state = np.random.RandomState(int(rng.integers(2**31))).get_state()
        state: Any = start
        while True:
            state = sampler.run_mcmc(state, BLOCK, skip_initial_state_check=True)
            chain = sampler.get_chain(discard=sampler.iteration // 10)
            effective = clock.aside(effective_samples, chain)
            enough = effective >= budget.effective_samples
            if enough or clock.seconds > budget.seconds:
                mean = chain.mean(axis=(0, 1)).tolist()
                return Reached(clock.seconds, density.evaluations, 0, effective, enough, mean=mean)

    return run


def effective_samples(chains: Floats) -> float:
    """Return the smallest effective sample size over the coordinates of chains (steps, chains, n)."""
    from arviz_stats.base import array_stats

    return float(array_stats.ess(chains, chain_axis=1, draw_axis=0, method="bulk").min())


def nuts(target: Target, budget: Budget, rng: np.random.Generator) -> Reached:
    """Run NumPyro's NUTS with the unit mass matrix that whitening makes right; only its step size is adapted."""
    from numpyro.infer import NUTS

    kernel = NUTS(potential_fn=lambda x: -target.traced(x), adapt_mass_matrix=False)
    keys = jax.random.split(jax.random.key(int(rng.integers(2**31))), CHAINS)
    state = kernel.init(keys, ADAPTATION, 0.5 * jnp.asarray(rng.standard_normal((CHAINS, target.size))), (), {})
    step = jax.jit(lambda state: kernel.sample(state, (), {})).lower(state).compile()
    clock = _Clock()
    gradients, draws = 0, []
    while True:
        for _ in range(NUTS_BLOCK):
            state = step(state)
            # the chains of a batch wait for the one whose trajectory is longest
            gradients += CHAINS * int(np.max(state.num_steps))
            draws.append(np.asarray(state.z))
        if len(draws) <= ADAPTATION + NUTS_BLOCK:
            continue
        chain = np.stack(draws[ADAPTATION:])
        effective = clock.aside(effective_samples, chain)
        enough = effective >= budget.effective_samples
        if enough or clock.seconds > budget.seconds:
            mean = chain.mean(axis=(0, 1)).tolist()
            return Reached(clock.seconds, gradients, gradients, effective, enough, mean=mean)


def nested_prior(unit: Floats) -> Floats:
    """Return points of the broad normal prior about the mode from points of the unit cube."""
    from scipy.special import ndtri

    return np.asarray(BROAD * ndtri(unit))


def _log_likelihood(function: Callable[[Floats], Any], size: int) -> Callable[[Floats], Any]:
    """Return the log density over that of the nested samplers' prior, so that their evidence is the posterior's."""
    constant = -0.5 * size * np.log(2.0 * np.pi) - size * np.log(BROAD)

    def log_likelihood(x: Floats) -> Any:
        value = np.asarray(function(x), dtype=float) - (constant - 0.5 * np.sum((x / BROAD) ** 2, axis=-1))
        inside = np.where(np.isfinite(value), value, LOWEST)
        return inside if inside.ndim else float(inside)

    return log_likelihood


def dynesty(target: Target, budget: Budget, rng: np.random.Generator) -> Reached:
    """Run dynesty's dynamic nested sampling with its defaults, one point at a time."""
    from dynesty import DynamicNestedSampler
    from dynesty.utils import get_neff_from_logwt

    one = target.log_density_of_one
    density = _Counted(_log_likelihood(one, target.size))
    density(np.zeros(target.size))  # the first call takes longer
    each = _Clock()
    for x in rng.standard_normal((PACE, target.size)):
        density(x)
    calls, clock = int(PACE * budget.seconds / each.seconds), _Clock()
    density.evaluations = 0
    sampler = DynamicNestedSampler(density, nested_prior, target.size, nlive=LIVE, rstate=rng)
    with warnings.catch_warnings():  # whether it was stopped is among what is returned
        warnings.filterwarnings("ignore", "The sampling was stopped short", UserWarning)
        sampler.run_nested(n_effective=int(budget.effective_samples), maxcall=calls, print_progress=False)
    results = sampler.results
    effective = float(get_neff_from_logwt(results.logwt))
    evidence = float(results.logz[-1]), float(results.logzerr[-1])
    mean = (results.importance_weights() @ results.samples).tolist()
    enough = effective >= budget.effective_samples
    return Reached(clock.seconds, density.evaluations, 0, effective, enough, *evidence, mean)


def nautilus(target: Target, budget: Budget, rng: np.random.Generator) -> Reached:
    """Run nautilus with its defaults, in batches."""
    from nautilus import Sampler as Nautilus

    target.log_density(np.zeros((1, target.size)))
    clock = _Clock()
    likelihood = _log_likelihood(target.log_density, target.size)
    density = _Counted(likelihood, lambda: clock.seconds > budget.seconds)
    sampler = Nautilus(
        nested_prior, density, n_dim=target.size, vectorized=True, pass_dict=False, seed=int(rng.integers(2**31))
    )
    try:
        sampler.run(n_eff=budget.effective_samples, discard_exploration=False)
    except _Expired:
        return Reached(clock.seconds, density.evaluations, 0, 0.0, False)
    points, log_weights, _ = sampler.posterior()
    effective, mean = float(sampler.n_eff), (np.exp(log_weights) @ points).tolist()
    error = float(1.0 / np.sqrt(sampler.n_eff))
    return Reached(clock.seconds, density.evaluations, 0, effective, True, float(sampler.log_z), error, mean)


# samplers by name, the package's own first
SAMPLERS: Mapping[Sampler, Callable[[Target, Budget, np.random.Generator], Reached]] = {
    Sampler.OURS: ours,
    Sampler.STRETCH: ensemble([(StretchMove(), 1.0)]),
    Sampler.DE: ensemble([(DEMove(), 0.8), (DESnookerMove(), 0.2)]),
    Sampler.NUTS: nuts,
    Sampler.DYNESTY: dynesty,
    Sampler.NAUTILUS: nautilus,
}


ITERATIONS = 100  # number of iterations of the bridge, many more than it needs


def reference(target: Target, budget: Budget, rng: np.random.Generator) -> Reached:
    """Return the reference, with as many effective samples as the budget wants; its time is no part of a comparison."""
    began = time.process_time()
    _, chains = _sampled(target, budget, rng)
    y = chains.y.reshape(len(chains.y), -1, chains.walkers, target.size)
    halves = np.array_split(np.arange(len(y)), 2)
    values, evaluations = [], chains.evaluations
    for fitted, bridged in (halves, halves[::-1]):
        known = y[fitted].reshape(-1, target.size)
        proposal = StudentT.about(known.mean(axis=0), np.cov(known.T))
        draws = proposal.draw(int(budget.effective_samples), rng)
        evaluations += len(draws)
        proposed = target.parameterisation.log_density(draws) - proposal.log_density(draws)
        held_out = y[bridged].reshape(-1, target.size)
        sampled = chains.log_density[bridged].ravel() - proposal.log_density(held_out)
        values.append(bridge(sampled, proposed, effective_samples(np.concatenate(y[bridged], axis=1))))
    (first, error), (second, other) = values
    x = target.whitened(y.reshape(-1, target.size))
    return Reached(
        seconds=time.process_time() - began,
        evaluations=evaluations,
        gradients=0,
        effective_samples=effective_samples(np.concatenate(y, axis=1)),
        finished=chains.converged,
        log_evidence=0.5 * (first + second),
        log_evidence_error=float(max(0.5 * np.hypot(error, other), 0.5 * abs(first - second))),
        mean=x.mean(axis=0).tolist(),
    )


def bridge(sampled: Floats, proposed: Floats, effective: float) -> tuple[float, float]:
    """Return the log evidence by bridge sampling, and its standard error.

    Parameters
    ----------
    sampled : (n,) array; log density over that of the proposal at draws of the posterior
    proposed : (m,) array; the same at draws of the proposal
    effective : float; number of effective samples among the draws of the posterior
    """
    shift = float(np.median(sampled))
    sampled, proposed = sampled - shift, proposed - shift
    n, m, value = effective, len(proposed), 0.0
    for _ in range(ITERATIONS):
        above = proposed - np.logaddexp(np.log(n) + proposed, np.log(m) + value)
        below = -np.logaddexp(np.log(n) + sampled, np.log(m) + value)
        value = float(logsumexp(above) - np.log(m) - logsumexp(below) + np.log(len(sampled)))
    spread = [np.exp(part - logsumexp(part) + np.log(len(part))).var() for part in (above, below)]
    return value + shift, float(np.sqrt(spread[0] / m + spread[1] / n))
