"""Problem 3 of the paper: the inertial parameters of every body of ETS-VII and of the load in its hand.

What is learnt beyond the drawings by which manoeuvre and which sensor; what must be known, and what restores the scale
of the masses; the identification itself, from motion alone and with joint torques; whether its uncertainty holds the
truth; and the paper's linear regressor method on the same data. Flown by an independent simulator.
``python -m studies.whole_system --full`` writes ``reports/whole_system.pdf``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from studies.common.command import Command
from studies.whole_system.contest import contest
from studies.whole_system.coverage import covered
from studies.whole_system.information import informed
from studies.whole_system.report import Result, write_report
from studies.whole_system.sampled import sampled
from studies.whole_system.setting import drawn, true_robot
from studies.whole_system.world import START_RATE, flights, fly, hand_speed, record

__all__ = ["Result", "main", "run"]


def run(
    *,
    full: bool = False,
    seed: int = 1,
    duration: float = 240.0,
    effective_samples: float = 1500.0,
    repeats: int = 40,
    progress: Callable[[str], None] | None = None,
) -> Result:
    """Run the study.

    Parameters
    ----------
    full : bool
        Also sample the posteriors and check the coverage.
    seed : int
        Every random number follows from it.
    duration : float
        Of each manoeuvre [s].
    effective_samples : float
        Of each identification.
    repeats : int
        Systems of the coverage check, and recordings of the contest of methods.
    progress : callable, optional
        Told what is being done.
    """
    tell = progress or (lambda text: None)
    truth, drawings = true_robot(), drawn(true_robot(), seed)
    tell("manoeuvres")
    runs = {name: fly(truth, seed, duration=duration, **flight) for name, flight in flights(duration).items()}
    known = informed(truth, {name: record(flown, truth, name, None) for name, flown in runs.items()})
    best = runs["six joints"]
    tell("the linear method")
    methods = contest(best, truth, drawings, count=repeats if full else 3, seed=seed, progress=tell)
    cases, coverage = [], None
    if full:
        rng = np.random.default_rng(seed)
        manoeuvre = record(best, truth, "six joints", rng)
        for title, torques in (("motion alone", False), ("motion and joint torques", True)):
            cases.append(
                sampled(
                    title,
                    truth,
                    drawings,
                    manoeuvre,
                    START_RATE,
                    torques=torques,
                    seed=seed,
                    effective_samples=effective_samples,
                    progress=tell,
                )
            )
        coverage = covered(drawings, repeats, seed, torques=False, duration=0.5 * duration, progress=tell)
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
    write_report(run(full=options.full, seed=options.seed, progress=print), options.output)
