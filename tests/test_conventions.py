"""Wrong conventions, hidden in recordings of MuJoCo, are named with a remedy that puts the study right."""

from __future__ import annotations

import json
import re
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest

from bayesid import InputError, Recording, identify
from bayesid._math.divergence import DivergenceError, divergence_named
from bayesid.app.convention_remedies import conventions_of, fixed_study, with_remedies
from bayesid.app.diagnose_command import diagnose_study
from bayesid.app.schema import Study
from bayesid.app.study_to_conventions import imported_as
from bayesid.app.study_to_model import load_manoeuvres, load_model, load_posterior
from bayesid.inference.no_motion import refuse_no_motion
from bayesid.recording.convention import Convention, ConventionError
from bayesid.recording.recorded_as import JointRecordedAs, RecordedAs, SensorRecordedAs
from studies.conventions.mistakes import MISTAKES, Columns, edited
from studies.truth.bodies import SERVICER3
from studies.truth.mujoco import Manoeuvres, write_study
from studies.truth.recordings import Sensors
from tests.pdf_text import PdfText

QUICK = ("gyro forward-right-down",)


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    options = {"manoeuvres": Manoeuvres(count=1, duration=40.0), "sensors": Sensors(attitude_period=2.0)}
    return write_study(folder, SERVICER3, np.random.default_rng(3), **options).file


def spoilt(study: Path, mistake: str, folder: Path) -> Path:
    copy = shutil.copytree(study.parent, folder / "study") / study.name
    MISTAKES[mistake].make(copy)
    return copy


def corrected(file: Path, conventions: list[Convention]) -> Study:
    text = with_remedies(file.read_text(), [convention.remedy for convention in conventions])
    return Study.from_mapping(tomllib.loads(text), file)


def test_a_right_study_has_no_wrong_conventions(study: Path) -> None:
    assert conventions_of(Study.load(study)) == []


@pytest.mark.parametrize(
    "mistake", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in MISTAKES]
)
def test_a_mistake_is_named_and_its_remedy_puts_the_study_right(mistake: str, study: Path, tmp_path: Path) -> None:
    file = spoilt(study, mistake, tmp_path)
    found = conventions_of(Study.load(file))
    # the first of each channel: another that comes as near, such as cm/s2 for milli-g, may stand behind it
    conventions = list({(one.name, one.channel): one for one in reversed(found)}.values())[::-1]
    assert sorted(convention.name for convention in conventions) == sorted(MISTAKES[mistake].names)
    again = corrected(file, conventions)
    assert conventions_of(again) == []
    right, mended = (_in_base_axes(either) for either in (Study.load(study), again))
    for column, values in right.items():
        there = np.isfinite(mended[column]) & np.isfinite(values)
        error = np.abs(mended[column] - values)[there].max()
        assert error < MISTAKES[mistake].error * (np.nanstd(values) + 1e-3), column


def _in_base_axes(study: Study) -> dict[str, np.ndarray]:
    model = load_model(study)
    recording = load_manoeuvres(study, model.robot)[0].recording
    channels = dict(recording.channels)
    for sensor in model.sensors:
        if sensor.kind.mounted:
            names = sensor.kind.columns
            channels |= dict(zip(names, sensor.rotation @ [channels[name] for name in names], strict=True))
    return channels


TIME = np.arange(0.0, 2.0, 0.1)


def test_a_joint_is_converted_and_takes_another_ones_columns() -> None:
    columns = {"time": TIME, "position.a": np.rad2deg(np.sin(TIME)), "position.b": TIME, "torque.b": TIME}
    joints = {"a": JointRecordedAs(-1.0, 0.5, 1.0, "b"), "b": JointRecordedAs(1.0, 0.0, np.pi / 180.0, "a")}
    converted = RecordedAs(joints=joints).converted(columns)
    np.testing.assert_allclose(converted["position.a"], 0.5 - TIME)
    np.testing.assert_allclose(converted["position.b"], np.sin(TIME), atol=1e-15)
    np.testing.assert_allclose(converted["torque.a"], -TIME)


def test_late_stamps_and_repeated_readings_are_put_right() -> None:
    steps = np.floor(TIME * 5.0 + 1e-9) / 5.0
    columns = {"time": TIME, **{f"rate.{axis}": steps for axis in "xyz"}}
    converted = RecordedAs(sensors={"rate": SensorRecordedAs(native_rate=5.0, latency=0.05)}).converted(columns)
    present = np.isfinite(converted["rate.x"])
    np.testing.assert_allclose(converted["time"][present] + 0.05, converted["rate.x"][present])
    assert present.sum() == 9  # the first would be before time 0


