"""Section 2.1 and figure 2 of the paper: why the attitude of ETS-VII drifted away from its simulation.

The truth, from an independent simulator, has gravity gradient, momentum left in the wheels and an initial rate; the
simulation starts without the three. ``python -m studies.ets7_drift --full`` writes ``reports/ets7_drift.pdf``.
"""

from studies.ets7_drift.analysis import CAUSES, Case, run
from studies.ets7_drift.report import STUDY

__all__ = ["CAUSES", "STUDY", "Case", "main", "run"]

main = STUDY.main
