"""Trials of the contest: one sampler on one density or one recipe on the task, alone in a process with one core.

The task is the base of a robot in deep space from recordings made by MuJoCo. Nothing but the arm moves the robot, so
that every peer's model is complete; a momentum of wheels that none of them knows of makes it incomplete. The recipes
are what users write, see `studies.peers.recipes`.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import os
import tempfile
import time
from collections.abc import Mapping
from contextlib import redirect_stdout
from dataclasses import asdict
from enum import StrEnum
from io import StringIO
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.app.compilation_cache import keep_compiled
from studies.common.flight import light_wheel
from studies.peers.density import CASES, target_of
from studies.peers.samplers import SAMPLERS, Budget, Sampler, reference
from studies.truth.bodies import SERVICER3
from studies.truth.mujoco import Hidden, Manoeuvres, write_study

# hidden momentum of the wheels [N m s], a hundredth of what a small reaction wheel stores
WHEEL = np.array([0.3, -0.2, 0.25])


class Recipe(StrEnum):
    """Ways to identify the base, named by their files."""

    BAYESID = "with_bayesid"
    SCIPY = "with_scipy"
    SYSID = "with_sysid"


def lines(recipe: Recipe) -> int:
    """Return how many lines a user writes, without blank ones, comments and docstrings."""
    module = importlib.import_module(f"studies.peers.recipes.{recipe}")
    source = ast.unparse(_without_docstrings(ast.parse(inspect.getsource(module))))
    return sum(bool(line.strip()) for line in source.splitlines())


def _without_docstrings(tree: ast.Module) -> ast.Module:
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.FunctionDef) and ast.get_docstring(node) is not None:
            node.body = node.body[1:] or [ast.Pass()]
    return tree


def attempt_recipe(recipe: Recipe, hidden: bool, seed: int, *, count: int, duration: float) -> dict[str, Any]:
    """Identify the base of a study that is written for it.

    Parameters
    ----------
    recipe : Recipe
    hidden : bool; whether wheels are spinning
    seed : int; seed of the study, the same for all recipes that are to be compared
    count, duration : number and length of the recordings [s]

    Returns
    -------
    dict
        Processor time ``seconds``, ``truth``, ``mean`` and ``sd`` of the ten quantities.
    """
    module = importlib.import_module(f"studies.peers.recipes.{recipe}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rng = np.random.default_rng([seed, int(hidden)])
        parts = Hidden(rotor=light_wheel(WHEEL)) if hidden else Hidden()
        manoeuvres = Manoeuvres(count=count, duration=duration)
        study = write_study(folder, SERVICER3, rng, orbit=None, hidden=parts, manoeuvres=manoeuvres, step=0.25)
        began = time.process_time()
        with redirect_stdout(StringIO()):
            mean, sd = module.identify(folder)
        seconds = time.process_time() - began
    truth: Floats = study.base.quantities
    return {"seconds": seconds, "truth": truth.tolist(), "mean": mean.tolist(), "sd": sd.tolist()}


EFFECTIVE = 4000.0  # number of effective samples that are wanted

# limits of a peer's processor time by the number of unknowns [s]; more than five times what the package takes
LIMITS = {10: 80.0, 19: 80.0, 39: 150.0, 79: 500.0}

LONG = 15_000.0  # number of effective samples of a reference
REFERENCE = "reference"  # name of the reference among the samplers
NESTED = 19  # largest number of unknowns on which nested samplers are tried; with more they are far from ending in time
REPLICATES = 3  # number of studies on which every recipe is tried, with a hidden wheel and without
Task = Mapping[str, Any]  # what is tried: a sampler on a number of unknowns, or a recipe


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
    """Make one trial in a new process; see `studies.peers.samplers.Reached` and `studies.peers.contest`."""
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
    effective = task["effective"]
    if task["sampler"] == REFERENCE:
        budget = Budget(LONG / EFFECTIVE * effective, np.inf)
        return asdict(reference(target, budget, np.random.default_rng(seed)))
    budget = Budget(effective, task["limit"])
    return asdict(SAMPLERS[Sampler(task["sampler"])](target, budget, np.random.default_rng(seed)))
