"""Recordings: round trips, and one clear error for every way a file can be wrong."""

import pickle
import re
from datetime import datetime, timedelta
from decimal import Decimal
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from bayesid._io.errors import InputError
from bayesid.recording import recording as recording_module
from bayesid.recording.recording import Recording

EXAMPLES = Path(__file__).parents[2] / "shared" / "examples"
ROWS = 10


@pytest.fixture
def channels() -> dict[str, np.ndarray]:
    generator = np.random.default_rng(1)
    quaternions = generator.normal(size=(4, ROWS))
    quaternions /= np.linalg.norm(quaternions, axis=0)
    columns = {f"attitude.{axis}": row for axis, row in zip("xyzw", quaternions, strict=True)}
    columns |= {f"rate.{axis}": 1e-4 * generator.normal(size=ROWS) for axis in "xyz"}
    columns |= {"position.arm.joint1": generator.normal(size=ROWS), "velocity.joint2": generator.normal(size=ROWS)}
    columns["torque.joint2"] = generator.normal(size=ROWS)
    for axis in "xyz":
        columns[f"rate.{axis}"][[2, 5]] = np.nan
    for axis in "xyzw":
        columns[f"attitude.{axis}"][1:] = np.nan
    return columns


@pytest.fixture
def time() -> np.ndarray:
    return 0.1 * np.arange(ROWS)


@pytest.mark.parametrize(("suffix", "tolerance"), [("csv", 1e-11), ("parquet", 1e-15)])
def test_a_round_trip_keeps_samples_and_gaps(tmp_path, time, channels, suffix, tolerance):
    path = tmp_path / f"manoeuvre.{suffix}"
    Recording("memory", None, time, channels).write(path)
    recording = Recording.read(path)
    assert (recording.name, recording.file) == ("manoeuvre", path)
    assert list(recording.channels) == list(channels)
    np.testing.assert_allclose(recording.time, time, rtol=tolerance)
    for name, values in channels.items():
        np.testing.assert_allclose(recording.channels[name], values, rtol=tolerance, atol=1e-18)
    assert [path.name for path in tmp_path.iterdir()] == [path.name]


def test_csv_cells_are_plain_numbers_or_empty(tmp_path, time, channels):
    Recording("memory", None, time, {"position.j": channels["rate.x"]}).write(tmp_path / "r.csv")
    lines = (tmp_path / "r.csv").read_text().splitlines()
    assert lines[0] == "time,position.j"
    assert lines[3] == "0.2,"
    assert float(lines[1].split(",")[1]) == pytest.approx(channels["rate.x"][0], rel=1e-11)


