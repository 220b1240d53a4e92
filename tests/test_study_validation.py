"""The validation report: it holds every goal of every summary, and is that of the summaries that lie in the folder."""

import json
from pathlib import Path

from studies.common.study import Verdict
from studies.validation import SUBJECTS, judged, write_validation
from tests.pdf_text import PdfText
from tests.report_rules import broken_rules

REPORTS = Path(__file__).resolve().parents[1] / "reports"


def test_every_goal_of_every_summary_is_in_the_report():
    text = PdfText.read(REPORTS / "validation.pdf")
    found = judged(REPORTS)
    summaries = [json.loads(file.read_text()) for file in REPORTS.glob("*.json")]
    untested = sum(len(subject.untested) for subject in SUBJECTS)
    assert len(found) == untested + sum(len(summary["goals"]) for summary in summaries)
    for item in found:
        row = (item.study, item.goal.text, item.goal.reached, item.goal.verdict.value)
        assert text.row(*row), f"{row}: run python -m studies.validation"
    for summary in summaries:
        assert summary["answer"] in text, "run python -m studies.validation"
    assert broken_rules(REPORTS / "validation.pdf", full=False) == []


def test_misses_come_first_and_unknown_studies_are_not_lost(tmp_path):
    goals = [{"text": f"goal {verdict.value}", "reached": "1 %", "verdict": verdict.value} for verdict in Verdict]
    summary = {"question": "Why?", "answer": "So.", "goals": goals, "valid": "always.", "full": False}
    (tmp_path / "novel.json").write_text(json.dumps(summary))
    for name in ("novel", "older"):
        (tmp_path / f"{name}.pdf").touch()
    write_validation(tmp_path, tmp_path / "validation.pdf")
    text = PdfText.read(tmp_path / "validation.pdf")
    assert "1 of 5 goals are met, and 1 are missed." in text
    assert "missed by novel (1)" in text
    assert "So. (Not run in full.)" in text
    assert "older: reports without a summary" in text
    assert text.row(
        "none", "Walkers and trials per second on a GPU against two cores", "no GPU was available", "NOT TESTED"
    )
    whole = " ".join(" ".join(text.pages).split())
    places = [whole.index(f"goal {verdict.value} 1 %") for verdict in (Verdict.FAIL, Verdict.OPEN, Verdict.PASS)]
    assert places == sorted(places)
