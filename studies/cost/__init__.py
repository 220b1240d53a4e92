"""Cost: time and memory of the commands, by phase, with and without cached code, and their growth."""

from studies.cost.report import STUDY

__all__ = ["STUDY", "main"]

main = STUDY.main
