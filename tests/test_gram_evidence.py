"""Gram, evidence and amplitudes against dense Gaussians, dense least squares and quadrature."""

from __future__ import annotations

import subprocess
import sys
from itertools import pairwise
from types import ModuleType

import numpy as np
import pytest
import scipy.linalg as sla
from scipy import integrate

from bayesid.diagnosis.evidence.amplitude_posterior import AmplitudePosterior
from bayesid.diagnosis.evidence.gram import GaussianBlock, Gram, covariance_roots
from bayesid.diagnosis.evidence.scale_integral import GroupSpectrum, log_evidences, log_evidences_beside
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause, scale_range
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from tests.gram_problem import LinearProblem


def cause(name: str, low: float | None, high: float, spread: np.ndarray | None = None) -> CandidateCause:
    return CandidateCause(name, (AmplitudeGroup(name, high, low, spread),))


def draw(posterior: AmplitudePosterior, rng: np.random.Generator, draws: int) -> np.ndarray:
    """Draw amplitudes, shape (draws, m), from each term of the mixture as often as it is probable."""
    counts = rng.multinomial(draws, posterior.weights)
    normal = np.split(rng.normal(size=(draws, posterior.means.shape[1])), np.cumsum(counts)[:-1])
    terms = zip(posterior.means, posterior.roots, normal, strict=True)
    return np.concatenate([mean + part @ root for mean, root, part in terms])


def test_evidence_loads_neither_the_simulation_nor_the_rest_of_the_diagnosis():
    names = ("gram", "set_evidence", "cause_sets", "evidence_alarm", "verdict", "amplitude_posterior")
    code = "import sys\n" + "".join(f"import bayesid.diagnosis.evidence.{name}\n" for name in names)
    code += "print(*(name for name in sys.modules if name.split('.')[0] in ('bayesid', 'jax')))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    allowed = ("bayesid._math", "bayesid.diagnosis.evidence", "bayesid.diagnosis.settings")
    assert "bayesid.diagnosis.evidence.gram" in loaded
    assert {name for name in loaded if not name.startswith(allowed)} == {"bayesid", "bayesid.diagnosis"}


def test_functions_of_the_diagnosis_are_not_hidden_by_submodules_of_their_names():
    import bayesid.diagnosis.candidates.cause_kind
    import bayesid.diagnosis.diagnose

    assert all(not isinstance(getattr(bayesid.diagnosis, name), ModuleType) for name in bayesid.diagnosis.__all__)


# Gram -----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("at_the_mode", [True, False])
def test_gram_is_what_refitting_everything_leaves(at_the_mode):
    rng = np.random.default_rng(1)
    problem = LinearProblem.random(rng, {"a": 2, "b": 3}).observed(rng)
    z = problem.mode if at_the_mode else rng.normal(size=4)
    residual = problem.data + problem.fitted @ z
    gram = Gram.of(problem.columns, residual, problem.fitted, None if at_the_mode else z)
    everything = np.concatenate(list(problem.columns.values()), axis=1)
    stacked = np.concatenate([problem.fitted, np.eye(4)])

    def least(amplitudes: np.ndarray) -> float:
        target = np.concatenate([residual + everything @ amplitudes, z])
        step = np.linalg.lstsq(stacked, -target)[0]
        return 0.5 * float(((target + stacked @ step) ** 2).sum())

    for amplitudes in rng.normal(size=(20, 5)):
        expected = gram.score @ amplitudes + 0.5 * amplitudes @ gram.matrix @ amplitudes
        assert least(amplitudes) - least(np.zeros(5)) == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_gram_keeps_what_the_unknowns_all_but_imitate():
    rng = np.random.default_rng(2)
    fitted = 1e6 * rng.normal(size=(50, 5))
    basis = np.linalg.qr(fitted)[0]
    rest = rng.normal(size=50)
    rest -= basis @ (basis.T @ rest)
    signature = (fitted @ rng.normal(size=5) + 1e-1 * rest)[:, None]  # a ten-millionth of it is its own
    gram = Gram.of({"a": signature}, np.zeros(50), fitted)
    inverse = np.linalg.inv(fitted.T @ fitted + np.eye(5))
    naive = signature.T @ signature - signature.T @ fitted @ inverse @ fitted.T @ signature
    refitted = np.linalg.lstsq(np.concatenate([fitted, np.eye(5)]), np.append(signature, np.zeros(5)))[0]
    left = np.append(signature, np.zeros(5)) - np.concatenate([fitted, np.eye(5)]) @ refitted
    assert gram.matrix[0, 0] == pytest.approx(left @ left, rel=1e-5)
    assert abs(naive[0, 0] - left @ left) > 1e-4 * left @ left


