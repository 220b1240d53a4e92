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
    """Reject a point, rod or plate as the centre of a prior."""
    if not body.parameters.is_extended:
        raise InputError(
            "the body is a point, a rod or a plate, about which no relative prior can be centred",
            place=place,
            remedy="Give it an inertia that fills a volume: I1 + I2 > I3 for its principal moments",
        )


class RecordingSection(Section):
    """Section ``[[recordings]]``, one recording.

    Parameters
    ----------
    file : Path
        CSV or Parquet file, see `bayesid.recording.recording`.
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
    """Section ``[[unknowns.changes]]``, a mass-property change since the posterior that is the prior.

    Parameters
    ----------
    body : str
        Name of the unknown body that changed.
    mass : float
        Mass that was added [kg]; negative for mass that was removed, such as burnt fuel.
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
        from bayesid.robot.mass_property_change import BodyChange

        xx, yy, zz, xy, xz, yz = self.inertia
        tensor = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
        return BodyChange(self.body, self.mass, self.com, tensor, self.mass_sigma)


class UnknownsSection(Section):
    """Section ``[unknowns]``, the bodies to identify and their priors.

    Parameters
    ----------
    bodies : sequence of str
        Links or loads whose ten inertial parameters are estimated; it is empty if only effects are.
    spread : float or table of body to float, optional
        Relative width of the prior in log-Cholesky coordinates, by default 1.
    prior : table of body to BodySection, optional
        Centres of the priors, by default the values of the URDF or of the load.
    posterior : Path, optional
        File ``posterior.nc`` of an earlier study of these bodies, whose posterior is used as prior.
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
        """Return the relative width of one body's prior."""
        return self.spread.get(body, 1.0) if isinstance(self.spread, Mapping) else self.spread


class ModelSection(Section):
    """Section ``[model]``, the contents of the simulation.

    Parameters
    ----------
    effects : sequence of str, optional
        Names of effects in the catalogue, with their place where they need one, such as ``payload:LINK``.
    initial_rate : {"unknown", "zero"}, optional
        Initial rate of each recording, which is estimated or zero.
    initial_rate_sigma : float, optional
        Prior standard deviation of an unknown initial rate, by default that of the model [rad/s].
    plugins : sequence of Path, optional
        Python files of the user that register effects, sensors or criteria of design.
    priors : table of effect to table of key to float, optional
        Prior standard deviations in place of an effect's defaults, in the unit of the key.
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
