"""The one base of all studies: command line, report with its parts in one order, summary, tables beside it, origin.

A study states how it runs (`Study.run`) and what its report holds (`Report`); `Study.main` does the rest. The report is
a `bayesid.report.Document` of two to four pages: answer, deciding figure and goals on the first, then the setup, the
study's own sections, the paper's statements and the names of the tables beside it. The summary beside it, as JSON, is
what `studies.index` and `studies.validation` read.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from matplotlib.figure import Figure

from bayesid._io.files import complete_file, write_json
from bayesid.app.compilation_cache import keep_compiled
from bayesid.app.options import executor_at
from bayesid.report import Document
from studies.common.code_version import CodeVersion, caution
from studies.common.provenance import MODELS, study_origin
from studies.common.report_parts import glossary, link_reports

R = TypeVar("R")

# options of what runs the trials: ``workers`` of `studies.common.monte_carlo.run_trials`
WORKERS: Mapping[str, Mapping[str, Any]] = {
    "--workers": {"type": int, "default": 1, "help": "number of processes for the trials"},
    "--scheduler": {
        "metavar": "ADDRESS",
        "dest": "workers",
        "type": executor_at,
        "help": "dask.distributed scheduler whose workers run the trials, instead of processes on this machine",
    },
}

# options of a study with `studies.common.monte_carlo.run_trials`, for `Command.extra`
TRIALS: Mapping[str, Mapping[str, Any]] = {
    "--trials": {"type": Path, "help": "file that stores the Monte Carlo trials, to resume an interrupted run"},
    **WORKERS,
}

# option of a study whose trials are made by many runs
MADE: Mapping[str, Mapping[str, Any]] = {
    "--made": {"action": "store_true", "help": "report the stored trials without making more"}
}


# caution on the first page of a study that was not run in full
NOT_FULL = "Not run in full: figures without an interval are examples, not results."


class Verdict(StrEnum):
    """What is said of a goal."""

    PASS = "PASS"
    FAIL = "FAIL"
    OPEN = "NOT DECIDED"
    NOT_TESTED = "NOT TESTED"

    @classmethod
    def of(cls, passed: object) -> Verdict:
        """Return PASS or FAIL, or NOT TESTED where nothing was computed (None)."""
        return cls.NOT_TESTED if passed is None else cls.PASS if passed else cls.FAIL

    @classmethod
    def all_of(cls, verdicts: Iterable[Verdict]) -> Verdict:
        """Return the verdict on a goal of several parts: FAIL where one fails, PASS only where all pass."""
        parts = set(verdicts) or {cls.NOT_TESTED}
        return cls.FAIL if cls.FAIL in parts else parts.pop() if len(parts) == 1 else cls.OPEN

    @classmethod
    def between(cls, low: float, high: float, least: float = -np.inf, most: float = np.inf) -> Verdict:
        """Return PASS where an interval from low to high lies within the goal, FAIL where it lies beside it."""
        within, beside = least <= low and high <= most, high < least or low > most
        return cls.PASS if within else cls.FAIL if beside else cls.OPEN


class Severity(StrEnum):
    """What it means to a user that a goal is missed."""

    HIGH = "high"
    MEDIUM = "medium"
    LOW = "low"

    @property
    def meaning(self) -> str:
        """What it means to a user, in words."""
        return {
            Severity.HIGH: "an answer or its stated uncertainty may be wrong",
            Severity.MEDIUM: "an answer is missing or less precise than required, and is stated as such",
            Severity.LOW: "an answer takes more time or memory than required",
        }[self]


@dataclass(frozen=True)
class Goal:
    """A goal of a study, as a user would set it."""

    text: str  # what is to be reached, with its number
    reached: str  # what was reached, with its interval where there is one
    verdict: Verdict  # NOT DECIDED where the interval holds values on both sides of the goal
    severity: Severity  # if it is missed


@dataclass(frozen=True)
class Setup:
    """Conditions of a study, one sentence or two each.

    The manoeuvre states its speed beside the flight's rule; the replicates say what a full run repeats.
    """

    robot: str
    manoeuvre: str
    sensors: str
    known: str
    unknown: str
    replicates: str


class Finding(StrEnum):
    """What a study finds of a statement in the paper."""

    CONFIRMED = "confirmed"
    REFUTED = "refuted"
    NOT_TESTABLE = "not testable"


class Statement(NamedTuple):
    """A statement of the paper, what is found of it, and why."""

    text: str
    finding: Finding
    reason: str


class Picture(NamedTuple):
    """A figure with its caption."""

    figure: Figure
    caption: str


class CsvTable(NamedTuple):
    """A table written beside the report, ``REPORT-NAME.csv``."""

    name: str
    header: Sequence[str]
    rows: Iterable[Sequence[object]]

    def write(self, output: Path) -> str:
        """Write the table beside a report and return the name of its file."""
        file = output.with_name(f"{output.stem}-{self.name}.csv")
        with complete_file(file) as part, part.open("w", encoding="utf-8", newline="") as stream:
            csv.writer(stream, lineterminator="\n").writerows([self.header, *self.rows])
        return file.name


@dataclass(frozen=True, kw_only=True)
class Report(Generic[R]):
    """What a report holds, in the order in which it is printed."""

    title: str
    subtitle: str
    # what is asked, the answer, and the conditions under which it is right; one sentence each
    question: str
    answer: str
    valid: str
    goals: Sequence[Goal]
    full: bool  # whether the study was run in full
    figure: Picture | None = None  # figure that decides, on the first page
    note: str = ""  # paragraph below the goals, as on how they are judged
    setup: Setup | None = None
    outline: Figure | None = None  # drawing of the robot inside the box of the setup
    picture: Picture | None = None  # figure below the setup, as of the motion
    # each adds to a document what it shows of a result: failures, evidence, calibration
    sections: Sequence[Callable[[Document, R], None]] = ()
    statements: Sequence[Statement] = ()  # what is found of the paper's statements
    tables: Sequence[CsvTable] = ()  # tables beside the report
    # sentence on these tables; ``{all}`` stands for all names of files, ``{0}`` for the first
    beside: str = "Tables with this report: {all}."
    credit: str = ""  # sentence added to where the report comes from

    def document(self, result: R, output: Path, stale: str = "") -> Document:
        """Return the printed report without its foot; the tables are written beside the output.

        Parameters
        ----------
        result : object; what the study's `run` returned
        output : Path; file of the PDF
        stale : str, optional; what is said where another version of the code made the figures
        """
        document = Document(self.title, self.subtitle)
        entries = [("Question", self.question), ("Valid when", self.valid)]
        cautions = [("Caution", text) for text in ("" if self.full else NOT_FULL, stale) if text]
        document.decision(self.answer, [*entries, *cautions])
        if self.figure is not None:
            document.figure(*self.figure)
        rows = [[goal.text, goal.reached, goal.verdict.value] for goal in self.goals]
        document.table(["goal", "reached", "verdict"], rows, "Goals.", ["left"] * 3)
        if self.note:
            document.paragraph(self.note)
        if self.setup is not None:
            document.section("Setup")
            conditions = [(name.capitalize(), text) for name, text in asdict(self.setup).items()]
            document.decision("Conditions", conditions, self.outline)
        if self.picture is not None:
            document.figure(*self.picture)
        for section in self.sections:
            section(document, result)
        if self.statements:
            document.section("Statements of the paper and results of this study")
            rows = [[statement.text, statement.finding.value, statement.reason] for statement in self.statements]
            document.table(["the paper", "finding", "why"], rows, "Statements of the paper.", ["left"] * 3)
        files = [table.write(output) for table in self.tables]
        for file in files:
            document.link(file, file)
        link_reports(document)
        if files and self.beside:
            document.paragraph(self.beside.format(*files, all=", ".join(files)))
        return document

    def summary(self, origin: str | None, versions: Sequence[CodeVersion]) -> dict[str, Any]:
        """Return what the JSON file beside the report holds."""
        goals = [asdict(goal) for goal in self.goals]
        said = {"question": self.question, "answer": self.answer, "goals": goals, "valid": self.valid}
        return {**said, "full": self.full, "origin": origin, "versions": [version._asdict() for version in versions]}


@dataclass(frozen=True)
class Command:
    """What a study understands on the command line, ``python -m studies.NAME [--full] [--output FILE] [--seed N]``."""

    name: str  # name of the study, and of its report
    description: str  # one sentence that says what the study does
    full: str | None = None  # what ``--full`` adds; the study has no such option where left out
    # seed of all random numbers unless another is given; the study has no such option where left out
    seed: int | None = None
    # further options -> keywords of ``argparse.ArgumentParser.add_argument``
    extra: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def parse(self, arguments: Sequence[str] | None = None) -> argparse.Namespace:
        """Return the options given, those of the command line where no arguments are; the report's folder is made."""
        parser = argparse.ArgumentParser(prog=f"python -m studies.{self.name}", description=self.description)
        if self.full is not None:
            parser.add_argument("--full", action="store_true", help=self.full)
        report = Path("reports") / f"{self.name}.pdf"
        parser.add_argument("--output", type=Path, default=report, help="PDF file, or folder, of the report")
        if self.seed is not None:
            parser.add_argument("--seed", type=int, default=self.seed, help="seed of all random numbers")
        for option, keywords in self.extra.items():
            parser.add_argument(option, **keywords)
        options = parser.parse_args(arguments)
        if options.output.is_dir() or not options.output.suffix:
            options.output /= report.name
        if getattr(options, "made", False) and options.trials is None:
            parser.error("--made reports stored trials: give their file with --trials")
        summary = options.output.with_suffix(".json")  # written beside the report
        for name, value in vars(options).items():
            if isinstance(value, Path) and value == summary:
                parser.error(f"--{name} {value} is the file for the report's summary: give another name")
        options.output.parent.mkdir(parents=True, exist_ok=True)
        return options


