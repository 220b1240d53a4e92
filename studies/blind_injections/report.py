"""Report of the blind injections."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from bayesid._io.files import write_json
from bayesid._io.words import counted, joined
from bayesid.report import Document
from bayesid.report.figures.figure_style import AFTER, BEFORE, TRUTH, styled, wide_figure
from bayesid.report.numbers import NO_VALUE, format_number, format_probability
from studies.blind_injections import goals, rows
from studies.blind_injections.goals import SURE, share_text, surely_misnamed
from studies.blind_injections.limits import DRAWS
from studies.blind_injections.rows import case_words
from studies.blind_injections.trials import ALIKE, Trial, plan, read
from studies.blind_injections.trials import run as make_trials
from studies.common.code_version import CodeVersion
from studies.common.monte_carlo import Workers
from studies.common.report_parts import add_number_table
from studies.common.study import MADE, WORKERS, CsvTable, Picture, Report, Setup, Study, Verdict, show

SCORES = ["stated of", "statements", "Brier score", "log score", "mean stated", "share true"]
SHOWN = 2  # trials of a case that were not answered rightly, from which the report lists its answers
ASTRAY = 10.0  # stated standard deviations from which a parameter of the base is said to be astray
SUREST = 0.99  # stated probability from which wrong verdicts are counted apart
TICKS = (3, 5, 7, 10, 20, 50, 100)  # ticks of the signal-to-noise ratio in the figure


class Campaign(NamedTuple):
    """Trials that were made, one at least, and the number of trials of the whole campaign."""

    trials: Sequence[Trial]
    planned: int


def run(
    *,
    trials: Path,
    full: bool = False,
    made: bool = False,
    record: Path | None = None,
    workers: Workers = 1,
    progress: Callable[[str], None] = show,
) -> Campaign:
    """Make the trials that the store does not hold yet, or only read those ``made`` so far; keep their ``record``."""
    plans = plan(full)
    done = read(trials) if made else make_trials(plans, trials, progress, workers)
    if not done:
        raise ValueError(f"{trials} contains no trials; omit --made to make some")
    if record is not None:
        releases = dict.fromkeys(version.release for version in CodeVersion.of_trials(trials))
        write_json(record, {"releases": list(releases), **goals.record_of(done)})
    return Campaign(done, len(plans))


def _report(campaign: Campaign) -> Report[Campaign]:
    trials, planned = campaign
    judged = goals.goals_of(trials)
    nulls = [trial for trial in trials if trial.kind == "adequate"]
    outside = [trial for trial in trials if trial.kind == "unknown"]
    sure = [trial for trial in trials if trial.kind == "effect" and (trial.probability or 0.0) >= SURE]
    verdicts = [goal.verdict for goal in judged]
    right, alarmed = sum(trial.holds for trial in sure), sum(trial.alarmed for trial in nulls)
    whole = sum(trial.named_rightly for trial in sure)
    interval = share_text(right, len(sure)).partition("(")[2].rstrip(")")
    misnamed = [trial for trial in outside if surely_misnamed(trial)]
    in_part = sum(trial.remainder == "present" for trial in misnamed)
    answer = (
        f"With a hidden cause of the catalogue, {right} of {len(sure)} verdicts stated at {SURE:g} or more name no "
        f"false cause. The 95 % interval is {interval}; {whole} of them name all hidden causes. In "
        f"{share_text(len(misnamed), len(outside))} trials with an effect outside the catalogue a cause of the "
        "catalogue was wrongly named with such a probability"
        + (f", in {in_part} of them as a part of the misfit next to something unnamed" if in_part else "")
        + f"; {share_text(alarmed, len(nulls))} trials with nothing hidden raised an alarm."
    )
    if len(trials) < planned:
        answer += (
            f" With {len(trials):,} of {planned:,} planned trials, {verdicts.count(Verdict.OPEN)} of {len(judged)} "
            "goals are undecided."
        )
    seconds = np.median([trial.seconds["total"] for trial in trials])
    return Report(
        title="Blind injections",
        subtitle="Verdicts of the diagnosis on hidden causes",
        question="How often does the diagnosis name a hidden cause, correctly or wrongly, and how often does it raise "
        "an alarm with nothing hidden?",
        answer=answer,
        goals=judged,
        valid="a base carries an arm of three to five joints whose links are known exactly or to 2 %, "
        "and noise is white and as declared unless a noise fault is hidden.",
        full=len(trials) >= planned,
        figure=Picture(
            _figure([trial for trial in trials if trial.kind == "effect"]),
            "Outcomes of the trials with a hidden cause of the catalogue, by its signal-to-noise ratio. Faults that "
            "only change the noise have no such ratio and are omitted. In the set, not alone: the hidden causes are "
            "one of several reported explanations, or are named with another.",
        ),
        note="Brackets contain exact 95 % intervals: Clopper and Pearson for shares, order statistics for medians; ± "
        "is one standard error, and the verdict takes two on either side. NOT DECIDED: the interval has values on both "
        "sides of the goal, because too few trials were made. σ of a cause: the root of the noncentrality of its "
        "signal without the part that the model's unknowns absorb. σ of an effect outside the catalogue: the same for "
        "the part that the most probable set of known causes does not absorb either; only this part could reveal that "
        "the named causes are wrong.",
        setup=_setup(trials, planned),
        sections=[_failures, _evidence, _parting, _calibration, _answers],
        tables=_tables(trials),
        beside="Tables with this report: every trial with its seed and strength ({0}), the answers by case in words "
        f"({{1}}) and as a matrix of counts ({{2}}), and Brier and logarithmic scores ({{3}}). The median time of a "
        f"trial was {seconds:.0f} s.",
    )


def _setup(trials: Sequence[Trial], planned: int) -> Setup:
    counts = [sum(trial.kind == kind for trial in trials) for kind in ("effect", "unknown", "adequate")]
    seeds = [trial.seed for trial in trials]
    wheels, fast = _made_in(trials, "wheel1", "wheels", "tachometers"), _made_in(trials, "1 kHz")
    return Setup(
        robot="Three robots of three to five joints, one with prismatic joints and branches, simulated in MuJoCo; "
        "its bodies, springs, fields and sensor faults share no code with the package. In "
        f"{len(goals.in_basilisk(trials))} trials two of them fly in Basilisk, where a soft servo drives the joints; "
        "hidden are Basilisk's models of a wheel, leak, slosh or panel, or nothing."
        + (f" In {wheels} trials it is a satellite of wheels without an arm." if wheels else ""),
        manoeuvre="Three recordings of 120 to 170 s each, a single one in some trials"
        + (", two of 70 s at 1 kHz." if fast else "."),
        sensors=f"At 2 Hz, noise per sample: rate {format_number(1e-5)} rad/s, accelerometer {format_number(1e-5)} "
        f"m/s², encoders {format_number(1e-6)} rad."
        + (f" In {fast} trials the same noise per root hertz at 1 kHz, encoders at 500 Hz." if fast else ""),
        known="Robot, orbit, sensors and attitude at the start, as the files state them; links exactly or with a "
        "relative uncertainty of 2 %.",
        unknown="The base's ten parameters, the initial rates, and the hidden cause. The diagnosis reads only the "
        "files.",
        replicates=f"{len(trials):,} of {planned:,} planned trials, in random order: {counts[0]:,} with hidden causes "
        f"of the catalogue, {counts[1]} with a cause outside it, {counts[2]} with nothing hidden. Seeds {min(seeds)} "
        f"to {max(seeds)}, different from those of the tests.",
    )


def _made_in(trials: Sequence[Trial], *ends: str) -> int:
    """Return how many trials are of cases whose names end so."""
    return sum(trial.case.endswith(ends) for trial in trials)


def _failure(alike: Sequence[Trial]) -> list[str]:
    """Return the row of trials that have the same case and the same answer."""
    first = alike[0]
    stated = [trial.probability for trial in alike if trial.probability is not None]
    ratios = [trial.signal_to_noise for trial in alike if trial.signal_to_noise is not None]
    return [
        _hidden(first),
        _said(first),
        str(len(alike)),
        format_probability(max(stated)) if stated else NO_VALUE,
        f"{max(ratios):.1f}" if ratios else NO_VALUE,
    ]


def _failures(document: Document, campaign: Campaign) -> None:
    document.section("Failures")
    trials = campaign.trials
    wrong = [trial for trial in trials if trial.misnamed or (trial.kind == "adequate" and trial.alarmed)]
    alike: dict[tuple[str, str], list[Trial]] = {}
    for trial in wrong:
        alike.setdefault((trial.case, _said(trial)), []).append(trial)
    texts = []
    if wrong:
        order = ("effect", "unknown", "adequate")
        groups = sorted(alike.values(), key=lambda group: (order.index(group[0].kind), group[0].case, -len(group)))
        add_number_table(
            document,
            ["hidden", "reported", "trials", "largest probability", "largest σ"],
            [_failure(group) for group in groups],
            "All trials in which something was wrongly named, or an alarm was raised with nothing hidden, by what was "
            "hidden and what was reported; the seeds are in the table of trials.",
            words=2,
        )
    else:
        texts.append("No trial was misnamed, and no trial with nothing hidden raised an alarm.")
    missed = [trial for trial in trials if trial.kind != "adequate" and not trial.alarmed]
    if missed:
        counts = Counter(map(_hidden, missed))
        named = joined([case if count == 1 else f"{case} ({count})" for case, count in sorted(counts.items())])
        largest = max(trial.signal_to_noise or 0.0 for trial in missed)
        texts.append(f"No alarm was raised for {named}; the largest of these effects has {largest:.1f} σ.")
    framed = [t for t in trials if t.kind == "unknown" and t.true_frame is not None and t.status == "unknown"]
    if framed:
        right = sum(t.frame == t.true_frame for t in framed)
        wrongly = sum(t.frame not in (None, t.true_frame) for t in framed)
        median = np.median([trial.correlation or 0.0 for trial in framed])
        texts.append(
            "Axes (base, orbit or inertial) in which a torque from outside the catalogue is constant: "
            f"{share_text(right, len(framed))} determined correctly, {wrongly} wrongly, "
            f"{len(framed) - right - wrongly} not determined. Over all {len(framed)} such torques that were reported "
            f"as unknown, the correlation of the reconstructed with the true one has a median of {median:.2f} and is "
            f"{min(trial.correlation or 0.0 for trial in framed):.2f} in the worst case."
        )
    judged = [trial for trial in trials if trial.body_errors and (trial.named_rightly or trial.kind == "adequate")]
    astray = [trial for trial in judged if np.abs(trial.body_errors).max() > ASTRAY]
    if astray:
        others = np.concatenate([trial.body_errors for trial in judged if trial not in astray])
        texts.append(
            f"In {counted(len(astray), 'trial')} a parameter of the base is wrong by more than {ASTRAY:g} stated "
            f"standard deviations: {joined(sorted(map(_hidden, astray)))}. The errors of the base's parameters in all "
            f"other trials have an rms of {np.sqrt(np.mean(others**2)):.3f} stated standard deviations."
        )
    document.items(texts)


def _hidden(trial: Trial) -> str:
    if trial.kind == "adequate":
        return case_words(trial.case)
    outside = " (outside the catalogue)" if trial.kind == "unknown" else ""
    return trial.case.replace(", ", " + ") + outside


def _said(trial: Trial) -> str:
    return " + ".join(trial.causes) or trial.status


def _evidence(document: Document, campaign: Campaign) -> None:
    document.section("Verdicts by size of the hidden cause")
    add_number_table(
        document,
        [
            *("signal-to-noise", "trials", "alarm", "alarm, limit", "in the set"),
            *("named alone", "named alone, limit", "false cause", "in part"),
        ],
        rows.rates(campaign.trials),
        "Trials with a hidden cause of the catalogue, by its signal-to-noise ratio: the root of its noncentrality "
        "without the part that the model's unknowns absorb. The limits are the numbers expected from a test that knows "
        "which effect to look for (family-wise 1 %), and from the Bayes decision between all sets of causes on data of "
        f"the linear model, simulated {'once' if DRAWS == 1 else f'{DRAWS} times'} per trial. In the set: the hidden "
        "causes are among the reported explanations, alone or not. False cause: something that is not hidden is named. "
        "In part: only hidden causes are named, but not all of them, and no reported explanation has all. Names that "
        "describe the same change of the model, such as a payload and the inertia of its link, or the latencies of "
        "different sensors, count as the same cause.",
    )


def _parting(document: Document, campaign: Campaign) -> None:
    table = rows.parting(campaign.trials)
    if not table:
        return
    document.section("Causes that resemble each other")
    add_number_table(
        document,
        ["hidden", *ALIKE],
        table,
        "Signal-to-noise ratio from which the hidden cause and the one in the column can be distinguished in 95 % of "
        "all cases, if only these two are possible and both sizes are known: the median over the trials with the "
        "hidden cause. Never: one of the two imitates the other completely. Coloured noise changes no mean and has no "
        "such ratio; the table of answers contains what it was taken for.",
    )


def _calibration(document: Document, campaign: Campaign) -> None:
    trials = campaign.trials
    document.section("Calibration of stated probabilities and intervals")
    stated = rows.reliability(trials)
    if stated:
        add_number_table(
            document,
            ["stated probability", "trials", "mean stated", "correct", "share correct", "95 % interval"],
            stated,
            "Trials whose verdict names causes, by the probability stated for the named causes together. Correct: "
            "every named cause is hidden. Intervals are Wilson's. Frequency and size of the hidden causes follow the "
            f"plan and not the prior of the diagnosis. {_overconfident(trials)}".strip(),
        )
        document.figure(
            rows.reliability_figure(trials),
            "Share of verdicts whose named causes are all hidden, against the stated probability, with 95 % intervals "
            "(Wilson). On the grey line both agree.",
        )
    else:
        document.paragraph("No trial has named a cause.")
    add_number_table(
        document,
        ["errors in stated sd", "numbers", "mean", "rms", "within 1 sd", "within 2 sd"],
        rows.errors(trials),
        "Errors of the reported values in their stated standard deviations; ideal are mean 0, rms 1, 68 % and 95 %. "
        "The ten parameters of a base are correlated.",
    )


def _answers(document: Document, campaign: Campaign) -> None:
    """Add scores of the stated probabilities, and the answers of cases that were missed more than once."""
    trials = campaign.trials
    add_number_table(
        document,
        SCORES,
        [[row[0], *(cell.replace("-", "−") for cell in row[1:])] for row in rows.scores(trials)],
        "Scores of the stated probabilities with standard errors, over the trials: for each cause stated above 1 %, "
        "for a cause outside the catalogue, and for nothing. The log score is the mean natural logarithm of the "
        "probability given to what was true: 0 is perfect, and always stating one half gives −0.693. Every name of a "
        "class of equivalent causes counts as a statement with the probability of the class, also a name that is not "
        "what is hidden.",
    )
    amiss = Counter(trial.case for trial in trials if not _answered(trial))
    mixed = {case for case, count in amiss.items() if count >= SHOWN}
    others = len({trial.case for trial in trials} - mixed)
    document.section("Answers by hidden cause")
    if mixed:
        add_number_table(
            document,
            ["hidden", "answers, with the number of trials"],
            sorted(rows.confusion([trial for trial in trials if trial.case in mixed])),
            f"Answers for the {len(mixed)} cases with {SHOWN} or more trials that were not answered "
            f"exactly: all their trials, of any strength. Adequate: no alarm; unknown: a cause outside the catalogue; "
            "unresolved: no four explanations together reach 95 %; or N more: so many further explanations remain "
            f"possible. Those for the {others} other cases are in blind_injections-answers.csv.",
            words=2,
        )
    else:
        document.paragraph(f"In each of the {others} cases at most {SHOWN - 1} trial was not answered correctly.")


def _overconfident(trials: Sequence[Trial]) -> str:
    """Return how many of the wrong verdicts of the highest probabilities are on effects from outside the catalogue."""
    wrong = [t for t in trials if t.probability is not None and t.probability >= SUREST and not t.holds]
    outside = sum(trial.kind == "unknown" for trial in wrong)
    if not wrong:
        return ""
    return (
        f"Of the {len(wrong)} wrong verdicts stated at {SUREST:g} or more, {outside} are on effects outside the "
        "catalogue, for which the stated probabilities allow too little."
    )


def _answered(trial: Trial) -> bool:
    """Return whether exactly what is hidden is said: its causes, nothing, or something outside the catalogue."""
    if trial.kind == "effect":
        return trial.named_rightly
    return trial.status == trial.kind


def _tables(trials: Sequence[Trial]) -> list[CsvTable]:
    fields = {name: None for trial in trials for name in asdict(trial)}
    long = ("probabilities", "amplitude_errors", "body_errors", "seconds", "parting")
    kept = [name for name in fields if name not in long]
    every = [[*(_cell(getattr(trial, name)) for name in kept), f"{trial.seconds['total']:.1f}"] for trial in trials]
    return [
        CsvTable("trials", [*kept, "seconds"], every),
        CsvTable("answers", ["hidden", "said"], rows.confusion(trials)),
        CsvTable("confusion", *rows.confusion_matrix(trials)),
        CsvTable("scores", SCORES, rows.scores(trials)),
    ]


def _cell(value: object) -> object:
    """Return a value of a trial as a table has it: numbers to six digits, lists of causes joined."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, tuple):
        return "; ".join(part if isinstance(part, str) else " + ".join(part) for part in value)
    return value


