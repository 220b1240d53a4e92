"""Forms of what nobody listed: tones, and disturbances that change the data as listed causes would."""

from __future__ import annotations

import numpy as np
import pytest

from bayesid.app.schema import Study
from bayesid.app.study_to_model import load_manoeuvres, load_model
from bayesid.diagnosis import Status, diagnose
from bayesid.diagnosis.candidates.cause_kind import candidates
from bayesid.diagnosis.candidates.courses import CourseGram
from bayesid.diagnosis.candidates.further_forms import choices_beside, with_forms
from bayesid.diagnosis.candidates.tones import _gains
from bayesid.diagnosis.evidence.cause_sets import CausePrior, CauseSet, SetProbabilities
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.evidence.verdict import Rest
from studies.truth import hidden_causes


def test_further_forms_have_half_of_the_prior() -> None:
    group = AmplitudeGroup("torque", 1.0)
    cause = CandidateCause("torque", (group,), True, ((group,),), (0.3, 0.7))
    more = with_forms(cause, [(group, 0.0), (group, -1e3)])
    np.testing.assert_allclose(np.exp([form.log_weight for form in more.variants]), [0.15, 0.35, 0.25, 0.0], atol=1e-12)
    assert with_forms(cause, []) is cause


def test_forms_are_chosen_beside_every_part_of_the_best_named_set() -> None:
    sets = [CauseSet(("a", "b"), "torque", 20.0), CauseSet(("c",), None, 5.0), CauseSet((), None, 0.0)]
    found = SetProbabilities.of(sets, ["a", "b", "c"], ["torque"], CausePrior())
    assert choices_beside(found) == [(), ("a",), ("b",), ("a", "b")]


def test_a_tone_gains_what_a_fit_of_its_columns_does() -> None:
    """Two recordings of different lengths, whose responses to any course follow from those to its cosines."""
    rng, waves, ends = np.random.default_rng(1), 30, np.array([100.0, 80.0])
    frequency, rows = 0.05, 300
    columns = rng.normal(size=(2, rows, waves, 3))
    residual = rng.normal(size=(2, rows))
    matrix = np.einsum("rnwa,rnxb->rwaxb", columns, columns)
    courses = CourseGram(matrix, np.einsum("rnwa,rn->rwa", columns, residual), ends)
    places = (np.arange(4000) + 0.5) / 4000
    tones = []
    for r, end in enumerate(ends):
        angle = 2.0 * np.pi * frequency * end * places
        basis = np.cos(np.pi * np.arange(waves)[:, None] * places)
        parts = 2.0 * basis @ np.stack([np.cos(angle), np.sin(angle)], axis=1) / 4000
        parts[0] *= 0.5
        tones.append(np.einsum("nwa,wp->npa", columns[r], parts).reshape(rows, 6))
    whole = np.concatenate(tones)
    fitted = whole @ np.linalg.lstsq(whole, residual.ravel(), rcond=None)[0]
    assert _gains(courses, np.array([frequency]))[0] == pytest.approx(0.5 * fitted @ residual.ravel(), rel=1e-3)


@pytest.mark.usefixtures("slow")
def test_a_cause_that_something_imitates_is_not_named(tmp_path) -> None:
    """A swinging body acts in time with pulses."""
    likely = ("thruster-pulses", "thruster-leak")
    hidden = next(one for one in hidden_causes.FURTHER_CASES if one.name == "swinging-mass")
    study = Study.load(hidden.make(tmp_path, 32, 1.0))
    model = load_model(study)
    effects = [effect for effect in candidates(model) if effect.label in likely]
    verdict = diagnose(model, load_manoeuvres(study, model.robot), effects=effects).verdict
    assert verdict.status is Status.UNKNOWN or verdict.remainder.verdict is Rest.PRESENT, verdict
    assert not set(verdict.causes) & set(likely), verdict
