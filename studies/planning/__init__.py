"""Section 1.1.1 of the paper: what path planning of a free-flying robot gains from identification.

A path planned in joint space misses its target if the spacecraft differs from the planner's model. True spacecraft are
drawn from the planner's prior and flown in MuJoCo. The final pose is predicted before and after the base is identified
from one manoeuvre, and the plan made with the identified base is flown too. ``python -m studies.planning --full``
writes ``reports/planning.pdf``.
"""

from studies.planning.report import STUDY, Result, run

__all__ = ["STUDY", "Result", "main", "run"]

main = STUDY.main
