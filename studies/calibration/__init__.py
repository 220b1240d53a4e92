"""Calibration: whether the truth lies as often within the stated intervals as they say, through the whole chain.

Every replicate draws the unknowns from the prior, records a manoeuvre with all noise, and identifies it as a user
would; the ranks of the truth among draws of the posterior must be uniform (simulation-based calibration). Some cases
draw the truth from the posterior of one data set, and some let MuJoCo make the data. A store keeps one replicate per
line. ``python -m studies.calibration --full`` makes those that are missing and writes ``reports/calibration.pdf``.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from bayesid.app.compilation_cache import keep_compiled
from studies.calibration.outcomes import Replicates, read
from studies.calibration.replicate import make, plan
from studies.calibration.report import write_report
from studies.common.monte_carlo import run_trials
from studies.common.provenance import study_origin
from studies.common.study import TRIALS, Command

__all__ = ["Replicates", "main", "make", "plan", "read", "write_report"]

SEED = 1  # seed of all replicates

COMMAND = Command(
    "calibration",
    "Whether the truth lies as often within the stated intervals as they say.",
    full="all replicates of all cases (hours)",
    extra={
        **TRIALS,
        "--trials": {**TRIALS["--trials"], "default": "out/calibration.jsonl"},
        "--made": {"action": "store_true", "help": "report the replicates made so far, make no more"},
    },
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Make the replicates that are missing and write the report."""
    options = COMMAND.parse(arguments)
    keep_compiled()
    if not options.made:
        run_trials(
            make,
            plan(options.full),
            options.trials,
            seed=SEED,
            workers=options.workers,
            progress=lambda text: print(text, file=sys.stderr),
        )
    write_report(read(options.trials), options.output, study_origin("calibration", options))
    print(f"Wrote {options.output}.")
