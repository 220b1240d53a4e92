"""In which coordinates the Student-t about the mode is drawn, and what the choice costs."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from bayesid.inference.importance import GOOD, TRIAL, choose_parameterisation, weighted_draws
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
