"""In which coordinates the Student-t about the mode is drawn, and what the choice costs."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest

from bayesid.inference.importance import GOOD, TRIAL, _weighted, choose_parameterisation, weighted_draws
from bayesid.inference.mode import Optimum, maximise
from bayesid.inference.parameterisation import LinearParameterisation, LogCholeskyParameterisation
from bayesid.inference.posterior import Posterior
from bayesid.simulation.effects import LinkInertia


@pytest.fixture
def evaluated(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    counts: list[int] = []
    evaluate = Posterior.log_likelihoods

    def counted(self, z):
        counts.append(len(z))
        return evaluate(self, z)

    monkeypatch.setattr(Posterior, "log_likelihoods", counted)
    return counts


def share(parameterisation: type, posterior: Posterior, optimum: Optimum) -> float:
    """Return the share of effective draws."""
    drawn = weighted_draws(parameterisation(posterior), optimum, np.random.default_rng(1), 2000)
    return drawn.effective_samples / 2000


@pytest.mark.slow
def test_one_trial_where_the_posterior_is_nearly_gaussian(
    planar_posterior: Callable[..., Posterior], evaluated: list[int]
) -> None:
    posterior, optimum = maximise(planar_posterior(np.random.default_rng(3), step=0.5), np.random.default_rng(0))
    assert share(LogCholeskyParameterisation, posterior, optimum) > GOOD
    evaluated.clear()
    chosen = choose_parameterisation(posterior, optimum, np.random.default_rng(2))
    assert isinstance(chosen, LogCholeskyParameterisation)
    assert evaluated == [TRIAL]


@pytest.mark.slow
def test_the_better_of_two_where_it_is_not(planar_posterior: Callable[..., Posterior], evaluated: list[int]) -> None:
    """An unknown error of the last link, of which the recording tells little."""
    base = planar_posterior(np.random.default_rng(3), step=0.5)
    posterior = Posterior.of(base.model.extend(LinkInertia("link2")), base.manoeuvres, step=0.5)
    posterior, optimum = maximise(posterior, np.random.default_rng(0))
    shares = [share(own, posterior, optimum) for own in (LogCholeskyParameterisation, LinearParameterisation)]
    assert shares[0] < GOOD
    assert abs(shares[0] - shares[1]) > 0.1, shares
    evaluated.clear()
    chosen = choose_parameterisation(posterior, optimum, np.random.default_rng(2))
    assert isinstance(chosen, LogCholeskyParameterisation if shares[0] > shares[1] else LinearParameterisation)
    assert evaluated == [TRIAL, TRIAL]


@pytest.mark.parametrize("tail", [0.2, 0.9])
def test_k_hat_is_the_tail_of_the_weights(tail: float):
    """The weights are powers of a uniform number, which are Pareto's with that shape; light ones are as they are."""
    logarithms = tail * np.random.default_rng(2).exponential(size=(40, 4000))
    unchanged = SimpleNamespace(to_z=lambda y: y)
    drawn = [_weighted(unchanged, np.zeros((4000, 1)), row) for row in logarithms]
    assert np.mean([one.pareto_k for one in drawn]) == pytest.approx(tail, abs=0.05)
    body = logarithms[0] < np.quantile(logarithms[0], 0.9)
    ratio = drawn[0].weights[body] / np.exp(logarithms[0][body])
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)


def test_weights_without_a_tail_are_not_trusted():
    few = np.full(1000, -800.0)
    few[:3] = 0.0
    assert _weighted(SimpleNamespace(to_z=lambda y: y), np.zeros((1000, 1)), few).pareto_k == np.inf


@pytest.mark.parametrize("draws", [1, 2, 26, 29, 30, 224, 225, 512, 1000])
@pytest.mark.parametrize("case", ["equal", "nearly equal", "some above", "equal tail", "few finite", "none", "spread"])
def test_no_weights_stop_the_sampling(draws: int, case: str):
    """ArviZ raises errors of tails without spread or of few draws, or divides by zero there, as its version has it."""
    rng = np.random.default_rng(4)
    random = rng.normal(size=draws)
    largest = np.argsort(random)[-max(1, draws // 3) :]
    logarithms = {
        "equal": np.full(draws, -3.0),
        "nearly equal": -3.0 + 1e-17 * random - 1e-300,
        "some above": np.where(random > 1.5, 1e-16, 0.0),
        "equal tail": np.where(np.isin(np.arange(draws), largest), 5.0, random - 4.0),
        "few finite": np.where(np.isin(np.arange(draws), largest[:4]), random, -np.inf),
        "none": np.full(draws, -np.inf),
        "spread": 400.0 * random,
    }[case]
    drawn = _weighted(SimpleNamespace(to_z=lambda y: y), np.zeros((draws, 1)), logarithms)
    assert np.isfinite(drawn.weights).all()
    assert drawn.weights.sum() == pytest.approx(1.0)
    assert not np.isnan(drawn.pareto_k)
    assert drawn.trusted <= (case == "some above")  # by the last digit, and bounded
