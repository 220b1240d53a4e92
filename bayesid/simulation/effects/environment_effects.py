"""Effects of the environment on the robot.

The largest density of the air is that of Wertz and Larson (eds.), Space Mission Analysis and Design, 3rd edition, 1999,
inside the rear cover, for the maximum of the solar cycle. Geomagnetic storms and the bulge on the day side come on top
of it (`SURGE`). The exponential model of Vallado, Fundamentals of Astrodynamics and Applications, 4th edition, 2013,
table 8-4, which knows no solar cycle, is 1.3 times thinner at 200 km, 2.0 times at 400 km and 3.8 times at 800 km.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jax import Array

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.robot.robot_size import RobotSize
from bayesid.simulation.effects.effect import Effect, Situation
from bayesid.simulation.effects.effect_parameters import Parameter, PhysicalBound, Prior, three_digits
from bayesid.simulation.effects.register import register
from bayesid.simulation.instant import Instant, Wrench
from bayesid.simulation.orbit import EARTH_RADIUS

__all__ = [
    "SURGE",
    "AerodynamicDrag",
    "GravityGradient",
    "MagneticDipole",
    "RotationalDrag",
    "SolarPressure",
    "ThrusterLeak",
    "largest_density",
]

EARTH_FIELD = 3.12e-5 * 6371.2e3**3 / 3.986004418e14
"""Equatorial field of the Earth's dipole divided by the gravity gradient mu / r^3 at the same radius [T s2]."""

REACH = 2.0
"""Largest distance of a centre of pressure from the base origin along each axis [m]."""

DRAG_COEFFICIENT = 2.2
"""Drag coefficient of a spacecraft in free molecular flow, the value in general use (Vallado 2013, chapter 8)."""

SUNLIGHT = 4.56e-6
"""Pressure of sunlight on an absorbing surface at the Earth's distance [Pa] (Montenbruck and Gill 2000, 3.4)."""

MIRROR = 2.0
"""Factor of that pressure on a perfect mirror that faces the Sun, which is one plus the reflectivity."""

DIPOLE = 1.0e-2
"""Residual dipole per mass of a spacecraft that does not spin and was built without regard to magnetism [A m2/kg].

It is that of class III of NASA SP-8018, Spacecraft Magnetic Torques, 1969.
"""

THRUST = 0.01
"""Acceleration that a spacecraft's thruster for attitude control gives it [m/s2]; assumed, as of 20 N on 2 t."""

LEAK = 0.01
"""Largest leak of a valve relative to its thrust; assumed, since a larger one would soon empty the tank."""

BRAKING_TIME = 10.0
"""Shortest time within which a base that is called free may lose its rotation [s]."""


