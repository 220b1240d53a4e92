"""Identification of a study's unknown bodies."""

from __future__ import annotations

from concurrent.futures import Executor
from pathlib import Path

from emcee.backends import HDFBackend

from bayesid._io.errors import InputError
from bayesid._io.progress import Progress, part_of, silent
from bayesid._math.arrays import Floats
from bayesid.app.functions.study_source import StudySource, recorded_posterior
from bayesid.inference import identification
from bayesid.inference.identification import Identification
from bayesid.inference.no_motion import refuse_no_motion
from bayesid.inference.posterior import Posterior
from bayesid.inference.sampler import Sampler

__all__ = ["identify"]


def identify(
    study: StudySource | Posterior,
    seed: int = 0,
    *,
    effective_samples: float = 4000.0,
    start: Floats | None = None,
    sampler: Sampler | None = None,
    max_steps: int = 5000,
    file: str | Path | HDFBackend | None = None,
    executor: Executor | None = None,
    progress: Progress = silent,
) -> Identification:
    """Identify the unknown bodies and effects by their posterior.

    Parameters
    ----------
    study : path, Study or Posterior
        Path of a study file, the study that was read from it, or its posterior.
    seed : int
        Seed of all random numbers.
    effective_samples : float
        Goal for the number of effective samples.
    start : (size,) array, optional
        Starting point of the search for the mode, by default the prior's centre.
    sampler : Sampler, optional
        Sampler of the posterior, by default `Emcee`, whose further arguments may be given here.
    max_steps : int
        Maximum number of steps per emcee ensemble.
    file : path or emcee.backends.HDFBackend, optional
        File in which emcee stores every step; an interrupted run resumes from it.
    executor : concurrent.futures.Executor, optional
        Executor whose workers read one recording each.
    progress : Progress, optional
        Receiver of the fraction done.

    Raises
    ------
    InputError
        If the study is invalid, nothing is unknown, nothing moves, or no values of the unknowns fit the data.
    """
    posterior = recorded_posterior(study, progress=part_of(progress, 0.0, 0.05), executor=executor)
    if not posterior.size:
        raise InputError("nothing is unknown", place="unknowns.bodies", remedy="Name a body to identify")
    refuse_no_motion(posterior)
    return identification.identify(
        posterior,
        seed,
        start=start,
        effective_samples=effective_samples,
        sampler=sampler,
        max_steps=max_steps,
        file=file,
        progress=progress,
    )
