"""Sections of a study file on the robot and its orbit, recordings, unknowns, the model and the prior of a diagnosis."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import BeforeValidator, Field, field_validator, model_validator

from bayesid._io.errors import InputError
from bayesid.app.schema.validation_messages import suggest
from bayesid.app.schema.value_types import (
    FULL_TURN,
    File,
    Name,
    Names,
    NonNegative,
    Number,
    PerComponent,
    PerName,
    Position,
    Positive,
    Quaternion,
    Section,
    Table,
    UnitVector,
    array_of_tables,
    distinct,
    list_of,
    no_more_than,
)

if TYPE_CHECKING:
    from bayesid.robot.inertial_parameters import BodyChange, InertialParameters


def check_extended(body: BodySection, place: str) -> None:
    """Reject a point, rod or plate as the centre of a prior.

    Parameters
    ----------
    body : BodySection
    place : str
        Place in the study file, for the message.
    """
    if not body.parameters.is_extended:
        raise InputError(
            "the body is a point, a rod or a plate, about which no relative prior can be centred",
            place=place,
            remedy="Give it the inertia of a body with volume: I1 + I2 > I3 for its principal moments",
        )


class RecordingSection(Section):
    """Section ``[[recordings]]``, one recording.

    Parameters
    ----------
    file : Path
        CSV or Parquet file in the format of a recording.
    attitude : (4,)
        Initial attitude, a quaternion from base to orbit axes.
    attitude_sigma : float, optional
        Standard deviation of the initial attitude per axis [rad], by default 0, which means exact.
    argument_of_latitude : float, optional
        Argument of latitude at time 0 [rad], needed by effects that depend on the position in the orbit.
    start : table of joint to float, optional
        Positions at time 0 of joints recorded by speed alone, by default zero [rad or m].
    """

    file: File
    attitude: Quaternion
    attitude_sigma: Annotated[NonNegative, no_more_than(math.pi, "Radians, not arcsec or degrees?")] = 0.0
    argument_of_latitude: Annotated[Number, FULL_TURN] | None = None
    start: Mapping[Name, Number] = Field(default_factory=dict)


class ChangeSection(Section):
    """Section ``[[unknowns.changes]]``, a mass-property change since the posterior that serves as prior.

    Parameters
    ----------
    body : str
        Name of the unknown body that changed.
    mass : float
        Added mass [kg]; negative for removed mass, such as burnt fuel.
    mass_sigma : float, optional
        Standard deviation of the mass, by default 0 [kg].
    com : (3,)
        Centre of the added mass in the body's axes [m].
    inertia : (6,), optional
        Inertia of the added mass about its centre, xx yy zz xy xz yz, by default that of a point mass [kg m2].
    """

    body: Name
    mass: Number
    mass_sigma: NonNegative = 0.0
    com: Position
    inertia: Annotated[tuple[Number, Number, Number, Number, Number, Number], list_of(6)] = (0.0,) * 6

    @model_validator(mode="after")
    def _check_physical(self) -> ChangeSection:
        _ = self.change
        return self

    @property
    def change(self) -> BodyChange:
        """Mass-property change as a `BodyChange`, which validates it."""
        from bayesid.robot.inertial_parameters import BodyChange

        xx, yy, zz, xy, xz, yz = self.inertia
        tensor = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
        return BodyChange(self.body, self.mass, self.com, tensor, self.mass_sigma)


class UnknownsSection(Section):
    """Section ``[unknowns]``, the bodies to identify and their priors.

    Parameters
    ----------
    bodies : sequence of str
        Links or loads whose ten inertial parameters are estimated; empty if only effects are estimated.
    spread : float or table of body to float, optional
        Relative width of the prior in log-Cholesky coordinates, by default 1.
    prior : table of body to BodySection, optional
        Centres of the priors, by default the values of the URDF or of the load.
    posterior : Path, optional
        File ``posterior.nc`` of an earlier study of these bodies; its posterior is used as prior.
    changes : sequence of ChangeSection, optional
        Mass-property changes since that posterior.
    """

    bodies: Names
    spread: Annotated[PerName, no_more_than(10.0, "A fraction, not a percentage: 0.05 is 5 %")] = 1.0
    prior: Mapping[Name, BodySection] = Field(default_factory=dict)
    posterior: File | None = None
    changes: Annotated[tuple[ChangeSection, ...], BeforeValidator(array_of_tables)] = ()

    @model_validator(mode="after")
    def _check_posterior(self) -> UnknownsSection:
        if self.posterior is None and self.changes:
            raise InputError(
                "there is no posterior to which the changes could apply", place="changes", remedy="Give posterior"
            )
        for key in ("spread", "prior"):
            if self.posterior is not None and key in self.model_fields_set:
                raise InputError(
                    "it contradicts unknowns.posterior, which is the prior", place=key, remedy="Remove one of the two"
                )
        for index, change in enumerate(self.changes, start=1):
            if change.body not in self.bodies:
                raise InputError(
                    f"'{change.body}' is not among unknowns.bodies",
                    place=f"changes #{index}.body",
                    remedy=suggest(change.body, self.bodies) or "Add it there or remove it here",
                )
        return self

    @model_validator(mode="after")
    def _check_bodies(self) -> UnknownsSection:
        tables = {"spread": self.spread if isinstance(self.spread, Mapping) else {}, "prior": self.prior}
        for key, table in tables.items():
            for body in table:
                if body not in self.bodies:
                    remedy = suggest(body, self.bodies) or "Add it there or remove it here"
                    raise InputError(f"'{body}' is not among unknowns.bodies", place=key, remedy=remedy)
        for body, section in self.prior.items():
            check_extended(section, place=f"prior.{body}")
        return self

    def spread_of(self, body: str) -> float:
        """Return the relative width of one body's prior."""
        return self.spread.get(body, 1.0) if isinstance(self.spread, Mapping) else self.spread


