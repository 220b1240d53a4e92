"""Sections of a study file on the manoeuvre to design."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, Strict, field_validator, model_validator

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

FEWEST_SAMPLES = 16
"""Of a manoeuvre; fewer do not determine a motion."""

CriterionName = Literal[
    "paper-26",
    "paper-26-intended",
    "condition-number",
    "d-optimal",
    "a-optimal",
    "e-optimal",
    "information-gain",
    "separation",
]

USUAL: tuple[CriterionName, ...] = (
    "paper-26",
    "condition-number",
    "d-optimal",
    "a-optimal",
    "e-optimal",
    "information-gain",
)
"""Criteria where a study names none."""


class DesignLimits(Section):
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
    base_rotation: Annotated[Positive, FULL_TURN] | None = None
    quiet_band: Annotated[tuple[NonNegative, Positive], list_of(2)] | None = None

    @field_validator("quiet_band")
    @classmethod
    def _ascending(cls, band: tuple[float, float] | None) -> tuple[float, float] | None:
        if band is not None and band[0] >= band[1]:
            raise InputError(f"{list(band)} does not ascend", remedy="Give the lower frequency first")
        return band


class DesignSection(Section):
    """The manoeuvre to design, ``[design]``.

    Parameters
    ----------
    duration : float, optional
        [s]
    tip_frame : str, optional
        The frame of the URDF whose motion is limited; the last link where left out.
    joints : sequence of str, optional
        Joints that move; all where left out.
    limits : DesignLimits
        What the manoeuvre must respect.
    interval : float, optional
        Between samples of all sensors [s].
    start : table of joint to float, optional
        Position before and after [rad or m]; where left out zero, or the end of the joint's range nearest to it.
    parameterisation : {"b-splines", "fourier", "paper"}, optional
        Family of joint motions.
    functions : int, optional
        Free functions of every joint, 8 where left out; the paper's family has none.
    criteria : sequence of str, optional
        What to design by, one manoeuvre each.
    rivals : sequence of str, optional
        Labels of effects to tell apart, for the criterion "separation".
    attitude : (4,), optional
        Quaternion, base to orbit axes at time 0.
    attitude_sigma : float, optional
        Its uncertainty [rad]; 0 = exact.
    argument_of_latitude : float, optional
        At time 0 [rad].
    """

    duration: Positive = 120.0
    tip_frame: Name | None = None
    joints: Names | None = None
    limits: DesignLimits = DesignLimits()
    interval: Positive = 0.5
    start: Mapping[Name, Number] = Field(default_factory=dict)
    parameterisation: Literal["b-splines", "fourier", "paper"] = "b-splines"
    functions: Annotated[int, Strict(), Field(ge=1, le=60)] | None = None
    criteria: Annotated[tuple[CriterionName, ...], Field(min_length=1), AfterValidator(distinct)] | None = None
    rivals: Names = ()
    attitude: Quaternion = (0.0, 0.0, 0.0, 1.0)
    attitude_sigma: Annotated[NonNegative, no_more_than(math.pi, "Radians, not arcsec or degrees?")] = 0.0
    argument_of_latitude: Annotated[Number, FULL_TURN] = 0.0

    @property
    def chosen_criteria(self) -> tuple[str, ...]:
        """The criteria, those of `USUAL` where none is named; with rivals also their separation."""
        return self.criteria or (*USUAL, *(("separation",) if self.rivals else ()))

    @model_validator(mode="after")
    def _check_samples(self) -> DesignSection:
        if self.duration < FEWEST_SAMPLES * self.interval:
            raise InputError(
                f"{self.duration:g} s hold fewer than {FEWEST_SAMPLES} samples at intervals of {self.interval:g} s",
                place="interval",
                remedy="Sample faster or allow more time",
            )
        return self

    @model_validator(mode="after")
    def _check_functions(self) -> DesignSection:
        if self.functions is not None and self.parameterisation == "paper":
            raise InputError(
                "the paper's (27) has two parameters per joint and no free functions",
                place="functions",
                remedy="Remove it, or choose another parameterisation",
            )
        if self.functions is not None and self.parameterisation == "fourier" and self.functions % 2:
            raise InputError(
                f"{self.functions} is odd; a Fourier series has sines and cosines",
                place="functions",
                remedy="Give an even number",
            )
        return self

    @model_validator(mode="after")
    def _check_rivals(self) -> DesignSection:
        wanted = "separation" in (self.criteria or ())
        if len(self.rivals) < 2 and (self.rivals or wanted):
            raise InputError(
                f"{len(self.rivals)} effects to tell apart",
                place="rivals",
                remedy="Name at least two, or neither rivals nor separation",
            )
        return self
