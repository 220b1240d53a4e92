"""Studies: the TOML file that says what was recorded, with which sensors, and what is to be found out.

A study is data only: typed, immutable, checked when it is loaded. SI units, radians, quaternions x, y, z, w. Each class
is a table of the file and each of its fields a key, so that an unknown key is an error. Tables within (joint to number)
are plain mappings and not to be changed.
"""

from __future__ import annotations

import difflib
import math
import os
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import (
    AfterValidator,
    AllowInfNan,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PrivateAttr,
    Strict,
    StringConstraints,
    Tag,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)
from pydantic_core import ErrorDetails

from bayesid.errors import InputError
from bayesid.inertia import InertialParameters
from bayesid.sensors import ARCSEC, AngleRandomWalk, Noise, NoiseDensity, StarTracker, White

__all__ = [
    "AccelSensor",
    "AttitudeSensor",
    "BodySection",
    "DesignLimits",
    "DesignSection",
    "EncoderSensor",
    "LoadSection",
    "ModelSection",
    "OrbitSection",
    "RateSensor",
    "RecordingSection",
    "RobotSection",
    "SensorsSection",
    "Study",
    "UnknownsSection",
]

LOWEST_ORBIT = 6.3e6
"""Radii below this are inside the Earth [m]."""

HIGHEST_ORBIT = 1.5e9
"""Radii above this are outside the Earth's sphere of influence [m]."""

UNIT_TOLERANCE = 1e-3
"""How far the norm of a unit vector or quaternion may be from one before it is taken for an error."""


# --- values ---------------------------------------------------------------------------------------------------------


def _no_more_than(limit: float, remedy: str) -> AfterValidator:
    """Reject magnitudes that only a wrong unit explains."""

    def check(value: Any) -> Any:
        largest = max(np.abs(list(value.values()) if isinstance(value, Mapping) else value).flat, default=0.0)
        if largest > limit:
            raise InputError(f"{largest:g} is implausibly large, over {limit:g}", remedy=remedy)
        return value

    return AfterValidator(check)


def _no_less_than(limit: float, remedy: str) -> AfterValidator:
    """Reject values so small that only a wrong unit explains them."""

    def check(value: float) -> float:
        if value < limit:
            raise InputError(f"{value:g} is implausibly small, below {limit:g}", remedy=remedy)
        return value

    return AfterValidator(check)


def _list_of(size: int, *, or_number: bool = False) -> BeforeValidator:
    """Require a list of ``size``; with ``or_number``, one number stands for all."""

    def check(value: Any) -> Any:
        if or_number and isinstance(value, (int, float)) and not isinstance(value, bool):
            return (value,) * size
        if not isinstance(value, (list, tuple)) or len(value) != size:
            count = f"a list of {len(value)}" if isinstance(value, (list, tuple)) else repr(value)
            raise InputError(
                f"got {count}", remedy=f"Give {'a number or ' if or_number else ''}a list of {size} numbers"
            )
        return value

    return BeforeValidator(check)


def _unit(value: tuple[float, ...]) -> tuple[float, ...]:
    """Normalise; an error where the norm is not one."""
    norm = math.hypot(*value)
    if abs(norm - 1.0) > UNIT_TOLERANCE:
        kind = "quaternion (x, y, z, w)" if len(value) == 4 else "vector"
        raise InputError(f"the norm of {list(value)} is {norm:.6g}, not 1", remedy=f"Give a unit {kind}")
    return tuple(component / norm for component in value)


def _distinct(values: tuple[str, ...]) -> tuple[str, ...]:
    for index, value in enumerate(values):
        if value in values[:index]:
            raise InputError(f"'{value}' appears twice", remedy="Name each once")
    return values


def _resolve(path: Path, info: ValidationInfo) -> Path:
    """Make a path relative to the study's folder, not to where the command runs."""
    if path == Path():
        raise InputError("the path is empty", remedy="Name a file")
    folder = (info.context or {}).get("folder")
    return path if folder is None else Path(os.path.normpath(Path(folder) / path))


