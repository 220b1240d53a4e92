"""Design of manoeuvres by several criteria, within limits."""

from __future__ import annotations

import os
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass, replace
from typing import Any

from bayesid._io.progress import Progress, silent
from bayesid._io.short_form import ShortForm, Summary
from bayesid.app.functions.study_source import StudySource, study_of
from bayesid.app.study_to_design import load_problem, separating
from bayesid.app.study_to_encoders import ASSUMED, assume_missing, encoder_noise
from bayesid.design import THOROUGH, Problem, Search, Store, best_design, design_result
from bayesid.design.design_result import Design
from bayesid.design.encoder_information import Encoder
from bayesid.report.design_report import design_sentences

__all__ = ["Designs", "design", "effort_of"]


@dataclass(frozen=True, repr=False)
class Designs(ShortForm):
    """Result of `design`.

    Attributes
    ----------
    title : str
        Title of the study.
    seed : int
        Seed of all random numbers.
    manoeuvres : tuple of Design
        The best manoeuvre by each criterion.
    best : Design
        Manoeuvre with the smallest predicted uncertainty.
    """

    title: str
    seed: int
    manoeuvres: tuple[Design, ...]
    best: Design

    def to_dict(self) -> dict[str, Any]:
        """Return the content of design.json."""
        manoeuvres = [motion.to_dict() for motion in self.manoeuvres]
        return {"title": self.title, "seed": self.seed, "manoeuvres": manoeuvres, "best": self.best.name}

    def summary(self) -> Summary:
        """Return the result of each manoeuvre, and which is best."""
        return Summary(design_sentences(self.manoeuvres, self.best))


def effort_of(starts: int, iterations: int, thorough: bool) -> Search:
    """Return the effort of a search.

    Parameters
    ----------
    starts, iterations : int
        Numbers of random starts for every criterion, and of iterations from each.
    thorough : bool
        Whether to search more thoroughly, also from combinations of the best motions.
    """
    return replace(THOROUGH if thorough else Search(), starts=starts, iterations=iterations)


def design(
    study: StudySource | Problem,
    seed: int = 0,
    *,
    starts: int = 12,
    iterations: int = 400,
    thorough: bool = False,
    separate: tuple[str, str] | None = None,
    encoder: Encoder | None = None,
    executor: Executor | None = None,
    store: Store | None = None,
    progress: Progress = silent,
) -> Designs:
    """Design manoeuvres by the study's criteria within its limits.

    Parameters
    ----------
    study : path, Study or Problem
        Path of a study file, the study that was read from it, or a problem of design.
    seed : int
        Seed of all random numbers.
    starts : int
        Number of random starts per criterion.
    iterations : int
        Maximum number of optimiser iterations per start.
    thorough : bool
        Whether to search more thoroughly, also from combinations of the best motions; this takes about five times as
        long.
    separate : tuple of two str, optional
        Labels of two effects that the manoeuvre must distinguish, instead of using the study's criteria.
    encoder : Encoder, optional
        Noise of the joint encoders, by default that of the study, or else 1e-6 rad or m.
    executor : concurrent.futures.Executor, optional
        Where the searches run, by default in threads of this process.
    store : Store, optional
        Store of completed searches, from which an interrupted design resumes.
    progress : Progress, optional
        Receiver of the fraction done.

    Raises
    ------
    InputError
        If the study defines no design problem, or no manoeuvre satisfies the limits.
    """
    title = ""
    if isinstance(study, Problem):
        problem = study
        noise = {0: ASSUMED} if encoder is None else encoder
    else:
        study = study_of(study)
        problem, title = load_problem(study if separate is None else separating(study, separate)), study.title
        noise = assume_missing(encoder_noise(study, problem.plan.model.robot))[0] if encoder is None else encoder
    effort = effort_of(starts, iterations, thorough)
    with ThreadPoolExecutor(os.cpu_count()) if executor is None else nullcontext(executor) as workers:
        searching = replace(effort, executor=workers)
        designs = design_result.design(problem, seed, noise, searching, store=store, progress=progress)
    return Designs(title, seed, tuple(designs), best_design(designs))
