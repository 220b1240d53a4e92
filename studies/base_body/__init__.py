"""Section 4.1 of the paper, identification of the base body, beside what the paper printed; and what it left open."""

from __future__ import annotations

from collections.abc import Sequence

from bayesid.app.compilation_cache import keep_compiled
from studies.base_body.report import write_report
from studies.base_body.result import BaseBody, compute
from studies.common.provenance import study_origin
from studies.common.study import Command

__all__ = ["BaseBody", "main", "run"]


def run(*, full: bool = False, seed: int = 0) -> BaseBody:
    """Run the study.

    Parameters
    ----------
    full : bool
        Whether to add what takes minutes: samples by emcee, measured joints, the heavier arm.
    seed : int
        Seed of all random numbers.
    """
    return compute(full=full, seed=seed)


COMMAND = Command(
    "base_body",
    "Identify the base body of ETS-VII, beside what the paper printed.",
    full="add what takes minutes",
    seed=0,
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study and write its report."""
    options = COMMAND.parse(arguments)
    keep_compiled()
    result = run(full=options.full, seed=options.seed)
    write_report(result, options.output, origin=study_origin(COMMAND.name, options))