def _array_of_tables(value: Any) -> Any:
    if isinstance(value, Mapping):
        raise InputError("got a single table", remedy="Write its header in double brackets, [[...]]")
    return value


Number = Annotated[float, Strict(), AllowInfNan(False)]
Positive = Annotated[Number, Field(gt=0.0)]
NonNegative = Annotated[Number, Field(ge=0.0)]
Name = Annotated[str, StringConstraints(min_length=1, strip_whitespace=True)]
Names = Annotated[tuple[Name, ...], AfterValidator(_distinct)]
File = Annotated[Path, AfterValidator(_resolve)]
Vector = Annotated[tuple[Number, Number, Number], _list_of(3)]
Position = Annotated[Vector, _no_more_than(100.0, "Metres, not millimetres?")]
UnitVector = Annotated[Vector, AfterValidator(_unit)]
Quaternion = Annotated[tuple[Number, Number, Number, Number], AfterValidator(_unit), _list_of(4)]
PerAxis = Annotated[tuple[Positive, Positive, Positive], _list_of(3, or_number=True)]
Decimation = Annotated[int, Strict(), Field(ge=1)]
Table = Mapping[Name, Positive]
PerName = Annotated[
    Annotated[Positive, Tag("number")] | Annotated[Table, Tag("table")],
    # without it both branches would complain about the same value
    Discriminator(lambda value: "table" if isinstance(value, Mapping) else "number"),
]

_FULL_TURN = _no_more_than(2.0 * math.pi, "Radians, not degrees?")
_ANGLE_SIGMA = _no_more_than(0.1, "Radians, not arcsec or degrees?")


class _Section(BaseModel):
    """A table of the study file."""

    model_config = ConfigDict(extra="forbid", frozen=True)


# --- robot and orbit ------------------------------------------------------------------------------------------------


