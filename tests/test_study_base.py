"""The template of the studies: what it writes, and that its rules are seen to be broken where they are."""

from __future__ import annotations

import argparse
import csv
import json
from pathlib import Path

import matplotlib as mpl
import pytest
from matplotlib.figure import Figure

from bayesid.report import Document
from bayesid.report.document import _least_filled
from bayesid.report.figures.figure_style import styled, wide_figure
from bayesid.report.vector_figure import VectorFigure
from studies.common.code_version import CodeVersion
from studies.common.provenance import study_origin
from studies.common.study import (
    CsvTable,
    Finding,
    Goal,
    Picture,
    Report,
    Setup,
    Severity,
    Statement,
    Study,
    Verdict,
    show,
)
from tests.pdf_text import PdfText, links_of
from tests.report_rules import badly_written, broken_rules

GOALS = (
    Goal("error at most 2 %", "1.2 % (0.9 to 1.5 %)", Verdict.of(1.2 < 2.0), Severity.HIGH),
    Goal("error at most 1 %", "1.2 % (1.1 to 1.5 %)", Verdict.of(False), Severity.MEDIUM),
    Goal("speed", "not run", Verdict.of(None), Severity.LOW),
)


@styled
def picture(height: float) -> Figure:
    figure = wide_figure(height)
    figure.subplots().plot([0.0, 1.0], [1.0, 0.0])
    return figure


def weighed(result: float) -> Report[float]:
    return Report(
        title="Weighing",
        subtitle="An example",
        question="How heavy is it?",
        answer=f"It weighs {result:g} kg.",
        valid="the arm is known. See the report on excitation.",
        goals=GOALS,
        full=False,
        figure=Picture(picture(4.0), "What decides."),
        setup=Setup("a box", "slow", "rate", "arm", "base", "3 recordings"),
        picture=Picture(picture(2.0), "The box."),
        sections=[lambda document, mass: document.figure(picture(3.0), f"More on {mass:g} kg.")],
        statements=[Statement("It is heavy.", Finding.REFUTED, "It weighs 3.1 kg.")],
        tables=[CsvTable("all", ["body", "mass [kg]"], [["a, b", 0.1], ["c", 2]])],
    )


STUDY = Study("weighing", "Weigh a box.", run=lambda seed, progress: float(seed), report=weighed, seed=4)


def test_a_report_has_every_part_and_keeps_the_rules(tmp_path: Path):
    origin = study_origin("weighing", argparse.Namespace(full=True, seed=4, output=tmp_path))
    STUDY.write(3.1, tmp_path / "weighing.pdf", origin)
    text = PdfText.read(tmp_path / "weighing.pdf")
    for words in (
        "It weighs 3.1 kg.",
        "More on 3.1 kg.",
        "Tables with this report: weighing-all.csv.",
        "How heavy is it?",
        "the arm is known.",
        "Not run in full",
        "python -m studies.weighing --full --seed 4",
        "ets7.urdf",
    ):
        assert words in text, words
    assert text.row("error at most 1 %", "1.2 % (1.1 to 1.5 %)", "FAIL")
    assert text.row("speed", "not run", "NOT TESTED")
    assert text.row("It is heavy.", "refuted", "It weighs 3.1 kg.")
    assert broken_rules(tmp_path / "weighing.pdf") == []
    kept = json.loads((tmp_path / "weighing.json").read_text())
    assert kept["answer"] == "It weighs 3.1 kg."
    assert kept["origin"] == origin
    assert links_of(tmp_path / "weighing.pdf") == {"excitation.pdf", "weighing-all.csv"}
    assert [goal["verdict"] for goal in kept["goals"]] == ["PASS", "FAIL", "NOT TESTED"]
    assert [goal["severity"] for goal in kept["goals"]] == ["high", "medium", "low"]

    with (tmp_path / "weighing-all.csv").open(newline="") as stream:
        assert list(csv.reader(stream)) == [["body", "mass [kg]"], ["a, b", "0.1"], ["c", "2"]]


