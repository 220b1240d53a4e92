"""Reports of diagnoses: sentences and tables hold the result's numbers, figures draw its data, pages show both."""

import json
from dataclasses import replace
from functools import cache
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.spatial import ConvexHull

import bayesid.diagnosis
from bayesid._io.errors import InputError
from bayesid.app.diagnose_command import diagnose_study
from bayesid.app.schema import Study
from bayesid.diagnosis import (
    Candidate,
    CauseSet,
    DisturbingWrench,
    Frame,
    Hypothesis,
    ProbableVerdict,
    Remainder,
    SetProbabilities,
    Status,
    candidates,
    diagnose,
)
from bayesid.diagnosis.candidates.motion_errors import JOINT
from bayesid.diagnosis.evidence.cause_sets import CausePrior
from bayesid.diagnosis.noise import UnderstatedNoise
from bayesid.diagnosis.noise.noise_fault import FittedFault
from bayesid.diagnosis.outcome.candidate_table import CauseAmplitude, amplitudes_of
from bayesid.diagnosis.outcome.cause_sizes import VectorSize, vector_size
from bayesid.diagnosis.outcome.disturbance import torque_correlations
from bayesid.diagnosis.outcome.gain import strongest_recording
from bayesid.diagnosis.outcome.inseparable_causes import cause_cosines
from bayesid.diagnosis.outcome.motion_change import motion_change
from bayesid.diagnosis.outcome.torque_of_causes import torque_of_causes, torque_spectrum
from bayesid.inference.perturbed_posterior import trace
from bayesid.inference.predicted_readings import sensor_fits
from bayesid.inference.residual_view import ResidualView
from bayesid.recording.recording import Recording
from bayesid.report import diagnosis_report, figures
from bayesid.report.diagnosis import diagnosis_sentences as sentences
from bayesid.report.diagnosis.appendix import (
    CHOICES,
    GLOSSARY,
    bound_rows,
    candidate_rows,
    choice_text,
    robustness_sentence,
    sensitivity_rows,
)
from bayesid.report.diagnosis.cause_words import amplitude_text, size_text, vector_text
from bayesid.report.diagnosis.causes_page import cause_rows, set_rows
from bayesid.report.diagnosis.consequences_page import change_rows, correlation_rows, most_moved
from bayesid.report.diagnosis.decision_page import conditions_text, decision_entries, probability_rows
from bayesid.report.diagnosis.diagnosis_sentences import ANYTHING, action_sentence, advice, advice_sentences
from bayesid.report.diagnosis.evidence_page import gain_rows
from bayesid.report.diagnosis.limits_page import computation_sentence, method_sentences, pair_rows, unseen_rows
from bayesid.report.diagnosis.sampled_page import sampled_sentence
from bayesid.report.figures.diagnosis_figures import moved_axis
from bayesid.report.figures.residual_figures import NOISE_BAND
from bayesid.report.figures.robot_with_causes import cause_marks, view_of
from bayesid.report.model_assumptions import joint_rows, model_sentences
from bayesid.report.numbers import format_number, format_probability, format_quantity, format_text
from bayesid.robot.kinematics import kinematics
from bayesid.simulation.effects import known_effects
from bayesid.simulation.effects.effect_parameters import Quantity
from bayesid.simulation.model import Manoeuvre
from bayesid.simulation.sensors import SensorKind
from tests.conftest import POINT, SIGMA
from tests.pdf_text import PdfText

NAMING = (Status.EXPLAINED, Status.PARTLY_EXPLAINED, Status.AMBIGUOUS)
BIAS = 4e-5
HIDDEN = ["accel-bias", "accel-drift", "rate-bias", "wheel-momentum", "thruster-leak"]
ALTERNATIVES = (("rate-bias", "wheel-momentum"), (), ("unknown",))
"""Besides the bias, of the ambiguous verdict."""


def with_bias(manoeuvre: Manoeuvre, size: float) -> Manoeuvre:
    recording = manoeuvre.recording
    channels = dict(recording.channels)
    channels["accel.x"] = channels["accel.x"] + size
    return replace(manoeuvre, recording=Recording(recording.name, None, recording.time, channels))


def diagnosed(planar_case, bias: float):
    model = planar_case.posterior.model
    effects = [effect for effect in candidates(model) if effect.label in HIDDEN]
    return diagnose(model, [with_bias(item, bias) for item in planar_case.posterior.manoeuvres], 3, effects=effects)


@pytest.fixture(scope="module")
def biased(planar_case):
    """A small study whose accelerometer reads a constant that the model does not know."""
    return diagnosed(planar_case, BIAS)


@pytest.fixture(scope="module")
def clean(planar_case):
    """The same study without the constant."""
    return diagnosed(planar_case, 0.0)


def judged(result, status: Status, *others: tuple[str, ...], **same: tuple[str, ...]):
    """A diagnosis with another verdict on the same probabilities; ``same`` are equivalents, dashes as underscores."""
    named = status in NAMING
    equivalent = {cause.replace("_", "-"): names for cause, names in same.items()}
    verdict = ProbableVerdict(status, ("accel-bias",) if named else (), equivalent, others)
    return replace(result, sensitivity=replace(result.sensitivity, verdict=verdict))


def weighed(result, *sets: tuple[tuple[str, ...], str | None, float]):
    """A diagnosis whose sets have given log evidences."""
    found = SetProbabilities.of(
        [CauseSet((), None, 0.0), *(CauseSet(*item) for item in sets)],
        result.probabilities.causes,
        result.probabilities.generics,
        CausePrior(),
    )
    return replace(result, search=replace(result.search, probabilities=found))


@pytest.fixture(scope="module")
def disturbance(biased) -> DisturbingWrench:
    """A torque about x that follows the first joint's position."""
    base = biased.before.fit
    time = np.asarray(base.operating.node.environment.time)[0]
    position = base.posterior.manoeuvres[0].motion.evaluate(time).position[:, 0]
    torque = np.stack([1e-3 * position, 0.0 * time, 0.0 * time], axis=1)
    same = {frame: [torque] for frame in Frame}
    sd = [np.full_like(torque, 1e-4)]
    return DisturbingWrench(12.0, ("planar",), (0,), [time], same, same, sd, sd, Frame.BASE, 50.0)