class BodySection(_Section):
    """Inertial parameters of a rigid body, in its link's axes.

    Parameters
    ----------
    mass : float
        [kg]
    com : (3,)
        Centre of mass [m].
    inertia : (6,)
        About the centre of mass, xx yy zz xy xz yz [kg m2].
    """

    mass: Positive
    com: Position
    inertia: Annotated[tuple[Number, Number, Number, Number, Number, Number], _list_of(6)]

    @model_validator(mode="after")
    def _check_physical(self) -> BodySection:
        _ = self.parameters
        return self

    @property
    def parameters(self) -> InertialParameters:
        """The same as `InertialParameters`, whose triangle inequality and the like have been checked."""
        xx, yy, zz, xy, xz, yz = self.inertia
        return InertialParameters(self.mass, self.com, [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


class LoadSection(BodySection):
    """A rigid body fixed on a link and not in the URDF, ``[[robot.loads]]``.

    Parameters
    ----------
    name, link : str
        Its own name, and the link's that carries it; for the rest see `BodySection`.
    """

    name: Name
    link: Name


class RobotSection(_Section):
    """The robot, ``[robot]``.

    Parameters
    ----------
    urdf : Path
        The root link is the base body.
    link_spread : float, optional
        Relative uncertainty of all links that are not unknowns; 0 = known exactly.
    loads : sequence of LoadSection, optional
        Bodies on links.
    """

    urdf: File
    link_spread: Annotated[NonNegative, _no_more_than(1.0, "A fraction, not a percentage: 0.05 is 5 %")] = 0.0
    loads: Annotated[tuple[LoadSection, ...], BeforeValidator(_array_of_tables)] = ()

    @field_validator("loads")
    @classmethod
    def _distinct_names(cls, loads: tuple[LoadSection, ...]) -> tuple[LoadSection, ...]:
        _distinct(tuple(load.name for load in loads))
        return loads


class OrbitSection(_Section):
    """The orbit about the Earth, ``[orbit]``.

    Parameters
    ----------
    radius : float
        [m]; the semi-major axis if there is an eccentricity.
    eccentricity : float, optional
        In [0, 1).
    inclination : float, optional
        [rad]
    argument_of_perigee : float, optional
        [rad]
    sun : (3,), optional
        Unit vector to the Sun, Earth-centred: node, along-orbit, normal.
    """

    radius: Number
    eccentricity: Annotated[Number, Field(ge=0.0, lt=1.0)] = 0.0
    inclination: Annotated[NonNegative, _no_more_than(math.pi, "Radians, not degrees?")] | None = None
    argument_of_perigee: Annotated[Number, _FULL_TURN] = 0.0
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


# --- sensors --------------------------------------------------------------------------------------------------------


def _exactly_one(section: BaseModel, keys: Sequence[str]) -> None:
    given = [key for key in keys if getattr(section, key) is not None]
    if len(given) != 1:
        problem = f"{' and '.join(given)} are given together" if given else "the noise is not given"
        raise InputError(problem, remedy=f"Give exactly one of {', '.join(keys)}")


class RateSensor(_Section):
    """Angular velocity of the base, ``[sensors.rate]``. Exactly one of the first three keys says how noisy it is.

    Parameters
    ----------
    sigma : float or (3,)
        White noise per sample [rad/s].
    angle_random_walk : float
        From a gyro's data sheet [rad/sqrt(s)]; per sample it is divided by the square root of the sample interval.
        1 deg/sqrt(h) is 2.909e-4 rad/sqrt(s).
    attitude_arcsec : float
        Accuracy per sample [arcsec] of a star sensor whose attitude was differenced to give the rate: two samples
        enter, so that sigma is sqrt(2) times the angle over the sample interval.
    mounting : (4,), optional
        Quaternion, sensor to base axes.
    bias_sigma : float or (3,), optional
        Prior standard deviation of a constant bias [rad/s]; left out, the model has none.
    low_pass, decimate : optional
        Filter cut-off [Hz], and every how many samples one is kept; both apply to samples and prediction alike.
    """

    sigma: Annotated[PerAxis, _no_more_than(0.1, "rad/s, not arcsec/s or degrees/s?")] | None = None
    angle_random_walk: (
        Annotated[Positive, _no_more_than(0.01, "rad/sqrt(s), not deg/sqrt(h)? Multiply that by 2.909e-4")] | None
    ) = None
    attitude_arcsec: (
        Annotated[Positive, _no_less_than(1e-3, "arcsec, not rad?"), _no_more_than(36000.0, "Is it in arcsec?")] | None
    ) = None
    mounting: Quaternion = (0.0, 0.0, 0.0, 1.0)
    bias_sigma: PerAxis | None = None
    low_pass: Positive | None = None
    decimate: Decimation = 1

    @model_validator(mode="after")
    def _check_noise(self) -> RateSensor:
        _exactly_one(self, ("sigma", "angle_random_walk", "attitude_arcsec"))
        return self

    @property
    def noise(self) -> Noise:
        """Noise of the recorded samples, before any filter."""
        if self.sigma is not None:
            return White(self.sigma)
        if self.angle_random_walk is not None:
            return AngleRandomWalk(self.angle_random_walk)
        return StarTracker(self.attitude_arcsec or math.nan)


class AccelSensor(_Section):
    """Non-gravitational acceleration at one point of the base, ``[sensors.accel]``. Give one of the first two keys.

    Parameters
    ----------
    sigma : float or (3,)
        White noise per sample [m/s2].
    noise_density : float
        From a data sheet, one-sided [m/s2/sqrt(Hz)]; per sample it is multiplied by the square root of the Nyquist
        frequency. 1 micro-g/sqrt(Hz) is 9.80665e-6 m/s2/sqrt(Hz).
    position : (3,)
        Base axes, from the base origin [m].
    mounting : (4,), optional
        Quaternion, sensor to base axes.
    bias_sigma : float or (3,), optional
        Prior standard deviation of a constant bias [m/s2]; left out, the model has none.
    low_pass, decimate : optional
        Filter cut-off [Hz], and every how many samples one is kept; both apply to samples and prediction alike.
    """

    sigma: Annotated[PerAxis, _no_more_than(1.0, "m/s2, not milli-g or micro-g?")] | None = None
    noise_density: (
        Annotated[Positive, _no_more_than(0.1, "m/s2/sqrt(Hz), not micro-g/sqrt(Hz)? Multiply that by 9.80665e-6")]
        | None
    ) = None
    position: Position
    mounting: Quaternion = (0.0, 0.0, 0.0, 1.0)
    bias_sigma: PerAxis | None = None
    low_pass: Positive | None = None
    decimate: Decimation = 1

    @model_validator(mode="after")
    def _check_noise(self) -> AccelSensor:
        _exactly_one(self, ("sigma", "noise_density"))
        return self

    @property
    def noise(self) -> Noise:
        """Noise of the recorded samples, before any filter."""
        return White(self.sigma) if self.sigma is not None else NoiseDensity(self.noise_density or math.nan)


class AttitudeSensor(_Section):
    """Star sensor, base to orbit axes, ``[sensors.attitude]``. Exactly one of the first two keys is given.

    Parameters
    ----------
    sigma : float or (3,)
        White noise per sample, a small rotation in base axes [rad].
    arcsec : float
        The same in seconds of arc.
    low_pass, decimate : optional
        Filter cut-off [Hz], and every how many samples one is kept; both apply to samples and prediction alike.
    """

    sigma: Annotated[PerAxis, _ANGLE_SIGMA] | None = None
    arcsec: (
        Annotated[Positive, _no_less_than(1e-3, "arcsec, not rad?"), _no_more_than(36000.0, "Is it in arcsec?")] | None
    ) = None
    low_pass: Positive | None = None
    decimate: Decimation = 1

    @model_validator(mode="after")
    def _check_noise(self) -> AttitudeSensor:
        _exactly_one(self, ("sigma", "arcsec"))
        return self

    @property
    def noise(self) -> Noise:
        """Noise of the recorded samples, before any filter."""
        return White(self.sigma if self.sigma is not None else (self.arcsec or math.nan) * ARCSEC)


class EncoderSensor(_Section):
    """Joint measurements, ``[sensors.encoder]``. A noise left out is estimated from the data.

    Parameters
    ----------
    sigma, velocity_sigma, acceleration_sigma : float or table of joint to float, optional
        White noise per sample of position [rad, or m for prismatic], velocity and acceleration.
    """

    sigma: Annotated[PerName, _ANGLE_SIGMA] | None = None
    velocity_sigma: Annotated[PerName, _no_more_than(1.0, "rad/s, not degrees/s?")] | None = None
    acceleration_sigma: PerName | None = None

    def sigma_of(self, family: Literal["position", "velocity", "acceleration"], joint: str) -> float | None:
        """Noise per sample of one joint's position, velocity or acceleration; None where it is to be estimated."""
        given = {
            "position": self.sigma,
            "velocity": self.velocity_sigma,
            "acceleration": self.acceleration_sigma,
        }[family]
        return given.get(joint) if isinstance(given, Mapping) else given


class SensorsSection(_Section):
    """The sensors, ``[sensors]``; of rate, accel and attitude at least one.

    Parameters
    ----------
    rate, accel, attitude : optional
        Sensors of the base; one that is left out is not used, even if it was recorded.
    encoder : EncoderSensor
        Sensors of the joints.
    """

    rate: RateSensor | None = None
    accel: AccelSensor | None = None
    attitude: AttitudeSensor | None = None
    encoder: EncoderSensor = EncoderSensor()

    @model_validator(mode="after")
    def _check_information(self) -> SensorsSection:
        if self.rate is None and self.accel is None and self.attitude is None:
            raise InputError(
                "no sensor of the base is declared",
                remedy="Add at least one of [sensors.rate], [sensors.accel], [sensors.attitude]",
            )
        if self.rate is not None and self.rate.attitude_arcsec is not None and self.attitude is not None:
            raise InputError(
                "a rate differenced from the attitude (rate.attitude_arcsec) is not a second sensor",
                remedy="Declare either [sensors.rate] or [sensors.attitude]",
            )
        return self


# --- recordings, unknowns, model, design ----------------------------------------------------------------------------


class RecordingSection(_Section):
    """One recording, ``[[recordings]]``.

    Parameters
    ----------
    file : Path
        CSV or Parquet, see `bayesid.recording`.
    attitude : (4,)
        Quaternion, base to orbit axes at time 0.
    attitude_sigma : float, optional
        Its uncertainty [rad]; 0 = exact.
    argument_of_latitude : float, optional
        At time 0 [rad]; needed by effects that know where they are on the orbit.
    start : table of joint to float, optional
        Position at time 0 [rad or m] of joints recorded by speed alone; a joint left out starts from its zero.
    """

    file: File
    attitude: Quaternion
    attitude_sigma: Annotated[NonNegative, _no_more_than(math.pi, "Radians, not arcsec or degrees?")] = 0.0
    argument_of_latitude: Annotated[Number, _FULL_TURN] | None = None
    start: Mapping[Name, Number] = Field(default_factory=dict)


class UnknownsSection(_Section):
    """What is to be identified, ``[unknowns]``.

    Parameters
    ----------
    bodies : sequence of str
        Links or loads whose ten inertial parameters are estimated; may be empty if only effects are.
    spread : float or table of body to float, optional
        Relative width of the prior in log-Cholesky coordinates; 1 for a body that the table leaves out.
    prior : table of body to BodySection, optional
        Centre of the prior where it is not the URDF's or the load's values.
    """

    bodies: Names
    spread: Annotated[PerName, _no_more_than(10.0, "A fraction, not a percentage: 0.05 is 5 %")] = 1.0
    prior: Mapping[Name, BodySection] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _check_bodies(self) -> UnknownsSection:
        tables = {"spread": self.spread if isinstance(self.spread, Mapping) else {}, "prior": self.prior}
        for key, table in tables.items():
            for body in table:
                if body not in self.bodies:
                    raise InputError(
                        f"'{body}' is not among unknowns.bodies",
                        place=key,
                        remedy=_suggest(body, self.bodies) or "Add it there or remove it here",
                    )
        for body, section in self.prior.items():
            _check_extended(section, place=f"prior.{body}")
        return self

    def spread_of(self, body: str) -> float:
        """Relative width of one body's prior."""
        return self.spread.get(body, 1.0) if isinstance(self.spread, Mapping) else self.spread


class ModelSection(_Section):
    """What the simulation contains, ``[model]``.

    Parameters
    ----------
    effects : sequence of str, optional
        Names of the catalogue; ``payload:LINK`` and the like say where.
    initial_rate : {"unknown", "zero"}, optional
        Whether each recording's initial rate is estimated.
    initial_rate_sigma : float, optional
        Prior standard deviation of an unknown initial rate [rad/s]; left out, the default of the model applies.
    plugins : sequence of Path, optional
        Python files with effects of one's own.
    priors : table of effect to table of key to float, optional
        Prior standard deviations that replace an effect's own, in the unit of the key.
    """

    effects: Names = ()
    initial_rate: Literal["unknown", "zero"] = "unknown"
    initial_rate_sigma: Annotated[Positive, _no_more_than(100.0, "Is it in rad/s?")] | None = None
    plugins: tuple[File, ...] = ()
    priors: Mapping[Name, Table] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _check_initial_rate(self) -> ModelSection:
        if self.initial_rate == "zero" and self.initial_rate_sigma is not None:
            raise InputError(
                "initial_rate_sigma contradicts initial_rate = 'zero'",
                remedy="Remove it, or set initial_rate = 'unknown'",
            )
        return self


class DesignLimits(_Section):
    """What a designed manoeuvre must respect, ``[design.limits]``; a limit left out does not apply.

    Parameters
    ----------
    tip_speed, tip_rate : float, optional
        [m/s], [rad/s]
    joint_speed : float, optional
        [rad/s or m/s]
    base_rotation : float, optional
        [rad]
    quiet_band : (2,), optional
        Frequencies between which the motion must not excite anything [Hz].
    """

    tip_speed: Positive | None = None
    tip_rate: Positive | None = None
    joint_speed: Positive | None = None
    base_rotation: Annotated[Positive, _FULL_TURN] | None = None
    quiet_band: Annotated[tuple[NonNegative, Positive], _list_of(2)] | None = None

    @field_validator("quiet_band")
    @classmethod
    def _ascending(cls, band: tuple[float, float] | None) -> tuple[float, float] | None:
        if band is not None and band[0] >= band[1]:
            raise InputError(f"{list(band)} does not ascend", remedy="Give the lower frequency first")
        return band


class DesignSection(_Section):
    """The manoeuvre to design, ``[design]``.

    Parameters
    ----------
    duration : float, optional
        [s]
    tip_frame : str, optional
        The frame of the URDF whose motion is limited.
    joints : sequence of str, optional
        Joints that move.
    limits : DesignLimits
        What the manoeuvre must respect.
    """

    duration: Positive | None = None
    tip_frame: Name | None = None
    joints: Names | None = None
    limits: DesignLimits = DesignLimits()


# --- the study ------------------------------------------------------------------------------------------------------


class Study(_Section):
    """A study file.

    Parameters
    ----------
    title : str, optional
        The file's stem if left out.
    robot, sensors, unknowns : sections
        Required.
    orbit : OrbitSection or None
        None away from orbit; then no environment effect applies.
    recordings : sequence of RecordingSection
        May be empty for commands that only design.
    model : ModelSection
        Optional.
    design : DesignSection or None
        Optional.
    """

    title: str = ""
    robot: RobotSection
    orbit: OrbitSection | None = None
    sensors: SensorsSection
    recordings: Annotated[tuple[RecordingSection, ...], BeforeValidator(_array_of_tables)] = ()
    unknowns: UnknownsSection
    model: ModelSection = ModelSection()
    design: DesignSection | None = None
    # not a key of the file
    _file: Path | None = PrivateAttr(default=None)

    @classmethod
    def load(cls, path: str | Path) -> Study:
        """Read and check a study file; its paths come out relative to the file's folder.

        Raises
        ------
        InputError
            If the file is absent, is no TOML, or breaks a rule; the message names the key, the value and the remedy.
        """
        file = Path(path)
        if not file.is_file():
            raise InputError("there is no such file", file=file, remedy="Give the path of a study, a TOML file")
        try:
            data = tomllib.loads(file.read_text(encoding="utf-8"))
        except UnicodeDecodeError as error:
            raise InputError(f"not a text file: {error}", file=file, remedy="Save it as UTF-8 text") from error
        except tomllib.TOMLDecodeError as error:
            raise _syntax_error(error, file) from error
        return cls.from_mapping({"title": file.stem} | data, file)

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any], file: Path | None = None) -> Study:
        """Check the content of a study file, already parsed; without a file its paths are left as they are."""
        try:
            study = cls.model_validate(data, context={"folder": None if file is None else file.parent})
        except ValidationError as error:
            raise _explain(error, data, cls).within(file=file) from error
        study._file = file
        return study

    @property
    def file(self) -> Path | None:
        """The file it was loaded from."""
        return self._file

    @model_validator(mode="after")
    def _check_whole(self) -> Study:
        files = [recording.file for recording in self.recordings]
        for index, file in enumerate(files):
            if file in files[:index]:
                raise InputError(
                    f"'{file.name}' is listed twice",
                    place=f"recordings #{index + 1}.file",
                    remedy="Remove one: the same data would count twice",
                )
        for index, load in enumerate(self.robot.loads, start=1):
            if load.name in self.unknowns.bodies and load.name not in self.unknowns.prior:
                _check_extended(load, place=f"robot.loads #{index} ('{load.name}')")
        return self


