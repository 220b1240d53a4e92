"""Optimum, evidence and samples: against closed forms, against each other, and against the truth over many noises."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import emcee
import numpy as np
import pytest
from scipy.stats import chi2 as chi2_distribution
from scipy.stats import kstest, norm

from bayesid._io.errors import InputError
from bayesid.inference import identification, integration_step
from bayesid.inference.ensemble import BLOCK, LaplaceMove, autocorrelation_time, sample
from bayesid.inference.identification import identify
from bayesid.inference.importance import importance_sample
from bayesid.inference.mode import Optimum, fit, maximise
from bayesid.inference.noise_changes import with_manoeuvres
from bayesid.inference.parameterisation import LogCholeskyParameterisation, StudentT
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.robot.body_prior import coordinates_of
from bayesid.simulation.model import Manoeuvre

# a posterior known in closed form -------------------------------------------------------------------------------------


class LinearGaussian:
    """y = A z + noise with a standard-normal prior of z: the evidence is a normal density of y."""

    def __init__(self, size: int = 4, seed: int = 0) -> None:
        rng = np.random.default_rng(seed)
        self.size, self.calls, self.limit = size, 0, np.inf
        self.matrix, self.sigma = rng.normal(size=(30, size)), 0.5
        self.y = self.matrix @ rng.normal(size=size) + self.sigma * rng.normal(size=30)
        self.unknowns = SimpleNamespace(names=tuple(f"z{k}" for k in range(size)))

    def log_density(self, z: np.ndarray) -> np.ndarray:
        self.calls += 1
        if self.calls > self.limit:
            raise KeyboardInterrupt
        z = np.atleast_2d(z)
        squares = (((self.y - z @ self.matrix.T) / self.sigma) ** 2).sum(axis=1) + (z**2).sum(axis=1)
        return -0.5 * (squares + (30 + self.size) * np.log(2.0 * np.pi)) - 30 * np.log(self.sigma)

    def log_densities(self, z: np.ndarray) -> np.ndarray:
        """The data are one recording."""
        z = np.atleast_2d(z)
        total = self.log_density(z)
        prior = -0.5 * (z**2).sum(axis=1) - 0.5 * self.size * np.log(2.0 * np.pi)
        return np.column_stack([total, total - prior])

    @property
    def optimum(self) -> Optimum:
        hessian = np.eye(self.size) + self.matrix.T @ self.matrix / self.sigma**2
        mode = np.linalg.solve(hessian, self.matrix.T @ self.y / self.sigma**2)
        return Optimum(mode, np.linalg.inv(hessian), 0.0, 0.0, 1, True)

    @property
    def log_evidence(self) -> float:
        covariance = self.matrix @ self.matrix.T + self.sigma**2 * np.eye(30)
        quadratic = self.y @ np.linalg.solve(covariance, self.y)
        return -0.5 * (30 * np.log(2.0 * np.pi) + np.linalg.slogdet(covariance)[1] + quadratic)


@pytest.mark.parametrize("size", [2, 8])
def test_evidence_of_a_linear_gaussian_model(size):
    """Laplace is exact; importance sampling within four of its own errors, which are small."""
    stub = LinearGaussian(size)
    optimum = stub.optimum
    assert optimum.log_evidence(stub) == pytest.approx(stub.log_evidence, abs=1e-9)
    found = importance_sample(LogCholeskyParameterisation(stub), optimum, np.random.default_rng(1))
    assert found.trusted
    assert found.error < 0.03
    assert abs(found.value - stub.log_evidence) < 4.0 * found.error
    sd = np.sqrt(np.diag(optimum.covariance))
    standard_error = 1.0 / np.sqrt(found.effective_samples)
    assert (np.abs(found.mean - optimum.z) < 4.5 * sd * standard_error).all()
    np.testing.assert_allclose(found.sd, sd, rtol=4.5 * standard_error)


def test_the_stated_error_of_the_evidence_is_its_scatter():
    """Over 60 seeds the scatter has a relative standard error of 9 %; four of them."""
    stub = LinearGaussian(6)
    parameterisation = LogCholeskyParameterisation(stub)
    runs = [importance_sample(parameterisation, stub.optimum, np.random.default_rng(k), 500) for k in range(60)]
    values, errors = np.array([(run.value, run.error) for run in runs]).T
    assert values.std() == pytest.approx(np.sqrt((errors**2).mean()), rel=0.37)
    assert abs(values.mean() - stub.log_evidence) < 4.0 * values.std() / np.sqrt(60)


def test_a_bad_proposal_is_not_trusted():
    """A tenth of the true width: the weights have no variance, and k-hat says so."""
    stub = LinearGaussian(4)
    good = stub.optimum
    narrow = Optimum(good.z, good.covariance * 0.01, 0.0, 0.0, 1, True)
    assert not importance_sample(LogCholeskyParameterisation(stub), narrow, np.random.default_rng(0)).trusted


def test_student_t_is_normalised_and_drawn_as_stated():
    """Importance-weighted against a wide normal it integrates to one; draws have covariance S nu / (nu - 2)."""
    covariance = np.array([[1.0, 0.6], [0.6, 2.0]])
    proposal = StudentT.about(np.array([1.0, -2.0]), covariance)
    rng, count = np.random.default_rng(0), 100000
    assert proposal.freedom == 8.0
    wide = rng.normal(size=(count, 2)) * 4.0 + proposal.mean
    weight = np.exp(proposal.log_density(wide) - norm.logpdf(wide, proposal.mean, 4.0).sum(axis=1))
    assert abs(weight.mean() - 1.0) < 4.5 * weight.std() / np.sqrt(count)
    draws = proposal.draw(count, rng)
    np.testing.assert_allclose(np.cov(draws.T), covariance * 8.0 / 6.0, atol=0.06)
    np.testing.assert_allclose(draws.mean(axis=0), proposal.mean, atol=5.0 * np.sqrt(2.0 * 8.0 / 6.0 / count))


# the sampler ----------------------------------------------------------------------------------------------------------


def banana(z: np.ndarray) -> np.ndarray:
    """x normal, y given x normal about x^2 - 1."""
    return norm.logpdf(z[:, 0]) + norm.logpdf(z[:, 1], z[:, 0] ** 2 - 1.0, 0.7)


def test_the_laplace_move_leaves_a_non_gaussian_target_as_it_is():
    """Walkers drawn exactly stay so distributed: x and the conditional residual of y pass Kolmogorov-Smirnov."""
    rng, walkers = np.random.default_rng(0), 3000
    x = rng.normal(size=walkers)
    start = np.stack([x, x**2 - 1.0 + 0.7 * rng.normal(size=walkers)], axis=1)
    move = LaplaceMove(StudentT.about(np.array([0.3, -0.8]), np.array([[1.2, 0.4], [0.4, 1.5]])))
    sampler = emcee.EnsembleSampler(walkers, 2, banana, moves=move, vectorize=True)
    sampler.random_state = np.random.RandomState(1).get_state()
    end = sampler.run_mcmc(start, 25).coords
    assert 0.2 < sampler.acceptance_fraction.mean() < 0.9
    assert (end != start).all(axis=1).mean() > 0.9
    assert kstest(end[:, 0], norm.cdf).pvalue > 1e-3
    assert kstest((end[:, 1] - end[:, 0] ** 2 + 1.0) / 0.7, norm.cdf).pvalue > 1e-3


def drawn(stub: LinearGaussian, seed: int = 3, **options):
    parameterisation = LogCholeskyParameterisation(stub)
    return sample(parameterisation, stub.optimum, seed, **{"effective_samples": 1e9, "max_steps": 150, **options})


def test_samples_of_a_known_posterior():
    stub = LinearGaussian(4)
    chains = drawn(stub, effective_samples=3000.0, max_steps=3000)
    assert chains.converged
    assert chains.r_hat < 1.01
    sd = np.sqrt(np.diag(stub.optimum.covariance))
    error = sd / np.sqrt(chains.effective_samples)
    assert (np.abs(chains.flat.mean(axis=0) - stub.optimum.z) < 4.5 * error).all()
    np.testing.assert_allclose(np.cov(chains.flat.T), stub.optimum.covariance, atol=0.1 * sd.max() ** 2)
    np.testing.assert_allclose(chains.log_density.ravel()[:50], stub.log_density(chains.flat[:50]), rtol=1e-12)
    likelihoods = stub.log_densities(chains.flat)[:, 1]
    np.testing.assert_allclose(chains.log_likelihood.ravel(), likelihoods, rtol=1e-12)


def test_the_autocorrelation_time_of_short_chains():
    """Autoregressive walkers of lag-one correlation 2/3 have one of 5 steps; 20 times that is long enough, within 7 %.

    An estimate that takes each walker's mean for the true one would give about half.
    """
    rng, correlation = np.random.default_rng(5), 2.0 / 3.0
    chain = np.empty((100, 200, 2))
    chain[0] = rng.normal(size=(200, 2))
    for step in range(1, len(chain)):
        chain[step] = correlation * chain[step - 1] + np.sqrt(1.0 - correlation**2) * rng.normal(size=(200, 2))
    assert autocorrelation_time(chain) == pytest.approx((1.0 + correlation) / (1.0 - correlation), rel=0.07)


def test_a_chain_that_ends_before_the_window_is_not_called_short():
    slow = np.cumsum(np.random.default_rng(4).normal(size=(100, 10, 2)), axis=0)
    assert autocorrelation_time(slow) >= 20.0
    still = np.linspace(0.0, 1.0, 30)[:, None, None] + np.zeros((30, 4, 1))
    still[:, 2:] *= -1.0  # walkers that keep their sides
    assert autocorrelation_time(still) == 30.0


@pytest.mark.slow
@pytest.mark.parametrize("trusted", [False, True])
def test_means_scatter_as_the_effective_samples_say(trusted):
    """Over 15 seeds and four coordinates, within four standard errors; the worst coordinate sets the size."""
    stub = LinearGaussian(4)
    runs = [drawn(stub, seed, effective_samples=1000.0, max_steps=400, trusted=trusted) for seed in range(15)]
    assert all(run.converged for run in runs)
    sd = np.sqrt(np.diag(stub.optimum.covariance))
    off = [(run.flat.mean(axis=0) - stub.optimum.z) / sd * np.sqrt(run.effective_samples) for run in runs]
    assert 0.64 < np.sqrt(np.mean(np.square(off))) < 1.36


@pytest.mark.slow
def test_the_same_seed_gives_the_same_chains_and_another_does_not(tmp_path):
    first, again, other = (drawn(LinearGaussian(), seed=seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(first.z, again.z)
    assert not np.array_equal(first.z, other.z)
    on_disk = drawn(LinearGaussian(), seed=3, file=tmp_path / "chain.h5")
    np.testing.assert_array_equal(first.z, on_disk.z)


def test_a_run_that_does_not_converge_says_so():
    chains = drawn(LinearGaussian())
    assert chains.steps == 150
    assert not chains.converged


def test_walkers_that_accept_no_proposal_are_given_up_early():
    """The proposal is a hundred times as wide as the posterior, and said to be trusted: the sampler ends by itself."""
    stub = LinearGaussian(6)
    wide = StudentT.about(stub.optimum.z, 1e4 * stub.optimum.covariance)
    chains = drawn(stub, trusted=True, proposal=wide, max_steps=3000)
    assert chains.stuck
    assert not chains.converged
    assert chains.steps < 300
    assert not drawn(stub, trusted=True, max_steps=250).stuck


def test_data_that_no_unknowns_follow_are_refused(planar_posterior, monkeypatch):
    posterior = planar_posterior(np.random.default_rng(0), step=0.5)
    far = Optimum(posterior.starting_point(), np.eye(posterior.size), 1e9 * posterior.samples, 0.0, 1, False)
    monkeypatch.setattr(identification, "maximise", lambda posterior, rng, start=None: (posterior, far))
    with pytest.raises(InputError, match=r"chi-square per sample is 1e\+09.*bayesid diagnose"):
        identify(posterior)


def interrupt_between_blocks(stub, file):
    def stop(fraction, text):
        assert text.startswith(f"step {BLOCK},")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        drawn(stub, file=file, progress=stop)


def interrupt_within(stub, file, calls: int):
    stub.limit = calls
    with pytest.raises(KeyboardInterrupt):
        drawn(stub, file=file)
    stub.limit = np.inf


@pytest.fixture(scope="module")
def whole():
    """A run that nothing interrupts."""
    return drawn(LinearGaussian())


@pytest.mark.slow
@pytest.mark.parametrize("calls", [None, 60, 2, 330])
def test_an_interrupted_run_goes_on_as_if_nothing_had_happened(calls, whole, tmp_path):
    """Interrupted between blocks, or at any evaluation (two per step and ensemble): the same samples bit for bit."""
    file, stub = tmp_path / "chain.h5", LinearGaussian()
    if calls is None:
        interrupt_between_blocks(stub, file)
    else:
        interrupt_within(stub, file, calls)
    resumed = drawn(LinearGaussian(), file=file)
    np.testing.assert_array_equal(resumed.z, whole.z)
    np.testing.assert_array_equal(resumed.log_density, whole.log_density)
    assert resumed.r_hat == whole.r_hat
    assert resumed.effective_samples == whole.effective_samples


@pytest.mark.slow
@pytest.mark.parametrize("calls", [60, 330])
def test_an_interrupted_run_stops_where_the_uninterrupted_one_did(calls, tmp_path):
    """Convergence is looked at after the same numbers of steps."""
    goals = {"effective_samples": 3000.0, "max_steps": 3000}
    whole = drawn(LinearGaussian(), **goals)
    assert whole.converged
    file, stub = tmp_path / "chain.h5", LinearGaussian()
    interrupt_within(stub, file, calls)
    resumed = drawn(LinearGaussian(), file=file, **goals)
    assert resumed.steps == whole.steps
    np.testing.assert_array_equal(resumed.z, whole.z)


@pytest.mark.slow
def test_a_finished_run_is_read_not_repeated(tmp_path):
    stub, file = LinearGaussian(), tmp_path / "chain.h5"
    first = drawn(stub, file=file)
    calls = stub.calls
    again = drawn(stub, file=file)
    assert stub.calls - calls <= 4
    np.testing.assert_array_equal(again.z, first.z)


@pytest.fixture(scope="module")
def chain(tmp_path_factory):
    """The file of a finished run."""
    file = tmp_path_factory.mktemp("finished") / "chain.h5"
    drawn(LinearGaussian(), file=file)
    return file


@pytest.mark.slow
@pytest.mark.parametrize("change", ["seed", "data", "names", "version"])
def test_another_runs_file_is_refused(change, chain, tmp_path, monkeypatch):
    file = Path(shutil.copy(chain, tmp_path))
    stub = LinearGaussian(seed=1 if change == "data" else 0)
    if change == "names":
        stub.unknowns = SimpleNamespace(names=("a", "b", "c", "d"))
    if change == "version":
        monkeypatch.setattr("bayesid.inference.ensemble.version", lambda package: "another")
    words = r"chain\.h5: it belongs to another run: data, model, seed or version of bayesid differ"
    with pytest.raises(InputError, match=words):
        drawn(stub, seed=4 if change == "seed" else 3, file=file)


# a robot --------------------------------------------------------------------------------------------------------------


def test_where_no_step_is_short_enough_the_fastest_motion_is_named(planar_case, monkeypatch):
    posterior = planar_case.posterior
    recorded = posterior.manoeuvres[0].recording
    spun = {**recorded.channels, "rate.y": np.degrees(recorded.channels["rate.y"])}
    manoeuvre = replace(posterior.manoeuvres[0], recording=replace(recorded, channels=spun))
    monkeypatch.setattr(integration_step, "grids_of", lambda *given: ())
    monkeypatch.setattr(integration_step, "_error", lambda *given: 1.0)
    given = posterior.data.recorded, posterior.structure, posterior.numbers, posterior.starting_point()
    with pytest.raises(InputError, match=r"planar: column 'rate\.y': no integration step .* recorded is [\d.]+ rad/s"):
        integration_step.choose_step(posterior.model, [manoeuvre], *given)


@pytest.mark.slow
def test_laplace_importance_and_ensemble_agree_on_a_nearly_normal_posterior(planar_case):
    """Means within 0.15 sd and widths within 10 %: three times the Monte Carlo error, and what is not quite normal."""
    result = identify(planar_case.posterior, 1, effective_samples=2500.0, max_steps=2000)
    assert result.disagreements == ()
    assert result.chains.converged
    assert result.evidence.trusted
    draws, optimum, evidence = result.chains.flat, result.optimum, result.evidence
    sd = np.sqrt(np.diag(optimum.covariance))
    for mean, width in ((draws.mean(axis=0), draws.std(axis=0)), (evidence.mean, evidence.sd)):
        assert (np.abs(mean - optimum.z) / sd).max() < 0.15
        np.testing.assert_allclose(width, sd, rtol=0.1)
    laplace = optimum.log_evidence(result.posterior)
    assert abs(evidence.value - laplace) < 0.2
    error = coordinates_of(result.posterior.model.priors[0], planar_case.truth) - optimum.z[:10]
    assert error @ np.linalg.solve(optimum.covariance[:10, :10], error) < chi2_distribution(10).ppf(0.9999)


@pytest.mark.slow
def test_the_optimum_is_reached_from_random_starts(planar_posterior, request):
    """From draws of a prior of relative width one, at least 95 % reach the lowest cost found to 1e-3."""
    posterior = planar_posterior(np.random.default_rng(2), spread=1.0, step=0.5)
    rng, first = np.random.default_rng(3), posterior.starting_point()
    costs, count = [], 100 if request.config.getoption("--catalogue") else 40
    for _ in range(count):
        start = first.copy()
        start[:10] = rng.normal(size=10)
        costs.append(fit(posterior, start).cost)
    best = fit(posterior, first).cost
    reached = int((np.array(costs) < best + 1e-3).sum())
    print("reached", reached, "best", best)
    assert min(costs) > best - 1e-3  # nothing better than from the prior's centre
    assert reached >= 0.95 * count


@pytest.mark.slow
def test_the_truth_is_covered_as_often_as_stated(planar_case, noisy):
    """Chi-square of the true base over 40 noises of one MuJoCo motion follows chi2(10).

    The prior is centred on a wrong base, 0.3 wide, and hardly matters beside the data.
    """
    compiled, truth = planar_case.posterior, planar_case.truth
    prior, values = compiled.model.priors[0], []
    for seed in range(40):
        recording = noisy(np.random.default_rng(100 + seed))
        motion = MeasuredMotion.from_recording(recording, compiled.model.robot, sigma={0: 1e-6})
        posterior = with_manoeuvres(compiled, [Manoeuvre(recording, motion)])
        _, optimum = maximise(posterior, np.random.default_rng(0))
        error = coordinates_of(prior, truth) - optimum.z[:10]
        values.append(error @ np.linalg.solve(optimum.covariance[:10, :10], error))
    result = kstest(values, chi2_distribution(10).cdf)
    print("coverage: mean", np.mean(values), "p", result.pvalue)
    assert result.pvalue > 1e-3
    # 40 values of chi2(10) have a mean of 10 with a standard error of 0.71
    assert abs(np.mean(values) - 10.0) < 4.0 * np.sqrt(20.0 / 40)
