"""Benchmark: what a simulation and an effective sample cost, as ratios measured in one run.

Absolute times depend on the machine and its load; ratios taken side by side do so much less. Comparisons are made at
the same accuracy, a hundredth of the sensors' noise.
"""

from studies.benchmark.report import main, write_report
from studies.benchmark.run import Benchmark, run

__all__ = ["Benchmark", "main", "run", "write_report"]