def test_a_signature_within_the_unknowns_is_exactly_nothing():
    rng = np.random.default_rng(3)
    fitted = 1e12 * rng.normal(size=(30, 3))
    gram = Gram.of({"a": fitted @ rng.normal(size=(3, 2)) * 1e-12}, rng.normal(size=30), fitted, np.zeros(3))
    assert (gram.matrix == 0.0).all()
    assert (gram.score == 0.0).all()
    assert gram.signal_to_noise("a") == 0.0


def test_cosines_are_those_of_the_projected_signatures():
    rng = np.random.default_rng(4)
    problem = LinearProblem.random(rng, {"a": 2, "b": 3, "c": 1}).observed(rng)
    stacked = np.concatenate([problem.fitted, np.eye(4)])
    off = np.eye(34) - stacked @ np.linalg.solve(stacked.T @ stacked, stacked.T)
    whole = {name: off @ np.concatenate([own, np.zeros((4, own.shape[1]))]) for name, own in problem.columns.items()}
    gram = problem.gram()
    for first, second in (("a", "b"), ("b", "c"), ("a", "a")):
        expected = np.sort(np.cos(sla.subspace_angles(whole[first], whole[second])))[::-1]
        np.testing.assert_allclose(gram.cosines(first, second), expected, atol=1e-9)


def test_signal_to_noise_is_that_of_a_joint_refit_whatever_the_units():
    rng = np.random.default_rng(5)
    problem = LinearProblem.random(rng, {"a": 2, "b": 3, "c": 2})
    problem.columns["b"][:, 2] = problem.columns["b"][:, 0]  # one direction twice
    problem = problem.observed(rng, {"a": np.array([2.0, 0.0])})
    unknowns = np.concatenate([problem.fitted, np.eye(4)])
    added = np.concatenate([problem.columns["a"], problem.columns["b"]], axis=1)
    more = np.concatenate([unknowns, np.concatenate([added, np.zeros((4, 5))])], axis=1)
    target = np.append(problem.data, np.zeros(4))
    costs = [((target - m @ np.linalg.lstsq(m, target)[0]) ** 2).sum() for m in (unknowns, more)]
    expected = np.sqrt(costs[0] - costs[1] - 4)
    assert problem.gram().signal_to_noise("a", "b") == pytest.approx(expected, rel=1e-9)
    problem.columns["a"] = problem.columns["a"] * [1e-7, 1e5]
    assert problem.gram().signal_to_noise("a", "b") == pytest.approx(expected, rel=1e-7)


def test_kept_groups_keep_their_numbers():
    rng = np.random.default_rng(6)
    gram = LinearProblem.random(rng, {"a": 2, "b": 3, "c": 1}).observed(rng).gram()
    kept = gram.keeping(["c", "a"])
    assert kept.score.tolist() == gram.score[[5, 0, 1]].tolist()
    assert kept.cosines("a", "c").tolist() == gram.cosines("a", "c").tolist()
    assert kept.signal_to_noise("a") == gram.signal_to_noise("a")


def test_conditioning_on_columns_is_integrating_their_amplitudes_out():
    """The amplitudes are observed as ``-A^-1 g`` with noise of covariance ``A^-1``, to which their prior adds."""
    rng = np.random.default_rng(20)
    gram = LinearProblem.random(rng, {"a": 2, "b": 3, "c": 2}).observed(rng).gram()
    out, deviations, kept = gram.groups["b"], np.array([0.3, 2.0, 50.0]), gram.keeping(["c", "a"])
    noise = np.linalg.inv(gram.matrix)
    noise[np.ix_(out, out)] += np.diag(deviations**2)
    precision = np.linalg.inv(noise)
    order = np.concatenate([gram.groups["c"], gram.groups["a"]])
    found = gram.conditioned(out, deviations, ["c", "a"])
    expected = precision @ np.linalg.solve(gram.matrix, gram.score)
    np.testing.assert_allclose(found.matrix, precision[np.ix_(order, order)], rtol=1e-9)
    np.testing.assert_allclose(found.score, expected[order], rtol=1e-9)
    assert {name: own.tolist() for name, own in found.groups.items()} == {
        name: own.tolist() for name, own in kept.groups.items()
    }
    everything = gram.conditioned(out, deviations)
    np.testing.assert_allclose(everything.matrix, precision, rtol=1e-9)
    np.testing.assert_allclose(everything.score, expected, rtol=1e-9)


