"""Signatures are what candidates change in the simulation; their Gram gives the evidence of the full model."""

from __future__ import annotations

import copy
from types import SimpleNamespace

import numpy as np
import pytest

from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.diagnosis import candidates
from bayesid.diagnosis.candidates.instant_cause import MassShiftCause, grid_instants
from bayesid.diagnosis.candidates.linear_cause import LinearCause
from bayesid.diagnosis.candidates.linear_model import SignatureProducts, Signatures
from bayesid.diagnosis.candidates.vibration_cause import PAIRS, slosh_entries
from bayesid.diagnosis.evidence.body_evidence import MissingBody, outer_moments, rigid_moments
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.response.perturbed_model import PerturbedModel
from bayesid.inference.importance import choose_parameterisation, importance_sample
from bayesid.inference.mode import maximise
from bayesid.inference.posterior import Posterior
from bayesid.simulation.effects import FuelSlosh, MassShift, bounds_by_label
from studies.truth import hidden_causes
from tests.gram_problem import LinearProblem

CASES = {case.name: case for case in hidden_causes.CASES}


@pytest.fixture(scope="module")
def null(tmp_path_factory):
    """PerturbedModel and fit of a study of MuJoCo that lacks nothing, with its candidates and their bounds."""
    study = Study.load(CASES["null, three joints"].make(tmp_path_factory.mktemp("null"), 5))
    model = load_model(study)
    perturbed = PerturbedModel(Posterior.of(model, load_manoeuvres(study, model.robot)))
    effects = candidates(model, knows_latitude=False)
    return perturbed, perturbed.fit(), effects, bounds_by_label(effects, model)


def in_simulation(perturbed, fit, effects, size):
    """Central differences of the full simulation's residual in the parameters of the effects, divided by `size`."""
    model = perturbed.posterior.model
    for effect in effects:
        model = model.extend(effect)
    posterior = Posterior.of(model, perturbed.posterior.manoeuvres, step=None)
    bare = np.zeros(posterior.size - len(fit.z))
    columns = []
    for k in range(len(bare)):
        sides = []
        for sign in (1.0, -1.0):
            there = bare.copy()
            there[k] = sign * size
            sides.append(posterior.residuals(np.concatenate([fit.z, there])).ravel())
        columns.append((sides[0] - sides[1]) / (2.0 * size))
    return np.stack(columns, axis=1)


def check_columns(null, labels):
    perturbed, fit, effects, bounds = null
    chosen = [effect for effect in effects if effect.label in labels]
    linear = [effect.in_amplitudes() for effect in chosen]
    expected, first = in_simulation(perturbed, fit, linear, 1e-3), 0
    for effect, simple in zip(chosen, linear, strict=True):
        bank = LinearCause().signatures(perturbed, fit, [effect], bounds)
        found = np.concatenate([item.columns for item in bank.signatures], axis=1)
        sigma = np.array([parameter.sigma for parameter in simple.parameters])
        own = expected[:, first : first + len(sigma)] / sigma
        assert np.linalg.norm(found - own) < 0.02 * np.linalg.norm(own), effect.label
        first += len(sigma)
    assert first == expected.shape[1]


@pytest.mark.slow
@pytest.mark.parametrize("label", ["thruster-leak", "payload:link3"])
def test_signatures_are_what_the_simulation_does(label, null):
    check_columns(null, [label])


@pytest.mark.usefixtures("slow")  # all effects in one model
def test_all_signatures_are_what_the_simulation_does(null):
    _, _, effects, _ = null
    labels = []
    for effect in effects:
        several = effect.modes_count or effect.per_recording or isinstance(effect, MassShift)
        if effect.in_amplitudes().parameters and not several:
            labels.append(effect.label)
    assert len(labels) >= 30
    check_columns(null, labels)


@pytest.mark.slow
def test_signatures_of_a_jump_are_what_the_simulation_does(null):
    perturbed, fit, effects, bounds = null
    bank = MassShiftCause().signatures(perturbed, fit, MassShiftCause().of(effects), bounds)
    end = float(np.asarray(fit.operating.node.environment.time)[0].max())
    instant = float(grid_instants(end)[7])
    recordings = len(perturbed.posterior.manoeuvres)
    shift = MassShift([instant] + [np.inf] * (recordings - 1)).attach(perturbed.posterior.model.robot)
    expected = in_simulation(perturbed, fit, [shift], 1e-2)
    found = bank.signatures[7].columns
    rows = len(found)
    assert bank.signatures[7].recording == 0
    assert np.abs(expected[rows:]).max() == 0.0
    assert np.linalg.norm(found - expected[:rows]) < 0.02 * np.linalg.norm(expected)


