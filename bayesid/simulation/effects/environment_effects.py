"""Effects of the environment on the robot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._math.arrays import Floats
from bayesid.simulation.effects.effect import Effect
from bayesid.simulation.effects.effect_parameters import Parameter, Prior
from bayesid.simulation.effects.instant import Instant, Wrench
from bayesid.simulation.effects.register import register

if TYPE_CHECKING:
    from bayesid.simulation.model import Model

__all__ = ["AerodynamicDrag", "GravityGradient", "MagneticDipole", "RotationalDrag", "SolarPressure", "ThrusterLeak"]

EARTH_FIELD = 3.12e-5 * 6371.2e3**3 / 3.986004418e14
"""Equatorial field of the Earth's dipole divided by the gravity gradient mu / r^3 at the same radius [T s2]."""

REACH = 2.0
"""Largest distance of a centre of pressure from the base origin along each axis [m]."""


@register
class GravityGradient(Effect):
    """Gravity gradient on every body, the paper's (12)-(16), for any Kepler orbit; it has no free parameter.

    Summed over the bodies, the forces of (14) and the torques of (16) are a pure torque about the common centre of
    mass, which depends only on the composite second moment.
    """

    name = "gravity-gradient"
    summary = (
        "Gravity is stronger on parts nearer the Earth. The difference over the robot's extent turns it, "
        "and an accelerometer away from the centre of mass feels it."
    )
    separated_by = (
        "It turns with the direction of the Earth: repeat with the base turned to another attitude, or with the arm "
        "stretched along another axis."
    )
    needs_orbit = True

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the torque 3 mu/r^3 (Xi u) x u."""
        up = instant.to_base(instant.environment.zenith)
        return Wrench(jnp.zeros(3), 3.0 * instant.environment.gradient * jnp.cross(instant.body.second_moment @ up, up))

    def specific_force(self, values: Array, instant: Instant, lever: Array) -> Array:
        """Return the negative gravity-gradient acceleration at the accelerometer."""
        return -self.gravity_gradient_tensor(values, instant) @ lever

    def gravity_gradient_tensor(self, values: Array, instant: Instant) -> Array:
        """Return the tensor mu/r^3 (3 u u' - 1)."""
        up = instant.to_base(instant.environment.zenith)
        return instant.environment.gradient * (3.0 * jnp.outer(up, up) - jnp.eye(3))


class _Pressure(Effect):
    """Force of constant size and known direction at a point of the base."""

    needs_orbit = True

    def __init__(self, force: float, spread: float) -> None:
        self.parameters = (
            Parameter("force", "N", spread, force, Prior.LOG_NORMAL),
            *(Parameter(f"cp.{axis}", "m", REACH, 0.0, Prior.UNIFORM) for axis in "xyz"),
        )

    @property
    def absent(self) -> Floats:
        """Values without a force, at the base origin."""
        return np.zeros(4)

    def in_amplitudes(self) -> Effect:
        """Return the effect with the force and its product with the lever as parameters."""
        return _LinearPressure(self)

    def amplitudes(self, values: Array) -> Array:
        """Return the force and its product with the lever."""
        return jnp.concatenate([values[:1], values[0] * values[1:]])

    @staticmethod
    def direction(instant: Instant) -> Array:
        """Return the direction of the force in orbit axes."""
        raise NotImplementedError

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the force and its torque about the base origin."""
        force = values[0] * instant.to_base(self.direction(instant))
        return Wrench(force, jnp.cross(values[1:], force))


class _LinearPressure(Effect):
    """Pressure with parameters in which it is linear, the force and the force times its lever.

    Their scales follow from the pressure's prior: the change of the force by one standard deviation of its logarithm at
    the median, and the median force at the longest lever.
    """

    needs_orbit = True

    def __init__(self, pressure: _Pressure) -> None:
        self.kind = type(pressure)
        force = pressure.parameters[0]
        self.parameters = (
            Parameter("force", "N", force.mean * force.sigma),
            *(Parameter(f"force-lever.{axis}", "N m", force.mean * REACH) for axis in "xyz"),
        )

    @property
    def label(self) -> str:
        """Name of the pressure effect."""
        return self.kind.name

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the force and its torque about the base origin."""
        unit = instant.to_base(self.kind.direction(instant))
        return Wrench(values[0] * unit, jnp.cross(values[1:], unit))


@register
class AerodynamicDrag(_Pressure):
    """Constant drag against the orbital motion, at a centre of pressure beside the centre of mass.

    The prior's median of 5 mN is the drag of ten square metres at 350 km; its spread of 1.5 in the logarithm stands for
    density and area. The centre of pressure lies within two metres of the base origin along each axis.
    """

    name = "aerodynamic-drag"
    summary = (
        "The thin air of a low orbit pushes against the direction of flight. Where the push acts beside the "
        "centre of mass it also turns the robot, and the turn follows the attitude to the direction of flight."
    )
    separated_by = "It keeps the direction of flight: repeat with the base turned to another attitude."

    def __init__(self, force: float = 5.0e-3, spread: float = 1.5) -> None:
        super().__init__(force, spread)

    @staticmethod
    def direction(instant: Instant) -> Array:
        """Return the direction against the orbital motion."""
        return -instant.environment.velocity


@register
class SolarPressure(_Pressure):
    """Constant radiation pressure from the Sun's direction, at a centre of pressure beside the centre of mass.

    The prior's median of 0.3 mN is that of 45 square metres of absorbing panel; its spread of 2 in the logarithm stands
    for area and reflection.
    """

    name = "solar-pressure"
    summary = (
        "Sunlight pushes the robot away from the Sun. Where the push acts beside the centre of mass it also turns "
        "the robot, about an axis that stays with the stars."
    )
    separated_by = (
        "It keeps the direction of the Sun and ends in eclipse: repeat with the base turned to another attitude, or on "
        "the orbit's night side."
    )
    needs_latitude = True

    @classmethod
    def instances(cls, model: Model) -> Sequence[Effect]:
        """Return the effect if the direction of the Sun is known."""
        return [] if model.orbit is None or model.orbit.sun is None else super().instances(model)

    def __init__(self, force: float = 3.0e-4, spread: float = 2.0) -> None:
        super().__init__(force, spread)

    @staticmethod
    def direction(instant: Instant) -> Array:
        """Return the direction away from the Sun."""
        return -instant.environment.sun


@register
class MagneticDipole(Effect):
    """Residual magnetic dipole of the base in the Earth's field, which is modelled as a dipole along the Earth's axis.

    The prior of 10 A m2 is that of a small satellite without magnetic cleanliness.
    """

    name = "magnetic-dipole"
    summary = "Currents and magnets on board make the base a compass needle in the Earth's magnetic field."
    separated_by = (
        "It follows the Earth's field along the orbit: repeat at another argument of latitude, a quarter of an orbit "
        "away, and in another attitude."
    )
    needs_latitude = True
    needs_orbit = True

    @classmethod
    def instances(cls, model: Model) -> Sequence[Effect]:
        """Return the effect if the inclination, and with it the direction of the Earth's field, is known."""
        return [] if model.orbit is None or model.orbit.inclination is None else super().instances(model)

    def __init__(self, sigma: float = 10.0) -> None:
        self.parameters = tuple(Parameter(axis, "A m2", sigma) for axis in "xyz")

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the torque mu x B, with B = -B0 (Re/r)^3 (3 (n.u) u - n)."""
        north, up = instant.environment.north, instant.environment.zenith
        field = -EARTH_FIELD * instant.environment.gradient * (3.0 * up * (up @ north) - north)
        return Wrench(jnp.zeros(3), jnp.cross(values, instant.to_base(field)))


@register
class ThrusterLeak(Effect):
    """Constant force and torque fixed in the base, such as those of a valve that does not close.

    The prior of 50 mN and 50 mN m is one per cent of a small thruster on a lever of one metre.
    """

    name = "thruster-leak"
    summary = "A leaking valve pushes steadily with a force and a torque that are fixed in the base."
    separated_by = (
        "It keeps its direction in the base: repeat with the base turned to another attitude, so that what is fixed in "
        "the orbit or in inertial space changes its direction in base axes and the leak does not; record with the arm "
        "at rest too."
    )

    def __init__(self, force: float = 0.05, torque: float = 0.05) -> None:
        self.parameters = tuple(
            Parameter(f"{key}.{axis}", unit, sigma)
            for key, unit, sigma in (("force", "N", force), ("torque", "N m", torque))
            for axis in "xyz"
        )

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the parameters, which are force and torque."""
        return Wrench(values[:3], values[3:])


@register
class RotationalDrag(Effect):
    """Torque against the base's rotation, proportional to its rate about each axis, as from the air of a laboratory.

    The prior of 0.1 N m s brakes a body of 1 kg m2 within ten seconds.
    """

    name = "rotational-drag"
    summary = "The air of a laboratory, or a bearing, brakes the rotation of the base in proportion to its rate."
    separated_by = "It brakes every rotation: let the base turn freely, with the arm at rest, at two rates."

    def __init__(self, sigma: float = 0.1) -> None:
        self.parameters = tuple(Parameter(axis, "N m s", sigma) for axis in "xyz")

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the torque, the negative product of rates and coefficients."""
        return Wrench(jnp.zeros(3), -values * instant.rate)
