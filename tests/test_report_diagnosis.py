"""Reports of diagnoses: sentences and tables hold the result's numbers, figures draw its data, pages show both."""

import copy
from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest

from bayesid.diagnosis import (
    Candidate,
    Frame,
    Gain,
    Hypothesis,
    Status,
    Unexplained,
    Verdict,
    candidates,
    diagnose,
)
from bayesid.diagnosis.cause_amplitudes import CauseAmplitude, amplitudes_of
from bayesid.diagnosis.rival_causes import improbable_rivals, signal_cosine
from bayesid.diagnosis.wrench_correlations import torque_correlations
from bayesid.inference.residual_series import Residuals
from bayesid.recording.recording import Recording
from bayesid.report import diagnosis_report, figures
from bayesid.report.diagnosis_report import unseen_candidates
from bayesid.report.figures.diagnosis_figures import torque_amplitudes
from bayesid.report.figures.residual_figures import NOISE_BAND
from bayesid.report.numbers import format_quantity
from bayesid.report.sentences import diagnosis_sentences as sentences
from bayesid.report.sentences.amplitude_words import amplitude_text
from bayesid.report.sentences.model_assumptions import model_sentences
from bayesid.report.sentences.next_experiment import ANYTHING, advice
from bayesid.report.tables import diagnosis_tables as tables
from bayesid.report.tables.identification_tables import joint_rows
from bayesid.simulation.effects import known_effects
from bayesid.simulation.effects.effect_parameters import Quantity
from bayesid.simulation.model import Manoeuvre
from bayesid.simulation.sensors import Kind
from tests.pdf_text import PdfText

BIAS = 4e-5
HIDDEN = ["accel-bias", "accel-drift", "rate-bias", "rate-noise", "wheel-momentum", "thruster-leak"]


def with_bias(manoeuvre: Manoeuvre, size: float) -> Manoeuvre:
    recording = manoeuvre.recording
    channels = dict(recording.channels)
    channels["accel.x"] = channels["accel.x"] + size
    return replace(manoeuvre, recording=Recording(recording.name, None, recording.time, channels))


@pytest.fixture(scope="module")
def biased(planar_case):
    """A small study whose accelerometer reads a constant that the model does not know."""
    model = planar_case.posterior.model
    effects = [effect for effect in candidates(model) if effect.label in HIDDEN]
    return diagnose(model, [with_bias(item, BIAS) for item in planar_case.posterior.manoeuvres], 3, effects=effects)


@pytest.fixture(scope="module")
def clean(biased):
    """As if the present model had passed every test."""
    search = copy.copy(biased.search)
    search._done = {}
    verdict = Verdict(Status.ADEQUATE, biased.before, {}, (), biased.verdict.disturbance)
    return replace(biased, search=search, verdict=verdict, gain=Gain(biased.gain.before, biased.gain.before))


@pytest.fixture(scope="module")
def disturbance(biased) -> Unexplained:
    """A torque about x that follows the first joint's position."""
    base = biased.before.fit
    time = np.asarray(base.operating.node.environment.time)[0]
    position = base.posterior.manoeuvres[0].motion.evaluate(time).position[:, 0]
    torque = np.stack([1e-3 * position, 0.0 * time, 0.0 * time], axis=1)
    same = {frame: [torque] for frame in Frame}
    sd = [np.full_like(torque, 1e-4)]
    return Unexplained(12.0, ("planar",), [time], same, same, sd, sd, Frame.BASE, 50.0)


def candidate(**changes) -> Candidate:
    fields = {
        "name": "accel-bias",
        "signal_to_noise": 20.0,
        "p_value": 1e-30,
        "p_value_adjusted": 1e-28,
        "log_bayes_factor": 180.0,
        "quantities": tuple(Quantity(axis, "m/s2") for axis in "xyz"),
        "mean": np.array([1e-5, 0.0, 0.0]),
        "sd": np.array([1e-6, 1e-6, 1e-6]),
        "power": 0.9,
        "refitted": True,
    }
    return Candidate(**{**fields, **changes})


