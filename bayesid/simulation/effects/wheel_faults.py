"""Errors of wheels whose speed is recorded: inertia or scale of the speed, tilt of the axis, delay, and imbalance.

Friction of a wheel's bearings is no such error: it acts between wheel and base, and what it does to the wheel is in the
recorded speed.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import ClassVar, Self

import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats, Traceable
from bayesid._math.small_matrices import cross
from bayesid.recording.recording import Recording
from bayesid.robot.robot import Robot
from bayesid.robot.robot_size import RobotSize
from bayesid.robot.wheel import Wheel
from bayesid.simulation.effects.effect import Effect, Situation
from bayesid.simulation.effects.effect_parameters import Parameter, PhysicalBound, Quantity, three_digits
from bayesid.simulation.effects.placed import Placed
from bayesid.simulation.effects.register import register
from bayesid.simulation.instant import Instant

__all__ = ["OnWheel", "WheelImbalance", "WheelInertia", "WheelLatency", "WheelTilt", "fastest_line"]

LARGEST_FACTOR = 2.0
"""Largest error of a factor on a wheel's momentum: that of a speed with the wrong sign."""

LARGEST_TILT = 0.1
"""Largest plausible tilt of an axis [rad]; assumed, since the eye would see more."""

LARGEST_DELAY = 1.0
"""Largest plausible delay of a time stamp [s], a cycle of slow telemetry."""

ECCENTRICITY, ROTOR_RADIUS = 0.01, 0.05
"""Distance of a rotor's centre of mass from its axis relative to its radius, and that relative to the base's length;
both assumed."""

MOSTLY = 0.95
"""Share of the samples at which the line of an imbalance is to lie below half the sampling rate."""


class OnWheel(Placed):
    """Effect at one wheel, whose numbers it takes when it is attached to a robot."""

    index: int = 0

    @classmethod
    def lacks(cls, model: Situation) -> str | None:
        """Return the section of the wheels where the robot has none."""
        return None if model.robot.wheels else "[[robot.wheels]]"

    @classmethod
    def instances(cls, model: Situation) -> Sequence[Effect]:
        """Return the effect at every wheel."""
        return [cls(wheel.name).attach(model.robot) for wheel in model.robot.wheels]

    def attach(self, robot: Robot) -> Self:
        """Return the effect with the place of its wheel among the robot's, and the wheel's numbers."""
        changed = copy.copy(self)
        try:
            changed.index = robot.wheel_index(self.place)
        except InputError as error:
            raise InputError(f"effect {self.label!r}: {error.problem}", remedy=error.remedy) from None
        changed.take(robot.wheels[changed.index])
        return changed

    def take(self, wheel: Wheel) -> None:
        """Take the numbers of the wheel that the hooks need."""
        self.spin = tuple((wheel.inertia * np.asarray(wheel.axis)).tolist())

    def course(self, instant: Instant) -> Array:
        """Return angle, speed and its derivatives of the wheel (`bayesid.recording.wheel_motion.COURSE`)."""
        return jnp.asarray(instant.environment.wheels)[self.index]


@register
class WheelInertia(OnWheel):
    """Factor on a wheel's inertia times its recorded speed: a wrong inertia, unit, gear or number of poles."""

    name = "wheel-inertia"
    summary = "The wheel's momentum differs from the product of its declared inertia and recorded speed."
    separated_by = (
        "The error grows with the wheel's acceleration: accelerate and decelerate this wheel with the others at "
        "constant speed."
    )

    def __init__(self, place: str = "", sigma: float = 0.3) -> None:
        super().__init__(place)
        self.parameters = (Parameter("factor", "1", sigma, 1.0),)

    @property
    def absent(self) -> Floats:
        """A factor of one."""
        return np.ones(1)

    def in_amplitudes(self) -> Effect:
        """Return the effect with the excess of the factor over one as its parameter."""
        return _WheelExcess(self)

    def amplitudes(self, values: Traceable) -> Traceable:
        """Return the excess of the factor over one."""
        return values - 1.0

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the error of a speed with the wrong sign."""
        return (PhysicalBound("1", LARGEST_FACTOR, "A speed with the wrong sign has an error of twice its value."),)

    def momentum(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return what the recorded momentum lacks, and its derivative."""
        _, speed, acceleration, *_ = self.course(instant)
        lacking = (values[0] - 1.0) * jnp.array(self.spin)
        return lacking * speed, lacking * acceleration


