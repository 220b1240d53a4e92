"""Two causes that a first manoeuvre cannot distinguish, and the manoeuvre designed to separate them.

Residual wheel momentum of a slowly drifting base gives a nearly constant torque, and so does a leaking valve.
One of them is hidden with MuJoCo, both are weighed with the prior of a diagnosis, and the rate at which the true one is
identified is predicted and realised before and after the designed manoeuvre; three further pairs likewise.
``python -m studies.separating`` writes ``reports/separating.pdf``.
"""

from studies.separating.analysis import Result, run
from studies.separating.report import STUDY

__all__ = ["STUDY", "Result", "main", "run"]

main = STUDY.main
