"""Which manoeuvre tells most about the base: the paper's criterion against the posterior it leads to.

The paper's manoeuvre of section 4.1, a poor neighbour of it and the best by each criterion compete on ETS-VII at equal
duration within the rule of the flight (50 mm/s and 5 deg/s at the tip). The predicted posterior is compared with the
errors realised over repeated flights of an independent simulator. ``python -m studies.excitation --full`` writes
``reports/excitation.pdf`` and, beside it, the manoeuvres, which `studies.ets7_limits` reads.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bayesid.app.compilation_cache import keep_compiled
from bayesid.design import THOROUGH, DOptimal, Search, Store
from studies.common import mission
from studies.common.monte_carlo import Workers
from studies.common.repeated_fits import Realised, repeat
from studies.common.study import TRIALS, Command
from studies.excitation.cloud import Cloud, random_cloud
from studies.excitation.contest import Contest, compete, contest_problem, sparse
from studies.excitation.rivals import Rivals, other_robots
from studies.excitation.saturation import CROWDED, Crowd, Searches, crowd_of, searches_of

__all__ = ["Result", "main", "run"]

FULL, QUICK = THOROUGH, Search(starts=3, iterations=60)  # effort of each search of a full and of a quick run


@dataclass(frozen=True)
class Result:
    """Outcome of the study."""

    contest: Contest
    realised: Mapping[str, Realised]  # designs that were flown, by name
    cloud: Cloud  # random manoeuvres, splines of all joints
    crowds: Mapping[str, Crowd]  # searches from many starts by criterion, if there were any
    searches: Searches | None  # repeated thorough searches by d-optimality, if there were any
    rivals: Mapping[str, Rivals]  # A search and the best of many descents on other robots, if there were any
    search: Search  # effort of each other search
    full: bool


def run(
    *,
    full: bool = False,
    seed: int = 1,
    search: Search | None = None,
    starts: int | None = None,
    searches: int | None = None,
    repeats: int | None = None,
    flown: Sequence[str] = ("d-optimal",),
    random: int | None = None,
    points: int = mission.POINTS,
    store: Store | None = None,
    trials: Path | None = None,
    workers: Workers = 1,
    executor: Executor | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> Result:
    """Run the study.

    Parameters
    ----------
    full : bool
        True for all criteria in place of four, for the thorough effort of each search, and to fly all of them.
    seed : int
        Seed of all random numbers.
    search : Search, optional
        Effort of each design.
    starts : int, optional
        Number of cheap descents by each of `CROWDED` from which the contest begins, too; none where left out.
    searches : int, optional
        Number of thorough searches by d-optimality that differ in their seeds, from whose best the contest begins, too.
        With ``starts`` as well, other robots are searched.
    repeats : int, optional
        Number of flights of each design that is flown; 400 in a full run, 100 in a quick one.
    flown : sequence of str
        Designs to fly in a quick run.
    random : int, optional
        Number of random manoeuvres.
    points : int
        Number of free control points of every joint.
    store : Store, optional
        Results of searches of an earlier run that was interrupted.
    trials, workers
        Folder that keeps the flights, and number of processes that fly.
    executor : concurrent.futures.Executor, optional
        Executor of the descents of all searches.
    progress : callable, optional
        Receives a line on what is being done.
    """
    search = replace(search or (FULL if full else QUICK), executor=executor)
    repeats = (400 if full else 100) if repeats is None else repeats
    random = (500 if full else 100) if random is None else random
    store = store or Store.forgetful()
    problem, crowds, rivals = contest_problem(full, points), {}, {}
    if starts is not None:
        effort = replace(QUICK, starts=starts, executor=executor)
        crowds = {item.name: crowd_of(problem, item, seed, effort, store, sparse(progress)) for item in CROWDED}
    first, repeated = [crowd.best for crowd in crowds.values()], None
    if searches:
        effort = replace(THOROUGH, executor=executor)
        repeated = searches_of(problem, DOptimal(), seed, searches, effort, store, sparse(progress))
        first.append(repeated.best)
        if starts is not None:
            rivals = other_robots(seed, replace(QUICK, starts=starts, executor=executor), effort, store, progress)
    contest = compete(problem, seed, search, first, store, progress)
    own = contest.designs["d-optimal"].problem
    cloud = random_cloud(own, random, np.random.default_rng(seed))
    realised = {}
    for number, name in enumerate(contest.designs):
        if full or name in flown:
            realised[name] = repeat(
                contest.designs[name].parameters,
                points,
                repeats,
                seed=1000 * seed + number,
                store=None if trials is None else trials / f"{name}.jsonl",
                workers=workers,
                progress=lambda text, name=name: progress(f"{name}: {text}"),  # type: ignore[misc]
            )
    return Result(contest, realised, cloud, crowds, repeated, rivals, search, full)


COMMAND = Command(
    "excitation",
    "Compare manoeuvres by the posterior they lead to.",
    full="all criteria, the thorough effort of each search, every design flown",
    seed=1,
    extra={
        "--repeats": {"type": int, "help": "number of flights of each design that is flown"},
        "--starts": {"type": int, "help": "number of further descents by (26) and d-optimality"},
        "--searches": {"type": int, "help": "number of thorough searches by d-optimality that are compared"},
        "--store": {"type": Path, "help": "file that keeps the results of the searches, for an interrupted run"},
        **TRIALS,
    },
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    from studies.common.provenance import study_origin
    from studies.excitation.report import write_report

    options = COMMAND.parse(arguments)
    keep_compiled()
    effort = FULL if options.full else QUICK
    store = None if options.store is None else Store.open(options.store, f"excitation {options.seed} {effort}")
    with ThreadPoolExecutor(os.cpu_count()) as executor:
        result = run(
            full=options.full,
            seed=options.seed,
            starts=options.starts,
            searches=options.searches,
            repeats=options.repeats,
            store=store,
            trials=options.trials,
            workers=options.workers,
            executor=executor,
            progress=lambda text: print(text, flush=True),
        )
    write_report(result, options.output, study_origin("excitation", options))
