"""Section 4.2 of the paper, a load on the arm: found by a loop that keeps every limit, and beside what was printed.

``python -m studies.load --full`` writes ``reports/load.pdf``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bayesid._io.progress import Progress, silent
from bayesid.app.compilation_cache import keep_compiled
from bayesid.design import Search
from studies.common.command import Command
from studies.load.noise_free import Iteration, iterate
from studies.load.safe_loop import Flight, fly_again, fly_loop

__all__ = ["Result", "main", "run"]

FULL, QUICK = Search(), Search(starts=2, iterations=25)
"""Effort of each design of a full and of a quick run."""


@dataclass(frozen=True)
class Result:
    """Outcome of the study.

    Attributes
    ----------
    iterations : list of Iteration
        The paper's two iterations without noise.
    loop, exact : Flight
        The safe loop with the arm known to 5 %, and its manoeuvres flown again with the arm known exactly.
    full : bool
    """

    iterations: list[Iteration]
    loop: Flight
    exact: Flight
    full: bool


def run(folder: Path, *, full: bool = False, seed: int = 0, progress: Progress = silent) -> Result:
    """Run the study.

    Parameters
    ----------
    folder : Path
        Folder of the loop's files; an interrupted run goes on there.
    full : bool
        True for the default effort of each search.
    seed : int
        Seed of all random numbers.
    progress : Progress
        Receiver of the fraction of the loop that is done.
    """
    search = FULL if full else QUICK
    loop = fly_loop(folder, seed=seed, search=search, progress=progress)
    exact = fly_again(folder, loop, seed=seed)
    return Result(iterate(seed=seed, search=search), loop, exact, full)


COMMAND = Command(
    "load",
    "Identify a load on the arm of ETS-VII.",
    full="the default effort of each search",
    seed=0,
    extra={"--folder": {"type": Path, "default": Path("out/load"), "help": "folder that keeps the loop's files"}},
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    from studies.common.provenance import study_origin
    from studies.load.report import write_report

    options = COMMAND.parse(arguments)
    keep_compiled()
    folder = options.folder / ("full" if options.full else "quick")
    folder.mkdir(parents=True, exist_ok=True)
    result = run(folder, full=options.full, seed=options.seed, progress=_show)
    write_report(result, options.output, study_origin("load", options))


def _show(fraction: float, text: str) -> None:
    print(f"{100.0 * fraction:.0f} %: {text}", flush=True)
