"""Bayes factors between the rivals before and after the designed manoeuvres, expected and realised, and verdicts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis import diagnose
from bayesid.recording.joint_motion import Motion
from bayesid.report.sentences.set_words import set_text
from studies.common.monte_carlo import run_trials
from studies.separating.expected import Expected, Linearised, Pair
from studies.separating.factors import Flown, Rivalry, Sampled, flown, noisy
from studies.separating.manoeuvres import Designed
from studies.separating.setting import CANDIDATES, RIVALS, STAGES, TRUTHS, amplitude, rival_model

__all__ = ["Realised", "Result", "Verdict", "diagnosed_causes", "expectations", "realise"]

DIRECTIONS = 200
"""Number of random directions of an effect for which the separation is computed."""


@dataclass(frozen=True)
class Realised:
    """Log Bayes factors over noises where one rival is hidden.

    Attributes
    ----------
    truth : str
        Label of the hidden rival.
    detected : (S,) array
        Log Bayes factors of the truth against no cause at all, from the first manoeuvre alone.
    factors : mapping of str to (S,) array
        Log Bayes factors of the truth against its rival, by stage.
    """

    truth: str
    detected: Floats
    factors: Mapping[str, Floats]


@dataclass(frozen=True)
class Verdict:
    """Verdict of the package's diagnosis: its status, the causes that it names, and other explanations."""

    status: str
    causes: tuple[str, ...]
    others: tuple[str, ...]


@dataclass(frozen=True)
class Result:
    """Outcome of the study.

    Attributes
    ----------
    pairs : sequence of Pair
        All pairs of candidates on the first manoeuvre.
    designs : mapping of str to Designed
        Designed manoeuvres by their criterion.
    expected : mapping of (truth, stage) to Expected
        Expectations of linear theory.
    directions : mapping of (truth, stage) to (n,) array
        Values lambda (1 - rho^2) / 2 of effects of the same size in random directions.
    realised : sequence of Realised
        Realised log Bayes factors, one for each truth.
    sampled : mapping of str to Sampled
        Log Bayes factors by importance sampling, by truth, from the first noise and the separating manoeuvre.
    verdicts : mapping of (truth, stage) to Verdict
        Verdicts of the diagnosis on the first noise; empty where it was not run.
    duration : float
        Duration of every manoeuvre [s].
    """

    pairs: Sequence[Pair]
    designs: Mapping[str, Designed]
    expected: Mapping[tuple[str, str], Expected]
    directions: Mapping[tuple[str, str], Floats]
    realised: Sequence[Realised]
    sampled: Mapping[str, Sampled]
    verdicts: Mapping[tuple[str, str], Verdict]
    duration: float


def expectations(
    motions: Mapping[str, Motion], duration: float, seed: int
) -> tuple[dict[tuple[str, str], Expected], dict[tuple[str, str], Floats]]:
    """Expect the Bayes factors of all truths and stages, and for effects of the same size in random directions."""
    single = {name: Linearised.of(rival_model(RIVALS), motion, duration) for name, motion in motions.items()}
    directions = np.random.default_rng(seed).normal(size=(DIRECTIONS, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    expected, energies = {}, {}
    for stage, (first, *others) in STAGES.items():
        joined = single[first]
        for name in others:
            joined = joined.with_another(single[name])
        for truth in RIVALS:
            hidden = amplitude(truth)
            expected[truth, stage] = joined.expect(truth, hidden)
            turned = np.pad(np.linalg.norm(hidden) * directions, ((0, 0), (len(hidden) - 3, 0)))
            energies[truth, stage] = np.array([joined.expect(truth, other).energy for other in turned])
    return expected, energies


def _flights(motions: Mapping[str, Motion], duration: float, truth: str) -> dict[str, Flown]:
    return {name: flown(motion, duration, truth, TRUTHS[truth]) for name, motion in motions.items()}


def realise(
    motions: Mapping[str, Motion], duration: float, noises: int, seed: int, progress: Callable[[str], None]
) -> tuple[list[Realised], dict[str, Sampled]]:
    """Fly all manoeuvres with each rival hidden, and compare the models for several noises.

    The noise of a recording follows from its number, so that all stages share it.
    """
    rivalry, flights = Rivalry(), {truth: _flights(motions, duration, truth) for truth in RIVALS}

    def compared(task: tuple[str, int], rng: np.random.Generator) -> dict[str, Any]:
        """Return the log Bayes factors of one truth from one noise."""
        truth, number = task
        first, *_ = recorded = [noisy(flights[truth], names, seed + number) for names in STAGES.values()]
        evidence = [rivalry.log_evidence(label, first, rng) for label in (truth, "")]
        factors = [rivalry.log_factor(truth, manoeuvres, rng) for manoeuvres in recorded]
        return {"detected": evidence[0] - evidence[1], "factors": factors}

    tasks = [(truth, number) for truth in RIVALS for number in range(noises)]
    outcomes = run_trials(compared, tasks, seed=seed, progress=lambda text: progress(f"noises: {text}")).complete()
    rows, sampled = [], {}
    for index, truth in enumerate(RIVALS):
        part = outcomes[index * noises : (index + 1) * noises]
        factors = np.array([outcome["factors"] for outcome in part]).T
        detected = np.array([outcome["detected"] for outcome in part])
        rows.append(Realised(truth, detected, dict(zip(STAGES, factors, strict=True))))
        last = noisy(flights[truth], STAGES["first, separating"], seed)
        sampled[truth] = rivalry.sampled(truth, last, np.random.default_rng(seed))
        progress(f"{truth}: {sampled[truth]}")
    return rows, sampled


def diagnosed_causes(
    motions: Mapping[str, Motion], duration: float, seed: int, progress: Callable[[str], None]
) -> dict[tuple[str, str], Verdict]:
    """Diagnose the flights of one noise with each rival hidden; the candidates are the five of the study."""
    verdicts, model = {}, rival_model([])
    for truth in RIVALS:
        flights = _flights(motions, duration, truth)
        for stage, names in STAGES.items():
            verdict = diagnose(model, noisy(flights, names, seed), seed, effects=list(CANDIDATES)).verdict
            others = tuple(map(set_text, verdict.ambiguous_with))
            verdicts[truth, stage] = Verdict(verdict.status.value, verdict.causes, others)
            progress(f"{truth}, {stage}: {verdicts[truth, stage]}")
    return verdicts
