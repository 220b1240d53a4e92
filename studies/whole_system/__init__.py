"""Problem 3 of the paper: the inertial parameters of every body of ETS-VII and of the load in its hand.

The study determines what each manoeuvre and each sensor adds to the drawings, what must be known, and what restores
the scale of the masses. It identifies all bodies, from motion alone and with joint torques, checks whether the stated
uncertainty covers the truth, and applies the paper's linear regressor method to the same data. An independent simulator
flies the manoeuvres. ``python -m studies.whole_system --full`` writes ``reports/whole_system.pdf``.
"""

from studies.whole_system.identification import Result, run
from studies.whole_system.report import STUDY

__all__ = ["STUDY", "Result", "main", "run"]

main = STUDY.main
