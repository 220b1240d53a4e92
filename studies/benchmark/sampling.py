"""Cost of an effective sample, with our moves and with emcee's default."""

from __future__ import annotations

import time
from typing import NamedTuple

import emcee
import numpy as np
from emcee.autocorr import integrated_time

from bayesid import Posterior
from bayesid.inference import Chains, LogCholeskyParameterisation, maximise, sample


class Sampling(NamedTuple):
    """Evaluations and seconds per effective sample, and the time to the wanted number of them, compilation apart."""

    ours: Chains
    seconds: float
    evaluations: float
    default_evaluations: float
    default_seconds: float
    default_lengths: float  # autocorrelation times that the default move's chain covers


def compare_moves(posterior: Posterior, *, wanted: float, default_steps: int, seed: int) -> Sampling:
    """Sample one posterior with our moves and with emcee's default stretch move."""
    refined, optimum = maximise(posterior, np.random.default_rng(seed))
    parameterisation = LogCholeskyParameterisation(refined)
    refined.log_density(optimum.z)  # compile
    began = time.perf_counter()
    ours = sample(parameterisation, optimum, seed, effective_samples=wanted)
    seconds = time.perf_counter() - began
    sampler = emcee.EnsembleSampler(ours.walkers, refined.size, refined.log_density, vectorize=True)
    sampler.random_state = np.random.RandomState(seed).get_state()
    start = parameterisation.proposal(optimum).draw(ours.walkers, np.random.default_rng(seed))
    began = time.perf_counter()
    sampler.run_mcmc(start, default_steps, skip_initial_state_check=True)
    default_seconds = time.perf_counter() - began
    tau = float(np.max(integrated_time(sampler.get_chain()[default_steps // 5 :], tol=0, quiet=True)))
    return Sampling(
        ours=ours,
        seconds=seconds,
        evaluations=ours.autocorrelation,  # of the walkers, each evaluated once per step
        default_evaluations=tau,
        default_seconds=default_seconds * tau / (default_steps * ours.walkers),
        default_lengths=0.8 * default_steps / tau,
    )
