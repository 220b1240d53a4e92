"""Reports: text is never markup, numbers are rounded to their uncertainty, figures draw the data, pages show both."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import typst
from arviz_stats.base import array_stats
from matplotlib.figure import Figure

from bayesid._io.errors import InputError
from bayesid._io.words import abridged, counted, joined, ordinal
from bayesid.inference import identify
from bayesid.inference.body_quantities import BODY_QUANTITIES
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import sensor_fits
from bayesid.inference.residual_view import ResidualView
from bayesid.recording.joint_motion import Excitation, sample_joints
from bayesid.recording.recording import Recording
from bayesid.report import Document, figures, format_quantity, identification_report
from bayesid.report.document import literal
from bayesid.report.identification_report import agreement_sentences, misfit_rows, parameter_rows, start_rows, verdict
from bayesid.report.model_assumptions import joint_rows, model_sentences
from bayesid.report.numbers import (
    format_fixed,
    format_number,
    format_p_value,
    format_percent,
    format_range,
    format_signed,
    format_unit,
    format_vector,
)
from bayesid.robot.body_prior import BodyPrior
from bayesid.robot.link_shapes import equivalent_box
from bayesid.robot.robot import Robot
from bayesid.simulation.effects import GravityGradient, SensorBias
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.orbit import Orbit
from bayesid.simulation.sensors import Filter, Sensor, SensorKind, White
from tests.pdf_text import PdfText
from tests.report_rules import badly_written

ROOT = Path(__file__).resolve().parents[1]

HOSTILE = [
    "#panic() $x$ *bold* _it_ [a](b) <label> @cite // comment /* */ `raw` ~ = heading",
    'quote " backslash \\ both \\" brace { } \\u{41}',
    "- item\n+ item\n\nnew paragraph",
    "tab\t nul\0 lone \ud800 surrogate",
    "",
    "Träger_7 µm ± 運動",
]


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
        Sensor(SensorKind.RATE, White(1e-4), mounting=(0.0, 0.0, 1.0, 0.0)),
        Sensor(SensorKind.ACCEL, White(1e-4), position=(0.1, 0.0, 0.2), filter=Filter(0.5, 2)),
        Sensor(SensorKind.ATTITUDE, White(1e-4)),
    )
    prior = BodyPrior(robot.base, robot.link(robot.base).inertial, 0.2)
    link = next(name for name, link in robot.links.items() if name != robot.base and link.inertial.mass > 0.0)
    nuisance = BodyPrior(link, robot.link(link).inertial, 0.05, nuisance=True)
    model = Model(robot, sensors, (prior, nuisance), Orbit(7e6), (GravityGradient(), SensorBias.of(SensorKind.ACCEL)()))
    time = np.arange(0.0, motion.duration, 0.4)
    blank = {
        f"{kind.value}.{axis}": np.zeros(len(time)) for kind in (SensorKind.RATE, SensorKind.ACCEL) for axis in "xyz"
    }
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
    text = PdfText.read(tmp_path / "a.pdf")
    assert len(text.pages) >= 4
    assert not any("invisible" in found for page in text.pages for found in badly_written(page))
    for number, hostile in enumerate(HOSTILE[:3], start=1):
        assert f"{number} {hostile} {hostile}" in text  # a heading and its paragraph
        assert text.row(hostile, "a_very.long-name/without:any.space" * 5)
    assert "6 Träger_7 µm ±" in text  # the fonts lack the rest
    assert text.row("a", "b", *["1", "2"] * 10)
    assert f"Table 1. {HOSTILE[0]}" in text
    assert "Table 2. A table of one column" in text
    assert f"Figure 1. {HOSTILE[0]}" in text
    assert "1 May 2031" in text
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


def test_numbers_have_true_minus_signs_and_no_negative_zero():
    assert [format_fixed(value, 2) for value in (-1.5, -0.001, 2.0)] == ["−1.50", "0.00", "2.00"]
    assert [format_signed(value) for value in (3.14, -2.0, -0.04, 0.0)] == ["+3.1", "−2.0", "0.0", "0.0"]
    assert format_vector([0.1, -2.0, 1e-5]) == "(0.1, −2, 1 × 10⁻⁵)"


def test_percentages_never_round_to_all():
    assert [format_percent(ratio) for ratio in (0.1234, 0.994, 0.996, 1.0, 0.0)] == [
        "12 %",
        "99 %",
        "99.6 %",
        "100 %",
        "0 %",
    ]
    assert format_percent(0.1234, 3) == "12.3 %"


def test_a_range_of_equal_values_is_one_number():
    assert format_range([3.0, 1.0, 2.0]) == "1 to 3"
    assert format_range([1.0001, 1.0002]) == "1"
    assert format_range(value for value in (0.5, 0.25)) == "0.25 to 0.5"


def test_a_p_value_has_a_floor():
    assert [format_p_value(value) for value in (1e-13, 2e-12, 0.0456)] == ["< 10⁻¹²", "2 × 10⁻¹²", "0.046"]


def test_lists_read_as_in_a_sentence():
    assert [joined(names) for names in ((), ("a",), ("a", "b"), ("a", "b", "c"))] == ["", "a", "a and b", "a, b and c"]
    assert abridged(["a", "b", "c"], 2) == "a, b and 1 more"
    assert abridged(["a", "b"], 2, separator="; ") == "a; b"
    assert [counted(number, "recording") for number in (0, 1, 2)] == ["0 recordings", "1 recording", "2 recordings"]
    assert [ordinal(number) for number in (1, 2, 3, 4)] == ["first", "second", "third", "4th"]


def test_units_are_raised():
    assert [format_unit(unit) for unit in ("kg m2", "m/s2", "N m s", "1")] == ["kg m²", "m/s²", "N m s", ""]


def test_equivalent_box_has_the_body_s_inertia():
    body = Robot.shipped("ets7").link("base_link").inertial
    corners = equivalent_box(body) - body.com
    # a box of variance half^2 / 3 along each axis: its corners have three times the second moment of its volume
    moment = body.mass * corners.T @ corners / 24.0
    np.testing.assert_allclose(np.trace(moment) * np.eye(3) - moment, body.inertia, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    "file", sorted((ROOT / "studies" / "truth" / "robots").glob("*.urdf")), ids=lambda file: file.stem
)
def test_any_robot_can_be_drawn(file, tmp_path):
    robot = Robot.from_urdf(file)
    joints = len(robot.joints)
    motion = Excitation(np.full(joints, 0.2), np.full(joints, 0.3), 0.2)
    time = np.linspace(0.0, motion.duration, 50)
    pose = figures.robot_pose(robot, motion, np.array([0.0, 25.0]))
    curves = figures.manoeuvre(motion, robot, time)
    document = Document(robot.name)
    document.figure(pose, "The robot at two instants.")
    document.figure(curves, "The motion of its joints.")
    document.write(tmp_path / "robot.pdf")
    text = PdfText.read(tmp_path / "robot.pdf")
    assert "Figure 1. The robot at two instants." in text
    assert "Figure 2. The motion of its joints." in text
    assert [axes.get_xlabel() for axes in pose.axes] == ["x [m]", "x [m]", "y [m]"]
    labels = pose.axes[0].get_legend_handles_labels()[1]
    assert labels[:2] == ["t = 0 s", "t = 25 s"]
    drawn = {line.get_label(): line.get_ydata() for axes in curves.axes[::2] for line in axes.lines}
    assert set(drawn) == {joint.name for joint in robot.joints}
    state = motion.evaluate(time)
    for index, joint in enumerate(robot.joints):
        np.testing.assert_array_equal(drawn[joint.name], state.position[:, index])
    speeds = [line.get_ydata() for axes in curves.axes[1::2] for line in axes.lines]
    assert sorted(map(np.ptp, speeds)) == sorted(np.ptp(state.velocity, axis=0))


def test_fits_are_those_of_the_posterior(attitude_posterior):
    z = np.zeros(attitude_posterior.size)
    fits = sensor_fits(attitude_posterior, z)[0]
    assert [fit.kind for fit in fits] == [SensorKind.RATE, SensorKind.ACCEL, SensorKind.ATTITUDE]
    assert sum(fit.samples for fit in fits) == attitude_posterior.samples
    assert sum(fit.chi2 for fit in fits) == pytest.approx(float((attitude_posterior.residuals(z) ** 2).sum()))
    for fit in fits:
        assert not fit.measured.any()
        assert fit.predicted.any()
        assert fit.residual.shape == (len(fit.residual_time), 3)


def test_readings_are_drawn_with_their_residuals_beneath(attitude_posterior):
    fits = sensor_fits(attitude_posterior, np.zeros(attitude_posterior.size))[0]
    fits = [replace(fit, measured=1e-3 * fit.predicted) for fit in fits]
    panels = np.reshape(figures.measured_against_simulated(fits).axes, (6, 3))
    for row, (fit, title) in enumerate(zip(fits, ("angular rate", "acceleration", "rotation"), strict=True)):
        power = 3 * int(np.floor(np.log10(np.abs(fit.measured).max()) / 3.0))
        assert power < 0
        for axis in range(3):
            above, below = panels[2 * row, axis], panels[2 * row + 1, axis]
            unit = ("rad/s", "m/s²", "rad")[row]
            assert above.get_title() == f"{title} {'xyz'[axis]} [$10^{{{power}}}$ {unit}]"
            curves = {line.get_label(): line.get_ydata() for line in above.lines}
            np.testing.assert_allclose(curves["measured"], fit.measured[:, axis] / 10.0**power)
            np.testing.assert_allclose(curves["simulated"], fit.predicted[:, axis] / 10.0**power)
            np.testing.assert_array_equal(below.lines[0].get_ydata(), fit.residual[:, axis])
            low, high = below.get_ylim()
            assert high == -low >= np.nanmax(np.abs(fit.residual[:, axis]))
    assert [axes.get_xlabel() for axes in panels[-1]] == ["time [s]"] * 3


def made_up_residuals(posterior: Posterior, make) -> ResidualView:
    """Residuals that a function of the sample times gives on every axis."""
    values = np.zeros(posterior.residual_shape)
    item, grid = posterior.whitenings[0], posterior.data.times(0)
    for channel in range(item.outputs.shape[1]):
        present = np.flatnonzero(item.outputs[:, channel])
        values[0, present, channel] = make(grid[item.rows[present]])
    return ResidualView(posterior, values)


def test_the_spectrum_of_noise_is_flat_and_that_of_a_wave_has_a_peak(attitude_posterior):
    rng = np.random.default_rng(3)
    noise = made_up_residuals(attitude_posterior, lambda time: rng.normal(size=len(time)))
    wave = made_up_residuals(attitude_posterior, lambda time: np.sin(2.0 * np.pi * 0.1 * time))
    for axis in range(3):
        frequency, power, ordinates = noise.spectrum(SensorKind.RATE, axis)
        assert np.average(power, weights=ordinates) == pytest.approx(1.0, abs=4.0 / np.sqrt(ordinates.sum()))
        # Parseval: the ordinates hold half the square sum, but for those at zero and at Nyquist
        time, value = wave.series(0, SensorKind.RATE, axis)
        frequency, power, ordinates = wave.spectrum(SensorKind.RATE, axis)
        assert power @ ordinates == pytest.approx(0.5 * value @ value, rel=0.05)
        width = frequency[1] - frequency[0]
        assert abs(frequency[np.argmax(power)] - 0.1) < width
        assert frequency[-1] < 0.5 / np.median(np.diff(time))


def test_spectra_and_distributions_are_drawn_for_every_sensor(attitude_posterior):
    residuals = ResidualView.at(attitude_posterior, np.zeros(attitude_posterior.size))
    panels = np.reshape(figures.residual_statistics(residuals).axes, (3, 2))
    for kind, (left, right) in zip(residuals.kinds, panels, strict=True):
        for axis in range(3):
            spectrum = residuals.spectrum(kind, axis)
            curve = next(line for line in left.lines if line.get_label() == f"axis {'xyz'[axis]}")
            np.testing.assert_array_equal(curve.get_xydata(), np.column_stack([spectrum.frequency, spectrum.power]))
        assert left.get_yscale() == "log"
        pooled = residuals.pooled(kind)
        assert right.texts[0].get_text() == (f"mean {pooled.mean():.3f}\nsd {pooled.std():.3f}\n{len(pooled)} samples")
        shares = [bar.get_height() * bar.get_width() for bar in right.patches]
        assert sum(shares) == pytest.approx(1.0)
    names = [left.get_ylabel().partition("\n")[0] for left in panels[:, 0]]
    assert names == ["angular rate", "acceleration", "rotation"]


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


@pytest.fixture(scope="module")
def printed(result, tmp_path_factory) -> PdfText:
    folder = tmp_path_factory.mktemp("report")
    identification_report(result, "Planar_robot #1", ["The arm is *rigid*."], folder / "report.pdf")
    assert [path.name for path in folder.iterdir()] == ["report.pdf"]
    return PdfText.read(folder / "report.pdf")


def test_the_report_tables_every_parameter_with_its_uncertainty(result, printed):
    body = result.bodies["base_link"]
    for index, (key, unit) in enumerate(BODY_QUANTITIES.items()):
        mean, sd = body.mean[index], body.sd[index]
        row = parameter_rows(result)[index]
        assert row[:2] == [f"base_link.{key}", format_unit(unit)]
        assert row[3] == format_quantity(mean, sd)
        assert printed.row(*row)
    rows = misfit_rows(result)
    assert [row[:3] for row in rows] == [["planar", "rate", "243"], ["planar", "accel", "243"]]
    assert sum(float(row[3].split()[0]) * int(row[2]) for row in rows) == pytest.approx(
        result.optimum.chi2, abs=0.0011 * 243
    )
    for row in (*rows, *start_rows(result), *joint_rows(result.posterior)):
        assert printed.row(*row)


def test_the_report_says_what_was_identified_how_and_on_which_assumptions(result, printed):
    mass = format_quantity(float(result.bodies["base_link"].mean[0]), float(result.bodies["base_link"].sd[0]))
    assert "Planar_robot #1" in printed
    assert (
        f"Mass, centre of mass and inertia of base_link of the robot planar were identified from 1 recording with "
        f"{result.posterior.samples} scalar sensor samples. Identified mass: base_link {mass} kg."
    ) in printed
    for sentence in (
        verdict(result),
        *agreement_sentences(result),
        "The arm is *rigid*.",
        *model_sentences(result.posterior, result.integration_error),
    ):
        assert sentence in printed
    for title in ("1 Result", "2 Robot and manoeuvres", "3 Measured against simulated", "4 Uncertainty"):
        assert title in printed
    assert "5 Computation" in printed
    assert "6 Assumptions" in printed


def test_the_bars_of_the_widths_are_the_ratios(result):
    axes = figures.prior_to_posterior(result).axes[0]
    prior, posterior = ({name: both[side] for name, both in result.widths.items()} for side in (0, 1))
    low = 10.0 ** -axes.lines[0].get_xdata()[0]  # the line at ratio one
    ratios = [low * 10.0 ** bar.get_width() for bar in axes.patches]
    np.testing.assert_allclose(ratios, [posterior[name] / prior[name] for name in prior])
    assert [label.get_text() for label in axes.get_yticklabels()] == list(prior)
    shown = [text.get_text().strip() for text in axes.texts]
    assert shown == [format_number(ratio, 2) for ratio in ratios]


def test_the_corner_plot_names_every_quantity_with_its_value(result):
    body = result.bodies["base_link"]
    figure = figures.plot_posterior(body)
    assert len(figure.axes) == 55
    assert smallest_axis_text(figure) >= 8.0
    texts = [axes.texts[0].get_text() for axes in figure.axes if axes.texts]
    assert texts == [
        f"{key}\n{format_quantity(mean, sd)}\n{format_unit(unit)}"
        for (key, unit), mean, sd in zip(BODY_QUANTITIES.items(), body.mean, body.sd, strict=True)
    ]


def smallest_axis_text(figure: Figure) -> float:
    """Return the size of the smallest name or number beside an axis [pt]."""
    texts = [
        text
        for axes in figure.axes
        for text in (axes.xaxis.label, axes.yaxis.label, *axes.get_xticklabels(), *axes.get_yticklabels())
    ]
    return min(text.get_fontsize() for text in texts)


def test_names_beside_many_correlations_can_be_read_in_print():
    figure = figures.correlations([f"{number}" for number in range(80)], np.eye(80))
    assert smallest_axis_text(figure) >= 8.0
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == [f"{3 * k}" for k in range(27)]


def test_correlations_are_drawn_with_their_values():
    covariance = [[4.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 0.0]]
    axes = figures.correlations(["a", "b", "c"], covariance).axes[0]
    np.testing.assert_array_equal(axes.images[0].get_array(), [[1.0, -0.5, 0.0], [-0.5, 1.0, 0.0], [0.0, 0.0, 0.0]])
    assert [text.get_text() for text in axes.texts] == [
        *("1.00", "−0.50", "0.00"),
        *("−0.50", "1.00", "0.00"),
        *("0.00", "0.00", "0.00"),
    ]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["a", "b", "c"]


def test_running_means_end_at_the_mean_of_each_ensemble(result):
    figure, draws = figures.convergence(result), result.chains.z
    panels = np.reshape(figure.axes, (-1, 2))
    assert len(panels) == 3
    names = list(result.posterior.unknowns.names)
    for left, right in panels:
        name, _, r_hat = left.get_title().partition(", R-hat ")
        column = draws[:, :, names.index(name)]
        assert r_hat == f"{float(array_stats.rhat(column)):.4f}"
        steps = draws.shape[1] // result.chains.walkers * result.chains.walkers
        for number, line in enumerate(left.lines):
            assert line.get_label() == f"ensemble {number + 1}"
            end = (column[number, :steps].mean() - column.mean()) / column.std()
            assert line.get_ydata()[-1] == pytest.approx(end, abs=1e-9)
        assert len(left.lines) == len(right.patches) == len(draws)
    assert f"largest R-hat {result.chains.r_hat:.4f}" in figure.get_suptitle()


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
    prior, posterior = ({name: both[side] for name, both in result.widths.items()} for side in (0, 1))
    assert list(prior) == list(posterior) == list(result.names)
    for name in ("mass", "inertia.xx", "inertia.yy", "inertia.zz"):
        assert posterior[f"base_link.{name}"] < prior[f"base_link.{name}"]