def test_a_block_has_the_posterior_of_its_amplitudes():
    rng = np.random.default_rng(21)
    gram = LinearProblem.random(rng, {"a": 4}).observed(rng).gram()
    deviations = np.array([1e-3, 0.5, 3.0, 1e4])
    precision = gram.matrix + np.diag(deviations**-2)
    block = GaussianBlock.of(gram.matrix, deviations)
    np.testing.assert_allclose(block.covariance, np.linalg.inv(precision), rtol=1e-9)
    np.testing.assert_allclose(block.mean(gram.score), -np.linalg.solve(precision, gram.score), rtol=1e-9)
    scaled = np.eye(4) + deviations[:, None] * gram.matrix * deviations
    assert block.half_log_det == pytest.approx(0.5 * np.linalg.slogdet(scaled)[1], rel=1e-12)
    roots, half_log_det = covariance_roots(gram.matrix, np.stack([deviations, 2.0 * deviations]))
    np.testing.assert_allclose(roots[0].T @ roots[0], block.covariance, rtol=1e-9)
    assert half_log_det[0] == pytest.approx(block.half_log_det, rel=1e-12)


def test_a_gram_refuses_what_is_not_finite_and_does_not_fit():
    with pytest.raises(ValueError, match="matrix of a Gram must be finite"):
        Gram(np.full((1, 1), np.nan), np.zeros(1), {})
    with pytest.raises(ValueError, match="length 2"):
        Gram(np.eye(3), np.zeros(2), {})


# evidence -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("size", "amplitude"), [(1, 0.0), (1, 1.5), (3, 0.7), (9, 0.4), (20, 1.0)])
def test_evidence_of_one_group_is_the_dense_one_integrated_over_the_scale(size, amplitude):
    rng = np.random.default_rng([7, size])
    spread = rng.uniform(0.3, 3.0, size=size)
    problem = LinearProblem.random(rng, {"a": size}).observed(rng, {"a": amplitude * rng.normal(size=size)})
    low, high = 2e-3, 8.0
    without = problem.log_density({})

    def ratio(log_scale: float) -> float:
        return np.exp(problem.log_density({"a": np.exp(2.0 * log_scale) * spread}) - without)

    expected = np.log(integrate.quad(ratio, np.log(low), np.log(high), limit=200)[0] / np.log(high / low))
    found = SetEvidence(problem.gram(), [cause("a", low, high, spread)]).log_evidence(["a"])
    assert found == pytest.approx(expected, abs=0.02)


@pytest.mark.parametrize("one_cause", [False, True])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_evidence_of_two_groups_is_the_dense_one_integrated_over_both_scales(seed, one_cause):
    rng = np.random.default_rng([8, seed])
    spread = np.array([2.0, 0.5])
    problem = LinearProblem.random(rng, {"a": 3, "b": 2}, samples=15)
    problem.columns["b"][:, 0] += problem.columns["a"][:, 0]
    problem = problem.observed(rng, {"a": 0.8 * rng.normal(size=3), "b": seed * 0.5 * rng.normal(size=2)})
    low, high = 1e-2, 5.0
    without = problem.log_density({})

    def ratio(first: float, second: float) -> float:
        variances = {"a": np.exp(2.0 * first) * np.ones(3), "b": np.exp(2.0 * second) * spread}
        return np.exp(problem.log_density(variances) - without)

    ends = (np.log(low), np.log(high))
    expected = np.log(integrate.dblquad(ratio, *ends, *ends, epsabs=0.0, epsrel=1e-3)[0] / (ends[1] - ends[0]) ** 2)
    causes = [cause("a", low, high), cause("b", low, high, spread)]
    if one_cause:  # such as a leak, with force and torque
        causes = [CandidateCause("both", causes[1].groups + causes[0].groups)]
    evidence = SetEvidence(problem.gram(), causes)
    assert evidence.log_evidence(evidence.catalogue) == pytest.approx(expected, abs=0.02)


