"""Trials of the contest: one sampler on one density or one recipe on the task, alone in a process with one core."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import asdict
from multiprocessing import get_context
from typing import Any

import numpy as np

from bayesid.app.compilation_cache import keep_compiled
from studies.peers.density import CASES, target_of
from studies.peers.reference import reference
from studies.peers.samplers import SAMPLERS, Budget, Sampler
from studies.peers.task import Recipe, attempt_recipe

__all__ = ["EFFECTIVE", "LIMITS", "NESTED", "REFERENCE", "attempt", "tasks"]

EFFECTIVE = 4000.0
"""Number of effective samples that are wanted."""

LIMITS = {10: 80.0, 19: 80.0, 39: 150.0, 79: 500.0}
"""Limits of a peer's processor time by the number of unknowns [s]; more than five times what the package takes."""

LONG = 15_000.0
"""Number of effective samples of a reference."""

REFERENCE = "reference"
"""Name of the reference among the samplers."""

NESTED = 19
"""Largest number of unknowns on which nested samplers are tried; with more they are far from ending in time."""

REPLICATES = 3
"""Number of studies on which every recipe is tried, with a hidden wheel and without."""

Task = Mapping[str, Any]
"""What is tried: a sampler on a number of unknowns, or a recipe."""


def tasks(full: bool) -> list[Task]:
    """Return the trials, those that decide first; the small study has the smallest case and what is quick."""
    cases = CASES if full else [min(CASES)]
    samplers = [Sampler.OURS, REFERENCE, *list(Sampler)[1:]] if full else [Sampler.OURS, REFERENCE, Sampler.DE]
    size = {"effective": EFFECTIVE} if full else {"effective": 500.0, "duration": 40.0}
    contests = [
        {"unknowns": unknowns, "sampler": str(sampler), **size, "limit": LIMITS[unknowns] if full else 20.0}
        for sampler in samplers
        for unknowns in cases
        if unknowns <= NESTED or sampler not in (Sampler.DYNESTY, Sampler.NAUTILUS)
    ]
    recipes = [
        {"recipe": str(recipe), "hidden": hidden, "study": study, "count": 2, "duration": 80.0 if full else 50.0}
        for study in range(REPLICATES if full else 1)
        for hidden in (False, True)
        for recipe in (Recipe if full else [Recipe.SCIPY])
    ]
    first = len(cases) * 3
    return [*contests[:first], *recipes, *contests[first:]]


def attempt(task: Task, rng: np.random.Generator) -> dict[str, Any]:
    """Make one trial in a new process; see `studies.peers.samplers.Reached` and `studies.peers.task`."""
    cores = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set()
    if cores:  # the new process inherits what this thread may use
        os.sched_setaffinity(0, {sorted(cores)[os.getpid() % len(cores)]})
    try:
        with get_context("spawn").Pool(1) as pool:
            return pool.apply(_alone, (dict(task), int(rng.integers(2**31))))
    finally:
        if cores:
            os.sched_setaffinity(0, cores)


def _alone(task: Task, seed: int) -> dict[str, Any]:
    keep_compiled()
    if "recipe" in task:
        # the study's number is its seed, so that all recipes read the same recordings
        settings = {key: task[key] for key in ("count", "duration")}
        return attempt_recipe(Recipe(task["recipe"]), task["hidden"], task["study"], **settings)
    target = target_of(task["unknowns"], **({"duration": task["duration"]} if "duration" in task else {}))
    wanted = task["effective"]
    if task["sampler"] == REFERENCE:
        budget = Budget(LONG / EFFECTIVE * wanted, np.inf)
        return asdict(reference(target, budget, np.random.default_rng(seed)))
    budget = Budget(wanted, task["limit"])
    return asdict(SAMPLERS[Sampler(task["sampler"])](target, budget, np.random.default_rng(seed)))
