"""The study of faults: its trials, and what its report says of them."""

from __future__ import annotations

import re
import tempfile
import textwrap
import warnings
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import seed as seeded
from matplotlib.figure import Figure

from bayesid._io.words import counted, joined
from bayesid.app.compilation_cache import keep_compiled
from bayesid.report import Document
from bayesid.report.figures.figure_style import COLOURS, shared_legend, styled, wide_figure
from bayesid.report.numbers import format_percent
from studies.common.monte_carlo import Workers, read_store, run_trials
from studies.common.report_parts import add_number_table
from studies.common.study import MADE, TRIALS, Goal, Picture, Report, Severity, Study, Verdict, show
from studies.faults.kills import COMMANDS, answers_beside_another_version, kill_and_resume
from studies.faults.surroundings import (
    FULL,
    KINDS,
    SLIPS,
    SURROUNDINGS,
    Spoilt,
    answer_amid,
    answer_to,
    answer_to_unit,
    can_fill_a_disk,
    spoilt,
)
from studies.truth.bodies import SERVICER3
from studies.truth.mujoco import Manoeuvres, write_study

Task = Mapping[str, Any]  # what is tried, and how often


def tasks(full: bool) -> list[Task]:
    """Return the trials; the small study kills only a campaign."""
    spoiling = [{"spoil": 100 + number, "changes": 250 if full else 50} for number in range(4 if full else 1)]
    killing = [{"kill": name, "kills": 8 if name == "campaign" else 3} for name in COMMANDS]
    if not full:
        return [*spoiling, killing[0]]
    around = [{"around": title} for title in SURROUNDINGS if title != FULL or can_fill_a_disk()]
    return [*spoiling, *killing, *({"unit": slip} for slip in SLIPS), *around, {"cache": "another version"}]


def attempt(task: Task, rng: np.random.Generator) -> dict[str, Any]:
    """Run one trial in a separate folder."""
    keep_compiled()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        manoeuvres = Manoeuvres(count=1, duration=40.0)
        study = write_study(folder / "made", SERVICER3, np.random.default_rng(3), manoeuvres=manoeuvres).file
        if "spoil" in task:
            return _spoil(task["spoil"], task["changes"], study, folder / "spoilt")
        if "unit" in task:
            noticed, said = answer_to_unit(study, task["unit"], folder)
            return {"noticed": noticed, "said": said}
        if "around" in task:
            clear, said = answer_amid(study, task["around"], folder)
            return {"refused": clear, "said": said}
        if "cache" in task:
            return answers_beside_another_version(study, folder)
        return asdict(kill_and_resume(task["kill"], study.parent, rng, task["kills"]))


