"""Section 4.2 of the paper, a load on the arm: found by a loop that keeps every limit, and beside what was printed.

``python -m studies.load --full`` writes ``reports/load.pdf``.
"""

from studies.load.report import STUDY, Result, run

__all__ = ["STUDY", "Result", "main", "run"]

main = STUDY.main
