"""Two causes that a first manoeuvre cannot tell apart, and the manoeuvre designed to separate them.

Momentum left in the wheels of a slowly drifting base makes a torque that is nearly constant; so does a leaking valve.
One of them is hidden with MuJoCo, both are fitted, and the Bayes factor is evaluated before and after the designed
manoeuvre. ``python -m studies.separating`` writes ``reports/separating.pdf``.
"""

from studies.separating.analysis import Result, run
from studies.separating.report import STUDY

__all__ = ["STUDY", "Result", "main", "run"]

main = STUDY.main
