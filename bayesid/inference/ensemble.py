"""Posterior samples by emcee: independent ensembles that start from the Laplace approximation and run to convergence.

Two kinds of move are mixed at random: an independence move that proposes from an approximation about the mode, which
mixes in a few steps where the posterior is nearly that, and emcee's differential evolution, which needs none
(Foreman-Mackey, Hogg, Lang & Goodman 2013, emcee: the MCMC hammer, PASP 125; ter Braak & Vrugt 2008, Differential
evolution Markov chain with snooker updater and fewer chains, Statistics and Computing 18).
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Protocol

import emcee
import h5py
import numpy as np
from emcee.backends import HDFBackend
from emcee.moves import DEMove, DESnookerMove
from emcee.moves.red_blue import RedBlueMove

from bayesid._io.errors import InputError
from bayesid._io.progress import Progress, silent
from bayesid._io.store import content_key, refuse_other
from bayesid._math.arrays import Floats
from bayesid._math.device import device
from bayesid.inference.mode import Optimum
from bayesid.inference.parameterisation import Parameterisation

__all__ = ["MOST_SECONDS", "Chains", "LaplaceMove", "sample"]


ENSEMBLES = 4
"""Number of independent ensembles, so that their disagreement shows a lack of convergence."""

BLOCK, LONGER = 10, 0.1
"""Number of steps between two tests of convergence at first, and the share of all steps by which blocks become longer.

A test sees all steps made so far, so that tests after blocks of one length would come to outweigh the sampling.
"""

BURN_IN = 3.0
"""Number of steps left out at first, in autocorrelation times, since the walkers start from weighted draws."""

WINDOW = 5.0
"""Number of steps over which the autocorrelation is summed up, in autocorrelation times (Sokal)."""

LENGTHS = 10.0
"""Smallest number of steps of a converged sampler, in autocorrelation times.

