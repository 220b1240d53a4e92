"""The campaign on two trials: kept, resumed, reported."""

import csv
import json
from collections import Counter
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from bayesid.diagnosis import Status
from bayesid.report.numbers import NO_VALUE
from bayesid.report.verdict_record import Record, Share, record_sentence, shipped_record
from studies.blind_injections import STUDY, Campaign, Trial, plan, run
from studies.blind_injections.goals import (
    _correlation,
    _coverage,
    _least,
    _misnamed_outside,
    _most,
    _rate,
    _reliable,
    _scatter,
    goals_of,
    record_of,
    surely_misnamed,
)
from studies.blind_injections.rows import (
    confusion,
    confusion_matrix,
    parting,
    rates,
    reliability,
    scores,
    statements,
)
from studies.blind_injections.trials import CASES, Plan, read
from studies.common.code_version import CodeVersion
from studies.common.monte_carlo import read_store
from studies.common.study import Verdict
from studies.truth import hidden_causes
from studies.truth.basilisk.cases import BASILISK_CASES
from tests.report_rules import broken_rules

REPORTS = Path(__file__).resolve().parents[1] / "reports"

IN_BASILISK = {case.name for case in BASILISK_CASES}
"""Names of the cases that Basilisk flies."""

PLANS = [Plan("rate-bias", 5, 0.3), Plan("null, three joints", 5)]


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    return tmp_path_factory.mktemp("campaign") / "trials.jsonl"


@pytest.fixture(scope="module")
def trials(kept):
    return run(PLANS, kept)


@pytest.mark.usefixtures("slow")
def test_what_was_hidden_is_compared_with_what_is_said(trials):
    bias, null = trials
    assert bias.named_rightly
    assert bias.in_set
    assert not bias.misnamed
    assert bias.signal_to_noise > 5.0
    assert 0.9 < bias.detection <= 1.0
    assert 0.5 <= bias.naming <= 1.0
    assert len(bias.amplitude_errors) == 3
    assert max(map(abs, bias.amplitude_errors)) < 5.0
    assert bias.probability > 0.9
    assert bias.probabilities["rate-bias"] >= bias.probability - 1e-9
    assert min(bias.probabilities.values()) > 0.01
    assert bias.seconds["total"] > bias.seconds["verdict"] > 0.0
    assert not null.alarmed
    assert null.probability is None
    assert null.nothing > 0.5
    assert null.signal_to_noise is None
    assert len(null.body_errors) == 10


@pytest.mark.usefixtures("slow")
def test_a_run_goes_on_where_it_was_cut_off(trials, kept, monkeypatch):
    lines = kept.read_text(encoding="utf-8").splitlines()
    kept.write_text("\n".join([*lines[:2], lines[2][:40]]), encoding="utf-8")
    assert read(kept) == [trials[0]]
    made = []
    monkeypatch.setattr("studies.blind_injections.trials.make", lambda item: made.append(item) or trials[1])
    assert run(PLANS, kept) == trials
    assert made == PLANS[1:]
    assert [line["task"]["case"] for line in read_store(kept)] == [item.case for item in PLANS]


@pytest.mark.usefixtures("slow")
def test_wrong_names_are_counted(trials):
    bias = trials[0]
    wrong = replace(bias, causes=("rate-drift",), sets=(("rate-drift",),))
    rival = replace(bias, status="ambiguous", causes=("rate-drift",), sets=(("rate-drift",), ("rate-bias",)))
    assert wrong.misnamed
    assert not wrong.in_set
    assert rival.in_set
    assert not rival.named_rightly
    assert not rival.misnamed
    (row,) = rates([bias, wrong, rival])
    assert row[1] == "3"
    assert row[4:6] == ["2", "1"]
    assert row[7] == "1"
    assert confusion([bias, wrong, wrong])[0] == ["rate-bias", "rate-drift (2), rate-bias"]


