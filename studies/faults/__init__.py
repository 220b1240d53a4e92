"""Faults: spoilt files, mistaken units and kills at random moments, and what the commands make of them."""

from studies.faults.report import main, write_report
from studies.faults.trials import attempt, tasks

__all__ = ["attempt", "main", "tasks", "write_report"]