def candidate(**changes) -> Candidate:
    fields = {
        "name": "accel-bias",
        "probability": 0.98,
        "signal_to_noise": 20.0,
        "p_value": 1e-30,
        "p_value_adjusted": 1e-28,
        "log_bayes_factor": 180.0,
        "quantities": tuple(Quantity(axis, "m/s2") for axis in "xyz"),
        "mean": np.array([1e-5, 0.0, 0.0]),
        "sd": np.array([1e-6, 1e-6, 1e-6]),
        "upper_limit": np.array([1.2e-5, 2e-6, 2e-6]),
        "power": 0.9,
    }
    return Candidate(**{**fields, **changes})


def residuals_of(hypothesis: Hypothesis) -> ResidualView:
    return hypothesis.fit.view


def test_sentences_name_the_cause_its_probability_its_size_and_what_it_gains(biased):
    said = list(sentences.diagnosis_sentences(biased))
    assert said[0].startswith("Explained by accel-bias")
    assert "Its probability is more than 0.999." in said[0]
    assert "The accelerometer reads a constant value in free fall." in said[1]
    assert "Its probability is more than 0.999." in said[1]
    assert "m/s²" in said[1]
    assert "chi-square per sample goes from" in said[-1]
    assert "base_link." in said[-1]
    assert "log score" not in said[-1]  # one recording
    assert len(said) == 3


@pytest.mark.parametrize("status", list(Status))
def test_every_status_is_said_with_its_gain_and_its_test(biased, clean, status):
    result = judged(clean if status is Status.ADEQUATE else biased, status)
    assert sentences.verdict_sentence(result).lower().startswith(status.value.replace("-", " "))
    named = status in NAMING
    before, after = result.gain.before, result.gain.after
    gain, alarm = sentences.gain_sentence(result), sentences.alarm_sentence(result)
    assert f"{before.chi2_per_sample:.3f}" in gain
    assert (f"to {after.chi2_per_sample:.3f}" in gain) is named
    assert (f"{100.0 * before.inside:.1f} % of the residuals lie within one σ" in gain) is not named
    assert f"Of {result.alarm.tests} tests" in alarm
    assert f"that for {result.alarm.loudest} (p " in alarm
    assert ("no alarm is raised" in alarm) is (status is Status.ADEQUATE)


@pytest.mark.parametrize(
    ("probability", "text"),
    [
        (0.02, "An unnamed cause in addition to it is improbable (probability 0.020)."),
        (0.3, "Whether an unnamed cause acts in addition to it is undecided (probability 0.30)."),
        (0.98, "A single unnamed cause that resembles it would lead to the same verdict."),
    ],
)
def test_what_remains_beside_the_named_cause_is_said(biased, probability, text):
    verdict = ProbableVerdict(Status.PARTLY_EXPLAINED, ("accel-bias",), remainder=Remainder.of(probability))
    said = sentences.verdict_sentence(replace(biased, sensitivity=replace(biased.sensitivity, verdict=verdict)))
    assert said.startswith("Partly explained by accel-bias. Its probability is more than 0.999.")
    assert said.endswith(text)


def test_the_alternatives_are_said_with_their_probabilities_and_other_names(biased):
    result = weighed(
        judged(biased, Status.AMBIGUOUS, *ALTERNATIVES, wheel_momentum=("a", "b")),
        (("accel-bias",), None, 2.0),
        (("rate-bias", "wheel-momentum"), None, 6.0),
        (("rate-bias",), "error of accel", 4.0),
    )
    verdict, cause, *others, gain = sentences.diagnosis_sentences(result)
    assert "are accel-bias; or rate-bias + wheel-momentum; or nothing; or something unknown." in verdict
    p = [result.probability_of(names) for names in (("accel-bias",), *ALTERNATIVES)]
    assert len({format_probability(value) for value in p}) == 4  # so that none can stand for another
    assert sum(p) == pytest.approx(1.0)
    assert f"Its probability is {format_probability(p[0])}." in cause
    assert others == [
        f"Alternative: rate-bias + wheel-momentum (probability {format_probability(p[1])}). "
        "Equivalent to wheel-momentum: a and b.",
        f"Alternative: nothing (probability {format_probability(p[2])}).",
        f"Alternative: something unknown (probability {format_probability(p[3])}).",
    ]
    assert gain.startswith("Effect on the fit")


def test_an_alternative_holds_what_accompanies_it_and_a_cause_its_equivalents(biased):
    sets = ((("accel-bias",), None, 3.0), (("accel-bias", "rate-bias"), None, 5.0), (("thruster-leak",), None, 2.0))
    result = replace(weighed(biased, *sets), classes=(("accel-bias", "thruster-leak"), ("rate-bias",)))
    p = {item.names: item.probability for item in result.probabilities.sets}
    assert result.probability_of(()) == pytest.approx(p[()])
    pair = p["accel-bias", "rate-bias"]
    assert result.probability_of(("accel-bias", "rate-bias")) == pytest.approx(pair)
    either = pair + p["accel-bias",] + p["thruster-leak",]
    assert result.cause_probability("thruster-leak") == pytest.approx(either)
    assert probability_rows(result, 1) == [
        ["accel-bias or thruster-leak", format_probability(either)],
        ["something unknown", "< 0.001"],
        ["nothing", format_probability(p[()])],
    ]


def test_what_is_unknown_is_said_with_the_most_probable_generic_candidate(biased):
    result = weighed(judged(biased, Status.UNKNOWN), ((), "error of accel", 9.0), ((), "disturbing torque", 5.0))
    said = sentences.verdict_sentence(result)
    assert f"(probability {format_probability(result.probabilities.unknown)})" in said
    assert said.endswith("the most probable is: error of accel.")


def test_what_follows_the_motion_is_said_with_its_joint(biased):
    point = biased.search.searches[0].point
    said = sentences.verdict_sentence(weighed(judged(biased, Status.UNKNOWN), ((), JOINT, 9.0)))
    assert said.endswith(f"the most probable is: {point.most_probable_form(JOINT, (JOINT,)).name}.")
    assert said.removesuffix(".").endswith(tuple(joint.name for joint in point.fit.posterior.model.robot.joints))


