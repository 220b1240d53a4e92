"""Cost of an identification and of its effective samples, with the package's moves and with emcee's default."""

from __future__ import annotations

import time
from typing import NamedTuple

import emcee
import numpy as np
from emcee.autocorr import integrated_time

from bayesid import Posterior
from bayesid.inference import Chains, LogCholeskyParameterisation, identify

__all__ = ["Sampling", "compare_moves"]


class Sampling(NamedTuple):
    """Cost of effective samples, burn-in included and compilation not.

    Attributes
    ----------
    chains : Chains
        Samples by the package's moves.
    seconds : float
        Time of the whole identification: mode, coordinates, evidence and samples [s].
    default_evaluations : int
        Number of evaluations by emcee's default move, burn-in included.
    default_effective : float
        Number of effective samples that they gave.
    default_seconds : float
        Time that they took [s].
    default_lengths : float
        Number of autocorrelation times that the default move's chain covers.
    """

    chains: Chains
    seconds: float
    default_evaluations: int
    default_effective: float
    default_seconds: float
    default_lengths: float

    @property
    def cost(self) -> float:
        """Evaluations per effective sample by the package's moves."""
        return self.chains.evaluations / self.chains.effective_samples

    @property
    def default_cost(self) -> float:
        """Evaluations per effective sample by emcee's default move."""
        return self.default_evaluations / self.default_effective


def compare_moves(posterior: Posterior, *, wanted: float, default_steps: int, seed: int) -> Sampling:
    """Sample one posterior with the package's moves and with emcee's default stretch move.

    Parameters
    ----------
    posterior : Posterior
    wanted : float
        Number of effective samples by the package's moves.
    default_steps : int
        Number of steps of the default move.
    seed : int
        Seed of the samplers.
    """
    identify(posterior, seed, effective_samples=1.0)  # compiles
    began = time.perf_counter()
    result = identify(posterior, seed, effective_samples=wanted)
    seconds = time.perf_counter() - began
    refined, chains = result.posterior, result.chains
    sampler = emcee.EnsembleSampler(chains.walkers, refined.size, refined.log_density, vectorize=True)
    sampler.random_state = np.random.RandomState(seed).get_state()
    start = (
        LogCholeskyParameterisation(refined).proposal(result.optimum).draw(chains.walkers, np.random.default_rng(seed))
    )
    began = time.perf_counter()
    sampler.run_mcmc(start, default_steps, skip_initial_state_check=True)
    default_seconds = time.perf_counter() - began
    kept = default_steps - default_steps // 5
    tau = float(np.max(integrated_time(sampler.get_chain()[-kept:], tol=0, quiet=True)))
    return Sampling(
        chains=chains,
        seconds=seconds,
        default_evaluations=default_steps * chains.walkers,
        default_effective=kept * chains.walkers / tau,
        default_seconds=default_seconds,
        default_lengths=kept / tau,
    )