def test_scales_of_eight_decades_and_a_singular_gram_do_no_harm():
    rng = np.random.default_rng(9)
    problem = LinearProblem.random(rng, {"a": 2, "b": 3, "twice": 0})
    problem.columns["twice"] = np.concatenate([problem.columns["a"]] * 2, axis=1)
    problem = problem.observed(rng, {"a": np.array([3.0, -1.0])})
    once = [cause("a", 1e-4, 1e4, np.full(2, 2.0)), cause("b", 1e-4, 1e4)]
    twice = [cause("twice", 1e-4, 1e4), cause("b", 1e-4, 1e4)]
    expected = SetEvidence(problem.gram(), once)
    found = SetEvidence(problem.gram(), twice)
    assert expected.log_evidence(["a"]) > 10.0
    assert found.log_evidence(["twice"]) == pytest.approx(expected.log_evidence(["a"]), abs=2e-3)
    assert found.log_evidence(["b", "twice"]) == pytest.approx(expected.log_evidence(["a", "b"]), abs=2e-3)
    scores = found.gram.score[None]
    assert found.log_evidences(["twice"], scores)[0] == pytest.approx(expected.log_evidence(["a"]), abs=2e-3)
    posterior = AmplitudePosterior.of(found, ["twice"])
    assert posterior.mean[:2] + posterior.mean[2:] == pytest.approx(
        AmplitudePosterior.of(expected, ["a"]).mean, abs=1e-3
    )


def test_evidence_of_many_groups_adds_up_where_they_have_nothing_in_common():
    rng = np.random.default_rng(10)
    sizes = {"a": 1, "b": 4, "c": 2, "d": 1, "e": 3, "f": 1}
    ends = np.cumsum([0, *sizes.values()])
    groups = {name: np.arange(*pair) for name, pair in zip(sizes, pairwise(ends), strict=True)}
    scale = np.repeat([0.0, 1.0, 3.0, 10.0, 0.3, 30.0], list(sizes.values()))
    gram = Gram(np.eye(ends[-1]), scale * rng.normal(size=ends[-1]), groups)
    evidence = SetEvidence(gram, [cause(name, 1e-2, 1e3) for name in sizes])
    single = {name: evidence.log_evidence([name]) for name in sizes}
    for names, accuracy in (("ab", 1e-3), ("abc", 1e-3), ("abcd", 0.05), ("abcde", 0.2), ("bcdef", 0.2)):
        assert evidence.log_evidence(names) == pytest.approx(sum(single[name] for name in names), abs=accuracy)


def test_evidence_does_not_depend_on_any_order():
    rng = np.random.default_rng(11)
    problem = LinearProblem.random(rng, {"a": 2, "b": 2, "c": 3}).observed(rng)
    causes = [cause(name, None, 5.0) for name in "abc"]
    one, other = SetEvidence(problem.gram(), causes), SetEvidence(problem.gram(), causes[::-1])
    assert one.log_evidence("abc") == other.log_evidence("cab")
    assert one.catalogue == other.catalogue


def test_evidence_for_many_scores_is_that_for_each():
    rng = np.random.default_rng(12)
    problem = LinearProblem.random(rng, {"a": 2, "b": 3, "c": 1})
    problem = problem.observed(rng)
    pair = CandidateCause("pair", (AmplitudeGroup("a", 3.0), AmplitudeGroup("b", 5.0)))
    gram, causes = problem.gram(), [pair, cause("c", None, 4.0)]
    scores = 3.0 * gram.null_scores(rng, 5)
    evidence = SetEvidence(gram, causes)
    each = [SetEvidence(Gram(gram.matrix, score, gram.groups), causes) for score in scores]
    for names, accuracy in ((["c"], 1e-9), (["pair"], 1e-9), (["c", "pair"], 0.02)):
        expected = [item.log_evidence(names) for item in each]
        np.testing.assert_allclose(evidence.log_evidences(names, scores), expected, atol=accuracy)
    assert (evidence.log_evidences([], scores) == 0.0).all()


