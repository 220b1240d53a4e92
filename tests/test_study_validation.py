"""The validation report: it holds every goal of every summary, and is that of the summaries that lie in the folder."""

import json
from pathlib import Path

from studies.common.study import NOT_FULL, Severity, Verdict
from studies.validation import UNSTATED, judged, write_validation
from tests.pdf_text import PdfText, links_of
from tests.report_rules import broken_rules

REPORTS = Path(__file__).resolve().parents[1] / "reports"


def test_every_goal_of_every_summary_is_in_the_report():
    text = PdfText.read(REPORTS / "validation.pdf")
    found = judged(REPORTS)
    summaries = [json.loads(file.read_text()) for file in REPORTS.glob("*.json")]
    assert len(found) == sum(len(summary["goals"]) for summary in summaries)
    for item in found:
        row = (item.study, item.text, item.reached)
        row += (item.severity,) if item.verdict is Verdict.FAIL else ()
        assert text.row(*row), f"{row}: run python -m studies.validation"
    for summary in summaries:
        assert summary["answer"] in text, "run python -m studies.validation"
    assert broken_rules(REPORTS / "validation.pdf", full=False) == []
    links = links_of(REPORTS / "validation.pdf")
    assert {f"{item.study}.pdf" for item in found} < links
    assert all((REPORTS / link).is_file() for link in links)


def test_misses_come_first_and_unknown_studies_are_not_lost(tmp_path):
    goals = [{"text": f"goal {verdict.value}", "reached": "1 %", "verdict": verdict.value} for verdict in Verdict]
    summary = {"question": "Why?", "answer": "So.", "goals": goals, "valid": "always.", "full": False}
    (tmp_path / "novel.json").write_text(json.dumps(summary))
    for name in ("novel", "older"):
        (tmp_path / f"{name}.pdf").touch()
    write_validation(tmp_path, tmp_path / "validation.pdf")
    text = PdfText.read(tmp_path / "validation.pdf")
    assert "1 of 4 goals are met, and 1 are missed." in text
    assert "missed in novel (1)" in text
    assert f"So. {NOT_FULL}" in text
    assert "older: reports without a summary" in text
    whole = " ".join(" ".join(text.pages).split())
    places = [whole.index(f"goal {verdict.value} 1 %") for verdict in (Verdict.FAIL, Verdict.OPEN, Verdict.PASS)]
    assert places == sorted(places)


def test_misses_are_sorted_by_severity_and_a_summary_without_it_is_read(tmp_path):
    goals = [
        {"text": f"goal {number}", "reached": "1 %", "verdict": "FAIL", "severity": severity}
        for number, severity in enumerate(("low", "high", None, "medium"))
    ]
    del goals[2]["severity"]
    summary = {"question": "Why?", "answer": "So.", "goals": goals, "valid": "always.", "full": True}
    (tmp_path / "older.json").write_text(json.dumps(summary))
    (tmp_path / "older.pdf").touch()
    write_validation(tmp_path, tmp_path / "validation.pdf")
    text = PdfText.read(tmp_path / "validation.pdf")
    whole = " ".join(" ".join(text.pages).split())
    rows = ("goal 1 1 % high", "goal 3 1 % medium", "goal 0 1 % low", f"goal 2 1 % {UNSTATED}")
    places = [whole.index(row) for row in rows]
    assert places == sorted(places)
    for severity in Severity:
        assert f"{severity}: {severity.meaning}" in text


def test_committed_goals_state_their_severity():
    """Reports that have not been run again since goals have one state none, for all of their goals."""
    for file in REPORTS.glob("*.json"):
        stated = [goal.get("severity") for goal in json.loads(file.read_text())["goals"]]
        assert set(stated) == {None} or set(stated) <= set(Severity), file.name
