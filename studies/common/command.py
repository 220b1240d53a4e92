"""The command line of a study: ``python -m studies.NAME [--full] [--output FILE] [--seed N]`` and further options."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bayesid.app.scheduler import executor_at

__all__ = ["TRIALS", "WORKERS", "Command"]

WORKERS: Mapping[str, Mapping[str, Any]] = {
    "--workers": {"type": int, "default": 1, "help": "number of processes that run the trials"},
    "--scheduler": {
        "metavar": "ADDRESS",
        "dest": "workers",
        "type": executor_at,
        "help": "scheduler of dask.distributed whose workers run the trials, in place of processes of this machine",
    },
}
"""Options of what runs the trials: ``workers`` of `studies.common.monte_carlo.run_trials`."""

TRIALS: Mapping[str, Mapping[str, Any]] = {
    "--trials": {"type": Path, "help": "file that keeps the Monte Carlo trials, for an interrupted run"},
    **WORKERS,
}
"""Options of a study with `studies.common.monte_carlo.run_trials`, for `Command.extra`."""


@dataclass(frozen=True)
class Command:
    """What a study understands on the command line.

    Attributes
    ----------
    name : str
        Name of the study, and of its report.
    description : str
        One sentence that says what the study does.
    full : str, optional
        What ``--full`` adds; the study has no such option where left out.
    seed : int, optional
        Seed of all random numbers unless another is given; the study has no such option where left out.
    extra : mapping
        Further options -> keywords of ``argparse.ArgumentParser.add_argument``.
    """

    name: str
    description: str
    full: str | None = None
    seed: int | None = None
    extra: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def parse(self, arguments: Sequence[str] | None = None) -> argparse.Namespace:
        """Options given, those of the command line where no arguments are; the report's folder is made."""
        parser = argparse.ArgumentParser(prog=f"python -m studies.{self.name}", description=self.description)
        if self.full is not None:
            parser.add_argument("--full", action="store_true", help=self.full)
        report = Path("reports") / f"{self.name}.pdf"
        parser.add_argument("--output", type=Path, default=report, help="PDF file, or folder, of the report")
        if self.seed is not None:
            parser.add_argument("--seed", type=int, default=self.seed, help="seed of all random numbers")
        for option, keywords in self.extra.items():
            parser.add_argument(option, **keywords)
        options = parser.parse_args(arguments)
        if options.output.is_dir() or not options.output.suffix:
            options.output /= report.name
        summary = options.output.with_suffix(".json")  # written beside the report
        for name, value in vars(options).items():
            if isinstance(value, Path) and value == summary:
                parser.error(f"--{name} {value} is the file of the report's summary: give another name")
        options.output.parent.mkdir(parents=True, exist_ok=True)
        return options
