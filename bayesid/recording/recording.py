"""Recordings of measured data in CSV or Parquet files, checked completely when they are made.

A file has one row per time stamp and one column per channel, in SI units. An empty cell (a null in Parquet) means that
the channel was not sampled at that time; in memory it is NaN. Every rule below is checked when a `Recording` is made,
from a file as from arrays, so that a `Recording` that exists is valid.
"""

from __future__ import annotations

import csv
import difflib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bayesid._io.errors import InputError
from bayesid._io.files import complete_file
from bayesid._io.short_form import ShortForm, Summary
from bayesid._math.arrays import Floats
from bayesid.recording.convention import Convention, ConventionError
from bayesid.recording.recorded_as import RecordedAs
from bayesid.recording.time_column import calendar_seconds, refuse_other_units, typed_seconds

__all__ = ["JOINT_FAMILIES", "VECTOR_FAMILIES", "WHEEL_SPEED", "Recording", "declare_family"]

Array = Floats

MINIMUM_ROWS = 8  # number of rows below which a motion is not determined
ABSURD = 1e9  # size above which no sample can be a measurement in SI units
LARGE = (
    4e6  # size of a text file above which it is read at once, as columns of plain numbers, if it is nothing else [B]
)
NORM_TOLERANCE = 1e-3  # deviation of a quaternion's norm from one above which it is taken for an error


