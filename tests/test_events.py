"""Pulses, kicks and snaps against MuJoCo made for them; a verdict that says what remains beside a named cause."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayesid._io.errors import InputError
from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.diagnosis import Rest, Status, diagnose
from bayesid.diagnosis.candidates import event_cause, shaped_cause
from bayesid.diagnosis.candidates.courses import CourseGram
from bayesid.diagnosis.evidence.cause_sets import CausePrior, CauseSet, SetProbabilities
from bayesid.diagnosis.evidence.gram import Gram
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.outcome.inseparable_causes import parting_ratio
from bayesid.robot.robot import Robot
from bayesid.simulation.effects import EVERY, Event, Kicks, RateBiasJump, ThermalSnap, ThrusterPulses, create
from studies.truth import mujoco as mj
from studies.truth.bodies import SERVICER3
from studies.truth.hidden_causes import FURTHER_CASES, Case
from studies.truth.hidden_causes import causes as hide
from studies.truth.hidden_causes.catalogue import hidden_case
from tests.hidden import diagnosed, shortened
from tests.simulated import simulated

POINT, RATE0 = (0.2, -0.1, 0.3), (0.02, -0.03, 0.015)
TIMES = np.arange(0.0, 40.01, 0.5)
MOTION = mj.smooth_motion(3, 40.0, 5, amplitude=0.5, frequencies=(0.03, 0.06), ramp=10.0)
FORCE, TORQUE = (0.3, -0.5, 0.2), (0.4, 0.2, -0.3)
BRIEF = 1e-4
"""Length of a contact in MuJoCo [s]."""


def burns(train, end=40.0):
    """Constant thrusts that make a train of pulses."""
    begins = np.arange(train.first[0], end, train.period)
    signs = [1.0 - 2.0 * (train.alternating and k % 2) for k in range(len(begins))]
    return [
        mj.Thrust(begin, begin + train.width, tuple(sign * np.array(FORCE)), tuple(sign * np.array(TORQUE)))
        for begin, sign in zip(begins.tolist(), signs, strict=True)
    ]


def contacts(times):
    part = lambda vector: tuple(np.array(vector) / BRIEF)  # noqa: E731
    return [mj.Thrust(time, time + BRIEF, part(FORCE), part(TORQUE)) for time in times]


CASES = {
    "pulses": (create("thruster-pulses:7.3,0.4,0,3.21"), [*FORCE, *TORQUE], lambda effect: burns(effect.train)),
    "limit cycle": (create("thruster-pulses:9.1,0.3,1,2.43"), [*FORCE, *TORQUE], lambda effect: burns(effect.train)),
    "kicks": (create("kicks:1@11.37,1@23.6"), 2 * [*FORCE, *TORQUE], lambda _: contacts([11.37, 23.6])),
    "kicks in all": (create("kicks:all@11.37,all@23.6"), 2 * [*FORCE, *TORQUE], lambda _: contacts([11.37, 23.6])),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", list(CASES))
def test_pushes_from_outside_are_those_of_mujoco(name, formula_motion):
    """Of the push itself, 2e-4 is that of a contact's finite length; the pulses are as good as the integration."""
    effect, values, thrusts = CASES[name]
    robot = Robot.from_urdf(SERVICER3)
    motion = formula_motion(MOTION, SERVICER3, robot)
    acting = thrusts(effect)
    edges = [edge for thrust in acting for edge in (thrust.start, thrust.stop) if edge < TIMES[-1]]
    times = np.unique([*TIMES, *edges])  # no step of MuJoCo's sees a thrust begin or end
    model = mj.TruthModel(SERVICER3, thrusts=acting, accel_position=POINT)
    truth = model.run(MOTION, times, rate0=RATE0, step=0.1)
    sampled = np.isin(times, TIMES)
    found = simulated(robot, motion, TIMES, RATE0, POINT, effect, np.array(values))
    without = simulated(robot, motion, TIMES, RATE0, POINT)
    for place, given in enumerate((truth.rate[sampled], truth.accel[sampled])):
        there = np.abs(without[place] - given).max()
        assert np.abs(found[place] - given).max() < 2e-4 * there