def test_a_study_runs_with_the_options_of_its_command(tmp_path: Path, capsys):
    STUDY.main(["--output", str(tmp_path), "--seed", "7"])
    assert capsys.readouterr().out == f"Wrote {tmp_path / 'weighing.pdf'}.\n"
    summary = json.loads((tmp_path / "weighing.json").read_text())
    assert summary["answer"] == "It weighs 7 kg."
    assert "python -m studies.weighing --seed 7" in summary["origin"]
    show(0.25, "designs")
    assert capsys.readouterr().out == "25%: designs\n"


def test_a_goal_of_several_parts_fails_with_one_and_passes_with_all():
    parts = Verdict.PASS, Verdict.FAIL, Verdict.OPEN, Verdict.NOT_TESTED
    assert Verdict.all_of(parts) is Verdict.FAIL
    assert [Verdict.all_of([part, part]) for part in parts] == list(parts)
    for part in parts[2:]:
        assert Verdict.all_of([Verdict.PASS, part]) is Verdict.OPEN
    assert Verdict.all_of([]) is Verdict.NOT_TESTED


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("chi-square 8e+05", "computers"),
        ("noise of 1e-5", "computers"),
        ("an error of -0.3", "minus"),
        ("from (-1", "minus"),
        ("in m/s2", "raised"),
        ("in kg m2.", "raised"),
    ],
)
def test_what_is_badly_written_is_seen(text: str, rule: str):
    (found,) = badly_written(text)
    assert rule in found


def test_what_is_well_written_is_left_alone():
    words = "8 × 10⁵, −0.3, 2026-11-23, link2-3, rate-noise, --seed 1, 6-8 m/s², x2, commit 12e45678ab90, 1–2 kg m²"
    assert list(badly_written(words)) == []


def test_figures_of_other_code_are_stated_on_the_first_page(tmp_path: Path):
    STUDY.write(3.1, tmp_path / "now.pdf")
    assert "the code that makes them" not in PdfText.read(tmp_path / "now.pdf")
    other = CodeVersion("0.1.0", "0123456789ab", "an older one")
    STUDY.write(3.1, tmp_path / "older.pdf", versions=[other])
    assert "0.1.0 (commit 0123456789ab)" in PdfText.read(tmp_path / "older.pdf").pages[0]
    assert json.loads((tmp_path / "older.json").read_text())["versions"] == [other._asdict()]


def test_a_hyphen_an_empty_half_page_and_a_lonely_caption_are_seen_in_a_report(tmp_path: Path):
    document = Document("Bad")
    document.figure(picture(6.0), "Fills the page, with an error of -0.3.")
    document.page()
    document.paragraph("Table 1. A caption whose table is on the next page.")
    document.write(tmp_path / "bad.pdf")
    found = broken_rules(tmp_path / "bad.pdf")
    assert [rule[:8] for rule in found] == ["page 1 h", "page 2 e", "page 2 o"], found


def test_small_print_at_the_foot_of_the_last_page_does_not_fill_it(tmp_path: Path):
    document = Document("Bad")
    document.figure(picture(6.0), "Fills the page.")
    document.page()
    document.paragraph("One line.")
    document.foot("", f"Terms. {'words ' * 400}")
    document.write(tmp_path / "bad.pdf")
    (found,) = broken_rules(tmp_path / "bad.pdf")
    assert found.startswith("page 2 of 2 is filled to")


@pytest.mark.parametrize(("heights", "pages"), [((2.35, 2.35, 2.35), 1), ((6.0, 2.0, 2.0), 2)], ids=["lower", "higher"])
def test_figures_become_lower_or_higher_until_the_last_page_is_filled(
    heights: tuple[float, ...], pages: int, tmp_path: Path
):
    document = Document("Good")
    for number, height in enumerate(heights):
        document.figure(picture(height), f"{height:g} inches.")
        if pages == 2 and number == 0:
            document.page()
    document.paragraph(" ".join(["words"] * (150 if pages == 1 else 1)))
    document.write(tmp_path / "as-asked.pdf")
    document.write(tmp_path / "filled.pdf", filled=True)
    document.write(tmp_path / "again.pdf")
    (found,) = broken_rules(tmp_path / "as-asked.pdf")
    assert "is filled to" in found
    assert broken_rules(tmp_path / "filled.pdf") == []
    assert len(PdfText.read(tmp_path / "filled.pdf").pages) == pages
    assert (tmp_path / "again.pdf").read_bytes() == (tmp_path / "as-asked.pdf").read_bytes()