# --- errors ---------------------------------------------------------------------------------------------------------


_WANTED = {
    "model_type": "a table",
    "dict_type": "a table",
    "mapping_type": "a table",
    "tuple_type": "a list",
    "float_type": "a number",
    "int_type": "a whole number",
    "string_type": "text in quotes",
    "path_type": "a path in quotes",
    "string_too_short": "a name",
}
"""What to give instead, by pydantic's type of error; for the others its own message serves."""


def _check_extended(body: BodySection, place: str) -> None:
    if not body.parameters.is_extended:
        raise InputError(
            "the body is a point, a rod or a plate, about which no relative prior can be centred",
            place=place,
            remedy="Give it an inertia that fills a volume: I1 + I2 > I3 for its principal moments",
        )


def _suggest(name: str, known: Sequence[str]) -> str | None:
    near = difflib.get_close_matches(name, known, n=1)
    return f"Did you mean '{near[0]}'?" if near else None


def _syntax_error(error: tomllib.TOMLDecodeError, file: Path) -> InputError:
    """Return the parser's complaint with the line as the place."""
    text = str(error)
    found = re.search(r"\s*\(at (line \d+, column \d+|end of document)\)", text)
    place = found.group(1) if found else None
    problem = text.replace(found.group(0), "") if found else text
    return InputError(f"not valid TOML: {problem}", file=file, place=place, remedy="Correct the syntax there")


