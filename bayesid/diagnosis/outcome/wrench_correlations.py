"""Correlations of a reconstructed disturbing torque with the motion of the robot, the orbit and the clock."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.outcome.disturbing_wrench import Frame, Unexplained
from bayesid.diagnosis.search.hypothesis import Hypothesis

__all__ = ["TorqueCorrelation", "torque_correlations"]

MOST = 12
"""Largest number of correlations returned."""


class TorqueCorrelation(NamedTuple):
    """Correlation of one component of the torque, in base axes, with a known series, all recordings pooled."""

    component: str
    series: str
    correlation: float


def torque_correlations(wrench: Unexplained, hypothesis: Hypothesis) -> list[TorqueCorrelation]:
    """Return the largest correlations of the reconstructed torque with motion, orbit and clock, the largest first.

    Parameters
    ----------
    wrench : Unexplained
    hypothesis : Hypothesis
        Hypothesis whose fit gives the motion of the joints and of the base.
    """
    torque = np.concatenate(wrench.torque[Frame.BASE])
    correlations = [
        TorqueCorrelation(f"torque {'xyz'[axis]}", name, float(np.corrcoef(torque[:, axis], series)[0, 1]))
        for name, series in _known_series(wrench, hypothesis)
        for axis in range(3)
        if np.std(series) > 0.0 and np.std(torque[:, axis]) > 0.0
    ]
    return sorted(correlations, key=lambda item: -abs(item.correlation))[:MOST]


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
