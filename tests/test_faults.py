"""Faults around a run: bad plug-ins, a full disk, a closed folder, two runs into one folder, wrong units."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, example, given, settings
from test_cli import copy, run, scale

from bayesid._io.errors import InputError
from bayesid._io.files import claimed_folder, complete_folder
from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_model, load_posterior
from bayesid.inference.posterior import Posterior
from bayesid.simulation.own_effects import check_own_effect
from studies.faults.surroundings import Spoilt, answer_to, spoilt, with_plugin
from studies.truth.bodies import SERVICER4
from studies.truth.mujoco import Manoeuvres, write_study

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of the four-joint servicer, made by MuJoCo."""
    folder = tmp_path_factory.mktemp("study")
    manoeuvres = Manoeuvres(count=1, duration=40.0)
    return write_study(folder, SERVICER4, np.random.default_rng(3), manoeuvres=manoeuvres, title="Servicer").file


FAILING = {
    "wrench NaN": (
        "wrench(self, v, i, s):\n        return Wrench(jnp.zeros(3), jnp.sqrt(-v[0]) + jnp.ones(3))",
        "finite",
    ),
    "wrench shape": ("wrench(self, v, i, s):\n        return Wrench(jnp.zeros(3), v)", "(1,)"),
    "wrench raises": ("wrench(self, v, i, s):\n        return Wrench(i.force, v)", "AttributeError"),
    "wrench not a wrench": ("wrench(self, v, i, s):\n        return jnp.zeros(3)", "Wrench"),
    "wrench branches": (
        "wrench(self, v, i, s):\n        return None if v[0] > 0 else None",
        "TracerBoolConversionError",
    ),
    "momentum shape": ("momentum(self, v, i, s):\n        return jnp.zeros(3)", "((3,), (3,))"),
    "momentum NaN": ("momentum(self, v, i, s):\n        return jnp.full(3, jnp.nan), jnp.zeros(3)", "finite"),
    "specific_force raises": ("specific_force(self, v, i, lever):\n        raise ValueError('no')", "ValueError: no"),
    "derivative shape": ("derivative(self, v, i, s):\n        return jnp.zeros(2)", "(0,)"),
    "read shape": ("read(self, v, readings):\n        return readings.replace(rate=readings.rate[0])", "(3,)"),
    "read NaN": (
        "read(self, v, readings):\n        return readings.replace(rate=jnp.log(-readings.rate**2-1))",
        "finite",
    ),
    "table shape": ("table(self, robot, motion, time):\n        return jnp.zeros((3, 2))", "shape"),
    "table raises": ("table(self, robot, motion, time):\n        return robot.nothing", "AttributeError"),
    "loads shape": ("loads(self, v):\n        return v", "(0,)"),
    "modes raises": ("modes(self, v):\n        return 1 / 0", "ZeroDivisionError"),
    "friction shape": ("friction(self, v, speed):\n        return v", "instead of"),
    "gravity shape": ("gravity_gradient_tensor(self, v, i):\n        return jnp.zeros(3)", "(3, 3)"),
    "made with arguments": ("__init__(self, place, other):\n        pass", "cannot be made"),
}


@pytest.mark.parametrize("kind", FAILING)
def test_a_faulty_plug_in_is_named(kind: str, study: Path, tmp_path: Path) -> None:
    hook, word = FAILING[kind]
    file = copy(study, tmp_path)
    with_plugin(file, hook)
    status, output = run("check", file, "--output", tmp_path / "out")
    assert status == 2, output
    assert output.count(" Error: ") + output.startswith("Error: ") == 1
    assert "test-faulty" in output
    assert hook.partition("(")[0] in output or "__init__" in hook
    assert word in output
    assert not (tmp_path / "out").exists()


def test_a_faulty_effect_of_a_program_is_named_before_a_simulation(study: Path, tmp_path: Path) -> None:
    from bayesid.simulation.effects import Effect, Parameter

    class Wrong(Effect):
        name = "wrong"
        parameters = (Parameter("x", "N", 1.0),)

        def wrench(self, values, instant, inner):
            return values

    loaded = load_posterior(Study.load(study))
    with pytest.raises(InputError, match=r"test_faults.py: effect 'wrong': wrench: it returns the shape"):
        Posterior.of(loaded.model.extend(Wrong()), loaded.manoeuvres)


