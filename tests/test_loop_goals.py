"""What a loop stops on: its goals, and a review that shows that the model is wrong; the report of all steps."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2
from test_loop import ENCODER, PROBLEM, TRUE, model_of

from bayesid._io.errors import InputError
from bayesid.app.functions.loop_study import LoopResult
from bayesid.design import CauseProbability, Loop, QuantitySd, RelativePrecision, TipRegion
from bayesid.design.base_prediction import predict
from bayesid.design.loop_goals import Review, StepKnowledge
from bayesid.design.loop_history import History
from bayesid.inference.body_quantities import BODY_QUANTITIES, BodyDraws
from bayesid.inference.posterior_file import write_draws
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.recording import Recording
from bayesid.report import loop_report
from bayesid.report.loop_report import (
    ending_sentence,
    goal_words,
    loop_sentences,
    next_sentence,
    review_words,
)
from bayesid.simulation.model import Manoeuvre
from tests.pdf_text import PdfText

TIME = np.arange(0.0, 12.01, 0.25)


def turning() -> Recording:
    """The second joint turns by half a radian, the base's sensors read nothing."""
    angle = 0.25 * (1.0 - np.cos(np.pi * TIME / TIME[-1]))
    channels = {"position.joint1": 0.0 * TIME, "position.joint2": angle}
    return Recording(
        "step-1", None, TIME, {**channels, **{f"{kind}.{x}": 0.0 * TIME for kind in ("rate", "accel") for x in "xyz"}}
    )


def knowledge(spread: float = 0.02, causes=None) -> StepKnowledge:
    model = model_of(TRUE, spread)
    recording = turning()
    motion = MeasuredMotion.from_recording(recording, model.robot, sigma=ENCODER)
    rng = np.random.default_rng(4)
    sd = 0.01 * (1.0 + np.arange(10.0))
    bodies = {"base_link": BodyDraws("base_link", 5.0 + sd * rng.normal(size=(4000, 10)))}
    return StepKnowledge(model, bodies, Manoeuvre(recording, motion, np.array([0.0, 0.0, 0.0, 1.0])), causes or {}, 7)


def test_a_standard_deviation_is_that_of_its_draws():
    for index, (name, unit) in enumerate(BODY_QUANTITIES.items()):
        goal = QuantitySd("base_link", name, 0.05)
        assert goal.value(knowledge()) == pytest.approx(0.01 * (1.0 + index), rel=0.05)
        assert (goal.unit, goal.text) == (unit, f"sd of base_link.{name}")
        assert [goal.reached(value) for value in (0.04, 0.05, 0.06)] == [True, True, False]
    with pytest.raises(InputError, match="'colour' is not a quantity of a body"):
        QuantitySd("base_link", "colour", 0.1)
    with pytest.raises(InputError, match="'link9' is not a body to identify"):
        QuantitySd("link9", "mass", 0.1).value(knowledge())


def test_a_cause_is_decided_either_way():
    goal = CauseProbability("payload:link2", 0.95)
    assert [goal.reached(value) for value in (0.01, 0.05, 0.06, 0.9, 0.95, 1.0)] == [
        True,
        True,
        False,
        False,
        True,
        True,
    ]
    assert goal.value(knowledge(causes={"payload:link2": 0.3})) == 0.3
    with pytest.raises(InputError, match="'payload:link2' is not a candidate of the diagnosis"):
        goal.value(knowledge(causes={"unknown": 0.3}))


@pytest.mark.slow
def test_the_region_of_the_tip_is_the_ellipsoid_of_its_draws_and_shrinks_with_the_prior():
    known = knowledge()
    value = TipRegion(0.001, "tip").value(known)
    found = predict(known.model, known.flown, np.random.default_rng(1), draws=2000, tip_frame="tip")
    variance = np.linalg.eigvalsh(np.cov(found.tip.position[:, -1].T))[-1]
    assert value == pytest.approx(np.sqrt(chi2.ppf(0.95, 3) * variance), rel=0.15)
    narrower = TipRegion(0.001, "tip").value(knowledge(0.01))
    assert narrower == pytest.approx(0.5 * value, rel=0.1)


