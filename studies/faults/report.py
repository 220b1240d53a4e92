"""Report of the faults."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bayesid._io.words import counted
from bayesid.report import Document
from bayesid.report.figures.figure_style import COLOURS, shared_legend, styled, wide_figure
from studies.common.monte_carlo import read_store, run_trials
from studies.common.provenance import study_origin
from studies.common.report_parts import add_number_table
from studies.common.study import TRIALS, Command, Goal, Verdict
from studies.common.template import Summary, add_first_page, write_study
from studies.faults.fuzz import KINDS, SLIPS
from studies.faults.kills import COMMANDS
from studies.faults.surroundings import SURROUNDINGS
from studies.faults.trials import attempt, tasks

OUTCOMES = {"refused": "refused with a clear message", "accepted": "accepted", "faulty": "unclear answer"}
"""Titles of the outcomes by their keys."""


@styled
def answer_figure(answers: Mapping[str, Mapping[str, int]]) -> Figure:
    """Draw the numbers of files by outcome, one bar for each kind of change."""
    figure = wide_figure(0.75 + 0.2 * len(answers))
    axes = figure.subplots()
    place, left = np.arange(len(answers)), np.zeros(len(answers))
    for (key, title), colour in zip(OUTCOMES.items(), COLOURS[2:5], strict=True):
        counts = np.array([found.get(key, 0) for found in answers.values()])
        axes.barh(place, counts, 0.65, left=left, color=colour, label=title)
        left = left + counts
    axes.set(xlabel="number of files", ylim=(len(answers) - 0.5, -0.5))
    axes.set_yticks(place, list(answers))
    shared_legend(figure, axes, len(OUTCOMES))
    return figure


Made = Mapping[str, Any]  # A task with its result
NAMED = re.compile(r"\.(csv|toml|urdf): ")  # file in a message, with what follows on the place in it

COMMAND = Command(
    "faults",
    "What commands make of spoilt files, mistaken units and kills at random moments.",
    full="1,000 spoilt files, ten mistaken units, faults around a run, and kills of every command that takes long",
    seed=1,
    extra={**TRIALS, "--made": {"action": "store_true", "help": "report the trials made so far, make no more"}},
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    options = COMMAND.parse(arguments)
    if options.made:
        lines = read_store(options.trials)
        made = [{**line["task"], **line["result"]} for line in lines if "result" in line]
        failures = [line["error"] for line in lines if "error" in line]
        write_report(made, failures, options.output, study_origin("faults", options))
        return
    planned = tasks(options.full)
    outcomes = run_trials(
        attempt,
        planned,
        options.trials,
        seed=options.seed,
        workers=options.workers,
        progress=lambda text: print(text, file=sys.stderr),
    )
    made = [{**task, **result} for task, result in zip(planned, outcomes.results, strict=True) if result is not None]
    write_report(made, list(outcomes.failures.values()), options.output, study_origin("faults", options))
    print(f"Wrote {options.output}.")


def write_report(made: Sequence[Made], failures: Sequence[str], file: Path, origin: str | None = None) -> None:
    """Write the report as PDF, with its summary beside it.

    Parameters
    ----------
    made : sequence of mappings
        Tasks with their results.
    failures : sequence of str
        Messages of trials that failed themselves.
    file : Path
    origin : str, optional
        Where the report comes from.
    """
    spoilt = [item for item in made if "spoil" in item]
    units = {item["unit"]: item for item in made if "unit" in item}
    killed = {item["kill"]: item for item in made if "kill" in item}
    around = {item["around"]: item for item in made if "around" in item}
    cache = next((item for item in made if "cache" in item), None)
    answers = {
        kind: {key: sum(item["answers"].get(kind, {}).get(key, 0) for item in spoilt) for key in OUTCOMES}
        for kind in KINDS
    }
    numbers = {key: sum(counts[key] for counts in answers.values()) for key in OUTCOMES}
    document = Document("Faults", "Spoilt files, mistaken units, kills at random moments")
    planned, kills = len(tasks(full=True)), sum(item["kills"] for item in killed.values())
    done = len(made) + len(failures)
    summary = Summary(
        question="What do commands make of spoilt files, mistaken units and kills at random moments?",
        answer=f"Of {sum(numbers.values())} spoilt files {numbers['faulty']} got an unclear answer, "
        f"{numbers['refused']} were refused with a clear message and {numbers['accepted']} were accepted; "
        f"{sum(item['refused'] for item in units.values())} of {counted(len(units), 'mistaken unit')} "
        f"{'was' if len(units) == 1 else 'were'} refused; after {counted(kills, 'kill')} "
        f"{sum(item['same'] for item in killed.values())} of {counted(len(killed), 'command')} gave the answer of a "
        "run left alone.",
        goals=tuple(_goals(numbers, units, killed, around, cache)),
        valid=f"files are those of a robot with three joints and one recording of 40 s; {done} of the {planned} trials "
        "of the full study were made.",
        full=done >= planned,
    )
    figure = answer_figure(answers) if spoilt else None
    add_first_page(document, summary, figure, "What became of the spoilt files, by kind of change.")
    document.section("What went wrong")
    wrong = [text for item in spoilt for text in item["faults"]]
    wrong += [f"{unit}: {item['said'] or 'not refused'}" for unit, item in units.items() if not item["refused"]]
    wrong += [f"{title}: {item['said'] or 'not refused'}" for title, item in around.items() if not item["refused"]]
    wrong += [f"{name} after kills: {item['message']}" for name, item in killed.items() if not item["same"]]
    wrong += [f"A trial failed: {text}" for text in failures]
    document.items([_short(text) for text in wrong])
    if not wrong:
        document.paragraph("Nothing in this run.")
    document.section("Kills")
    document.paragraph(
        "A command is run alone, then killed with SIGKILL at moments drawn uniformly over the time that it took, and "
        "called again until it ends. Compared are the names of all files, tables and JSON without times. Identify, "
        "design, loop and campaigns go on from what they kept; diagnose keeps nothing and starts anew."
    )
    rows = [
        [name, str(item["kills"]), str(len(item["half_written"])), "yes" if item["same"] else "no"]
        for name, item in killed.items()
    ]
    if rows:
        header = ["command", "kills while it ran", "files half written", "same answer"]
        add_number_table(document, header, rows, "Kills of every command, and what became of its results.")
    if units:
        document.section("Mistaken units")
        said = [[unit, "yes" if item["refused"] else "no", _short(item["said"])] for unit, item in units.items()]
        document.table(
            ["unit", "refused", "what the command says"], said, "What the command check says of mistaken units."
        )
    if around:
        document.section("Faults around a run")
        said = [[title, "yes" if item["refused"] else "no", _short(item["said"])] for title, item in around.items()]
        document.table(["fault", "refused", "what the command says"], said, "What commands say of faults around a run.")
    document.section("Conditions")
    document.paragraph(
        "MuJoCo makes the files. A spoilt file has one value replaced, text inserted, the end cut off, a line dropped "
        "or repeated, or a byte changed, drawn by Hypothesis. It counts as refused where the exit status is 2, one "
        "message begins with Error, nothing is written and Python warns of nothing. The full disk holds 16 kB. The "
        "other version, whose cache an identification finds, computes a torque of the gravity gradient a hundred times "
        "as large."
    )
    packages = ", ".join(f"{name} {version(name)}" for name in ("hypothesis", "jax", "numpy"))
    write_study(document, summary, file, None if origin is None else f"{origin} With {packages}.")


def _refused(title: str, item: Made | None) -> Goal:
    """Return the goal on one fault around a run."""
    text = f"{title}: one clear error"
    if item is None:
        return Goal(text, "not tried; see tests/test_faults.py", Verdict.NOT_TESTED)
    return Goal(text, "refused" if item["refused"] else "not refused", Verdict.of(item["refused"]))


def _unmoved(item: Made | None) -> Goal:
    """Return the goal on a cache that another version filled."""
    text = "a cache of another version: no effect"
    if item is None:
        return Goal(text, "not tried; a damaged file of it: tests/test_kept_jit.py", Verdict.NOT_TESTED)
    if not item["differs"]:
        return Goal(text, "the other version itself gives the same answer", Verdict.NOT_TESTED)
    same = "same answer as" if item["same"] else "another answer than"
    return Goal(text, f"{same} with an empty cache; the other version answers otherwise", Verdict.of(item["same"]))


def _short(said: str) -> str:
    """Return the beginning of a message, without the folders of files."""
    return re.sub(r"/\S*/", "", said)[:300]


def _goals(
    numbers: Mapping[str, int],
    units: Mapping[str, Made],
    killed: Mapping[str, Made],
    around: Mapping[str, Made],
    cache: Made | None,
) -> list[Goal]:
    """Return each goal, what was reached, and whether that passes."""
    total, kills = sum(numbers.values()), sum(item["kills"] for item in killed.values())
    broken = [name for item in killed.values() for name in item["half_written"]]
    refused = sum(item["refused"] for item in units.values())
    named = sum(item["refused"] and bool(NAMED.search(item["said"])) for item in units.values())
    answers = {name: killed.get(name, {"kills": 0, "same": False}) for name in COMMANDS}
    goals = [
        (
            "No unclear answer to a spoilt file",
            f"{numbers['faulty']} of {total}; {numbers['refused']} refused, {numbers['accepted']} accepted",
            not numbers["faulty"],
            total > 0,
        ),
        (
            "No wrong unit in silence",
            f"{refused} of {len(units)} refused, {named} with file and place",
            refused == len(units),
            len(units) == len(SLIPS),
        ),
        (
            "Nothing half written after a kill",
            f"{counted(len(broken), 'file')} after {counted(kills, 'kill')}",
            not broken,
            kills > 0,
        ),
        *(
            (f"{name}: same answer after kills", counted(item["kills"], "kill"), item["same"], item["kills"] > 0)
            for name, item in answers.items()
        ),
    ]
    return [
        *(Goal(goal, reached, Verdict.of(passed if tested else None)) for goal, reached, passed, tested in goals),
        *(_refused(title, around.get(title)) for title in SURROUNDINGS),
        _unmoved(cache),
    ]