def stated(probability: float | None, causes: tuple[str, ...], hidden: tuple[str, ...]) -> Trial:
    """A trial of which only what was hidden and what was said matters."""
    empty = dict.fromkeys(Trial.__dataclass_fields__)
    said = {"probability": probability, "causes": causes, "hidden": hidden, "accept": ()}
    return Trial(**{**empty, **said})


def test_the_ratios_from_which_causes_part_are_medians_over_the_trials_of_each():
    leaks = [
        replace(stated(None, (), ("thruster-leak",)), parting={"kicks": ratio, "thruster-pulses": None})
        for ratio in (4.0, 5.0, 9.0)
    ]
    backlash = replace(stated(None, (), ("joint-backlash:joint2",)), parting={"kicks": 7.25})
    none = replace(stated(None, (), ("rate-bias",)), parting={})
    assert parting([backlash, *leaks, none]) == [
        ["thruster-leak", NO_VALUE, "never", "5.0", *[NO_VALUE] * 4],
        ["joint-backlash", NO_VALUE, NO_VALUE, "7.2", *[NO_VALUE] * 4],
    ]


def test_stated_probabilities_are_compared_with_how_often_they_held():
    trials = [stated(0.92, ("rate-bias",), ("rate-bias",))] * 7
    trials += [stated(0.94, ("rate-bias",), ("rate-bias", "accel-bias"))]  # what is named holds, though not all of it
    trials += [stated(0.93, ("rate-drift",), ("rate-bias",)), stated(0.91, ("rate-bias", "rate-drift"), ("rate-bias",))]
    trials += [stated(1.0, ("rate-drift",), ("rate-drift",)), stated(None, (), ())]
    ninety, certain, every = reliability(trials)
    assert ninety == ["0.9 to 0.95", "10", "0.922", "8", "0.800", "0.490 to 0.943"]  # Wilson 1927
    assert certain[:5] == ["0.999 to 1", "1", "1.000", "1", "1.000"]
    assert every[:2] == ["all", "11"]
    assert reliability(trials[-1:]) == []


def test_every_stated_probability_has_its_range(committed):
    """Sums of probabilities that rounding lifts above one are taken as one."""
    assert max(trial.probability for trial in committed if trial.probability is not None) <= 1.0
    *rows, every = reliability(committed)
    for column in (1, 3):
        assert sum(int(row[column]) for row in rows) == int(every[column])
    header, rows = confusion_matrix(committed)
    assert {len(row) for row in rows} == {len(header)}
    assert sum(int(cell) for row in rows for cell in row[1:]) == len(committed)


def test_trials_that_state_no_probabilities_are_left_out(tmp_path):
    file = tmp_path / "trials.jsonl"
    file.write_text('{"seed": 0}\n{"trial": 0, "task": {}, "result": {"case": "rate-bias", "seconds": 3.0}}\n')
    assert read(file) == []
    with pytest.raises(ValueError, match="give another file"):
        run([], file)


def test_outside_the_catalogue_it_is_right_to_say_so():
    aside = stated(0.6, ("rate-bias",), ())
    ambiguous = replace(aside, kind="unknown", status="ambiguous", sets=(("rate-bias",), ("unknown",)))
    assert ambiguous.in_set
    assert not ambiguous.misnamed
    assert not ambiguous.holds
    assert replace(ambiguous, sets=(("rate-bias",),)).misnamed
    close = replace(ambiguous, status="explained", sets=(("rate-bias",),), accept=("rate-bias",))
    assert close.named_rightly
    assert close.holds


def test_a_cause_named_by_an_equivalent_that_the_verdict_gives_holds():
    """The stated probability is that of the class, so that no other member of it makes the verdict wrong."""
    said = stated(0.99, ("wheel-momentum", "thruster-leak"), ("wheel-momentum", "thruster-pulses"))
    alone = replace(said, kind="effect", status="explained", sets=(said.causes,))
    assert not alone.holds
    assert replace(alone, sets=(said.causes, ("wheel-momentum", "thruster-pulses"))).holds
    assert not replace(alone, sets=(said.causes, ("wheel-momentum", "thruster-pulses")), status="ambiguous").holds


