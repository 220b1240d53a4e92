"""Problem 3 of the paper: the inertial parameters of every body of ETS-VII and of the load in its hand.

The study asks what each manoeuvre and each sensor teaches beyond the drawings, what must be known, and what restores
the scale of the masses. It identifies all bodies, from motion alone and with joint torques, checks whether the stated
uncertainty holds the truth, and applies the paper's linear regressor method to the same data. An independent simulator
flies the manoeuvres. ``python -m studies.whole_system --full`` writes ``reports/whole_system.pdf``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from bayesid.app.compilation_cache import keep_compiled
from studies.common.provenance import study_origin
from studies.common.study import Command
from studies.whole_system.contest import contest
from studies.whole_system.coverage import covered
from studies.whole_system.information import informed
from studies.whole_system.report import Result, write_report
from studies.whole_system.sampled import Sampled, sampled
from studies.whole_system.setting import drawn, true_robot
from studies.whole_system.world import flights, fly, hand_speed, record

__all__ = ["Result", "main", "run", "write_report"]


def run(
    *,
    full: bool = False,
    seed: int = 1,
    duration: float = 240.0,
    effective_samples: float = 1500.0,
    repeats: int = 40,
    progress: Callable[[str], None] = lambda text: None,
) -> Result:
    """Run the study.

    Parameters
    ----------
    full : bool
        True to sample the posteriors too, and to check the coverage.
    seed : int
        Seed of all random numbers.
    duration : float
        Duration of each manoeuvre [s].
    effective_samples : float
        Effective sample size of each identification.
    repeats : int
        Number of systems of the coverage check, and of recordings of the contest of methods.
    progress : callable, optional
        Receives a line on what is being done.
    """
    truth, drawings = true_robot(), drawn(true_robot(), seed)
    progress("manoeuvres")
    runs = {name: fly(truth, seed, duration=duration, **flight) for name, flight in flights(duration).items()}
    known = informed(truth, {name: record(flown, truth, name, None) for name, flown in runs.items()})
    best = runs["six joints"]
    progress("the linear method")
    methods = contest(best, truth, drawings, count=repeats if full else 3, seed=seed, progress=progress)
    cases: list[Sampled] = []
    coverage = None
    if full:
        manoeuvre = record(best, truth, "six joints", np.random.default_rng(seed))
        cases = [
            sampled(
                truth,
                drawings,
                manoeuvre,
                torques=torques,
                seed=seed,
                effective_samples=effective_samples,
                progress=progress,
            )
            for torques in (False, True)
        ]
        coverage = covered(drawings, repeats, seed, torques=False, duration=0.5 * duration, progress=progress)
    return Result(truth, drawings, known, tuple(cases), coverage, methods, duration, hand_speed(best, truth))


COMMAND = Command(
    "whole_system",
    "Identify every body of the robot.",
    full="also sample the posteriors and check the coverage",
    seed=1,
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    options = COMMAND.parse(arguments)
    keep_compiled()
    result = run(full=options.full, seed=options.seed, progress=print)
    write_report(result, options.output, origin=study_origin(COMMAND.name, options))