def test_joints_that_are_late_or_early_leave_out_what_the_base_reads_without_them() -> None:
    columns = {"time": TIME, "position.a": 1.0 + TIME, "position.b": TIME, "rate.x": TIME, "base_force.x": TIME}
    sensors = {"rate": SensorRecordedAs(), "position": SensorRecordedAs(latency=-0.2)}
    early = RecordedAs(sensors=sensors).converted(columns)
    np.testing.assert_allclose(early["time"][-3:], [1.9, 2.0, 2.1])
    at = np.searchsorted(early["time"], [0.0, 0.45])
    np.testing.assert_allclose(early["position.a"][at], [1.0, 1.3])  # at rest until its first reading
    np.testing.assert_array_equal(np.isfinite(early["rate.x"]), (early["time"] > 0.15) & (early["time"] < 1.95))
    late = RecordedAs(sensors={"rate": SensorRecordedAs()}, joints={"a": JointRecordedAs(latency=0.5)}).converted(
        columns
    )
    present = np.isfinite(late["position.a"])
    np.testing.assert_allclose(late["position.a"][present], 1.5 + late["time"][present])
    np.testing.assert_allclose(late["time"][np.isfinite(late["rate.x"])].max(), 1.4)
    np.testing.assert_array_equal(np.isfinite(late["base_force.x"]), True)
    np.testing.assert_array_equal(late["position.b"], TIME)


def test_gravity_in_space_is_taken_off_a_base_that_turns() -> None:
    turn = 0.3 * TIME
    gravity = 9.8 * np.stack([np.sin(turn), np.cos(turn), 0.0 * turn])
    columns = {"time": TIME, "rate.x": 0.0 * TIME, "rate.y": 0.0 * TIME, "rate.z": 0.3 + 0.0 * TIME}
    columns |= {f"accel.{axis}": 0.1 + values for axis, values in zip("xyz", gravity, strict=True)}
    accel = SensorRecordedAs(gravity=(0.0, 9.8, 0.0), in_space=True)
    converted = RecordedAs(sensors={"accel": accel}).converted(columns)
    np.testing.assert_allclose([converted[f"accel.{axis}"] for axis in "xyz"], 0.1, atol=1e-12)


def test_times_of_another_unit_are_refused_with_the_line_that_states_it() -> None:
    channels = {"position.a": np.sin(TIME)}
    with pytest.raises(ConventionError, match=r'time_unit = "ns"') as caught:
        Recording("x", None, 1e9 * TIME, channels)
    assert [convention.name for convention in caught.value.conventions] == ["convention:unit:time"]


def test_remedies_replace_keys_and_add_sections() -> None:
    text = "[sensors.rate]  # gyro\nsigma = 1\nmounting = [0, 0, 0, 1]\n[unknowns]\nbodies = []\n"
    remedies = ["[sensors.rate]\nmounting = [1, 0, 0, 0]\nreflected = true", '[joints."j"]\nsign = -1']
    content = tomllib.loads(with_remedies(text, remedies))
    assert content["sensors"]["rate"] == {"sigma": 1, "mounting": [1, 0, 0, 0], "reflected": True}
    assert content["joints"] == {"j": {"sign": -1}}
    text = "[[recordings]]\nattitude = [1, 0, 0, 0]\n[[recordings]]\nattitude = [0, 1, 0, 0]\n"
    remedy = "[[recordings]]\nattitude = [0, 0, 0, 1]\n[[recordings]]\nattitude = [0, 0, 1, 0]"
    attitudes = [section["attitude"] for section in tomllib.loads(with_remedies(text, [remedy]))["recordings"]]
    assert attitudes == [[0, 0, 0, 1], [0, 0, 1, 0]]
    with pytest.raises(InputError, match="no section"):
        with_remedies("", ["sign = 1"])


@pytest.mark.parametrize(
    "text",
    [
        "sensors.rate.sigma = 1.0 # gyro\n[unknowns]\nbodies = []\n",
        "sensors.rate = { sigma = 1.0 } # gyro\n[unknowns]\nbodies = []\n",
        "[sensors] # gyro\nrate.sigma = 1.0\n[unknowns]\nbodies = []\n",
    ],
)
def test_remedies_join_sections_without_a_header(text: str) -> None:
    changed = with_remedies(text, ['[sensors.rate]\nunit = "deg/s"', '[joints."j"]\nsign = -1'])
    assert tomllib.loads(changed) == {
        "sensors": {"rate": {"sigma": 1.0, "unit": "deg/s"}},
        "unknowns": {"bodies": []},
        "joints": {"j": {"sign": -1}},
    }
    assert "# gyro" in changed


