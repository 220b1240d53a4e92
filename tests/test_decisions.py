"""Corner cases of the decision on small problems: thresholds of a verdict, sets without company, rows of the table."""

from __future__ import annotations

from dataclasses import fields
from types import SimpleNamespace

import numpy as np
import pytest

from bayesid.diagnosis.candidates.initial_rate import InitialRate
from bayesid.diagnosis.evidence.cause_sets import CausePrior, CauseSet, SetProbabilities, enumerate_sets
from bayesid.diagnosis.evidence.evidence_alarm import EvidenceAlarm
from bayesid.diagnosis.evidence.gram import Gram
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.evidence.verdict import Status, classes_of_equivalents, probable_verdict, verdict_sensitivity
from bayesid.diagnosis.noise.family_alarm import FamilyAlarm
from bayesid.diagnosis.outcome.candidate_table import candidate_table, listed_amplitudes
from bayesid.diagnosis.settings import DiagnosisSettings
from bayesid.simulation.effects.effect import Quantity
from tests.gram_problem import LinearProblem

INITIAL_RATE = InitialRate.name


def stated(shares: dict[tuple[str, ...], float]) -> SetProbabilities:
    """Probabilities of sets, as given; "unknown" stands for a generic candidate, and what is left for nothing."""
    shares = {**shares, (): 1.0 - sum(shares.values())}
    sets = [
        CauseSet(tuple(n for n in names if n != "unknown"), "unknown" if "unknown" in names else None, 0.0, 0.0, share)
        for names, share in sorted(shares.items(), key=lambda pair: -pair[1])
    ]
    return SetProbabilities(tuple(sets), tuple("abcde"), ("unknown",), CausePrior())


CLASSES = tuple((name,) for name in "abcde")


def test_a_fault_of_the_noise_is_not_named_beside_something_unnamed():
    """What its courses do not follow looks like noise; without it, noise is a cause like others."""
    beside, alone = stated({("a", "b", "unknown"): 0.95}), stated({("a", "b"): 0.95})
    assert set(probable_verdict(beside, CLASSES, silent=False).causes) == {"a", "b"}
    assert probable_verdict(beside, CLASSES, silent=False, noise=["b"]).causes == ("a",)
    assert probable_verdict(beside, CLASSES, silent=False, noise=["a", "b"]).status is Status.UNKNOWN
    assert set(probable_verdict(alone, CLASSES, silent=False, noise=["b"]).causes) == {"a", "b"}


@pytest.mark.parametrize(
    ("shares", "status"),
    [
        ({("a",): 0.9}, Status.EXPLAINED),
        ({("a",): 0.8999}, Status.AMBIGUOUS),  # nothing has the rest, and both together have everything
        ({("unknown",): 0.5, ("a",): 0.49}, Status.AMBIGUOUS),
        ({("unknown",): 0.5001, ("a",): 0.49}, Status.UNKNOWN),
        ({("a", "b"): 0.9, ("a", "c"): 0.1}, Status.EXPLAINED),
        ({("a", "b"): 0.89, ("a", "c"): 0.11}, Status.AMBIGUOUS),
        ({("a",): 0.25, ("b",): 0.25, ("c",): 0.23, ("d",): 0.225, ("e",): 0.045}, Status.AMBIGUOUS),  # 0.955 by four
        ({("a",): 0.25, ("b",): 0.24, ("c",): 0.23, ("d",): 0.22, ("e",): 0.06}, Status.UNRESOLVED),  # 0.94 by four
        ({("a",): 0.501}, Status.AMBIGUOUS),
        ({("a",): 0.499}, Status.UNRESOLVED),  # nothing is the most probable in spite of the alarm
        ({}, Status.UNRESOLVED),
    ],
)
def test_a_verdict_changes_at_its_thresholds(shares, status):
    assert probable_verdict(stated(shares), CLASSES, silent=False).status is status
    assert probable_verdict(stated(shares), CLASSES, silent=True).status is Status.ADEQUATE


def cause(name: str, high: float = 5.0) -> CandidateCause:
    return CandidateCause(name, (AmplitudeGroup(name, high),), generic=name.startswith("generic"))


def test_without_candidates_nothing_is_certain():
    found = enumerate_sets(SetEvidence(Gram(np.zeros((0, 0)), np.zeros(0), {}), []))
    assert [item.names for item in found.sets] == [()]
    assert (found.nothing, found.unknown, found.inclusion) == (1.0, 0.0, {})