def judged(result, status: Status, rivals: tuple[Hypothesis, ...] = ()):
    return replace(result, verdict=replace(result.verdict, status=status, equivalents={}, rivals=rivals))


def residuals_of(hypothesis: Hypothesis) -> Residuals:
    posterior = hypothesis.fit.posterior
    return Residuals(posterior, hypothesis.fit.residual.reshape(posterior.residual_shape))


def test_sentences_name_the_cause_its_size_and_what_it_gains(biased):
    said = list(sentences.diagnosis_sentences(biased))
    assert said[0].startswith("Explained by accel-bias")
    assert "The accelerometer reads a constant in free fall." in said[1]
    assert "m/s²" in said[1]
    assert "chi-square per sample goes from" in said[-1]
    assert "base_link." in said[-1]
    assert "held" not in said[-1]  # one recording


@pytest.mark.parametrize("status", list(Status))
def test_every_status_is_said_with_its_gain_and_its_test(biased, clean, status):
    result = judged(clean if status is Status.ADEQUATE else biased, status)
    assert sentences.verdict_sentence(result).lower().startswith(status.value)
    named = status in (Status.EXPLAINED, Status.AMBIGUOUS)
    before, after = result.gain.before, result.gain.after
    gain, alarm = sentences.gain_sentence(result), sentences.alarm_sentence(result)
    assert f"{before.chi2_per_sample:.3f}" in gain
    assert (f"to {after.chi2_per_sample:.3f}" in gain) is named
    assert (f"{100.0 * before.inside:.1f} % of the residuals lie within one σ" in gain) is not named
    assert f"Of {len(result.before.outcome.log_p)} tests" in alarm
    assert f"that for {result.before.outcome.worst} (p " in alarm
    assert (f"With the named cause it is that for {result.after.outcome.worst} (p " in alarm) is named


def test_the_parameter_that_moves_most_is_named(biased):
    shift = biased.gain.shift
    k = int(np.argmax(np.abs(shift)))
    size = f"{shift[k]:+.1f}".replace("-", "−")
    name = biased.gain.before.bodies.names[k]
    assert f"the inertial parameter that moves most is {name}, by {size} of the" in sentences.gain_sentence(biased)


def test_equivalents_are_other_names(biased):
    verdict = replace(biased.verdict, equivalents={"accel-bias": ("a", "b")}, rivals=())
    assert "Other names for the same change: a and b." in next(
        sentences.cause_sentences(replace(biased, verdict=verdict))
    )


def test_amplitudes_have_units_and_the_value_that_was_hidden(biased):
    hidden, *others = amplitudes_of(biased.after, "accel-bias")
    assert abs(hidden.mean - BIAS) < 4.0 * hidden.sd
    assert len(others) == 2
    for item in others:
        assert item.distance < 4.0
    pair = [CauseAmplitude(Quantity(name, "N m s"), mean, 0.1) for name, mean in (("x", 1.0), ("y", 2.0))]
    assert amplitude_text(pair) == "x 1.00 ± 0.10, y 2.00 ± 0.10 N m s"
    several = [CauseAmplitude(Quantity(f"k{i}", "1"), float(i), 1.0) for i in range(6)]
    assert amplitude_text(several) == "k3 3.0 ± 1.0, k4 4.0 ± 1.0, k5 5.0 ± 1.0"
    mixed = [CauseAmplitude(Quantity("m", "kg"), 1.0, 0.1), CauseAmplitude(Quantity("x", "m"), 2.0, 0.1)]
    assert amplitude_text(mixed) == "m 1.00 ± 0.10 kg, x 2.00 ± 0.10 m"


