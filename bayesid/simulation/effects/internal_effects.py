"""Effects of moving parts inside or on the base that no encoder measures."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Self

import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Floats
from bayesid.robot.robot import Robot
from bayesid.robot.robot_size import RobotSize
from bayesid.simulation.effects.effect import Effect, Situation
from bayesid.simulation.effects.effect_parameters import (
    Parameter,
    PhysicalBound,
    Prior,
    Quantity,
    coordinates_of,
    three_digits,
)
from bayesid.simulation.effects.register import register
from bayesid.simulation.instant import Instant, Modes, Resonance

__all__ = ["FlexibleAppendage", "FuelSlosh", "WheelMomentum", "wheel_bound"]

FREQUENCY, FREQUENCY_SPREAD = 0.12, 1.0
"""Median of a hidden vibration's frequency [Hz] and standard deviation of its logarithm, for 0.02 to 0.9 Hz at 2 sd."""

DAMPING, DAMPING_SPREAD = 0.01, 1.0
"""Median of its damping ratio, and standard deviation of the logarithm."""

STEPS_PER_PERIOD = 10.0
"""Number of integration steps in one period of the vibration."""

RESONANCES = 2
"""Largest number of resonances from which the fit of an appendage starts."""

SMALLEST_COUPLING = 0.1
"""Smallest squared coupling of a mode at the start of a fit [kg m2]; from zero the fit could not choose its sign."""

SLOSH_MASS, SMALLEST_MASS = 5.0, 0.1
"""Mass [kg] from which the fit of slosh starts at further places, and least mass of any start."""

TANK_DISTANCE = 0.4
"""Distance of further starting positions of the tank from the middle of the spacecraft, along each axis [m]."""

TANK_CORNERS = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
"""Directions of these positions, which are the corners of a tetrahedron."""

ROTORS, RIM_SPEED, RIM_RADIUS = 0.01, 100.0, 0.05
"""Mass of all rotors relative to the robot's, speed of their rims [m/s], and radius relative to the base's length.

They are assumed: for a base of 3 t and 5 m they give more than twice what four large wheels of 68 N m s hold, for one
of 4 kg and 0.3 m what four small ones of 15 mN m s do.
"""

ALIGNED = 0.01
"""Angle between a base axis and a wheel that is mounted along it [rad]; assumed."""

APPENDAGES = 0.1
"""Mass of all panels, booms and antennas that swing, relative to the robot's; assumed."""

REACH = 1.5
"""Half width of the place of a tank in a spacecraft of unknown size [m]."""

FUEL = 0.3
"""Mass of fuel that sloshes relative to the base's; assumed, if half of the base is fuel and 60 % of that sloshes."""


@register
class WheelMomentum(Effect):
    """Residual momentum of reaction wheels at constant speed, in base axes.

    The prior of 1 N m s is the capacity of a small wheel, more than usually remains in the wheels while attitude
    control is off.
    """

    name = "wheel-momentum"
    summary = (
        "The momentum of spinning reaction wheels couples the axes of the base: turning it about one axis causes a "
        "torque about another."
    )
    separated_by = (
        "The torque grows with the base's rate: repeat with the base rotating faster and about other axes; a torque "
        "on a base that does not rotate is not caused by wheels at constant speed."
    )

    def __init__(self, sigma: float = 1.0) -> None:
        self.parameters = tuple(Parameter(axis, "N m s", sigma) for axis in "xyz")

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the momentum of all wheels that a robot of this mass and size carries, at full speed."""
        return (wheel_bound(model.robot),)

    @property
    def amplitude_shapes(self) -> Sequence[Sequence[float]]:
        """Any direction, or about one axis of the base: of one wheel, or of several if only one of them turns."""
        along = np.where(np.eye(3) > 0.0, 1.0, ALIGNED)
        return [[1.0, 1.0, 1.0], *along.tolist()]

    def momentum(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return the momentum of the wheels, and a zero derivative."""
        return values, jnp.zeros(3)


