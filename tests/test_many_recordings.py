"""Many recordings: packed derivatives, parts of responses, bounded candidates, folds; memory that is refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from typer.testing import CliRunner

from bayesid._io.errors import InputError
from bayesid._math import memory
from bayesid.app import command_line
from bayesid.diagnosis import Rest, Status
from bayesid.diagnosis.candidates.generic_cause import ERROR_WAVES, WAVES, course_groups, instants_of_each
from bayesid.diagnosis.outcome.gain import FOLDS, folds_of
from bayesid.diagnosis.settings import FULL
from bayesid.inference import compiled
from bayesid.inference.adapted_proposal import adapted_proposal, effective_share
from bayesid.inference.memory_estimate import posterior_memory
from bayesid.inference.mode import maximise
from bayesid.inference.parameterisation import LogCholeskyParameterisation, StudentT
from bayesid.inference.perturbed_posterior import LinearResponses, Perturbation
from bayesid.inference.posterior import Posterior
from bayesid.inference.recording_check import check_recordings
from bayesid.simulation.effects import WheelHistory
from studies.truth import hidden_causes
from tests.hidden import diagnosed


@pytest.fixture(scope="module")
def three(planar_posterior: Callable[..., Posterior]) -> Posterior:
    """Three recordings, with rates, an attitude of the second, and histories of a wheel of their own."""
    base = planar_posterior(np.random.default_rng(3), step=0.5)
    flown = [base.manoeuvres[0]] * 3
    flown[1] = replace(flown[1], attitude_sigma=1e-3)
    model = replace(base.model, effects=(*base.model.effects, WheelHistory("z", 40.0)))
    return Posterior.of(model, flown, step=0.5)


@pytest.mark.slow
def test_packed_derivatives_are_those_of_every_unknown(three: Posterior) -> None:
    """Unknowns of different recordings share columns; here each is differentiated by itself."""
    z = 0.1 * np.random.default_rng(4).normal(size=three.size)
    found = compiled.jacobian(three.structure, three.numbers, z, three.data.arrays)
    assert three.unknowns.layout.packed.max() + 1 < three.size / 2
    for place in (0, 7, 10, 14, 18, 19, 22, 40, three.size - 1):
        step = 1e-4 * np.eye(three.size)[place]
        expected = (three.residuals(z + step) - three.residuals(z - step)) / 2e-4
        np.testing.assert_allclose(found[place], expected, atol=1e-5 * max(np.abs(expected).max(), 1.0))


@pytest.mark.slow
def test_responses_of_a_part_are_those_of_the_whole(three: Posterior) -> None:
    rng = np.random.default_rng(5)
    z, arrays = 0.1 * rng.normal(size=three.size), three.data.arrays
    node, sample = arrays.grid.node.known.shape, arrays.grid.sample.known.shape
    shapes = (node, sample, (*node[:2], 6), (*sample[:2], 6), arrays.offset.shape)
    pushes = Perturbation(*(rng.normal(size=(2, *shape)) for shape in shapes))
    linear = LinearResponses.about(three, z, arrays)
    whole = linear.along(pushes)
    for chosen in ([1], [0, 2]):
        part = linear.part(chosen).along(jax.tree.map(lambda x, c=chosen: x[:, c], pushes))
        np.testing.assert_allclose(part, whole[:, chosen], rtol=1e-9, atol=1e-9 * np.abs(whole).max())


@pytest.mark.parametrize("recordings", [1, 6, 7, 40, 200])
def test_courses_of_what_nobody_listed_stay_bounded(recordings: int) -> None:
    """Up to six recordings all is weighed in each; then no more columns than one a recording and those of six."""
    groups = course_groups("torque", recordings, WAVES)
    columns = sum(len(chosen) * count for _, chosen, count in groups)
    if recordings <= FULL:
        assert groups == [("torque", list(range(recordings)), WAVES)]
        assert instants_of_each(20, recordings) == 20
    else:
        assert columns <= FULL * WAVES + recordings
        assert {r for _, chosen, _ in groups for r in chosen} == set(range(recordings))
        assert max(count for *_, count in groups) == WAVES == ERROR_WAVES
        assert recordings * instants_of_each(20, recordings) <= 20 * FULL + recordings


@pytest.mark.slow
def test_a_torque_that_nobody_listed_is_unknown_in_many_recordings(tmp_path: Path) -> None:
    """From seven recordings on, a disturbance has quick courses in some of them and slow ones in all."""
    (case,) = (case for case in hidden_causes.CASES if case.name == "growing-torque")
    manoeuvres = {"count": FULL + 1, "duration": 40.0}
    latitudes = [0.1 * number for number in range(FULL + 1)]
    case = replace(case, fixed={**case.fixed, "manoeuvres": manoeuvres, "latitudes": latitudes})
    result = diagnosed(case.make(tmp_path, 5, 6.0))
    assert result.verdict.status is Status.UNKNOWN
    assert result.remainder.verdict is Rest.PRESENT


def test_every_recording_is_left_out_once() -> None:
    assert folds_of(3) == [range(0, 3, FOLDS), range(1, 3, FOLDS), range(2, 3, FOLDS)]
    left_out = [recording for fold in folds_of(43) for recording in fold]
    assert len(folds_of(43)) == FOLDS
    assert sorted(left_out) == list(range(43))


def test_a_check_predicts_once_for_all_recordings(three: Posterior, monkeypatch: pytest.MonkeyPatch) -> None:
    from bayesid.inference import recording_check

    calls = []
    predict = recording_check.readings_at_start
    monkeypatch.setattr(recording_check, "readings_at_start", lambda p: calls.append(p) or predict(p))
    assert [check.name for check in check_recordings(three)] == [m.recording.name for m in three.manoeuvres]
    assert len(calls) == 1


def test_what_cannot_fit_is_refused_before_it_is_allocated(three: Posterior, monkeypatch: pytest.MonkeyPatch) -> None:
    """The estimate grows with samples and recordings, and exceeds the arrays that are kept in the end."""
    needed = posterior_memory(three.model, three.data.recorded)
    kept = sum(np.asarray(x).nbytes for x in jax.tree.leaves(three.data.arrays))
    assert kept / 3.0 < needed < 30.0 * kept
    assert posterior_memory(three.model, three.data.recorded[:1]) < needed
    monkeypatch.setattr(memory, "free_memory", lambda: 0.5 * needed)
    with pytest.raises(InputError, match=r"GB of memory, but .* GB are free.*fewer or shorter recordings"):
        Posterior.of(three.model, three.manoeuvres, step=0.5)


@pytest.mark.parametrize("error", [MemoryError(), RuntimeError("RESOURCE_EXHAUSTED: Out of memory")])
def test_a_lack_of_memory_is_one_message(error: Exception) -> None:
    def run() -> object:
        raise error
        yield

    app = command_line.typer.Typer()
    app.command()(command_line._command(run))
    result = CliRunner().invoke(app, [])
    assert result.exit_code == 2
    assert "not enough memory" in result.output
    assert "Traceback" not in result.output


def test_free_memory_is_a_number_of_bytes() -> None:
    assert 1e6 < memory.free_memory() < 1e15


class CutPrior:
    """Standard normal in six dimensions, of which a wall leaves half: the density falls by 100 nats beyond it."""

    size = 6

    def proposal(self, optimum: object) -> StudentT:
        return StudentT.about(np.full(self.size, 0.3), 0.1 * np.eye(self.size))

    def log_density(self, y: np.ndarray) -> np.ndarray:
        return -0.5 * (y**2).sum(axis=1) - 100.0 * (y[:, 0] < 0.0)


def test_a_proposal_is_fitted_to_a_prior_that_data_cut_off() -> None:
    """Mean and variance of half a normal are known; the first proposal, three times too narrow, is worth little."""
    target, rng = CutPrior(), np.random.default_rng(6)
    optimum = SimpleNamespace(z=np.zeros(target.size))
    first = effective_share(target, target.proposal(optimum), rng)
    adapted = adapted_proposal(target, optimum, rng)
    assert adapted is not None
    assert first < 0.1 < effective_share(target, adapted, rng)
    y = adapted.draw(20000, rng)
    weights = np.exp(target.log_density(y) - adapted.log_density(y))
    mean = weights @ y / weights.sum()
    np.testing.assert_allclose(mean, [np.sqrt(2.0 / np.pi), 0.0, 0.0, 0.0, 0.0, 0.0], atol=0.07)


@pytest.mark.slow
def test_a_sampler_ends_at_its_time(planar_posterior: Callable[..., Posterior]) -> None:
    from bayesid.inference.ensemble import sample

    posterior, optimum = maximise(planar_posterior(np.random.default_rng(3), step=0.5), np.random.default_rng(0))
    chains = sample(LogCholeskyParameterisation(posterior), optimum, 1, effective_samples=1e9, max_seconds=0.0)
    assert chains.steps == 10
    assert not chains.converged
