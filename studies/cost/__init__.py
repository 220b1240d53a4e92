"""Cost: what commands take from files to answers, by phase, cold and with compiled code kept, and how that grows."""

from studies.cost.report import STUDY

__all__ = ["STUDY", "main"]

main = STUDY.main
