"""What a study states of the prior of causes reaches the diagnosis."""

from __future__ import annotations

from pathlib import Path

import pytest

import bayesid.diagnosis
from bayesid._io.errors import InputError
from bayesid.app.diagnose_command import diagnose_study
from bayesid.app.schema import Study
from bayesid.diagnosis import CausePrior
from bayesid.simulation.effects import PhysicalBound

DEMONSTRATION = Path(bayesid.__file__).parent / "app" / "demonstration_data"

STATED = """
[diagnosis]
one_more_cause = 0.2
outside_catalogue = 0.05
[diagnosis.bounds]
wheel-momentum = {"N m s" = 5.0}
"""


class ReachedError(Exception):
    """Raised in place of the diagnosis."""


def stated(tmp_path: Path, text: str) -> Study:
    for file in DEMONSTRATION.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    file = tmp_path / "study.toml"
    file.write_text(file.read_text(encoding="utf-8") + text, encoding="utf-8")
    return Study.load(file)


def test_prior_and_bounds_of_a_study_reach_the_diagnosis(tmp_path, monkeypatch):
    given = {}

    def instead(*_, **options):
        given.update(options)
        raise ReachedError

    monkeypatch.setattr("bayesid.app.functions.diagnose_study.diagnose_motion", instead)
    with pytest.raises(ReachedError):
        list(diagnose_study(stated(tmp_path, STATED), tmp_path / "results", 0, None))
    assert given["prior"] == CausePrior(0.2, 0.05)
    assert given["bounds"] == {"wheel-momentum": [PhysicalBound("N m s", 5.0, "Stated in the study.")]}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("one_more_cause = 0.2", "one_more_cause = 1.5", "diagnosis.one_more_cause"),
        ("outside_catalogue", "outside", "unknown key 'outside'"),
        ("5.0", "-5.0", "diagnosis.bounds.wheel-momentum"),
    ],
)
def test_what_cannot_be_meant_is_an_error(old, new, message, tmp_path):
    with pytest.raises(InputError, match=message):
        stated(tmp_path, STATED.replace(old, new))
