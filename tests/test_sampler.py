"""Samplers: the interface, one of a user's own, one of another package, and the posterior as a plain object."""

from __future__ import annotations

from dataclasses import replace

import emcee
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

import bayesid
from bayesid.inference.ensemble import ENSEMBLES
from bayesid.inference.sampler import chains_of
from bayesid.report.identification_report import agreement_sentences


class Importance:
    """A user's own sampler: draws of the proposal with their weights."""

    def __init__(self, draws: int = 4000) -> None:
        self.draws = draws

    def sample(self, target, rng, *, effective_samples, progress):
        y = target.proposal.draw(self.draws, rng)
        log_weights = target.parameterisation.log_density(y) - target.proposal.log_density(y)
        weights = np.exp(log_weights - log_weights.max())
        return bayesid.PosteriorDraws(target.parameterisation.to_z(y), weights, evaluations=self.draws)


BROAD = 3.0
"""Width of the prior that nested sampling starts from, in those of the Laplace approximation, as it would take minutes
from the posterior's own."""


class Broad:
    """A posterior as nested samplers want it: a transform of the unit cube, and what is left of the log density."""

    def __init__(self, target) -> None:
        self.posterior, self.centre = target.posterior, target.optimum.z
        self.factor = BROAD * np.linalg.cholesky(target.optimum.covariance)
        self.prior = stats.multivariate_normal(self.centre, self.factor @ self.factor.T)

    def transform(self, unit):
        return self.centre + self.posterior.prior_transform(unit) @ self.factor.T

    def log_likelihood(self, z):
        return np.maximum(self.posterior.log_density(z) - self.prior.logpdf(z), -1e300)


class Dynesty:
    """Nested sampling by dynesty, one point at a time."""

    def sample(self, target, rng, *, effective_samples, progress):
        from dynesty import NestedSampler

        broad, n = Broad(target), target.posterior.size
        sampler = NestedSampler(broad.log_likelihood, broad.transform, n, nlive=35, rstate=rng)
        sampler.run_nested(print_progress=False, dlogz=1.0)
        results = sampler.results
        self.log_evidence, self.error = float(results.logz[-1]), float(results.logzerr[-1])
        calls = int(results.ncall.sum())
        return bayesid.PosteriorDraws(results.samples, results.importance_weights(), evaluations=calls)


def agree(result: bayesid.Identification, deviations: float = 4.0) -> None:
    """Samples, which are of chi-square as importance sampling has it, within their Monte Carlo error."""
    evidence, draws = result.evidence, result.chains.flat
    assert evidence.trusted
    error = evidence.sd * np.sqrt(1.0 / result.chains.effective_samples + 1.0 / evidence.effective_samples)
    np.testing.assert_array_less(np.abs(draws.mean(axis=0) - evidence.mean), deviations * error)
    # a standard deviation is known to one part in the root of twice as many draws, for normal ones
    np.testing.assert_array_less(np.abs(draws.std(axis=0) / evidence.sd - 1.0), deviations * error / evidence.sd)


@pytest.mark.slow
def test_a_users_own_sampler_takes_the_place_of_emcee(planar_case):
    result = bayesid.identify(planar_case.posterior, 3, effective_samples=1000.0, sampler=Importance())
    agree(result)
    assert result.chains.converged
    assert result.chains.evaluations == 4000
    assert result.to_dict()["sampler"]["evaluations"] == 4000
    expected = result.posterior.log_density(result.chains.flat[:5])
    np.testing.assert_allclose(result.chains.log_density[0, :5], expected, rtol=1e-12)
    drawn = bayesid.PosteriorDraws(result.chains.flat[:400])
    few = replace(result, chains=chains_of(result.posterior, drawn, np.random.default_rng(1), 1000.0))
    assert not few.chains.converged
    assert any("has not converged" in sentence for sentence in few.disagreements)
    assert "a user-supplied sampler, 4 chains of 100 draws" in agreement_sentences(few)[1]


@pytest.mark.parametrize(
    ("drawn", "message"),
    [
        (lambda n: bayesid.PosteriorDraws(np.zeros((50, n + 1))), "draws of shape"),
        (lambda n: bayesid.PosteriorDraws(np.zeros((2, n))), "draws of shape"),
        (lambda n: bayesid.PosteriorDraws(np.zeros((50, n)), np.zeros(50)), "no positive one"),
        (lambda n: bayesid.PosteriorDraws(np.zeros((50, n)), np.ones(49)), "weights of shape"),
        (lambda n: bayesid.PosteriorDraws(np.full((50, n), np.nan)), "no finite density"),
    ],
)
def test_what_is_no_sample_is_refused(drawn, message, planar_case):
    posterior = planar_case.posterior
    with pytest.raises(bayesid.InputError, match=message):
        chains_of(posterior, drawn(posterior.size), np.random.default_rng(0), 100.0)