def _spoil(seed: int, changes: int, study: Path, folder: Path) -> dict[str, Any]:
    """Spoil a file so many times, and return the numbers of answers by kind of change and what was wrong with any."""
    answers: dict[str, Counter[str]] = {kind: Counter() for kind in KINDS}
    faults: list[str] = []

    @seeded(seed)
    @settings(
        max_examples=changes,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(spoilt())
    def spoil(change: Spoilt) -> None:
        answer = answer_to(study, change, folder)
        answers[change.kind]["faulty" if answer.fault else "accepted" if answer.accepted else "refused"] += 1
        if answer.fault:
            faults.append(f"{change}: {answer.fault}")

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        spoil()
    return {"answers": {kind: dict(counts) for kind, counts in answers.items()}, "faults": faults}


# what was done to a file, by the kind of its change
CHANGES = dict(
    zip(
        KINDS,
        ("value replaced", "text inserted", "file truncated", "line dropped", "line repeated", "byte changed"),
        strict=True,
    )
)

# titles of the outcomes by their keys
OUTCOMES = {"refused": "refused with a clear message", "accepted": "accepted", "faulty": "unclear answer"}

Made = Mapping[str, Any]  # a task with its result
LONGEST = 300  # characters of a quoted message
STATED = re.compile(r"\[[\w.]+\] (unit|time_unit) = ")  # lines of a study in a message that put a unit right


@dataclass(frozen=True)
class Result:
    """Tasks with their results, and the messages of failed trials."""

    made: Sequence[Made]
    failures: Sequence[str]

    def by(self, key: str) -> dict[str, Made]:
        """Return the tasks of one kind ("unit", "kill", "around") by what they try."""
        return {task[key]: task for task in self.made if key in task}

    @property
    def spoilt(self) -> list[Made]:
        """Tasks that spoil files."""
        return [task for task in self.made if "spoil" in task]

    @cached_property
    def answers(self) -> dict[str, dict[str, int]]:
        """Numbers of spoilt files by kind of change and outcome."""
        return {
            kind: {key: sum(task["answers"].get(kind, {}).get(key, 0) for task in self.spoilt) for key in OUTCOMES}
            for kind in KINDS
        }

    @property
    def numbers(self) -> dict[str, int]:
        """Numbers of spoilt files by outcome."""
        return {key: sum(counts[key] for counts in self.answers.values()) for key in OUTCOMES}

    @property
    def kills(self) -> int:
        """Number of kills that found a command running."""
        return sum(task["kills"] for task in self.by("kill").values())


def run(
    *,
    full: bool = False,
    seed: int = 1,
    trials: Path | None = None,
    workers: Workers = 1,
    made: bool = False,
    progress: Callable[[str], None] = show,
) -> Result:
    """Make the trials that the store does not hold yet, or only read those ``made`` so far."""
    if made and trials is not None:
        lines = read_store(trials)
        kept = [{**line["task"], **line["result"]} for line in lines if "result" in line]
        return Result(kept, [line["error"] for line in lines if "error" in line])
    planned = tasks(full)
    outcomes = run_trials(attempt, planned, trials, seed=seed, workers=workers, progress=progress)
    done = [{**task, **answer} for task, answer in zip(planned, outcomes.results, strict=True) if answer is not None]
    return Result(done, list(outcomes.failures.values()))


def _report(result: Result) -> Report[Result]:
    planned, done = len(tasks(full=True)), len(result.made) + len(result.failures)
    numbers, units, killed = result.numbers, result.by("unit"), result.by("kill")
    caption = "Outcome of the corrupted files, by kind of change."
    return Report(
        title="Robustness",
        subtitle="Corrupted files, wrong units, interruptions, full disks and faulty plug-ins",
        question="How do commands respond to corrupted files, wrong units and kills at random times?",
        answer=f"{numbers['faulty']} of {counted(sum(numbers.values()), 'corrupted file')} got an unclear answer. "
        f"{numbers['refused']} were refused with a clear message and {numbers['accepted']} were accepted; "
        f"{sum(task['noticed'] for task in units.values())} of {counted(len(units), 'wrong unit')} "
        f"{'was' if len(units) == 1 else 'were'} noticed; after {counted(result.kills, 'kill')} "
        f"{sum(task['same'] for task in killed.values())} of {counted(len(killed), 'command')} gave the same result as "
        "an uninterrupted run.",
        goals=_goals(result),
        valid="the files are those of a robot with three joints and one recording of 40 s"
        + ("." if done >= planned else f"; {done} of the {planned} trials of the full study were run."),
        full=done >= planned,
        figure=Picture(answer_figure(result.answers), caption) if result.spoilt else None,
        sections=[_failures, _kills, _said, _conditions],
        credit=f"With {', '.join(f'{name} {version(name)}' for name in ('hypothesis', 'jax', 'numpy'))}.",
    )


def _failures(document: Document, result: Result) -> None:
    document.section("What went wrong")
    wrong = [text for task in result.spoilt for text in task["faults"]]
    for key, good in (("unit", "noticed"), ("around", "refused")):
        wrong += [f"{title}: {i['said'] or f'not {good}'}" for title, i in result.by(key).items() if not i[good]]
    wrong += [f"{name} after kills: {task['message']}" for name, task in result.by("kill").items() if not task["same"]]
    wrong += [f"A trial failed: {text}" for text in result.failures]
    document.items([_short(text) for text in wrong])
    if not wrong:
        document.paragraph("Nothing went wrong in this run.")


def _kills(document: Document, result: Result) -> None:
    document.section("Kills")
    document.paragraph(
        "Each command first runs without interruption. It is then killed with SIGKILL at times drawn uniformly over "
        "that duration, and called again until it finishes. The comparison covers the names of all files, tables, and "
        "JSON without times. Identify, design, loop and campaigns resume from stored results; diagnose stores nothing "
        "and starts again."
    )
    rows = [
        [name, str(task["kills"]), str(len(task["half_written"])), "yes" if task["same"] else "no"]
        for name, task in result.by("kill").items()
    ]
    if rows:
        header = ["command", "kills while running", "partly written files", "same result"]
        add_number_table(document, header, rows, "Kills of each command and their effect on its results.")


def _said(document: Document, result: Result) -> None:
    for key, good, section, title, caption in (
        ("unit", "noticed", "Wrong units", "unit", "Messages of the command check for wrong units."),
        ("around", "refused", "Full disk, locked folders and faulty plug-ins", "fault", "Messages of commands."),
    ):
        said = [[name, "yes" if i[good] else "no", _short(i["said"])] for name, i in result.by(key).items()]
        if said:
            document.section(section)
            document.table([title, good, "message"], said, caption)


def _conditions(document: Document, result: Result) -> None:
    document.section("Conditions")
    document.paragraph(
        "MuJoCo generates the files. Hypothesis draws the corruption of a file: one value is replaced, text is "
        "inserted, the end is cut off, a line is dropped or repeated, or a byte is changed. The file counts as refused "
        "if the exit status is 2, one message begins with Error, nothing is written and Python gives no warning. It "
        "counts as accepted if it can still be read and every value is permitted, such as a changed digit; the trial "
        "ends after reading, so that later checks of the data are not tested. A "
        "wrong unit counts as noticed if check refuses it in this way or names it as a convention. The "
        "full disk has a capacity of 16 kB. The other version, whose cache an identification reads, computes a "
        "gravity-gradient torque a hundred times as large."
    )


def _goals(result: Result) -> list[Goal]:
    numbers, units, killed = result.numbers, result.by("unit"), result.by("kill")
    total, kills = sum(numbers.values()), result.kills
    broken = [name for task in killed.values() for name in task["half_written"]]
    noticed = [task for task in units.values() if task["noticed"]]
    stated = sum(bool(STATED.search(task["said"])) for task in noticed)
    goals = (
        (
            "No unclear answer to a corrupted file",
            f"{numbers['faulty']} of {total}; {numbers['refused']} refused, {numbers['accepted']} accepted",
            not numbers["faulty"],
            total > 0,
        ),
        (
            "No wrong unit passes unnoticed",
            f"{len(noticed)} of {len(units)} refused or named; {stated} of the messages give the line to add to the "
            "study file",
            len(noticed) == len(units),
            len(units) == len(SLIPS),
        ),
        (
            "No partly written file after a kill",
            f"{counted(len(broken), 'file')} after {counted(kills, 'kill')}{_at_most(len(broken), kills)}",
            not broken,
            kills > 0,
        ),
    )
    return [
        *(
            Goal(goal, reached, Verdict.of(passed if tested else None), Severity.HIGH)
            for goal, reached, passed, tested in goals
        ),
        _resumed(killed),
        _refused(result.by("around")),
        _unmoved(next((task for task in result.made if "cache" in task), None)),
    ]


def _resumed(killed: Mapping[str, Made]) -> Goal:
    """Return the goal on what commands that are killed and resumed write in the end."""
    text = f"Same result after kills: {joined(COMMANDS)}"
    told, verdicts = [], []
    for name in COMMANDS:
        task = killed.get(name, {"kills": 0, "same": False})
        verdicts.append(Verdict.of(task["same"] if task["kills"] else None))
        other = ", other result" if verdicts[-1] is Verdict.FAIL else ""
        told.append(f"{name} {counted(task['kills'], 'kill')}{other}")
    return Goal(text, ", ".join(told), Verdict.all_of(verdicts), Severity.HIGH)


def _refused(around: Mapping[str, Made]) -> Goal:
    """Return the goal on the errors for faults around a run."""
    text = f"Each of these gives exactly one clear error message: {joined(SURROUNDINGS)}"
    verdicts = {title: Verdict.of(around[title]["refused"] if title in around else None) for title in SURROUNDINGS}
    count = list(verdicts.values()).count(Verdict.PASS)
    parts = [f"{count} of {len(verdicts)}"] + [
        f"{words} {joined(titles)}"
        for words, verdict in (
            ("not refused:", Verdict.FAIL),
            ("not run (see tests/test_faults.py):", Verdict.NOT_TESTED),
        )
        if (titles := [title for title, made in verdicts.items() if made is verdict])
    ]
    return Goal(text, "; ".join(parts), Verdict.all_of(verdicts.values()), Severity.MEDIUM)


def _unmoved(task: Made | None) -> Goal:
    """Return the goal on a cache that another version filled."""
    text = "A cache written by another version is not used"
    if task is None:
        reached = "not run; for a damaged cache file see tests/test_kept_jit.py"
        return Goal(text, reached, Verdict.NOT_TESTED, Severity.HIGH)
    if not task["differs"]:
        reached = "not decisive: the other version gives the same result"
        return Goal(text, reached, Verdict.NOT_TESTED, Severity.HIGH)
    same = "the same result as" if task["same"] else "a result that differs from that"
    reached = f"{same} with an empty cache; the other version itself gives a different one, so the test can fail"
    return Goal(text, reached, Verdict.of(task["same"]), Severity.HIGH)


def _at_most(count: int, total: int) -> str:
    """Return how often something may still happen that never did, for a goal; nothing where it did."""
    if count or not total:
        return ""
    return f" (with 95 % confidence in at most {format_percent(1.0 - 0.05 ** (1.0 / total), 2)} of kills)"


def _short(said: str) -> str:
    """Return a message, shortened, without the folders of files and what a command states before and after it."""
    message = re.sub(r"^.*? unknowns\. | Write this into the study.*$", "", re.sub(r"/\S*/", "", said))
    return textwrap.shorten(message, LONGEST, placeholder=" …")


@styled
def answer_figure(answers: Mapping[str, Mapping[str, int]]) -> Figure:
    """Draw the numbers of files by outcome, one bar for each kind of change."""
    figure = wide_figure(0.75 + 0.2 * len(answers))
    axes = figure.subplots()
    place, left = np.arange(len(answers)), np.zeros(len(answers))
    for (key, title), colour in zip(OUTCOMES.items(), COLOURS[2:5], strict=True):
        counts = np.array([of_kind.get(key, 0) for of_kind in answers.values()])
        if not counts.any():  # a legend would promise bars that are not there
            continue
        axes.barh(place, counts, 0.65, left=left, color=colour, label=title)
        left = left + counts
    axes.set(xlabel="number of files", ylim=(len(answers) - 0.5, -0.5))
    axes.set_yticks(place, [CHANGES[kind] for kind in answers])
    shared_legend(figure, axes, len(OUTCOMES))
    return figure


STUDY = Study(
    "faults",
    "Test how commands respond to corrupted files, wrong units and kills at random times.",
    run=run,
    report=_report,
    full="1,000 corrupted files, ten wrong units, faults around a run, and kills of every long-running command",
    seed=1,
    extra={**TRIALS, **MADE},
)