def test_the_plans_hide_everything_and_nothing():
    for full in (False, True):
        plans = plan(full)
        assert len({item.seed for item in plans}) == len(plans)
        listed = len(hidden_causes.CASES) - len(hidden_causes.NOW_LISTED) + len(hidden_causes.FURTHER_CASES)
        assert len({item.case for item in plans}) == listed + len(BASILISK_CASES)
    kinds = Counter(CASES[item.case].status for item in plans)
    assert kinds == {"effect": 1000, "unknown": 400, "adequate": 1000}
    assert sum(item.case in IN_BASILISK for item in plans) == 150
    assert len({item.case for item in plans if CASES[item.case].status == "unknown"}) >= 10
    assert sum(item.case.endswith("1 kHz") for item in plans) >= 50
    assert {item.case for item in plans[:1200]} == {item.case for item in plans}


def test_trials_of_earlier_campaigns_are_still_read():
    lines = read_store(REPORTS / "blind_injections.jsonl.gz")
    assert {line["task"]["case"] for line in lines} <= CASES.keys()


def test_false_names_are_compared_with_what_was_stated_decade_by_decade():
    """By hand: of 100 verdicts with 0.95 five may be wrong and 20 may not; nor may one in ten of those with 0.9995."""
    right = replace(stated(0.95, ("rate-bias",), ("rate-bias",)), kind="effect")
    wrong = replace(right, hidden=("rate-drift",))
    assert _reliable([]).verdict is Verdict.NOT_TESTED
    assert _reliable([right] * 95 + [wrong] * 5).verdict is Verdict.PASS
    assert _reliable([right] * 80 + [wrong] * 20).verdict is Verdict.FAIL
    sure, mistaken = (replace(trial, probability=0.9995) for trial in (right, wrong))
    judged = _reliable([right] * 95 + [wrong] * 5 + [sure] * 9 + [mistaken])
    assert judged.verdict is Verdict.FAIL
    assert "0.9 to 0.99: 5 of 100, 5 expected" in judged.reached
    assert "0.999 to 1: 1 of 10, 5 × 10⁻³ expected" in judged.reached


def test_one_kind_of_outside_effect_must_not_be_misnamed_however_few_others_are():
    aside = replace(stated(None, (), ()), kind="unknown", status="unknown", case="frozen-gyro")
    said = {"causes": ("rate-bias",), "sets": (("rate-bias",),)}
    named = replace(aside, status="explained", probability=0.95, case="curved-gyro", **said)
    quiet = replace(named, status="unknown", causes=(), sets=())
    assert _misnamed_outside([]).verdict is Verdict.NOT_TESTED
    assert _misnamed_outside([aside] * 990 + [named] + [quiet] * 9).verdict is Verdict.PASS
    assert _misnamed_outside([aside] * 90 + [named] + [quiet] * 9).verdict is Verdict.OPEN  # 0 to 5.4 % of all
    twice = _misnamed_outside([aside] * 990 + [named] * 2 + [quiet] * 8)
    assert twice.verdict is Verdict.FAIL
    assert twice.reached.endswith("worst of 2 kinds: curved-gyro, 2 of 10")
    assert not surely_misnamed(replace(named, probability=0.89))
    assert not surely_misnamed(replace(named, accept=("rate-bias",)))