def test_resampling_keeps_the_weights(planar_case):
    n, rng = planar_case.posterior.size, np.random.default_rng(5)
    z, weights = 0.1 * rng.normal(size=(800, n)), rng.uniform(size=800) ** 4
    chains = chains_of(planar_case.posterior, bayesid.PosteriorDraws(z, 7.0 * weights), rng, 100.0)
    assert chains.z.shape == (ENSEMBLES, 800 // ENSEMBLES, n)
    assert chains.effective_samples == pytest.approx(weights.sum() ** 2 / (weights**2).sum())
    for one, weight in zip(z, weights * 800 / weights.sum(), strict=True):
        times = (chains.flat == one).all(axis=1).sum()
        assert np.floor(weight) <= times <= np.ceil(weight)


@pytest.mark.slow
def test_a_file_of_emcee_is_reachable(planar_case, tmp_path):
    backend = emcee.backends.HDFBackend(str(tmp_path / "steps.h5"), name="flight")
    sampler = bayesid.Emcee(max_steps=10, file=backend)
    result = bayesid.identify(planar_case.posterior, 1, effective_samples=1e5, sampler=sampler)
    kept = emcee.backends.HDFBackend(str(tmp_path / "steps.h5"), name="flight-2", read_only=True)
    assert kept.iteration == result.chains.steps == 10
    burnt = kept.get_chain()[-result.chains.y.shape[1] // result.chains.walkers :]
    np.testing.assert_array_equal(burnt.reshape(-1, planar_case.posterior.size), result.chains.y[2])
    with pytest.raises(bayesid.InputError, match="a file of emcee"):
        bayesid.identify(planar_case.posterior, sampler=sampler, file=tmp_path / "other.h5")


@pytest.mark.slow
def test_the_sampler_of_another_package_agrees_with_importance_sampling(planar_case):
    pytest.importorskip("dynesty", reason="dynesty is among the extra 'peers'")
    sampler = Dynesty()
    result = bayesid.identify(planar_case.posterior, 2, effective_samples=800.0, sampler=sampler)
    agree(result)
    # nested sampling starts from the prior, and importance sampling from the mode
    assert abs(sampler.log_evidence - result.evidence.value) < 4.0 * np.hypot(sampler.error, result.evidence.error)


def test_the_density_is_prior_times_likelihood(planar_case):
    posterior = planar_case.posterior
    z = posterior.starting_point() + 0.01 * np.random.default_rng(1).normal(size=(2, 3, posterior.size))
    prior, likelihood = posterior.log_prior(z), posterior.log_likelihood(z)
    assert prior.shape == likelihood.shape == posterior.log_density(z).shape == (2, 3)
    np.testing.assert_allclose(posterior.log_density(z), prior + likelihood, rtol=1e-14)
    np.testing.assert_allclose(prior, stats.multivariate_normal(np.zeros(posterior.size)).logpdf(z), rtol=1e-12)
    assert posterior.log_density(z[0, 0]).shape == ()
    assert posterior.log_density(z[0, 0]) == pytest.approx(posterior.log_density(z)[0, 0], rel=1e-13)
    assert float(posterior.traced_log_density(jnp.asarray(z[1, 2]))) == pytest.approx(
        posterior.log_density(z)[1, 2], rel=1e-12
    )
    assert len(posterior.names) == posterior.size
    with pytest.raises(bayesid.InputError, match="numbers of type float32"):
        posterior.traced_log_density(jnp.asarray(z[1, 2], dtype=jnp.float32))


def test_the_transform_of_the_unit_cube_gives_the_prior(planar_case):
    posterior = planar_case.posterior
    unit = np.random.default_rng(2).uniform(size=(4000, posterior.size))
    z = posterior.prior_transform(unit)
    np.testing.assert_allclose(stats.norm.cdf(z), unit, atol=1e-12)  # the prior's own quantiles
    assert posterior.prior_transform(unit[0]).shape == (posterior.size,)
    # moments of the physical rates, which are normal
    rate = posterior.unknowns.values_of(z).rate[:, 0]
    sigma = posterior.unknowns.rate_sigma
    np.testing.assert_allclose(rate.std(axis=0), sigma, rtol=5.0 / np.sqrt(2 * 4000))
    np.testing.assert_allclose(rate.mean(axis=0), 0.0, atol=5.0 * sigma / np.sqrt(4000))


def test_jacobian_and_gradient_are_those_of_finite_differences(planar_case):
    posterior = planar_case.posterior
    z = posterior.starting_point() + 0.02
    jacobian, gradient, step = posterior.jacobian(z), posterior.gradient(z), 1e-5
    assert jacobian.shape == (posterior.least_squares(z).size, posterior.size)
    for index in (0, 4, posterior.size - 1):
        along = step * np.eye(posterior.size)[index]
        difference = (posterior.least_squares(z + along) - posterior.least_squares(z - along)) / (2.0 * step)
        np.testing.assert_allclose(jacobian[:, index], difference, rtol=1e-5, atol=1e-5 * np.abs(difference).max())
        slope = (posterior.log_density(z + along) - posterior.log_density(z - along)) / (2.0 * step)
        assert gradient[index] == pytest.approx(slope, rel=1e-4)
