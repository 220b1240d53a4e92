"""Effect of a wheel whose momentum changes during a recording and is not recorded."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Self

import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.robot.robot import Robot
from bayesid.simulation.effects.effect import Effect, Situation
from bayesid.simulation.effects.effect_parameters import Parameter, PhysicalBound, Quantity
from bayesid.simulation.effects.internal_effects import wheel_bound
from bayesid.simulation.effects.placed import Placed
from bayesid.simulation.effects.register import register
from bayesid.simulation.instant import Instant

__all__ = ["KNOTS", "WheelHistory"]

KNOTS = 24
"""Number of instants between which the momentum is linear."""

RUN_UP = 0.1
"""Time in which the fastest motors bring their wheels to full speed [s]: small ones that drive propellers; reaction
wheels take from some seconds to several minutes. Assumed."""

AXES = "xyz"


@register
class WheelHistory(Placed):
    """Unrecorded momentum of reaction wheels along one base axis, which changes during a recording.

    The momentum is piecewise linear in time, with separate values in every recording. Its 24 values (knots) are
    equally spaced from the start of the recording to ``end``, by default ten seconds apart. It is constant after the
    last knot; the data do not determine knots after the end of a recording. The reaction torque on the base is minus
    the slope of the momentum. For a momentum that is the same in all recordings, use `wheel-momentum`.

    The parameters are the momentum at the first knot and the torques of the motor between the knots, since a motor
    changes a momentum gradually: with independent torques the momentum is a random walk from any start. In a diagnosis
    the start has one scale and the torques have another, so that a wheel whose speed hardly changes is not charged for
    24 independent values. The momenta at all knots are reported.

    If the momentum of the wheels is recorded, the effect is the difference between true and recorded momentum.

    Parameters
    ----------
    place : str
        Base axis, x, y or z, and after a comma the time of the last knot if it differs from the default.
    end : float
        Time of the last knot [s], best the length of the longest recording.
    sigma : float
        Standard deviation of the prior of the momentum at the first knot [N m s].
    torque : float
        Standard deviation of the prior of each torque of the motor [N m].
    """

    name = "wheel-history"
    summary = (
        "A reaction wheel about the axis changes its speed without being recorded: it exerts a reaction torque on the "
        "base and makes it a gyroscope."
    )
    separated_by = (
        "The wheel returns its momentum to the base when it stops, and acts with the arm at rest: record longer rest "
        "periods before and after the motion. Repeat the motion; the speed of the wheel need not repeat with it."
    )
    per_recording: ClassVar[bool] = True
    constant_names = ("end",)

    def __init__(self, place: str = "", end: float = 230.0, sigma: float = 1.0, torque: float = 0.1) -> None:
        axis, _, stated = place.partition(",")
        super().__init__(axis)
        self.end = float(stated) if stated else end
        if not 0.0 < self.end < np.inf:
            raise InputError(
                f"{self.label}: the last knot is at {self.end:g} s", remedy="Give the length of the recordings"
            )
        self.parameters = (
            Parameter("momentum.1", "N m s", sigma),
            *(Parameter(f"torque.{piece}", "N m", torque) for piece in range(1, KNOTS)),
        )

    @classmethod
    def instances(cls, model: Situation) -> Sequence[Effect]:
        """Return the effect about every base axis."""
        return [cls(axis) for axis in AXES]

    def in_study(self, longest: float | None, records_wheels: bool) -> Self | None:
        """Return the effect over the longest recording, None where the momentum of the wheels is recorded."""
        if records_wheels:
            return None
        return self if longest is None else type(self)(self.place, longest)

    @property
    def entry(self) -> str:
        """The label with the time of the last knot."""
        return f"{self.label},{self.end:g}"

    def attach(self, robot: Robot) -> Self:
        """Return the effect after a check of its axis."""
        if self.place not in tuple(AXES):
            raise InputError(
                f"effect {self.label!r}: {self.place!r} is not an axis of the base", remedy=f"Axes: {', '.join(AXES)}"
            )
        return self

    @property
    def knots(self) -> Floats:
        """Instants between which the momentum is linear, shape (24,) [s]."""
        return np.linspace(0.0, self.end, KNOTS)

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Reported quantities: the momenta at the knots."""
        return [Quantity(f"momentum.{knot}", "N m s") for knot in range(1, KNOTS + 1)]

    def report(self, values: Array) -> Array:
        """Return the momenta at the knots, shape (24,) [N m s]."""
        return jnp.cumsum(jnp.concatenate([values[:1], values[1:] * (self.end / (KNOTS - 1))]))

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the momentum of all wheels of a robot of this mass and size, and the torque that runs them up."""
        full = wheel_bound(model.robot)
        torque = f"{full.reason} The fastest motors reach full speed in {RUN_UP:g} s."
        return full, PhysicalBound("N m", full.largest / RUN_UP, torque)

    def momentum(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return the momentum of the wheels between the knots, and its slope."""
        time, spacing = instant.environment.time, self.end / (KNOTS - 1)
        piece = jnp.clip(jnp.floor(time / spacing).astype(int), 0, KNOTS - 2)
        since = jnp.clip(time - piece * spacing, 0.0, spacing)
        torque = values[1 + piece]
        slope = jnp.where(time < self.end, torque, 0.0)
        axis = jnp.eye(3)[AXES.index(self.place)]
        return (self.report(values)[piece] + since * torque) * axis, slope * axis