def test_coupling_of_slosh_is_linear_in_the_moments_of_its_mass():
    values = np.array([3.0, 0.2, 0.01, 0.4, -0.7, 0.3])
    modes = FuelSlosh().modes(values)
    coupling = np.concatenate([np.asarray(modes.linear), np.asarray(modes.angular)], axis=1)
    matrix = coupling.T @ coupling
    moments = outer_moments(np.concatenate([[np.log(3.0)], values[3:]]))
    assert slosh_entries() @ moments == pytest.approx([matrix[i, j] for i, j in PAIRS], abs=1e-12)


@pytest.mark.parametrize("moments", [outer_moments, rigid_moments])
def test_evidence_of_a_body_is_that_of_a_sum_over_its_prior(moments):
    rng = np.random.default_rng(1)
    lightest, body = 0.05, MissingBody(20.0, 2.0, (0.0,), moments)
    mean = np.array([0.5 * np.log(lightest * body.heaviest), 0.0, 0.0, 0.0])
    sd = np.array([np.log(body.heaviest / lightest) / np.sqrt(12.0), *[0.5 * body.reach] * 3])
    columns = rng.normal(size=(40, 10)) * np.array([1.0, *[2.0] * 3, *[3.0] * 6])
    true = moments(np.array([np.log(1.5), 0.4, -0.3, 0.2]))
    residual = rng.normal(size=40) - columns @ true
    matrix, score = columns.T @ columns, columns.T @ residual
    draws = mean + sd * rng.normal(size=(100_000, 4))
    values = np.array([moments(theta) for theta in draws])
    logs = -values @ score - 0.5 * np.einsum("ni,ij,nj->n", values, matrix, values)
    expected = float(np.log(np.mean(np.exp(logs - logs.max()))) + logs.max())
    laplace = body.log_evidence(matrix, score, lightest)
    assert laplace == pytest.approx(expected, abs=0.5)  # the moments are not linear in the place
    assert body.log_evidence(matrix, -score, lightest) < expected - 10.0  # a body has no negative mass


def test_forms_of_a_cause_are_averaged_and_what_is_fixed_has_no_freedom():
    rng = np.random.default_rng(2)
    problem = LinearProblem.random(rng, {"a": 2, "b": 2, "c": 1}).observed(rng, {"c": np.array([1.0])})
    gram = problem.gram()
    whole = CandidateCause("forms", (AmplitudeGroup("a", 2.0, 0.1),), others=((AmplitudeGroup("b", 2.0, 0.1),),))
    single = [CandidateCause(name, (AmplitudeGroup(name, 2.0, 0.1),)) for name in "ab"]
    fixed = CandidateCause("there", (AmplitudeGroup("c", 1.0),), fixed=True)
    evidence = SetEvidence(gram, [whole, *single, fixed])
    parts = [evidence.log_evidence([name]) for name in "ab"]
    assert evidence.log_evidence(["forms"]) == pytest.approx(np.logaddexp(*parts) - np.log(2.0), abs=1e-9)
    moved = LinearProblem(problem.fitted, problem.columns, problem.data + problem.columns["c"][:, 0])
    expected = moved.log_density({}) - problem.log_density({})
    assert evidence.log_evidence(["there"]) == pytest.approx(expected, abs=1e-6)
    beside = SetEvidence(moved.gram(), single).log_evidence(["a"])
    assert evidence.log_evidence(["a", "there"]) == pytest.approx(expected + beside, abs=1e-6)
    scores = np.stack([gram.score, 0.5 * gram.score])
    assert evidence.log_evidences(["a", "there"], scores)[0] == pytest.approx(expected + beside, abs=1e-6)


