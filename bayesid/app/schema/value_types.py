"""Types of the values in a study file, which check range, length and unit."""

from __future__ import annotations

import inspect
import math
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    AllowInfNan,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Strict,
    StringConstraints,
    Tag,
    ValidationInfo,
)

from bayesid._io.errors import InputError

# largest deviation from one of the norm of a unit vector or quaternion, for values rounded to some digits
UNIT_TOLERANCE = 1e-3


def _numbers(value: Any) -> Iterable[float]:
    """Return the numbers in one number, a list of them or a table of them."""
    if isinstance(value, Mapping):
        return value.values()
    return value if isinstance(value, (list, tuple)) else (value,)


def no_more_than(limit: float, remedy: str) -> AfterValidator:
    """Return a validator that rejects magnitudes so large that only a wrong unit explains them.

    Parameters
    ----------
    limit : float
        Largest magnitude.
    remedy : str
        Remedy in the message.
    """

    def check(value: Any) -> Any:
        largest = max(map(abs, _numbers(value)), default=0.0)
        if largest > limit:
            raise InputError(f"{largest:g} is implausibly large, over {limit:g}", remedy=remedy)
        return value

    return AfterValidator(check)


def no_less_than(limit: float, remedy: str) -> AfterValidator:
    """Return a validator that rejects values so small that only a wrong unit explains them.

    Parameters
    ----------
    limit : float
        Smallest value.
    remedy : str
        Remedy in the message.
    """

    def check(value: float) -> float:
        if value < limit:
            raise InputError(f"{value:g} is implausibly small, below {limit:g}", remedy=remedy)
        return value

    return AfterValidator(check)


def list_of(size: int, *, or_number: bool = False) -> BeforeValidator:
    """Return a validator that requires a list of ``size`` numbers, or with ``or_number`` one positive for all.

    Parameters
    ----------
    size : int
        Number of elements.
    or_number : bool
        Whether one positive number may stand for all.
    """

    def check(value: Any) -> Any:
        if or_number and isinstance(value, (int, float)) and not isinstance(value, bool):
            return (value,) * size
        if not isinstance(value, (list, tuple)) or len(value) != size:
            count = f"a list of {len(value)}" if isinstance(value, (list, tuple)) else repr(value)
            raise InputError(
                f"got {count}", remedy=f"Give {'a number or ' if or_number else ''}a list of {size} numbers"
            )
        return value

    # the schema for editors does not see the validator, and has to be told that one number will do
    accepted = Positive | Annotated[list[Positive], Field(min_length=size, max_length=size)]
    return BeforeValidator(check, json_schema_input_type=accepted) if or_number else BeforeValidator(check)


def _unit(value: tuple[float, ...]) -> tuple[float, ...]:
    """Normalise a vector, and reject one whose norm is not nearly one."""
    norm = math.hypot(*value)
    if abs(norm - 1.0) > UNIT_TOLERANCE:
        kind = "quaternion (x, y, z, w)" if len(value) == 4 else "vector"
        raise InputError(f"the norm of {list(value)} is {norm:.6g}, not 1", remedy=f"Give a unit {kind}")
    return tuple(component / norm for component in value)


def distinct(values: tuple[str, ...]) -> tuple[str, ...]:
    """Reject names of which one appears twice."""
    for index, value in enumerate(values):
        if value in values[:index]:
            raise InputError(f"'{value}' appears twice", remedy="Name each once")
    return values


def _resolve(path: Path, info: ValidationInfo) -> Path:
    """Resolve a path relative to the study's folder, not to the folder in which the command runs."""
    if path == Path():
        raise InputError("the path is empty", remedy="Name a file")
    folder = (info.context or {}).get("folder")
    return path if folder is None else Path(os.path.normpath(Path(folder) / path))


def array_of_tables(value: Any) -> Any:
    """Reject a single table where the file may hold several."""
    if isinstance(value, Mapping):
        raise InputError("got a single table", remedy="Write its header in double brackets, [[...]]")
    return value


Number = Annotated[float, Strict(), AllowInfNan(False)]
Positive = Annotated[Number, Field(gt=0.0)]
NonNegative = Annotated[Number, Field(ge=0.0)]
Name = Annotated[str, StringConstraints(min_length=1, strip_whitespace=True)]
Names = Annotated[tuple[Name, ...], AfterValidator(distinct)]
File = Annotated[Path, AfterValidator(_resolve)]
Vector = Annotated[tuple[Number, Number, Number], list_of(3)]
Position = Annotated[Vector, no_more_than(100.0, "Metres, not millimetres?")]
UnitVector = Annotated[Vector, AfterValidator(_unit)]
Quaternion = Annotated[tuple[Number, Number, Number, Number], AfterValidator(_unit), list_of(4)]
PerAxis = Annotated[tuple[Positive, Positive, Positive], list_of(3, or_number=True)]
Decimation = Annotated[int, Strict(), Field(ge=1)]
Table = Mapping[Name, Positive]
PerName = Annotated[
    Annotated[Positive, Tag("number")] | Annotated[Table, Tag("table")],
    # without the discriminator both branches would report an error about the same value
    Discriminator(lambda value: "table" if isinstance(value, Mapping) else "number"),
]

PerComponent = Annotated[
    Annotated[Positive, Tag("number")] | Annotated[tuple[Positive, ...], Tag("list")],
    Discriminator(lambda value: "list" if isinstance(value, (list, tuple)) else "number"),
]


def _several(value: Any) -> Any:
    """Return one number as a tuple of it."""
    return (value,) if isinstance(value, (int, float)) and not isinstance(value, bool) else value


# one number or a list of them
Numbers = Annotated[tuple[Number, ...], BeforeValidator(_several, json_schema_input_type=Number | list[Number])]

# validator of angles, which are at most one turn [rad]
FULL_TURN = no_more_than(2.0 * math.pi, "Radians, not degrees?")
# validator of the noise of angles, which no sensor exceeds [rad]
ANGLE_SIGMA = no_more_than(0.1, "Radians, not arcsec or degrees?")


class Section(BaseModel):
    """Table of the study file; unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    @classmethod
    def key_names(cls) -> tuple[str, ...]:
        """Return the keys of the table, its own before those that it shares with others."""
        names = dict.fromkeys(key for part in cls.__mro__ for key in inspect.get_annotations(part))
        return tuple(name for name in names if name in cls.model_fields)
