"""What the functions of the commands take: a study file, a study, or the objects that a study describes."""

from __future__ import annotations

from concurrent.futures import Executor
from pathlib import Path

from bayesid._io.progress import Progress, silent
from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_posterior
from bayesid.inference.posterior import Posterior
from bayesid.inference.wrong_units import refuse_wrong_units

__all__ = ["StudySource", "recorded_posterior", "study_of"]

StudySource = Study | str | Path
"""A study, or the path of its file."""


def study_of(source: StudySource) -> Study:
    """Return the study, which is read if a path is given."""
    return Study.of(source)


def recorded_posterior(
    source: StudySource | Posterior,
    window: int | None = None,
    progress: Progress = silent,
    executor: Executor | None = None,
) -> Posterior:
    """Return the posterior of a study's recordings, whose units are checked; a posterior is returned as it is.

    Parameters
    ----------
    source : Study, path or Posterior
        Path of a study file, the study that was read from it, or its posterior.
    window : int, optional
        Number of earlier blocks on which the whitening conditions each sample, by default the smallest that is
        accurate.
    progress : Progress, optional
        Receiver of the share of the recordings that is read.
    executor : concurrent.futures.Executor, optional
        As for `load_manoeuvres`.
    """
    if isinstance(source, Posterior):
        return source
    posterior = load_posterior(study_of(source), window, progress, executor)
    refuse_wrong_units(posterior)
    return posterior
