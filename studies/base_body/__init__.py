"""Section 4.1 of the paper: identification of the base body, compared with the printed results."""

from studies.base_body.report import STUDY, BaseBody, run

__all__ = ["STUDY", "BaseBody", "main", "run"]

main = STUDY.main