@dataclass(frozen=True, kw_only=True)
class Study(Command, Generic[R]):
    """A study: its command, how it runs, and what its report says."""

    # takes every option of the command but ``output`` as keyword, and ``progress`` as `show`; returns the result
    run: Callable[..., R]
    report: Callable[[R], Report[R]]  # result -> `Report`
    # options -> files that the study reads, for the report's origin; by default the robot ETS-VII
    inputs: Callable[[argparse.Namespace], Sequence[Path]] = lambda options: [MODELS / "ets7.urdf"]

    def main(self, arguments: Sequence[str] | None = None) -> None:
        """Run the study with the options given, by default those of the command line, and write its report."""
        options = self.parse(arguments)
        keep_compiled()
        chosen = {name: value for name, value in vars(options).items() if name != "output"}
        result = self.run(**chosen, progress=show)
        store = getattr(options, "trials", None)
        # one study may store its trials in several files, named after the one that is given
        stores = [] if store is None else [store, *sorted(store.parent.glob(f"{store.stem}-*{store.suffix}"))]
        made_by = (version for file in stores if file.is_file() for version in CodeVersion.of_trials(file))
        versions = list(dict.fromkeys(made_by))
        self.write(result, options.output, study_origin(self.name, options, self.inputs(options)), versions)
        show(f"Wrote {options.output}.")

    def write(self, result: R, output: Path, origin: str | None = None, versions: Sequence[CodeVersion] = ()) -> None:
        """Write the report as PDF, and beside it its summary as JSON and its tables as CSV.

        The meanings of the terms that it uses stand at the foot of its last page, which is filled to one half where the
        figures' heights permit.

        Parameters
        ----------
        result : object; what `run` returned
        output : Path; file of the PDF; the other files have its name but for their endings
        origin : str, optional; where the report comes from, `studies.common.provenance.study_origin`
        versions : sequence of CodeVersion, optional; of the code that made the figures, by default the present one
        """
        report, present = self.report(result), CodeVersion.present(self.name)
        versions = versions or [present]
        document = report.document(result, output, caution(versions, present))
        if origin is not None and report.credit:
            origin = f"{origin.rstrip('.')}. {report.credit}"
        document.foot(origin or "", glossary(document))
        document.write(output, filled=True)
        write_json(output.with_suffix(".json"), report.summary(origin, versions))


def show(*said: float | str) -> None:
    """Print a line on what is being done, after the fraction that is done where that is given first."""
    print(": ".join(part if isinstance(part, str) else f"{part:.0%}" for part in said), flush=True)
