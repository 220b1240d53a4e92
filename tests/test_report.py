"""Reports: text is never markup, numbers read well, every figure has something in it, every document is a PDF."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import typst
from matplotlib.figure import Figure

from bayesid._io.errors import InputError
from bayesid.inference import identify
from bayesid.inference.posterior import Posterior
from bayesid.recording.joint_motion import Excitation, sample_joints
from bayesid.recording.recording import Recording
from bayesid.report import Document, figures, format_quantity, identification_report
from bayesid.report.assumptions import model_sentences
from bayesid.report.document import literal
from bayesid.report.figures.robot_figures import equivalent_box
from bayesid.report.figures.uncertainty_figures import widths
from bayesid.report.identification_text import verdict
from bayesid.report.numbers import format_number, format_unit
from bayesid.report.sensor_fit import sensor_fits
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.robot import Robot
from bayesid.simulation.effects import AccelBias, GravityGradient
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.orbit import Orbit
from bayesid.simulation.sensors import Filter, Kind, Sensor, White

ROOT = Path(__file__).resolve().parents[1]

HOSTILE = [
    "#panic() $x$ *bold* _it_ [a](b) <label> @cite // comment /* */ `raw` ~ = heading",
    'quote " backslash \\ both \\" brace { } \\u{41}',
    "- item\n+ item\n\nnew paragraph",
    "tab\t nul\0 lone \ud800 surrogate",
    "",
    "Träger_7 µm ± 運動",
]


def pages(file) -> int:
    content = file.read_bytes()
    assert content.startswith(b"%PDF")
    return len(re.findall(rb"/Type\s*/Page\b", content))


def simple_figure() -> Figure:
    figure = Figure(figsize=(4, 2))
    figure.subplots().plot(np.arange(5000), np.sin(np.arange(5000)), ".")
    return figure


@pytest.fixture(scope="session")
def result(planar_case):
    return identify(planar_case.posterior, 1, effective_samples=200.0, max_steps=50)


@pytest.fixture(scope="session")
def attitude_posterior():
    robot = Robot.shipped("planar")
    joints = len(robot.joints)
    motion = Excitation(np.full(joints, 0.2), np.full(joints, 0.4), 0.6, periods=1, ramp=5.0)
    sensors = (
        Sensor(Kind.RATE, White(1e-4), mounting=(0.0, 0.0, 1.0, 0.0)),
        Sensor(Kind.ACCEL, White(1e-4), position=(0.1, 0.0, 0.2), filter=Filter(0.5, 2)),
        Sensor(Kind.ATTITUDE, White(1e-4)),
    )
    prior = BodyPrior(robot.base, robot.link(robot.base).inertial, 0.2)
    link = next(name for name, link in robot.links.items() if name != robot.base and link.inertial.mass > 0.0)
    nuisance = BodyPrior(link, robot.link(link).inertial, 0.05, nuisance=True)
    model = Model(robot, sensors, (prior, nuisance), Orbit(7e6), (GravityGradient(), AccelBias()))
    time = np.arange(0.0, motion.duration, 0.4)
    blank = {f"{kind.value}.{axis}": np.zeros(len(time)) for kind in (Kind.RATE, Kind.ACCEL) for axis in "xyz"}
    blank |= {f"attitude.{axis}": np.full(len(time), float(axis == "w")) for axis in "xyzw"}
    recording = Recording("still", None, time, {**blank, **sample_joints(motion, robot, time)})
    return Posterior.of(model, [Manoeuvre(recording, motion, attitude_sigma=1e-3)], step=0.5)


@pytest.mark.parametrize("text", HOSTILE)
def test_text_reaches_the_page_as_it_is(text, tmp_path):
    clean = re.sub(r"[\x00-\x09]", " ", text).encode("utf-8", "replace").decode()
    (tmp_path / "check.typ").write_text(f"#metadata({literal(text)}) <it>", encoding="utf-8")
    found = typst.query(str(tmp_path / "check.typ"), "<it>", field="value", one=True)
    assert found == json.dumps(clean, ensure_ascii=False)


def test_document_with_every_element(tmp_path):
    document = Document(HOSTILE[0], HOSTILE[1], date="1 May 2031")
    for text in HOSTILE:
        document.section(text)
        document.paragraph(text)
    document.items(HOSTILE)
    document.items([])
    document.table(["a", HOSTILE[0]], [[text, "a_very.long-name/without:any.space" * 5] for text in HOSTILE])
    document.table(["a", "b"], [["1", "2"]] * 200, HOSTILE[0], ["left", "right"])
    document.table(["one"], [["1"]], "A table of one column")
    document.formula("chi^2 = r^T C^(-1) r")
    document.figure(simple_figure(), HOSTILE[0], "60%")
    document.write(tmp_path / "a.pdf")
    document.write(str(tmp_path / "b.pdf"))
    assert pages(tmp_path / "a.pdf") >= 4
    assert (tmp_path / "a.pdf").read_bytes() == (tmp_path / "b.pdf").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.pdf", "b.pdf"]


def test_misuse_of_a_document_is_explained():
    document = Document("title")
    with pytest.raises(InputError, match="60 mm"):
        document.figure(simple_figure(), "caption", "60 mm")
    with pytest.raises(InputError, match="columns"):
        document.table(["a", "b"], [["1"]])
    with pytest.raises(InputError, match="middle"):
        document.table(["a"], [["1"]], align=["middle"])


@pytest.mark.parametrize(
    ("mean", "sd", "text"),
    [
        (640.0, 0.5, "640.00 ± 0.50"),
        (640.0, 0.0996, "640.00 ± 0.10"),
        (-0.05990, 0.00017, "−0.05990 ± 0.00017"),
        (1.234e-5, 1.2e-7, "(1.234 ± 0.012) × 10⁻⁵"),
        (0.0, 3e-7, "(0.0 ± 3.0) × 10⁻⁷"),
        (-1e-9, 0.03, "0.000 ± 0.030"),
        (12345.0, 678.0, "12340 ± 680"),
        (6.916e6, 1500.0, "(6.9160 ± 0.0015) × 10⁶"),
        (3.0, 0.0, "3"),
        (float("nan"), 1.0, "not finite"),
        (1.0, float("inf"), "not finite"),
    ],
)
def test_format_quantity(mean, sd, text):
    assert format_quantity(mean, sd) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (1e-5, "1 × 10⁻⁵"), (0.1, "0.1"), (-547.23, "−547"), (9.999e5, "1 × 10⁶"), (123456.0, "123000")],
)
def test_format_number(value, text):
    assert format_number(value) == text


def test_units_are_raised():
    assert [format_unit(unit) for unit in ("kg m2", "m/s2", "N m s", "1")] == ["kg m²", "m/s²", "N m s", ""]


def test_equivalent_box_has_the_body_s_inertia():
    body = Robot.shipped("ets7").link("base_link").inertial
    corners = equivalent_box(body) - body.com
    # a box of variance half^2 / 3 along each axis: its corners have three times the second moment of its volume
    instant = body.mass * corners.T @ corners / 24.0
    np.testing.assert_allclose(np.trace(instant) * np.eye(3) - instant, body.inertia, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    "file", sorted((ROOT / "studies" / "truth" / "robots").glob("*.urdf")), ids=lambda file: file.stem
)
def test_any_robot_can_be_drawn(file, tmp_path):
    robot = Robot.from_urdf(file)
    joints = len(robot.joints)
    motion = Excitation(np.full(joints, 0.2), np.full(joints, 0.3), 0.2)
    document = Document(robot.name)
    document.figure(figures.robot_pose(robot, motion, np.array([0.0, 25.0])), "pose")
    document.figure(figures.manoeuvre(motion, robot, np.linspace(0.0, motion.duration, 50)), "manoeuvre")
    document.write(tmp_path / "robot.pdf")
    assert pages(tmp_path / "robot.pdf") >= 1


def test_fits_are_those_of_the_posterior(attitude_posterior):
    z = np.zeros(attitude_posterior.size)
    fits = sensor_fits(attitude_posterior, z)[0]
    assert [fit.kind for fit in fits] == [Kind.RATE, Kind.ACCEL, Kind.ATTITUDE]
    assert sum(fit.samples for fit in fits) == attitude_posterior.samples
    assert sum(fit.chi2 for fit in fits) == pytest.approx(float((attitude_posterior.residuals(z) ** 2).sum()))
    for fit in fits:
        assert not fit.measured.any()
        assert fit.predicted.any()
        assert fit.residual.shape == (len(fit.residual_time), 3)


def test_figures_of_three_sensors(attitude_posterior, tmp_path):
    z = np.zeros(attitude_posterior.size)
    document = Document("three sensors")
    document.figure(figures.measured_against_simulated(attitude_posterior, z, 0), "fit")
    document.figure(figures.residual_spectrum(attitude_posterior, z), "spectrum")
    document.items(model_sentences(attitude_posterior, 0.001))
    document.write(tmp_path / "fit.pdf")
    assert pages(tmp_path / "fit.pdf") >= 1


def test_what_was_assumed_names_the_model(attitude_posterior):
    text = " ".join(model_sentences(attitude_posterior, 0.002))
    for word in (
        "base_link",
        "relative width of 0.2",
        "0.05",
        "low-pass at 0.5 Hz",
        "one sample of 2",
        "accel-bias",
        "7000 km",
    ):
        assert word in text
    assert "1 × 10⁻³ rad" in text


def test_identification_report(result, tmp_path):
    identification_report(result, "Planar_robot #1", ["The arm is *rigid*."], tmp_path / "report.pdf")
    assert pages(tmp_path / "report.pdf") >= 4
    assert [path.name for path in tmp_path.iterdir()] == ["report.pdf"]


def test_verdict_follows_chi2(result):
    samples, spread = result.posterior.samples, np.sqrt(2.0 * result.posterior.samples)
    for shift, words in (
        (0.0, "the model explains the data"),
        (6.0, "does not explain"),
        (-6.0, "smaller than the declared"),
    ):
        other = replace(result, optimum=replace(result.optimum, chi2=samples - result.posterior.size + shift * spread))
        assert words in verdict(other)


def test_prior_is_no_narrower_than_the_posterior(result):
    prior, posterior = widths(result)
    assert list(prior) == list(posterior) == list(result.names)
    assert all(posterior[name] < prior[name] for name in prior if name.endswith(("mass", "xx", "yy", "zz")))