class ModelSection(Section):
    """Section ``[model]``, the contents of the simulation.

    Parameters
    ----------
    effects : sequence of str, optional
        Names of effects in the catalogue, with their place if required, such as ``payload:LINK``.
    initial_rate : {"unknown", "zero"}, optional
        Initial rate of each recording, either estimated or zero.
    initial_rate_sigma : float, optional
        Prior standard deviation of an unknown initial rate, by default 0.1 [rad/s].
    plugins : sequence of Path, optional
        User-supplied Python files that register effects, sensors or design criteria.
    priors : table of effect to table of key to float, optional
        Prior standard deviations that replace an effect's defaults, in the unit of the key.
    noise : table of fault to table of key to float, optional
        Noise faults, with the names and keys that a diagnosis reports: ``"rate-noise" = { factor = 2.0 }``,
        ``"coloured-noise:accel" = { sigma = 1e-5, time = 3.0 }``, ``"outliers:rate" = { fraction = 0.01 }``,
        ``"quantisation:rate" = { step = 1e-6 }``, ``"encoder-noise" = { factor = 2.0 }``. A list has a value per axis.
    """

    effects: Names = ()
    initial_rate: Literal["unknown", "zero"] = "unknown"
    initial_rate_sigma: Annotated[Positive, no_more_than(100.0, "Is it in rad/s?")] | None = None
    plugins: tuple[File, ...] = ()
    priors: Mapping[Name, Table] = Field(default_factory=dict)
    noise: Mapping[Name, Mapping[Name, PerComponent]] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _check_initial_rate(self) -> ModelSection:
        if self.initial_rate == "zero" and self.initial_rate_sigma is not None:
            problem = "initial_rate_sigma contradicts initial_rate = 'zero'"
            raise InputError(problem, remedy="Remove it, or set initial_rate = 'unknown'")
        return self


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
        Name of the load, and of the link that carries it. The other parameters are in the axes of that link.
    """

    name: Name
    link: Name


class WheelSection(Section):
    """Section ``[[robot.wheels]]``, a reaction wheel whose speed is recorded as ``wheel_speed.NAME``.

    Parameters
    ----------
    name : str
        Name of the wheel in recordings.
    axis : (3,)
        Unit vector of its axis, base axes.
    inertia : float
        Moment of inertia about the axis; the inertia of the base includes the wheel at rest [kg m2].
    position : (3,), optional
        Centre of the wheel in the base, where an imbalance acts, by default the base origin [m].
    """

    name: Name
    axis: UnitVector
    inertia: Annotated[Positive, no_more_than(100.0, "Is it in kg m2?")]
    position: Position = (0.0, 0.0, 0.0)


class RobotSection(Section):
    """Section ``[robot]``, the robot and its loads.

    Parameters
    ----------
    urdf : Path
        URDF of the robot, whose root link is the base body, or MJCF, which is converted to URDF.
    link_spread : float, optional
        Prior width, in log-Cholesky coordinates, of all links that are not unknowns: lengths are uncertain by about
        that fraction, masses by twice that. By default 0, which means exactly known.
    nearest_physical : bool, optional
        Whether physically impossible link inertias are replaced by the nearest possible ones; by default they are
        refused.
    loads : sequence of LoadSection, optional
        Bodies that are fixed to links.
    wheels : sequence of WheelSection, optional
        Reaction wheels whose speed is recorded.
    """

    urdf: File
    nearest_physical: bool = False
    link_spread: Annotated[NonNegative, no_more_than(1.0, "A fraction, not a percentage: 0.05 is 5 %")] = 0.0
    loads: Annotated[tuple[LoadSection, ...], BeforeValidator(array_of_tables)] = ()
    wheels: Annotated[tuple[WheelSection, ...], BeforeValidator(array_of_tables)] = ()

    @field_validator("loads", "wheels")
    @classmethod
    def _distinct_names(cls, named: tuple[LoadSection | WheelSection, ...]) -> tuple[LoadSection | WheelSection, ...]:
        distinct(tuple(section.name for section in named))
        return named


class OrbitSection(Section):
    """Section ``[orbit]``, the orbit about the Earth.

    Parameters
    ----------
    radius : float
        Radius, or semi-major axis if an eccentricity is given [m].
    eccentricity : float, optional
        Eccentricity, in [0, 1).
    inclination : float, optional
        Inclination [rad].
    argument_of_perigee : float, optional
        Argument of perigee [rad].
    sun : (3,), optional
        Unit vector from the Earth to the Sun, node axes: x to the ascending node, z along the orbit normal.
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
            remedy = "Metres, not kilometres? The radius is measured from the Earth's centre; it is not the altitude"
            raise InputError(f"{radius:g} m is inside the Earth", remedy=remedy)
        if radius > HIGHEST_ORBIT:
            raise InputError(f"{radius:g} m is not an orbit about the Earth", remedy="Metres, not millimetres?")
        return radius

    @model_validator(mode="after")
    def _perigee_above_ground(self) -> OrbitSection:
        perigee = self.radius * (1.0 - self.eccentricity)
        if perigee < LOWEST_ORBIT:
            problem = f"the perigee, radius (1 - eccentricity) = {perigee:g} m, is inside the Earth"
            raise InputError(problem, remedy="With an eccentricity, radius is the semi-major axis")
        return self


Probability = Annotated[Number, Field(gt=0.0, lt=1.0)]


class DiagnosisSection(Section):
    """Section ``[diagnosis]``, prior beliefs about causes.

    Parameters
    ----------
    one_more_cause : float
        Prior probability of one more cause, for any number of causes.
    outside_catalogue : float
        Prior probability of a cause that is not in the catalogue.
    bounds : table of label to table of unit to float
        Largest plausible sizes that replace the defaults, by the label of the effect and the unit of its amplitudes.
    """

    one_more_cause: Probability = 0.1
    outside_catalogue: Probability = 0.1
    bounds: Mapping[Name, Mapping[Name, Positive]] = Field(default_factory=dict)
