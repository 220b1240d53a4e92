"""Sections of a study file on the manoeuvre to design."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import AfterValidator, Discriminator, Field, Strict, Tag, field_validator, model_validator

from bayesid._io.errors import InputError
from bayesid.app.schema.value_types import (
    FULL_TURN,
    Name,
    Names,
    NonNegative,
    Number,
    Positive,
    Quaternion,
    Section,
    distinct,
    list_of,
    no_more_than,
)

FEWEST_SAMPLES = 16  # smallest number of samples of a manoeuvre, since fewer do not determine a motion


class DesignLimits(Section):
    """Section ``[design.limits]``, the limits of a designed manoeuvre; limits that are not given do not apply.

    Parameters
    ----------
    tip_speed, tip_rate : float, optional
        Largest speed [m/s] and angular rate [rad/s] of the tip frame.
    joint_speed : float, optional
        Largest speed of any joint [rad/s or m/s].
    base_rotation : float, optional
        Largest rotation of the base relative to the start [rad].
    quiet_band : (2,), optional
        Frequency band that may contain at most a thousandth of the power of the base's motion [Hz].
    """

    tip_speed: Positive | None = None
    tip_rate: Positive | None = None
    joint_speed: Positive | None = None
    base_rotation: Annotated[Positive, FULL_TURN] | None = None
    quiet_band: Annotated[tuple[NonNegative, Positive], list_of(2)] | None = None

    @field_validator("quiet_band")
    @classmethod
    def _ascending(cls, band: tuple[float, float] | None) -> tuple[float, float] | None:
        if band is not None and band[0] >= band[1]:
            raise InputError(f"{list(band)} is not ascending", remedy="Give the lower frequency first")
        return band


def _ascending_times(points: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    if not points or any(later[0] <= earlier[0] for earlier, later in pairwise(points)):
        raise InputError("the times are not ascending", remedy="Give pairs [time, speed] in ascending order of time")
    return points


Speed = Annotated[
    Annotated[Number, Tag("number")]
    | Annotated[tuple[tuple[Number, Number], ...], AfterValidator(_ascending_times), Tag("points")],
    Discriminator(lambda value: "points" if isinstance(value, (list, tuple)) else "number"),
]
"""Speed of a wheel [rad/s], or pairs of time [s] and speed."""


class DesignSection(Section):
    """Section ``[design]``, the manoeuvre to design.

    Parameters
    ----------
    duration : float, optional
        Duration of the manoeuvre [s].
    tip_frame : str, optional
        Frame of the URDF whose motion is limited, by default the last link.
    joints : sequence of str, optional
        Names of the joints that move, by default all.
    limits : DesignLimits
        Limits of the manoeuvre.
    interval : float, optional
        Interval between samples of all sensors [s].
    start : table of joint to float, optional
        Positions before and after the manoeuvre, by default zero or the limit of the joint's range nearest to zero
        [rad or m].
    parameterisation : {"b-splines", "fourier", "paper"}, optional
        Family of joint motions.
    functions : int, optional
        Number of free functions per joint, by default 8; the paper's family has none.
    criteria : sequence of str, optional
        Names of the criteria; one manoeuvre is designed per criterion. Plugins may register further criteria.
    options : table of criterion to table, optional
        Parameters of criteria that take any, such as those of a plugin.
    rivals : sequence of str, optional
        Labels of the effects to distinguish, for the criterion "separation".
    wheel_speed : table of wheel to float or list of pairs, optional
        Speed of a wheel during the manoeuvre [rad/s], or pairs of time [s] and speed that are interpolated; by
        default at rest.
    attitude : (4,), optional
        Initial attitude, a quaternion from base to orbit axes.
    attitude_sigma : float, optional
        Standard deviation of the initial attitude per axis [rad], by default 0, which means exact.
    argument_of_latitude : float, optional
        Argument of latitude at time 0 [rad].
    """

    duration: Positive = 120.0
    tip_frame: Name | None = None
    joints: Names | None = None
    limits: DesignLimits = DesignLimits()
    interval: Positive = 0.5
    start: Mapping[Name, Number] = Field(default_factory=dict)
    parameterisation: Literal["b-splines", "fourier", "paper"] = "b-splines"
    functions: Annotated[int, Strict(), Field(ge=1, le=60)] | None = None
    criteria: Annotated[tuple[Name, ...], Field(min_length=1), AfterValidator(distinct)] | None = None
    options: Mapping[Name, Mapping[Name, bool | int | float | str]] = Field(default_factory=dict)
    rivals: Names = ()
    wheel_speed: Mapping[Name, Speed] = Field(default_factory=dict)
    attitude: Quaternion = (0.0, 0.0, 0.0, 1.0)
    attitude_sigma: Annotated[NonNegative, no_more_than(math.pi, "Radians, not arcsec or degrees?")] = 0.0
    argument_of_latitude: Annotated[Number, FULL_TURN] = 0.0

    @model_validator(mode="after")
    def _check_samples(self) -> DesignSection:
        if self.duration < FEWEST_SAMPLES * self.interval:
            raise InputError(
                f"{self.duration:g} s contain fewer than {FEWEST_SAMPLES} samples at intervals of {self.interval:g} s",
                place="interval",
                remedy="Sample faster or increase the duration",
            )
        return self

    @model_validator(mode="after")
    def _check_functions(self) -> DesignSection:
        if self.functions is not None and self.parameterisation == "paper":
            problem = "the paper's (27) has two parameters per joint and no free functions"
            raise InputError(problem, place="functions", remedy="Remove it, or choose another parameterisation")
        if self.functions is not None and self.parameterisation == "fourier" and self.functions % 2:
            problem = f"{self.functions} is odd; a Fourier series has sines and cosines"
            raise InputError(problem, place="functions", remedy="Give an even number")
        return self

    @model_validator(mode="after")
    def _check_rivals(self) -> DesignSection:
        if len(self.rivals) == 1:
            raise InputError("1 effect to distinguish", place="rivals", remedy="Name at least two, or no rivals")
        return self
