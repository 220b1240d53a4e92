"""Probabilities of sets of causes against brute force and against causes drawn from the prior; verdicts on them."""

from __future__ import annotations

import time
from itertools import combinations

import numpy as np
import pytest

from bayesid.diagnosis.evidence.cause_sets import CausePrior, CauseSet, SetProbabilities, enumerate_sets
from bayesid.diagnosis.evidence.evidence_alarm import EvidenceAlarm
from bayesid.diagnosis.evidence.gram import Gram
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.evidence.verdict import (
    Rest,
    Status,
    classes_of_equivalents,
    probable_verdict,
    verdict_sensitivity,
)
from tests.gram_problem import LinearProblem

LOW, HIGH = 0.02, 5.0


def cause(name: str, high: float = HIGH, low: float | None = None) -> CandidateCause:
    return CandidateCause(name, (AmplitudeGroup(name, high, low),), generic=name.startswith("generic"))


def named(probabilities: SetProbabilities) -> dict[tuple[str, ...], float]:
    return {item.names: item.probability for item in probabilities.sets}


# enumeration ----------------------------------------------------------------------------------------------------------


def brute_force(gram: Gram, names: tuple[str, ...]) -> float:
    """Log evidence of causes with one column each, by the dense formula at every combination of scales."""
    if not names:
        return 0.0
    nodes = np.geomspace(LOW, HIGH, 13)
    weights = np.ones(13)
    weights[[0, -1]] = 0.5
    scales = np.stack([axis.ravel() for axis in np.meshgrid(*[nodes] * len(names))], axis=1)
    products = np.prod([axis.ravel() for axis in np.meshgrid(*[weights / weights.sum()] * len(names))], axis=0)
    own = np.concatenate([gram.groups[name] for name in names])
    information, score = gram.matrix[np.ix_(own, own)], gram.score[own]
    precision = information + np.eye(len(own)) * scales[:, None, :] ** -2
    gain = 0.5 * (score * np.linalg.solve(precision, score[:, None])[..., 0]).sum(axis=1)
    log_det = np.linalg.slogdet(precision)[1] + 2.0 * np.log(scales).sum(axis=1)
    return float(np.log(products @ np.exp(gain - 0.5 * log_det)))


def test_probabilities_are_those_of_a_brute_force_sum():
    rng = np.random.default_rng(1)
    causes, generics = [*"abcde"], ["generic x", "generic y"]
    problem = LinearProblem.random(rng, dict.fromkeys([*causes, *generics], 1))
    problem.columns["b"] += problem.columns["a"]
    gram = problem.observed(rng, {"a": np.array([0.5]), "generic y": np.array([0.3])}).gram()
    sizes, one_more, generic = {0: 1, 1: 5, 2: 10, 3: 10}, 0.2, 0.05
    weights = {}
    for size, count in sizes.items():
        for own in combinations(causes, size):
            prior = (1.0 - one_more) * one_more**size / count
            weights[own] = prior * (1.0 - generic) * np.exp(brute_force(gram, own))
            for name in generics:
                weights[*own, name] = prior * generic / 2.0 * np.exp(brute_force(gram, (*own, name)))
    total = sum(weights.values())
    evidence = SetEvidence(gram, [cause(name, low=LOW) for name in [*causes, *generics]])
    found = enumerate_sets(evidence, CausePrior(one_more, generic))
    assert set(named(found)) == set(weights)
    for names, probability in named(found).items():
        assert probability == pytest.approx(weights[names] / total, rel=0.02, abs=1e-6)
    for name, probability in found.inclusion.items():
        expected = sum(weight for names, weight in weights.items() if name in names) / total
        assert probability == pytest.approx(expected, rel=0.02)
        assert found.of_any([name]) == pytest.approx(probability, rel=1e-12)
    unknown = sum(weight for names, weight in weights.items() if set(generics) & set(names)) / total
    assert found.unknown == pytest.approx(unknown, rel=0.02)
    assert found.nothing == pytest.approx(weights[()] / total, rel=0.02)


