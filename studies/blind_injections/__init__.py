"""Blind injections: how often a hidden cause is found, named rightly or wrongly, and how often nothing raises alarm.

Every trial hides one thing (or nothing, or something outside the catalogue) in data of an independent simulator, writes
a study to the file contract, and runs the diagnosis on the files alone. Trials are kept one per line, so that a run can
be interrupted and goes on where it stopped.
"""

from studies.blind_injections.report import main, write_report
from studies.blind_injections.trials import Trial, plan, run

__all__ = ["Trial", "main", "plan", "run", "write_report"]
