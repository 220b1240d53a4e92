"""The densities on which samplers compete: ETS-VII's base from three recordings of 120 s, with more unknowns or fewer.

Every sampler gets the same function of the same coordinates, whitened by the Laplace approximation: the mode lies at
the origin and the covariance about it is one. They are those that the package would choose for its own walkers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid import BodyPrior, Manoeuvre, MeasuredMotion, Model, Posterior, SensorKind
from bayesid._math.arrays import Floats
from bayesid.design.design_result import sample_times
from bayesid.inference import (
    LinearParameterisation,
    Optimum,
    Parameterisation,
    choose_parameterisation,
    maximise,
)
from bayesid.inference.parameterisation import StudentT
from bayesid.inference.predicted_readings import simulate_manoeuvre
from studies.benchmark.run import DURATION, excitation
from studies.common.ets7 import ACCEL, BASE, ENCODER, INTERVAL, RATE, ets7
from studies.common.models import ARM_SPREAD, base_model

RECORDINGS = 3  # number of recordings of every case


@dataclass(frozen=True)
class Case:
    """What is unknown."""

    links: int  # number of links of the arm that are known to 5 % only; all others are known exactly
    rates: bool  # whether the initial rates are unknown
    title: str


# number of unknowns -> case; the first is the base body as the package's users have it
CASES = {
    19: Case(0, True, "base and initial rates"),
    10: Case(0, False, "base, from rest"),
    39: Case(2, True, "base, initial rates and two links"),
    79: Case(6, True, "base, initial rates and the whole arm"),
}


@dataclass(frozen=True)
class Target:
    """A posterior over whitened coordinates x, with y = centre + factor x those of its parameterisation."""

    parameterisation: Parameterisation
    optimum: Optimum  # mode and Laplace approximation

    @property
    def posterior(self) -> Posterior:
        """Posterior of the case."""
        return self.parameterisation.posterior

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.posterior.size

    @cached_property
    def laplace(self) -> StudentT:
        """Proposal about the mode, whose mean and factor whiten."""
        return self.parameterisation.proposal(self.optimum)

    @cached_property
    def log_volume(self) -> float:
        """Logarithm of the volume of y per volume of x."""
        return float(np.log(np.diag(self.laplace.factor)).sum())

    def whitened(self, y: Floats) -> Floats:
        """Return x of coordinates y (n, size)."""
        return np.linalg.solve(self.laplace.factor, (y - self.laplace.mean).T).T

    def log_density(self, x: Floats) -> Floats:
        """Return the log density over x of many points (n, size), normalised like the posterior's; shape (n,)."""
        y = self.laplace.mean + x @ self.laplace.factor.T
        return self.parameterisation.log_density(y) + self.log_volume

    def traced(self, x: Array) -> Array:
        """Return the log density at one point (size,), in a function that JAX traces."""
        posterior = self.posterior
        layout, numbers = posterior.unknowns.layout, posterior.numbers
        z, change = jnp.asarray(self.laplace.mean) + jnp.asarray(self.laplace.factor) @ x, jnp.zeros(())
        if isinstance(self.parameterisation, LinearParameterisation):
            z = layout.from_linear(numbers.prior, z)
            change = layout.log_volume(numbers.prior, z)
        value = posterior.traced_log_density(z) - change + self.log_volume
        return jnp.where(jnp.isfinite(value), value, -jnp.inf)

    @cached_property
    def log_density_of_one(self) -> jax.stages.Compiled:
        """Compiled log density at one point, for samplers that take no batches."""
        mode = self.whitened(self.laplace.mean[None])[0]  # which finds the factor before anything is traced
        return jax.jit(self.traced).lower(mode).compile()


def target_of(unknowns: int, *, duration: float = DURATION, seed: int = 0) -> Target:
    """Return the target of a case of `CASES`.

    Parameters
    ----------
    unknowns : int; number of unknowns
    duration : float; length of each recording [s]
    seed : int; seed of the recordings' noise
    """
    model = _model(CASES[unknowns])
    generators = [np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(RECORDINGS + 2)]
    manoeuvres = _recorded(model, duration, generators[:RECORDINGS])
    posterior, optimum = maximise(Posterior.of(model, manoeuvres), generators[-2])
    return Target(choose_parameterisation(posterior, optimum, generators[-1]), optimum)


def _model(case: Case) -> Model:
    robot = ets7()
    links = [name for name, link in robot.links.items() if name != BASE and link.inertial.mass > 0.0][: case.links]
    priors = (
        BodyPrior(BASE, robot.link(BASE).inertial, 1.0),
        *(BodyPrior(name, robot.link(name).inertial, ARM_SPREAD, nuisance=True) for name in links),
    )
    model = base_model({SensorKind.RATE: RATE, SensorKind.ACCEL: ACCEL}, bias=0.0)
    return replace(model, priors=priors, rate_sigma=model.rate_sigma if case.rates else 0.0, speed_errors=False)


def _recorded(model: Model, duration: float, generators: Sequence[np.random.Generator]) -> list[Manoeuvre]:
    manoeuvres = []
    for number, rng in enumerate(generators):
        motion = excitation(len(model.robot.joints), number)
        times, name = sample_times(duration, INTERVAL), f"manoeuvre-{number + 1}"
        recording = simulate_manoeuvre(model, motion, times, name=name, rng=rng, encoder_sigma=ENCODER)
        manoeuvres.append(
            Manoeuvre(recording, MeasuredMotion.from_recording(recording, model.robot, sigma={0: ENCODER}))
        )
    return manoeuvres