def test_what_is_unresolved_is_said_with_the_most_probable_sets(biased):
    result = weighed(judged(biased, Status.UNRESOLVED), (("rate-bias",), None, 5.5), (("accel-drift",), None, 5.0))
    first, second, third = result.probabilities.sets
    words = [
        f"{name} (probability {item.probability:.2f})"
        for name, item in zip(("rate-bias", "accel-drift", "nothing"), (first, second, third), strict=True)
    ]
    assert sentences.verdict_sentence(result).endswith(f"are: {'; '.join(words)}.")


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.9996, "> 0.999"), (0.0004, "< 0.001"), (0.9712, "0.971"), (0.93, "0.93"), (0.0123, "0.012"), (0.5, "0.50")],
)
def test_probabilities_are_rounded_less_near_zero_and_one(value, text):
    assert format_probability(value) == text


def test_units_and_powers_in_reasons_are_raised():
    said = "Air of 3.6e-12 kg/m3 on 2.07 m2, A m2 (NASA SP-8018), 0.01 m/s2, link3, e2."
    assert format_text(said) == "Air of 3.6 × 10⁻¹² kg/m³ on 2.07 m², A m² (NASA SP-8018), 0.01 m/s², link3, e2."


def test_the_parameter_that_moves_most_is_named(biased):
    shift = biased.gain.shift
    k = int(np.argmax(np.abs(shift)))
    size = f"{shift[k]:+.1f}".replace("-", "−")
    name = biased.gain.before.bodies.names[k]
    said = sentences.gain_sentence(biased)
    assert f"parameter that changes most is {name}, by {size} standard deviations of the fit without" in said


def test_equivalents_are_other_names(biased):
    result = judged(biased, Status.EXPLAINED, accel_bias=("a", "b"))
    assert "Equivalent causes: a and b." in next(sentences.cause_sentences(result))


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


def test_a_vector_has_its_magnitude_and_direction(biased):
    size = vector_size(biased.after, "accel-bias")
    values = np.array([item.mean for item in amplitudes_of(biased.after, "accel-bias")])
    assert size.magnitude == pytest.approx(np.linalg.norm(values))
    np.testing.assert_allclose(size.direction, values / np.linalg.norm(values))
    assert abs(size.magnitude - BIAS) < 3.0 * size.sd
    assert np.arccos(size.direction[0]) < size.angle < 0.3  # it was hidden along x
    assert size_text(biased.after, "accel-bias") == vector_text(size)
    assert vector_text(size).endswith("°")
    assert " m/s² along (" in vector_text(size)


def test_the_cone_and_the_interval_of_a_vector_hold_95_percent():
    rng = np.random.default_rng(0)
    mean, root = np.array([3.0, -1.0, 0.5]), 0.05 * rng.normal(size=(3, 3))
    size = VectorSize.of_normal("N", mean, root @ root.T)
    drawn = mean + rng.normal(size=(20000, 3)) @ root.T
    length = np.linalg.norm(drawn, axis=1)
    assert np.mean(np.abs(length - size.magnitude) < 1.96 * size.sd) == pytest.approx(0.95, abs=0.01)
    inside = np.mean(np.arccos(drawn @ size.direction / length) < size.angle)
    assert 0.94 < inside < 0.999
    assert not VectorSize.of_normal("N", mean, 100.0 * np.eye(3)).directed


def test_a_candidate_that_is_not_seen_has_a_limit():
    seen, faint, noise = candidate_rows(
        [
            candidate(),
            candidate(p_value_adjusted=0.4, probability=0.01, log_bayes_factor=-2.0),
            candidate(quantities=(), mean=np.zeros(0), sd=np.zeros(0), power=None, log_bayes_factor=None),
        ],
        0.01,
    )
    assert seen == [
        "accel-bias",
        "0.980",
        "20.0",
        "< 10⁻¹²",
        "+180.0",
        "x (1.00 ± 0.10) × 10⁻⁵, y (0.0 ± 1.0) × 10⁻⁶, z (0.0 ± 1.0) × 10⁻⁶ m/s²",
        "0.90",
    ]
    assert faint[1] == "0.010"
    assert faint[4] == "−2.0"
    assert faint[5] == "x < 1.2 × 10⁻⁵, y < 2 × 10⁻⁶, z < 2 × 10⁻⁶ m/s²"
    assert noise[4] == noise[6] == ""


def test_candidates_out_of_reach_are_those_of_low_power(biased):
    rows = [candidate(power=0.9), candidate(name="b", power=0.3), candidate(name="c", power=0.1), candidate(power=None)]
    unseen = replace(biased, candidates=rows).unseen_candidates
    assert [row.name for row in unseen] == ["c", "b"]
    assert unseen_rows(unseen[:1]) == [["c", "0.10", "x < 1.2 × 10⁻⁵, y < 2 × 10⁻⁶, z < 2 × 10⁻⁶ m/s²"]]


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


def test_the_advice_is_on_the_causes_in_which_the_alternatives_differ(biased):
    result = judged(biased, Status.AMBIGUOUS, ("accel-bias", "rate-bias"), ("wheel-momentum", "accel-bias", "unknown"))
    *said, design = advice_sentences(result)
    assert said == [f"{name}: {advice(name)}" for name in ("rate-bias", "wheel-momentum")]
    assert design.endswith("bayesid design STUDY.toml --separate rate-bias wheel-momentum")
    assert f"rate-bias: {advice('rate-bias')}" in action_sentence(result)
    assert result.rivals == ("rate-bias", "wheel-momentum")
    assert list(advice_sentences(judged(biased, Status.EXPLAINED))) == []
    assert judged(biased, Status.EXPLAINED).rivals is None


def test_rivals_of_an_unresolved_verdict_are_the_most_probable_of_unknown_size(biased):
    """A fault of the noise has no size that a manoeuvre could tell from another's."""
    sets = ((("rate-noise",), None, 40.0), (("accel-bias",), None, 38.0), (("rate-bias",), None, 37.0))
    assert judged(weighed(biased, *sets), Status.UNRESOLVED).rivals == ("accel-bias", "rate-bias")


