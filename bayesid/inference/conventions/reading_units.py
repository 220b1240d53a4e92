"""Readings in other units: degrees, arcseconds, thousandths, g, and counts whose factor the balance itself tells."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from bayesid.inference.conventions.mistake import Mistake, MistakeFamily
from bayesid.inference.conventions.momentum_balance import mean_between
from bayesid.inference.conventions.readings_on_grid import ReadingsOnGrid
from bayesid.recording.units import ANGLES, UNITS
from bayesid.robot.joint_state import JointState
from bayesid.simulation.model import Model
from bayesid.simulation.sensors import SensorKind

__all__ = ["JointUnits", "ReadingUnits", "in_unit"]

WORDS = {"deg/s": "degrees per second", "arcsec/s": "arcseconds per second", "mg": "milli-g", "ug": "micro-g"}
"""Units in words, where their names are short."""

USUAL = {"deg/s": 0.5, "g": 0.4, "mg": 0.4}
"""Share of units that people use, for which others that come as near are no match."""

OWN, LEAST = 0.1, 1.5
"""Share of units of their own, and the smallest factor of one: less is an error of scale, an effect."""

GEARS = 2.0 ** np.array([-4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0])
"""Factors of the angles of all joints, between which the search refines."""


@MistakeFamily.register
class ReadingUnits(MistakeFamily):
    """Sensors of the base."""

    title = "units of sensors"

    def members(self, model: Model, readings: ReadingsOnGrid) -> Iterator[Mistake]:
        """Yield the units of each sensor, and for rates that of turns between attitudes where it is none of them."""
        for kind in readings.sensors:
            named = {factor: unit for unit, factor in reversed(UNITS[kind.value].items()) if factor != 1.0}
            units = {unit: factor for factor, unit in named.items()}  # degrees per hour are arcseconds per second
            rest = (1.0 - sum(USUAL.get(unit, 0.0) for unit in units)) / len(units)
            for unit, factor in units.items():
                yield in_unit(kind, unit, factor, 0.5 * USUAL.get(unit, rest))
        factor = _of_turns(readings)
        if factor and all(abs(np.log(factor / known)) > np.log(LEAST) for known in UNITS["rate"].values()):
            yield in_unit(SensorKind.RATE, "", factor, OWN)


def _of_turns(readings: ReadingsOnGrid) -> float:
    """Return the ratio of the sizes of turns between attitudes to those of the rates, 0 where one is not known."""
    pairs, turns = readings.turns
    if SensorKind.RATE not in readings.sensors or not len(pairs):
        return 0.0
    mean = mean_between(readings.time, readings.sensors[SensorKind.RATE].in_base[None], pairs)[0]
    return float(np.sqrt((turns**2).sum() / max((mean**2).sum(), 1e-300)))


def in_unit(kind: SensorKind, unit: str, factor: float, share: float) -> Mistake:
    """Return the mistake that the readings of a sensor are in a unit.

    Parameters
    ----------
    kind : SensorKind
    unit : str
        Empty for one of its own.
    factor : float
        To the unit of the format.
    share : float
        Share of the family's prior.
    """
    line = f'unit = "{unit}"' if unit else f"scale = {factor:.4g}"
    text = f"The readings of {kind.value} are in {WORDS.get(unit, unit) or 'counts'}, not in {kind.unit}"
    if not unit:
        text += f": one count is about {factor:.4g} {kind.unit}, see the data sheet"
    return Mistake(
        f"convention:unit:{kind.value}",
        kind.value,
        f"unit:{kind.value}",
        0,
        lambda seen: seen.with_sensor(kind, factor * seen.sensors[kind].values, factor),
        lambda seen: f"[{kind.section}]\n{_stated(line, seen.recorded_as.sensor(kind.value).unit, factor, kind.unit)}",
        lambda seen: f"{text}.",
        share,
        ("rate", "turning") if kind == SensorKind.RATE else (kind.value,),
    )


@MistakeFamily.register
class JointUnits(MistakeFamily):
    """All joints in degrees, or in other units of angles."""

    title = "units of joints"

    def members(self, model: Model, readings: ReadingsOnGrid) -> Iterator[Mistake]:
        """Yield the units of angles, and those of their own."""
        if not any(joint.unit == "rad" for joint in model.robot.joints):
            return
        for unit, factor in ANGLES.items():
            if factor != 1.0:
                yield _joints_in_unit(model, unit, factor, 0.9 / len(ANGLES))
        for factor in GEARS:
            yield _joints_in_unit(model, "", float(factor), OWN / len(GEARS))


def _joints_in_unit(model: Model, unit: str, factor: float, share: float) -> Mistake:
    line = f'unit = "{unit}"' if unit else f"scale = {factor:.4g}"
    told = (
        f"in {unit}, not in rad"
        if unit
        else f"in counts or measured behind a gear: their angles are {factor:.4g} times the readings"
    )

    def nearby(level: int) -> tuple[Mistake, ...]:
        other = [factor * 2.0 ** (sign * 0.5 ** (level + 1)) for sign in (1.0, -1.0)]
        return (
            () if unit else tuple(_joints_in_unit(model, "", f, share) for f in other if abs(np.log(f)) > np.log(LEAST))
        )

    factors = np.array([factor if joint.unit == "rad" else 1.0 for joint in model.robot.joints])
    turning = [joint.name for joint in model.robot.joints if joint.unit == "rad"]

    def undo(seen: ReadingsOnGrid) -> ReadingsOnGrid:
        before = {name: seen.recorded_as.joint(name) for name in turning}
        after = {name: replace(joint, scale=factor * joint.scale) for name, joint in before.items()}
        return seen.with_joints(JointState(*(values * factors for values in seen.joints)), after)

    return Mistake(
        "convention:unit:position",
        "position",
        "unit:position",
        0,
        undo,
        lambda seen: f"[sensors.encoder]\n{_stated(line, seen.recorded_as.joint(turning[0]).scale, factor, 'rad')}",
        lambda seen: f"The joints are {told}.",
        share,
        nearby=nearby,
        value=None if unit else float(np.log2(factor)) / 0.25,
    )


def _stated(line: str, before: float, factor: float, unit: str) -> str:
    """Return a line, or where the study states a factor already, the lines that replace it."""
    return line if before == 1.0 else f'unit = "{unit}"\nscale = {before * factor:.6g}'