def test_products_of_signatures_that_join_others_are_those_of_all_together():
    """Signatures of all recordings and of one, of which some are known; those that are left out are forgotten."""
    rng, rows = np.random.default_rng(4), 30
    fit = SimpleNamespace(
        posterior=SimpleNamespace(manoeuvres=[0, 1, 2], residual_shape=(3, rows, 1)),
        residual=rng.normal(size=3 * rows),
        own=rng.normal(size=(3 * rows, 4)),
        own_coordinates=rng.normal(size=4),
    )
    whole = [Signatures(name, rng.normal(size=(3 * rows, k))) for name, k in (("a", 2), ("b", 1), ("c", 3))]
    single = [Signatures("d", rng.normal(size=(rows, 2)), r) for r in (1, 2)]
    every = [whole[2], single[0], whole[0], single[1], whole[1]]
    known = SignatureProducts.of([whole[0], single[0], whole[1]], fit)
    found, expected = SignatureProducts.of(every, fit, known), SignatureProducts.of(every, fit)
    columns = []
    for item in every:
        count = item.columns.shape[1]
        placed = np.zeros((3, rows, count))
        placed[slice(None) if item.recording is None else [item.recording]] = item.columns.reshape(-1, rows, count)
        columns.append(placed.reshape(3 * rows, count))
    separate = np.concatenate(columns, axis=1)
    for products in (found, expected):
        full = np.zeros_like(separate)
        full[:, np.concatenate(products.places)] = separate
        np.testing.assert_allclose(products.matrix, full.T @ full, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(products.score, full.T @ fit.residual, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(products.shared, fit.own.T @ full, rtol=1e-12, atol=1e-12)
        taken = full.T @ fit.own @ np.linalg.inv(fit.own.T @ fit.own + np.eye(4)) @ fit.own.T @ full
        gram = products.gram()
        np.testing.assert_allclose(gram.matrix, full.T @ full - taken, atol=1e-9)
        for name in "abcd":
            own = [where for item, where in zip(every, products.places, strict=True) if item.name == name]
            np.testing.assert_array_equal(gram.groups[name], np.concatenate(own))
        union = products.gram({"a and d": ("a", "d")}).groups["a and d"]
        np.testing.assert_array_equal(union, np.concatenate([gram.groups["a"], gram.groups["d"]]))


SETS = (
    ("rate-bias",),
    ("accel-bias",),
    ("wheel-momentum",),
    ("thruster-leak",),
    ("rate-scale",),
    ("accel-position",),
    ("rate-drift",),
    ("encoder-offset:joint1",),
    ("rate-bias", "wheel-momentum"),
    ("accel-scale", "rate-drift"),
)
"""Sets whose evidence is compared with that of the extended model."""


@pytest.mark.usefixtures("slow")  # an extended model is sampled eleven times
def test_evidence_of_the_gram_is_that_of_the_extended_model(null):
    perturbed, fit, effects, bounds = null
    wanted = {name for own in SETS for name in own}
    chosen = [effect for effect in effects if effect.label in wanted]
    bank = LinearCause().signatures(perturbed, fit, chosen, bounds)
    gram = SignatureProducts.of(bank.signatures, fit).gram()
    scales = {name: 4.0 / np.sqrt(np.diag(gram.matrix)[own].max()) for name, own in gram.groups.items()}
    causes = [
        CandidateCause(
            cause.name,
            tuple(AmplitudeGroup(group.name, scales[group.name], scales[group.name]) for group in cause.groups),
        )
        for cause in bank.causes
    ]
    evidence = SetEvidence(gram, causes)
    base = sampled_evidence(perturbed, chosen, (), scales)
    for names in SETS:
        expected = sampled_evidence(perturbed, chosen, names, scales) - base
        assert evidence.log_evidence(names) == pytest.approx(expected, abs=0.3), names


def with_scales(effect, scales, factor):
    """Return an effect with standard deviations that are `factor` of those of its groups."""
    changed = copy.copy(effect)
    changed.parameters = tuple(
        p._replace(sigma=factor * scales.get(f"{effect.label} [{p.unit}]", scales.get(effect.label)))
        for p in effect.parameters
    )
    return changed


def sampled_evidence(perturbed, effects, names, scales) -> float:
    """Log evidence by importance sampling in the full simulation, which is extended by all effects.

    The prior of those that are not named is a millionth as wide, so that one compiled model serves every set.
    """
    rng = np.random.default_rng(0)
    model = perturbed.posterior.model
    for effect in effects:
        model = model.extend(with_scales(effect, scales, 1.0 if effect.label in names else 1e-6))
    posterior, optimum = maximise(Posterior.of(model, perturbed.posterior.manoeuvres), rng)
    found = importance_sample(choose_parameterisation(posterior, optimum, rng), optimum, rng)
    assert found.error < 0.1
    return found.value
