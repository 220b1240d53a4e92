"""Sections of a study file on recordings, unknowns and the model."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import BeforeValidator, Field, model_validator

from bayesid._io.errors import InputError
from bayesid.app.schema.robot_section import BodySection
from bayesid.app.schema.validation_messages import suggest
from bayesid.app.schema.value_types import (
    FULL_TURN,
    File,
    Name,
    Names,
    NonNegative,
    Number,
    PerName,
    Position,
    Positive,
    Quaternion,
    Section,
    Table,
    array_of_tables,
    list_of,
    no_more_than,
)

if TYPE_CHECKING:
    from bayesid.robot.mass_property_change import BodyChange


def check_extended(body: BodySection, place: str) -> None:
    """Reject a body without extent as the centre of a prior."""
    if not body.parameters.is_extended:
        raise InputError(
            "the body is a point, a rod or a plate, about which no relative prior can be centred",
            place=place,
            remedy="Give it an inertia that fills a volume: I1 + I2 > I3 for its principal moments",
        )


class RecordingSection(Section):
    """One recording, ``[[recordings]]``.

    Parameters
    ----------
    file : Path
        CSV or Parquet, see `bayesid.recording.recording`.
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
    attitude_sigma: Annotated[NonNegative, no_more_than(math.pi, "Radians, not arcsec or degrees?")] = 0.0
    argument_of_latitude: Annotated[Number, FULL_TURN] | None = None
    start: Mapping[Name, Number] = Field(default_factory=dict)


class ChangeSection(Section):
    """What was added to a body, or taken from it, since the posterior that is its prior, ``[[unknowns.changes]]``.

    Parameters
    ----------
    body : str
        One of the unknown bodies.
    mass : float
        [kg]; negative if it was taken away, as fuel that was burnt.
    mass_sigma : float, optional
        Its standard deviation [kg].
    com : (3,)
        Its centre of mass in the body's axes [m].
    inertia : (6,), optional
        About its own centre of mass, xx yy zz xy xz yz [kg m2]; a point mass where left out.
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
        """The same as `BodyChange`, which has checked it."""
        from bayesid.robot.mass_property_change import BodyChange

        xx, yy, zz, xy, xz, yz = self.inertia
        tensor = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
        return BodyChange(self.body, self.mass, self.com, tensor, self.mass_sigma)


class UnknownsSection(Section):
    """What is to be identified, ``[unknowns]``.

    Parameters
    ----------
    bodies : sequence of str
        Links or loads whose ten inertial parameters are estimated; may be empty if only effects are.
    spread : float or table of body to float, optional
        Relative width of the prior in log-Cholesky coordinates; 1 for a body that the table leaves out.
    prior : table of body to BodySection, optional
        Centre of the prior where it is not the URDF's or the load's values.
    posterior : Path, optional
        The ``posterior.nc`` of an earlier study of these bodies, which is then their prior.
    changes : sequence of ChangeSection, optional
        What was added to them or taken from them since.
    """

    bodies: Names
    spread: Annotated[PerName, no_more_than(10.0, "A fraction, not a percentage: 0.05 is 5 %")] = 1.0
    prior: Mapping[Name, BodySection] = Field(default_factory=dict)
    posterior: File | None = None
    changes: Annotated[tuple[ChangeSection, ...], BeforeValidator(array_of_tables)] = ()

    @model_validator(mode="after")
    def _check_posterior(self) -> UnknownsSection:
        if self.posterior is None and self.changes:
            raise InputError("there is no posterior that they could change", place="changes", remedy="Give posterior")
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
                    raise InputError(
                        f"'{body}' is not among unknowns.bodies",
                        place=key,
                        remedy=suggest(body, self.bodies) or "Add it there or remove it here",
                    )
        for body, section in self.prior.items():
            check_extended(section, place=f"prior.{body}")
        return self

    def spread_of(self, body: str) -> float:
        """Relative width of one body's prior."""
        return self.spread.get(body, 1.0) if isinstance(self.spread, Mapping) else self.spread


class ModelSection(Section):
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
    initial_rate_sigma: Annotated[Positive, no_more_than(100.0, "Is it in rad/s?")] | None = None
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