class _Vibration(Effect):
    """Common part of effects of a mass on a spring in the base."""

    separated_by = (
        "The oscillation continues after the motion: excite it with one quick motion, then record with the arm at rest."
    )
    cause_kind = "vibration"
    frequency: float = FREQUENCY

    @property
    def longest_step(self) -> float:
        """Longest integration step, a tenth of the period at the frequency of the start or of `tuned` [s]."""
        return 1.0 / (STEPS_PER_PERIOD * self.frequency)

    def tuned(self, values: Floats) -> Self:
        """Return the effect with an integration step that suits the frequency among the values."""
        changed = copy.copy(self)
        changed.frequency = float(values[[parameter.name for parameter in self.parameters].index("frequency")])
        return changed


@register
class FlexibleAppendage(_Vibration):
    """One vibration mode of a panel, boom or antenna, with its frequency for a fixed base, damping and coupling.

    The momentum of unit modal speed has a linear part [sqrt(kg)] and an angular part about the base origin
    [sqrt(kg) m]; ``participation`` is the norm of the angular part, whose square is the inertia that vibrates. The
    prior of 5 sqrt(kg) m per axis corresponds to 25 kg m2, a pair of small panels, and that of 3 sqrt(kg) to 9 kg. The
    centrifugal load on the mode is omitted.
    """

    name = "flexible-appendage"
    summary = (
        "A panel, boom or antenna on the base is flexible: it lags behind the base and oscillates at its natural "
        "frequency, and the base reacts to it."
    )
    modes_count = 1

    def __init__(self, angular: float = 5.0, linear: float = 3.0) -> None:
        self.parameters = (
            Parameter("frequency", "Hz", FREQUENCY_SPREAD, FREQUENCY, Prior.LOG_NORMAL),
            Parameter("damping", "1", DAMPING_SPREAD, DAMPING, Prior.LOG_NORMAL),
            *(Parameter(f"linear.{axis}", "sqrt(kg)", linear) for axis in "xyz"),
            *(Parameter(f"angular.{axis}", "sqrt(kg) m", angular) for axis in "xyz"),
        )

    @property
    def quantities(self) -> Sequence[Quantity]:
        """Reported quantities: frequency, damping, participation, and the coupling."""
        first, second, *rest = (Quantity(parameter.name, parameter.unit) for parameter in self.parameters)
        return [first, second, Quantity("participation", "sqrt(kg) m"), *rest]

    def report(self, values: Array) -> Array:
        """Return the quantities with the largest angular coupling made positive, since the sign has no meaning."""
        coupling = values[2:]
        sign = jnp.sign(coupling[3 + jnp.argmax(jnp.abs(coupling[3:]))])
        return jnp.concatenate([values[:2], jnp.linalg.norm(coupling[3:])[None], sign * coupling])

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the roots of the oscillating mass and of its inertia at the edge of the base about the base origin."""
        size = RobotSize.of(model.robot)
        root = float(np.sqrt(APPENDAGES * size.mass))
        swings = f"Flexible panels and booms are at most {100.0 * APPENDAGES:g} % of {three_digits(size.mass)} kg"
        return (
            PhysicalBound("sqrt(kg)", root, f"{swings}."),
            PhysicalBound(
                "sqrt(kg) m", root * size.radius, f"{swings}, at the base's radius of {three_digits(size.radius)} m."
            ),
        )

    def modes(self, values: Array) -> Modes:
        """Return the single mode."""
        return Modes(2.0 * jnp.pi * values[:1], values[1:2], values[None, 2:5], values[None, 5:8], jnp.zeros((1, 3, 3)))

    def starts_near(self, resonances: Sequence[Resonance], alone: bool) -> Sequence[Floats]:
        """Return one start per resonance, with the eigenvector of its coupling of largest eigenvalue as mode."""
        starts = []
        for frequency, matrix, damping in resonances[:RESONANCES]:
            values, vectors = np.linalg.eigh(matrix)
            coupling = vectors[:, -1] * np.sqrt(max(values[-1], SMALLEST_COUPLING))
            starts.append(coordinates_of(self.parameters, [frequency, damping, *coupling]))
        return starts


@register
class FuelSlosh(_Vibration):
    """Fuel in a tank, as a mass on equal springs along three axes (Dodge 2000) that at rest is part of the base.

    The prior's median is 10 kg, with a standard deviation of 1 of its logarithm. The tank lies within a box one and a
    half times as large as the uniform box with the base's mass and inertia; in Python, ``FuelSlosh(reach=...)`` sets
    another half width [m].
    """

    name = "fuel-slosh"
    summary = "Fuel in a partly filled tank lags behind the base and sloshes back and forth."
    modes_count = 3

    def __init__(self, mass: float = 10.0, reach: float = REACH) -> None:
        self.parameters = (
            Parameter("mass", "kg", 1.0, mass, Prior.LOG_NORMAL),
            Parameter("frequency", "Hz", FREQUENCY_SPREAD, FREQUENCY, Prior.LOG_NORMAL),
            Parameter("damping", "1", DAMPING_SPREAD, DAMPING, Prior.LOG_NORMAL),
            *(Parameter(f"position.{axis}", "m", reach, 0.0, Prior.UNIFORM) for axis in "xyz"),
        )

    @property
    def absent(self) -> Floats:
        """Values with zero mass and all others at the middle of the prior."""
        return np.array([0.0, *(parameter.mean for parameter in self.parameters[1:])])

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the fuel that can slosh in a base of this mass."""
        mass = RobotSize.of(model.robot).base_mass
        reason = f"At most half of a base of {three_digits(mass)} kg is fuel, and at most 60 % of the fuel sloshes."
        return (PhysicalBound("kg", FUEL * mass, reason),)

    def attach(self, robot: Robot) -> Self:
        """Return the effect with the position of the tank bounded by the spacecraft."""
        centre, reach = _spacecraft_box(robot)
        changed = copy.copy(self)
        changed.parameters = (
            *self.parameters[:3],
            *(
                place._replace(sigma=float(size) if place.sigma == REACH else place.sigma, mean=float(middle))
                for place, size, middle in zip(self.parameters[3:], reach, centre, strict=True)
            ),
        )
        return changed

    @property
    def reach_of_swing(self) -> float:
        """Largest distance of the tank from the base origin along an axis [m]."""
        return max(parameter.sigma + abs(parameter.mean) for parameter in self.parameters[3:])

    def starts_near(self, resonances: Sequence[Resonance], alone: bool) -> Sequence[Floats]:
        """Return the start of the strongest resonance and, for a fit alone, starts at other positions.

        The coupling of a mass at ``p`` is its mass times ``[[1, -[p]], [[p], [p][p]']]``, from which both follow.
        """
        middle = np.array([parameter.mean for parameter in self.parameters[3:]])
        first = resonances[0]
        mass = float(np.trace(first.coupling[:3, :3])) / 3.0
        turned = first.coupling[3:, :3]
        moment = 0.5 * np.array([turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]])
        place = moment / mass if mass > SMALLEST_MASS else middle
        starts = [(max(mass, SMALLEST_MASS), place)]
        if alone:  # the position may have several optima
            starts += [(SLOSH_MASS, middle + TANK_DISTANCE * corner) for corner in TANK_CORNERS]
        return [coordinates_of(self.parameters, [m, first.frequency, first.damping, *where]) for m, where in starts]

    def modes(self, values: Array) -> Modes:
        """Return three modes, one along each axis."""
        root, position = jnp.sqrt(values[0]), values[3:]
        linear = root * jnp.eye(3)
        return Modes(
            jnp.full(3, 2.0 * jnp.pi * values[1]),
            jnp.full(3, values[2]),
            linear,
            jnp.cross(position[None], linear),
            linear[:, :, None] * position,
        )


def _spacecraft_box(robot: Robot) -> tuple[Floats, Floats]:
    """Return the centre and half sizes of one and a half times the uniform box of the base's inertia, base axes [m]."""
    base = robot.link(robot.base).inertial
    second = np.diag(base.pseudo_inertia[:3, :3]) / base.mass - base.com**2
    return base.com, 1.5 * np.sqrt(3.0 * second)


def wheel_bound(robot: Robot) -> PhysicalBound:
    """Return the momentum of all wheels that a robot of this mass and size carries, at full speed [N m s]."""
    size = RobotSize.of(robot)
    radius = RIM_RADIUS * size.length
    reason = (
        f"The rotors of the wheels have at most {100.0 * ROTORS:g} % of the robot's {three_digits(size.mass)} kg and "
        f"a rim speed of {RIM_SPEED:g} m/s at a radius of {radius:.2g} m."
    )
    return PhysicalBound("N m s", ROTORS * size.mass * RIM_SPEED * radius, reason)
