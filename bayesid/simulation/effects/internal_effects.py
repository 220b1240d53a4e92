"""Moving parts inside or on the base that no encoder sees."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Floats
from bayesid.robot.robot import Robot
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import Parameter, Prior, Quantity, coordinates_of
from bayesid.simulation.effects.instant import Instant, Modes, Resonance
from bayesid.simulation.effects.register import register

__all__ = ["FlexibleAppendage", "FuelSlosh", "WheelMomentum"]

FREQUENCY, FREQUENCY_SPREAD = 0.12, 1.0
"""Median of a hidden vibration's frequency [Hz], standard deviation of its logarithm: 0.02 to 0.9 Hz at 2 sd."""

DAMPING, DAMPING_SPREAD = 0.01, 1.0
"""Median of its damping relative to critical, and the standard deviation of the logarithm."""

STEPS_PER_PERIOD = 10.0
"""Integration steps in one period of the vibration."""

RESONANCES = 2
"""Number of resonances from which the fit of an appendage is started."""

SMALLEST_COUPLING = 0.1
"""Least square of a mode's coupling at which a fit is started [kg m2]; from zero it would not find its sign."""

SLOSH_FREQUENCIES, SLOSH_MASS = (0.06, 0.25), 5.0
"""Frequencies [Hz] and mass [kg] at which the fit of slosh is started: it converges from afar."""

TANK_DISTANCE = 0.4
"""Distance of further starting places of the tank from the middle of the spacecraft, along each axis [m]."""

TANK_CORNERS = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
"""Directions of those places, the corners of a tetrahedron."""


@register
class WheelMomentum(Effect):
    """Residual momentum of reaction wheels at constant speed, in base axes.

    The prior of 1 N m s is the capacity of a small wheel: a resting attitude control leaves less than that.
    """

    name = "wheel-momentum"
    summary = (
        "Reaction wheels left spinning make the base a gyroscope: turning it about one axis turns it about another."
    )
    separated_by = (
        "Its torque grows with the base's rate: repeat with the base turning faster, and about other axes; a torque "
        "that is there at rest is not of wheels."
    )

    def __init__(self, sigma: float = 1.0) -> None:
        self.parameters = tuple(Parameter(axis, "N m s", sigma) for axis in "xyz")

    def momentum(self, values: Array, instant: Instant, inner: Array) -> tuple[Array, Array]:
        """Return the wheels' momentum; they keep their speed."""
        return values, jnp.zeros(3)


class _Vibration(Effect):
    """Something on a spring inside the base: what such effects share."""

    separated_by = "It goes on swinging: excite it with one quick motion, then record with the arm at rest."
    frequency: float = FREQUENCY

    @property
    def longest_step(self) -> float:
        """A tenth of the period at the frequency the fit starts from [s]."""
        return 1.0 / (STEPS_PER_PERIOD * self.frequency)

    def tuned(self, values: Floats) -> Self:
        """Return the effect with its integration step for the frequency among the values."""
        changed = type(self).__new__(type(self))
        changed.__dict__.update(self.__dict__)
        changed.frequency = float(values[[parameter.name for parameter in self.parameters].index("frequency")])
        return changed


