"""Realised log Bayes factors: flights of the independent simulator, to which models with either rival are fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from bayesid import Manoeuvre, Posterior
from bayesid._math.arrays import Floats
from bayesid.inference import maximise
from bayesid.inference.importance import choose_parameterisation, importance_sample
from bayesid.inference.noise_changes import with_manoeuvres
from bayesid.recording.joint_motion import Motion
from studies.common.flight import light_wheel
from studies.ets7_limits.flights import fly, record
from studies.separating.setting import DRIFT, rival_model, rival_of
from studies.truth.mujoco import Truth, leak

__all__ = ["Flown", "Rivalry", "Sampled", "flown", "noisy"]


@dataclass(frozen=True)
class Flown:
    """Motion of the joints in a flight, and what truly happened."""

    motion: Motion
    run: Truth


def flown(motion: Motion, duration: float, truth: str, amplitude: Floats) -> Flown:
    """Fly a manoeuvre with one of the rivals hidden.

    Parameters
    ----------
    motion : Motion
        Motion of the joints.
    duration : float
        Duration of the flight [s].
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


def noisy(flights: Mapping[str, Flown], names: Sequence[str], seed: int) -> list[Manoeuvre]:
    """Record some flights with the joints exactly known; the noise of each follows from the seed and its name."""
    manoeuvres = []
    for name in names:
        rng = np.random.default_rng([seed, *name.encode()])
        manoeuvres.append(replace(record(flights[name].run, name, rng), motion=flights[name].motion))
    return manoeuvres


@dataclass(frozen=True)
class Sampled:
    """A log Bayes factor by Laplace's approximation and by importance sampling.

    Attributes
    ----------
    laplace : float
        Value by Laplace's approximation.
    sampled, error : float
        Value by importance sampling, and its standard error.
    pareto_k : float
        Larger Pareto k-hat of the two models.
    """

    laplace: float
    sampled: float
    error: float
    pareto_k: float


@dataclass
class Rivalry:
    """Models with neither and with each of the rivals, whose compiled functions are kept between noises.

    Attributes
    ----------
    known : dict of (str, int) to Posterior
        Posteriors by label and number of recordings.
    """

    known: dict[tuple[str, int], Posterior] = field(default_factory=dict)

    def posterior(self, label: str, manoeuvres: Sequence[Manoeuvre]) -> Posterior:
        """Return the posterior of the model with one rival, or with neither where the label is empty."""
        key = label, len(manoeuvres)
        if key not in self.known:
            self.known[key] = Posterior.of(rival_model([label]), manoeuvres)
        return with_manoeuvres(self.known[key], manoeuvres)

    def log_evidence(self, label: str, manoeuvres: Sequence[Manoeuvre], rng: np.random.Generator) -> float:
        """Return the log evidence of one model by Laplace's approximation."""
        refined, optimum = maximise(self.posterior(label, manoeuvres), rng)
        return optimum.log_evidence(refined)

    def log_factor(self, truth: str, manoeuvres: Sequence[Manoeuvre], rng: np.random.Generator) -> float:
        """Return the log Bayes factor of the truth against its rival by Laplace's approximation."""
        true, rival = (self.log_evidence(label, manoeuvres, rng) for label in (truth, rival_of(truth)))
        return true - rival

    def sampled(self, truth: str, manoeuvres: Sequence[Manoeuvre], rng: np.random.Generator) -> Sampled:
        """Return the log Bayes factor by Laplace's approximation and by importance sampling."""
        laplace, values = [], []
        for label in (truth, rival_of(truth)):
            refined, optimum = maximise(self.posterior(label, manoeuvres), rng)
            laplace.append(optimum.log_evidence(refined))
            values.append(importance_sample(choose_parameterisation(refined, optimum, rng), optimum, rng))
        return Sampled(
            laplace=laplace[0] - laplace[1],
            sampled=values[0].value - values[1].value,
            error=float(np.hypot(values[0].error, values[1].error)),
            pareto_k=max(value.pareto_k for value in values),
        )
