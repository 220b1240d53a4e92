"""Events of a disturbing torque are found where they are, and none where there is noise alone."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.diagnosis.candidates.generic_cause import generic_signatures
from bayesid.diagnosis.outcome.disturbance import Frame, disturbing_wrench
from bayesid.diagnosis.outcome.torque_events import EventCandidates, Taken
from bayesid.diagnosis.response.perturbed_model import PerturbedModel
from bayesid.diagnosis.search.fitted_set import Hypothesis
from bayesid.inference.noise_changes import relinearised
from bayesid.inference.posterior import Posterior
from studies.truth import mujoco as mj
from studies.truth.bodies import SERVICER4
from studies.truth.hidden_causes import causes as hide
from studies.truth.hidden_causes.catalogue import hidden_case

TIME = np.linspace(0.0, 100.0, 201)
SHAPES = np.array([(k / 20, decay) for decay in (0.05, np.inf) for k in range(20)])
LARGEST = 10.0


def candidates(residual: np.ndarray, columns: np.ndarray) -> EventCandidates:
    """One recording; the residual is linear in the amplitudes."""
    since = TIME - 100.0 * SHAPES[:, :1]
    courses = (since >= 0.0) * np.exp(-np.maximum(since, 0.0) / (100.0 * SHAPES[:, 1:]))
    empty = np.zeros((columns.shape[1], 0))
    place = np.zeros(len(SHAPES), dtype=int)
    score = columns.T @ residual
    return EventCandidates(place, SHAPES, tuple(courses), columns.T @ columns, empty, score, LARGEST, len(SHAPES))


def columns(rng: np.random.Generator) -> np.ndarray:
    """Responses to the three axes of every event: its course, seen by three sensors at some angle to the axes."""
    since = TIME - 100.0 * SHAPES[:, :1]
    courses = (since >= 0.0) * np.exp(-np.maximum(since, 0.0) / (100.0 * SHAPES[:, 1:]))
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return np.einsum("kt,sa->tska", courses, axes).reshape(3 * len(TIME), 3 * len(SHAPES))


def test_two_events_are_found_with_their_torques():
    rng = np.random.default_rng(1)
    matrix = columns(rng)
    truth = np.zeros(3 * len(SHAPES))
    truth[3 * 6 : 3 * 6 + 3], truth[3 * 33 : 3 * 33 + 3] = (3.0, -2.0, 1.0), (0.0, 1.5, -1.0)
    found = candidates(-matrix @ truth + rng.normal(size=len(matrix)), matrix)
    nothing = Taken.nothing(matrix.shape[1])
    events = found.chosen(nothing)
    assert set(events.places) == {6, 33}
    assert events.log_evidence > 50.0
    torque = sum(own for _, own, _ in found.averaged(nothing, events))
    expected = np.outer(found.course[6], truth[18:21]) + np.outer(found.course[33], truth[99:102])
    assert np.corrcoef(torque.ravel(), expected.ravel())[0, 1] > 0.95  # the noise leaves 0.98


def test_noise_alone_has_no_event():
    rng = np.random.default_rng(2)
    matrix = columns(rng)
    found = [candidates(rng.normal(size=len(matrix)), matrix).chosen(Taken.nothing(matrix.shape[1])) for _ in range(40)]
    assert sum(bool(events.places) for events in found) <= 2  # the cost makes it one in fifty or fewer
    assert all(events.log_evidence >= 0.0 for events in found)


def test_what_is_held_is_not_found_again():
    rng = np.random.default_rng(3)
    matrix = columns(rng)
    truth = np.zeros(3 * len(SHAPES))
    truth[18:21] = 3.0
    found = candidates(-matrix @ truth + rng.normal(size=len(matrix)), matrix)
    # a column that takes the same share as the event, with a wide prior
    own = matrix[:, 18:21]
    lower = np.linalg.cholesky(own.T @ own + 1e-6 * np.eye(3))
    held = Taken(np.linalg.solve(lower, own.T @ matrix), np.linalg.solve(lower, found.score[18:21]))
    assert 6 not in found.chosen(held).places
    assert 6 in found.chosen(Taken.nothing(matrix.shape[1])).places


def torque_at_once(draw, strength):
    """Torque from outside, base axes, that appears at once and dies away."""
    start, vector = float(draw.integers(50, 80)), hide.direction(draw, 2.5e-3 * strength)

    def torque(time, attitude, rate):
        return np.zeros(3), vector * (np.exp((start - time) / 4.0) if time >= start else 0.0)

    return {"hidden": mj.Hidden(fields=[torque])}


@pytest.mark.usefixtures("slow")
def test_a_sudden_torque_in_mujoco_is_drawn_better_with_events(tmp_path):
    case = hidden_case("sudden torque", torque_at_once, urdf=SERVICER4, status="unknown", frame="base")
    written = case.write(tmp_path / "study", 5, 1.5)
    study = Study.load(written.file)
    model = load_model(study)
    posterior = Posterior.of(model, load_manoeuvres(study, model.robot))
    perturbed = PerturbedModel(posterior)
    first = perturbed.fit()
    perturbed = perturbed.with_posterior(relinearised(posterior, first.z))
    hypothesis = Hypothesis(perturbed, perturbed.fit(z=first.z))
    bank = generic_signatures(perturbed, hypothesis.fit)
    smooth, sudden = (disturbing_wrench(hypothesis, bank, wanted) for wanted in (False, True))
    assert sudden.log_bayes_factor > smooth.log_bayes_factor + 10.0

    def correlation(found: SimpleNamespace) -> float:
        true = []
        for time, truth in zip(found.time, written.truths, strict=True):
            torque = case.torque(5, 1.5, truth)
            true.append(np.stack([np.interp(time, truth.times, torque[:, axis]) for axis in range(3)], axis=1))
        estimated = np.concatenate(found.torque[Frame.BASE])
        return float(np.corrcoef(estimated.ravel(), np.concatenate(true).ravel())[0, 1])

    assert correlation(sudden) > max(0.7, correlation(smooth) + 0.1)
    assert sudden.fixed_in is not None
