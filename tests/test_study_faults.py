"""The study of faults: a campaign that is killed, units that are mistaken, and what the report says of both."""

from __future__ import annotations

import numpy as np
import pytest

from bayesid._io.words import joined
from studies.faults import STUDY, Result, attempt, tasks
from studies.faults.kills import COMMANDS, content_of, half_written, kill_and_resume
from studies.faults.surroundings import FULL, SURROUNDINGS, can_fill_a_disk
from tests.pdf_text import PdfText


@pytest.mark.slow
def test_a_campaign_that_is_killed_ends_as_one_left_alone(tmp_path):
    killed = kill_and_resume("campaign", tmp_path, np.random.default_rng(1), kills=3)
    assert killed.kills > 0
    assert killed.same, killed
    lines = (tmp_path / "killed" / "trials.json").read_text().splitlines()
    assert len(lines) == len(set(lines)) == 41


def test_what_differs_and_what_is_half_written_is_seen(tmp_path):
    (tmp_path / "a.json").write_text('{"mass": 1.0, "seconds": 2.0}')
    (tmp_path / "report.pdf").write_bytes(b"%PDF-1.7 and then")
    assert content_of(tmp_path) == {"a.json": {"mass": 1.0}, "report.pdf": None}
    assert half_written(tmp_path) == ["report.pdf"]
    (tmp_path / "a.json").write_text('{"mass": 1.')
    assert half_written(tmp_path) == ["a.json", "report.pdf"]


@pytest.mark.slow
@pytest.mark.parametrize("title", SURROUNDINGS)
def test_faults_around_a_run_get_one_clear_error(title):
    if title == FULL and not can_fill_a_disk():
        pytest.skip("this system gives a process no file system of its own")
    found = attempt({"around": title}, np.random.default_rng(0))
    assert found["refused"], found["said"]


@pytest.mark.slow
@pytest.mark.parametrize(("slip", "unit"), [("rate in arcseconds per second", "arcsec/s"), ("acceleration in g", "g")])
def test_a_wrong_unit_is_refused_with_the_unit_that_it_is(slip, unit):
    """Rates that nothing can follow, which a simulation must not try."""
    found = attempt({"unit": slip}, np.random.default_rng(0))
    assert found["noticed"], found["said"]
    assert f'unit = "{unit}"' in found["said"]


@pytest.mark.slow
def test_spoilt_files_are_counted():
    found = attempt({"spoil": 3, "changes": 20}, np.random.default_rng(0))
    assert sum(sum(counts.values()) for counts in found["answers"].values()) == 20
    assert found["faults"] == []


def test_the_report_says_what_failed_and_what_was_not_tested(tmp_path):
    killed = {"kill": "design", "kills": 2, "half_written": ["a.json"], "same": False, "message": "other files"}
    answers = {"insert": {"refused": 4, "accepted": 2}, "cut off": {"faulty": 1}}
    made = [
        {"spoil": 1, "answers": answers, "faults": ["KeyError"]},
        {"unit": "acceleration in g", "noticed": False, "said": ""},
        {"around": "a full disk", "refused": True, "said": "Error: No space left"},
        killed,
    ]
    STUDY.write(Result(made, ["a trial broke"]), tmp_path / "faults.pdf")
    text = PdfText.read(tmp_path / "faults.pdf")
    assert text.row("No unclear answer to a corrupted file", "1 of 7; 4 refused, 2 accepted", "FAIL")
    around = f"Each of these gives exactly one clear error message: {joined(SURROUNDINGS)}"
    others = joined([title for title in SURROUNDINGS if title != FULL])
    reached = f"1 of {len(SURROUNDINGS)}; not run (see tests/test_faults.py): {others}"
    assert text.row(around, reached, "NOT DECIDED")
    assert text.row("No partly written file after a kill", "1 file after 2 kills", "FAIL")
    resumed = ", ".join(f"{name} {'2 kills, other result' if name == 'design' else '0 kills'}" for name in COMMANDS)
    assert text.row(f"Same result after kills: {joined(COMMANDS)}", resumed, "FAIL")
    unmoved = "A cache written by another version is not used"
    assert text.row(unmoved, "not run; for a damaged cache file see tests/test_kept_jit.py", "NOT TESTED")
    for part in ("KeyError", "not noticed", "other files", "a trial broke"):
        assert part in text
    made[2] = {**made[2], "refused": False}
    STUDY.write(Result(made, []), tmp_path / "faults.pdf")
    refusals = f"0 of {len(SURROUNDINGS)}; not refused: {FULL}; not run (see tests/test_faults.py): {others}"
    assert PdfText.read(tmp_path / "faults.pdf").row(around, refusals, "FAIL")
    made[2:] = [{"around": title, "refused": True, "said": "Error"} for title in SURROUNDINGS]
    made += [{**killed, "kill": name, "half_written": [], "same": True} for name in COMMANDS]
    STUDY.write(Result(made, []), tmp_path / "faults.pdf")
    text = PdfText.read(tmp_path / "faults.pdf")
    assert text.row(around, f"{len(SURROUNDINGS)} of {len(SURROUNDINGS)}", "PASS")
    resumed = ", ".join(f"{name} 2 kills" for name in COMMANDS)
    assert text.row(f"Same result after kills: {joined(COMMANDS)}", resumed, "PASS")


OTHER = "with an empty cache; the other version itself gives a different one, so the test can fail"


@pytest.mark.parametrize(
    ("same", "differs", "reached", "verdict"),
    [
        (
            True,
            True,
            f"the same result as {OTHER}",
            "PASS",
        ),
        (
            False,
            True,
            f"a result that differs from that {OTHER}",
            "FAIL",
        ),
        (True, False, "not decisive: the other version gives the same result", "NOT TESTED"),
    ],
)
def test_another_cache_passes_only_where_it_could_have_failed(same, differs, reached, verdict, tmp_path):
    made = [{"cache": "another version", "same": same, "differs": differs}]
    STUDY.write(Result(made, []), tmp_path / "faults.pdf")
    text = PdfText.read(tmp_path / "faults.pdf")
    assert text.row("A cache written by another version is not used", reached, verdict)


def test_the_small_study_is_a_part_of_the_full_one():
    assert {next(iter(task)) for task in tasks(full=False)} < {next(iter(task)) for task in tasks(full=True)}