def test_probabilities_sum_to_one_and_do_not_depend_on_the_order_of_the_causes():
    rng = np.random.default_rng(2)
    names = [*(f"cause {k}" for k in range(12)), "generic x", "generic y"]
    problem = LinearProblem.random(rng, {name: int(rng.integers(1, 4)) for name in names})
    gram = problem.observed(rng, {"cause 3": 0.5 * np.ones(problem.columns["cause 3"].shape[1])}).gram()
    one = enumerate_sets(SetEvidence(gram, [cause(name) for name in names]))
    other = enumerate_sets(SetEvidence(gram, [cause(names[k]) for k in rng.permutation(len(names))]))
    assert one == other
    assert sum(item.probability for item in one.sets) == pytest.approx(1.0, abs=1e-12)
    assert max(len(item.causes) for item in one.sets) == 3
    assert max(len(item.names) for item in one.sets) == 4
    ordered = [item.probability for item in one.sets]
    assert ordered == sorted(ordered, reverse=True)


def test_a_triple_beside_something_generic_is_found_among_many():
    rng = np.random.default_rng(3)
    names = [*(f"cause {k:02}" for k in range(25)), *(f"generic {k}" for k in range(4))]
    problem = LinearProblem.random(rng, dict.fromkeys(names, 2), samples=200)
    truth = {name: np.array([0.8, -0.8]) for name in ("cause 03", "cause 11", "cause 20", "generic 2")}
    found = enumerate_sets(SetEvidence(problem.observed(rng, truth).gram(), [cause(name) for name in names]))
    assert found.sets[0].names == tuple(truth)
    assert found.sets[0].probability > 0.9
    assert len(found.sets) < 4000  # not all of 2,625 sets of causes beside each of five


def test_a_triple_is_found_though_something_generic_takes_the_place_of_two_of_it():
    rng = np.random.default_rng(5)
    causes = [f"cause {k:02}" for k in range(40)]
    problem = LinearProblem.random(rng, dict.fromkeys([*causes, "generic"], 1), samples=200)
    two = np.concatenate([problem.columns["cause 04"], problem.columns["cause 21"]], axis=1)
    problem.columns["generic"] = two + 0.2 * rng.standard_normal(two.shape) * two.std(axis=0)
    problem = problem.observed(rng, {name: np.array([3.0]) for name in ("cause 00", "cause 04", "cause 21")})
    found = enumerate_sets(SetEvidence(problem.gram(), [cause(name) for name in [*causes, "generic"]]))
    best = {item.generic: item for item in reversed([item for item in found.sets if len(item.names) == 2])}
    assert best["generic"].log_evidence > best[None].log_evidence + 100.0
    assert found.sets[0].names == ("cause 00", "cause 04", "cause 21")


def test_bounds_that_are_too_high_do_not_hide_other_sets(monkeypatch):
    """Bounds of bodies far above their evidence: what comes near the best set is evaluated all the same."""
    monkeypatch.setattr("bayesid.diagnosis.evidence.cause_sets.FEW", 0)
    rng = np.random.default_rng(7)
    names = [*"abcdefgh"]
    problem = LinearProblem.random(rng, dict.fromkeys(names, 1)).observed(rng, {"a": np.array([2.0])})
    evidence = SetEvidence(problem.gram(), [cause(name) for name in names])
    evidence.__dict__["bodily"] = {"b": 40.0, "c": 20.0, "d": 10.0}
    found = enumerate_sets(evidence)
    assert found.sets[0].names == ("a",)
    for item in found.sets[:20]:
        assert item.log_evidence == pytest.approx(evidence.log_evidence(item.names), abs=0.1), item.names


def test_causes_drawn_from_the_prior_are_at_work_as_often_as_stated():
    rng = np.random.default_rng(4)
    causes, generics, trials = [*"abcd"], ["generic x"], 3000
    problem = LinearProblem.random(rng, {"a": 1, "b": 2, "c": 1, "d": 3, "generic x": 6}, samples=40)
    problem.columns["c"] += 1.5 * problem.columns["a"]  # often mistaken for one another
    gram, prior = problem.observed(rng).gram(), CausePrior(0.4, 0.3)
    evidence = SetEvidence(gram, [cause(name, low=LOW) for name in [*causes, *generics]])
    counts = np.arange(4)
    sizes = rng.choice(counts, p=0.4**counts / (0.4**counts).sum(), size=trials)
    truths = [frozenset(rng.choice(causes, size=size, replace=False)) for size in sizes]
    truths = [own | {"generic x"} if rng.uniform() < 0.3 else own for own in truths]
    scores = gram.null_scores(rng, trials)
    for row, own in enumerate(truths):
        amplitudes = np.zeros(len(gram.score))
        for name in own:
            columns = gram.groups[name]
            scale = np.exp(rng.uniform(np.log(LOW), np.log(HIGH)))
            amplitudes[columns] = scale * rng.normal(size=len(columns))
        scores[row] -= gram.matrix @ amplitudes
    keys = [(own, g) for size in counts for own in combinations(causes, size) for g in (None, "generic x")]
    values = {key: evidence.log_evidences(key[0] if key[1] is None else (*key[0], key[1]), scores) for key in keys}
    stated, true = [], []
    for row, own in enumerate(truths):
        sets = [CauseSet(*key, float(values[key][row])) for key in keys]
        inclusion = SetProbabilities.of(sets, causes, generics, prior).inclusion
        stated += inclusion.values()
        true += [name in own for name in inclusion]
    stated, true = np.array(stated), np.array(true)
    occupied = 0
    for low in np.arange(0.0, 1.0, 0.1):
        there = (stated >= low) & (stated < low + 0.1 + (low > 0.85))
        occupied += there.sum() >= 30
        error = np.sqrt((stated[there] * (1.0 - stated[there])).sum())
        assert abs(stated[there].sum() - true[there].sum()) < 3.5 * max(error, 1.0), low
    assert occupied >= 9
    assert ((stated > 0.99) & true).sum() > 500