def test_what_to_do_follows_from_the_verdict(biased):
    said = {status: action_sentence(judged(biased, status)) for status in Status}
    assert len(set(said.values())) == len(Status)
    assert said[Status.EXPLAINED] == "Add accel-bias to the model's effects and use the values fitted with it."
    assert said[Status.ADEQUATE] == "Use the model as it is."


def test_a_cause_imitates_itself_and_others_less(biased):
    largest, smallest = cause_cosines(biased.evidence, "accel-bias", "accel-drift")
    # a drift grows from zero to twice its mean: in white noise the cosine with a constant is the root of 3/4
    assert 0.5 < smallest <= largest < 0.95
    assert cause_cosines(biased.evidence, "accel-drift", "accel-bias") == pytest.approx((largest, smallest))
    pairs = biased.inseparable_pairs[:20]
    assert {(pair.first, pair.second) for pair in pairs} == {("accel-bias", name) for name in HIDDEN[1:]}
    smallest = [pair.smallest for pair in pairs]
    assert smallest == sorted(smallest, reverse=True)
    drift = next(pair for pair in pairs if pair.second == "accel-drift")
    assert (drift.largest, drift.smallest) == pytest.approx(cause_cosines(biased.evidence, "accel-bias", "accel-drift"))


def test_equivalents_stand_first_among_the_pairs(biased):
    result = replace(biased, classes=(("accel-bias", "wheel-momentum"),))
    first, second, *_ = pair_rows(result.inseparable_pairs[:20])
    assert [first[1], first[5], second[5]] == ["wheel-momentum", "equivalent", ""]


def test_the_disturbance_moves_with_what_drives_it(biased, disturbance):
    correlations = torque_correlations(disturbance, biased.before)
    axis, name, value = correlations[0]
    assert (axis, name) == ("torque x", f"position of {biased.before.fit.posterior.model.robot.joints[0].name}")
    assert value == pytest.approx(1.0)
    sizes = [abs(item.correlation) for item in correlations]
    assert sizes == sorted(sizes, reverse=True)
    assert {item.component for item in correlations} == {"torque x"}  # the others are zero
    assert correlation_rows(correlations)[0] == ["torque x", name, "+1.00"]


def test_the_spectrum_of_a_wave_is_its_amplitude():
    time = np.linspace(0.0, 100.0, 401)
    wave = 0.3 * np.cos(2.0 * np.pi * 0.05 * time)
    torque = [np.stack([wave, 0.0 * time, 0.0 * time], axis=1)]
    same = dict.fromkeys(Frame, torque)
    disturbance = DisturbingWrench(1.0, ("a",), (0,), [time], same, same, torque, torque, None, 0.0)
    frequency, amplitude = torque_spectrum(disturbance, 0)
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
    again = ResidualView.at(biased.before.fit.posterior, biased.before.fit.z)
    np.testing.assert_allclose(again.values, side.values, atol=1e-6)


def test_histories_and_spectra_draw_the_residuals_before_and_after(biased):
    sides = [residuals_of(biased.before), residuals_of(biased.after)]
    histories, spectra = figures.plot_residuals(sides, 0), figures.plot_spectrum(sides)
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
    before, after = (side.spectrum(SensorKind.ACCEL, 0).power[0] for side in sides)
    assert before > 2.0 * after


def test_the_present_model_alone_is_not_called_before(clean):
    side = residuals_of(clean.before)
    labels = figures.plot_residuals([side], 0).axes[0].get_legend_handles_labels()[1]
    assert labels == ["samples and their running mean"]
    assert "residual" in figures.plot_spectrum([side]).axes[0].get_legend_handles_labels()[1]


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
    frequency, amplitude = torque_spectrum(disturbance, 0)
    drawn = spectrum.lines[0].get_xydata()
    np.testing.assert_array_equal(drawn[:, 0], frequency)
    np.testing.assert_allclose(drawn[:, 1] / amplitude[:, 0], drawn[0, 1] / amplitude[0, 0])
    assert spectrum.get_xlabel() == "frequency [Hz]"


def test_a_force_that_nothing_sees_is_not_drawn(disturbance):
    blank = {frame: [np.full_like(value, np.nan) for value in values] for frame, values in disturbance.force.items()}
    drawn = figures.wrench_histories(replace(disturbance, force=blank), Frame.BASE)
    assert [axes.get_title()[:6] for axes in drawn.axes] == ["torque"] * 3
    assert [axes.get_xlabel() for axes in drawn.axes] == ["time [s]"] * 3


def test_the_table_of_the_gain_compares_before_and_after(biased):
    before, after = biased.gain.before, biased.gain.after
    rows = {row[0]: row[1:] for row in gain_rows(biased)}
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
    assert gain_rows(result)[-2:] == [
        [f"left-out log score of {names[0]}", "−12.3", "56.8", "higher is better"],
        ["left-out log score, sum", "−12.3", "56.8", "higher is better"],
    ]
    assert "the log score of recordings predicted from the others rises by 69.12" in sentences.gain_sentence(result)


def test_the_parameters_are_those_given_and_of_both_fits(biased):
    before, after = biased.gain.before.bodies, biased.gain.after.bodies
    changes = biased.parameter_changes
    given = biased.before.fit.posterior.model.bodies[0].centre
    assert [item.name for item in changes] == list(before.names)
    assert [item.unit for item in changes] == ["kg", "m", "m", "m", *["kg m2"] * 6]
    assert changes[0].given == pytest.approx(given.mass)
    np.testing.assert_allclose([item.given for item in changes[1:4]], given.com)
    # the logarithm of the mass is normal with twice the spread
    spread = biased.before.fit.posterior.model.bodies[0].spread
    assert changes[0].prior_sd == pytest.approx(given.mass * np.sinh(2.0 * spread), rel=0.1)
    rows = change_rows(changes)
    for k, (row, item) in enumerate(zip(rows, changes, strict=True)):
        assert row[2:4] == [format_number(item.given, 4), format_number(item.prior_sd, 2)]
        assert row[4] == format_quantity(before.mean[k], before.sd[k])
        assert row[5] == format_quantity(after.mean[k], after.sd[k])
        assert float(row[6].replace("−", "-")) == pytest.approx(biased.gain.shift[k], abs=0.051)
    assert [row[:5] for row in rows] == change_rows(changes, named=False)


