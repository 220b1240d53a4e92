"""A criterion of a user's own, one class in one file: a study names it, a search follows it, and the report says it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from test_cli import run
from test_design_command import STUDY

from bayesid._io.errors import InputError
from bayesid.app.schema import Study
from bayesid.app.study_to_design import load_problem
from bayesid.app.study_to_model import load_model
from bayesid.design import Criterion, known_criteria, register_criterion
from tests.pdf_text import PdfText

PLUGIN = '''
from dataclasses import dataclass
from typing import ClassVar

import jax.numpy as jnp

from bayesid.design import Criterion, register_criterion


@register_criterion
@dataclass(frozen=True)
class Turn(Criterion):
    """How far the base turns about one axis."""

    name = "turn"
    meaning = "The largest turn of the base about one of its axes, which nobody but a test wants."
    informed = False
    axis: int = 0

    def cost(self, plan, outcome):
        return -jnp.mean(outcome.trajectory.excursion[:, 3 + self.axis] ** 2)
'''


def study(folder: Path, criteria: str = '["turn"]', options: str = "axis = 2") -> Path:
    """A study with the plugin, designed by its criterion."""
    (folder / "turn.py").write_text(PLUGIN)
    text = STUDY.replace('["paper-26", "condition-number"]', criteria).replace(
        "effects = []", 'effects = []\nplugins = ["turn.py"]'
    )
    file = folder / "study.toml"
    file.write_text(text + (f"[design.options.turn]\n{options}\n" if options else ""))
    return file


@pytest.mark.slow
def test_a_plugin_adds_a_criterion_that_is_searched_with_and_reported(tmp_path):
    file = study(tmp_path)
    status, text = run("design", file, "--output", tmp_path / "out", "--starts", 2, "--iterations", 8, "--seed", 3)
    assert status == 0, text
    (manoeuvre,) = json.loads((tmp_path / "out" / "design.json").read_text())["manoeuvres"]
    assert manoeuvre["criterion"] == "turn"
    problem = load_problem(Study.load(file))
    (criterion,) = problem.criteria
    assert criterion.axis == 2
    parameters = np.array(list(manoeuvre["parameters"].values()))
    angle = np.asarray(problem.trajectory(parameters).excursion)[:, 5]
    assert manoeuvre["criteria"]["turn"] == pytest.approx(-np.mean(angle**2), rel=0.02)  # on a finer grid
    assert np.abs(angle).max() > 0.01  # a random motion is improved on
    assert "which nobody but a test wants" in PdfText.read(tmp_path / "out" / "report.pdf")


def test_a_criterion_that_is_unknown_or_made_wrongly_is_named_as_soon_as_a_model_is_read(tmp_path):
    with pytest.raises(InputError, match=r"study.toml.*design.criteria #2.*'twist'.*turn.*model.plugins"):
        load_model(Study.load(study(tmp_path, '["turn", "twist"]')))
    with pytest.raises(InputError, match=r"study.toml.*design.options.turn.*'turn' cannot be made.*radius"):
        load_model(Study.load(study(tmp_path, options="radius = 2")))
    with pytest.raises(InputError, match=r"study.toml.*design.rivals.*Name at least two"):
        load_model(Study.load(study(tmp_path, '["separation"]', options="")))
    with pytest.raises(InputError, match="has no name"):
        register_criterion(Criterion)


def test_every_criterion_says_what_it_rewards():
    shipped = {name: kind for name, kind in known_criteria().items() if kind.__module__.startswith("bayesid.design.")}
    assert len(shipped) == 8
    assert len({kind.meaning for kind in shipped.values()} - {Criterion.meaning}) == 8
