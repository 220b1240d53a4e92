"""Section 4.2 of the paper, identification of a load, beside what the paper printed; then with real sensors.

``python -m studies.load --full`` writes ``reports/load.pdf``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from bayesid.design import Search
from studies.common.command import Command
from studies.load.noise_free import Iteration, iterate
from studies.load.report import write
from studies.load.sampled import Flight, fly_all

__all__ = ["Result", "main", "run"]


@dataclass(frozen=True)
class Result:
    """Numbers of the study.

    Attributes
    ----------
    iterations : list of Iteration
        Without noise.
    flights : mapping of str to Flight
        With noise, by how the manoeuvres were planned; full study only.
    """

    iterations: list[Iteration]
    flights: Mapping[str, Flight]


def run(*, full: bool = False, seed: int = 0) -> Result:
    """Run the study.

    Parameters
    ----------
    full : bool
        Search for the manoeuvres, and add the loops with noise: a quarter of an hour.
    seed : int
        Every random number follows from it.
    """
    if not full:
        return Result(iterate(seed=seed), {})
    search = Search(starts=2, iterations=60)
    return Result(iterate(seed=seed, search=search), fly_all(seed=seed, search=search))


COMMAND = Command(
    "load", "Identify a load on the arm of ETS-VII.", full="search for the manoeuvres, and fly with noise", seed=0
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    options = COMMAND.parse(arguments)
    result = run(full=options.full, seed=options.seed)
    write(result.iterations, result.flights, options.output)