@register
class GravityGradient(Effect):
    """Gravity gradient on every body, the paper's (12)-(16), for any Kepler orbit; it has no free parameter.

    Summed over the bodies, the forces of (14) and the torques of (16) are a pure torque about the common centre of
    mass, which depends only on the composite second moment.
    """

    name = "gravity-gradient"
    summary = (
        "Gravity is stronger on parts nearer the Earth. This difference over the robot's extent causes a torque and "
        "a reading of an accelerometer that is not at the centre of mass."
    )
    separated_by = (
        "The torque follows the direction of the Earth: repeat with the base in a different attitude, or with the arm "
        "stretched along a different axis."
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

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the pressure on all of the robot's area, and on its area times the distance from the base origin."""
        return _pressure_bounds(type(self), model)

    @staticmethod
    def largest_pressure(model: Situation) -> tuple[float, str]:
        """Return the largest pressure on a surface that faces it [Pa], and the start of a sentence that names it."""
        raise NotImplementedError

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

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the bounds of the pressure effect."""
        return _pressure_bounds(self.kind, model)

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the force and its torque about the base origin."""
        unit = instant.to_base(self.kind.direction(instant))
        return Wrench(values[0] * unit, jnp.cross(values[1:], unit))


def _pressure_bounds(kind: type[_Pressure], model: Situation) -> tuple[PhysicalBound, ...]:
    """Return the largest force, and the largest torque about the base origin, of a pressure on the whole robot."""
    pressure, reason = kind.largest_pressure(model)
    size = RobotSize.of(model.robot)
    lever = size.area_moment / size.area
    presses = f"{reason} acts on {three_digits(size.area)} m2"
    return (
        PhysicalBound("N", pressure * size.area, f"{presses}."),
        PhysicalBound(
            "N m", pressure * size.area_moment, f"{presses} at {three_digits(lever)} m from the base origin."
        ),
    )


@register
class AerodynamicDrag(_Pressure):
    """Constant drag against the orbital motion, at a centre of pressure offset from the centre of mass.

    The prior's median of 5 mN is the drag of ten square metres at 350 km; the standard deviation of 1.5 of its
    logarithm stands for density and area. The prior of the centre of pressure is uniform within two metres of the base
    origin along each axis, whatever the size of the robot; the largest torque is that on this robot's area.
    """

    name = "aerodynamic-drag"
    summary = (
        "The thin air of a low orbit exerts a force against the direction of flight. If the force is offset from "
        "the centre of mass, it also causes a torque, which depends on the attitude to the direction of flight."
    )
    separated_by = "The force is fixed to the direction of flight: repeat with the base in a different attitude."

    def __init__(self, force: float = 5.0e-3, spread: float = 1.5) -> None:
        super().__init__(force, spread)

    @staticmethod
    def largest_pressure(model: Situation) -> tuple[float, str]:
        """Return the drag per area at the lowest point of the orbit in the densest air there."""
        if model.orbit is None:
            raise InputError("drag of the upper atmosphere exists only in orbit", remedy="State the orbit")
        altitude, speed = model.orbit.perigee_altitude, model.orbit.perigee_speed
        density = largest_density(altitude)
        return (
            0.5 * density * speed**2 * DRAG_COEFFICIENT,
            f"Air of {density:.2g} kg/m3, the densest at {1e-3 * altitude:.0f} km at solar maximum, with a relative "
            f"speed of {1e-3 * speed:.2f} km/s and a drag coefficient of {DRAG_COEFFICIENT:g},",
        )

    @staticmethod
    def direction(instant: Instant) -> Array:
        """Return the direction against the orbital motion."""
        return -instant.environment.velocity


@register
class SolarPressure(_Pressure):
    """Constant radiation pressure from the Sun's direction, at a centre of pressure offset from the centre of mass.

    The prior's median of 0.3 mN is that of 66 square metres of absorbing panel; the standard deviation of 2 of its
    logarithm stands for area and reflection.
    """

    name = "solar-pressure"
    summary = (
        "Sunlight exerts a force away from the Sun. If the force is offset from the centre of mass, it also causes a "
        "torque about an axis perpendicular to the direction of the Sun."
    )
    separated_by = (
        "The direction of the force is fixed to the Sun: repeat with the base in a different attitude, in sunlight. A "
        "recording in eclipse, compared separately, must be free of it."
    )
    needs_latitude = True

    @classmethod
    def lacks(cls, model: Situation) -> str | None:
        """Return the orbit or the direction of the Sun if it is not known."""
        return super().lacks(model) or ("sun in [orbit]" if model.orbit is None or model.orbit.sun is None else None)

    def __init__(self, force: float = 3.0e-4, spread: float = 2.0) -> None:
        super().__init__(force, spread)

    @staticmethod
    def largest_pressure(model: Situation) -> tuple[float, str]:
        """Return the pressure of sunlight on a mirror that faces the Sun."""
        return MIRROR * SUNLIGHT, f"Sunlight of {1e6 * SUNLIGHT:.3g} micropascal, reflected by a mirror,"

    @staticmethod
    def direction(instant: Instant) -> Array:
        """Return the direction away from the Sun."""
        return -instant.environment.sun


@register
class MagneticDipole(Effect):
    """Residual magnetic dipole of the base in the Earth's field, which is modelled as a dipole along the Earth's axis.

    The prior of 10 A m2 is that of a spacecraft of 1000 kg that was built without magnetic control.
    """

    name = "magnetic-dipole"
    summary = "Currents and magnets on board act like a compass needle in the Earth's magnetic field."
    separated_by = (
        "The torque follows the Earth's field along the orbit: repeat a quarter of an orbit later, at a different "
        "argument of latitude, and in a different attitude."
    )
    needs_latitude = True
    needs_orbit = True

    @classmethod
    def lacks(cls, model: Situation) -> str | None:
        """Return the orbit or its inclination, which gives the direction of the field, if it is not known."""
        inclination = None if model.orbit is None else model.orbit.inclination
        return super().lacks(model) or ("inclination in [orbit]" if inclination is None else None)

    def __init__(self, sigma: float = 10.0) -> None:
        self.parameters = tuple(Parameter(axis, "A m2", sigma) for axis in "xyz")

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the dipole of a spacecraft of the robot's mass that was built without magnetic control."""
        mass = model.robot.mass
        reason = (
            "A spacecraft built without magnetic control has a residual dipole of 1 A m2 per 100 kg (NASA SP-8018, "
            f"class III); the robot has {three_digits(mass)} kg."
        )
        return (PhysicalBound("A m2", DIPOLE * mass, reason),)

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the torque mu x B, with B = -B0 (Re/r)^3 (3 (n.u) u - n)."""
        north, up = instant.environment.north, instant.environment.zenith
        field = -EARTH_FIELD * instant.environment.gradient * (3.0 * up * (up @ north) - north)
        return Wrench(jnp.zeros(3), jnp.cross(values, instant.to_base(field)))


@register
class ThrusterLeak(Effect):
    """Constant force and torque fixed in the base, such as those of a valve that does not close.

    The priors of 50 mN and 50 mN m are one per cent of a thruster of 5 N, and of its torque at a lever of one metre.
    """

    name = "thruster-leak"
    summary = "A leaking valve exerts a constant force and torque that are fixed in the base."
    separated_by = (
        "The direction of the leak is fixed in the base: repeat with the base in a different attitude, so that forces "
        "fixed in the orbit or in inertial space change their direction in base axes and the leak does not; also "
        "record with the arm at rest."
    )

    def __init__(self, force: float = 0.05, torque: float = 0.05) -> None:
        self.parameters = tuple(
            Parameter(f"{key}.{axis}", unit, sigma)
            for key, unit, sigma in (("force", "N", force), ("torque", "N m", torque))
            for axis in "xyz"
        )

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return one per cent of the thrust for a robot of this mass, and its torque at the edge of the base."""
        size = RobotSize.of(model.robot)
        force = LEAK * THRUST * size.mass
        thrust = f"{three_digits(THRUST * size.mass)} N, which accelerates the robot by {THRUST:g} m/s2"
        leak = f"A valve leaks at most {100.0 * LEAK:g} % of {thrust}"
        return (
            PhysicalBound("N", force, f"{leak}."),
            PhysicalBound(
                "N m", force * size.radius, f"{leak}, at the base's radius of {three_digits(size.radius)} m."
            ),
        )

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the parameters, which are force and torque."""
        return Wrench(values[:3], values[3:])


@register
class RotationalDrag(Effect):
    """Torque against the base's rotation, proportional to its rate about each axis, as from the air of a laboratory.

    The prior of 0.1 N m s brakes a body of 1 kg m2 with a time constant of ten seconds.
    """

    name = "rotational-drag"
    summary = "Air in a laboratory, or a bearing, damps the rotation of the base in proportion to its rate."
    separated_by = "The torque damps every rotation: let the base rotate freely at two rates with the arm at rest."

    def __init__(self, sigma: float = 0.1) -> None:
        self.parameters = tuple(Parameter(axis, "N m s", sigma) for axis in "xyz")

    def physical_bounds(self, model: Situation) -> tuple[PhysicalBound, ...]:
        """Return the coefficient that stops the base within ten seconds.

        In orbit, air and eddy currents damp about a million times less; a rate controller that was assumed to be off
        can act like this.
        """
        inertia = RobotSize.of(model.robot).inertia
        reason = (
            f"A base of {three_digits(inertia)} kg m2 that loses its rotation in less than {BRAKING_TIME:g} s is not "
            "free-floating."
        )
        return (PhysicalBound("N m s", inertia / BRAKING_TIME, reason),)

    def wrench(self, values: Array, instant: Instant, inner: Array) -> Wrench:
        """Return the torque, the negative product of rates and coefficients."""
        return Wrench(jnp.zeros(3), -values * instant.rate)


SURGE = 2.0
"""Density that a spacecraft can meet relative to what a model states (ECSS-E-ST-10-04C, 2008, 7.2.1.2, note 1)."""

ALTITUDES = 1e3 * np.array(
    [100, 150, 200, 250, 300, 350, 400, 450, 500, 550, 600, 650, 700, 800, 900, 1000, 1250, 1500], dtype=float
)
"""Altitudes of the table [m]."""

DENSITIES = np.array(
    [
        *(5.10e-7, 2.04e-9, 3.52e-10, 1.06e-10, 3.96e-11, 1.66e-11, 7.55e-12, 3.61e-12, 1.80e-12),
        *(9.25e-13, 4.89e-13, 2.64e-13, 1.47e-13, 4.39e-14, 1.91e-14, 8.84e-15, 2.59e-15, 1.22e-15),
    ]
)
"""Densities at these altitudes at the maximum of the solar cycle [kg/m3]."""


def largest_density(altitude: float) -> float:
    """Return the largest density that a spacecraft can meet at an altitude [m], in kg/m3.

    Between the table's altitudes the logarithm is interpolated. Below 100 km, where no orbit is, the first density
    holds; above 1500 km the density falls as in an isothermal atmosphere under gravity of the inverse square.
    """
    log_density = float(np.interp(altitude, ALTITUDES, np.log(DENSITIES)))
    top, last = ALTITUDES[-1], np.log(DENSITIES[-2:])
    if altitude > top:
        decay = (last[0] - last[1]) / (top - ALTITUDES[-2])
        log_density -= decay * (altitude - top) * (EARTH_RADIUS + top) / (EARTH_RADIUS + altitude)
    return SURGE * float(np.exp(log_density))
