"""Section 1.1.1 of the paper: what the planner of a free-flying robot gains by identification.

A path planned in joint space ends elsewhere if the ship is not what the planner takes it for. True ships are drawn from
what the planner holds possible and flown in MuJoCo; the prediction says beforehand where the path may end, before and
after the base was identified from one manoeuvre, and the plan made with the identified base is flown too. ``python -m
studies.planning --full`` writes ``reports/planning.pdf``.
"""

from studies.planning.report import STUDY, Result, run

__all__ = ["STUDY", "Result", "main", "run"]

main = STUDY.main