def test_those_that_move_most_stand_in_their_usual_order(biased):
    changes = biased.parameter_changes
    moved = most_moved(changes, 3)
    assert moved == [item for item in changes if item in moved]
    least = min(abs(item.shift) for item in moved)
    assert all(abs(item.shift) <= least for item in changes if item not in moved)


def test_the_errors_are_in_the_units_of_the_sensors(biased):
    rate, accel = biased.simulation_errors
    assert (rate.kind, accel.kind) == (SensorKind.RATE, SensorKind.ACCEL)
    for item in (rate, accel):
        assert item.noise == pytest.approx(np.sqrt(3.0) * SIGMA)
        rms = [biased.gain.before.rms[f"{item.kind.value}.{axis}"] for axis in "xyz"]
        assert item.before == pytest.approx(SIGMA * np.linalg.norm(rms))
    assert accel.before > 1.5 * accel.after


def test_the_strongest_recording_is_the_one_that_gains_most(biased):
    def model(*residual):
        return SimpleNamespace(fit=SimpleNamespace(posterior=two, residual=np.array(residual)))

    two = SimpleNamespace(residual_shape=(2, 2, 1))
    assert strongest_recording(model(3.0, 0.0, 0.0, 2.0), model(2.9, 0.0, 0.0, 0.0)) == 1
    assert strongest_recording(model(3.0, 0.0, 0.0, 2.0), None) == 0


def test_the_table_of_causes_has_value_distance_and_bound(biased):
    rows = cause_rows(biased)
    amplitudes = amplitudes_of(biased.after, "accel-bias")
    assert [row[0] for row in rows] == [f"accel-bias.{axis}" for axis in "xyz"]
    for row, item in zip(rows, amplitudes, strict=True):
        assert row[1:] == ["m/s²", format_quantity(item.mean, item.sd), f"{item.distance:.1f} sd", "0.049"]


def test_the_most_probable_sets_have_sizes_beside_their_bounds(biased):
    best = biased.probabilities.sets[0]
    assert best.causes == ("accel-bias",)
    (size,) = biased.sizes_of(best)
    values = [item.mean for item in amplitudes_of(biased.after, "accel-bias")]
    assert size.size == pytest.approx(np.sqrt(np.mean(np.square(values))), rel=0.05)
    (bound,) = biased.bounds["accel-bias"]
    assert (size.unit, size.largest) == ("m/s2", bound.largest)
    assert size.share == pytest.approx(size.size / bound.largest)
    rows = set_rows(biased, 4)
    assert rows[0][:3] == ["accel-bias", format_probability(best.probability), f"{best.log_evidence:+.1f}"]
    assert rows[0][4] == "0.049 m/s²"
    firsts = [row for row in rows if row[1]]
    assert [row[1] for row in firsts] == [
        format_probability(item.probability) for item in biased.probabilities.sets[:4]
    ]
    for item, row in zip(biased.probabilities.sets[:4], firsts, strict=True):
        place = rows.index(row)
        assert row[0] == item.names[0]
        if len(item.names) > 1:
            assert f"+ {item.names[1]}" in [other[0] for other in rows[place : place + 3]]


def test_a_size_beyond_its_bound_is_called_so_and_nothing_has_none(biased):
    small = {"accel-bias": tuple(replace(item, largest=1e-6) for item in biased.bounds["accel-bias"])}
    state = biased.search.searches[0]
    causes = [cause.rescaled(state.point.evidence.gram, 1e-6 / 0.049) for cause in state.point.evidence.causes.values()]
    evidence = type(state.point.evidence)(state.point.evidence.gram, causes)
    states = (replace(state, point=replace(state.point, evidence=evidence)),)
    result = weighed(biased, (("accel-bias",), None, 9.0))
    result = replace(result, bounds=small, search=replace(result.search, searches=states))
    named, nothing = set_rows(result, 2)
    assert named[4] == "10⁻⁶ m/s²" or named[4] == "1 × 10⁻⁶ m/s²"
    assert named[5].endswith(", beyond it")
    assert nothing == ["nothing", nothing[1], "0", "", "", ""]


def test_the_sensitivity_says_under_which_choices_the_verdict_is_another(biased):
    first = next(iter(biased.sensitivity.others))
    other = ProbableVerdict(Status.AMBIGUOUS, ("accel-bias",), {}, ((),))
    changed = replace(biased.sensitivity, others={**biased.sensitivity.others, first: other})
    result = replace(biased, sensitivity=changed)
    assert sensitivity_rows(result) == [[choice_text(first), "ambiguous: accel-bias or nothing"]]
    said, others = robustness_sentence(result), list(biased.sensitivity.others)
    assert said.startswith(
        f"The verdict would change under 1 of {len(others)} other choices. It remains the same with "
    )
    assert [name for name in others if choice_text(name) in said] == others[1:]
    assert robustness_sentence(biased).startswith(
        f"The verdict is the same under each of {len(others)} other choices: "
    )
    assert all(choice_text(name) in robustness_sentence(biased) for name in others)
    assert set(CHOICES) == set(others)  # no name of a key reaches the reader
    assert sensitivity_rows(biased) == []


def test_the_bounds_have_their_reasons(biased):
    rows = bound_rows(dict(biased.bounds))
    assert ["accel-bias", "0.049 m/s²", biased.bounds["accel-bias"][0].reason] in rows
    assert len(rows) == sum(map(len, biased.bounds.values()))
    assert [row[0] for row in rows if row[0]] == sorted(HIDDEN)