def test_trials_of_basilisk_are_counted_by_themselves():
    wheel = replace(stated(0.99, ("wheel-momentum",), ("wheel-momentum",)), kind="effect", status="explained", sets=())
    wheel = replace(wheel, sets=(wheel.causes,), amplitude_errors=(), body_errors=())
    flown = replace(wheel, case="wheel-momentum in Basilisk")
    wrong = replace(flown, causes=("rate-bias",), sets=(("rate-bias",),))
    text = "Basilisk as truth"
    none, some = (
        next(goal for goal in goals_of(trials) if goal.text.startswith(text))
        for trials in ([wheel], [wheel] + 199 * [flown] + [wrong])
    )
    assert none.verdict is Verdict.NOT_TESTED
    assert some.verdict is Verdict.PASS
    assert some.reached.startswith("1 of 200 ")


@pytest.fixture(scope="module")
def committed():
    return read(REPORTS / "blind_injections.jsonl.gz")


def test_the_record_that_is_shipped_is_that_of_the_committed_trials(committed):
    record = record_of(committed)
    versions = CodeVersion.of_trials(REPORTS / "blind_injections.jsonl.gz")
    assert asdict(shipped_record()) == {"releases": list(dict.fromkeys(each.release for each in versions)), **record}
    totals = [record[where][status.value]["total"] for where in ("inside", "outside") for status in Status]
    assert sum(totals) == len(committed) > 100
    hidden_outside = sum(trial.kind == "unknown" for trial in committed)
    assert record["outside"]["misnamed"]["total"] == hidden_outside > 10


def test_a_verdict_is_shown_with_its_record_inside_and_outside_the_catalogue(monkeypatch):
    inside = {status.value: Share(9, 10) for status in Status} | {"unresolved": Share(0, 0)}
    inside |= {"quiet": Share(20, 20), "loud": Share(7, 8), "misnamed": Share(1, 40)}
    outside = {status.value: Share(2, 3) for status in Status} | {"unresolved": Share(0, 0), "loud": Share(4, 5)}
    record = Record(["0.2.0", "0.3.0"], inside, outside | {"misnamed": Share(1, 6)})
    monkeypatch.setattr("bayesid.report.verdict_record.shipped_record", lambda: record)
    explained = record_sentence(Status.EXPLAINED)
    assert explained.startswith("In blind trials of bayesid 0.2.0 and 0.3.0 (95 % intervals in brackets): inside")
    assert "inside the catalogue, 9 of 10 (55 to 100 %) verdicts that explained the data named only" in explained
    assert "outside it, 1 of 6 (0 to 64 %) injections were wrongly explained" in explained
    partly = record_sentence(Status.PARTLY_EXPLAINED)
    assert partly.endswith("named only injected causes; outside it, 2 of 3 (9 to 99 %) did.")
    assert "outside it, 2 of 3 (9 to 99 %) listed something unknown" in record_sentence(Status.AMBIGUOUS)
    unknown = record_sentence(Status.UNKNOWN)
    assert "11 of 13 (55 to 98 %) verdicts of an unknown cause followed" in unknown
    assert "2 of the 6 injections outside it" in unknown
    adequate = record_sentence(Status.ADEQUATE)
    assert "20 of 20 (83 to 100 %) raised no alarm" in adequate
    assert "7 of 8 (47 to 100 %) inside the catalogue and 4 of 5 (28 to 99 %) outside it raised one" in adequate
    assert record_sentence(Status.UNRESOLVED) is None


def test_a_goal_is_decided_by_its_interval():
    """By hand: 0 of 1,000, and 30 of 1,000, where one per cent is due; 95 % of many, of few, and of none."""
    assert Share(0, 10).interval == pytest.approx((0.0, 1.0 - 0.025**0.1))
    assert _rate("", 0.01, 12, 1000).verdict is Verdict.PASS
    assert _rate("", 0.01, 30, 1000).verdict is Verdict.FAIL
    assert _rate("", 0.01, 1, 100).verdict is Verdict.OPEN
    assert _least("", 0.93, 198, 200).verdict is Verdict.PASS
    assert _least("", 0.93, 5, 5).verdict is Verdict.OPEN
    assert _least("", 0.93, 150, 200).verdict is Verdict.FAIL
    assert _least("", 0.93, 0, 0).verdict is Verdict.NOT_TESTED
    assert _most("", 0.03, 0, 200).verdict is Verdict.PASS
    assert _most("", 0.03, 30, 200).verdict is Verdict.FAIL
    rng = np.random.default_rng(1)
    assert _scatter("", list(rng.normal(size=(4000, 1)))).verdict is Verdict.PASS
    assert _scatter("", list(1.5 * rng.normal(size=(4000, 1)))).verdict is Verdict.FAIL
    # ten equal errors of one trial are one
    assert _scatter("", list(np.repeat(rng.normal(size=(400, 1)), 10, axis=1))).verdict is Verdict.OPEN