@pytest.mark.slow
@pytest.mark.parametrize("kept", [0.0, 1.0])
def test_a_snap_exchanges_momentum_with_the_base_as_in_mujoco(kept, formula_motion):
    """MuJoCo is given the reaction ``-h' - w x h`` of the panel's momentum, whose first instant is a sample's."""
    begin, decay, momentum = 12.0, 3.0, np.array([0.3, -0.2, 0.25])

    def reaction(time, attitude, rate):
        left = np.exp(-(time - begin) / decay) if time >= begin else 0.0
        share = (time >= begin) - left if kept else left
        slope = (left if kept else -left) / decay
        return np.zeros(3), -(slope * momentum + np.cross(rate, share * momentum))

    robot = Robot.from_urdf(SERVICER3)
    motion = formula_motion(MOTION, SERVICER3, robot)
    blow = [] if kept else [mj.Thrust(begin, begin + BRIEF, torque=tuple(-momentum / BRIEF))]
    model = mj.TruthModel(SERVICER3, thrusts=blow, fields=[reaction], accel_position=POINT)
    times = np.unique([*TIMES, begin + BRIEF])
    rate = model.run(MOTION, times, rate0=RATE0, step=0.05).rate[np.isin(times, TIMES)]
    effect = ThermalSnap().with_events([Event(0, begin, (decay, kept))])
    found = simulated(robot, motion, TIMES, RATE0, POINT, effect, momentum)[0]
    without = simulated(robot, motion, TIMES, RATE0, POINT)[0]
    far = np.arange(len(TIMES)) != int(2 * begin)  # where MuJoCo's blow has not ended
    assert np.abs(without - rate)[far].max() > 1e-3
    assert np.abs(found - rate)[far].max() < 3e-4 * np.abs(without - rate)[far].max()


def test_events_are_written_as_they_are_read():
    effect = Kicks(momentum=False).with_events([Event(1, 12.25), Event(1, 30.5), Event(2, 3.0)], ("a", "b", "c"))
    assert effect.label == "kicks:2@12.25,2@30.5,3@3"
    assert create(effect.label).events == effect.events
    assert effect.parameters[3].name == "b.2.angular_momentum.x"
    snap = ThermalSnap().with_events([Event(0, 7.0, (4.0, 1.0))])
    assert create(snap.label).events == snap.events
    recurring = Kicks(momentum=False).with_events([Event(EVERY, 12.25), Event(EVERY, 30.5)], ("a", "b", "c"))
    assert recurring.label == "kicks:all@12.25,all@30.5"
    assert create(recurring.label).events == recurring.events
    assert [parameter.name for parameter in recurring.parameters[::3]] == [
        "all.angular_momentum.x",
        "all.2.angular_momentum.x",
    ]
    train = create("thruster-pulses:20,0.5,1,7,inf").train
    assert ThrusterPulses().with_train(train).label == "thruster-pulses:20,0.5,1,7,inf"
    assert [parameter.name for parameter in RateBiasJump("1@5").parameters] == ["x", "y", "z"]


def test_an_event_of_every_recording_is_that_of_each():
    recurring, once = create("kicks:all@5,2@7"), create("kicks:1@5,2@5,2@7")
    times = np.array([4.0, 5.5, 8.0])
    np.testing.assert_array_equal(recurring.begun(times, 0), [[0, 0], [1, 0], [1, 0]])
    np.testing.assert_array_equal(recurring.begun(times, 1), [[0, 0], [1, 0], [1, 1]])
    for index in (0, 1):
        np.testing.assert_array_equal(recurring.begun(times, index).sum(1), once.begun(times, index).sum(1))
        assert recurring.in_recording(index).jumps(40.0) == once.in_recording(index).jumps(40.0)


