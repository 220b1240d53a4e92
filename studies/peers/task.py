"""One task for all: the base of a robot in deep space from recordings made by MuJoCo, with and without a hidden wheel.

Nothing but the arm moves the robot, so that every peer's model is complete; a momentum of wheels that none of them
knows of makes it incomplete. The recipes are what users write, see `studies.peers.recipes`.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import tempfile
import time
from contextlib import redirect_stdout
from enum import StrEnum
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from bayesid._math.arrays import Floats
from studies.common.flight import light_wheel
from studies.truth.mujoco import Hidden, Manoeuvres, write_study
from studies.truth.urdf import SERVICER3

__all__ = ["Recipe", "attempt_recipe", "lines"]

WHEEL = np.array([0.3, -0.2, 0.25])
"""Hidden momentum of the wheels [N m s], a hundredth of what a small reaction wheel stores."""


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
    hidden : bool
        Whether wheels are spinning.
    seed : int
        Seed of the study, the same for all recipes that are to be compared.
    count, duration
        Number and length of the recordings [s].

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
