"""Blind injections: how often a hidden cause is named rightly or wrongly, and how often nothing hidden raises an alarm.

Every trial hides one cause (or nothing, or a cause outside the catalogue) in data of an independent simulator, writes a
study to the file contract, and runs the diagnosis on the files alone. A store keeps one trial per line, so that a run
that was interrupted continues where it stopped.
"""

from studies.blind_injections.report import STUDY, Campaign
from studies.blind_injections.trials import Trial, plan, run

__all__ = ["STUDY", "Campaign", "Trial", "main", "plan", "run"]

main = STUDY.main
