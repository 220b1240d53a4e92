"""Robots flown in Basilisk with hidden parts, and studies written from their flights."""

from studies.truth.basilisk.cases import write_basilisk_study
from studies.truth.basilisk.model import BasiliskHidden, Leak, Panel, Run, Slosh, Wheel, simulate, true_base

__all__ = ["BasiliskHidden", "Leak", "Panel", "Run", "Slosh", "Wheel", "simulate", "true_base", "write_basilisk_study"]
