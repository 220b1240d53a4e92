"""Section 2.1 and figure 2 of the paper: why the attitude of ETS-VII drifted away from its simulation.

The truth, from an independent simulator, has gravity gradient, momentum left in the wheels and an initial rate; the
simulation starts without the three. ``python -m studies.ets7_drift --full`` writes ``reports/ets7_drift.pdf``.
"""

from __future__ import annotations

from collections.abc import Sequence

from bayesid._io.progress import Progress, silent
from bayesid.app.compilation_cache import keep_compiled
from studies.common.provenance import study_origin
from studies.common.study import Command
from studies.ets7_drift.analysis import CAUSES, Case, analyse
from studies.ets7_drift.report import write_report
from studies.ets7_drift.world import DURATION, KNOWN, draw_world

__all__ = ["CAUSES", "Case", "main", "run"]


def run(
    *,
    full: bool = False,
    seed: int = 1,
    duration: float = DURATION,
    names: Sequence[str] | None = None,
    progress: Progress = silent,
) -> dict[str, Case]:
    """Run the study and return its cases by what is known of the base, as in `studies.ets7_drift.world.KNOWN`.

    Parameters
    ----------
    full : bool
        True for three recordings and all cases, in place of two recordings and a base known to 1 %.
    seed : int
        Seed of all random numbers.
    duration : float
        Duration of each recording [s].
    names : sequence of str, optional
        Names of the candidates, by default the whole catalogue.
    progress : callable, optional
        Receives a fraction and a sentence, anew in every case.
    """
    cases = KNOWN if full else {"1 %": KNOWN["1 %"]}
    return {
        known: analyse(
            draw_world(3 if full else 2, seed, spread, duration=duration), spread, seed, progress, names=names
        )
        for known, spread in cases.items()
    }


COMMAND = Command(
    "ets7_drift",
    "Name what makes the attitude of ETS-VII drift.",
    full="three recordings, and a base known to 5 %%",
    seed=1,
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    options = COMMAND.parse(arguments)
    keep_compiled()
    cases = run(full=options.full, seed=options.seed, progress=lambda share, text: print(f"{share:4.0%} {text}"))
    write_report(cases, options.output, full=options.full, origin=study_origin(COMMAND.name, options))
