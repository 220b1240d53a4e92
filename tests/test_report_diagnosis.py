"""Reports of diagnoses: sentences say what was found, tables are full, figures have something in them, PDFs are set."""

import copy
import re
from dataclasses import replace
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
from bayesid.inference.posterior import Posterior
from bayesid.recording.recording import Recording
from bayesid.report import diagnosis_report, figures
from bayesid.report import diagnosis_tables as tables
from bayesid.report import diagnosis_text as text
from bayesid.report.diagnosis_advice import adequate_too, advice, imitation, moves_with, unseen
from bayesid.report.diagnosis_report import diagnosis_sentences
from bayesid.report.figures.diagnosis_figures import torque_amplitudes
from bayesid.report.residual_series import Residuals
from bayesid.simulation.effects import known_effects
from bayesid.simulation.effects.effect_parameters import Quantity
from bayesid.simulation.model import Manoeuvre

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


def pages(file) -> int:
    content = file.read_bytes()
    assert content.startswith(b"%PDF")
    return len(re.findall(rb"/Type\s*/Page\b", content))


def test_sentences_name_the_cause_its_size_and_what_it_gains(biased):
    said = list(diagnosis_sentences(biased))
    assert said[0].startswith("Explained by accel-bias")
    assert "The accelerometer reads a constant in free fall." in said[1]
    assert "m/s²" in said[1]
    assert "chi-square per sample goes from" in said[-1]
    assert "base_link." in said[-1]
    assert "held" not in said[-1]  # one recording


@pytest.mark.parametrize("status", list(Status))
def test_every_status_is_said(biased, clean, status):
    result = judged(clean if status is Status.ADEQUATE else biased, status)
    assert text.verdict_sentence(result).lower().startswith(status.value)
    assert text.gain_sentence(result).endswith(".")
    assert text.rest_sentence(result).endswith(".")


def test_equivalents_are_other_names(biased):
    verdict = replace(biased.verdict, equivalents={"accel-bias": ("a", "b")}, rivals=())
    assert "Other names for the same change: a and b." in next(text.cause_sentences(replace(biased, verdict=verdict)))


def test_amplitudes_have_units_and_the_value_that_was_hidden(biased):
    (_, mean, sd), *_ = tables.amplitudes_of(biased.after, "accel-bias")
    assert abs(mean - BIAS) < 4.0 * sd
    shown = tables.amplitude_text([(Quantity("x", "N m s"), 1.0, 0.1), (Quantity("y", "N m s"), 2.0, 0.1)])
    assert shown == "x 1.00 ± 0.10, y 2.00 ± 0.10 N m s"
    several = [(Quantity(f"k{i}", "1"), float(i), 1.0) for i in range(6)]
    assert tables.amplitude_text(several) == "k3 3.0 ± 1.0, k4 4.0 ± 1.0, k5 5.0 ± 1.0"


def test_a_candidate_that_is_not_seen_has_a_limit():
    seen, faint, noise = tables.candidate_rows(
        [
            candidate(),
            candidate(p_value_adjusted=0.4, refitted=False, log_bayes_factor=-2.0),
            candidate(quantities=(), mean=np.zeros(0), sd=np.zeros(0), power=None, log_bayes_factor=None),
        ],
        0.01,
    )
    assert "±" in seen[4]
    assert seen[2].startswith("<")
    assert seen[6] == "refitted"
    assert faint[3] == "−2.0"
    assert faint[4].startswith("x < ")
    assert faint[6] == "linear"
    assert noise[3:6] == ["", "", ""]


def test_candidates_out_of_reach_are_those_of_low_power():
    rows = [candidate(power=0.9), candidate(name="b", power=0.3), candidate(name="c", power=0.1), candidate(power=None)]
    assert [row.name for row in unseen(rows)] == ["c", "b"]


@pytest.mark.parametrize("name", sorted(known_effects()))
def test_every_cause_of_the_catalogue_has_an_advice(name):
    builtin = known_effects()[name].__module__.startswith("bayesid.")
    assert (advice(name) != advice("of-a-plugin")) or not builtin


@pytest.mark.parametrize("name", ["rate-noise", "coloured-noise:rate", "outliers:accel", "quantisation:rate"])
def test_every_fault_of_noise_has_an_advice(name):
    assert advice(name) != advice("of-a-plugin")


