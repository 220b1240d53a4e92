"""Samplers of a posterior: emcee, and the interface by which any other takes its place."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from emcee.backends import HDFBackend

from bayesid._io.errors import InputError
from bayesid._io.progress import Progress, silent
from bayesid._math.arrays import Floats
from bayesid.inference.ensemble import ENSEMBLES, MOST_SECONDS, R_HAT, Chains, Proposal, sample
from bayesid.inference.mode import Optimum
from bayesid.inference.parameterisation import LogCholeskyParameterisation, Parameterisation
from bayesid.inference.posterior import Posterior

__all__ = ["Emcee", "PosteriorDraws", "Sampler", "SamplingTarget", "chains_of"]


@dataclass(frozen=True)
class SamplingTarget:
    """Posterior to sample, with its mode and approximations.

    Attributes
    ----------
    posterior : Posterior
        Posterior over the coordinates z, whose prior is standard normal.
    optimum : Optimum
        Mode of z and its Laplace approximation.
    parameterisation : Parameterisation
        Coordinates y in which the posterior is nearer to normal; ``to_z`` and ``log_density`` take many points.
    proposal : Proposal
        Approximation of the posterior over y, with ``draw`` and ``log_density``.
    trusted : bool
        Whether importance sampling from the proposal may be trusted.
    """

    posterior: Posterior
    optimum: Optimum
    parameterisation: Parameterisation
    proposal: Proposal
    trusted: bool


@dataclass(frozen=True)
class PosteriorDraws:
    """Draws that a sampler returns.

    Attributes
    ----------
    z : (draws, n) or (chains, draws, n) array
        Draws in the coordinates of the posterior.
    weights : (draws,) array, optional
        Weights of draws without chains; they need not sum to one. By default all are equal.
    effective_samples : float, optional
        By default Kish's number of weighted draws, and the bulk effective sample size of chains.
    evaluations : int
        Number of evaluations of the log density.
    """

    z: Floats
    weights: Floats | None = None
    effective_samples: float | None = None
    evaluations: int = 0


class Sampler(Protocol):
    """Interface of the samplers of `identify`."""

    def sample(
        self, target: SamplingTarget, rng: np.random.Generator, *, effective_samples: float, progress: Progress
    ) -> PosteriorDraws | Chains:
        """Sample the posterior of a target.

        Parameters
        ----------
        target : SamplingTarget
        rng : numpy.random.Generator
            Source of all random numbers.
        effective_samples : float
            Goal for the number of effective samples.
        progress : Progress
            Receiver of the fraction done.
        """
        ...


@dataclass(frozen=True)
class Emcee:
    """Ensembles of emcee, the default (`bayesid.inference.ensemble`).

    Attributes
    ----------
    max_steps : int
        Largest number of steps of each ensemble.
    file : path or emcee.backends.HDFBackend, optional
        File in emcee's format that stores every step, in groups ``ensemble-0`` to ``ensemble-3``, or of the backend's
        name and the same numbers; an interrupted run resumes from it.
    max_seconds : float
        Time after which it stops at the next test of convergence, converged or not [s].
    """

    max_steps: int = 5000
    file: str | Path | HDFBackend | None = None
    max_seconds: float = MOST_SECONDS

    def sample(
        self,
        target: SamplingTarget,
        rng: np.random.Generator,
        *,
        effective_samples: float = 4000.0,
        progress: Progress = silent,
    ) -> Chains:
        """Sample the posterior of a target until the ensembles have converged; see `Sampler.sample`."""
        seed = rng.bit_generator.seed_seq
        if not isinstance(seed, np.random.SeedSequence):
            raise InputError("the random numbers have no seed", remedy="Make them by numpy.random.default_rng(seed)")
        return sample(
            target.parameterisation,
            target.optimum,
            seed,
            effective_samples=effective_samples,
            max_steps=self.max_steps,
            max_seconds=self.max_seconds,
            trusted=target.trusted,
            proposal=target.proposal,
            file=self.file,
            progress=progress,
        )


def chains_of(posterior: Posterior, drawn: PosteriorDraws, rng: np.random.Generator, goal: float) -> Chains:
    """Return the draws of any sampler as chains of equal weight.

    Weighted draws are resampled systematically (Kitagawa 1996, Monte Carlo filter and smoother for non-Gaussian
    nonlinear state space models, Journal of Computational and Graphical Statistics 5), and draws without chains are
    shuffled into as many as emcee has ensembles.

    Parameters
    ----------
    posterior : Posterior
    drawn : PosteriorDraws
    rng : numpy.random.Generator
        Of the resampling.
    goal : float
        Number of effective samples from which on the draws suffice.

    Raises
    ------
    InputError
        If the draws have another shape, or none of them a weight or a finite density.
    """
    from arviz_stats.base import array_stats  # here, as it takes a second that commands without samples save

    z, effective = np.asarray(drawn.z, dtype=float), drawn.effective_samples
    if z.ndim not in (2, 3) or z.shape[-1] != posterior.size or z.shape[-2] < 2 * ENSEMBLES:
        remedy = f"Return (draws, {posterior.size}) or (chains, draws, {posterior.size}), {2 * ENSEMBLES} or more"
        raise InputError(f"the sampler returned draws of shape {z.shape}", remedy=remedy)
    if z.ndim == 2:
        weights = np.ones(len(z)) if drawn.weights is None else np.asarray(drawn.weights, dtype=float)
        if weights.shape != (len(z),) or not (np.isfinite(weights).all() and weights.min() >= 0.0 < weights.sum()):
            problem = f"the sampler returned weights of shape {weights.shape}, or negative ones, or no positive one"
            raise InputError(problem, remedy=f"Return {len(z)} weights that are not negative")
        weights = weights / weights.sum()
        effective = float(1.0 / (weights**2).sum()) if effective is None else effective
        count = len(z) - len(z) % ENSEMBLES
        at = (np.arange(count) + rng.uniform()) / count
        chosen = np.arange(count) if drawn.weights is None else np.searchsorted(np.cumsum(weights), at * (1.0 - 1e-12))
        z = z[rng.permutation(chosen)].reshape(ENSEMBLES, -1, posterior.size)
    densities = posterior.log_densities(z.reshape(-1, posterior.size)).reshape(*z.shape[:2], -1)
    if not np.isfinite(densities[:, :, 0]).all():
        raise InputError("the sampler returned draws of no finite density", remedy="Return draws of the posterior")
    axes = {"chain_axis": 0, "draw_axis": 1}
    effective = float(array_stats.ess(z, method="bulk", **axes).min()) if effective is None else effective
    r_hat = float(array_stats.rhat(z, **axes).max())
    return Chains(
        parameterisation=LogCholeskyParameterisation(posterior),
        y=z,
        log_density=densities[:, :, 0],
        log_likelihood=densities[:, :, 1:],
        effective_samples=effective,
        r_hat=r_hat,
        autocorrelation=max(1.0, z.shape[0] * z.shape[1] / effective),
        acceptance=np.nan,
        evaluations=drawn.evaluations,
        steps=z.shape[1],
        walkers=1,
        converged=bool(r_hat < R_HAT and effective >= goal),
    )