def test_a_candidate_that_is_not_seen_has_a_limit():
    seen, faint, noise = tables.candidate_rows(
        [
            candidate(),
            candidate(p_value_adjusted=0.4, refitted=False, log_bayes_factor=-2.0),
            candidate(quantities=(), mean=np.zeros(0), sd=np.zeros(0), power=None, log_bayes_factor=None),
        ],
        0.01,
    )
    assert seen == [
        "accel-bias",
        "20.0",
        "< 10⁻¹²",
        "+180.0",
        "x (1.00 ± 0.10) × 10⁻⁵, y (0.0 ± 1.0) × 10⁻⁶, z (0.0 ± 1.0) × 10⁻⁶ m/s²",
        "0.90",
        "refitted",
    ]
    assert faint[3] == "−2.0"
    assert faint[4] == "x < 1.2 × 10⁻⁵, y < 1.6 × 10⁻⁶, z < 1.6 × 10⁻⁶ m/s²"
    assert faint[6] == "linear"
    assert noise[3:6] == ["", "", ""]


def test_candidates_out_of_reach_are_those_of_low_power():
    rows = [candidate(power=0.9), candidate(name="b", power=0.3), candidate(name="c", power=0.1), candidate(power=None)]
    assert [row.name for row in unseen_candidates(rows)] == ["c", "b"]
    assert tables.unseen_rows(unseen_candidates(rows)[:1]) == [
        ["c", "0.10", "x < 1.2 × 10⁻⁵, y < 1.6 × 10⁻⁶, z < 1.6 × 10⁻⁶ m/s²"]
    ]


SHIPPED = sorted(name for name, effect in known_effects().items() if effect.__module__.startswith("bayesid."))


@pytest.mark.parametrize("name", SHIPPED)
def test_every_cause_of_the_catalogue_has_an_advice(name):
    assert advice(name) != ANYTHING


@pytest.mark.parametrize("name", ["rate-noise", "coloured-noise:rate", "outliers:accel", "quantisation:rate"])
def test_every_fault_of_noise_has_an_advice(name):
    assert advice(name) != ANYTHING


def test_an_unknown_cause_gets_the_general_advice():
    assert advice("of-a-plugin") == ANYTHING
    assert advice("accel-bias") == advice("rate-bias") != advice("rate-drift")


def test_a_signal_looks_like_itself_and_less_like_another_s(biased):
    best = biased.after
    columns = biased.search.suite.effects
    suite = SimpleNamespace(effects={**columns, "alias": columns["accel-bias"]})
    seen = replace(biased, search=SimpleNamespace(suite=suite, base=biased.search.base))
    alias, drift, thrust = (SimpleNamespace(labels=(name,)) for name in ("alias", "accel-drift", "thruster-leak"))
    assert signal_cosine(best, alias, seen) == pytest.approx(1.0, abs=1e-6)
    # a drift grows from zero to twice its mean: in white noise the cosine with a constant is the root of 3/4
    cosine = signal_cosine(best, drift, seen)
    assert 0.5 < cosine < 0.95
    assert signal_cosine(best, thrust, seen) < 1.0


def test_hypotheses_that_do_not_differ_or_have_no_columns_have_no_cosine(biased):
    assert signal_cosine(biased.after, biased.after, biased) is None
    assert signal_cosine(biased.after, SimpleNamespace(labels=("noise",)), biased) is None


def test_advice_names_both_sides(biased):
    rival = SimpleNamespace(labels=("rate-bias",))
    said = list(sentences.advice_sentences(biased, (rival,)))
    assert said == [f"{name}: {advice(name)}" for name in ("accel-bias", "rate-bias")]


def test_the_disturbance_moves_with_what_drives_it(biased, disturbance):
    correlations = torque_correlations(disturbance, biased.before)
    axis, name, value = correlations[0]
    assert (axis, name) == ("torque x", f"position of {biased.before.fit.posterior.model.robot.joints[0].name}")
    assert value == pytest.approx(1.0)
    sizes = [abs(item.correlation) for item in correlations]
    assert sizes == sorted(sizes, reverse=True)
    assert {item.component for item in correlations} == {"torque x"}  # the others are zero
    assert tables.correlation_rows(correlations)[0] == ["torque x", name, "+1.00"]


