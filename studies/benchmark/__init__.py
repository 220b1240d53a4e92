"""Benchmark: cost of a simulation and of an effective sample, as ratios measured in one run.

Absolute times depend on the machine and its load; ratios measured side by side depend on them much less. Comparisons
are made at the same accuracy, a hundredth of the sensors' noise. ``python -m studies.benchmark --full`` writes
``reports/benchmark.pdf``.
"""

from studies.benchmark.report import STUDY
from studies.benchmark.run import Benchmark, Result, run

__all__ = ["STUDY", "Benchmark", "Result", "main", "run"]

main = STUDY.main
