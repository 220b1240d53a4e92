"""The validation report: it holds every goal of every summary, and is that of the summaries that lie in the folder."""

import json
from pathlib import Path

import pytest

from studies.common.study import NOT_FULL, Verdict
from studies.validation import Severity, judged, severity, write_validation
from tests.pdf_text import PdfText, links_of
from tests.report_rules import broken_rules

REPORTS = Path(__file__).resolve().parents[1] / "reports"


def test_every_goal_of_every_summary_is_in_the_report():
    text = PdfText.read(REPORTS / "validation.pdf")
    found = judged(REPORTS)
    summaries = [json.loads(file.read_text()) for file in REPORTS.glob("*.json")]
    assert len(found) == sum(len(summary["goals"]) for summary in summaries)
    for item in found:
        row = (item.study, item.goal.text, item.goal.reached)
        row += (severity(item.goal.text).value,) if item.goal.verdict is Verdict.FAIL else ()
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
    assert "missed by novel (1)" in text
    assert f"So. {NOT_FULL}" in text
    assert "older: reports without a summary" in text
    whole = " ".join(" ".join(text.pages).split())
    places = [whole.index(f"goal {verdict.value} 1 %") for verdict in (Verdict.FAIL, Verdict.OPEN, Verdict.PASS)]
    assert places == sorted(places)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("outside effects with a residual below 10 sigma wrongly explained", Severity.HIGH),
        ("ranks uniform (corrected p above 0.01), 200 replicates: whole system", Severity.HIGH),
        ("mass of the whole system to 1 % with motion alone", Severity.MEDIUM),
        ("a cause named on every body", Severity.MEDIUM),
        ("at least 5 times faster than the best peer, 79 unknowns", Severity.LOW),
        ("Files to verdict, cold: at most 20 s for nothing, leak", Severity.LOW),
    ],
)
def test_a_missed_goal_is_severe_where_an_answer_may_be_wrong(text, expected):
    assert severity(text) is expected