def test_a_cause_imitates_itself_but_not_another(biased):
    best = biased.after
    others = {h.labels: h for h in biased.search.tried if len(h.labels) == 1 and h.labels != best.labels}
    assert others
    for rival in others.values():
        alike = imitation(best, rival, biased)
        assert alike is None or 0.0 <= alike <= 1.0
    assert imitation(best, best, biased) is None


def test_advice_names_both_sides(biased):
    rival = SimpleNamespace(labels=("rate-bias",))
    said = list(text.advice_sentences(biased, (rival,)))
    assert [sentence.split(":")[0] for sentence in said] == ["accel-bias", "rate-bias"]


def test_the_disturbance_moves_with_what_drives_it(biased, disturbance):
    axis, name, value = moves_with(disturbance, biased.before)[0]
    assert (axis, name) == ("torque x", f"position of {biased.before.fit.posterior.model.robot.joints[0].name}")
    assert value == pytest.approx(1.0)


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
    side = Residuals.of(biased.before)
    channels = range(3 * len(side.kinds))
    values = np.concatenate([side.channel(0, channel)[1] for channel in channels])
    assert values @ values == pytest.approx(biased.before.fit.chi2)
    assert all(np.all(np.diff(side.channel(0, channel)[0]) > 0.0) for channel in channels)


def test_figures_show_something(biased, disturbance):
    sides = [Residuals.of(biased.before), Residuals.of(biased.after)]
    drawn = [
        figures.residual_histories(sides, 0),
        figures.residual_spectra(sides),
        figures.candidate_strengths(biased.candidates, biased.verdict.causes, 0.01),
        figures.wrench_histories(disturbance, Frame.BASE),
        figures.wrench_histories(disturbance, Frame.INERTIAL),
        figures.wrench_spectrum(disturbance),
    ]
    for figure in drawn:
        for axes in figure.axes:
            assert axes.lines or axes.patches
            assert axes.get_title() or axes.get_xlabel()


def test_tables_are_full(biased):
    for rows in (
        tables.gain_rows(biased),
        tables.shift_rows(biased),
        tables.cause_rows(biased),
        tables.hypothesis_rows(biased.search.tried, biased.before),
    ):
        assert rows
        assert len({len(row) for row in rows}) == 1
        assert all(row[0] for row in rows)


def test_the_assumptions_state_false_alarms_and_the_seed(biased):
    said = " ".join(text.made_sentences(biased))
    assert f"{len(biased.before.outcome.log_p)} tests" in said
    assert "less than 1 %" in said
    assert "Seed of all random numbers: 3." in said


def test_what_is_adequate_but_improbable_is_listed(biased):
    others = adequate_too(biased)
    assert all(h.adequate and h.labels != biased.after.labels for h in others)
    rivals = [h for h in biased.search.tried if h.labels and h.labels != biased.after.labels]
    rows = tables.rival_rows(biased, rivals)
    assert [row[0] for row in rows] == [" + ".join(h.labels) for h in rivals]
    assert all(float(row[1].replace("−", "-")) > 0.0 for row in rows)


def test_reports_of_all_verdicts_are_pdfs(biased, clean, disturbance, tmp_path, monkeypatch):
    monkeypatch.setattr(Posterior, "integration_error", lambda self, z: 1e-3)
    rivals = tuple(h for h in biased.search.tried if len(h.labels) == 1 and h.labels != biased.after.labels)[:2]
    for result in (
        biased,
        clean,
        judged(biased, Status.AMBIGUOUS, rivals),
        replace(judged(biased, Status.UNKNOWN), unexplained=disturbance),
        judged(biased, Status.UNRESOLVED),
    ):
        vars(result)["posterior"] = biased.before.fit.posterior  # for its sentences only; not built again
        file = tmp_path / f"{result.verdict.status.value}.pdf"
        diagnosis_report(result, None, "Träger #1 *bold*", file)
        assert pages(file) >= 3


def test_the_identification_follows_the_diagnosis(biased, tmp_path, monkeypatch):
    added = []
    monkeypatch.setattr(
        "bayesid.report.diagnosis_report.add_identification", lambda _, result, said: added.append(result)
    )
    sampled = SimpleNamespace()
    diagnosis_report(biased, sampled, "Study", tmp_path / "report.pdf")
    assert added == [sampled]
