"""Study of real measurements: thrown bodies with a reaction wheel, identified, diagnosed, compared with geometry.

Data: Blaha, Kuijper, Pop, Smeur, "Rapid and Inexpensive Inertia Tensor Estimation from a Single Object Throw",
arXiv:2503.13137; not part of the project. ``python -m studies.throws --full`` writes ``reports/throws.pdf``.
"""

from studies.throws.report import STUDY, Result, run

__all__ = ["STUDY", "Result", "main", "run"]

main = STUDY.main