def test_generic_candidates_alone_are_weighed_one_at_a_time():
    rng = np.random.default_rng(1)
    names = ["generic x", "generic y"]
    gram = LinearProblem.random(rng, dict.fromkeys(names, 1)).observed(rng, {names[0]: np.array([2.0])}).gram()
    found = enumerate_sets(SetEvidence(gram, map(cause, names)))
    assert {item.names for item in found.sets} == {(), ("generic x",), ("generic y",)}
    assert found.unknown == pytest.approx(1.0 - found.nothing, abs=1e-12)
    assert found.causes == ()


def test_sets_end_at_the_largest_and_grow_from_what_is_given():
    rng = np.random.default_rng(2)
    names = [*"abcd", "generic x"]
    gram = LinearProblem.random(rng, dict.fromkeys(names, 1)).observed(rng).gram()
    evidence = SetEvidence(gram, map(cause, names))
    single = enumerate_sets(evidence, largest=1)
    assert max(len(item.names) for item in single.sets) == 1
    assert len(single.sets) == 1 + len(names)
    beside = enumerate_sets(evidence, beside=("b",))
    assert all("b" in item.causes for item in beside.sets)
    assert beside.inclusion["b"] == pytest.approx(1.0, abs=1e-12)
    assert max(len(item.causes) for item in beside.sets) == 3


def test_what_can_only_be_told_apart_beyond_the_bounds_is_one_class():
    rng = np.random.default_rng(3)
    problem = LinearProblem.random(rng, {"a": 1, "b": 1, "c": 1}, samples=50)
    difference = rng.normal(size=(50, 1))
    problem.columns["b"] = problem.columns["a"] + 0.1 * difference
    gram = problem.observed(rng).gram()
    apart = np.sqrt(
        gram.conditioned(gram.groups["a"], np.array([1e9]), ["b"]).matrix[0, 0]
    )  # information of b beside a
    for factor, classes in ((0.9, (("a", "b"),)), (1.1, (("a",), ("b",)))):
        pair = [cause("a", factor / apart), cause("b", factor / apart)]
        assert classes_of_equivalents(SetEvidence(gram, pair)) == classes
    assert classes_of_equivalents(SetEvidence(gram, [])) == ()


def test_a_cause_of_several_forms_is_equivalent_in_one_of_them():
    """As a train of pulses is to a leak: the same where it is fast, another where it is slow."""
    matrix = np.array([[9.0, 9.0, 0.0], [9.0, 9.0, 0.0], [0.0, 0.0, 9.0]])
    gram = Gram(
        matrix, np.array([9.0, 9.0, 8.0]), {name: np.array([k]) for k, name in enumerate(("leak", "fast", "slow"))}
    )
    leak = CandidateCause("leak", (AmplitudeGroup("leak", 10.0),))
    train = CandidateCause("train", (AmplitudeGroup("slow", 10.0),), others=((AmplitudeGroup("fast", 10.0),),))
    evidence = SetEvidence(gram, [leak, train])
    assert classes_of_equivalents(evidence) == (("leak", "train"),)  # the fast form is the more probable one
    assert classes_of_equivalents(evidence, forms={"train": 0}) == (("leak",), ("train",))


def test_amplitudes_of_several_units_are_listed_for_the_first_recording():
    """Within each group, the columns of the first recording come first."""
    rng = np.random.default_rng(1)
    problem = LinearProblem.random(rng, {"wheel [N m s]": 2, "wheel [N m]": 6}, samples=200)
    true = {"wheel [N m s]": np.array([1.0, 2.0]), "wheel [N m]": np.array([3.0, 4.0, 5.0, 6.0, 7.0, 8.0])}
    evidence = SetEvidence(
        problem.observed(rng, true).gram(),
        [CandidateCause("wheel", tuple(AmplitudeGroup(name, 100.0) for name in true))],
    )
    quantities = tuple(Quantity(*pair) for pair in (("start", "N m s"), ("1", "N m"), ("2", "N m"), ("3", "N m")))
    listed, mean, sd, _ = listed_amplitudes("wheel", list(true), evidence, quantities)
    assert listed == quantities
    np.testing.assert_allclose(mean, [1.0, 3.0, 4.0, 5.0], atol=4.0 * sd.max())