def _explain(error: ValidationError, data: Mapping[str, Any], study: type[BaseModel]) -> InputError:
    """Return the first error in the user's terms, and the number of the others.

    A misspelt key comes first: it is usually why another one is missing.
    """
    faults = sorted(error.errors(include_url=False), key=lambda fault: fault["type"] != "extra_forbidden")
    first = _one_error(faults[0], data, study)
    # one number that stands for three axes is one error
    others = len({_path_of(fault, data) for fault in faults}) - 1
    if not others:
        return first
    remedy = f"{first.remedy or ''} ({others} more error{'s' if others > 1 else ''} in this file)".lstrip()
    return InputError(first.problem, place=first.place, remedy=remedy)


def _path_of(fault: ErrorDetails, data: Any) -> tuple[str | int, ...]:
    """Return the part of pydantic's location that is in the file: it names union branches and "[key]" as well."""
    path: list[str | int] = []
    last = len(fault["loc"]) - 1
    for position, part in enumerate(fault["loc"]):
        is_key = isinstance(data, Mapping) and part in data
        is_entry = isinstance(data, list) and isinstance(part, int) and part < len(data)
        if is_key or is_entry:
            data = data[part]
            path.append(part)
        elif fault["type"] == "missing" and position == last:
            path.append(part)
    return tuple(path)