@dataclass(frozen=True)
class Sure:
    """Identifies everything at once: draws about the truth, one percent wide."""

    def identify(self, posterior, seed: int, file: Path) -> dict:
        rng = np.random.default_rng(seed)
        scale = 1.0 + 0.01 * rng.normal(size=(1, 2000, 1, 1))
        write_draws(["base_link"], scale * TRUE.vector, file)
        return {"method": "stub", "chi2": 90.0, "samples": 100, "disagreements": []}


@dataclass(frozen=True)
class Judge:
    """Says after every step what it was told to say."""

    said: tuple[Review, ...]

    def review(self, model, manoeuvres: Sequence[Manoeuvre], seed: int, file: Path) -> Review:
        file.write_text(json.dumps({"recordings": [item.recording.name for item in manoeuvres]}))
        return self.said[len(manoeuvres) - 1]


FINE = Review("adequate", (), True, {"payload:link2": 0.3, "unknown": 0.02})
WRONG = Review("explained", ("payload:link2",), False, {"payload:link2": 0.98, "unknown": 0.01})


@pytest.fixture
def planned(monkeypatch: pytest.MonkeyPatch):
    """Stand for the search, which would take long to compile."""

    def plan(self: Loop, history: History, number: int, problem, progress) -> bool:
        if history.entry(number, "plan") is None:
            turning().write(history.path(number, "plan"))
            rotation = {"limit": 0.03, "designed_for": 0.02, "quantile_99": 0.029, "unit": "rad"}
            limits = {
                name: {"limit": size, "largest": 0.5 * size, "unit": "rad/s"}
                for name, size in (("joint_speed", 0.5), ("base_rotation", 0.03))
            }
            attempts = [{"go": True, "limits": {"base_rotation": rotation}, "broken": []}]
            history.record(number, "plan", {"go": True, "attempts": attempts, "limits": limits})
        return True

    monkeypatch.setattr(Loop, "_plan", plan)


class Still:
    """Nothing but the joints move."""

    def execute(self, plan: Recording) -> Recording:
        return plan


def loop_of(*said: Review, **options) -> Loop:
    settings = {"goals": (RelativePrecision(1e-9),), "at_most": 3, "identifier": Sure(), **options}
    return Loop(PROBLEM, ENCODER, reviewer=Judge(said) if said else None, **settings)


@pytest.mark.slow
@pytest.mark.usefixtures("planned")
def test_a_loop_stops_where_its_model_is_wrong(tmp_path: Path):
    history = loop_of(FINE, WRONG).run(Still(), tmp_path)
    assert history.status == "wrong-model"
    assert [step["diagnosis"]["trusted"] for step in history.steps] == [True, False]
    reviewed = json.loads((tmp_path / "step-2-diagnosis.json").read_text())["recordings"]
    assert reviewed == ["step-1-recording", "step-2-recording"]
    text = list(loop_sentences(history))
    assert "Step 2: the verdict on the recordings so far is explained: payload:link2 (98 %)." in text
    assert "The model is wrong: after 2 manoeuvres, the recordings indicate payload:link2. The loop stops." in text
    # even where what is wanted is reached: it would be known well of the wrong model
    again = loop_of(FINE, WRONG, goals=(RelativePrecision(1.0),)).run(Still(), tmp_path)
    assert (again.status, len(again.steps)) == ("wrong-model", 2)
    assert loop_of(WRONG, goals=(RelativePrecision(1.0),)).run(Still(), tmp_path / "other").status == "wrong-model"