class _WheelExcess(WheelInertia):
    """The same in the excess of the factor over one."""

    def __init__(self, inertia: WheelInertia) -> None:
        self.__dict__.update(vars(inertia))
        self.parameters = (Parameter("factor", "1", inertia.parameters[0].sigma),)

    in_amplitudes, amplitudes = Effect.in_amplitudes, Effect.amplitudes

    @property
    def absent(self) -> Floats:
        """No excess."""
        return np.zeros(1)

    def momentum(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return what the recorded momentum lacks, and its derivative."""
        return super().momentum(values + 1.0, instant, inner)


@register
class WheelTilt(OnWheel):
    """Small tilt of a wheel's axis, by two angles towards two directions across it.

    The first direction is the cross product of the axis with the base axis that is farthest from it, the second that of
    the axis with the first. The true axis in base axes is reported with the angles.
    """

    name = "wheel-tilt"
    summary = "The wheel's axis is slightly misaligned: its momentum also rotates the base about other axes."
    separated_by = (
        "The wheel rotates the base about axes normal to the wheel's: accelerate that wheel with the others at rest."
    )

    def __init__(self, place: str = "", sigma: float = 0.02) -> None:
        super().__init__(place)
        self.parameters = tuple(Parameter(which, "rad", sigma) for which in ("first", "second"))

    def take(self, wheel: Wheel) -> None:
        """Take axis, inertia and the directions across."""
        super().take(wheel)
        self.frame = tuple(map(tuple, np.concatenate([[wheel.axis], wheel.across]).tolist()))

    @property
    def quantities(self) -> Sequence[Quantity]:
        """The angles, and the true axis."""
        return [*super().quantities, *(Quantity(f"axis.{axis}", "1") for axis in "xyz")]

    def report(self, values: Array) -> Array:
        """Return the angles and the true axis."""
        axis = jnp.concatenate([jnp.ones(1), values]) @ jnp.array(self.frame)
        return jnp.concatenate([values, axis / jnp.linalg.norm(axis)])

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return a tilt that is visible to the eye."""
        reason = f"A wheel tilt of more than {LARGEST_TILT:g} rad, six degrees, is visible to the eye."
        return (PhysicalBound("rad", LARGEST_TILT, reason),)

    def momentum(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return the momentum across the declared axis, and its derivative, to first order."""
        _, speed, acceleration, *_ = self.course(instant)
        across = jnp.linalg.norm(jnp.array(self.spin)) * (values @ jnp.array(self.frame)[1:])
        return across * speed, across * acceleration


@register
class WheelLatency(OnWheel):
    """Delay of a wheel's recorded speed: the speed stamped t is that of t - delay; to second order in the delay."""

    name = "wheel-latency"
    summary = "The recorded speed of the wheel is late: the wheel reaches each speed before it is recorded."
    separated_by = "The error grows with the wheel's acceleration: accelerate the wheel twice as fast."

    def __init__(self, place: str = "", sigma: float = 0.2) -> None:
        super().__init__(place)
        self.parameters = (Parameter("delay", "s", sigma),)

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return a cycle of slow telemetry."""
        return (PhysicalBound("s", LARGEST_DELAY, "Slow telemetry stamps its samples once per second."),)

    def momentum(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return by how much the true momentum is ahead of the recorded one, and its derivative."""
        _, _, acceleration, jerk, snap = self.course(instant)
        delay, spin = values[0], jnp.array(self.spin)
        return spin * (delay * acceleration + 0.5 * delay**2 * jerk), spin * (delay * jerk + 0.5 * delay**2 * snap)


@register
class WheelImbalance(OnWheel):
    """Imbalance of a wheel, which shakes the base at a multiple of its recorded speed; the phase differs by recording.

    The static imbalance is a first moment of mass off the axis: its force acts at the wheel's place, and turns the base
    about the common centre of mass. The dynamic one is the momentum across the axis per speed. The disturbance is a
    spectral line at order times recorded speed. The order is one unless the recorded speed is wrongly scaled; force and
    momentum are those of the speed so corrected. The line is taken to be as narrow as the smoothed speed permits, and
    the influence of the base's rotation on it is neglected. Where the line lies above half the rate of the data that
    are used, blocks or samples, it is not a candidate; ``blocks_per_second = 0`` uses all samples and raises that
    limit.

    Parameters
    ----------
    place : str
        Wheel, and after a comma the order, if another than one.
    order : float
        Speed of the line over the recorded speed.
    static, dynamic : float
        Standard deviations of the priors of both components [kg m, kg m2]; by default a tenth of their bounds.
    """

    name = "wheel-imbalance"
    summary = "The wheel is unbalanced and shakes the base once per revolution."
    separated_by = (
        "The base shakes at the wheel's speed, with a force that grows with its square: accelerate this wheel slowly, "
        "with the others at a different speed."
    )
    per_recording: ClassVar[bool] = True
    cause_kind: ClassVar[str] = "order-line"
    constant_names = ("order",)

    def __init__(
        self, place: str = "", order: float = 1.0, static: float | None = None, dynamic: float | None = None
    ) -> None:
        wheel, _, stated = place.partition(",")
        super().__init__(wheel)
        try:
            self.order = float(stated) if stated else order
        except ValueError:
            raise InputError(f"{self.label}: {stated!r} is not an order", remedy="Write WHEEL,ORDER") from None
        self._stated = static, dynamic
        self._set(1.0, 1.0)

    def _set(self, static: float, dynamic: float) -> None:
        sizes = [
            default if stated is None else stated
            for stated, default in zip(self._stated, (static, dynamic), strict=True)
        ]
        parts = zip(("static", "dynamic"), ("kg m", "kg m2"), sizes, strict=True)
        self.parameters = tuple(
            Parameter(f"{name}.{part}", unit, size) for name, unit, size in parts for part in ("cos", "sin")
        )

    def attach(self, robot: Robot) -> Self:
        """Return the effect with priors that suit the wheel and the robot."""
        changed = super().attach(robot)
        wheel = robot.wheels[changed.index]
        changed._set(0.1 * _largest_static(robot, wheel), 0.1 * ECCENTRICITY * wheel.inertia)
        return changed

    def take(self, wheel: Wheel) -> None:
        """Take the place and the directions of the wheel."""
        self.frame = tuple(map(tuple, np.concatenate([[wheel.axis], wheel.across]).tolist()))
        self.position = tuple(np.asarray(wheel.position).tolist())

    def with_order(self, order: float) -> Self:
        """Return the effect with another order."""
        changed = copy.copy(self)
        changed.order = order
        return changed

    def shows_in(self, recordings: Sequence[Recording], blocks_per_second: float = 0.0) -> bool:
        """Return whether the line of order one lies below half the sampling rate of a sensor in some recording."""
        return any(fastest_line(recording, self.place, blocks_per_second) < 1.0 for recording in recordings)

    @property
    def entry(self) -> str:
        """The label with the order."""
        return self.label if self.order == 1.0 else f"{self.label},{self.order:.6g}"

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Both imbalances, the order, and the angle of the static one at time 0."""
        names = (("static", "kg m"), ("dynamic", "kg m2"), ("order", "1"), ("phase", "rad"))
        return [Quantity(*pair) for pair in names]

    def report(self, values: Array) -> Array:
        """Return both magnitudes, the order and the phase."""
        static, dynamic = (jnp.sqrt((part**2).sum() + 1e-300) for part in (values[:2], values[2:]))
        return jnp.stack([static, dynamic, jnp.asarray(self.order), jnp.arctan2(values[1], values[0])])

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the imbalance of a rotor that is off its axis by a hundredth of its radius."""
        wheel = model.robot.wheels[self.index]
        off = (
            f"Imbalance of a rotor of {three_digits(wheel.inertia)} kg m2 is at most {100.0 * ECCENTRICITY:g} % of its"
        )
        return (
            PhysicalBound("kg m", _largest_static(model.robot, wheel), f"{off} mass times its radius."),
            PhysicalBound("kg m2", ECCENTRICITY * wheel.inertia, f"{off} inertia about its axis."),
        )

    def momentum(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return the momentum of the turning imbalance about the centre of mass, and its derivative."""
        lever = jnp.array(self.position) - instant.body.com
        outward, inward = self._turned(values[:2], instant)
        across, rate = self._turned(values[2:], instant, momentum=True)
        shown = instant.environment.sampled
        return shown * (cross(lever, outward) + across), shown * (cross(lever, inward) + rate)

    def specific_force(self, values: Array, instant: Instant, lever: Array) -> Array:
        """Return the acceleration of the base by the force of the static imbalance."""
        return -self._turned(values[:2], instant)[1] / instant.body.mass

    def _turned(self, pair: Array, instant: Instant, momentum: bool = False) -> tuple[Array, Array]:
        """Return the first derivatives of a first moment that turns with the wheel, or momentum and its derivative."""
        angle, speed, acceleration, *_ = self.order * self.course(instant)
        _, first, second = jnp.array(self.frame)
        c, s = jnp.cos(angle), jnp.sin(angle)
        along = (pair[0] * c - pair[1] * s) * first + (pair[1] * c + pair[0] * s) * second
        ahead = (pair[0] * c - pair[1] * s) * second - (pair[1] * c + pair[0] * s) * first
        if momentum:
            return speed * along, acceleration * along + speed**2 * ahead
        return speed * ahead, acceleration * ahead - speed**2 * along


def fastest_line(recording: Recording, wheel: str, blocks_per_second: float = 0.0) -> float:
    """Return the frequency below which a wheel mostly turns, over half the best sampling rate of a base sensor.

    Parameters
    ----------
    recording : Recording
    wheel : str
        Name of the wheel.
    blocks_per_second : float
        Rate above which samples are averaged [1/s]; 0 keeps every sample.
    """
    sampled = [recording.interval(name) for name in ("rate.x", "accel.x") if name in recording.channels]
    column = f"wheel_speed.{wheel}"
    if not sampled or column not in recording.channels:
        return float("inf")
    speed = float(np.quantile(np.abs(recording.series(column)[1]), MOSTLY))
    interval = max(min(sampled), 1.0 / blocks_per_second if blocks_per_second else 0.0)
    return speed * interval / np.pi


def _largest_static(robot: Robot, wheel: Wheel) -> float:
    """Return the first moment of a rotor's mass off its axis, for a radius that suits the robot's size [kg m]."""
    return ECCENTRICITY * wheel.inertia / (ROTOR_RADIUS * RobotSize.of(robot).length)
