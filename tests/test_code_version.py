"""The version of the code that makes figures: what changes its fingerprint, what trials record, what reports say."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import bayesid
from studies.common import code_version
from studies.common.code_version import UNRECORDED, CodeVersion, caution, fingerprint, refusals, study_of
from studies.common.monte_carlo import run_trials

BEFORE = '''
"""Weighs."""
LIMIT = 3.0


def weigh(mass: float, unit: str = "kg") -> str:
    """Return the mass."""
    if mass > LIMIT:
        raise ValueError(f"{mass} {unit} is too heavy")
    return f"{mass}{unit}"
'''

OTHER = CodeVersion("0.1.0", "0123456789ab", "an older one")


@pytest.fixture
def fingerprint_with(tmp_path, monkeypatch):
    """Fingerprint of a study whose code calls a package of one module."""
    monkeypatch.setattr(code_version, "ROOT", tmp_path)

    def written(source: str, file: str = "bayesid/weighing.py") -> str:
        path = tmp_path / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(source, encoding="utf-8")
        fingerprint.cache_clear()
        code_version._content.cache_clear()
        return fingerprint("load")

    yield written
    fingerprint.cache_clear()
    code_version._content.cache_clear()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"""Weighs."""', '"""Determines a mass."""'),
        ('    """Return the mass."""\n', ""),
        ("LIMIT = 3.0", "LIMIT = 3.0  # of the balance [kg]\n"),
        ("is too heavy", "exceeds the balance"),
    ],
    ids=["docstring", "no docstring", "comment and lines", "message"],
)
def test_words_leave_the_fingerprint_alone(old, new, fingerprint_with):
    first = fingerprint_with(BEFORE)
    assert fingerprint_with(BEFORE.replace(old, new)) == first


@pytest.mark.parametrize(
    ("old", "new"), [("3.0", "3.1"), ("mass > LIMIT", "mass >= LIMIT"), ('"kg"', '"g"')], ids=["value", "logic", "key"]
)
def test_what_changes_numbers_changes_the_fingerprint(old, new, fingerprint_with):
    first = fingerprint_with(BEFORE)
    assert fingerprint_with(BEFORE.replace(old, new)) != first


def test_the_study_and_its_robots_belong_to_the_code_and_reports_do_not(fingerprint_with):
    first = fingerprint_with(BEFORE)
    assert fingerprint_with("LIMIT = 1.0", "bayesid/report/document.py") == first
    assert fingerprint_with("LIMIT = 1.0", "studies/load/report.py") == first
    assert fingerprint_with("LIMIT = 1.0", "studies/sensors/analysis.py") == first
    seen = {first}
    for file in ("studies/load/analysis.py", "studies/truth/orbit.py", "bayesid/robot/models/arm.urdf"):
        seen.add(fingerprint_with("LIMIT = 1.0", file))
    assert len(seen) == 4


def half(task: float, rng: np.random.Generator) -> float:
    """Return half of the task."""
    return task / 2.0


def test_trials_record_the_version_that_made_them(tmp_path):
    store = tmp_path / "trials.jsonl"
    run_trials(half, [1.0], store)
    present = CodeVersion.present(study_of(half.__module__))
    assert present.release == bayesid.__version__
    assert CodeVersion.of_trials(store) == [present]
    header, line = store.read_text().splitlines()
    older = json.loads(line)
    del older["code"]
    store.write_text(f"{header}\n{json.dumps(older)}\n")
    run_trials(half, [1.0, 2.0], store)
    assert CodeVersion.of_trials(store) == [UNRECORDED, present]


def test_figures_of_other_code_are_refused_and_those_of_another_commit_are_not():
    present = CodeVersion.present("load")
    assert caution([present, present._replace(commit="another")], present) == ""
    assert "0.1.0 (commit 0123456789ab)" in caution([present, OTHER], present)
    summaries = {
        "load": {"versions": [present._asdict()]},
        "sensors": {"versions": [OTHER._asdict()]},
        "faults": {"versions": []},
    }
    first, second = refusals(summaries)
    assert first.startswith("sensors: The numbers were made by bayesid 0.1.0")
    assert second == "faults: no version is stated. Run python -m studies.faults --full"


def test_modules_of_no_study_belong_to_what_all_studies_share():
    assert study_of("studies.calibration.replicate") == "calibration"
    assert study_of("tests.test_code_version") == "common"
    assert Path(code_version.ROOT / "studies" / "common").is_dir()