def test_torques_and_coverage_are_decided_by_their_intervals():
    aside = replace(stated(None, (), ()), case="pulse-train")
    found = [replace(aside, correlation=value) for value in np.linspace(0.5, 0.95, 10)]
    assert _correlation("", 0.8, ("pulse-train",), []).verdict is Verdict.NOT_TESTED
    assert _correlation("", 0.8, ("pulse-train",), found[:3]).verdict is Verdict.OPEN
    assert _correlation("", 0.7, ("pulse-train",), found).verdict is Verdict.OPEN
    assert _correlation("", 0.55, ("pulse-train",), found).verdict is Verdict.PASS  # second of ten: 0.55
    assert _correlation("", 0.95, ("pulse-train",), found).verdict is Verdict.FAIL
    rng = np.random.default_rng(1)
    assert _coverage([]).verdict is Verdict.NOT_TESTED
    assert _coverage(list(rng.normal(size=(3000, 3)))).verdict is Verdict.PASS
    assert _coverage(list(rng.normal(size=(20, 3)))).verdict is Verdict.OPEN
    assert _coverage(list(2.0 * rng.normal(size=(3000, 3)))).verdict is Verdict.FAIL


@pytest.mark.usefixtures("slow")
def test_statements_are_scored(trials):
    """Against the definition, by hand."""
    bias, null = trials
    sure = replace(bias, probabilities={"rate-bias": 0.8, "rate-drift": 0.1}, unknown=0.05, nothing=0.0)
    quiet = replace(null, probabilities={}, unknown=0.2, nothing=0.8)
    said = statements([sure, quiet])
    assert said["causes"] == [(0.8, True), (0.1, False)]
    assert said["unknown"] == [(0.05, False), (0.2, False)]
    assert said["nothing"] == [(0.0, False), (0.8, True)]
    rows = {row[0]: row for row in scores([sure, quiet])}
    assert rows["causes"][2].startswith(f"{(0.04 + 0.01) / 2.0:.4f}")
    assert rows["nothing"][3].startswith(f"{np.log(0.8) / 2.0:.3f}")


@pytest.mark.usefixtures("slow")
def test_the_report_is_written(trials, tmp_path):
    outside = Trial(**{**vars(trials[0]), "kind": "unknown", "hidden": (), "true_frame": "base", "correlation": 0.9})
    STUDY.write(Campaign([*trials, outside], 3), tmp_path / "blind.pdf")
    assert broken_rules(tmp_path / "blind.pdf", full=False) == []


@pytest.mark.slow
def test_the_report_is_that_of_the_committed_trials(committed, tmp_path):
    made_by = CodeVersion.of_trials(REPORTS / "blind_injections.jsonl.gz")
    STUDY.write(Campaign(committed, len(committed)), tmp_path / "blind.pdf", versions=made_by)
    assert broken_rules(tmp_path / "blind.pdf") == []
    made, kept = (json.loads(file.read_text()) for file in (tmp_path / "blind.json", REPORTS / "blind_injections.json"))
    assert {**made, "origin": kept["origin"]} == kept
    with (tmp_path / "blind-trials.csv").open(newline="") as stream:
        assert [int(row["seed"]) for row in csv.DictReader(stream)] == [trial.seed for trial in committed]
