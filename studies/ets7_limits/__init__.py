"""What ETS-VII itself could have identified within its flight rules, in what time, and with which sensors.

The d-optimal manoeuvre of `studies.excitation`, within 50 mm/s and 5 degrees a second at the tip, is taken from the
table beside that study's report. Its information is rescaled for other sensors, repeated, and evaluated with an arm
that is not known exactly, beside that of the flight's own manoeuvre. ``python -m studies.ets7_limits`` writes
``reports/ets7_limits.pdf``.
"""

from studies.ets7_limits.analysis import Result, run
from studies.ets7_limits.report import STUDY

__all__ = ["STUDY", "Result", "main", "run"]

main = STUDY.main