def test_the_spectrum_of_a_wave_is_its_amplitude():
    time = np.linspace(0.0, 100.0, 401)
    wave = 0.3 * np.cos(2.0 * np.pi * 0.05 * time)
    torque = [np.stack([wave, 0.0 * time, 0.0 * time], axis=1)]
    same = dict.fromkeys(Frame, torque)
    disturbance = Unexplained(1.0, ("a",), [time], same, same, torque, torque, None, 0.0)
    frequency, amplitude = torque_amplitudes(disturbance, 0)
    assert frequency[np.argmax(amplitude[:, 0])] == pytest.approx(0.05, rel=0.01)
    assert amplitude[:, 0].max() == pytest.approx(0.3, rel=0.02)


def test_residuals_are_those_of_the_fit(biased):
    side = residuals_of(biased.before)
    assert side.kinds
    values = np.concatenate([side.pooled(kind) for kind in side.kinds])
    assert values @ values == pytest.approx(biased.before.fit.chi2)
    for kind in side.kinds:
        for axis in range(3):
            time, value = side.series(0, kind, axis)
            assert len(time) == len(value) > 70
            assert np.diff(time).min() > 0.0
    again = Residuals.at(biased.before.fit.posterior, biased.before.fit.z)
    np.testing.assert_allclose(again.values, side.values, atol=1e-6)


def test_histories_and_spectra_draw_the_residuals_before_and_after(biased):
    sides = [residuals_of(biased.before), residuals_of(biased.after)]
    histories, spectra = figures.residual_histories(sides, 0), figures.residual_spectra(sides)
    assert len(histories.axes) == len(spectra.axes) == 6
    for place, (over_time, by_frequency) in enumerate(zip(histories.axes, spectra.axes, strict=True)):
        sensor, axis = divmod(place, 3)
        kind, title = sides[0].kinds[sensor], f"{('angular rate', 'acceleration')[sensor]} {'xyz'[axis]}"
        assert over_time.get_title() == by_frequency.get_title() == title
        samples = over_time.lines[::2]
        curves = {line.get_label(): line.get_xydata() for line in by_frequency.lines}
        for side, line, name in zip(sides, samples, ("before", "after"), strict=True):
            np.testing.assert_array_equal(line.get_xydata(), np.column_stack(side.series(0, kind, axis)))
            np.testing.assert_array_equal(curves[name], np.column_stack(side.spectrum(kind, axis)[:2]))
        assert by_frequency.get_xlabel() == "frequency [Hz]"
    labels = histories.axes[0].get_legend_handles_labels()[1]
    assert labels == ["before: samples and their running mean", "after: samples and their running mean"]
    assert spectra.axes[0].get_legend_handles_labels()[1] == ["before", "after", NOISE_BAND]
    # the bias that was hidden stands in the lowest bins before, and is gone after
    before, after = (side.spectrum(Kind.ACCEL, 0).power[0] for side in sides)
    assert before > 2.0 * after


def test_the_present_model_alone_is_not_called_before(clean):
    side = residuals_of(clean.before)
    labels = figures.residual_histories([side], 0).axes[0].get_legend_handles_labels()[1]
    assert labels == ["samples and their running mean"]
    assert "residual" in figures.residual_spectra([side]).axes[0].get_legend_handles_labels()[1]


def test_bars_are_the_candidates_signal_to_noise_ratios():
    rows = [
        candidate(name="a", signal_to_noise=9.0),
        candidate(name="b", signal_to_noise=5.0),
        candidate(name="c", signal_to_noise=1.0, p_value_adjusted=0.5),
    ]
    axes = figures.candidate_strengths(rows, ("a",), 0.01).axes[0]
    bars = {(round(bar.get_y() + bar.get_height() / 2.0), bar.get_width()) for bar in axes.patches}
    assert bars == {(2, 9.0), (1, 5.0), (0, 1.0)}
    assert [label.get_text() for label in axes.get_yticklabels()] == ["a", "b", "c"]
    legend = [text.get_text() for text in axes.get_legend().get_texts()]
    assert legend == ["named", "significant", "not significant"]
    assert len({bar.get_facecolor() for bar in axes.patches}) == 3
    assert [text.get_text() for text in axes.texts] == ["9.0", "5.0", "1.0"]
    assert axes.get_xlabel() == "signal-to-noise ratio"


