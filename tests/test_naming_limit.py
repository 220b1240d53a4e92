"""The simulated share of right decisions, against decisions on drawn data with evidence that is written out densely."""

from __future__ import annotations

import numpy as np
import pytest

from bayesid.diagnosis.evidence.cause_sets import CausePrior
from bayesid.diagnosis.evidence.scales import AmplitudeGroup, CandidateCause
from bayesid.diagnosis.evidence.set_evidence import SetEvidence
from bayesid.diagnosis.evidence.verdict import ProbableVerdict, Status
from bayesid.diagnosis.settings import DEFAULT_SETTINGS
from studies.blind_injections import Trial
from studies.blind_injections.goals import _relative
from studies.blind_injections.limits import simulated_naming
from studies.common.study import Verdict
from tests.gram_problem import LinearProblem

SCALE, HIDDEN, DRAWS = 3.0, 1.0, 1500


@pytest.fixture(scope="module")
def problem() -> LinearProblem:
    """Two causes of one amplitude whose signatures are much alike."""
    rng = np.random.default_rng(8)
    problem = LinearProblem.random(rng, {"left": 1, "right": 1})
    problem.columns["right"] = 0.9 * problem.columns["left"] + 0.25 * problem.columns["right"]
    return problem


def named(problem: LinearProblem, prior: CausePrior) -> bool:
    """Whether the left cause is named alone on the problem's data: only it has a probability of 0.9."""
    sets = [(), ("left",), ("right",), ("left", "right")]
    log = [
        problem.log_density({name: np.array([SCALE**2]) for name in names})
        + prior.log_probability(len(names), 2, False, 0)
        for names in sets
    ]
    weight = np.exp(np.array(log) - max(log))
    left, right = (weight[[name in names for names in sets]].sum() / weight.sum() for name in ("left", "right"))
    best = sets[int(weight.argmax())]
    return best == ("left",) and left >= DEFAULT_SETTINGS.named_from > right


def test_the_share_is_that_of_decisions_on_drawn_data(problem):
    rng, prior = np.random.default_rng(1), CausePrior()
    dense = np.mean([named(problem.observed(rng, {"left": np.array([HIDDEN])}), prior) for _ in range(DRAWS)])
    gram = problem.observed(rng).gram()
    causes = [CandidateCause(name, (AmplitudeGroup(name, SCALE, low=SCALE),)) for name in problem.columns]
    evidence = SetEvidence(gram, causes)
    score = -HIDDEN * gram.matrix[:, gram.groups["left"][0]]

    def right(verdict: ProbableVerdict) -> bool:
        return verdict.status is Status.EXPLAINED and verdict.causes == ("left",)

    share = simulated_naming(evidence, prior, score, right, rng, DRAWS)
    assert 0.2 < dense < 0.8
    assert share == pytest.approx(dense, abs=4.0 * np.sqrt(2.0 * dense * (1.0 - dense) / DRAWS))


def trials(right: int, total: int, naming: float) -> list[Trial]:
    """Trials of which some are named rightly, all with the same limit."""
    empty = dict.fromkeys(Trial.__dataclass_fields__)
    said = {"hidden": ("rate-bias",), "accept": (), "status": "explained", "detection": 1.0, "naming": naming}
    names = [("rate-bias",)] * right + [("rate-drift",)] * (total - right)
    return [Trial(**{**empty, **said, "causes": own}) for own in names]


def test_names_are_compared_with_the_limit():
    assert _relative("named", 0.97, []).verdict is Verdict.NOT_TESTED
    assert _relative("named", 0.97, trials(490, 500, 0.9)).verdict is Verdict.PASS
    assert _relative("named", 0.97, trials(440, 500, 0.9)).verdict is Verdict.OPEN
    assert _relative("named", 0.97, trials(300, 500, 0.9)).verdict is Verdict.FAIL
    assert _relative("named", 0.97, trials(440, 500, 0.9)).reached.startswith("0.98 (0.94 to 1.01): 440 where")
