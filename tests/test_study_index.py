"""The page of all reports: what it says of them, and that it agrees with what lies in the folder."""

import json
from pathlib import Path

import pytest

from studies.common.study import NOT_FULL, Verdict
from studies.index import index_text
from tests.pdf_text import PdfText

REPORTS = Path(__file__).resolve().parents[1] / "reports"


def test_the_page_is_that_of_the_summaries():
    assert (REPORTS / "README.md").read_text(encoding="utf-8") == index_text(REPORTS), "run python -m studies.index"


@pytest.mark.slow
def test_summaries_are_those_of_their_reports():
    found = sorted(REPORTS.glob("*.json"))
    assert found
    for file in found:
        summary, text = json.loads(file.read_text()), PdfText.read(file.with_suffix(".pdf"))
        assert (NOT_FULL in text) is not summary["full"], file.name
        assert summary["answer"] in text, file.name
        for goal in summary["goals"]:
            assert text.row(goal["text"], goal["reached"], goal["verdict"]), (file.name, goal["text"])


def test_goals_are_counted_and_reports_without_a_summary_are_named(tmp_path):
    goals = [{"text": "a | b", "reached": "1 %", "verdict": verdict.value} for verdict in Verdict]
    summary = {"question": "Why?", "answer": "So.", "goals": goals, "valid": "always.", "full": True}
    (tmp_path / "one.json").write_text(json.dumps(summary))
    for name in ("one", "two"):
        (tmp_path / f"{name}.pdf").touch()
    text = index_text(tmp_path)
    assert "All 4 goals: 1 PASS, 1 FAIL, 1 NOT DECIDED, 1 NOT TESTED." in text
    assert "| a \\| b | 1 % | FAIL |" in text
    for goal in goals:
        goal["severity"] = "medium"
    (tmp_path / "one.json").write_text(json.dumps(summary))
    text = index_text(tmp_path)
    assert "| a \\| b | 1 % | FAIL (medium) |" in text
    assert "| a \\| b | 1 % | PASS |" in text
    assert "High: an answer or its stated uncertainty may be wrong; medium: " in text
    assert text.endswith("- [two](two.pdf)\n")
