"""Section 3.1 of the paper: which combinations of the inertial parameters can be identified at all.

The paper's two-joint example is worked through, then ETS-VII: the base parameters as sums of standard parameters, those
that follow once the dependent ones are known, and the data that show the scale of the masses.
``python -m studies.base_parameters`` writes ``reports/base_parameters.pdf``.
"""

from studies.base_parameters.report import STUDY, Result, run

__all__ = ["STUDY", "Result", "main", "run"]

main = STUDY.main
