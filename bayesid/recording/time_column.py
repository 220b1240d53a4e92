"""Times of a recording's rows: seconds from its start, or what certainly means them.

Calendar times and durations are read, since their meaning is certain. Numbers are seconds; numbers that can only be
milliseconds, microseconds, nanoseconds or counts since 1970 are refused by their unit.
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.recording.convention import Convention, ConventionError, in_one_line

__all__ = ["calendar_seconds", "refuse_other_units", "typed_seconds"]

SLOWEST = 30.0  # median time between rows above which no motion of a robot is followed [s]
UNITS = {"milliseconds": ("ms", 1e3), "microseconds": ("us", 1e6), "nanoseconds": ("ns", 1e9)}
EPOCH = 5e8, 5e9  # range of the seconds since 1970 from 1985 to 2128 [s]


def calendar_seconds(cells: Sequence[str]) -> Floats | None:
    """Return seconds from the first of calendar times in ISO 8601, shape (T,), or None where they are none."""
    try:
        times = [datetime.fromisoformat(cell) for cell in cells]
    except ValueError:
        return None
    aware = [time if time.tzinfo else time.replace(tzinfo=UTC) for time in times]
    return np.array([(time - aware[0]).total_seconds() for time in aware])


def typed_seconds(column: Any, file: Path) -> Floats | None:
    """Return seconds of a column of Parquet that holds timestamps, counted from the first, or durations.

    Parameters
    ----------
    column : pyarrow.ChunkedArray
    file : Path
        Named in errors.

    Returns
    -------
    (T,) array or None
        None for a column of another type.
    """
    import pyarrow as pa

    kind = column.type
    if not (pa.types.is_timestamp(kind) or pa.types.is_duration(kind)):
        return None
    if column.null_count:
        row = int(np.argmax(column.is_null().to_numpy()))
        raise InputError("the time is missing", file=file, place=f"row {row + 1}", remedy="Give every row a time")
    counts = column.cast(pa.int64()).to_numpy()
    origin = counts[0] if pa.types.is_timestamp(kind) else 0
    return np.asarray((counts - origin) / {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}[kind.unit])


def refuse_other_units(time: Floats, file: Path | str) -> None:
    """Refuse times that cannot be seconds from the start of a recording.

    Parameters
    ----------
    time : (T,) array
        Increasing times as given.
    file : path or str
        Named in the error.

    Raises
    ------
    InputError
        If they are counts since 1970, or their rows so far apart that they must be in a smaller unit.
    """
    first, interval = float(time[0]), float(np.median(np.diff(time)))
    for name, (unit, scale) in {"seconds": ("s", 1.0), **UNITS}.items():
        if EPOCH[0] <= first / scale <= EPOCH[1]:
            raise _in_unit(
                f"the first time, {first:.15g}, is a count of {name} since 1970",
                "Give seconds from the start of the recording: subtract the first time"
                + (f" and divide by {scale:g}" if scale > 1.0 else ""),
                file,
                unit,
            )
    if interval <= SLOWEST:
        return
    name, (unit, scale) = next(
        ((name, scale) for name, scale in UNITS.items() if interval / scale[1] < SLOWEST), ("another unit", ("", 1.0))
    )
    raise _in_unit(
        f"the median interval between rows is {interval:g} s, too long to follow a motion; in {name} it would be "
        f"{interval / scale:g} s",
        f"Give seconds: divide the times by {scale:g}" if scale > 1.0 else "Give seconds",
        file,
        unit,
    )


def _in_unit(problem: str, remedy: str, file: Path | str, unit: str) -> InputError:
    place = "column 'time'"
    if not unit:
        return InputError(problem, file=file, place=place, remedy=remedy)
    line = f'[telemetry]\ntime_unit = "{unit}"'
    convention = Convention("convention:unit:time", "time", line, f"{problem[0].upper()}{problem[1:]}.")
    stated = f"{remedy}, or state it: {in_one_line(line)}"
    return ConventionError([convention], problem, file=file, place=place, remedy=stated)