def test_studies_that_lack_nothing_hardly_ever_name_a_cause():
    rng = np.random.default_rng(10)
    causes, trials = [f"cause {k}" for k in range(10)], 20_000
    problem = LinearProblem.random(rng, dict.fromkeys(causes, 1), samples=40)
    gram, prior = problem.observed(rng).gram(), CausePrior()
    evidence = SetEvidence(gram, [cause(name) for name in causes])
    ratios = np.exp([evidence.log_evidences([name], gram.null_scores(rng, trials)) for name in causes])
    weight = np.exp(prior.log_probability(1, 10, False, 0) - prior.log_probability(0, 10, False, 0))
    stated = weight * ratios.max(axis=0) / (1.0 + weight * ratios.sum(axis=0))
    assert 0 < (stated >= 0.9).sum() < trials / 73


def test_all_pairs_of_forty_causes_take_seconds_at_most():
    rng = np.random.default_rng(5)
    names = [f"cause {k}" for k in range(40)]
    problem = LinearProblem.random(rng, {name: int(rng.integers(1, 7)) for name in names}, samples=400)
    evidence = SetEvidence(problem.observed(rng).gram(), [cause(name, 100.0) for name in names])
    start = time.process_time()
    for pair in combinations(names, 2):
        evidence.log_evidence(pair)
    assert time.process_time() - start < 5.0


def test_prior_of_all_sets_is_one_and_refuses_impossible_numbers():
    prior = CausePrior(0.3, 0.2)
    total = 0.0
    for size in range(31):
        number = len(list(combinations(range(6), size))) if size <= 6 else 0
        for generic, times in ((False, 1), (True, 3)):
            total += number * times * np.exp(prior.log_probability(size, 6, generic, 3)) if number else 0.0
    assert total == pytest.approx(1.0 - 0.3**7)
    assert np.exp(prior.log_probability(0, 6, False, 0)) == pytest.approx(0.7)
    with pytest.raises(ValueError, match="one_more is a probability"):
        CausePrior(one_more=0.0)


# equivalents ----------------------------------------------------------------------------------------------------------


def test_causes_with_the_same_columns_are_one_class_and_share_its_probability():
    rng = np.random.default_rng(6)
    problem = LinearProblem.random(rng, dict.fromkeys(["a", "mixed", "near", "faint", "weak", "z"], 2), samples=60)
    mixing = rng.normal(size=(2, 2))
    problem.columns["mixed"] = problem.columns["a"] @ mixing
    problem.columns["near"] = problem.columns["a"] + 0.1 * rng.normal(size=(60, 2))
    problem.columns["faint"] = problem.columns["a"]  # the same but for its bound
    problem.columns["one"] = problem.columns["a"][:, :1]  # imitated by a, but not the other way round
    problem = problem.observed(rng, {"a": np.array([1.5, -1.0])})
    causes = [cause(name) for name in ("z", "near", "mixed", "a", "one")]
    causes += [cause("faint", 1e-6), cause("weak", 1e-6)]
    evidence = SetEvidence(problem.gram(), causes)
    classes = classes_of_equivalents(evidence)
    assert classes == (("a", "mixed"), ("faint",), ("near",), ("one",), ("weak",), ("z",))
    close = SetEvidence(problem.gram(), [cause("a", 1.0), cause("near", 1.0)])
    assert classes_of_equivalents(close) == (("a", "near"),)  # at this scale the difference is hidden
    found = enumerate_sets(evidence)
    both = found.of_any(["a", "mixed"])
    assert both > max(found.inclusion["a"], found.inclusion["mixed"])
    assert both <= found.inclusion["a"] + found.inclusion["mixed"] + 1e-12
    assert found.inclusion["a"] / found.inclusion["mixed"] == pytest.approx(1.0, abs=0.8)