@pytest.mark.parametrize("size", [4, 120])
def test_evidence_beside_a_set_is_that_of_the_gram_that_the_set_leaves(size):
    """New eigenvectors where a group is small beside what was taken, an update of the old ones where it is large."""
    rng = np.random.default_rng(22)
    problem = LinearProblem.random(rng, {"a": 3, "b": size, "c": size}, samples=300)
    problem.columns["b"][:, :2] += 3.0 * problem.columns["a"][:, :2]
    problem = problem.observed(rng, {"a": np.array([1.0, -2.0, 0.5]), "b": np.full(size, 0.1)})
    gram = problem.gram()
    spread = np.linspace(1.0, 0.1, size)
    groups = [AmplitudeGroup("b", 30.0, 1e-4), AmplitudeGroup("b", 30.0, 1e-4, spread), AmplitudeGroup("c", 30.0, 1e-4)]
    columns, deviations = gram.groups["a"], np.array([0.1, 3.0, 1e4])
    found = log_evidences_beside(GroupSpectrum.of(groups, gram), columns, deviations, gram)
    expected = log_evidences(GroupSpectrum.of(groups, gram.conditioned(columns, deviations)))
    np.testing.assert_allclose(found, expected, atol=0.03)  # other nodes of the scale
    assert np.abs(found - log_evidences(GroupSpectrum.of(groups, gram))).max() > 1.0


def test_scores_of_nothing_have_the_gram_as_their_covariance():
    rng = np.random.default_rng(13)
    problem = LinearProblem.random(rng, {"a": 2, "b": 2})
    gram = problem.observed(rng).gram()
    simulated = np.array([problem.observed(rng).gram().score for _ in range(4000)])
    size = np.sqrt(np.outer(np.diag(gram.matrix), np.diag(gram.matrix)))
    for scores in (simulated, gram.null_scores(rng, 4000)):
        assert np.abs(scores.T @ scores / 4000 - gram.matrix).max() < 0.08 * size.max()


# scales ---------------------------------------------------------------------------------------------------------------


def test_evidence_of_every_form_is_that_of_its_group_by_itself():
    rng = np.random.default_rng(12)
    problem = LinearProblem.random(rng, {"a": 3, "b": 2}).observed(rng, {"a": np.array([0.5, 1.0, -2.0])})
    spreads = (np.ones(3), np.array([1.0, 0.1, 3.0]), np.array([0.2, 1.0, 1.0]))
    groups = [(AmplitudeGroup("a", 20.0, 1e-3, spread),) for spread in spreads]
    several = CandidateCause("several", groups[0], others=tuple(groups[1:]), shares=(0.5, 0.3, 0.2))
    gram = problem.gram()
    evidence = SetEvidence(gram, [cause("b", 1e-3, 20.0), several])
    alone = [SetEvidence(gram, [CandidateCause("own", own)]).log_evidence(["own"]) for own in groups]
    assert evidence.of_forms("several") == pytest.approx(np.array(alone) + np.log([0.5, 0.3, 0.2]), abs=1e-10)


def test_floor_set_by_the_data_is_where_evidence_ceases():
    rng = np.random.default_rng(14)
    gram = LinearProblem.random(rng, {"a": 2}).observed(rng).gram()
    group = AmplitudeGroup("a", 5.0, spread=np.array([4.0, 1.0]))
    found = scale_range(group, gram)
    root = np.array([2.0, 1.0])
    assert found.low**2 * np.linalg.eigvalsh(root[:, None] * gram.matrix * root).max() == pytest.approx(0.01)
    assert found.visible
    below = SetEvidence(gram, [cause("a", 0.1 * found.low, found.low, group.spread)])
    assert abs(below.log_evidence(["a"])) < 0.02


def test_what_cannot_be_seen_within_its_bound_says_so_and_has_no_evidence():
    rng = np.random.default_rng(15)
    problem = LinearProblem.random(rng, {"a": 2, "b": 2, "none": 1})
    problem.columns["none"] *= 0.0
    problem = problem.observed(rng, {"a": np.array([5.0, 5.0])})
    evidence = SetEvidence(problem.gram(), [cause("a", None, 1e-4), cause("b", None, 1.0), cause("none", None, 1e9)])
    assert evidence.invisible == ("a", "none")
    assert abs(evidence.log_evidence(["a"])) < 0.01
    assert evidence.log_evidence(["none"]) == 0.0
    assert evidence.log_evidence(["a", "b"]) == pytest.approx(evidence.log_evidence(["b"]), abs=0.01)


