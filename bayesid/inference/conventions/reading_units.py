"""Readings in other units: degrees, arcseconds, thousandths, g."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from bayesid.inference.conventions.mistake import Mistake, MistakeFamily
from bayesid.inference.conventions.readings_on_grid import ReadingsOnGrid
from bayesid.recording.units import ANGLES, UNITS
from bayesid.robot.joint_state import JointState
from bayesid.simulation.model import Model
from bayesid.simulation.sensors import SensorKind

__all__ = ["JointUnits", "ReadingUnits"]

WORDS = {"deg/s": "degrees per second", "arcsec/s": "arcseconds per second", "mg": "milli-g", "ug": "micro-g"}
"""Units in words, where their names are short."""


@MistakeFamily.register
class ReadingUnits(MistakeFamily):
    """Sensors of the base."""

    title = "units of sensors"

    def members(self, model: Model, readings: ReadingsOnGrid) -> Iterator[Mistake]:
        """Yield the units of each sensor."""
        for kind in readings.sensors:
            units = UNITS[kind.value]
            for unit, factor in units.items():
                if factor != 1.0:
                    yield _in_unit(kind, unit, factor, 0.5 / (len(units) - 1))


def _in_unit(kind: SensorKind, unit: str, factor: float, share: float) -> Mistake:
    return Mistake(
        f"convention:unit:{kind.value}",
        kind.value,
        f"unit:{kind.value}",
        0,
        lambda seen: seen.with_sensor(kind, factor * seen.sensors[kind].values, factor),
        lambda seen: f'[{kind.section}]\nunit = "{unit}"',
        lambda seen: f"The readings of {kind.value} are in {WORDS.get(unit, unit)}, not in {kind.unit}.",
        share,
        ("rate", "turning") if kind == SensorKind.RATE else (kind.value,),
    )


@MistakeFamily.register
class JointUnits(MistakeFamily):
    """All joints in degrees, or in other units of angles."""

    title = "units of joints"

    def members(self, model: Model, readings: ReadingsOnGrid) -> Iterator[Mistake]:
        """Yield the units of angles."""
        for unit, factor in ANGLES.items():
            if factor != 1.0 and any(joint.unit == "rad" for joint in model.robot.joints):
                yield _joints_in_unit(model, unit, factor, 1.0 / len(ANGLES))


def _joints_in_unit(model: Model, unit: str, factor: float, share: float) -> Mistake:
    factors = np.array([factor if joint.unit == "rad" else 1.0 for joint in model.robot.joints])
    return Mistake(
        "convention:unit:position",
        "position",
        "unit:position",
        0,
        lambda seen: replace(seen, joints=JointState(*(values * factors for values in seen.joints))),
        lambda seen: f'[sensors.encoder]\nunit = "{unit}"',
        lambda seen: f"The joints are in {unit}, not in rad.",
        share,
    )
