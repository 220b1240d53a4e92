"""The report of the benchmark."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from bayesid.report import Document
from studies.benchmark.run import Benchmark, run
from studies.benchmark.sampling import Sampling
from studies.common.command import Command
from studies.common.tables import add_number_table

__all__ = ["main", "write_report"]

GOALS = {"Pinocchio, step by step in Python": 2000.0, "MuJoCo rollouts in C": 100.0}
"""Smallest wanted ratio of the time of each other simulator to that of an evaluation."""

ENOUGH = 50.0
"""Number of autocorrelation times from which on the estimate of the autocorrelation is reliable."""


def write_report(result: Benchmark, file: Path) -> None:
    """Write the report as PDF."""
    document = Document("Benchmark", "Cost of simulations and of effective samples, as ratios of one run")
    _simulations(document, result)
    _dependence(document, result)
    _samples(document, result.sampling)
    document.write(file)


def _simulations(document: Document, result: Benchmark) -> None:
    document.section("Simulations")
    document.paragraph(
        "One evaluation simulates a manoeuvre of ETS-VII of 120 s with rate and accelerometer at 2 Hz and gives its "
        f"log likelihood. It takes {1e6 * result.evaluation:.0f} µs in batches on this machine, with an integration "
        f"error of {result.error:.2g} σ of a sample. The other simulators simulate the same manoeuvre with steps short "
        "enough for an error below 0.01 σ, where they reach it. MuJoCo's joints are driven by the exact torques at "
        "mid-step, which is the best case for it; it simulates without the gravity gradient."
    )
    add_number_table(
        document,
        ["simulator", "step [s]", "error [σ]", "time [ms]", "ratio", "goal"],
        [
            [
                rival.name,
                f"{rival.step:g}",
                f"{rival.error:.2g}",
                f"{1e3 * rival.seconds:.3g}",
                f"{result.speedups[rival.name]:.0f}",
                f"{GOALS[rival.name]:.0f}",
            ]
            for rival in result.rivals
        ],
        "Time per simulation over that of one evaluation.",
    )


def _dependence(document: Document, result: Benchmark) -> None:
    document.section("Dependence of the cost on the problem")
    for title, header, times in (
        ("Time of one evaluation by number of links; the goal is a ratio of at most 1.3.", "links", result.links),
        ("Time by number of samples of a recording of 120 s.", "samples", result.samples),
        ("Time by treatment of the joints' noise; the goal is a ratio of at most 1.5.", "noise", result.whitening),
    ):
        first = next(iter(times.values()))
        rows = [[str(key), f"{1e6 * value:.0f}", f"{value / first:.2f}"] for key, value in times.items()]
        add_number_table(document, [header, "time [µs]", "ratio to the first"], rows, title)
    windows = ", ".join(f"{name}: {count}" for name, count in result.windows.items())
    document.paragraph(f"Numbers of earlier sample times that the whitening conditions on: {windows}.")


def _samples(document: Document, sampling: Sampling) -> None:
    document.section("Effective samples")
    chains = sampling.chains
    document.paragraph(
        f"The base of ETS-VII is identified from three recordings of 120 s, with {chains.z.shape[-1]} unknowns. The "
        f"package's moves gave {chains.effective_samples:.0f} effective samples in {sampling.seconds:.1f} s after "
        f"compilation (R-hat {chains.r_hat:.4f}, {chains.evaluations} evaluations); the goal is 4,000 within 15 s."
    )
    lengths = f"The default move's chain covers {sampling.default_lengths:.0f} autocorrelation times"
    if sampling.default_lengths < ENOUGH:
        lengths += ", too few to be sure of its length, so the ratio is a lower bound"
    add_number_table(
        document,
        ["moves", "evaluations per effective sample", "time per effective sample [ms]"],
        [
            [
                "Laplace-t independence and differential evolution",
                f"{sampling.evaluations:.1f}",
                f"{1e3 * sampling.seconds / chains.effective_samples:.2f}",
            ],
            [
                "emcee's default stretch move",
                f"{sampling.default_evaluations:.0f}",
                f"{1e3 * sampling.default_seconds:.2f}",
            ],
        ],
        "Cost of an effective sample. The ratio of evaluations is "
        f"{sampling.default_evaluations / sampling.evaluations:.0f}; the goal is 20. {lengths}.",
    )


COMMAND = Command(
    "benchmark", "Measure the cost of simulations and of effective samples.", full="longer chains, more repeats"
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the benchmark and write its report."""
    options = COMMAND.parse(arguments)
    write_report(run(full=options.full), options.output)