def test_the_method_states_false_alarms_the_prior_and_the_seed(biased):
    said = " ".join(method_sentences(biased))
    assert f"{biased.alarm.tests} tests" in said
    assert "less than 1 %" in said
    prior = biased.probabilities.prior
    assert f"with a probability of {prior.one_more:g}" in said
    assert "Seed of all random numbers: 3." in said
    listed = {row.name for row in biased.candidates}
    assert all((name in said) is (name not in listed) for name in biased.probabilities.causes)
    assert f"{sum(biased.seconds.values()):.1f} s in total" in computation_sentence(biased)


def test_the_conditions_name_uncertain_links(biased):
    assert conditions_text(biased.after).startswith("Links exact, geometry exact, noise white")
    model = biased.after.fit.posterior.model
    loose = SimpleNamespace(
        model=SimpleNamespace(priors=[SimpleNamespace(nuisance=True, spread=0.05)], sensors=model.sensors)
    )
    found = conditions_text(SimpleNamespace(fit=SimpleNamespace(posterior=loose), faults=()))
    assert found.startswith("Links uncertain by 5 %")


def test_the_cause_is_drawn_where_it_acts(biased):
    manoeuvre = biased.before.fit.posterior.manoeuvres[0]
    robot = biased.before.fit.posterior.model.robot
    pose = kinematics(robot, manoeuvre.motion.evaluate(manoeuvre.recording.time[:1])).pose[0]
    (mark,) = cause_marks(biased.after, pose)
    assert mark.label == "accel-bias"
    np.testing.assert_allclose(mark.point, POINT)  # where the accelerometer is
    assert mark.vector.direction[0] > 0.95
    robot_panel, before, after = figures.plot_verdict(biased, 0).axes
    assert "accel-bias" in [text.get_text() for text in robot_panel.texts]
    assert (before.get_title(), after.get_title()) == ("acceleration x, before", "acceleration x, after")
    for axes, side in ((before, biased.before), (after, biased.after)):
        drawn = axes.lines[0].get_xydata()
        np.testing.assert_array_equal(drawn, np.column_stack(residuals_of(side).series(0, SensorKind.ACCEL, 0)))
    assert moved_axis([residuals_of(biased.before), residuals_of(biased.after)], 0) == (SensorKind.ACCEL, 0)


def test_no_cause_is_drawn_where_none_is_named(clean):
    robot_panel, residual = figures.plot_verdict(clean, 0).axes
    assert {text.get_text() for text in robot_panel.texts} - {"x", "y", "z"} == {"0.5 m"}  # axes and their scale alone
    assert "before" not in residual.get_title()


def test_the_forest_shows_what_was_given_and_both_fits(biased):
    changes = biased.parameter_changes
    axes = figures.parameter_forest(changes).axes[0]
    assert axes.get_legend_handles_labels()[1] == ["given, prior", "without", "with"]
    given, without, fitted = (np.asarray(container.lines[0].get_xdata(), float) for container in axes.containers)
    np.testing.assert_array_equal(without, 0.0)
    np.testing.assert_allclose(given, [(item.given - item.without) / item.without_sd for item in changes])
    np.testing.assert_allclose(fitted, [item.shift for item in changes])
    low, high = axes.get_xlim()  # both fits are seen as bars, however wide the prior is
    assert low < min(fitted.min(), -1.96)
    assert high > max(fitted.max(), 1.96)
    assert high - low < 4.0 * max(np.abs(fitted).max(), 1.96) + 12.0
    beyond = [f"given at {value:+.0f}".replace("-", "−") for value in given if not low <= value <= high]
    assert [text.get_text() for text in axes.texts] == beyond
    assert [label.get_text() for label in axes.get_yticklabels()] == [item.name for item in changes]


def test_what_is_no_effect_is_put_elsewhere_into_the_model(biased):
    verdict = ProbableVerdict(Status.EXPLAINED, ("initial-rate", "rate-noise"))
    fault = FittedFault(UnderstatedNoise(SensorKind.RATE), np.array([2.5]), np.array([0.1]), biased.posterior)
    after = replace(biased.after, faults=(fault,))
    result = replace(biased, after=after, sensitivity=replace(biased.sensitivity, verdict=verdict))
    assert action_sentence(result) == (
        'Treat the initial rates as unknown, state under [model.noise] "rate-noise" = { factor = 2.5 } and use the '
        "values fitted with them."
    )


def test_the_torque_of_the_causes_is_that_of_their_formulas(biased):
    assert torque_of_causes(biased.after) is None  # a reading, not a torque
    both = biased.fitted(("wheel-momentum", "thruster-leak"))
    values = {effect.label: both.fit.values(index) for index, effect in enumerate(both.fit.effects)}
    node = both.fit.operating.node
    rate, com = np.asarray(node.rate)[0], np.asarray(node.body.com)[0]
    leak = np.ravel(values["thruster-leak"])
    expected = leak[3:] - np.cross(com, leak[:3]) - np.cross(rate, np.ravel(values["wheel-momentum"]))
    (torque,) = torque_of_causes(both)
    assert len(torque) == len(biased.disturbance.time[0])
    own = np.concatenate([[True], np.diff(np.asarray(node.environment.time)[0]) > 0.0])
    np.testing.assert_allclose(torque, expected[own], atol=1e-12)
    drawn = figures.wrench_histories(biased.disturbance, Frame.BASE, [torque]).axes[0]
    dashed = next(line for line in drawn.lines if line.get_linestyle() == "--" and len(line.get_xdata()))
    ratio = dashed.get_ydata() / torque[:, 0]
    np.testing.assert_allclose(ratio, ratio[0])


@pytest.fixture(scope="module")
def readings(biased):
    """Measured and simulated with the present model, for pictures only."""
    fit = biased.before.fit
    return sensor_fits(fit.posterior, fit.z)


RECORD, ADVICE, ORIGIN = "Right in 97 of 100 cases.", "Fly next.csv, 60 s.", "study.toml 0a1b; seed 3"