def test_the_reconstructed_wrench_is_drawn_with_its_uncertainty(disturbance):
    scale, time = 1e-6, disturbance.time[0]
    for frame in (Frame.BASE, Frame.INERTIAL):
        figure = figures.wrench_histories(disturbance, frame)
        torque = figure.axes[0]
        assert torque.get_title() == "torque x [$10^{-6}$ N m]"
        line = next(line for line in torque.lines if line.get_label() == "planar")
        np.testing.assert_allclose(
            line.get_xydata(), np.column_stack([time, disturbance.torque[frame][0][:, 0] / scale])
        )
        assert len(torque.collections) == (frame is Frame.BASE)  # the band of ± 1 sd
    band = figures.wrench_histories(disturbance, Frame.BASE).axes[0].collections[0].get_paths()[0].vertices
    value, sd = (part[0][:, 0] / scale for part in (disturbance.torque[Frame.BASE], disturbance.torque_sd))
    assert sd.min() > 0.0
    assert band[:, 1].min() == pytest.approx((value - sd).min())
    assert band[:, 1].max() == pytest.approx((value + sd).max())
    spectrum = figures.wrench_spectrum(disturbance).axes[0]
    frequency, amplitude = torque_amplitudes(disturbance, 0)
    drawn = spectrum.lines[0].get_xydata()
    np.testing.assert_array_equal(drawn[:, 0], frequency)
    np.testing.assert_allclose(drawn[:, 1] / amplitude[:, 0], drawn[0, 1] / amplitude[0, 0])
    assert spectrum.get_xlabel() == "frequency [Hz]"


def test_the_table_of_the_gain_compares_before_and_after(biased):
    before, after = biased.gain.before, biased.gain.after
    rows = {row[0]: row[1:] for row in tables.gain_rows(biased)}
    assert list(rows) == [
        "chi-square per sample",
        "share of residuals within 1 σ",
        *(f"rms residual of {name} [σ]" for name in before.rms),
    ]
    assert list(before.rms) == [f"{family}.{axis}" for family in ("rate", "accel") for axis in "xyz"]
    samples = biased.before.fit.posterior.samples
    assert rows["chi-square per sample"] == [
        f"{before.chi2_per_sample:.3f}",
        f"{after.chi2_per_sample:.3f}",
        f"1 ± {np.sqrt(2.0 / samples):.3f}",
    ]
    assert rows["share of residuals within 1 σ"] == [f"{before.inside:.3f}", f"{after.inside:.3f}", "0.683"]
    assert rows["rms residual of rate.x [σ]"] == [f"{before.rms['rate.x']:.3f}", f"{after.rms['rate.x']:.3f}", "1"]


def test_held_out_scores_are_tabled_by_recording(biased):
    names = [item.recording.name for item in biased.before.fit.posterior.manoeuvres]
    gain = replace(
        biased.gain,
        before=replace(biased.gain.before, held_out=np.array([-12.34])),
        after=replace(biased.gain.after, held_out=np.array([56.78])),
    )
    result = replace(biased, gain=gain)
    assert tables.gain_rows(result)[-2:] == [
        [f"held-out log score of {names[0]}", "−12.3", "56.8", "higher is better"],
        ["held-out log score, sum", "−12.3", "56.8", "higher is better"],
    ]
    assert "the log score of recordings predicted from the others rises by 69.12" in sentences.gain_sentence(result)


def test_the_table_of_shifts_has_every_inertial_parameter(biased):
    before, after = biased.gain.before.bodies, biased.gain.after.bodies
    rows = tables.shift_rows(biased)
    assert [row[0] for row in rows] == list(before.names)
    assert len(rows) == 10
    assert [row[1] for row in rows] == ["kg", "m", "m", "m", *["kg m²"] * 6]
    for k, row in enumerate(rows):
        assert row[2] == format_quantity(before.mean[k], before.sd[k])
        assert row[3] == format_quantity(after.mean[k], after.sd[k])
        assert float(row[4].replace("−", "-")) == pytest.approx(biased.gain.shift[k], abs=0.051)
        assert float(row[5]) == pytest.approx(after.sd[k] / before.sd[k], abs=6e-4)


