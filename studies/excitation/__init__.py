"""Which manoeuvre tells most about the base: the paper's criterion against the posterior it leads to.

The paper's 4.1 manoeuvre, a poor neighbour of it and the best by each criterion compete on ETS-VII at equal duration
within equal limits, once with the rule of the flight (50 mm/s and 5 deg/s at the tip) and once with no rule for the
tip. The predicted posterior is compared with emcee on data of an independent simulator, and with the errors realised
over repeated noise. ``python -m studies.excitation --full`` writes ``reports/excitation.pdf``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayesid.app.compilation_cache import keep_compiled
from bayesid.design import Search
from studies.common.command import Command
from studies.common.ets7 import LIMITS
from studies.excitation.cloud import Cloud, Sensitivity, random_cloud, sensitivity
from studies.excitation.contest import Contest, compete
from studies.excitation.realised import Realised, realise
from studies.excitation.world import FAST

__all__ = ["Result", "main", "run"]

SETS = {"within the flight's rule": LIMITS, "without a rule for the tip": FAST}
"""Sets of limits by their names, which complete a sentence of the report."""


@dataclass(frozen=True)
class Result:
    """Outcome of the study.

    Attributes
    ----------
    contests : mapping of str to Contest
        Contests by the name of their set of limits.
    realised : mapping of (set, design) to Realised
        Designs that were flown.
    clouds : mapping of str to Cloud
        Random manoeuvres within the flight's rule by their family.
    sensitivities : mapping of str to Sensitivity
        Sensitivities along the paper's manoeuvre and its poor neighbour, without a rule for the tip.
    """

    contests: Mapping[str, Contest]
    realised: Mapping[tuple[str, str], Realised]
    clouds: Mapping[str, Cloud]
    sensitivities: Mapping[str, Sensitivity]


def run(
    *,
    full: bool = False,
    seed: int = 1,
    search: Search | None = None,
    repeats: int | None = None,
    random: int | None = None,
    points: int = 8,
    sets: Sequence[str] = tuple(SETS),
    progress: Callable[[str], None] = lambda text: None,
) -> Result:
    """Run the study.

    Parameters
    ----------
    full : bool
        True for all criteria in place of three, and for effort to match.
    seed : int
        Seed of all random numbers.
    search : Search, optional
        Effort of each design.
    repeats : int, optional
        Number of noisy recordings of the d-optimal design within the first set of limits; other designs that are flown
        have a quarter of them.
    random : int, optional
        Number of random manoeuvres per family.
    points : int
        Number of free control points of every joint.
    sets : sequence of str
        Names of the sets of limits.
    progress : callable, optional
        Receives a line on what is being done.
    """
    search = search or (Search() if full else Search(starts=4, iterations=10))
    repeats = (400 if full else 4) if repeats is None else repeats
    random = (500 if full else 20) if random is None else random
    contests, realised = {}, {}
    for name in sets:
        contests[name] = compete(SETS[name], seed, search, full, points, progress)
        for design in ("paper-26", "d-optimal") if full else ("d-optimal",):
            count = repeats if (name, design) == (sets[0], "d-optimal") else max(4, repeats // 4)
            item = contests[name].designs[design]
            realised[name, design] = realise(item, seed, count, 2000.0 if full else 300.0, progress)
    rng = np.random.default_rng(seed)
    first, last = contests[sets[0]].designs, contests[sets[-1]].designs
    clouds = {
        "(27), three joints": random_cloud(first["27: paper-26"].problem, random, rng),
        "splines, six joints": random_cloud(first["paper-26"].problem, random, rng),
    }
    weights = {name: sensitivity(last[name].problem, last[name].parameters) for name in ("printed", "poor")}
    return Result(contests, realised, clouds, weights)


COMMAND = Command(
    "excitation",
    "Compare manoeuvres by the posterior they lead to.",
    full="all criteria, 400 recordings per design (half an hour)",
    seed=1,
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    from studies.excitation.report import write_report

    options = COMMAND.parse(arguments)
    keep_compiled()
    write_report(run(full=options.full, seed=options.seed, progress=print), options.output)