def test_a_figure_is_not_made_lower_than_its_named_ticks_permit(tmp_path: Path):
    @styled
    def named(count: int) -> Figure:
        figure = wide_figure(2.0)
        figure.subplots().set_yticks(range(count), [f"name {number}" for number in range(count)])
        return figure

    letters = 72.0 * 2.0 / 8.0  # of 8 points, which a figure of two inches would hold without axes and room
    for count, lowest in ((2, 0.7), (10, 0.9), (int(letters), 1.0)):
        drawn = named(count)
        height = VectorFigure(drawn).height(0.7) / 2.0
        assert height == pytest.approx(0.7) if lowest == 0.7 else 0.7 < height <= lowest
        axes = drawn.axes[0].get_position().height * 2.0 * 72.0 - 144.0 * (1.0 - height)
        assert axes >= 1.15 * 8.0 * count - 1e-9 or height == 1.0


def test_labels_can_be_read_in_print():
    @styled
    def sizes() -> list[float]:
        keys = ("font.size", "axes.labelsize", "axes.titlesize", "xtick.labelsize", "ytick.labelsize")
        return [float(mpl.rcParams[key]) for key in keys]

    assert min(sizes()) >= 8.0


def test_a_page_is_filled_by_what_runs_on_to_the_next_and_not_by_what_moves_there():
    whole, flowing = [(1, 0.4), (2, 0.3), (2, 0.9)], [(1, 0.4), (2, 0.3), (3, 0.8)]
    assert _least_filled(whole, [True, False, False]) == 0.4
    assert _least_filled(flowing, [True, True, True]) == 0.8
    assert _least_filled([(1, 0.1)], [True]) == 1.0


def test_a_page_is_filled_by_the_figures_at_its_foot():
    ends, whole = [(1, 0.4), (2, 0.9)], [False, False]
    assert _least_filled(ends, whole, [(1, 0.7)]) == pytest.approx(0.7)
    assert _least_filled(ends, whole, [(1, 0.7), (1, 0.5)]) == pytest.approx(0.9)  # the higher of two counts
    assert _least_filled(ends, whole, [(3, 0.8)]) == pytest.approx(0.2)  # alone on the last page
    assert _least_filled(ends, whole, [(1, 0.1)]) == 0.4  # at the head, above what ends there


def test_a_floating_figure_is_made_higher_where_its_page_is_not_filled(tmp_path: Path):
    document = Document("Floating")
    figure = wide_figure(5.0)
    figure.subplots().plot([0.0, 1.0])
    document.paragraph("Text on the first page. " * 10)
    document.figure(figure, "At the foot.", floating=True)
    document.page()
    document.paragraph("Text on the second page. " * 160)
    for filled in (False, True):
        document.write(tmp_path / f"{filled}.pdf", filled=filled)
        assert len(PdfText.read(tmp_path / f"{filled}.pdf").pages) == 2
    assert (tmp_path / "True.pdf").read_bytes() != (tmp_path / "False.pdf").read_bytes()


def test_options_and_units_are_not_torn_at_line_ends(tmp_path: Path):
    document = Document("Lines")
    document.paragraph("python -m studies.weighing --full --seed 4 with 1 × 10⁻⁵ m/s². " * 40)
    document.write(tmp_path / "lines.pdf")
    lines = PdfText.read(tmp_path / "lines.pdf").pages[0].splitlines()
    assert len(lines) > 20
    assert not any(line.rstrip().endswith(("-", "m/", "×", " 1")) for line in lines)
