"""What ETS-VII itself could have identified within its flight rules, in what time, and with which sensors.

A manoeuvre of all six joints is designed within 50 mm/s and 5 degrees a second at the tip. Its information is rescaled
for other sensors, repeated, and evaluated with an arm that is not known exactly. It is compared with the flight's
manoeuvre, and the predicted standard deviations are checked with MuJoCo. ``python -m studies.ets7_limits`` writes
``reports/ets7_limits.pdf``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from bayesid.app.compilation_cache import keep_compiled
from bayesid.design import Search, Store
from studies.common.command import TRIALS, Command
from studies.common.models import ARM_SPREAD
from studies.ets7_limits.analysis import ACCELS, CHECKED, RATES, answers, design_manoeuvre, information_of, widths
from studies.ets7_limits.check import Planned, check
from studies.ets7_limits.report import Result, write_report
from studies.ets7_limits.setting import DURATION, POINTS, limits_problem

__all__ = ["Result", "main", "run"]

SEARCH = Search()
"""Effort of the search."""

REPETITIONS = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1e3, 3e3, 1e4, 1e5)
"""Numbers of repetitions at which the accuracy is drawn."""


def run(
    *,
    seed: int = 1,
    duration: float = DURATION,
    points: int = POINTS,
    search: Search = SEARCH,
    noises: int = 40,
    rates: Sequence[str] = tuple(RATES),
    accels: Sequence[str] = tuple(ACCELS),
    arm_spread: float = ARM_SPREAD,
    store: Store | None = None,
    trials: Path | None = None,
    workers: int = 1,
    progress: Callable[[str], None] = lambda text: None,
) -> Result:
    """Run the study.

    Parameters
    ----------
    seed : int
        Seed of all random numbers.
    duration : float
        Length of the designed manoeuvre [s].
    points : int
        Number of free control points of every joint.
    search : Search
        Effort of the search.
    noises : int
        Number of recordings of the check.
    rates, accels : sequence of str
        Labels of the sensors.
    arm_spread : float
        Relative width of the arm's priors where it is not known exactly; 0 where it always is.
    store : Store, optional
        Store that keeps the starts of the search.
    trials, workers
        File and number of processes of the check's fits; see `studies.common.monte_carlo.run_trials`.
    progress : callable
        Receives a line on what is being done.
    """
    designed = design_manoeuvre(limits_problem(duration, points), seed, search, store or Store.forgetful(), progress)
    both = dict(zip(("designed", "flight"), information_of(designed, arm_spread), strict=True))
    table = answers(both["designed"], rates, {label: ACCELS[label] for label in accels}, progress)
    curves = {
        (name, known): [information.repeated(CHECKED, known).worst(count) for count in REPETITIONS]
        for name, information in both.items()
        for known in (True, False)
    }
    progress("flights of the independent simulator")
    planned = Planned(tuple(map(float, designed.optimum.parameters)), duration, points)
    checked = check(planned, noises, seed, trials, workers, progress)
    after_one = {name: widths(information) for name, information in both.items()}
    return Result(designed, table, after_one["designed"], after_one["flight"], REPETITIONS, curves, checked, duration)


COMMAND = Command(
    "ets7_limits",
    "Say what ETS-VII could have identified within its rules.",
    seed=1,
    extra={
        "--store": {"type": Path, "help": "file that keeps the starts of the search, for an interrupted run"},
        **TRIALS,
    },
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    options = COMMAND.parse(arguments)
    keep_compiled()
    store = None if options.store is None else Store.open(options.store, f"ets7-limits {options.seed} {SEARCH}")
    result = run(seed=options.seed, store=store, trials=options.trials, workers=options.workers, progress=print)
    write_report(result, options.output)
