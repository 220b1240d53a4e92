"""Robots flown in Basilisk with hidden parts, and studies written from their flights."""

from studies.truth.basilisk.arm import true_base
from studies.truth.basilisk.model import Run, simulate
from studies.truth.basilisk.parts import BasiliskHidden, Leak, Panel, Slosh, Wheel
from studies.truth.basilisk.study import write_basilisk_study

__all__ = ["BasiliskHidden", "Leak", "Panel", "Run", "Slosh", "Wheel", "simulate", "true_base", "write_basilisk_study"]
