"""Faults: corrupted files, wrong units and kills at random times, and how the commands respond to them."""

from studies.faults.report import STUDY, Result, attempt, tasks

__all__ = ["STUDY", "Result", "attempt", "main", "tasks"]

main = STUDY.main
