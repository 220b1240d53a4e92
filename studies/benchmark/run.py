"""The measurements of the benchmark."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from bayesid.inference.predicted_readings import integration_error_at
from studies.benchmark.cases import chain, posterior_of
from studies.benchmark.sampling import Sampling, compare_moves
from studies.benchmark.timing import Rival, rivals, seconds_per_evaluation
from studies.common.ets7 import ets7

__all__ = ["RUNS", "Benchmark", "run"]

RUNS = 5
"""Number of runs, one after the other, whose spread is reported."""


@dataclass(frozen=True)
class Benchmark:
    """Times measured in one run [s].

    Attributes
    ----------
    evaluation : float
        Time of one evaluation of the log density of ETS-VII.
    error : float
        Integration error of that evaluation, in standard deviations of a sample.
    rivals : list of Rival
        Other simulators of the same manoeuvre.
    links, samples : dict of int to float
        Time of one evaluation by number of links, and by number of samples.
    whitening : dict of str to float
        Time with white noise, with an encoder whose noise is negligible, and with one whose noise matters.
    windows : dict of str to int
        Number of earlier sample times that each of these whitenings conditions on.
    sampling : Sampling
        Cost of an effective sample.
    """

    evaluation: float
    error: float
    rivals: list[Rival]
    links: dict[int, float]
    samples: dict[int, float]
    whitening: dict[str, float]
    windows: dict[str, int]
    sampling: Sampling

    @property
    def speedups(self) -> dict[str, float]:
        """Time of each rival over that of one evaluation, by its name."""
        return {rival.name: rival.seconds / self.evaluation for rival in self.rivals}


def run(*, full: bool = False, seed: int = 0, progress: Callable[[str], None] = lambda text: None) -> list[Benchmark]:
    """Measure everything in each of `RUNS` runs.

    Parameters
    ----------
    full : bool
        Whether to take longer chains of the default move and more repeats.
    seed : int
        Seed of the samplers in the first run.
    progress : callable, optional
        Receives a line before each run.
    """
    results = []
    for number in range(RUNS):
        progress(f"run {number + 1} of {RUNS}")
        results.append(_measured(full=full, seed=seed + number))
    return results


def _measured(*, full: bool, seed: int) -> Benchmark:
    """Measure everything once."""
    robot = ets7()
    single = posterior_of(robot)
    whitening = {"white": 0.0, "encoder 1e-6 rad": 1e-6, "encoder 1e-4 rad": 1e-4}
    posteriors = {name: posterior_of(robot, encoder_sigma=sigma) for name, sigma in whitening.items()}
    repeats = 20 if full else 5
    return Benchmark(
        evaluation=seconds_per_evaluation(single, repeats),
        error=integration_error_at(single, single.starting_point()),
        rivals=rivals(robot, single),
        links={count: seconds_per_evaluation(posterior_of(chain(count)), repeats) for count in (6, 20, 60)},
        samples={
            round(120.0 / interval) + 1: seconds_per_evaluation(posterior_of(robot, interval=interval), repeats)
            for interval in (1.0, 0.5, 0.2, 0.1)
        },
        whitening={name: seconds_per_evaluation(posterior, repeats) for name, posterior in posteriors.items()},
        windows={name: posterior.whitenings[0].window for name, posterior in posteriors.items()},
        sampling=compare_moves(
            posterior_of(robot, recordings=3), wanted=4000.0, default_steps=12000 if full else 600, seed=seed
        ),
    )
