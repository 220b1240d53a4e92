"""Sections of a study file on the robot, its loads and its orbit."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

from pydantic import BeforeValidator, Field, field_validator, model_validator

from bayesid._io.errors import InputError
from bayesid.app.schema.value_types import (
    FULL_TURN,
    File,
    Name,
    NonNegative,
    Number,
    Position,
    Positive,
    Section,
    UnitVector,
    array_of_tables,
    distinct,
    list_of,
    no_more_than,
)

if TYPE_CHECKING:
    from bayesid.robot.inertial_parameters import InertialParameters

LOWEST_ORBIT = 6.3e6  # radius below which an orbit is inside the Earth [m]
HIGHEST_ORBIT = 1.5e9  # radius above which an orbit is outside the Earth's sphere of influence [m]


class BodySection(Section):
    """Section ``[unknowns.prior.BODY]``, the inertial parameters of a rigid body in its link's axes.

    Parameters
    ----------
    mass : float
        Mass [kg].
    com : (3,)
        Centre of mass [m].
    inertia : (6,)
        Inertia about the centre of mass, xx yy zz xy xz yz [kg m2].
    """

    mass: Positive
    com: Position
    inertia: Annotated[tuple[Number, Number, Number, Number, Number, Number], list_of(6)]

    @model_validator(mode="after")
    def _check_physical(self) -> BodySection:
        _ = self.parameters
        return self

    @property
    def parameters(self) -> InertialParameters:
        """Inertial parameters as `InertialParameters`, which checks that they are physically possible."""
        from bayesid.robot.inertial_parameters import InertialParameters

        xx, yy, zz, xy, xz, yz = self.inertia
        return InertialParameters(self.mass, self.com, [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


class LoadSection(BodySection):
    """Section ``[[robot.loads]]``, a rigid body that is fixed to a link and is not in the URDF.

    Parameters
    ----------
    name, link : str
        Name of the load and of the link that carries it, in whose axes the other parameters are.
    """

    name: Name
    link: Name


class RobotSection(Section):
    """Section ``[robot]``, the robot and its loads.

    Parameters
    ----------
    urdf : Path
        URDF of the robot, whose root link is the base body, or its MJCF, which is rewritten as URDF.
    link_spread : float, optional
        Relative uncertainty of all links that are not unknowns, by default 0, which means known exactly.
    nearest_physical : bool, optional
        Whether links whose inertia no rigid body can have take the nearest that one can; by default they are refused.
    loads : sequence of LoadSection, optional
        Bodies that are fixed to links.
    """

    urdf: File
    nearest_physical: bool = False
    link_spread: Annotated[NonNegative, no_more_than(1.0, "A fraction, not a percentage: 0.05 is 5 %")] = 0.0
    loads: Annotated[tuple[LoadSection, ...], BeforeValidator(array_of_tables)] = ()

    @field_validator("loads")
    @classmethod
    def _distinct_names(cls, loads: tuple[LoadSection, ...]) -> tuple[LoadSection, ...]:
        distinct(tuple(load.name for load in loads))
        return loads


class OrbitSection(Section):
    """Section ``[orbit]``, the orbit about the Earth.

    Parameters
    ----------
    radius : float
        Radius, or the semi-major axis if there is an eccentricity [m].
    eccentricity : float, optional
        Eccentricity, in [0, 1).
    inclination : float, optional
        Inclination [rad].
    argument_of_perigee : float, optional
        Argument of perigee [rad].
    sun : (3,), optional
        Unit vector from the Earth to the Sun, in the axes of node, along-orbit direction and orbit normal.
    """

    radius: Number
    eccentricity: Annotated[Number, Field(ge=0.0, lt=1.0)] = 0.0
    inclination: Annotated[NonNegative, no_more_than(math.pi, "Radians, not degrees?")] | None = None
    argument_of_perigee: Annotated[Number, FULL_TURN] = 0.0
    sun: UnitVector | None = None

    @field_validator("radius")
    @classmethod
    def _above_ground(cls, radius: float) -> float:
        if radius < LOWEST_ORBIT:
            raise InputError(
                f"{radius:g} m is inside the Earth",
                remedy="Metres, not kilometres? It is counted from the Earth's centre, not the altitude",
            )
        if radius > HIGHEST_ORBIT:
            raise InputError(f"{radius:g} m is no orbit about the Earth", remedy="Metres, not millimetres?")
        return radius

    @model_validator(mode="after")
    def _perigee_above_ground(self) -> OrbitSection:
        perigee = self.radius * (1.0 - self.eccentricity)
        if perigee < LOWEST_ORBIT:
            raise InputError(
                f"the perigee, radius (1 - eccentricity) = {perigee:g} m, is inside the Earth",
                remedy="With an eccentricity, radius is the semi-major axis",
            )
        return self