def test_numbers_that_diverge_are_one_error_with_a_remedy_and_others_stay_as_they_are() -> None:
    for error in (np.linalg.LinAlgError("Matrix is not positive definite"), ValueError("Probability returned NaN")):
        with pytest.raises(DivergenceError, match=r"contradict the simulation .*bayesid check"), divergence_named():
            raise error
    with pytest.raises(ValueError, match="shapes") as caught, divergence_named():
        raise ValueError("shapes do not match")
    assert not isinstance(caught.value, InputError)


@pytest.mark.parametrize(
    ("remedy", "message"),
    [
        ("joints.joint9.sign=-1", "no joint 'joint9'"),
        ("joint1.sign=-1", "there is no joint1"),
        ("sensors.rate.unit=furlong", "Give 'rad/s'"),
        ("sensors.rate.mounting=[1, 0, 0, 0]", "State it in the study"),
        ("sensors=3", "does not name a key"),
    ],
)
def test_an_import_takes_remedies_by_the_keys_of_a_study(remedy: str, message: str) -> None:
    given = ["joints.joint1.sign=-1", "sensors.rate.unit=deg/s"]
    columns = {"time": TIME, "position.joint1": TIME, "rate.x": np.rad2deg(TIME)}
    converted = imported_as(given, ["joint1"]).converted(columns)
    np.testing.assert_allclose([converted["position.joint1"], converted["rate.x"]], [-TIME, TIME])
    with pytest.raises(InputError, match=re.escape(message)):
        imported_as([remedy], ["joint1"])


@pytest.mark.slow
def test_recordings_without_motion_are_refused_and_those_with_a_little_are_not(study: Path, tmp_path: Path) -> None:
    file = shutil.copytree(study.parent, tmp_path / "study") / study.name
    text = file.read_text()
    file.write_text(text[: text.index("[sensors.attitude]")] + text[text.index("[sensors.encoder]") :])
    refuse_no_motion(load_posterior(Study.load(file), window=0))
    draw = np.random.default_rng(1)

    def stilled(columns: Columns) -> Columns:
        return {
            name: values if name.startswith(("time", "attitude")) else 1e-5 * draw.standard_normal(len(values))
            for name, values in columns.items()
        }

    edited(stilled)(file)
    with pytest.raises(InputError, match="contain no information"):
        identify(load_posterior(Study.load(file), window=0))


@pytest.mark.slow
def test_the_stated_attitudes_of_all_recordings_are_put_right(tmp_path: Path) -> None:
    options = {"manoeuvres": Manoeuvres(count=3, duration=40.0), "sensors": Sensors(attitude_period=2.0)}
    file = write_study(tmp_path, SERVICER3, np.random.default_rng(5), **options).file
    right = tomllib.loads(file.read_text())["recordings"]
    swapped = [f"[[recordings]]\nattitude = {np.roll(section['attitude'], 1).tolist()}" for section in right]
    file.write_text(with_remedies(file.read_text(), ["\n".join(swapped)]))
    (convention,) = conventions_of(Study.load(file))
    assert (convention.name, convention.channel) == ("convention:order:attitude", "recordings.attitude")
    again = tomllib.loads(with_remedies(file.read_text(), [convention.remedy]))["recordings"]
    np.testing.assert_allclose([one["attitude"] for one in again], [one["attitude"] for one in right], atol=1e-9)


@pytest.mark.slow
def test_a_diagnosis_ends_with_the_convention_and_init_writes_its_remedy(study: Path, tmp_path: Path) -> None:
    file, output = spoilt(study, "gyro forward-right-down", tmp_path), tmp_path / "out"
    said = " ".join(diagnose_study(Study.load(file), output, 0, None))
    assert "180 degrees about x" in said
    written = json.loads((output / "diagnosis.json").read_text())
    assert (written["status"], written["causes"]) == ("explained", ["convention:axes:rate"])
    assert written["conventions"][0]["remedy"] == "[sensors.rate]\nmounting = [1, 0, 0, 0]"
    with pytest.raises(ConventionError, match="180 degrees about x"):
        load_posterior(Study.load(file))
    before = file.read_text()
    assert "nothing was written" in " ".join(fixed_study(file, lambda question: False))
    assert file.read_text() == before
    assert "Wrote 1 of 1" in " ".join(fixed_study(file, lambda question: True))
    assert conventions_of(Study.load(file)) == []
    pages = PdfText.read(output / "report.pdf")
    assert "Wrong conventions" in pages
    assert "mounting = [1, 0, 0, 0]" in pages
