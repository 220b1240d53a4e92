"""Realised log Bayes factors: flights of the independent simulator, both rivals fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesid import Manoeuvre, Posterior
from bayesid.inference import maximise
from bayesid.inference.importance import choose_parameterisation, importance_sample
from bayesid.inference.noise_changes import with_manoeuvres
from bayesid.recording.joint_motion import Motion
from studies.common.flight import light_wheel
from studies.ets7_limits.flights import fly, record
from studies.separating.setting import DRIFT, RIVALS, rival_model
from studies.truth.mujoco import Truth, leak

__all__ = ["Flown", "Rivalry", "Sampled", "flown", "noisy"]

Floats = NDArray[np.floating]


@dataclass(frozen=True)
class Flown:
    """A flight: what the joints did, and what truly happened."""

    motion: Motion
    run: Truth


def flown(motion: Motion, duration: float, truth: str, amplitude: Floats) -> Flown:
    """Fly a manoeuvre with one of the rivals at work.

    Parameters
    ----------
    truth : str
        Label of the rival, or empty for none.
    amplitude : (3,) array
        Momentum of the wheels [N m s] or torque of the leak [N m], base axes.
    """
    hidden: dict[str, Any] = {}
    if truth == "wheel-momentum":
        hidden = {"rotor": light_wheel(amplitude)}
    elif truth == "thruster-leak":
        hidden = {"fields": [leak((0.0, 0.0, 0.0), amplitude)]}
    return Flown(motion, fly(motion, duration, DRIFT, **hidden))


@dataclass(frozen=True)
class Sampled:
    """A log Bayes factor by importance sampling beside Laplace's, with the larger Pareto k-hat of the two models."""

    laplace: float
    sampled: float
    error: float
    pareto_k: float


@dataclass
class Rivalry:
    """The models with nothing, and with each of the rivals; compiled functions are kept between noises."""

    known: dict[tuple[str, int], Posterior] = field(default_factory=dict)

    def posterior(self, label: str, manoeuvres: Sequence[Manoeuvre]) -> Posterior:
        """Return the posterior of the model with one rival, or with neither where the label is empty."""
        like = self.known.get((label, len(manoeuvres)))
        if like is not None:
            return with_manoeuvres(like, manoeuvres)
        self.known[label, len(manoeuvres)] = Posterior.of(rival_model([label]), manoeuvres)
        return self.known[label, len(manoeuvres)]

    def log_evidence(self, label: str, manoeuvres: Sequence[Manoeuvre], rng: np.random.Generator) -> float:
        """Laplace's log evidence of one model."""
        refined, optimum = maximise(self.posterior(label, manoeuvres), rng)
        return optimum.log_evidence(refined)

    def log_factor(self, truth: str, manoeuvres: Sequence[Manoeuvre], rng: np.random.Generator) -> float:
        """Log Bayes factor of the truth against its rival."""
        own, other = (self.log_evidence(label, manoeuvres, rng) for label in _ordered(truth))
        return own - other

    def sampled(self, truth: str, manoeuvres: Sequence[Manoeuvre], rng: np.random.Generator) -> Sampled:
        """Log Bayes factor by Laplace's approximation and by importance sampling."""
        laplace, values = [], []
        for label in _ordered(truth):
            refined, optimum = maximise(self.posterior(label, manoeuvres), rng)
            laplace.append(optimum.log_evidence(refined))
            values.append(importance_sample(choose_parameterisation(refined, optimum, rng), optimum, rng))
        return Sampled(
            laplace=laplace[0] - laplace[1],
            sampled=values[0].value - values[1].value,
            error=float(np.hypot(values[0].error, values[1].error)),
            pareto_k=max(value.pareto_k for value in values),
        )


def noisy(flights: Mapping[str, Flown], names: Sequence[str], seed: int) -> list[Manoeuvre]:
    """Record flights with the noise of one seed, the joints exactly known; a flight's noise is its own."""
    found = []
    for name in names:
        rng = np.random.default_rng([seed, *name.encode()])
        found.append(replace(record(flights[name].run, name, rng), motion=flights[name].motion))
    return found


def _ordered(truth: str) -> tuple[str, str]:
    return truth, next(label for label in RIVALS if label != truth)