emcee advises 50, since its estimate takes the mean of every walker for that of the posterior, and is too small by ten
autocorrelation times over the number of steps. Here all walkers share one mean, so that a chain need only be long
beside `BURN_IN` and `WINDOW`.
"""

INDEPENDENT = {True: 0.95, False: 0.5}
"""Share of moves that propose from the approximation about the mode, where it is and is not trusted."""

STUCK_AFTER, STUCK = 200, 0.02
"""Number of steps from which on a sampler is given up that trusts its proposals, and the share of accepted ones."""

MOST_SECONDS = 1800.0
"""Longest time that a sampler runs by default [s]."""

KEPT = "positions, log densities, log likelihoods"
"""What the store holds of every step."""

R_HAT = 1.01
"""Largest potential scale reduction of a converged sampler."""

NEARLY = 1.05
"""Potential scale reduction below which the effective samples are reported as progress."""


class Proposal(Protocol):
    """Distribution of which independence moves propose, over the coordinates in which the walkers move."""

    def draw(self, count: int, rng: np.random.Generator | np.random.RandomState) -> Floats:
        """Draw points, shape (count, n).

        Parameters
        ----------
        count : int
            Number of draws.
        rng : numpy.random.Generator or numpy.random.RandomState
        """
        ...

    def log_density(self, y: Floats) -> Floats:
        """Return the log density at points, up to a constant, shape (count, n) -> (count,)."""
        ...


class LaplaceMove(RedBlueMove):
    """Independence move of emcee, which proposes from an approximation irrespective of the other walkers."""

    def __init__(self, proposal: Proposal) -> None:
        self.proposal = proposal
        super().__init__()

    def get_proposal(
        self, sample: Floats, complement: list[Floats], random: np.random.RandomState
    ) -> tuple[Floats, Floats]:
        """Return the proposals and the log ratio of backward to forward proposal densities."""
        new = self.proposal.draw(len(sample), random)
        return new, self.proposal.log_density(sample) - self.proposal.log_density(new)


@dataclass(frozen=True)
class Chains:
    """Samples of all ensembles after burn-in.

    Attributes
    ----------
    parameterisation : Parameterisation
        Coordinates in which the walkers moved.
    y : (ensembles, draws, n) array
        Draws in those coordinates; steps and walkers of an ensemble run along one axis, step-major.
    log_density : (ensembles, draws) array
        Log posterior density over those coordinates.
    log_likelihood : (ensembles, draws, R) array
        Log likelihood of each recording.
    effective_samples : float
        Number of draws divided by the longest autocorrelation time.
    r_hat : float
        Potential scale reduction between the ensembles, the largest over the coordinates.
    autocorrelation : float
        Autocorrelation time, the longest over the coordinates [steps].
    acceptance : float
        Mean share of emcee's accepted proposals; not a number for another sampler.
    evaluations : int
        Number of evaluations of the posterior density.
    steps : int
        Number of steps of each ensemble, burn-in included.
    walkers : int
        Number of walkers of each ensemble.
    converged : bool
        Whether the chains reached their goals in length, ``r_hat`` and effective samples.
    """

    parameterisation: Parameterisation
    y: Floats
    log_density: Floats
    log_likelihood: Floats
    effective_samples: float
    r_hat: float
    autocorrelation: float
    acceptance: float
    evaluations: int
    steps: int
    walkers: int
    converged: bool

    @property
    def stuck(self) -> bool:
        """Whether almost no proposal was accepted, so that the walkers remain near their starting points."""
        return self.acceptance < STUCK and self.autocorrelation >= self.steps >= STUCK_AFTER

    @property
    def origin(self) -> str:
        """How the draws were made, as part of a sentence."""
        if np.isnan(self.acceptance):
            return f"a user-supplied sampler, {len(self.y)} chains of {self.steps} draws"
        accepted = f"{100.0 * self.acceptance:.0f} % of the proposals accepted"
        return f"emcee, {len(self.y)} independent ensembles of {self.walkers} walkers, {self.steps} steps, {accepted}"

    @cached_property
    def z(self) -> Floats:
        """Draws in the posterior's coordinates, shape (ensembles, draws, n)."""
        return self.parameterisation.to_z(self.y.reshape(-1, self.y.shape[-1])).reshape(self.y.shape)

    @property
    def flat(self) -> Floats:
        """All draws, shape (ensembles * draws, n)."""
        return self.z.reshape(-1, self.z.shape[-1])


