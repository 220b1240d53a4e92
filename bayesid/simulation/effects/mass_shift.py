"""Effect of mass that moves inside the base at one instant, such as a part that comes loose."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Self

import numpy as np
from jax import Array

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.recording.joint_motion import Motion
from bayesid.robot.composite_tables import ENTRIES, WIDTH
from bayesid.robot.robot import Robot
from bayesid.robot.robot_size import RobotSize
from bayesid.simulation.effects.effect import Effect, Situation
from bayesid.simulation.effects.effect_parameters import Parameter, PhysicalBound, three_digits
from bayesid.simulation.effects.register import register

__all__ = ["MassShift"]

FIRST = ("x", "y", "z")
SECOND = ("xx", "yy", "zz", "xy", "xz", "yz")
"""Elements of the first and second moments of mass, in the order of `ENTRIES`."""

LOOSE = 0.1
"""Largest mass that moves over inside the base at once, relative to the base's; assumed."""


@register
class MassShift(Effect):
    """Jump of the base's first and second moments of mass, about its origin and in base axes, at an instant.

    A mass m that moves from a to b changes the first moment by ``m (b - a)`` and the second by ``m (b b' - a a')``;
    the base's mass stays the same. The angular momentum about the common centre of mass and the attitude are the same
    before and after; the base's rate jumps. The moments remain changed until the recording ends. Every
    recording begins with the mass in its original place; a negative instant stands for a mass that has already moved.
    The instant is a constant of the effect; a diagnosis determines it.

    The motion of the mass itself is omitted. While it moves, it turns the base by about ``m a x (b - a)`` divided by
    the inertia, where a and b are measured from the common centre of mass; the speed of the mass does not matter. On a
    rotating base this angle changes the subsequent rates by as much as the moments do. If only the rate is measured, a
    pulse of torque at the same instant can represent it. The shock on gyro and accelerometer while it moves is also
    omitted: readings of fast sensors within it are left out of the data (`bayesid.recording.shocks`).

    Parameters
    ----------
    instants : str or sequence of float
        Instant in each recording [s] since its start, or one for all recordings; as text with commas between. A
        negative instant is before the recording, and ``inf`` never. Without any, it is half-way through each recording.
    first, second : float
        Standard deviations of the priors of the first [kg m] and second moments [kg m2]; the default is that of a part
        of 1 kg that moves by 1 m.
    """

    name = "mass-shift"
    summary = (
        "A mass inside the base shifts at one instant, such as a part that comes loose: the base's centre of mass and "
        "inertia change at that instant."
    )
    separated_by = (
        "The change acts from one instant: the model fits the data before it, and no constant body fits both parts. "
        "Repeat the manoeuvre: a loose part remains in its new place or moves again."
    )
    cause_kind = "mass-shift"
    constant_names = ("instants",)

    def __init__(self, instants: str | Sequence[float] = (), first: float = 1.0, second: float = 1.0) -> None:
        self.instants = _seconds(instants)
        self.base: str | None = None
        self.parameters = (
            *(Parameter(f"first.{axis}", "kg m", first) for axis in FIRST),
            *(Parameter(f"second.{axes}", "kg m2", second) for axes in SECOND),
        )

    @property
    def label(self) -> str:
        """Name of the effect, followed by its instants where they are given."""
        if not self.instants:
            return self.name
        return f"{self.name}:{','.join(f'{instant:g}' for instant in self.instants)}"

    @property
    def candidate(self) -> str:
        """Name without instants, which the data give."""
        return self.name

    @property
    def link(self) -> str | None:
        """The base, in which the mass moves."""
        return self.base

    def attach(self, robot: Robot) -> Self:
        """Return the effect on the base of a robot."""
        changed = copy.copy(self)
        changed.base = robot.base
        return changed

    def in_recording(self, index: int) -> Self:
        """Return the effect with the instant of one recording."""
        if len(self.instants) <= 1:
            return self
        if index >= len(self.instants):
            raise InputError(
                f"effect {self.label!r} has {len(self.instants)} instants, but there are more recordings",
                remedy="Give one instant for each recording, or one for all; inf where it does not happen",
            )
        return self.at(self.instants[index : index + 1])

    def jumps(self, end: float) -> Sequence[float]:
        """Return the instant, if it is within the recording."""
        instant = self._instant(end)
        return (instant,) if 0.0 <= instant < end else ()

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the moments of the largest part that moves from one side of the base to the other."""
        size = RobotSize.of(model.robot)
        mass = LOOSE * size.base_mass
        part = f"At most {100.0 * LOOSE:g} % of the base, {three_digits(mass)} kg, shifts inside it at one instant"
        return (
            PhysicalBound("kg m", 2.0 * mass * size.radius, f"{part}, by at most {three_digits(2.0 * size.radius)} m."),
            PhysicalBound(
                "kg m2", mass * size.radius**2, f"{part}, within {three_digits(size.radius)} m of its origin."
            ),
        )

    def table(self, robot: Robot, motion: Motion, time: Floats) -> Floats:
        """Return the columns of the nine moments, which are zero up to the instant, shape (T, 28, 9)."""
        return self.table_at(time, self._instant(float(time[-1])))

    @staticmethod
    def table_at(time: Floats, instant: float) -> Floats:
        """Return the columns of the nine moments that jump just after an instant [s], shape (T, 28, 9).

        They are those of `table` and depend neither on the robot nor on its motion, since the base does not move in its
        own axes. Multiplied by the moments, in the order of ``parameters``, they give the change of the tables.

        Parameters
        ----------
        time : (T,) array
            Times of the columns [s].
        instant : float
            Instant of the shift [s].
        """
        unit = np.zeros((WIDTH, len(FIRST) + len(SECOND)))
        unit[ENTRIES["first"], : len(FIRST)] = np.eye(len(FIRST))
        unit[ENTRIES["second"], len(FIRST) :] = np.eye(len(SECOND))
        return (np.asarray(time) > instant)[:, None, None] * unit

    def loads(self, values: Array) -> Array:
        """Return the nine moments."""
        return values

    def _instant(self, end: float) -> float:
        """Return the instant in a recording that ends at a time [s]."""
        if len(self.instants) > 1:
            raise InputError(
                f"effect {self.label!r} has a separate instant in each recording, and no recording is named",
                remedy="Choose one with `in_recording`, or give one instant for all",
            )
        return self.instants[0] if self.instants else 0.5 * end


def _seconds(instants: str | Sequence[float]) -> tuple[float, ...]:
    """Return instants from numbers or from text with commas between them."""
    parts = [part for part in instants.split(",") if part] if isinstance(instants, str) else instants
    try:
        seconds = tuple(float(instant) for instant in parts)
    except ValueError:
        seconds = (float("nan"),)
    if any(np.isnan(instant) for instant in seconds):
        raise InputError(
            f"mass-shift: {instants!r} is not a list of instants",
            remedy="Give seconds since the start of each recording, such as mass-shift:12.5,inf",
        )
    return seconds