def test_impossible_scales_and_unknown_groups_are_refused():
    for arguments, message in (
        (("a", -1.0), "positive and finite, received -1"),
        (("a", 1.0, 2.0), r"\(0, 1.0\], received 2"),
        (("a", 1.0, None, np.zeros(2)), "relative variances must be positive"),
    ):
        with pytest.raises(ValueError, match=message):
            AmplitudeGroup(*arguments)
    gram = Gram(np.eye(2), np.zeros(2), {"a": np.arange(2)})
    with pytest.raises(ValueError, match="'b' needs groups of columns"):
        SetEvidence(gram, [cause("b", None, 1.0)])
    with pytest.raises(ValueError, match="two causes have the name 'a'"):
        SetEvidence(gram, [cause("a", None, 1.0), cause("a", None, 2.0)])
    with pytest.raises(ValueError, match="names one group of columns twice"):
        SetEvidence(gram, [CandidateCause("c", (AmplitudeGroup("a", 1.0), AmplitudeGroup("a", 2.0)))])
    with pytest.raises(ValueError, match="2 amplitudes need so many variances"):
        SetEvidence(gram, [cause("a", None, 1.0, np.ones(3))])


# amplitudes -----------------------------------------------------------------------------------------------------------


def test_amplitudes_have_the_mean_and_covariance_of_the_dense_mixture():
    rng = np.random.default_rng(16)
    spread = np.array([1.0, 3.0])
    problem = LinearProblem.random(rng, {"a": 2}, samples=12).observed(rng, {"a": np.array([0.4, -0.3])})
    low, high = 1e-2, 5.0
    logs = np.linspace(np.log(low), np.log(high), 400)
    weights = np.full(400, 1.0)
    weights[[0, -1]] = 0.5
    weights *= np.exp([problem.log_density({"a": np.exp(2.0 * x) * spread}) for x in logs])
    weights /= weights.sum()
    signature, noise = problem.columns["a"], np.eye(12) + problem.fitted @ problem.fitted.T
    means, covariances = [], []
    for x in logs:
        prior = np.diag(np.exp(2.0 * x) * spread)
        gain = prior @ signature.T @ np.linalg.inv(noise + signature @ prior @ signature.T)
        means.append(-gain @ problem.data)
        covariances.append(prior - gain @ signature @ prior)
    mean = weights @ np.array(means)
    offset = np.array(means) - mean
    covariance = np.einsum("t,tij->ij", weights, covariances) + np.einsum("t,ti,tj->ij", weights, offset, offset)
    posterior = AmplitudePosterior.of(SetEvidence(problem.gram(), [cause("a", low, high, spread)]), ["a"])
    deviation = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(posterior.mean, mean, atol=0.01 * deviation.min())
    np.testing.assert_allclose(posterior.covariance, covariance, atol=0.01 * deviation.min() ** 2)


def test_draws_of_amplitudes_and_their_limits_belong_to_the_same_posterior():
    rng = np.random.default_rng(17)
    problem = LinearProblem.random(rng, {"a": 2, "b": 1}).observed(rng, {"a": np.array([1.0, -0.2])})
    evidence = SetEvidence(problem.gram(), [cause("a", None, 5.0), cause("b", None, 5.0)])
    posterior = AmplitudePosterior.of(evidence, ["b", "a"])
    draws = draw(posterior, np.random.default_rng(0), 40_000)
    deviation = np.sqrt(np.diag(posterior.covariance))
    np.testing.assert_allclose(draws.mean(axis=0), posterior.mean, atol=5.0 * deviation.max() / 200.0)
    np.testing.assert_allclose(np.cov(draws.T), posterior.covariance, atol=0.04 * deviation.max() ** 2)
    for probability in (0.5, 0.95):
        within = (np.abs(draws) < posterior.upper_limits(probability)).mean(axis=0)
        np.testing.assert_allclose(within, probability, atol=0.01)
    assert set(posterior.amplitudes) == {("a", "a"), ("b", "b")}
    known = posterior.amplitudes["a", "a"]
    np.testing.assert_allclose(posterior.mean[known], [1.0, -0.2], atol=4.0 * deviation[known].max())
    with pytest.raises(ValueError, match=r"received 1\.5"):
        posterior.upper_limits(1.5)
    with pytest.raises(ValueError, match="at least one cause"):
        AmplitudePosterior.of(evidence, [])
