"""Section 1.1.1 of the paper: what the planner of a free-flying robot gains by identification.

A path planned in joint space ends elsewhere if the ship is not what the planner takes it for. True ships are drawn from
what the planner holds possible and flown in MuJoCo; the prediction says beforehand where the path may end, before and
after the base was identified from one manoeuvre, and the plan made with the identified base is flown too. ``python -m
studies.planning --full`` writes ``reports/planning.pdf``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.app.compilation_cache import keep_compiled
from studies.common import mission
from studies.common.flight import Flown, flown_along
from studies.common.monte_carlo import Workers
from studies.common.study import TRIALS, Command
from studies.planning.planner import Planner
from studies.planning.ships import Row, Trip, row_of, trip_of
from studies.planning.world import planners_model

__all__ = ["Result", "main", "run"]

SHIPS, FEW = 200, 20  # number of drawn ships of each row in a full and in a quick run


@dataclass(frozen=True)
class Result:
    """Outcome of the study."""

    rows: Mapping[str, Row]  # drawn ships by what is known of the arm, see `studies.common.mission.ROWS`
    example: tuple[Trip, ...]  # paths of one more ship by stage, arm as in the headline
    course: Flown  # course of the first path with the published ship in MuJoCo
    full: bool


def run(
    parameters: Floats,
    *,
    full: bool = False,
    seed: int = 1,
    ships: int | None = None,
    trials: Path | None = None,
    workers: Workers = 1,
    progress: Callable[[str], None] = lambda text: None,
) -> Result:
    """Run the study.

    Parameters
    ----------
    parameters : (n,) array
        Parameters of the identifying manoeuvre, `studies.common.mission.splines`.
    full : bool
        True for `SHIPS` ships of each row.
    seed : int
        Seed of all random numbers.
    ships : int, optional
        Number of ships of each row.
    trials : path, optional
        Folder that keeps the trials of every row.
    workers : int or Executor
        Number of processes for these trials.
    progress : callable, optional
        Receives a line on what is being done.
    """
    ships = (SHIPS if full else FEW) if ships is None else ships
    rows = {
        row: row_of(
            parameters,
            spread,
            ships,
            seed=1000 * seed + number,
            store=None if trials is None else trials / f"{number}.jsonl",
            workers=workers,
            progress=lambda text, row=row: progress(f"{row}: {text}"),  # type: ignore[misc]
        )
        for number, (row, spread) in enumerate(mission.ROWS.items())
    }
    spread = next(iter(mission.ROWS.values()))
    example, _ = trip_of(tuple(map(float, parameters)), spread, np.random.default_rng(seed))
    course = flown_along(mission.ship(), Planner(planners_model(spread)).first, mission.DURATION)
    return Result(rows, example, course, full and ships >= SHIPS)


COMMAND = Command(
    "planning",
    "Say what a planner gains by identification.",
    full=f"{SHIPS} drawn ships for each knowledge of the arm",
    seed=1,
    extra={
        "--tables": {"type": Path, "default": Path("reports"), "help": "folder with the tables of excitation"},
        "--ships": {"type": int, "help": "number of drawn ships for each knowledge of the arm"},
        **TRIALS,
    },
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    from studies.common.provenance import MODELS, study_origin
    from studies.ets7_limits.analysis import designed_motion
    from studies.planning.report import write_report

    options = COMMAND.parse(arguments)
    keep_compiled()
    table = options.tables / "excitation-manoeuvres.csv"
    result = run(
        np.asarray(designed_motion(table).parameters),
        full=options.full,
        seed=options.seed,
        ships=options.ships,
        trials=options.trials,
        workers=options.workers,
        progress=lambda text: print(text, flush=True),
    )
    write_report(result, options.output, study_origin("planning", options, [MODELS / "ets7.urdf", table]))