@pytest.fixture(scope="module")
def table():
    rng = np.random.default_rng(4)
    names = [INITIAL_RATE, "seen", "generic x", "there"]
    problem = LinearProblem.random(rng, {INITIAL_RATE: 3, "seen": 2, "generic x": 4, "there": 1}, samples=80)
    gram = problem.observed(rng, {"seen": np.array([1.5, -2.0])}).gram()
    fixed = CandidateCause("there", (AmplitudeGroup("there", 1.0),), fixed=True)
    evidence = SetEvidence(gram, [*(cause(name) for name in names[:3]), fixed])
    alarm = FamilyAlarm(EvidenceAlarm.of(evidence, rng), {"rate-noise": np.log(0.2), "variance by axis": np.log(0.5)})
    found = enumerate_sets(evidence)
    everything = SetProbabilities.of(found.sets, (*found.causes, "rate-noise"), found.generics, found.prior)
    search = SimpleNamespace(
        base=SimpleNamespace(evidence=evidence), alarm=alarm, probabilities=everything, searches=(), states=()
    )
    units = ("N", "m")
    effect = SimpleNamespace(
        label="seen",
        cause_kind="linear",
        amplitude_units=units,
        amplitude_quantities=tuple(Quantity(f"of {unit}", unit) for unit in units[::-1]),
    )
    return {row.name: row for row in candidate_table(search, [effect], rng)}, search


def test_the_table_has_every_candidate_once_the_most_probable_first(table):
    rows, search = table
    assert set(rows) == {*search.base.evidence.causes, "rate-noise"}  # a test without a fault has no row
    probabilities = [row.probability for row in rows.values()]
    assert probabilities == sorted(probabilities, reverse=True)
    assert next(iter(rows)) == "seen"
    for name, row in rows.items():
        assert row.probability == search.probabilities.inclusion[name]
        assert row.p_value <= row.p_value_adjusted <= 1.0
        assert row.generic == (name == "generic x")


def test_a_row_has_amplitudes_where_they_have_a_name_and_a_limit_above_them(table):
    rows, _ = table
    seen, rate = rows["seen"], rows[INITIAL_RATE]
    assert [item.unit for item in seen.quantities] == ["N", "m"]  # in the order of the columns
    assert np.abs(seen.mean - [1.5, -2.0]).max() < 1.0
    assert (seen.upper_limit > np.abs(seen.mean)).all()
    assert [item.name for item in rate.quantities] == ["x", "y", "z"]
    assert (np.abs(rate.mean) < rate.upper_limit).all()
    for name in ("generic x", "there"):
        assert rows[name].quantities == () == tuple(rows[name].mean)
    assert seen.signal_to_noise > 5.0 > rate.signal_to_noise
    assert 0.0 <= rate.power <= 1.0


def test_a_fault_that_was_not_weighed_has_a_p_value_and_no_size(table):
    row = table[0]["rate-noise"]
    assert row.p_value == pytest.approx(0.2)
    assert row.p_value_adjusted > row.p_value
    assert row.signal_to_noise == pytest.approx(0.8416, abs=1e-3)  # one-sided
    assert (row.log_bayes_factor, row.quantities, row.power) == (None, (), None)


def test_settings_move_the_thresholds_of_a_verdict():
    shares = stated({("a",): 0.8, ("b",): 0.2})
    assert probable_verdict(shares, CLASSES, silent=False).status is Status.AMBIGUOUS
    assert probable_verdict(shares, CLASSES, False, DiagnosisSettings(named_from=0.75)).status is Status.EXPLAINED
    assert probable_verdict(shares, CLASSES, False, DiagnosisSettings(most_alternatives=1)).status is Status.UNRESOLVED
    unknown = stated({("a",): 0.6, ("unknown",): 0.4})
    assert probable_verdict(unknown, CLASSES, False, DiagnosisSettings(unknown_from=0.3)).status is Status.UNKNOWN


@pytest.mark.parametrize(("name", "value"), [("named_from", 1.5), ("alarm_level", 0.0), ("most_full_fits", -1)])
def test_settings_that_decide_nothing_are_refused(name, value):
    with pytest.raises(ValueError, match=f"{name} must be positive"):
        DiagnosisSettings(**{name: value})


def test_the_sensitivity_names_what_it_varies_and_no_setting_is_among_it():
    found = verdict_sensitivity(stated({("a",): 0.8}), CLASSES, False, lambda bound, floor: stated({("a",): 0.8}))
    assert len(found.varied) * 2 - 2 == len(found.others)  # prior numbers both ways, ranges one way
    assert not set(found.varied) & {setting.name for setting in fields(DiagnosisSettings)}
