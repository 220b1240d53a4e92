"""The tasks of the manual that have a picture, in its order."""

from __future__ import annotations

from studies.manual.pictures import bag, drift, effect, load, plan, sensors, torque, wheels

__all__ = ["TASKS"]

TASKS = tuple(module.PICTURE for module in (bag, load, drift, sensors, plan, torque, wheels, effect))
