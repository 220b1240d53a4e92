"""Which manoeuvre determines the base best: the paper's criterion compared with posterior criteria.

The paper's manoeuvre of section 4.1, a poor neighbour of it and the best by each criterion compete on ETS-VII at equal
duration within the rule of the flight (50 mm/s and 5 deg/s at the tip). The predicted posterior is compared with the
errors realised over repeated flights of an independent simulator. ``python -m studies.excitation --full`` writes
``reports/excitation.pdf`` and, beside it, the manoeuvres, which `studies.ets7_limits` reads.
"""

from studies.excitation.report import STUDY
from studies.excitation.search import Result, run

__all__ = ["STUDY", "Result", "main", "run"]

main = STUDY.main