def test_a_failed_write_leaves_the_old_file_and_no_other(tmp_path, time, channels, monkeypatch):
    recording = Recording("memory", None, time, channels)
    path = tmp_path / "r.csv"
    recording.write(path)
    before = path.read_bytes()
    monkeypatch.setattr("csv.writer", lambda *_, **__: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        recording.write(path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_selections_drop_what_is_missing(time, channels):
    recording = Recording("memory", None, time, channels)
    times, values = recording.vector("rate")
    assert values.shape == (ROWS - 2, 3)
    np.testing.assert_array_equal(times, np.delete(time, [2, 5]))
    times, values = recording.vector("attitude", ("x", "y", "z", "w"))
    assert values.shape == (1, 4)
    times, values = recording.series("rate.y")
    assert times.shape == values.shape == (ROWS - 2,)
    assert recording.joints == ("arm.joint1", "joint2")
    assert recording.interval("velocity.joint2") == pytest.approx(0.1)


def test_recordings_are_immutable_copies_and_pickle(time, channels):
    recording = Recording("memory", None, time, channels)
    for copy in (recording, pickle.loads(pickle.dumps(recording))):
        with pytest.raises(ValueError, match="read-only"):
            copy.time[0] = 1.0
        with pytest.raises(ValueError, match="read-only"):
            copy.channels["rate.x"][0] = 1.0
        with pytest.raises(TypeError):
            copy.channels["rate.x"] = time
    time[0] = -1.0
    assert recording.time[0] == 0.0


def test_quaternions_almost_of_norm_one_are_normalised(time):
    near = {f"attitude.{axis}": np.full(ROWS, 0.5 * 1.0005) for axis in "xyzw"}
    np.testing.assert_allclose(Recording("memory", None, time, near).channels["attitude.w"], 0.5, rtol=1e-15)


def test_asking_for_an_absent_column_lists_those_there(time, channels):
    recording = Recording("memory", None, time, channels)
    with pytest.raises(InputError, match=r"memory: there is no column 'accel.x'. Columns here: attitude.x"):
        recording.vector("accel")


def test_joints_sampled_at_different_times_are_no_vector(time):
    uneven = np.where(np.arange(ROWS) == 3, np.nan, 1.0)
    recording = Recording("memory", None, time, {"position.a": np.ones(ROWS), "position.b": uneven})
    with pytest.raises(InputError, match=r"row 4: the sample is incomplete: position.b empty"):
        recording.vector("position", ("a", "b"))


def csv_text(header="time,position.j1,rate.x,rate.y,rate.z", **replaced):
    """Ten rows of a valid file; ``line7="..."`` replaces that line of the file."""
    width = header.count(",")
    lines = [header, *(",".join([f"{0.5 * row:g}", *["0.1"] * width]) for row in range(ROWS))]
    for key, line in replaced.items():
        lines[int(key.removeprefix("line")) - 1] = line
    return "\n".join(lines) + "\n"


QUATERNION = "time,attitude.x,attitude.y,attitude.z,attitude.w"
UNIT = {f"line{2 + row}": f"{row},0.5,0.5,0.5,0.5" for row in range(ROWS)}

WRONG_CSV = {
    "empty": ("", ["the file is empty"]),
    "blank lines only": ("\n\n", ["the file is empty"]),
    "header only": ("time,position.j1\n", ["header and no rows"]),
    "few rows": ("\n".join(csv_text().splitlines()[:8]), ["7 rows; at least 8"]),
    "duplicate": (csv_text("time,rate.x,rate.y,rate.z,rate.x"), ["'rate.x'", "twice", "columns 2 and 5", "Remove one"]),
    "no time": (csv_text("position.j1,position.j2"), ["column 'time' is missing"]),
    "unnamed": (csv_text("time,position.j1,"), ["column 3 has no name"]),
    "misspelt axis": (csv_text("time,rates.x,rate.y,rate.z"), ["unknown column 'rates.x'", "Did you mean 'rate.x'?"]),
    "misspelt time": (csv_text("Time,position.j1"), ["unknown column 'Time'", "Did you mean 'time'?"]),
    "misspelt joint": (csv_text("time,postion.Arm"), ["unknown column 'postion.Arm'", "Did you mean 'position.Arm'?"]),
    "reversed joint": (csv_text("time,j1.velocity"), ["unknown column 'j1.velocity'", "Did you mean 'velocity.j1'?"]),
    "no joint": (csv_text("time,velocity."), ["unknown column 'velocity.'", "velocity.<joint>"]),
    "unlike anything": (
        csv_text("time,comment"),
        ["unknown column 'comment'", "Remove or rename", "rate.x|y|z"],
    ),
    "row of units": (
        csv_text(line2="s,rad,rad/s,rad/s,rad/s"),
        ["line 2", "'s' is not a", "row of units"],
    ),
    "decimal comma": (
        csv_text(line3='0.5,0,"0,01",0,0'),
        ["line 3", "'0,01' is not", "a decimal point"],
    ),
    "semicolons": (csv_text("time;position.j1"), ["unknown column", "Separate the columns by commas"]),
    "axis missing": (csv_text("time,accel.x,accel.z"), ["'accel.y' is missing", "accel.x, accel.y, accel.z"]),
    "w missing": (csv_text("time,attitude.x,attitude.y,attitude.z"), ["column 'attitude.w' is missing"]),
    "nan": (csv_text(line7="2.5,NaN,0,0,0"), ["column 'position.j1', line 7", "'NaN'", "Use an empty cell"]),
    "inf": (csv_text(line3="0.5,0,-inf,0,0"), ["column 'rate.x', line 3", "'-inf' is not a finite number"]),
    "text": (csv_text(line11="4.5,0,0,0,n/a"), ["column 'rate.z', line 11", "'n/a' is not a finite number"]),
    "no time stamp": (csv_text(line4=",0,0,0,0"), ["column 'time', line 4", "the time is missing"]),
    "time is text": (csv_text(line4="1 s,0,0,0,0"), ["column 'time', line 4", "'1 s' is not a finite number"]),
    "repeated": (csv_text(line6="1.5,0,0,0,0"), ["line 6", "time 1.5 s repeats 1.5 s of line 5", "strictly increase"]),
    "backwards": (csv_text(line6="1.2,0,0,0,0"), ["line 6", "time 1.2 s is earlier than 1.5 s of line 5"]),
    "negative": (csv_text(line2="-0.5,0,0,0,0"), ["column 'time', line 2", "-0.5 s is negative"]),
    "late": (
        csv_text("time,position.j1", **{f"line{2 + row}": f"{700 + row},0" for row in range(ROWS)}),
        ["the first time, 700 s", "subtract the first time"],
    ),
    "no samples": (
        csv_text("time,position.j1,position.j2", **{f"line{2 + row}": f"{row},0," for row in range(ROWS)}),
        ["column 'position.j2'", "has no samples"],
    ),
    "partial sample": (csv_text(line5="1.5,0,0,,0"), ["line 5", "incomplete: rate.y empty"]),
    "norm": (csv_text(QUATERNION, **(UNIT | {"line9": "7,0.5,0.5,0.5,0.51"})), ["line 9", "norm is 1.00504, not 1"]),
    "short line": (csv_text(line8="3,0,0"), ["line 8", "3 cells, but the header has 5 columns"]),
    "long line": (csv_text(line8="3,0,0,0,0,0,0"), ["line 8", "7 cells, but the header has 5"]),
    "blank line": (csv_text(line8=""), ["line 8", "0 cells"]),
    "unmeasured joint": (
        csv_text("time,position.j1,torque.j2"),
        ["'torque.j2'", "'j2' has neither position nor velocity", "Add position.j2 or velocity.j2"],
    ),
    "open quote": (csv_text(line8='3,"0,0,0,0'), ["not a CSV file"]),
}


@pytest.mark.parametrize("size", [0, recording_module.LARGE], ids=["large", "small"])
@pytest.mark.parametrize(("text", "fragments"), WRONG_CSV.values(), ids=WRONG_CSV)
def test_a_wrong_csv_is_named_with_place_value_and_remedy(tmp_path, monkeypatch, text, fragments, size):
    monkeypatch.setattr(recording_module, "LARGE", size)
    path = tmp_path / "wrong.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        Recording.read(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert caught.value.remedy
    for fragment in fragments:
        assert fragment in str(caught.value)


def test_a_large_csv_is_read_at_once_to_the_same_numbers(tmp_path, time, channels, monkeypatch):
    path = tmp_path / "large.csv"
    Recording("memory", None, time, channels).write(path)
    cell_by_cell = Recording.read(path)
    monkeypatch.setattr(recording_module, "LARGE", 0)
    monkeypatch.setattr(recording_module, "_numbers", None)  # no cell by itself
    at_once = Recording.read(path)
    np.testing.assert_array_equal(at_once.time, cell_by_cell.time)
    assert list(at_once.channels) == list(cell_by_cell.channels)
    for name, values in cell_by_cell.channels.items():
        np.testing.assert_array_equal(at_once.channels[name], values)


def test_the_unbroken_csv_is_fine(tmp_path):
    path = tmp_path / "right.csv"
    path.write_text(
        "\ufeff" + csv_text().replace(",", " , ").replace("\n", "\r\n") + "\r\n", encoding="utf-8", newline=""
    )
    assert Recording.read(path).vector("rate")[1].shape == (ROWS, 3)


def test_binary_content_is_not_csv(tmp_path):
    path = tmp_path / "wrong.csv"
    path.write_bytes(b"\xff\xfe\x00time")
    with pytest.raises(InputError, match="not a CSV file"):
        Recording.read(path)


@pytest.mark.parametrize("name", ["absent.csv", "absent.parquet"])
def test_an_absent_file(tmp_path, name):
    with pytest.raises(InputError, match="there is no such file"):
        Recording.read(tmp_path / name)


def test_other_formats_and_folders(tmp_path, time, channels):
    (tmp_path / "r.xlsx").touch()
    with pytest.raises(InputError, match=re.escape("'.xlsx' file. Use .csv or .parquet")):
        Recording.read(tmp_path / "r.xlsx")
    recording = Recording("memory", None, time, channels)
    with pytest.raises(InputError, match=re.escape("Use .csv or .parquet")):
        recording.write(tmp_path / "r.txt")
    with pytest.raises(InputError, match="there is no folder"):
        recording.write(tmp_path / "absent" / "r.csv")


TIMES = [0.5 * row for row in range(ROWS)]
ONES = [1.0] * ROWS
WRONG_PARQUET = {
    "duplicate": ([TIMES, ONES, ONES], ["time", "position.a", "position.a"], ["'position.a'", "twice"]),
    "unknown": ([TIMES, ONES], ["time", "acel.x"], ["Did you mean 'accel.x'?"]),
    "text": ([TIMES, ["a"] * ROWS], ["time", "position.a"], ["column 'position.a': its type is string, not a number"]),
    "truth": ([TIMES, [True] * ROWS], ["time", "position.a"], ["its type is bool, not a number"]),
    "clock": (
        [["12:00:00"] * ROWS, ONES],
        ["time", "position.a"],
        ["column 'time': its type is string", "2030-05"],
    ),
    "nan": ([TIMES, [*ONES[1:], np.nan]], ["time", "position.a"], ["column 'position.a', row 10: nan is not a finite"]),
    "no time stamp": ([[None, *TIMES[1:]], ONES], ["time", "position.a"], ["column 'time', row 1", "is missing"]),
    "no samples": ([TIMES, [None] * ROWS], ["time", "position.a"], ["column 'position.a'", "no samples"]),
    "repeated": ([[0.0, *TIMES[:-1]], ONES], ["time", "position.a"], ["row 2", "time 0 s repeats 0 s of row 1"]),
    "header only": ([[], []], ["time", "position.a"], ["header and no rows"]),
}


@pytest.mark.parametrize(("columns", "names", "fragments"), WRONG_PARQUET.values(), ids=WRONG_PARQUET)
def test_a_wrong_parquet_is_named_with_place_value_and_remedy(tmp_path, columns, names, fragments):
    path = tmp_path / "wrong.parquet"
    pq.write_table(pa.table([pa.array(column) for column in columns], names=names), path)
    with pytest.raises(InputError) as caught:
        Recording.read(path)
    assert str(caught.value).startswith(f"{path}: ")
    for fragment in fragments:
        assert fragment in str(caught.value)


MOMENTS = [datetime(2030, 5, 1, 12, 0, 0, 250000) + timedelta(seconds=time) for time in TIMES]
TYPED = {
    "timestamp": pa.array(MOMENTS, pa.timestamp("ns", tz="UTC")),
    "duration": pa.array([round(1e9 * time) for time in TIMES], pa.duration("ns")),
    "decimal": pa.array([Decimal(str(time)) for time in TIMES], pa.decimal128(20, 9)),
    "text": pa.array([moment.isoformat() + "Z" for moment in MOMENTS]),
    "integers": pa.array(range(ROWS), pa.int16()),
}


@pytest.mark.parametrize("kind", TYPED)
def test_times_whose_meaning_is_certain_are_read(tmp_path, kind):
    pq.write_table(pa.table([TYPED[kind], pa.array(ONES)], names=["time", "position.a"]), tmp_path / "t.parquet")
    expected = np.arange(ROWS) if kind == "integers" else TIMES
    np.testing.assert_allclose(Recording.read(tmp_path / "t.parquet").time, expected, atol=1e-12)


def test_calendar_times_of_a_csv_are_counted_from_the_first(tmp_path):
    lines = [f"{moment.isoformat()}+02:00,1" for moment in MOMENTS]
    (tmp_path / "t.csv").write_text("\n".join(["time,position.a", *lines]))
    np.testing.assert_allclose(Recording.read(tmp_path / "t.csv").time, TIMES, atol=1e-12)


@pytest.mark.parametrize(
    ("times", "words"),
    [
        (1e3 * 0.1 * np.arange(ROWS), ("between rows is 100 s", "milliseconds", "divide the times by 1000")),
        (1e6 * 0.1 * np.arange(ROWS), ("between rows is 100000 s", "microseconds", "divide the times by 1e+06")),
        (1e9 * 0.1 * np.arange(ROWS), ("between rows is 1e+08 s", "nanoseconds", "divide the times by 1e+09")),
        (1.7e9 + 0.1 * np.arange(ROWS), ("count of seconds since 1970", "subtract the first time")),
        (1.7e12 + 100.0 * np.arange(ROWS), ("count of milliseconds since 1970", "divide by 1000")),
        (1.7e18 + 1e8 * np.arange(ROWS), ("count of nanoseconds since 1970", "divide by 1e+09")),
    ],
)
def test_times_in_another_unit_are_refused_by_its_name(times, words):
    with pytest.raises(InputError) as caught:
        Recording("flight", None, times, {"position.a": np.ones(ROWS)})
    assert all(word in str(caught.value) for word in ("column 'time'", *words)), caught.value


def test_text_is_not_parquet(tmp_path):
    path = tmp_path / "wrong.parquet"
    path.write_text("time,position.j1\n")
    with pytest.raises(InputError, match="not a Parquet file"):
        Recording.read(path)


def test_integers_and_nulls_of_parquet_are_samples_and_gaps(tmp_path):
    path = tmp_path / "r.parquet"
    pq.write_table(pa.table({"time": list(range(ROWS)), "position.a": [None, *range(1, ROWS)]}), path)
    times, values = Recording.read(path).series("position.a")
    np.testing.assert_array_equal(times, np.arange(1.0, ROWS))
    np.testing.assert_array_equal(values, np.arange(1.0, ROWS))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rate.x": np.ones(3)}, r"column 'rate.x': shape \(3,\) differs from that of time, \(10,\)"),
        ({"rate.x": np.full(ROWS, np.inf)}, r"column 'rate.x', row 1: the value is infinite"),
        ({"time": np.ones(ROWS)}, r"column 'time': the column appears twice"),
    ],
)
def test_arrays_are_checked_like_files(time, channels, change, message):
    with pytest.raises(InputError, match=message):
        Recording("memory", None, time, channels | change)


def test_the_time_of_arrays_is_finite(time, channels):
    time[3] = np.nan
    with pytest.raises(InputError, match="column 'time', row 4: the time is missing or not finite"):
        Recording("memory", None, time, channels)


@pytest.mark.skipif(not EXAMPLES.is_dir(), reason="the worked examples are not beside this checkout")
@pytest.mark.parametrize("case", ["nothing-hidden", "wheel-momentum", "accel-position"])
def test_the_examples_are_read(case):
    paths = sorted((EXAMPLES / case).glob("*.csv"))
    assert len(paths) == 3
    for path in paths:
        recording = Recording.read(path)
        assert recording.joints == ("joint1", "joint2", "joint3")
        assert recording.vector("rate")[1].shape == recording.vector("accel")[1].shape == (len(recording.time), 3)
        assert recording.interval("rate.x") == pytest.approx(0.5)