NARROW = settings(
    max_examples=40,
    derandomize=True,
    deadline=None,
    database=None,
    phases=[Phase.explicit, Phase.generate],
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
"""The same changes in every run; the study makes more of them."""


@pytest.mark.slow
@NARROW
@example(change=Spoilt(".urdf", "another byte", 0.4, ""))
@example(change=Spoilt(".csv", "replace a value", 0.5, "1e300"))
@given(change=spoilt())
def test_spoilt_files_give_one_clear_error_or_are_accepted(change: Spoilt, study: Path, tmp_path: Path) -> None:
    answer = answer_to(study, change, tmp_path / "spoilt")
    assert not answer.fault, (answer.message, change)


def test_what_the_robots_parser_prints_is_in_the_one_message(study: Path, tmp_path: Path, capfd) -> None:
    file = copy(study, tmp_path)
    robot = tmp_path / "robot.urdf"
    robot.write_text(re.sub(r'lower="[^"]*"', 'lower="low"', robot.read_text(), count=1))
    with pytest.raises(InputError, match=r"robot.urdf: Pinocchio cannot read the robot: .*lower value \(low\)"):
        load_model(Study.load(file))
    assert capfd.readouterr().err == ""


def call(*arguments: object, **options: object) -> subprocess.CompletedProcess[str]:
    """A command in a process of its own, with all warnings shown."""
    command = [sys.executable, "-W", "default", "-m", "bayesid.app.command_line", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False, **options)


@pytest.mark.parametrize("command", ["check", "identify"])
def test_degrees_are_refused_before_anything_is_computed(command: str, study: Path, tmp_path: Path) -> None:
    file = copy(study, tmp_path)
    recording = next(tmp_path.glob("*.csv"))
    recording.write_text(scale("position.", 180.0 / np.pi)(recording.read_text()))
    done = call(command, file, "--output", tmp_path / "out")
    assert done.returncode == 2
    assert "radians" in done.stderr
    assert "Warning" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


@pytest.mark.slow
def test_degrees_are_the_verdict_of_a_diagnosis(study: Path, tmp_path: Path) -> None:
    file = copy(study, tmp_path)
    recording = next(tmp_path.glob("*.csv"))
    recording.write_text(scale("position.", 180.0 / np.pi)(recording.read_text()))
    done = call("diagnose", file, "--output", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert found["causes"] == ["convention:unit:position"]
    assert 'unit = "deg"' in found["conventions"][0]["remedy"]
    assert "Warning" not in done.stderr


@pytest.mark.slow
def test_a_motion_that_no_simulation_follows_is_refused_without_a_warning(study: Path, tmp_path: Path) -> None:
    """Without limits in the URDF nothing says that joint positions are in degrees but the simulation."""
    file = copy(study, tmp_path)
    robot = tmp_path / "robot.urdf"
    robot.write_text(re.sub(r"<limit[^>]*/>", "", robot.read_text()).replace('"revolute"', '"continuous"'))
    recording = next(tmp_path.glob("*.csv"))
    recording.write_text(scale("position.", 1e8)(recording.read_text()))
    done = call("check", file, "--output", tmp_path / "out")
    assert done.returncode == 2, done.stderr
    assert "Warning" not in done.stderr, done.stderr
    assert "Traceback" not in done.stderr, done.stderr


def test_a_full_disk_is_one_clear_error(study: Path, tmp_path: Path) -> None:
    done = call("init", study.parent / "robot.urdf", next(study.parent.glob("*.csv")), "--output", "/dev/full")
    assert done.returncode == 2
    assert done.stderr.count("Error:") == 1
    code = f"""
import resource
from pathlib import Path
from bayesid.app.command_line import _reported
from bayesid._io.files import complete_folder, write_json
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
with _reported(), complete_folder(Path({str(tmp_path / "out")!r})) as folder:
    write_json(folder / "small.json", {{}})
    write_json(folder / "large.json", {{"values": list(range(9999))}})
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=ROOT)
    assert "Error: File too large. Free space on the disk of the output folder" in done.stderr.replace("\n", " "), (
        done.stderr
    )
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_closed_folder_is_one_clear_error(study: Path, tmp_path: Path) -> None:
    closed = Path("/sys") if os.geteuid() == 0 else tmp_path / "closed"  # root may write wherever a disk lets it
    if os.geteuid() != 0:
        closed.mkdir(mode=0o500)
    elif not closed.is_dir():
        pytest.skip("root may write everywhere, and this system has no /sys")
    done = call("check", study, "--output", closed / "out")
    assert done.returncode == 2
    assert "cannot create the folder" in done.stderr
    assert done.stderr.count("Error:") == 1


def test_a_second_run_into_one_folder_is_refused_and_a_killed_one_leaves_nothing(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    code = (
        "import time; from pathlib import Path; from bayesid._io.files import claimed_folder, complete_folder\n"
        f"with claimed_folder(Path({str(folder)!r})), complete_folder(Path({str(folder)!r})) as part:\n"
        "    (part / 'half.json').write_text('{'); print('in', flush=True); time.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", code], cwd=ROOT, stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        other.stdout.readline()
        with pytest.raises(InputError, match="another run is writing into this folder"), claimed_folder(folder):
            pass
        other.kill()
    assert len(list(folder.iterdir())) == 1
    with complete_folder(folder) as part:
        (part / "whole.json").write_text("{}")
    assert [item.name for item in folder.iterdir()] == ["whole.json"]


@pytest.mark.slow
def test_the_trial_of_effects_accepts_what_the_package_ships(monkeypatch: pytest.MonkeyPatch) -> None:
    from test_effect_contract import EFFECTS, LINEAR, ROBOT, SENSORS

    monkeypatch.setattr("bayesid.simulation.own_effects.PACKAGE", "none")
    for effect in (*EFFECTS, *LINEAR):
        check_own_effect(effect, ROBOT, SENSORS)