def test_the_table_of_causes_has_prior_value_and_distance(biased):
    rows = tables.cause_rows(biased)
    amplitudes = amplitudes_of(biased.after, "accel-bias")
    assert [row[0] for row in rows] == [f"accel-bias.{axis}" for axis in "xyz"]
    for row, item in zip(rows, amplitudes, strict=True):
        assert row[1] == "m/s²"
        assert row[2].startswith("0 ± ")
        assert row[3:] == [format_quantity(item.mean, item.sd), f"{item.distance:.1f} sd"]


def test_the_table_of_hypotheses_starts_from_the_present_model(biased):
    tried = biased.search.tried
    assert len(tried) > 2
    rows = tables.hypothesis_rows(tried, biased.before)
    for row, hypothesis in zip(rows, tried, strict=True):
        assert row[0] == (" + ".join(hypothesis.labels) or "present model")
        assert row[2] == f"{hypothesis.fit.chi2 / hypothesis.fit.posterior.samples:.3f}"
        assert row[4:] == [hypothesis.outcome.worst, "yes" if hypothesis.adequate else "no"]
    present = next(row for row in rows if row[0] == "present model")
    assert present[1] == "0"
    assert present[5] == "no"
    named = next(row for row in rows if row[0] == "accel-bias")
    gain = biased.after.log_evidence - biased.before.log_evidence
    assert gain > 10.0
    assert named[1] == f"{gain:+.1f}"
    assert named[5] == "yes"


def test_the_assumptions_state_false_alarms_and_the_seed(biased):
    said = " ".join(sentences.method_sentences(biased))
    assert f"{len(biased.before.outcome.log_p)} tests" in said
    assert "less than 1 %" in said
    assert "Seed of all random numbers: 3." in said


def test_what_is_adequate_but_improbable_is_listed(biased):
    best = biased.after
    twin = SimpleNamespace(labels=("rate-bias",), adequate=True)
    strange = SimpleNamespace(labels=("accel-drift",), adequate=False)
    pair = SimpleNamespace(labels=("rate-bias", "accel-drift"), adequate=True)
    search = SimpleNamespace(tried=[best, twin, strange, pair])
    assert improbable_rivals(replace(biased, search=search)) == [twin]
    alias = replace(biased.verdict, equivalents={"accel-bias": ("rate-bias",)})
    assert improbable_rivals(replace(biased, search=search, verdict=alias)) == []


def test_the_table_of_rivals_says_by_how_much_the_best_leads(biased):
    rivals = [h for h in biased.search.tried if h.labels and h.labels != biased.after.labels]
    assert rivals
    for row, rival in zip(tables.rival_rows(biased, rivals), rivals, strict=True):
        assert row[0] == " + ".join(rival.labels)
        lead = biased.after.log_evidence - rival.log_evidence
        assert float(row[1].replace("−", "-")) == pytest.approx(lead, abs=0.051)
        assert lead > 0.0
        cosine = signal_cosine(biased.after, rival, biased)
        assert row[4] == ("" if cosine is None else f"{cosine:.3f}")
        added = [label for label in rival.labels if label != "accel-bias"]
        lost = "nothing" if "accel-bias" in rival.labels else "accel-bias"
        assert row[3] == f"{', '.join(added)} for {lost}"


@pytest.fixture
def printed(biased, clean, disturbance, tmp_path, monkeypatch):
    """Return a function that prints the report of a verdict and reads it."""
    module = import_module("bayesid.report.diagnosis_report")
    monkeypatch.setattr(module, "integration_error_at", lambda posterior, z: 1e-3)

    def read(status: Status) -> tuple[object, PdfText]:
        rivals = tuple(h for h in biased.search.tried if len(h.labels) == 1 and h.labels != biased.after.labels)[:2]
        result = {
            Status.EXPLAINED: lambda: biased,
            Status.ADEQUATE: lambda: clean,
            Status.AMBIGUOUS: lambda: judged(biased, Status.AMBIGUOUS, rivals),
            Status.UNKNOWN: lambda: replace(judged(biased, Status.UNKNOWN), unexplained=disturbance),
            Status.UNRESOLVED: lambda: judged(biased, Status.UNRESOLVED),
        }[status]()
        vars(result)["posterior"] = biased.before.fit.posterior  # for its sentences only; not built again
        diagnosis_report(result, None, "Träger #1 *bold*", tmp_path / "report.pdf")
        return result, PdfText.read(tmp_path / "report.pdf")

    return read