# outcomes of a trial from the top of the figure down, each with its colour
OUTCOMES = {
    "named alone": AFTER,
    "in the set, not alone": "#56B4E9",
    "alarm, nothing named": TRUTH,
    "no alarm": "#000000",
    "misnamed": BEFORE,
}


@styled
def _figure(injected: Sequence[Trial]) -> Figure:
    figure = wide_figure(1.7)
    axes = figure.subplots()
    for row, (label, colour) in enumerate(reversed(OUTCOMES.items())):
        ratios = [t.signal_to_noise for t in injected if t.signal_to_noise is not None and _outcome(t) == label]
        axes.scatter(ratios, np.full(len(ratios), row), s=14, alpha=0.6, color=colour)
    axes.set_yticks(range(len(OUTCOMES)), list(reversed(OUTCOMES)))
    axes.set_ylim(-0.6, len(OUTCOMES) - 0.4)
    axes.set_xscale("log")
    axes.set_xticks(TICKS, [str(tick) for tick in TICKS])
    axes.minorticks_off()
    axes.set_xlabel("signal-to-noise ratio of the hidden cause")
    return figure


def _outcome(trial: Trial) -> str:
    if trial.misnamed:
        return "misnamed"
    if trial.named_rightly:
        return "named alone"
    if trial.in_set:
        return "in the set, not alone"
    return "alarm, nothing named" if trial.alarmed else "no alarm"


STUDY = Study(
    "blind_injections",
    "Count how often a hidden cause is named correctly or wrongly, and how often nothing hidden raises an alarm.",
    run=run,
    report=_report,
    full="hundreds of hidden causes and a thousand trials with nothing hidden (many hours)",
    extra={
        "--trials": {"type": Path, "default": Path("out/blind_injections.jsonl"), "help": "file of the trials"},
        **MADE,
        "--record": {"type": Path, "help": "file for the counts that come with the package"},
        **WORKERS,
    },
    inputs=lambda options: [options.trials],
)
