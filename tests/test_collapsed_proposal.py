"""The proposal for bodies that are known hardly better than before, against the whole posterior and other samplers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from bayesid.inference.collapsed_proposal import CollapsedProposal, collapsed_proposal, wide_coordinates
from bayesid.inference.ensemble import sample
from bayesid.inference.mode import Optimum, maximise
from bayesid.inference.parameterisation import LinearParameterisation, StudentT
from bayesid.inference.posterior import Posterior
from bayesid.simulation.effects import LinkInertia

pytestmark = pytest.mark.slow


class Case:
    """The small case, made by MuJoCo, with an unknown error of its last link."""

    def __init__(self, base: Posterior) -> None:
        posterior = Posterior.of(base.model.extend(LinkInertia("link2")), base.manoeuvres, step=0.5)
        self.posterior, self.optimum = maximise(posterior, np.random.default_rng(0))
        made = collapsed_proposal(self.posterior, self.optimum, np.random.default_rng(1), 1000.0)
        assert made is not None
        self.proposal: CollapsedProposal = made


@pytest.fixture(scope="module")
def case(planar_posterior: Callable[..., Posterior]) -> Case:
    return Case(planar_posterior(np.random.default_rng(3), step=0.5))


def test_the_whole_posterior_finds_its_draws_worth_more(case: Case) -> None:
    """The simulation, not linearised, weighs them; it is not quite linear, since 40 s tell little of the base."""
    parameterisation = LinearParameterisation(case.posterior)
    shares = []
    for proposal in (case.proposal, parameterisation.proposal(case.optimum)):
        y = proposal.draw(8192, np.random.default_rng(2))
        log_weights = parameterisation.log_density(y) - proposal.log_density(y)
        weights = np.exp(log_weights - log_weights.max()).reshape(16, 512)  # a few large ones decide a single share
        shares.append(np.median(weights.sum(axis=1) ** 2 / (weights**2).sum(axis=1)) / 512.0)
    assert shares[0] > 0.4
    assert shares[0] > 1.1 * shares[1], shares


def test_samples_with_it_have_the_moments_of_its_weighted_draws(case: Case) -> None:
    """emcee, with the proposal among its moves, against importance sampling by the whole posterior."""
    parameterisation = LinearParameterisation(case.posterior)
    chains = sample(
        parameterisation, case.optimum, 7, effective_samples=1500.0, trusted=True, proposal=case.proposal, max_steps=400
    )
    assert chains.converged
    y = case.proposal.draw(4096, np.random.default_rng(8))
    log_weights = parameterisation.log_density(y) - case.proposal.log_density(y)
    weights = np.exp(log_weights - log_weights.max())
    weights /= weights.sum()
    z = parameterisation.to_z(y)
    mean = weights @ z
    sd = np.sqrt(weights @ (z - mean) ** 2)
    error = np.sqrt((weights**2).sum() + 1.0 / chains.effective_samples)
    assert (np.abs(chains.flat.mean(axis=0) - mean) / sd).max() < 4.5 * error
    np.testing.assert_allclose(chains.flat.std(axis=0) / sd, 1.0, atol=6.0 * error)


def test_the_pool_is_that_of_another_sampler(case: Case) -> None:
    """Moments of the widely known bodies by importance sampling of their density."""
    own, wide = case.proposal, case.proposal.wide
    other = StudentT.about(case.optimum.z[wide], 1.5 * case.optimum.covariance[np.ix_(wide, wide)])
    draws = other.draw(60_000, np.random.default_rng(4))
    log_weights = own.log_marginal(draws) - other.log_density(draws)
    weights = np.exp(log_weights - log_weights.max())
    weights /= weights.sum()
    effective = 1.0 / (weights**2).sum()
    assert effective > 500.0
    mean = weights @ draws
    sd = np.sqrt(weights @ (draws - mean) ** 2)
    error = np.sqrt(1.0 / effective + 1.0 / own.effective_samples)
    assert (np.abs(own.pool.mean(axis=0) - mean) / sd).max() < 4.5 * error
    np.testing.assert_allclose(own.pool.std(axis=0) / sd, 1.0, atol=4.5 * error)


def test_all_else_is_drawn_as_its_density_says(case: Case) -> None:
    """Given one point of the wide bodies, quadratic log density and covariance of the draws agree."""
    own = replace(case.proposal, pool=case.proposal.pool[:1])
    y = own.draw(20_000, np.random.default_rng(5))[:, own.other]
    expected = np.linalg.inv(own.factor @ own.factor.T)
    np.testing.assert_allclose(y.std(axis=0), np.sqrt(np.diag(expected)), rtol=0.03)
    point = own.draw(1, np.random.default_rng(6))
    for index in own.other:
        size = np.sqrt(1.0 / (own.factor @ own.factor.T)[np.ix_(own.other == index, own.other == index)].item())
        values = own.log_density(point + size * np.array([[-1.0], [0.0], [1.0]]) * np.eye(point.shape[1])[index])
        assert values[0] - 2.0 * values[1] + values[2] == pytest.approx(-1.0, rel=1e-3)


def test_no_proposal_where_every_body_is_known_well_or_there_is_no_prior(case: Case) -> None:
    optimum: Optimum = replace(case.optimum, covariance=1e-6 * case.optimum.covariance)
    assert not len(wide_coordinates(case.posterior.unknowns, optimum))
    assert collapsed_proposal(case.posterior, optimum, np.random.default_rng(0)) is None
    assert collapsed_proposal(replace(case.posterior, flat_prior=True), case.optimum, np.random.default_rng(0)) is None
