"""Faults: spoilt files, mistaken units and kills at random moments, and what the commands make of them."""

from studies.faults.report import STUDY, Result, attempt, tasks

__all__ = ["STUDY", "Result", "attempt", "main", "tasks"]

main = STUDY.main