def sample(
    parameterisation: Parameterisation,
    optimum: Optimum,
    seed: int | np.random.SeedSequence,
    *,
    effective_samples: float = 4000.0,
    max_steps: int = 5000,
    max_seconds: float = MOST_SECONDS,
    trusted: bool = False,
    proposal: Proposal | None = None,
    file: str | Path | HDFBackend | None = None,
    progress: Progress = silent,
) -> Chains:
    """Sample the posterior until it has converged.

    Parameters
    ----------
    parameterisation : Parameterisation
        Posterior, in the coordinates in which the walkers move.
    optimum : Optimum
        Mode of the posterior and its Laplace approximation.
    seed : int or SeedSequence
        Seed of all random numbers; a resumed run gives the samples of an uninterrupted one.
    effective_samples : float
        Goal for the effective samples of all ensembles together.
    max_steps : int
        Largest number of steps of each ensemble; a sampler that stops there may not have converged. One that trusts its
        proposal stops before where hardly any is accepted.
    max_seconds : float
        Time after which it stops at the next test of convergence, converged or not [s].
    trusted : bool
        Whether importance sampling trusts the proposal, so that most moves may propose from it.
    proposal : Proposal, optional
        Approximation of which independence moves propose, by default a Student-t about the mode.
    file : path or emcee.backends.HDFBackend, optional
        HDF5 file in which emcee stores every step, in groups ``ensemble-0`` and so on, or of the backend's name and the
        same numbers; if it contains a part of the same run, sampling resumes from it.
    progress : Progress, optional
        Function that is called after every block of steps.
    """
    posterior = parameterisation.posterior
    proposal = parameterisation.proposal(optimum) if proposal is None else proposal
    share = INDEPENDENT[trusted]
    moves = [(LaplaceMove(proposal), share), (DEMove(), 0.75 * (1.0 - share)), (DESnookerMove(), 0.25 * (1.0 - share))]
    walkers = _walkers(posterior.size)
    sequence = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
    # the mode stands for data and model in the key; it is rounded, so that rounding errors do not change the key
    mode = np.round(optimum.z, 6) + 0.0
    key = content_key(version("bayesid"), KEPT, posterior.unknowns.names, sequence.entropy, sequence.spawn_key, mode)
    samplers = []
    for number, child in enumerate(sequence.spawn(ENSEMBLES)):
        backend = _backend(file, number, key)
        state = np.random.RandomState(child.generate_state(8))
        fresh = not backend.initialized or backend.iteration == 0
        sampler = emcee.EnsembleSampler(
            walkers, posterior.size, parameterisation.log_densities, moves=moves, vectorize=True, backend=backend
        )
        if fresh:
            sampler.random_state = state.get_state()
        samplers.append((sampler, None if not fresh else _start(parameterisation, proposal, walkers, state)))
    began = time.monotonic()
    while True:
        late = time.monotonic() - began > max_seconds
        steps = min(int(sampler.iteration) for sampler, _ in samplers)
        if steps and (steps in _tests(steps) or steps >= max_steps):
            chains = _summary(parameterisation, [sampler for sampler, _ in samplers], effective_samples)
            _tell(progress, chains, max_steps, effective_samples)
            # with hardly a move of differential evolution, walkers that accept no proposal stay where they are
            if chains.converged or steps >= max_steps or late or (trusted and chains.stuck):
                return chains
        # after an interruption ensembles stand at different steps; all go on to the end of the block
        target = min(_tests(steps)[-1], max_steps)
        for number, (sampler, start) in enumerate(samplers):
            if sampler.iteration < target:
                sampler.run_mcmc(start, target - sampler.iteration, skip_initial_state_check=True)
            samplers[number] = (sampler, None)


def _tests(steps: int) -> list[int]:
    """Return the steps after which convergence is tested, up to the first beyond some steps."""
    tests = [BLOCK]
    while tests[-1] <= steps:
        tests.append(tests[-1] + BLOCK * max(1, round(LONGER * tests[-1] / BLOCK)))
    return tests


def _tell(progress: Progress, chains: Chains, limit: int, goal: float) -> None:
    """Report the progress towards the goal for the samples or, while the ensembles disagree, towards the last step."""
    sampled = chains.effective_samples / goal if chains.r_hat < NEARLY else 0.0
    text = f"step {chains.steps}, {chains.effective_samples:.0f} effective samples, R-hat {chains.r_hat:.3f}"
    progress(min(max(sampled, chains.steps / limit), 1.0), text)


def _walkers(size: int) -> int:
    pair = 2 * device().fewest  # both halves of an ensemble fill whole batches
    return pair * max(1, int(np.ceil((2 * size + 2) / pair)))


def _start(
    parameterisation: Parameterisation, proposal: Proposal, walkers: int, state: np.random.RandomState
) -> Floats:
    """Return starting points of the walkers, of finite density: draws of the proposal, chosen by their weights.

    They are chosen without putting back, by adding Gumbel noise to the logarithms of the weights and taking the
    largest, so that no two walkers start from one point.
    """
    points = proposal.draw(4 * walkers, state)
    log_weights = parameterisation.log_density(points) - proposal.log_density(points)
    if np.isfinite(log_weights).sum() < walkers:
        raise InputError(
            "the approximation about the mode lies outside the support", remedy="Check the priors and the data"
        )
    return points[np.argsort(log_weights + state.gumbel(size=len(points)))[-walkers:]]