def _one_error(fault: ErrorDetails, data: Mapping[str, Any], study: type[BaseModel]) -> InputError:
    kind = fault["type"]
    path = _path_of(fault, data)
    place = _place(path)
    if kind == "extra_forbidden":
        known = tuple(_table_at(study, path[:-1]).model_fields)
        remedy = f"{_suggest(str(path[-1]), known) or ''} Allowed: {', '.join(known)}".lstrip()
        return InputError(f"unknown key '{path[-1]}'", place=place, remedy=remedy)
    if kind == "missing":
        is_section = _section_in(_table_at(study, path[:-1]).model_fields[str(path[-1])].annotation) is not None
        problem, remedy = ("section", f"Add [{place}]") if is_section else ("key", f"Add {path[-1]} = ...")
        return InputError(f"the {problem} is missing", place=place, remedy=remedy)
    cause = fault.get("ctx", {}).get("error")
    if isinstance(cause, InputError):
        within = ".".join(part for part in (place, cause.place) if part)
        return InputError(cause.problem, place=within or None, remedy=cause.remedy)
    wanted = fault["msg"].removeprefix("Input should be ")
    if kind.startswith(("greater_than", "less_than")):
        wanted = f"a value {wanted}"
    return InputError(f"got {fault['input']!r}", place=place, remedy=f"Give {_WANTED.get(kind, wanted)}")


def _place(path: Sequence[str | int]) -> str:
    """Write a path as a reader counts: entries of lists from 1."""
    text = ""
    for part in path:
        text += f" #{part + 1}" if isinstance(part, int) else f".{part}" if text else part
    return text


def _table_at(section: type[BaseModel], path: Sequence[str | int]) -> type[BaseModel]:
    """Return the class of the table at a path, below the class of another table."""
    for part in path:
        if isinstance(part, str) and part in section.model_fields:
            section = _section_in(section.model_fields[part].annotation) or section
    return section


def _section_in(annotation: Any) -> type[BaseModel] | None:
    """Return the section class in an annotation such as ``tuple[LoadSection, ...]`` or ``OrbitSection | None``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next(filter(None, map(_section_in, get_args(annotation))), None)
