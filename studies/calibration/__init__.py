"""Calibration: whether stated intervals contain the truth as often as they state, through the whole chain.

Every replicate draws the unknowns from the prior, records a manoeuvre with all noise, and identifies it as a user
would; the ranks of the truth among draws of the posterior must be uniform (simulation-based calibration). Some cases
draw the truth from the posterior of one data set, and some let MuJoCo make the data. A store keeps one replicate per
line. ``python -m studies.calibration --full`` makes those that are missing and writes ``reports/calibration.pdf``.
"""

from studies.calibration.replicate import Replicates, make, plan, read
from studies.calibration.report import STUDY

__all__ = ["STUDY", "Replicates", "main", "make", "plan", "read"]

main = STUDY.main
