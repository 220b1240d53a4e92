"""The report of the benchmark."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from bayesid.report import Document
from studies.benchmark.run import Benchmark, run
from studies.common.command import Command

GOALS = {"Pinocchio, step by step in Python": 2000.0, "MuJoCo rollouts in C": 100.0}


def write_report(result: Benchmark, file: Path) -> None:
    """Write the report as PDF."""
    document = Document("Benchmark", "Cost of simulations and of effective samples, as ratios of one run")
    document.section("Simulations")
    document.paragraph(
        "One evaluation simulates a 120 s manoeuvre of ETS-VII with rate and accelerometer at 2 Hz and gives its log "
        f"likelihood: {1e6 * result.evaluation:.0f} µs in batches on this machine, with an integration error of "
        f"{result.error:.2g} σ of a sample. The rivals simulate the same manoeuvre with steps short enough for "
        "an error below 0.01 σ, where they reach it. MuJoCo's joints are driven by the exact torques at mid-step, the "
        "best case for it; it does without the gravity gradient."
    )
    document.table(
        ["simulator", "step [s]", "error [σ]", "time [ms]", "ratio", "goal"],
        [
            [
                r.name,
                f"{r.step:g}",
                f"{r.error:.2g}",
                f"{1e3 * r.seconds:.3g}",
                f"{result.speedups[r.name]:.0f}",
                f"{GOALS[r.name]:.0f}",
            ]
            for r in result.rivals
        ],
        "Time per simulation over that of one evaluation.",
        ["left"] + ["right"] * 5,
    )
    document.section("What the cost depends on")
    for title, header, times in (
        ("Time of one evaluation by number of links; the goal is flat within 1.3.", "links", result.links),
        ("By number of samples of a 120 s recording.", "samples", result.samples),
        ("By treatment of the joints' noise; the goal is at most 1.5 of white noise.", "noise", result.whitening),
    ):
        first = next(iter(times.values()))
        rows = [[str(key), f"{1e6 * value:.0f}", f"{value / first:.2f}"] for key, value in times.items()]
        document.table([header, "time [µs]", "ratio to the first"], rows, title, ["left", "right", "right"])
    windows = ", ".join(f"{name}: {count}" for name, count in result.windows.items())
    document.paragraph(f"Earlier sample times that the whitening conditions on: {windows}.")
    document.section("Effective samples")
    s = result.sampling
    document.paragraph(
        f"Base of ETS-VII from three recordings of 120 s, {s.ours.z.shape[-1]} unknowns. Our moves gave "
        f"{s.ours.effective_samples:.0f} effective samples in {s.seconds:.1f} s after compilation "
        f"(R-hat {s.ours.r_hat:.4f}, {s.ours.evaluations} evaluations); the goal is 4,000 within 15 s."
    )
    ratio = s.default_evaluations / s.evaluations
    document.table(
        ["moves", "evaluations per effective sample", "time per effective sample [ms]"],
        [
            [
                "Laplace-t independence and differential evolution",
                f"{s.evaluations:.1f}",
                f"{1e3 * s.seconds / s.ours.effective_samples:.2f}",
            ],
            ["emcee's default stretch move", f"{s.default_evaluations:.0f}", f"{1e3 * s.default_seconds:.2f}"],
        ],
        f"Ratio of evaluations {ratio:.0f}; the goal is 20. The default move's chain covers {s.default_lengths:.0f} "
        "autocorrelation times"
        + (", too few to be sure of its length: the ratio is a lower bound." if s.default_lengths < 50.0 else "."),
        ["left", "right", "right"],
    )
    document.write(file)


COMMAND = Command("benchmark", "Cost of simulations and of effective samples.", full="longer chains, more repeats")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the benchmark and write its report."""
    options = COMMAND.parse(arguments)
    write_report(run(full=options.full), options.output)
