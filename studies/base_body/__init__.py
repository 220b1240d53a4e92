"""Section 4.1 of the paper, identification of the base body, beside what the paper printed; and what it left open."""

from __future__ import annotations

import argparse
from pathlib import Path

from studies.base_body.figures import draw
from studies.base_body.report import write
from studies.base_body.result import BaseBody, compute

__all__ = ["BaseBody", "main", "run"]


def run(*, full: bool = False, seed: int = 0) -> BaseBody:
    """Run the study.

    Parameters
    ----------
    full : bool
        Add what takes minutes: samples by emcee, measured joints, the slow manoeuvre, the heavier arm.
    seed : int
        Every random number follows from it.
    """
    result = compute(full=full, seed=seed)
    result.figures.update(draw(result))
    return result


def main() -> None:
    """Run the study and write its report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--full", action="store_true", help="add what takes minutes")
    parser.add_argument("--output", type=Path, default=Path("reports/base_body.pdf"))
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    options.output.parent.mkdir(parents=True, exist_ok=True)
    write(run(full=options.full, seed=options.seed), options.output)