@pytest.fixture(scope="module")
def printed(biased, clean, disturbance, readings, tmp_path_factory):
    """Return a function that prints the report of a verdict, once, and reads it."""
    module = import_module("bayesid.report.diagnosis.diagnosis_report")
    file = tmp_path_factory.mktemp("printed") / "report.pdf"

    @cache
    def read(status: Status) -> tuple[object, PdfText]:
        result = {
            Status.EXPLAINED: lambda: judged(biased, Status.EXPLAINED),
            Status.ADEQUATE: lambda: judged(clean, Status.ADEQUATE),
            Status.PARTLY_EXPLAINED: lambda: judged(biased, Status.PARTLY_EXPLAINED),
            Status.AMBIGUOUS: lambda: judged(biased, Status.AMBIGUOUS, *ALTERNATIVES),
            Status.UNKNOWN: lambda: replace(
                judged(biased, Status.UNKNOWN), disturbance=disturbance, unexplained=disturbance
            ),
            Status.UNRESOLVED: lambda: judged(biased, Status.UNRESOLVED),
        }[status]()
        vars(result)["posterior"] = biased.before.fit.posterior  # for its sentences only; not built again
        diagnosis_report(replace(result, advice=ADVICE), "Träger #1 *bold*", file, record=RECORD, origin=ORIGIN)
        return result, PdfText.read(file)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "integration_error_at", lambda posterior, z: 1e-3)
        patch.setattr(module, "sensor_fits", lambda posterior, z: readings)
        yield read


@pytest.mark.slow
def test_a_report_is_written_where_the_extended_model_cannot_be_simulated(biased, tmp_path, monkeypatch):
    def refuse(after):
        raise InputError("the simulation gives no finite readings")

    result = judged(biased, Status.EXPLAINED)
    monkeypatch.setattr(import_module("bayesid.diagnosis.result"), "extended_posterior", refuse)
    diagnosis_report(result, "Lost motion", tmp_path / "report.pdf")
    text = PdfText.read(tmp_path / "report.pdf")
    assert "neither simulated in full nor sampled: the simulation gives no finite readings." in text
    assert "Measured and simulated" not in text
    assert "Consequences" in text


SECTIONS = {
    True: ("Evidence", "Why this cause", "Consequences"),
    False: ("Evidence", "Possible causes", "Inertial parameters and the disturbance"),
}
STATUSES = [
    Status.EXPLAINED,
    *(pytest.param(status, marks=pytest.mark.slow) for status in Status if status is not Status.EXPLAINED),
]
LAST = ("Next experiment and limits", "Measured and simulated", "Assumptions", "Appendix: robustness of the verdict")


@pytest.mark.parametrize("status", STATUSES)
def test_the_report_of_every_verdict_holds_its_sentences_and_tables(printed, status):
    result, text = printed(status)
    named = status in (Status.EXPLAINED, Status.PARTLY_EXPLAINED, Status.AMBIGUOUS)
    assert "Träger #1 *bold*" in text
    for number, title in enumerate((*SECTIONS[named], *LAST), start=1):
        assert f"{number} {title}" in text
    for sentence in (
        sentences.verdict_sentence(result),
        sentences.alarm_sentence(result),
        action_sentence(result),
        robustness_sentence(result),
        *advice_sentences(result),
        *method_sentences(result),
        computation_sentence(result),
        *model_sentences(result.posterior, 1e-3),
        *(meaning for _, meaning in GLOSSARY),
    ):
        assert sentence in text
    for row in gain_rows(result):
        assert text.row(*row) if named else text.row(row[0], row[1], row[3])
    for row in change_rows(result.parameter_changes, named):
        assert text.row(*row)
    for row in candidate_rows(result.candidates, 0.01):
        assert text.row(*row)
    for row in cause_rows(result) if named else ():
        assert text.row(*row)
    weighed = {cause for item in result.probabilities.sets[:6] for cause in item.causes}
    for rows in (
        set_rows(result, 6),
        sensitivity_rows(result),
        bound_rows({label: bounds for label, bounds in result.bounds.items() if label in weighed}),
        pair_rows(result.inseparable_pairs[:6]),
        unseen_rows(result.unseen_candidates),
        joint_rows(result.posterior),
    ):
        for row in rows:
            assert text.row(*row)


@pytest.mark.parametrize("status", STATUSES)
def test_the_decision_stands_on_the_first_page(printed, status):
    result, text = printed(status)
    assert ADVICE in text
    first = PdfText(text.pages[:1])
    assert "Decision. " + status.value.capitalize() in first
    entries = decision_entries(result, RECORD)
    for name, said in entries:
        assert f"{name}{said}" in first
    for row in probability_rows(result, 3):
        assert first.row(*row)
    for quantity in ("mass", "com.x", "com.y", "com.z", "inertia.xx", "inertia.yy", "inertia.zz"):
        (change,) = (change for change in result.parameter_changes if change.name == f"base_link.{quantity}")
        assert first.row(*change_rows([change], bool(result.named))[0])
    assert ORIGIN in first
    assert "1 Evidence" not in first


def test_without_a_record_the_box_has_none(biased):
    entries = dict(decision_entries(biased))
    assert "Record" not in entries
    assert entries["Cause"].startswith("accel-bias, probability > 0.999. The accelerometer")
    assert entries["Size, with 95 % interval"] == size_text(biased.after, "accel-bias")
    assert entries["Changes"].startswith(
        "Without the named causes, the estimate of base_link.mass would shift by 25 standard dev"
    )
    assert "accel 3.2 × 10⁻⁵ before, 1.7 × 10⁻⁵ after (noise alone 1.7 × 10⁻⁵) m/s²" in entries["Changes"]
    change = biased.motion_change
    assert (
        f"the predicted base rate would be wrong by up to {format_number(change.rate, 2)} rad/s" in entries["Changes"]
    )
    assert (
        f"of {change.tip_frame} would be wrong by up to {format_number(1e3 * change.tip, 2)} mm." in entries["Changes"]
    )


