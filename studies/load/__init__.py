"""Section 4.2 of the paper, a load on the arm: identified by a loop within all limits, compared with printed values.

``python -m studies.load --full`` writes ``reports/load.pdf``.
"""

from studies.load.report import STUDY, Result, run

__all__ = ["STUDY", "Result", "main", "run"]

main = STUDY.main