def test_causes_with_two_groups_are_compared_as_a_whole():
    rng = np.random.default_rng(7)
    problem = LinearProblem.random(rng, dict.fromkeys("abcd", 2), samples=60)
    problem.columns["c"], problem.columns["d"] = problem.columns["a"] * 3.0, problem.columns["b"] * 0.2
    gram = problem.observed(rng).gram()
    leak, other, half = (
        CandidateCause(name, tuple(AmplitudeGroup(group, 5.0) for group in groups))
        for name, groups in (("leak", "ab"), ("other", "dc"), ("half", "a"))
    )
    assert classes_of_equivalents(SetEvidence(gram, [leak, other, half])) == (("half",), ("leak", "other"))


# verdict --------------------------------------------------------------------------------------------------------------


def stated(shares: dict[tuple[str, ...], float]) -> SetProbabilities:
    """Probabilities of sets, as given; "generic" stands for a generic candidate."""
    sets = []
    for names, share in sorted(shares.items(), key=lambda pair: -pair[1]):
        own = tuple(sorted(name for name in names if name != "generic"))
        sets.append(CauseSet(own, "generic" if "generic" in names else None, 0.0, 0.0, share))
    assert sum(shares.values()) == pytest.approx(1.0)
    return SetProbabilities(tuple(sets), ("a", "a'", "b", "c", "d", "e", "f"), ("generic",), CausePrior())


CLASSES = (("a", "a'"), ("b",), ("c",), ("d",), ("e",), ("f",))
NOTHING: tuple[str, ...] = ()
PARTLY = Status.PARTLY_EXPLAINED
SPREAD = {("e",): 0.02, ("f",): 0.02, ("b", "e"): 0.02, ("b", "f"): 0.02}


@pytest.mark.parametrize(
    ("shares", "status", "causes", "others"),
    [
        ({("b",): 0.92, ("c",): 0.08}, Status.EXPLAINED, ("b",), ()),
        ({("b",): 0.6, ("b", "c"): 0.2, ("b", "d"): 0.12, ("e",): 0.08}, Status.EXPLAINED, ("b",), ()),
        ({("b", "c"): 0.93, ("b",): 0.07}, Status.EXPLAINED, ("b", "c"), ()),
        ({("a",): 0.5, ("a'",): 0.42, ("c",): 0.08}, Status.EXPLAINED, ("a",), ()),
        ({("b",): 0.86, ("b", "generic"): 0.09, ("c",): 0.05}, Status.EXPLAINED, ("b",), ()),
        ({("b",): 0.85, ("b", "generic"): 0.1, ("c",): 0.05}, PARTLY, ("b",), ()),
        ({("b",): 0.55, ("b", "generic"): 0.4, ("c",): 0.05}, PARTLY, ("b",), ()),
        ({("b", "c"): 0.2, ("b", "generic"): 0.6, ("b",): 0.2}, PARTLY, ("b",), ()),
        ({("b", "c", "generic"): 0.91, ("generic",): 0.09}, PARTLY, ("b", "c"), ()),
        ({("b", "generic"): 0.89, ("generic",): 0.11}, Status.UNKNOWN, (), ()),
        ({("b", name): 0.2 for name in "acdef"}, PARTLY, ("b",), ()),
        ({("b",): 0.5, ("c",): 0.42, **SPREAD}, Status.AMBIGUOUS, ("b",), (("c",),)),
        ({("b", "c"): 0.6, ("b",): 0.4}, Status.AMBIGUOUS, ("b", "c"), (("b",),)),
        ({("b", "c"): 0.5, ("b", "d"): 0.5}, Status.AMBIGUOUS, ("b", "c"), (("b", "d"),)),
        ({("b",): 0.7, NOTHING: 0.3}, Status.AMBIGUOUS, ("b",), ((),)),
        ({("b",): 0.6, ("generic",): 0.4}, Status.AMBIGUOUS, ("b",), (("unknown",),)),
        ({("b",): 0.3, ("c",): 0.29, ("d",): 0.21, ("a",): 0.1, ("a'",): 0.1}, Status.AMBIGUOUS, ("b",), 3),
        ({("b",): 0.3, ("c",): 0.2, ("d",): 0.2, ("a",): 0.1, ("e",): 0.1, ("f",): 0.1}, Status.UNRESOLVED, (), ()),
        ({("b",): 0.3, ("c",): 0.29, ("d",): 0.27, ("e",): 0.07, ("f",): 0.07}, Status.UNRESOLVED, (), ()),
        ({NOTHING: 0.6, ("b",): 0.4}, Status.UNRESOLVED, (), ()),
        ({("generic",): 0.6, ("b",): 0.4}, Status.UNKNOWN, (), ()),
        ({("b", "generic"): 0.99, ("b",): 0.01}, PARTLY, ("b",), ()),
    ],
)
def test_verdict_follows_the_contract(shares, status, causes, others):
    found = probable_verdict(stated(shares), CLASSES, silent=False)
    assert (found.status, found.causes) == (status, causes)
    assert found.ambiguous_with == others if isinstance(others, tuple) else len(found.ambiguous_with) == others
    assert found.equivalent_to == (
        {"a": ("a'",)} if any("a" in item for item in (causes, *found.ambiguous_with)) else {}
    )
    assert probable_verdict(stated(shares), CLASSES, silent=True).status is Status.ADEQUATE


