"""What a diagnosis advises: how like two causes look in these manoeuvres, and which manoeuvre would tell them apart."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis import Candidate, Diagnosis, Frame, Hypothesis, Unexplained
from bayesid.diagnosis.verdict import fit_without
from bayesid.simulation.effects import known_effects

__all__ = ["adequate_too", "advice", "differing", "imitation", "moves_with", "unseen"]

WEAK = 0.5
"""Power below which a candidate could not have been seen."""

VISIBLE = 1.0
"""Information, at the prior's scale, from which on a direction of a cause can be seen."""

ADVICE = {
    "initial-rate": "It is there before the arm moves: record a rest before the motion.",
    "noise": "It is there at rest: record the sensor with the arm at rest.",
    "outliers": "They are single samples: look at the readings themselves, and record at rest.",
    "quantisation": "The readings lie on a lattice: record at rest, and look up the sensor's resolution.",
}
"""What would bring a cause out that is no effect, by its name or a part of it."""


def advice(name: str) -> str:
    """Return the manoeuvre that would bring a cause out, as a sentence; of an effect its class states it."""
    bare = name.partition(":")[0]
    effect = known_effects().get(bare)
    said = effect.separated_by if effect else next((text for key, text in ADVICE.items() if key in bare), "")
    return said or "Repeat with other amplitudes, other speeds and the base in another attitude."


def differing(first: Hypothesis, second: Hypothesis) -> tuple[list[str], list[str]]:
    """Return the causes that each of two hypotheses has and the other has not."""
    mine = [label for label in first.labels if label not in second.labels]
    theirs = [label for label in second.labels if label not in first.labels]
    return mine, theirs


def adequate_too(result: Diagnosis) -> list[Hypothesis]:
    """Return hypotheses of as many causes that leave nothing but noise either, but are too improbable to be rivals.

    Other names for the same change are left out.
    """
    verdict = result.verdict
    best = verdict.best
    same = [{*best.labels} - {cause} | {name} for cause, names in verdict.equivalents.items() for name in names]
    return [
        other
        for other in result.search.tried
        if verdict.causes
        and other.adequate
        and len(other.labels) == len(best.labels)
        and {*other.labels} not in [{*best.labels}, *same, *({*rival.labels} for rival in verdict.rivals)]
    ]


def imitation(best: Hypothesis, rival: Hypothesis, result: Diagnosis) -> float | None:
    """Cosine between the best's signal and the nearest that a rival can make.

    Of both, only what the model's own unknowns cannot take counts. One if these manoeuvres cannot tell them apart; None
    where a cause has no columns, as faults of noise.
    """
    mine, theirs = differing(best, rival)
    columns = result.search.suite.effects
    if not mine or not theirs or not {*mine, *theirs} <= columns.keys():
        return None
    base = result.before
    a = np.concatenate([columns[label] for label in mine], axis=1)
    b = np.concatenate([columns[label] for label in theirs], axis=1)
    both = fit_without(base, np.concatenate([a, b], axis=1))
    return _cosine(both, a.shape[1], -a.T @ base.fit.residual)


def _cosine(gram: Floats, count: int, pull: Floats) -> float | None:
    own, cross, rest = gram[:count, :count], gram[:count, count:], gram[count:, count:]
    amplitude = np.linalg.solve(own + np.eye(count), pull)
    energy = float(amplitude @ own @ amplitude)
    if energy <= 0.0:
        return None
    values, vectors = np.linalg.eigh(rest)
    seen = values > VISIBLE
    along = (vectors[:, seen].T @ (cross.T @ amplitude)) / np.sqrt(values[seen])
    return float(np.sqrt(min(1.0, float(along @ along) / energy)))


def unseen(rows: Sequence[Candidate]) -> list[Candidate]:
    """Return the candidates that these manoeuvres could hardly have shown, the least visible first."""
    found = [row for row in rows if row.power is not None and row.power < WEAK]
    return sorted(found, key=lambda row: row.power or 0.0)


def moves_with(wrench: Unexplained, hypothesis: Hypothesis, most: int = 12) -> list[tuple[str, str, float]]:
    """Return the largest correlations of the reconstructed torque with motion, orbit and clock, all recordings pooled.

    Returns
    -------
    list of (str, str, float)
        Torque axis, what it moves with, correlation.
    """
    known = list(_known_series(wrench, hypothesis))
    found = []
    torque = np.concatenate(wrench.torque[Frame.BASE])
    for axis in range(3):
        for name, series in known:
            if np.std(series) > 0.0 and np.std(torque[:, axis]) > 0.0:
                found.append((f"torque {'xyz'[axis]}", name, float(np.corrcoef(torque[:, axis], series)[0, 1])))
    return sorted(found, key=lambda item: -abs(item[2]))[:most]


def _known_series(wrench: Unexplained, hypothesis: Hypothesis) -> Iterator[tuple[str, Floats]]:
    posterior, node = hypothesis.fit.posterior, hypothesis.fit.operating.node
    states = [
        manoeuvre.motion.evaluate(time) for manoeuvre, time in zip(posterior.manoeuvres, wrench.time, strict=True)
    ]
    for order, kind in enumerate(("position", "speed", "acceleration")):
        for column, joint in enumerate(posterior.model.robot.joints):
            yield f"{kind} of {joint.name}", np.concatenate([state[order][:, column] for state in states])
    counts = [len(time) for time in wrench.time]
    for axis in range(3):
        rates = [np.asarray(node.rate)[r, :n, axis] for r, n in enumerate(counts)]
        yield f"rate of the base about {'xyz'[axis]}", np.concatenate(rates)
    if posterior.model.orbit is not None:
        phase = np.concatenate([np.asarray(node.environment.argument_of_latitude)[r, :n] for r, n in enumerate(counts)])
        yield "cosine of the argument of latitude", np.cos(phase)
        yield "sine of the argument of latitude", np.sin(phase)
    yield "time", np.concatenate(wrench.time)
    yield "time squared", np.concatenate(wrench.time) ** 2