@pytest.mark.parametrize(
    "label", ["kicks:0@5", "kicks:-1@5", "kicks:all", "kicks:noon", "thermal-snap:1@5/4", "thruster-pulses:5,6,0,1"]
)
def test_an_event_that_cannot_be_read_is_refused(label):
    with pytest.raises(InputError, match=r"is not an? (event|train)"):
        create(label)


# diagnoses ------------------------------------------------------------------------------------------------------------


HIDDEN = {
    "a wheel and a torque that swings": ((hide.wheel, hide.swinging_torque), {"wheel-momentum"}, Rest.PRESENT),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", list(HIDDEN))
def test_what_mujoco_hides_is_named_and_what_remains_is_said(name, tmp_path):
    builds, causes, rest = HIDDEN[name]
    case = Case(name, tuple(causes), "effect", builds, SERVICER3, {})
    study = Study.load(case.make(tmp_path, 5))
    model = load_model(study)
    result = diagnose(model, load_manoeuvres(study, model.robot), 0)
    assert set(result.verdict.causes) == causes
    assert result.remainder.verdict is rest
    assert result.verdict.status is (Status.EXPLAINED if rest is Rest.NONE else Status.PARTLY_EXPLAINED)
    assert result.to_dict()["remainder"]["verdict"] == rest.value


@pytest.mark.slow
def test_a_train_that_is_too_fast_for_the_readings_is_not_called_a_leak_alone(tmp_path):
    """Pulses of half a second every three seconds at 2 Hz."""

    def train(draw, strength):
        torque = hide.direction(draw, 6e-4 * strength)
        return {"hidden": mj.Hidden(fields=[mj.pulses(torque, every=3.0, length=0.5, start=4.0)])}

    verdict = diagnosed(shortened(hidden_case("thruster-leak", train)).make(tmp_path, 35, 2.0)).verdict
    assert verdict.status is Status.EXPLAINED
    assert verdict.causes == ("thruster-leak",)
    assert verdict.equivalent_to == {"thruster-leak": ("thruster-pulses",)}


@pytest.mark.parametrize("signs", [(1.0, 1.0, 1.0), (1.0, -1.0, 0.0)])
def test_events_alike_in_all_recordings_gain_what_separate_ones_gain_together(signs):
    """With white information the gain is half the square of the amplitudes, of their mean where they are alike."""
    waves, ends, place = 40, np.full(3, 100.0), (30 + 0.5) / 64 * 100.0
    matrix = np.tile(np.eye(3 * waves).reshape(waves, 3, waves, 3), (3, 1, 1, 1, 1))
    courses = CourseGram(matrix, np.zeros((3, waves, 3)), ends)
    cosines = courses.cosines(0, event_cause._course(Kicks(), Event(0, place), courses, 0)[None])[0]
    amplitude = 200.0 * np.array([0.3, -0.5, 0.2])
    courses = replace(courses, score=np.array(signs)[:, None, None] * cosines[:, None] * amplitude)
    separate = [gain for r in range(3) for gain, _ in event_cause._events(courses, Kicks(), r)]
    alike = event_cause._events(courses, Kicks(), EVERY)
    unit = 0.5 * float(cosines @ cosines) * float(amplitude @ amplitude)
    np.testing.assert_allclose(separate, [unit * sign**2 for sign in signs if sign], rtol=1e-6)
    if not sum(signs):
        assert alike == []
        return
    ((gain, event),) = alike
    assert event == Event(EVERY, pytest.approx(place))
    assert gain == pytest.approx(3.0 * unit, rel=1e-6)


def test_shapes_are_proposed_beside_what_needs_something_unnamed():
    """Both of the most probable sets have a cause that stands for the shape."""
    sets = [CauseSet(("a", "b"), None, 9.0), CauseSet(("a", "c"), None, 8.5), CauseSet(("a",), None, 1.0)]
    named = SetProbabilities.of(sets, ("a", "b", "c"), ("u",), CausePrior())
    assert shaped_cause._companies(named, {"c"}) == [(), ("a", "b"), ("a",), ("b",)]
    assert shaped_cause._companies(named, set()) == [(), ("a", "b"), ("a", "c"), ("b",), ("a",)]
    unnamed = named.with_sets([*sets, CauseSet(("c",), "u", 8.0)])
    assert shaped_cause._companies(unnamed, set()) == [(), ("a", "b"), ("a", "c"), ("b",), ("a",), ("c",)]


# where two causes part ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("cosine", [0.0, 0.8, 0.99])
def test_two_causes_part_where_their_likelihoods_decide_in_95_percent(cosine):
    """Draws of the score with the one at work: its log likelihood is above that of the other in 95 % at that ratio."""
    matrix, rng = np.array([[1.0, cosine], [cosine, 1.0]]), np.random.default_rng(0)
    gram = Gram(matrix, np.zeros(2), {"a": np.array([0]), "b": np.array([1])})
    evidence = SetEvidence(gram, [CandidateCause(name, (AmplitudeGroup(name, 1e3),)) for name in "ab"])
    ratio = parting_ratio(evidence, "a", "b")
    scores = rng.multivariate_normal(np.zeros(2), matrix, 40_000) - ratio * matrix[0]
    # known sizes: as large as the one is, and what the other would have to be to do its best
    sizes = np.array([[ratio, 0.0], [0.0, ratio * cosine]])
    true, other = (-scores @ size - 0.5 * size @ matrix @ size for size in sizes)
    assert np.mean(true > other) == pytest.approx(0.95, abs=0.005)


def test_causes_that_imitate_each_other_never_part():
    gram = Gram(np.ones((2, 2)), np.zeros(2), {"a": np.array([0]), "b": np.array([1])})
    evidence = SetEvidence(gram, [CandidateCause(name, (AmplitudeGroup(name, 1e3),)) for name in "ab"])
    assert parting_ratio(evidence, "a", "b") == np.inf


@pytest.mark.slow
def test_kicks_are_named_where_their_cosines_are_overrated_beside_another_cause(tmp_path):
    """One kick in every recording; beside a dipole, six kicks would seem to gain more than all there is."""
    case = next(case for case in FURTHER_CASES if case.name == "kicks")
    study = Study.load(case.make(tmp_path, 7700))
    model = load_model(study)
    verdict = diagnose(model, load_manoeuvres(study, model.robot), 7700, knows_latitude=True).verdict
    assert verdict.status is Status.EXPLAINED
    assert verdict.causes == ("kicks",)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "seed", "strength", "cause"),
    [("bias-jump, listed", 300790, 0.488, "rate-bias-jump"), ("thermal-snap, listed", 300119, 0.75, "thermal-snap")],
)
def test_events_that_recur_are_not_taken_for_separate_ones(name, seed, strength, cause, tmp_path):
    """One in each recording has three times the amplitudes; tuned in its place, it lost to a kick or a snap."""
    case = next(case for case in FURTHER_CASES if case.name == name)
    assert diagnosed(case.make(tmp_path, seed, strength)).verdict.causes == (cause,)


def recurring(draw, strength):
    """One kick, the same at the same time of every recording."""
    start = 0.5 * float(draw.integers(60, 220)) + 0.25
    torque, force = (hide.direction(draw, 2e-2 * strength) for _ in range(2))
    return {"hidden": mj.Hidden(fields=[mj.pulses(torque, every=np.inf, length=0.25, start=start, force=force)])}


@pytest.mark.slow
def test_kicks_beside_a_mass_that_shifts_are_no_leak(tmp_path):
    """A leak has three amplitudes, and stands for a kick where the base of each recording may have jumped besides.

    A weak kick and a jump of the gyro's bias differ in little but their sizes: both may be reported.
    """
    case = hidden_case("kicks, mass-shift", recurring, hide.jumping_mass)
    verdict = diagnosed(case.make(tmp_path, 2, 0.5)).verdict
    reported = [set(names) for names in (verdict.causes, *verdict.ambiguous_with)]
    assert {"kicks", "mass-shift"} in reported
    assert not any("thruster-leak" in names for names in reported)