@dataclass(frozen=True, eq=False, repr=False)
class Recording(ShortForm):
    """Measured data of one manoeuvre, with T time stamps.

    Parameters
    ----------
    name : str
        Name in reports; the stem of the file, if there is one.
    file : Path or None
        File that was read, None for a recording made of arrays.
    time : (T,) array_like
        Time stamps, strictly increasing from the start of the recording at 0 [s].
    channels : mapping of str to (T,) array_like
        Samples by the name of their column, NaN where a channel has no sample. Arrays are copied and locked
        read-only; attitude quaternions are normalised.
    recorded_as : RecordedAs, optional
        Conventions from which they were converted, by default those of the format.

    Raises
    ------
    InputError
        If a rule of the file format is violated; the message names the file, the column, the line and the value.
    """

    name: str
    file: Path | None
    time: Array
    channels: Mapping[str, Array]
    recorded_as: RecordedAs = field(default_factory=RecordedAs)

    def summary(self) -> Summary:
        """Return number and duration of the samples, and the columns."""
        samples = f"{self.name}: {len(self.time)} samples over {self.time[-1]:.4g} s"
        return Summary([f"{samples} of {', '.join(self.channels)}."])

    def __post_init__(self) -> None:
        channels = {column: np.array(values, dtype=float) for column, values in self.channels.items()}
        object.__setattr__(self, "time", _locked(self.time))
        object.__setattr__(self, "channels", MappingProxyType(channels))
        _check_names(("time", *channels), self.file or self.name)
        self._check_shapes()
        self._check_time()
        self._check_samples()
        self._normalise_attitude(channels)
        for values in channels.values():
            values.setflags(write=False)

    def __reduce__(self) -> tuple[type[Recording], tuple[str, Path | None, Array, dict[str, Array], RecordedAs]]:
        # a mapping proxy does not pickle, and unpickled arrays would be writable
        return Recording, (self.name, self.file, self.time, dict(self.channels), self.recorded_as)

    @classmethod
    def read(cls, path: str | Path, recorded_as: RecordedAs | None = None) -> Recording:
        """Read and check a ``.csv`` or ``.parquet`` file.

        Parameters
        ----------
        path : path
        recorded_as : RecordedAs, optional
            Conventions of the file that differ from the format.

        Raises
        ------
        InputError
            If the file is absent, malformed or breaks a rule of the format.
        """
        file = Path(path)
        reader = {".csv": _read_csv, ".parquet": _read_parquet}.get(file.suffix.lower())
        if not file.is_file():
            raise InputError("there is no such file", file=file, remedy="Correct the path of the recording")
        if reader is None:
            raise InputError(f"a recording cannot be a {file.suffix!r} file", file=file, remedy=_FORMATS)
        columns = reader(file)
        if recorded_as is not None:
            columns = recorded_as.converted(columns)
        return cls(file.stem, file, columns.pop("time"), columns, recorded_as or RecordedAs())

    def converted(self, recorded_as: RecordedAs) -> Recording:
        """Return the recording in the conventions of the format, if it was recorded with other conventions."""
        columns = recorded_as.converted({"time": self.time, **self.channels})
        return Recording(self.name, self.file, columns.pop("time"), columns, self.recorded_as)

    def write(self, path: str | Path) -> None:
        """Write a ``.csv`` (12 significant digits) or ``.parquet`` (exact) file, whole or not at all."""
        file = Path(path)
        writer = {".csv": _write_csv, ".parquet": _write_parquet}.get(file.suffix.lower())
        if writer is None:
            raise InputError(f"a recording cannot be a {file.suffix!r} file", file=file, remedy=_FORMATS)
        if not file.parent.is_dir():
            raise InputError(f"there is no folder {file.parent}", file=file, remedy="Create it first")
        with complete_file(file) as part:
            writer(part, {"time": self.time, **self.channels})

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints whose position, velocity or acceleration is recorded, in the order of the columns."""
        names = (column.partition(".") for column in self.channels)
        return tuple(dict.fromkeys(joint for family, _, joint in names if family in JOINT_FAMILIES[:3]))

    @property
    def wheels(self) -> tuple[str, ...]:
        """Wheels whose speed is recorded, in the order of the columns."""
        names = (column.partition(".") for column in self.channels)
        return tuple(wheel for family, _, wheel in names if family == WHEEL_SPEED)

    def series(self, name: str) -> tuple[Array, Array]:
        """Return the samples of one channel without the missing ones.

        Parameters
        ----------
        name : str
            Column, for example ``"position.joint1"``.

        Returns
        -------
        times, values : (n,) arrays
            Times [s] and samples in the unit of the channel.
        """
        times, values = self._select((name,))
        return times, values[:, 0]

    def vector(self, family: str, axes: Sequence[str] = ("x", "y", "z")) -> tuple[Array, Array]:
        """Return the samples of several columns of one family without the missing ones.

        Parameters
        ----------
        family : str
            First part of the columns' names, for example ``"rate"``, or ``"position"`` with joints as the axes.
        axes : sequence of str
            Second parts of the columns' names, k of them.

        Returns
        -------
        times : (n,) array
            Times [s]
        values : (n, k) array
            Samples in the unit of the family.

        Raises
        ------
        InputError
            If a column is absent, or a sample lacks some of the axes.
        """
        return self._select(tuple(f"{family}.{axis}" for axis in axes))

    def interval(self, name: str) -> float:
        """Return the median time between the samples of one channel [s]."""
        times, _ = self.series(name)
        if len(times) < 2:
            problem = "one sample has no sample interval"
            remedy = "Record more samples"
            raise InputError(problem, file=self.file or self.name, place=f"column '{name}'", remedy=remedy)
        return float(np.median(np.diff(times)))

    def _select(self, names: tuple[str, ...]) -> tuple[Array, Array]:
        for name in names:
            if name not in self.channels:
                remedy = f"Columns here: {', '.join(self.channels)}"
                raise InputError(f"there is no column '{name}'", file=self.file or self.name, remedy=remedy)
        values = np.stack([self.channels[name] for name in names], axis=1)
        missing = np.isnan(values)
        partial = missing.any(axis=1) & ~missing.all(axis=1)
        if partial.any():
            row = int(np.argmax(partial))
            absent = [name for name, gone in zip(names, missing[row], strict=True) if gone]
            problem = f"the sample is incomplete: {', '.join(absent)} empty, but the other axes are not"
            raise self._error(problem, columns=names, row=row, remedy="Fill or empty all axes of a sample")
        present = ~missing.all(axis=1)
        return self.time[present], values[present]

    def _error(self, problem: str, *, columns: Sequence[str], row: int | None = None, remedy: str) -> InputError:
        place = f"column{'s' if len(columns) > 1 else ''} {', '.join(repr(column) for column in columns)}"
        if row is not None:
            place = f"{place}, {_row(self.file, row)}"
        return InputError(problem, file=self.file or self.name, place=place, remedy=remedy)

    def _check_shapes(self) -> None:
        if self.time.ndim != 1 or len(self.time) < MINIMUM_ROWS:
            rows = f"{len(self.time)} rows" if self.time.ndim == 1 else f"time of shape {self.time.shape}"
            problem = f"{rows}; at least {MINIMUM_ROWS} rows are needed"
            raise InputError(problem, file=self.file or self.name, remedy="Record for longer or at a higher rate")
        for column, values in self.channels.items():
            if values.shape != self.time.shape:
                raise self._error(
                    f"shape {values.shape} differs from that of time, {self.time.shape}",
                    columns=[column],
                    remedy="Give one sample per time stamp, NaN where there is none",
                )

    def _check_time(self) -> None:
        time, column = self.time, ["time"]
        if not np.isfinite(time).all():
            row = int(np.argmin(np.isfinite(time)))
            raise self._error(
                "the time is missing or not finite", columns=column, row=row, remedy="Give every row a time"
            )
        if time[0] < 0.0:
            raise self._error(
                f"time {time[0]:.12g} s is negative", columns=column, row=0, remedy="0 is the start of the recording"
            )
        falls = np.diff(time) <= 0.0
        if falls.any():
            row = int(np.argmax(falls)) + 1
            fault = "repeats" if time[row] == time[row - 1] else "is earlier than"
            problem = f"time {time[row]:.12g} s {fault} {time[row - 1]:.12g} s of {_row(self.file, row - 1)}"
            remedy = "Time must strictly increase; sort the rows and merge those with the same time"
            raise self._error(problem, columns=column, row=row, remedy=remedy)
        refuse_other_units(time, self.file or self.name)
        # such a clock was hardly reset: nothing is known of the motion between 0 and the first row
        if time[0] > time[-1] - time[0]:
            raise self._error(
                f"the first time, {time[0]:.12g} s, exceeds the length of the recording ({time[-1] - time[0]:.6g} s)",
                columns=column,
                row=0,
                remedy="0 is the start of the recording; subtract the first time",
            )

    def _check_samples(self) -> None:
        for column, values in self.channels.items():
            if np.isinf(values).any():
                row = int(np.argmax(np.isinf(values)))
                raise self._error("the value is infinite", columns=[column], row=row, remedy=_NO_SAMPLE)
            absurd = np.abs(values) > ABSURD
            if absurd.any():
                row = int(np.argmax(absurd))
                problem = f"{values[row]:g} is implausibly large, over {ABSURD:g}"
                raise self._error(problem, columns=[column], row=row, remedy=_NO_SAMPLE)
            if np.isnan(values).all():
                raise self._error("the column has no samples", columns=[column], remedy="Remove the column or fill it")
            family, _, joint = column.partition(".")
            measured = f"position.{joint}" in self.channels or f"velocity.{joint}" in self.channels
            if family in ("acceleration", "torque") and not measured:
                remedy = f"Add position.{joint} or velocity.{joint}"
                raise self._error(f"joint '{joint}' has neither position nor velocity", columns=[column], remedy=remedy)
        if self.wheels and "wheel_momentum.x" in self.channels:
            raise self._error(
                "the wheels are recorded twice, by their speeds and by their momentum",
                columns=["wheel_momentum.x", f"{WHEEL_SPEED}.{self.wheels[0]}"],
                remedy="Use the speeds and describe each wheel under [[robot.wheels]], or use the momentum only",
            )
        for family, axes in VECTOR_FAMILIES.items():
            columns = [f"{family}.{axis}" for axis in axes]
            absent = [column for column in columns if column not in self.channels]
            if len(absent) == len(columns):
                continue
            if absent:
                raise InputError(
                    f"column {', '.join(repr(column) for column in absent)} is missing",
                    file=self.file or self.name,
                    remedy=f"Give all of {', '.join(columns)} or none",
                )
            self.vector(family, axes)

    def _normalise_attitude(self, channels: dict[str, Array]) -> None:
        columns = [f"attitude.{axis}" for axis in VECTOR_FAMILIES["attitude"]]
        if columns[0] not in channels:
            return
        norm = np.linalg.norm([channels[column] for column in columns], axis=0)
        off = np.abs(norm - 1.0) > NORM_TOLERANCE
        if off.any():
            row = int(np.argmax(off))
            if len(set(sample := [float(channels[column][row]) for column in columns])) == 1:
                line = f"[sensors.attitude]\nmissing = {sample[0]:g}"
                text = f"Missing attitudes contain the fill value {sample[0]:g}."
                convention = Convention("convention:fill:attitude", "attitude", line, text)
                raise ConventionError([convention], file=self.file or self.name, place=f"column '{columns[0]}'")
            problem = f"the quaternion's norm is {norm[row]:.6g}, not 1"
            raise self._error(problem, columns=columns, row=row, remedy="Give unit quaternions in the order x, y, z, w")
        for column in columns:
            channels[column] /= norm


_FORMATS = "Use .csv or .parquet"
_NO_SAMPLE = "Use an empty cell where there is no sample"
_DECIMAL = "Write numbers with a decimal point, and use an empty cell where there is no sample"
_TIMES = "Give times as numbers, in seconds from 0, or as calendar times like 2030-05-01T12:00:00.250Z"
_ONE_HEADER = "Start the samples in the second line: a row of units or a second header is not supported"


def _locked(values: ArrayLike) -> Array:
    array = np.array(values, dtype=float)
    array.setflags(write=False)
    return array


def _row(file: Path | None, row: int) -> str:
    """Return the place of a row, counted from 0, as the user counts it: a line of a CSV file, or a row from 1."""
    is_text = file is not None and file.suffix.lower() == ".csv"
    return f"line {row + 2}" if is_text else f"row {row + 1}"


def _is_known(column: str) -> bool:
    family, _, rest = column.partition(".")
    if family in (*JOINT_FAMILIES, WHEEL_SPEED):
        return bool(rest)
    return column == "time" or rest in VECTOR_FAMILIES.get(family, ())


def _nearest(column: str) -> str:
    """Return the remedy for an unknown column: the nearest known name, or all families where none is near."""
    family, _, rest = column.partition(".")
    vectors = [f"{name}.{axis}" for name, axes in VECTOR_FAMILIES.items() for axis in axes]
    near = difflib.get_close_matches(column.lower(), ["time", *vectors], n=1, cutoff=0.7)
    if not near and rest in JOINT_FAMILIES:
        near = [f"{rest}.{family}"]
    if not near and rest:
        near = [f"{name}.{rest}" for name in difflib.get_close_matches(family.lower(), JOINT_FAMILIES, n=1, cutoff=0.5)]
    if near:
        return f"Did you mean '{near[0]}'?"
    families = ["time", *(f"{name}.<joint>" for name in JOINT_FAMILIES), f"{WHEEL_SPEED}.<wheel>"]
    families += [f"{name}.{'|'.join(axes)}" for name, axes in VECTOR_FAMILIES.items()]
    return f"Remove or rename the column. Known ones: {', '.join(families)}"


def _check_names(columns: Sequence[str], file: Path | str) -> None:
    """Raise if a column is unnamed, duplicate or unknown, or time is missing."""
    for number, column in enumerate(columns, start=1):
        if not column:
            raise InputError(
                f"column {number} has no name", file=file, remedy="Name it, or remove a comma at the end of the lines"
            )
        if column in columns[: number - 1]:
            problem = f"the column appears twice, as columns {columns.index(column) + 1} and {number}"
            raise InputError(problem, file=file, place=f"column '{column}'", remedy="Remove one")
        if not _is_known(column):
            remedy = (
                "Separate the columns by commas, and write decimal points"
                if {";", "\t"} & set(column)
                else _nearest(column)
            )
            raise InputError(f"unknown column '{column}'", file=file, remedy=remedy)
    if "time" not in columns:
        raise InputError("column 'time' is missing", file=file, remedy="Add the time in seconds, 0 at the start")


def _read_csv(file: Path) -> dict[str, Array]:
    if file.stat().st_size > LARGE and (plain := _read_plain_csv(file)) is not None:
        return plain
    try:
        with file.open(newline="", encoding="utf-8-sig") as stream:
            rows = list(csv.reader(stream, strict=True))
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(
            f"not a CSV file: {error}", file=file, remedy="Save it as comma-separated UTF-8 text"
        ) from error
    while rows and not rows[-1]:
        rows.pop()
    if not rows:
        raise InputError("the file is empty", file=file, remedy="Write a header line and one row per time stamp")
    header = [name.strip() for name in rows.pop(0)]
    _check_names(header, file)
    _check_rows(len(rows), file)
    for index, row in enumerate(rows):
        if len(row) != len(header):
            problem = f"{len(row)} cells, but the header has {len(header)} columns"
            remedy = "Give one cell per column, empty where there is no sample"
            raise InputError(problem, file=file, place=_row(file, index), remedy=remedy)
    columns = {name: [row[index].strip() for row in rows] for index, name in enumerate(header)}
    calendar = calendar_seconds(columns["time"]) if not np.isfinite(_parse(columns["time"][0])) else None
    return {
        name: calendar if name == "time" and calendar is not None else _numbers(cells, name, file, _parse, missing="")
        for name, cells in columns.items()
    }


def _read_plain_csv(file: Path) -> dict[str, Array] | None:
    """Return the columns of a file of nothing but finite numbers and empty cells, None where anything else is there."""
    import pyarrow as pa  # here, as sensors import this module and small files need none
    from pyarrow import csv as plain

    try:
        with file.open(encoding="utf-8-sig") as stream:
            header = [name.strip() for name in next(csv.reader(stream, strict=True), [])]
        table = plain.read_csv(
            file,
            plain.ReadOptions(column_names=header, skip_rows=1),
            plain.ParseOptions(ignore_empty_lines=False),
            plain.ConvertOptions(column_types=dict.fromkeys(header, pa.float64()), null_values=[""]),
        )
    except (UnicodeDecodeError, csv.Error, pa.ArrowException, OSError):
        return None  # read cell by cell, it says where and why
    if not table.num_rows:
        return None
    _check_names(header, file)
    columns = {name: _plain_numbers(column) for name, column in zip(header, table.columns, strict=True)}
    clear = all(values is not None for values in columns.values()) and not table["time"].null_count
    return {name: values for name, values in columns.items() if values is not None} if clear else None


def _plain_numbers(column: Any) -> Array | None:
    """Return a column of an Arrow table as floating-point numbers, NaN where null; None where one is not finite."""
    values = np.array(column.cast("float64", safe=False).to_numpy(), dtype=float)
    return values if int(np.isfinite(values).sum()) == len(values) - column.null_count else None


def _read_parquet(file: Path) -> dict[str, Array]:
    import pyarrow as pa  # here, as sensors import this module and CSV needs none
    import pyarrow.parquet as pq

    try:
        # not pq.read_table, which fails obscurely on duplicate columns
        with pq.ParquetFile(file) as source:
            table = source.read()
    except (pa.ArrowException, OSError) as error:
        raise InputError(f"not a Parquet file: {error}", file=file, remedy="Write the file again") from error
    _check_names(table.column_names, file)
    _check_rows(table.num_rows, file)
    columns = dict(zip(table.column_names, table.columns, strict=True))
    times = typed_seconds(columns["time"], file)
    if times is None and pa.types.is_string(columns["time"].type) and not columns["time"].null_count:
        times = calendar_seconds(columns["time"].to_pylist())
    return {
        name: times if name == "time" and times is not None else _typed(column, name, file)
        for name, column in columns.items()
    }


def _typed(column: Any, name: str, file: Path) -> Array:
    """Return the numbers of a column of Parquet, and refuse one of another type."""
    import pyarrow as pa

    kind = column.type
    if pa.types.is_decimal(kind):
        column = column.cast(pa.float64())
    elif not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_null(kind)):
        raise InputError(
            f"its type is {kind}, not a number",
            file=file,
            place=f"column '{name}'",
            remedy=_TIMES if name == "time" else "Write it as floating-point numbers in SI units, null for no sample",
        )
    plain = None if name == "time" and column.null_count else _plain_numbers(column)
    return _numbers(column.to_pylist(), name, file, _number, missing=None) if plain is None else plain


def _check_rows(rows: int, file: Path) -> None:
    if rows == 0:
        raise InputError("the file has a header and no rows", file=file, remedy="Write one row per time stamp")


def _parse(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return math.nan


def _number(cell: object) -> float:
    return float(cell) if isinstance(cell, (int, float)) and not isinstance(cell, bool) else math.nan


def _numbers(cells: Sequence[object], column: str, file: Path, convert: Callable[..., float], missing: object) -> Array:
    """Return the cells of one column as numbers, NaN where missing; raise where a cell is not a finite number."""
    absent = np.array([cell == missing for cell in cells])
    values = np.array([convert(cell) for cell in cells])
    bad = ~np.isfinite(values) & ~absent
    if column == "time":
        bad |= absent
    if bad.any():
        row = int(np.argmax(bad))
        problem = "the time is missing" if absent[row] else f"{cells[row]!r} is not a finite number"
        if column == "time":
            remedy = f"{_TIMES}. {_ONE_HEADER}" if row == 0 and not absent[row] else "Give every row a time"
        else:
            remedy = _NO_SAMPLE if str(cells[row]).lower().strip("+-") in ("nan", "inf", "infinity") else _DECIMAL
        raise InputError(problem, file=file, place=f"column '{column}', {_row(file, row)}", remedy=remedy)
    return values


def _write_csv(file: Path, columns: Mapping[str, Array]) -> None:
    with file.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        for row in zip(*columns.values(), strict=True):
            writer.writerow(["" if math.isnan(value) else f"{value:.12g}" for value in row])


def _write_parquet(file: Path, columns: Mapping[str, Array]) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.table({name: pa.array(values, from_pandas=True) for name, values in columns.items()}), file)


JOINT_FAMILIES = ("position", "velocity", "acceleration", "torque")
"""Families with one column per joint, such as ``position.<joint>`` [rad, m]; torques are in N m, forces in N."""

WHEEL_SPEED = "wheel_speed"
"""Family with one column per wheel, ``wheel_speed.<wheel>`` [rad/s]."""

_VECTOR_FAMILIES = {
    "rate": ("x", "y", "z"),
    "accel": ("x", "y", "z"),
    "attitude": ("x", "y", "z", "w"),
    "base_force": ("x", "y", "z"),
    "base_torque": ("x", "y", "z"),
    "wheel_momentum": ("x", "y", "z"),
}
VECTOR_FAMILIES: Mapping[str, tuple[str, ...]] = MappingProxyType(_VECTOR_FAMILIES)
"""Families with one column per axis, all of them or none: [rad/s], [m/s2], [1], [N], [N m], [N m s]."""


def declare_family(name: str, axes: tuple[str, ...]) -> None:
    """Make columns ``name.axis`` known to recordings, for a sensor that the package lacks.

    Parameters
    ----------
    name : str
    axes : tuple of str
        Names of the columns after the dot.

    Raises
    ------
    InputError
        If the name is taken by columns with other axes.
    """
    if name in (*JOINT_FAMILIES, WHEEL_SPEED) or _VECTOR_FAMILIES.get(name, axes) != axes:
        raise InputError(f"columns {name!r} already exist with another meaning", remedy="Give the sensor another name")
    _VECTOR_FAMILIES[name] = axes
