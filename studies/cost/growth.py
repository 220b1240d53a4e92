"""How cost grows with the size of the problem, and how far one evaluation is from what the machine could do."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from bayesid import BodyPrior, Manoeuvre, Model, Posterior
from bayesid.diagnosis import candidates, diagnose
from bayesid.inference import compiled
from studies.benchmark.cases import chain, posterior_of
from studies.benchmark.timing import best_of, seconds_per_evaluation
from studies.common.ets7 import ets7

__all__ = ["Floor", "floor_of", "growth", "verdict_by_candidates"]

MATRIX, VECTOR = 1500, 30_000_000
"""Sizes of the matrix product and of the sum that measure what the machine can do."""


class Floor(NamedTuple):
    """What one evaluation of the log likelihood needs, and what one core of this machine gives.

    Attributes
    ----------
    operations, traffic : float
        Floating-point operations, and bytes read and written by all compiled operations, of one evaluation in a batch.
    speed, bandwidth : float
        Operations per second of a large matrix product, and bytes per second of a sum of large vectors.
    seconds : float
        Time of one evaluation, both cores [s].
    """

    operations: float
    traffic: float
    speed: float
    bandwidth: float
    seconds: float

    @property
    def least(self) -> float:
        """Time that operations alone would take at the speed of a matrix product [s]."""
        return self.operations / self.speed


def floor_of(repeats: int) -> Floor:
    """Count what an evaluation needs and measure what the machine gives."""
    posterior = posterior_of(ets7())
    batch = 64
    z = jnp.zeros((batch, posterior.size)) + posterior.starting_point()

    def chi2(points: jax.Array) -> jax.Array:
        function = jax.vmap(lambda one: compiled.residuals(structure, numbers, one, arrays))
        return jnp.sum(function(points) ** 2, axis=(1, 2, 3))

    structure, numbers, arrays = posterior.structure, posterior.numbers, posterior.data.arrays
    cost = jax.jit(chi2).lower(z).compile().cost_analysis()
    counted = cost if isinstance(cost, dict) else {}
    a = np.random.default_rng(0).normal(size=(MATRIX, MATRIX))
    v, w = np.ones(VECTOR), np.ones(VECTOR)
    product, total = best_of(lambda: a @ a, repeats), best_of(lambda: np.add(v, w, out=w), repeats)
    return Floor(
        float(counted.get("flops", np.nan)) / batch,
        float(counted.get("bytes accessed", np.nan)) / batch,
        2.0 * MATRIX**3 / product,
        24.0 * VECTOR / total,
        seconds_per_evaluation(posterior, repeats),
    )


def growth(repeats: int, sizes: int | None = None) -> dict[str, dict[int, float]]:
    """Return the time of one evaluation by samples, recordings, links, unknowns and walkers in a batch [s].

    Parameters
    ----------
    repeats : int
        Repetitions, of which the fastest counts.
    sizes : int, optional
        How many sizes of each are measured, the smallest ones; by default all.
    """
    robot = ets7()
    three = posterior_of(robot, recordings=3)

    def seconds(posterior: Posterior) -> float:
        return seconds_per_evaluation(posterior, repeats)

    return {
        "samples of a recording": {
            round(120.0 / interval) + 1: seconds(posterior_of(robot, interval=interval))
            for interval in (1.0, 0.5, 0.25, 0.125)[:sizes]
        },
        "recordings": {n: seconds(posterior_of(robot, recordings=n)) for n in (1, 2, 4, 8)[:sizes]},
        "links": {n: seconds(posterior_of(chain(n))) for n in (3, 6, 12, 24, 48)[:sizes]},
        "unknowns": {item.size: seconds(item) for item in (_with_bodies(three, n) for n in (1, 2, 4, 7)[:sizes])},
        "walkers in a batch": {n: _seconds_of_batch(three, n, repeats) / n for n in (1, 4, 16, 64, 256)[:sizes]},
    }


def _with_bodies(posterior: Posterior, bodies: int) -> Posterior:
    """Return the posterior with more unknown bodies, the base first."""
    model = posterior.model
    massive = [name for name, link in model.robot.links.items() if link.inertial.mass > 0.0]
    names = sorted(massive, key=lambda name: name != model.robot.base)[:bodies]
    priors = tuple(BodyPrior(name, model.robot.link(name).inertial, 0.3) for name in names)
    changed = Model(model.robot, model.sensors, priors, model.orbit, model.effects)
    return Posterior.of(changed, posterior.manoeuvres, step=posterior.step)


def _seconds_of_batch(posterior: Posterior, count: int, repeats: int) -> float:
    z = posterior.starting_point() + 0.01 * np.random.default_rng(0).normal(size=(count, posterior.size))
    return best_of(lambda: posterior.log_density(z), repeats)


def verdict_by_candidates(model: Model, manoeuvres: list[Manoeuvre], counts: tuple[int, ...]) -> dict[int, float]:
    """Return the time of the verdict by the number of candidates of the catalogue [s].

    The code must be compiled: the same recordings have been diagnosed in this process.
    """
    every = candidates(model, longest=float(manoeuvres[0].recording.time[-1]))
    found = {}
    for count in counts:
        chosen = every[:count] if count < len(every) else every
        found[len(chosen)] = diagnose(model, manoeuvres, effects=chosen).seconds["verdict"]
    return found