def _backend(file: str | Path | HDFBackend | None, number: int, key: str) -> emcee.backends.Backend:
    """Return the store of an ensemble's steps, and refuse samples of another key."""
    if file is None:
        return emcee.backends.Backend()
    name = f"{file.name if isinstance(file, HDFBackend) else 'ensemble'}-{number}"
    file = Path(file.filename if isinstance(file, HDFBackend) else file)
    if file.is_file():
        try:
            with h5py.File(file, "r") as opened:
                stored = opened[name].attrs.get("key", "") if name in opened else key
        except OSError as error:
            raise InputError(f"unreadable samples: {error}", file=file, remedy="Delete the file") from error
        refuse_other(stored, key, file, "run", "data, model, seed or version of bayesid")
    return _KeyedBackend(file, name, key)


class _KeyedBackend(HDFBackend):
    """HDF5 backend that stores a key of the data, model and seed on which its samples depend."""

    def __init__(self, file: Path, name: str, key: str) -> None:
        super().__init__(str(file), name=name)
        self.key = key

    def reset(self, nwalkers: int, ndim: int) -> None:
        super().reset(nwalkers, ndim)
        with self.open("a") as opened:
            opened[self.name].attrs["key"] = self.key


def autocorrelation_time(chain: Floats) -> float:
    """Return the longest autocorrelation time of the coordinates of walkers (steps, walkers, n) [steps].

    The autocovariance is that about the mean of all walkers, and is summed up in Sokal's window. A chain that ends
    before the window has an autocorrelation time of at least its length.
    """
    steps = len(chain)
    spectrum = np.fft.rfft(chain - chain.mean(axis=(0, 1)), n=2 * steps, axis=0)
    power = np.mean(np.abs(spectrum) ** 2, axis=1)
    covariance = np.fft.irfft(power, axis=0)[:steps] / np.arange(steps, 0, -1)[:, None]
    if not np.all(covariance[0] > 0.0):
        return float(steps)
    times = 2.0 * np.cumsum(covariance / covariance[0], axis=0) - 1.0
    inside = np.arange(steps)[:, None] < WINDOW * times
    if inside.all(axis=0).any():
        return float(steps)
    return max(1.0, float(np.take_along_axis(times, inside.argmin(axis=0)[None], axis=0).max()))


def _likelihoods(sampler: emcee.EnsembleSampler) -> Floats:
    """Return the log likelihoods of R recordings, which emcee keeps beside the steps, shape (steps, walkers, R)."""
    kept = sampler.get_blobs()
    return kept.reshape(*kept.shape[:2], -1)  # emcee leaves out the axis of a single recording


def _summary(parameterisation: Parameterisation, samplers: list[emcee.EnsembleSampler], goal: float) -> Chains:
    from arviz_stats.base import array_stats  # here, as it takes a second that commands without samples save

    steps = min(int(sampler.iteration) for sampler in samplers)
    chains = [sampler.get_chain()[:steps] for sampler in samplers]
    densities = [sampler.get_log_prob()[:steps] for sampler in samplers]
    tau = autocorrelation_time(np.concatenate(chains, axis=1))
    burn = min(int(np.ceil(BURN_IN * tau)), steps // 2)
    y = np.stack([chain[burn:].reshape(-1, chain.shape[-1]) for chain in chains])
    walkers = chains[0].shape[1]
    effective = y.shape[0] * y.shape[1] / tau
    r_hat = float(np.max(array_stats.rhat(y, chain_axis=0, draw_axis=1)))
    return Chains(
        parameterisation=parameterisation,
        y=y,
        log_density=np.stack([density[burn:].ravel() for density in densities]),
        log_likelihood=np.stack([_likelihoods(sampler)[burn:steps].reshape(y.shape[1], -1) for sampler in samplers]),
        effective_samples=effective,
        r_hat=r_hat,
        autocorrelation=tau,
        acceptance=float(np.mean([sampler.acceptance_fraction.mean() for sampler in samplers])),
        evaluations=steps * walkers * len(samplers),
        steps=steps,
        walkers=walkers,
        converged=bool(steps >= LENGTHS * tau and r_hat < R_HAT and effective >= goal),
    )
