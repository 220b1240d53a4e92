"""What ETS-VII itself could have identified within its flight rules, in what time, and with which sensors.

A manoeuvre of all six joints is designed within 50 mm/s and 5 degrees a second at the tip; its information is rescaled
for other sensors, repeated, and held against an arm that is not known exactly. The flight's own manoeuvre is put beside
it, and the predicted widths are checked with MuJoCo. ``python -m studies.ets7_limits`` writes
``reports/ets7_limits.pdf``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from bayesid.app.compilation_cache import keep_compiled
from bayesid.design import Search, Store
from studies.common.command import Command
from studies.ets7_limits.analysis import ACCELS, CHECKED, RATES, answers, design_manoeuvre, knowledge_of, tell
from studies.ets7_limits.check import check
from studies.ets7_limits.report import Result, write_report
from studies.ets7_limits.setting import ARM_SPREAD, DURATION, POINTS, limits_problem

__all__ = ["Result", "main", "run"]

SEARCH = Search(starts=2, iterations=60)
REPETITIONS = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1e3, 3e3, 1e4, 1e5)


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
    progress: Callable[[str], None] = lambda text: None,
) -> Result:
    """Run the study.

    Parameters
    ----------
    seed : int
        Every random number follows from it.
    duration : float
        Of the designed manoeuvre [s].
    points : int
        Free control points of every joint.
    search : Search
    noises : int
        Recordings of the check.
    rates, accels : sequence of str
        Sensors, by their labels.
    arm_spread : float
        Relative width of the arm's priors where it is not known exactly; 0 where it always is.
    store : Store, optional
        Keeps what the search found.
    """
    designed = design_manoeuvre(limits_problem(duration, points), seed, search, store or Store.forgetful(), progress)
    own, flown = knowledge_of(designed, arm_spread)
    table = answers(own, rates, {label: ACCELS[label] for label in accels}, progress)
    curves = {
        (name, known): [knowledge.repeated(CHECKED, known).worst(count) for count in REPETITIONS]
        for name, knowledge in (("designed", own), ("flight", flown))
        for known in (True, False)
    }
    progress("flights of the independent simulator")
    checked = check(designed.motion, duration, noises, seed, progress)
    return Result(designed, table, tell(own), tell(flown), REPETITIONS, curves, checked, duration)


COMMAND = Command(
    "ets7_limits",
    "Say what ETS-VII could have identified within its rules.",
    seed=1,
    extra={"--store": {"type": Path, "help": "file that keeps what the search found, for an interrupted run"}},
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    options = COMMAND.parse(arguments)
    keep_compiled()
    store = None if options.store is None else Store.open(options.store, f"ets7-limits {options.seed} {SEARCH}")
    write_report(run(seed=options.seed, store=store, progress=print), options.output)
