"""The study of ETS-VII's limits: the flight's ramps, what repetitions add, floors, and times in words."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bayesid._io.errors import InputError
from bayesid.identifiability.local_knowledge import Knowledge
from studies.common import mission
from studies.common.ets7 import EXCURSION, RAMPS, START, FlightManoeuvre
from studies.common.study import CsvTable, Verdict
from studies.ets7_limits.analysis import Answer, Repeated, designed_motion
from studies.ets7_limits.report import USUAL, goals, time_needed

TRUTH = np.ones(10)


def repeated(rows: np.ndarray) -> Repeated:
    """Return what is known of ten quantities that are the coordinates themselves."""
    prior = Knowledge(tuple(map(str, range(10))), TRUTH, np.eye(10), np.eye(10))
    return Repeated(prior, rows)


def test_the_flight_ramps_at_constant_speed_between_rounded_corners():
    time = np.linspace(50.0, 160.0, 11001)
    state = FlightManoeuvre(START).evaluate(time)
    np.testing.assert_allclose(np.gradient(state.position, time, axis=0)[5:-5], state.velocity[5:-5], atol=1e-7)
    np.testing.assert_allclose(np.gradient(state.velocity, time, axis=0)[5:-5], state.acceleration[5:-5], atol=1e-5)
    held = FlightManoeuvre(START).evaluate(np.array([0.0, 100.0, 200.0])).position - START
    np.testing.assert_allclose(held, [0.0 * EXCURSION, EXCURSION, 0.0 * EXCURSION], atol=1e-12)
    middle = FlightManoeuvre(START).evaluate(np.array([np.mean(RAMPS[0])]))
    np.testing.assert_allclose(middle.velocity[0], EXCURSION / 22.6)


def test_repetitions_add_information():
    information = repeated(5.0 * np.eye(10))
    np.testing.assert_allclose(information.sd(4.0), 1.0 / np.sqrt(101.0))
    assert information.needed() == pytest.approx(9999.0 / 25.0)
    assert repeated(1e2 * np.eye(10)).needed() == 1.0


def test_what_is_not_seen_sets_a_floor():
    rows = 5.0 * np.eye(10)
    # mass and moment in one combination only
    rows[0, 0] = rows[0, 4] = 5.0 / np.sqrt(2.0)
    rows[4] = 0.0
    information = repeated(rows)
    assert information.needed() == np.inf
    assert information.floored
    assert information.worst(1e6) == pytest.approx(np.sqrt(0.5), rel=1e-4)


def test_what_is_seen_faintly_sets_no_floor():
    rows = 5.0 * np.eye(10)
    rows[4] *= 1e-3
    information = repeated(rows)
    assert information.needed() == np.inf
    assert not information.floored


def test_a_floor_is_seen_while_more_repetitions_still_help():
    rows = 5.0 * np.eye(10)
    # mass and moment in one combination only, and faintly
    rows[0, 0] = rows[0, 4] = 1e-3 / np.sqrt(2.0)
    rows[4] = 0.0
    information = repeated(rows)
    assert information.worst(1e6) == pytest.approx(np.sqrt(0.75))
    assert information.floored


@pytest.mark.parametrize(
    ("repetitions", "floored", "words"),
    [
        (1.0, False, "at most 240 s"),
        (6.0, False, "24 min"),
        (150.0, False, "10 h"),
        (np.inf, True, "never (2.3 %)"),
        (np.inf, False, "over 7.6 years"),
    ],
)
def test_times_in_words(repetitions: float, floored: bool, words: str):
    assert time_needed(Answer(0.5, repetitions, 0.0234, floored), 240.0) == words


def test_the_manoeuvre_is_read_from_the_table_of_the_other_study(tmp_path):
    file = tmp_path / "excitation-manoeuvres.csv"
    with pytest.raises(InputError, match="python -m studies"):
        designed_motion(file)
    names = mission.splines(2).names
    values = 0.01 * np.arange(len(names))
    CsvTable("manoeuvres", ["manoeuvre", *names], [["d-optimal", *values]]).write(tmp_path / "excitation.pdf")
    np.testing.assert_allclose(designed_motion(file).parameters, values)


@pytest.mark.parametrize(("once", "verdict"), [(0.002, Verdict.PASS), (0.02, Verdict.FAIL)])
def test_the_arm_is_exact_in_the_goal(once: float, verdict: Verdict):
    def worst(known: bool) -> float:
        return once if known else 0.5

    answers = {USUAL: {(True, False): Answer(once, 1.0, 0.0, False)}}
    (goal,) = goals(SimpleNamespace(after={"designed": SimpleNamespace(worst=worst)}, answers=answers))
    assert goal.verdict is verdict
