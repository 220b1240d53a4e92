"""Two causes that a first manoeuvre cannot distinguish, and the manoeuvre designed to separate them.

Residual wheel momentum of a slowly drifting base gives a nearly constant torque, and so does a leaking valve.
One of them is hidden with MuJoCo, both are fitted, and the Bayes factor is evaluated before and after the designed
manoeuvre. ``python -m studies.separating`` writes ``reports/separating.pdf``.
"""

from studies.separating.analysis import Result, run
from studies.separating.report import STUDY

__all__ = ["STUDY", "Result", "main", "run"]

main = STUDY.main