@pytest.mark.slow
@pytest.mark.usefixtures("planned")
def test_the_result_of_a_loop_names_its_bodies_goals_and_causes(tmp_path: Path):
    result = LoopResult("Träger", loop_of(FINE, WRONG).run(Still(), tmp_path))
    written = json.loads((tmp_path / "loop.json").read_text())
    assert result.to_dict() == {key: written[key] for key in ("status", "steps")}
    first, last = result.steps
    mass = written["steps"][1]["identification"]["bodies"]["base_link"]["mass"]
    assert result.bodies["base_link"].mass.to_dict() == pytest.approx(mass)
    assert first.bodies["base_link"].mass.mean != pytest.approx(mass["mean"], rel=1e-9)
    assert (first.causes, last.causes) == ((), ("payload:link2",))
    (goal,) = last.goals
    assert (goal.wanted, goal.reached) == (1e-9, False)
    assert goal.value == pytest.approx(0.01, rel=0.05)
    assert last.recording == tmp_path / "step-2-recording.csv"
    assert "The model is wrong: after 2 manoeuvres" in str(result)
    assert "<p>The model is wrong: after 2 manoeuvres" in result._repr_html_()


@pytest.mark.usefixtures("planned")
def test_a_loop_that_waits_has_a_result_without_bodies(tmp_path: Path):
    result = LoopResult("", loop_of().run(None, tmp_path))
    (step,) = result.steps
    assert (result.status, result.bodies, step.goals, step.causes) == ("waiting", {}, (), ())
    assert step.plan.is_file()
    assert f"Fly {step.plan}" in str(result)


@pytest.mark.slow
@pytest.mark.usefixtures("planned")
def test_a_loop_that_asks_for_a_cause_goes_on_until_it_is_decided(tmp_path: Path):
    goals = (CauseProbability("payload:link2"),)
    history = loop_of(FINE, WRONG, goals=goals).run(Still(), tmp_path)
    assert history.status == "reached"
    assert [step["goals"][0]["value"] for step in history.steps] == [0.3, 0.98]
    with pytest.raises(InputError, match="the steps are not reviewed"):
        loop_of(goals=goals)


@pytest.mark.slow
@pytest.mark.usefixtures("planned")
def test_a_lost_review_is_made_again_and_a_changed_goal_is_assessed(tmp_path: Path):
    first = loop_of(FINE, FINE, FINE).run(Still(), tmp_path)
    assert first.status == "at-most"
    (tmp_path / "step-3-diagnosis.json").unlink()
    again = loop_of(FINE, FINE, FINE).run(Still(), tmp_path)
    assert again.steps == first.steps
    assert (tmp_path / "step-3-diagnosis.json").is_file()
    goals = (RelativePrecision(0.5), QuantitySd("base_link", "mass", 2.0))
    reached = loop_of(FINE, FINE, FINE, goals=goals).run(Still(), tmp_path)
    assert reached.status == "reached"
    assert [goal["reached"] for goal in reached.steps[-1]["goals"]] == [True, True]
    with pytest.raises(InputError, match="it belongs to another loop"):
        loop_of(FINE, WRONG, FINE).run(Still(), tmp_path)


@pytest.mark.slow
@pytest.mark.usefixtures("planned")
def test_the_report_has_all_steps(tmp_path: Path):
    history = loop_of(FINE, WRONG).run(Still(), tmp_path)
    loop_report(history, "Träger", tmp_path / "report.pdf", origin="SHA-256: none")
    text = PdfText.read(tmp_path / "report.pdf")
    last = history.steps[-1]
    for words in (
        ending_sentence(history),
        next_sentence(history),
        review_words(last["diagnosis"]),
        goal_words(last["goals"][0]),
    ):
        assert words[1:] in text
    assert text.row("1", "1", "base rotation", "96.7 %", "0.900", "adequate", "0 of 1")
    assert text.row("2", "1", "base rotation", "96.7 %", "0.900", "explained: payload:link2", "0 of 1")
    assert text.row("1", "joint speed", "0.5", "0.25", "rad/s")
    plain = loop_of().run(Still(), tmp_path / "plain")
    loop_report(plain, "Träger", tmp_path / "plain.pdf")
    assert "a wrong model would not have been noticed" in PdfText.read(tmp_path / "plain.pdf")