@register
class FlexibleAppendage(_Vibration):
    """One vibration mode of a panel, boom or antenna, with base held: frequency, damping and how it couples.

    The momentum of unit modal speed has a linear part [sqrt(kg)] and an angular one about the base origin
    [sqrt(kg) m]; ``participation`` is the length of the angular one, whose square is the inertia that swings. The prior
    of 5 sqrt(kg) m per axis is 25 kg m2, a pair of small panels; of 3 sqrt(kg), 9 kg. The centrifugal load on the mode
    is left out.
    """

    name = "flexible-appendage"
    summary = (
        "A panel, boom or antenna on the base is not rigid: it lags behind the base and swings at a frequency of its "
        "own, and the base swings against it."
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
        """Frequency, damping, participation, then the coupling itself."""
        first, second, *rest = (Quantity(parameter.name, parameter.unit) for parameter in self.parameters)
        return [first, second, Quantity("participation", "sqrt(kg) m"), *rest]

    def report(self, values: Array) -> Array:
        """Insert the participation; the sign of the coupling has no meaning, its largest part is made positive."""
        coupling = values[2:]
        sign = jnp.sign(coupling[3 + jnp.argmax(jnp.abs(coupling[3:]))])
        return jnp.concatenate([values[:2], jnp.linalg.norm(coupling[3:])[None], sign * coupling])

    def modes(self, values: Array) -> Modes:
        """Return the mode."""
        return Modes(2.0 * jnp.pi * values[:1], values[1:2], values[None, 2:5], values[None, 5:8], jnp.zeros((1, 3, 3)))

    def starts_near(self, resonances: Sequence[Resonance], alone: bool) -> Sequence[Floats]:
        """Return one mode per resonance: the largest eigenvector of its coupling."""
        starts = []
        for frequency, matrix in resonances[:RESONANCES]:
            values, vectors = np.linalg.eigh(matrix)
            coupling = vectors[:, -1] * np.sqrt(max(values[-1], SMALLEST_COUPLING))
            starts.append(coordinates_of(self.parameters, [frequency, DAMPING, *coupling]))
        return starts


@register
class FuelSlosh(_Vibration):
    """Fuel in a tank as a mass held by equal springs along three axes (Dodge 2000), at rest part of the base.

    The prior's median is 10 kg, e-fold 1; the tank lies within the spacecraft, taken as one and a half times the
    uniform box of the base's mass and inertia.
    """

    name = "fuel-slosh"
    summary = "Fuel that does not fill its tank lags behind the base and swings back and forth in it."
    modes_count = 3

    def __init__(self, mass: float = 10.0, reach: float = 1.5) -> None:
        self.parameters = (
            Parameter("mass", "kg", 1.0, mass, Prior.LOG_NORMAL),
            Parameter("frequency", "Hz", FREQUENCY_SPREAD, FREQUENCY, Prior.LOG_NORMAL),
            Parameter("damping", "1", DAMPING_SPREAD, DAMPING, Prior.LOG_NORMAL),
            *(Parameter(f"position.{axis}", "m", reach, 0.0, Prior.UNIFORM) for axis in "xyz"),
        )

    @property
    def absent(self) -> Floats:
        """No mass, all else in the middle of the prior."""
        return np.array([0.0, *(parameter.mean for parameter in self.parameters[1:])])

    def attach(self, robot: Robot) -> Self:
        """Bound the tank to the spacecraft."""
        centre, reach = spacecraft_box(robot)
        changed = type(self).__new__(type(self))
        changed.__dict__.update(self.__dict__)
        changed.parameters = (
            *self.parameters[:3],
            *(
                Parameter(f"position.{axis}", "m", float(size), float(middle), Prior.UNIFORM)
                for axis, size, middle in zip("xyz", reach, centre, strict=True)
            ),
        )
        return changed

    def starts_near(self, resonances: Sequence[Resonance], alone: bool) -> Sequence[Floats]:
        """Return two frequencies in the middle of the spacecraft, and where affordable other places of the tank."""
        middle = np.array([parameter.mean for parameter in self.parameters[3:]])
        places = [(frequency, middle) for frequency in SLOSH_FREQUENCIES]
        if alone:  # the place may have several optima
            places += [(resonances[0].frequency, middle + TANK_DISTANCE * corner) for corner in TANK_CORNERS]
        return [
            coordinates_of(self.parameters, [SLOSH_MASS, frequency, DAMPING, *place]) for frequency, place in places
        ]

    def modes(self, values: Array) -> Modes:
        """Return one mode per axis."""
        root, position = jnp.sqrt(values[0]), values[3:]
        linear = root * jnp.eye(3)
        return Modes(
            jnp.full(3, 2.0 * jnp.pi * values[1]),
            jnp.full(3, values[2]),
            linear,
            jnp.cross(position[None], linear),
            linear[:, :, None] * position,
        )


def spacecraft_box(robot: Robot) -> tuple[Floats, Floats]:
    """Centre and half sizes [m], base axes, of one and a half times the uniform box with the base's inertia."""
    base = robot.link(robot.base).inertial
    second = np.diag(base.pseudo_inertia[:3, :3]) / base.mass - base.com**2
    return base.com, 1.5 * np.sqrt(3.0 * second)
