"""The catalogue as a user reads it: every effect is there, with all that the package knows of it."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from bayesid.app.command_line import app
from bayesid.report.effect_catalogue import catalogue, entry_of
from bayesid.simulation.effects import known_effects
from bayesid.simulation.effects.register import _REGISTER
from bayesid.simulation.sensors import SensorKind

DEMONSTRATION = Path(__file__).resolve().parents[1] / "bayesid" / "app" / "demonstration_data" / "study.toml"

PLUGIN = '''
from bayesid import Effect, Parameter, register


@register
class SteadyTorque(Effect):
    """A torque that never changes, in base axes."""

    name = "steady-torque"
    parameters = (Parameter("x", "N m", 2e-3),)
'''

SENSOR = """
from bayesid import Instrument, SensorKind


@SensorKind.register
class Field(SensorKind):
    value, unit = "magnetic", "T"
    instrument = Instrument("magnetometer", "the field", bias_sigma=1e-7, drift_sigma=1e-9)

    def read(self, sensed):
        return sensed.instant.to_base(sensed.instant.environment.north)
"""


def run(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(app, ["catalogue", *map(str, arguments)])
    return result.exit_code, re.sub(r"\s+", " ", result.output)


@pytest.fixture(scope="module")
def entries():
    return catalogue()


def test_every_effect_states_its_explanation_parameters_and_the_reason_of_its_size(entries):
    for name, kind in known_effects().items():
        entry = entry_of(name, entries)
        assert entry.summary == kind.summary
        assert entry.separated_by == kind.separated_by
        assert entry.parameters, name
        assert entry.sizes or "physics" in entry.parameters[0], name
        assert all(re.search(r"for \S.*: .+\. [A-Z].*\.$", size) for size in entry.sizes), entry.sizes


def test_what_the_diagnosis_calls_noise_is_there_too(entries):
    for name in (
        "rate-noise",
        "encoder-noise",
        "coloured-noise:rate",
        "outliers:accel",
        "quantisation",
        "initial-rate",
    ):
        assert entry_of(name, entries).summary, name


@pytest.mark.parametrize(
    ("name", "needs"),
    [
        ("wheel-momentum", ()),
        ("encoder-offset:joint3", ()),
        ("rate-scale", ("[sensors.rate]",)),
        ("torque-bias", ("[sensors.torque]",)),
        ("gravity-gradient", ("[orbit]",)),
        ("magnetic-dipole", ("[orbit]", "inclination in [orbit]", "argument_of_latitude in every recording")),
        ("solar-pressure", ("[orbit]", "sun in [orbit]", "argument_of_latitude in every recording")),
    ],
)
def test_an_effect_needs_what_it_does_not_occur_without(entries, name, needs):
    assert entry_of(name, entries).needs == needs


def test_the_command_prints_all_effects_or_one():
    status, output = run()
    assert status == 0, output
    assert all(f"{name}" in output for name in known_effects())
    status, output = run("rate-scale")
    assert status == 0, output
    assert output.startswith("rate-scale The rate sensor reads too high or too low")
    assert "x, y, z [1]: normal, mean 0, standard deviation 0.03" in output
    assert "within 10 % of its nominal value" in output
    assert "rate-bias" not in output


def test_sizes_are_those_of_a_study_with_its_plugins(tmp_path):
    for item in DEMONSTRATION.parent.iterdir():
        (tmp_path / item.name).write_bytes(item.read_bytes())
    (tmp_path / "steady.py").write_text(PLUGIN)
    study = tmp_path / "study.toml"
    study.write_text(study.read_text().replace("[model]", '[model]\nplugins = ["steady.py"]'))
    try:
        status, output = run("wheel-momentum", "--study", study)
        assert status == 0, output
        assert "Largest size of x, y, z for servicer" in output
        status, output = run("steady-torque", "--study", study)
        assert status == 0, output
        assert "A torque that never changes" in output
        assert "x [N m]: normal, mean 0, standard deviation 2 × 10⁻³" in output
    finally:
        _REGISTER.pop("steady-torque", None)


def test_a_sensor_of_ones_own_has_faults(tmp_path, monkeypatch):
    monkeypatch.setattr(SensorKind, "_known", dict(SensorKind._known))
    text = DEMONSTRATION.read_text(encoding="utf-8").replace('urdf = "', f'urdf = "{DEMONSTRATION.parent}/')
    section = "[sensors.other.magnetic]\nsigma = 1e-5\n\n[sensors.rate]"
    text = text.replace("[sensors.rate]", section, 1) + 'plugins = ["field.py"]\n'
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    (tmp_path / "field.py").write_text(SENSOR, encoding="utf-8")
    status, output = run("--study", tmp_path / "study.toml")
    assert status == 0, output
    assert "rate-bias The rate sensor reads a constant value" in output
    assert "magnetic-drift The magnetometer's zero drifts steadily" in output
    assert "x, y, z [T/s]: normal, mean 0, standard deviation 1 × 10⁻⁹" in output
    assert output.count("Needs: [sensors.other.magnetic]") == 6


def test_an_unknown_effect_is_answered_with_the_known_ones():
    status, output = run("wheels")
    assert status == 2
    assert "unknown effect 'wheels'" in output
    assert "wheel-momentum" in output
