"""Sections of a study file on how its telemetry was recorded, as far as that differs from the format."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from bayesid._io.errors import InputError
from bayesid.app.schema.value_types import FULL_TURN, Name, NonNegative, Number, Positive, Section, no_more_than

__all__ = ["JointSection", "TelemetrySection"]


class JointSection(Section):
    """Section ``[joints.JOINT]``, a joint whose recorded values differ in sign, zero, unit or column.

    Its position is ``sign * scale * reading + offset``.

    Parameters
    ----------
    sign : {1, -1}, optional
        -1 for a joint with the opposite sign.
    offset : float, optional
        Offset added to its position [rad or m].
    scale : float, optional
        Factor of its position, velocity and acceleration, such as 0.001 for millimetres.
    column : str, optional
        Column ``position.OTHER`` that contains its position; its other readings are then also in the columns of OTHER.
    latency : float, optional
        Delay of its time stamps, negative if they are early; replaces the value of the encoders [s].
    """

    sign: Annotated[int, Field(ge=-1, le=1)] = 1
    offset: Annotated[Number, FULL_TURN] = 0.0
    scale: Positive = 1.0
    column: Name | None = None
    latency: Number = 0.0

    @model_validator(mode="after")
    def _check(self) -> JointSection:
        if self.sign == 0:
            raise InputError("got 0", place="sign", remedy="Give 1 or -1")
        if self.column is not None and not self.column.startswith("position."):
            raise InputError(f"got '{self.column}'", place="column", remedy='Give a column "position.JOINT"')
        return self


class TelemetrySection(Section):
    """Section ``[telemetry]``, the times of all recordings and the use of their samples.

    Parameters
    ----------
    time_unit : {"s", "ms", "us", "ns", "min"}, optional
        Unit of the times; if given, times counted from an earlier epoch, such as 1970, are shifted to the start.
    blocks_per_second : float
        Minimum number of averaging blocks per second; sensors with less than twice this rate
        are not averaged, and 0 disables averaging [1/s].
    """

    time_unit: Literal["s", "ms", "us", "ns", "min"] | None = None
    blocks_per_second: Annotated[NonNegative, no_more_than(1e5, "Blocks per second, not a duration?")] = 10.0
