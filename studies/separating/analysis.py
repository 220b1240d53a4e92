"""The first manoeuvre, the designed ones, and the Bayes factor between the rivals before and after."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesid.design import Search, Store
from bayesid.recording.joint_motion import Motion
from studies.common.ets7 import START, FlightManoeuvre
from studies.separating.expected import Expected, Linearised
from studies.separating.factors import Rivalry, Sampled, flown, noisy
from studies.separating.manoeuvres import Designed, design_both, separating_problem
from studies.separating.pairs import Pair
from studies.separating.setting import RIVALS, TRUTHS, amplitude, rival_model
from studies.separating.verdicts import Verdict

__all__ = ["STAGES", "Realised", "Result", "design_stage", "expectations", "motions_of", "realise"]

Floats = NDArray[np.floating]

DIRECTIONS = 200
"""Random directions of an effect for which the separation is computed."""

STAGES = {
    "first alone": ("first",),
    "first, d-optimal": ("first", "d-optimal"),
    "first, separating": ("first", "separation"),
}
"""Which manoeuvres are fitted together."""


@dataclass(frozen=True)
class Realised:
    """What was found where one rival is hidden.

    Attributes
    ----------
    truth : str
    detected : (S,) array
        Log Bayes factor of the truth against no cause at all, first manoeuvre alone.
    factors : mapping of str to (S,) array
        By stage, of the truth against its rival, one per noise.
    """

    truth: str
    detected: Floats
    factors: Mapping[str, Floats]


@dataclass(frozen=True)
class Result:
    """All that the report tells."""

    pairs: Sequence[Pair]
    designs: Mapping[str, Designed]
    expected: Mapping[tuple[str, str], Expected]
    """By truth and stage."""
    directions: Mapping[tuple[str, str], Floats]
    """Likewise, lambda (1 - rho^2) / 2 of effects of the same size in random directions."""
    realised: Sequence[Realised]
    sampled: Mapping[str, Sampled]
    """By truth, of the first noise and the designed manoeuvre."""
    verdicts: Mapping[tuple[str, str], Verdict]
    """By truth and stage, what `diagnose` says of the first noise; empty where it was not asked."""
    duration: float


def design_stage(
    duration: float, points: int, seed: int, search: Search, store: Store, progress: Callable[[str], None]
) -> Mapping[str, Designed]:
    """Design both manoeuvres."""
    return design_both(separating_problem(duration, points), seed, search, store, progress)


def motions_of(designs: Mapping[str, Designed]) -> dict[str, Motion]:
    """Return all manoeuvres by name."""
    return {"first": FlightManoeuvre(START), **{name: item.motion for name, item in designs.items()}}


def expectations(
    motions: Mapping[str, Motion], duration: float, seed: int
) -> tuple[dict[tuple[str, str], Expected], dict[tuple[str, str], Floats]]:
    """Expect the Bayes factors of all truths and stages, and for effects of the same size in random directions."""
    model, posterior = rival_model(RIVALS), None
    single = {}
    for name, motion in motions.items():
        single[name], posterior = Linearised.of(model, motion, duration, posterior)
    directions = np.random.default_rng(seed).normal(size=(DIRECTIONS, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    found, energies = {}, {}
    for stage, names in STAGES.items():
        joined = single[names[0]]
        for name in names[1:]:
            joined = joined.with_another(single[name])
        for truth in RIVALS:
            own = amplitude(truth)
            found[truth, stage] = joined.expect(truth, own)
            turned = np.zeros((DIRECTIONS, len(own)))
            turned[:, -3:] = np.linalg.norm(own) * directions
            energies[truth, stage] = joined.energies(truth, turned)
    return found, energies


def realise(
    motions: Mapping[str, Motion], duration: float, noises: int, seed: int, progress: Callable[[str], None]
) -> tuple[list[Realised], dict[str, Sampled]]:
    """Fly all manoeuvres with each rival hidden, and compare the models for several noises.

    Parameters
    ----------
    duration : float
        Of every manoeuvre [s].
    noises : int
    """
    rivalry, rows, sampled = Rivalry(), [], {}
    for truth in RIVALS:
        flights = {name: flown(motion, duration, truth, TRUTHS[truth]) for name, motion in motions.items()}
        detected = np.zeros(noises)
        factors = {stage: np.zeros(noises) for stage in STAGES}
        for number in range(noises):
            rng = np.random.default_rng([seed, number])
            first = noisy(flights, STAGES["first alone"], seed + number)
            detected[number] = rivalry.log_evidence(truth, first, rng) - rivalry.log_evidence("", first, rng)
            for stage, names in STAGES.items():
                factors[stage][number] = rivalry.log_factor(truth, noisy(flights, names, seed + number), rng)
            line = ", ".join(f"{stage} {values[number]:.1f}" for stage, values in factors.items())
            progress(f"{truth}, noise {number + 1}: {line}, detected {detected[number]:.1f}")
        rows.append(Realised(truth, detected, factors))
        last = noisy(flights, STAGES["first, separating"], seed)
        sampled[truth] = rivalry.sampled(truth, last, np.random.default_rng(seed))
        progress(f"{truth}: {sampled[truth]}")
    return rows, sampled
