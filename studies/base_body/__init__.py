"""Section 4.1 of the paper, identification of the base body, beside what the paper printed; and what it left open."""

from studies.base_body.report import STUDY, BaseBody, run

__all__ = ["STUDY", "BaseBody", "main", "run"]

main = STUDY.main