def test_plots_of_a_diagnosis_take_axes(biased, disturbance):
    figure = Figure()
    assert bayesid.plot_verdict(biased, axes=figure.subplots(1, 3)) is figure
    drawn = [axes.lines[0].get_xydata() for axes in bayesid.plot_verdict(biased).axes[1:]]
    np.testing.assert_array_equal([axes.lines[0].get_xydata() for axes in figure.axes[1:]], drawn)
    seen = replace(biased, disturbance=disturbance)
    panels = np.shape(bayesid.plot_disturbance(seen, "inertial").axes)[0]
    figure = Figure()
    assert bayesid.plot_disturbance(seen, "inertial", axes=figure.subplots(panels // 3, 3)) is figure
    assert len(bayesid.plot_residuals(biased).axes) == len(bayesid.plot_spectrum(biased).axes) == 6
    assert len(bayesid.plot_manoeuvre(biased).axes) == 2


def test_a_diagnosis_is_shown_by_its_verdict_and_its_causes(biased, clean):
    text, html = repr(biased), biased._repr_html_()
    assert text.startswith("Verdict: explained, accel-bias (probability > 0.999).")
    row = next(line for line in text.splitlines() if line.startswith("accel-bias "))
    assert all(f"{axis} " in row for axis in "xyz")
    assert "m/s2" in row
    assert f"with the causes {biased.gain.after.chi2_per_sample:.4g}." in text
    assert "<td>accel-bias</td>" in html
    assert len(text) < 2000
    assert repr(clean).startswith("Verdict: adequate.")


def test_what_changes_the_readings_alone_has_no_disturbance(printed):
    _, text = printed(Status.EXPLAINED)
    assert "Reconstructed torque and force" not in text


@pytest.mark.slow
def test_an_unknown_cause_is_shown_as_a_torque_with_its_correlations(printed):
    result, text = printed(Status.UNKNOWN)
    assert sentences.wrench_sentence(result.unexplained) in text
    assert "ratio of 12.0. The direction of the torque is fixed in base axes: the source is on board." in text
    for frame in ("base", "orbit (zenith, along-track, normal)", "inertial"):
        assert f"Reconstructed torque and force, {frame} axes." in text
    for row in correlation_rows(torque_correlations(result.unexplained, result.before)):
        assert text.row(*row)
    assert "Repeat a manoeuvre unchanged at a later time" in text


@pytest.mark.slow
def test_samples_are_compared_with_the_fit_and_not_reported_twice(biased, readings, tmp_path):
    changes, amplitudes = biased.parameter_changes, amplitudes_of(biased.after, "accel-bias")
    mean = np.array([item.fitted for item in changes])
    sd = np.array([item.fitted_sd for item in changes])
    mean[1] -= 0.37 * sd[1]
    sizes = [
        SimpleNamespace(label="accel-bias", name=item.quantity.name, mean=item.mean, sd=item.sd) for item in amplitudes
    ]
    sizes[2].sd *= 1.25
    fit = biased.before.fit
    sampled = SimpleNamespace(
        bodies={"base_link": SimpleNamespace(mean=mean, sd=sd)},
        effect_quantities=sizes,
        posterior=fit.posterior,
        integration_error=1e-3,
        sensor_fits=readings,
        chains=SimpleNamespace(
            origin="emcee", evaluations=9, effective_samples=8.0, r_hat=1.0, autocorrelation=2.0, converged=True
        ),
        evidence=SimpleNamespace(
            evaluations=7, effective_samples=6.0, pareto_k=-0.1, trusted=True, value=1.0, error=0.1
        ),
        optimum=SimpleNamespace(evaluations=5, converged=True, log_evidence=lambda posterior: 1.0),
        seconds=1.0,
        disagreements=["Two methods disagree."],
    )
    said = sampled_sentence(biased, sampled)
    assert "by at most 0.37 standard deviations (base_link.com.x)" in said
    assert "the standard deviations by at most 25 % (accel-bias.z)." in said
    diagnosis_report(replace(biased, identification=sampled), "Study", tmp_path / "report.pdf")
    text = PdfText.read(tmp_path / "report.pdf")
    assert said in text
    assert "The extended model, sampled" in text
    assert "Pareto k-hat −0.10" in text
    assert "Two methods disagree." in text
    assert "How the verdict was reached" in text
    for title in ("Assumptions", "Measured and simulated"):
        assert title in text
    for title in ("Result", "Robot and manoeuvres", "Uncertainty", "Computation"):
        assert all(f"{number} {title}" not in text for number in range(1, 12))


def test_the_motions_of_both_fits_are_compared(biased, clean):
    change = biased.motion_change
    samples = [trace(side.fit.posterior, side.fit.z, side.fit.data).sample for side in (biased.before, biased.after)]
    rates = [np.asarray(sample.rate)[0] for sample in samples]
    assert change.rate == pytest.approx(np.linalg.norm(rates[1] - rates[0], axis=1).max())
    assert 0.0 < change.tip < 1.0
    assert biased.to_dict()["motion_change"]["tip"] == {"frame": change.tip_frame, "largest": change.tip, "unit": "m"}
    assert motion_change(biased.after, biased.after).tip == motion_change(biased.after, biased.after).rate == 0.0
    assert clean.motion_change is None


def test_the_robot_is_seen_from_where_arrows_have_their_full_length():
    corners = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 2.0) for z in (0.0, 3.0)])
    rng = np.random.default_rng(1)
    for count in (0, 1, 2):
        arrows = [vector / np.linalg.norm(vector) for vector in rng.normal(size=(count, 3))]
        view = view_of(corners, arrows)
        np.testing.assert_allclose(view @ view.T, np.eye(3), atol=1e-12)
        for arrow in arrows:
            assert np.linalg.norm(view[:2] @ arrow) > 0.99
    assert ConvexHull(corners @ view_of(corners, [])[:2].T).volume > 6.0  # the area of the largest side


def test_the_verdict_outlives_an_interrupted_sampling(biased, tmp_path, monkeypatch):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("bayesid.app.functions.diagnose_study.diagnose_motion", lambda *_, **__: biased)
    monkeypatch.setattr("bayesid.app.functions.diagnose_study.identify_extended", interrupt)
    study = Study.load(Path(bayesid.__file__).parent / "app" / "demonstration_data" / "study.toml")
    with pytest.raises(KeyboardInterrupt):
        list(diagnose_study(study, tmp_path / "out", 0, 100.0))
    content = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert content["causes"] == ["accel-bias"]
    assert content["identification"] is None
    assert sorted(file.name for file in (tmp_path / "out").iterdir()) == ["diagnosis.json", "unexplained.csv"]