COMMON = ("Verdict", "Residuals of the simulation", "Candidates", "Hypotheses tried")
SECTIONS = {
    Status.EXPLAINED: (*COMMON, "The named causes", "Gain of the extension"),
    Status.AMBIGUOUS: (*COMMON, "The named causes", "Gain of the extension"),
    Status.ADEQUATE: (*COMMON, "Fit of the present model"),
    Status.UNKNOWN: (*COMMON, "The disturbance, reconstructed", "Fit of the present model"),
    Status.UNRESOLVED: (*COMMON, "The disturbance, reconstructed", "Fit of the present model"),
}


@pytest.mark.parametrize("status", list(Status))
def test_the_report_of_every_verdict_holds_its_sentences_and_tables(printed, status):
    result, text = printed(status)
    assert "Träger #1 *bold*" in text
    for number, title in enumerate((*SECTIONS[status], "Recommended experiments", "Assumptions"), start=1):
        assert f"{number} {title}" in text
    for sentence in (
        sentences.verdict_sentence(result),
        sentences.gain_sentence(result),
        sentences.alarm_sentence(result),
        *sentences.cause_sentences(result),
        *sentences.method_sentences(result),
        *model_sentences(result.posterior, 1e-3),
    ):
        assert sentence in text
    named = bool(result.verdict.causes)
    assert named == (status in (Status.EXPLAINED, Status.AMBIGUOUS))
    for row in tables.gain_rows(result):
        assert text.row(*row) if named else text.row(row[0], row[1], row[3])
    for row in tables.shift_rows(result):
        assert text.row(*row) if named else text.row(*row[:3])
    ranked = sorted(result.candidates, key=lambda row: (-row.signal_to_noise, -(row.log_bayes_factor or 0.0)))
    for row in tables.candidate_rows(ranked[:5], 0.01):
        assert text.row(*row)
    if named:
        for row in tables.cause_rows(result):
            assert text.row(*row)
    for row in joint_rows(result.posterior):
        assert text.row(*row)


def test_rivals_are_tabled_with_what_would_tell_them_apart(printed):
    result, text = printed(Status.AMBIGUOUS)
    assert result.verdict.rivals
    names = "; ".join(" + ".join(rival.labels) for rival in result.verdict.rivals)
    assert f"Explaining the data as well: {names}." in text
    for row in tables.rival_rows(result, result.verdict.rivals):
        assert text.row(*row)
    for sentence in sentences.advice_sentences(result, result.verdict.rivals):
        assert sentence in text


def test_an_unknown_cause_is_shown_as_a_torque_with_its_correlations(printed):
    result, text = printed(Status.UNKNOWN)
    assert sentences.wrench_sentence(result.unexplained) in text
    assert "signal-to-noise ratio of 12.0. It keeps its direction in base axes: its source is on board." in text
    for frame in ("base", "orbit (zenith, along-track, normal)", "inertial"):
        assert f"Reconstructed torque and force, {frame} axes." in text
    for row in tables.correlation_rows(torque_correlations(result.unexplained, result.before)):
        assert text.row(*row)
    assert "Nothing in the catalogue explains the residual." in text


def test_the_identification_follows_the_diagnosis(biased, tmp_path, monkeypatch):
    added = []
    module = import_module("bayesid.report.diagnosis_report")
    monkeypatch.setattr(module, "add_identification", lambda _, result, said: added.append(result))
    sampled = SimpleNamespace()
    diagnosis_report(biased, sampled, "Study", tmp_path / "report.pdf")
    assert added == [sampled]
    text = PdfText.read(tmp_path / "report.pdf")
    assert "Method of the diagnosis" in text
    assert "The extended model, sampled" in text
    assert "Assumptions" not in text
