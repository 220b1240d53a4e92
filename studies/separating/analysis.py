"""Bayes factors between the rivals before and after the designed manoeuvres, expected and realised."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.recording.joint_motion import Motion
from studies.common import mission
from studies.common.ets7 import BIAS
from studies.common.flight import light_wheel
from studies.common.models import ARM_SPREAD
from studies.common.monte_carlo import run_trials
from studies.common.repeated_fits import Reference
from studies.separating.linear_evidence import Expected, Linearised
from studies.separating.setting import DRIFT, RIVALS, STAGES, TRUTHS, amplitude, drifting, rival_model
from studies.truth.mujoco import Truth, leak

__all__ = ["Realised", "expectations", "flown", "realise", "references"]

DIRECTIONS = 200  # number of random directions of an effect for which the separation is computed


@dataclass(frozen=True)
class Realised:
    """Log Bayes factors over flights where one rival is hidden."""

    truth: str  # label of the hidden rival
    detected: Floats  # (S,): log Bayes factors of the truth against no cause at all, from the first manoeuvre alone
    factors: Mapping[str, Floats]  # log Bayes factors of the truth against its rival, by stage


def references(motions: Mapping[str, Motion], arm_spread: float = ARM_SPREAD) -> dict[str, Reference]:
    """Return the manoeuvres linearised about the drifting base, with both rivals as unknowns.

    Parameters
    ----------
    motions : mapping of str to Motion
    arm_spread : float
        Relative width of the links' priors.
    """
    model = rival_model(RIVALS, arm_spread)
    z = drifting(mission.problem(model, mission.splines()).plan.unknowns)
    return {name: Reference.of(model, motion, z) for name, motion in motions.items()}


def joined(single: Mapping[str, Linearised], names: Sequence[str]) -> Linearised:
    """Return the manoeuvres of a stage, fitted together."""
    first, *others = names
    total = single[first]
    for name in others:
        total = total.with_another(single[name])
    return total


def expectations(
    known: Mapping[str, Reference], seed: int
) -> tuple[dict[tuple[str, str], Expected], dict[tuple[str, str], list[Expected]]]:
    """Expect the Bayes factors of all truths and stages, and for effects of the same size in random directions."""
    single = {name: Linearised.of(reference) for name, reference in known.items()}
    directions = np.random.default_rng(seed).normal(size=(DIRECTIONS, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    expected: dict[tuple[str, str], Expected] = {}
    turned: dict[tuple[str, str], list[Expected]] = {}
    for stage, names in STAGES.items():
        total = joined(single, names)
        for truth in RIVALS:
            hidden = amplitude(truth)
            expected[truth, stage] = total.expect(truth, hidden)
            others = np.pad(np.linalg.norm(hidden) * directions, ((0, 0), (len(hidden) - 3, 0)))
            turned[truth, stage] = [total.expect(truth, other) for other in others]
    return expected, turned


def flown(motion: Motion, truth: str, size: Floats, **options: Any) -> Truth:
    """Fly a manoeuvre of the drifting base with one of the rivals hidden.

    Parameters
    ----------
    motion : Motion
        Motion of the joints.
    truth : str
        Label of the rival, or empty for none.
    size : (3,) array
        Momentum of the wheels [N m s] or torque of the leak [N m], base axes.
    **options
        Further arguments of `studies.common.mission.fly`.
    """
    hidden: dict[str, Any] = {}
    if truth == "wheel-momentum":
        hidden = {"rotor": light_wheel(size)}
    elif truth == "thruster-leak":
        hidden = {"fields": [leak((0.0, 0.0, 0.0), size)]}
    return mission.fly(motion, rate=DRIFT, **hidden, **options)


def realise(
    motions: Mapping[str, Motion],
    known: Mapping[str, Reference],
    noises: int,
    seed: int,
    store: Path | None = None,
    progress: Callable[[str], None] = lambda text: None,
    arm_spread: float = ARM_SPREAD,
) -> list[Realised]:
    """Fly all manoeuvres with each rival hidden, and compare the models; each time with another arm, bias and noise.

    Parameters
    ----------
    motions : mapping of str to Motion
    known : mapping of str to Reference
        The same manoeuvres linearised, with the links' priors of the same width.
    noises : int
        Number of sets of flights for each truth.
    seed, store, progress
        See `studies.common.monte_carlo.run_trials`.
    arm_spread : float
        Relative width of the distribution from which the true arm is drawn.
    """

    def compared(task: tuple[str, int], rng: np.random.Generator) -> dict[str, Any]:
        """Return the log Bayes factors of one truth from one set of flights."""
        truth, _ = task
        robot, bias = mission.true_arm(mission.ship(), rng, arm_spread), BIAS * rng.standard_normal(3)
        single = {}
        for name, motion in motions.items():
            run = flown(motion, truth, TRUTHS[truth], robot=robot)
            single[name] = Linearised.of(known[name], mission.recorded(run, rng, name, bias))
        detected = _evidence(single["first"], truth) - _evidence(single["first"], "")
        factors = []
        for names in STAGES.values():
            total = joined(single, names)
            values = {label: _evidence(total, label) for label in RIVALS}
            factors.append(2.0 * values[truth] - sum(values.values()))
        return {"detected": detected, "factors": factors}

    tasks = [(truth, number) for number in range(noises) for truth in RIVALS]
    outcomes = run_trials(compared, tasks, store, seed=seed, progress=lambda text: progress(f"flights: {text}"))
    results, rows = outcomes.complete(), []
    for index, truth in enumerate(RIVALS):
        part = results[index :: len(RIVALS)]
        factors = np.array([outcome["factors"] for outcome in part]).T
        detected = np.array([outcome["detected"] for outcome in part])
        rows.append(Realised(truth, detected, dict(zip(STAGES, factors, strict=True))))
    return rows


def _evidence(linearised: Linearised, label: str) -> float:
    """Return the log evidence of the model with one rival, or with neither where the label is empty."""
    return linearised.log_evidence(linearised.without([other for other in RIVALS if other != label]))