@pytest.mark.parametrize(
    ("shares", "probability", "rest"),
    [
        ({("b",): 0.95, ("b", "generic"): 0.05}, 0.05, Rest.NONE),
        ({("b",): 0.9, ("b", "generic"): 0.1}, 0.1, Rest.UNDECIDED),
        ({("b",): 0.5, ("b", "generic"): 0.5}, 0.5, Rest.UNDECIDED),
        ({("b",): 0.49, ("b", "generic"): 0.51}, 0.51, Rest.PRESENT),
        ({("b", name): 0.2 for name in "acdef"}, 1.0, Rest.PRESENT),
        ({("b",): 0.6, ("generic",): 0.4}, 0.4, Rest.UNDECIDED),
    ],
)
def test_the_remainder_is_said_apart_from_the_causes(shares, probability, rest):
    found = probable_verdict(stated(shares), CLASSES, silent=False).remainder
    assert found.verdict is rest
    assert found.probability == pytest.approx(probability)
    assert probable_verdict(stated(shares), CLASSES, silent=True).remainder.verdict is Rest.NONE


def test_verdict_that_rests_on_the_prior_says_so_and_a_clear_one_does_not():
    rng = np.random.default_rng(8)
    names = [*(f"cause {k}" for k in range(6)), "generic x"]
    problem = LinearProblem.random(rng, dict.fromkeys(names, 1), samples=60)
    sensitivities = {}
    for size in (3.0, 0.62):
        gram = problem.observed(np.random.default_rng(0), {"cause 2": np.array([size])}).gram()
        evidence = SetEvidence(gram, [cause(name) for name in names])
        alarm = EvidenceAlarm.of(evidence, np.random.default_rng(0))

        def widened(bound: float, floor: float, evidence: SetEvidence = evidence) -> SetProbabilities:
            causes = [own.rescaled(evidence.gram, bound, floor) for own in evidence.causes.values()]
            return enumerate_sets(SetEvidence(evidence.gram, causes))

        sensitivities[size] = verdict_sensitivity(
            enumerate_sets(evidence), classes_of_equivalents(evidence), alarm.silent(), widened
        )
    assert sensitivities[3.0].verdict.status is Status.EXPLAINED
    assert sensitivities[3.0].verdict.causes == ("cause 2",)
    # at 0.05 to 0.1 for the only generic candidate, twice its prior leaves open whether something remains
    assert sensitivities[3.0].changes == ("unknown twice as probable",)
    assert len(sensitivities[3.0].others) == 6
    assert {other.causes for other in sensitivities[3.0].others.values()} == {("cause 2",)}
    assert "causes twice as probable" in sensitivities[0.62].changes


def test_halved_and_doubled_priors_weigh_the_same_sets_anew():
    rng = np.random.default_rng(9)
    problem = LinearProblem.random(rng, dict.fromkeys(["a", "b", "generic x"], 1))
    evidence = SetEvidence(problem.observed(rng, {"a": np.array([0.4])}).gram(), map(cause, problem.columns))
    base, other = CausePrior(), CausePrior(one_more=0.2)
    assert enumerate_sets(evidence, base).under(other) == enumerate_sets(evidence, other)
    assert enumerate_sets(evidence, other).inclusion["a"] > enumerate_sets(evidence, base).inclusion["a"]
