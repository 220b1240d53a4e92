"""Section 4.2 of the paper, identification of a load, beside what the paper printed; then with real sensors.

``python -m studies.load --full`` writes ``reports/load.pdf``.
"""

from __future__ import annotations

from collections.abc import Sequence

from bayesid.design import Search
from studies.common.command import Command
from studies.load.noise_free import iterate
from studies.load.report import Result, write_report
from studies.load.sampled import fly_all

__all__ = ["Result", "main", "run"]


def run(*, full: bool = False, seed: int = 0) -> Result:
    """Run the study.

    Parameters
    ----------
    full : bool
        True to search for the manoeuvres and to add the loops with noise, which takes a quarter of an hour.
    seed : int
        Seed of all random numbers.
    """
    if not full:
        return Result(iterate(seed=seed), {})
    search = Search(starts=8, iterations=60)
    return Result(iterate(seed=seed, search=search), fly_all(seed=seed, search=search))


COMMAND = Command(
    "load", "Identify a load on the arm of ETS-VII.", full="search for the manoeuvres, and fly with noise", seed=0
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    options = COMMAND.parse(arguments)
    write_report(run(full=options.full, seed=options.seed), options.output)
