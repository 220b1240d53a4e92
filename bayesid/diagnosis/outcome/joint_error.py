"""Error of a joint's recorded position as a function of the position, where the data most probably show one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.diagnosis.candidates.linear_model import Linearisation
from bayesid.diagnosis.candidates.motion_errors import JOINT, joint_positions, joint_series
from bayesid.diagnosis.evidence.amplitude_posterior import AmplitudePosterior

__all__ = ["JointError", "joint_error"]

POINTS = 100
"""Positions at which the error is evaluated."""


class JointError(NamedTuple):
    """Recorded less true position of a joint, at positions over its range in the recordings.

    Attributes
    ----------
    joint : str
    unit : str
        rad or m.
    positions, errors, deviations : (n,) arrays
        Positions, posterior mean of the error at each and its standard deviation.
    """

    joint: str
    unit: str
    positions: Floats
    errors: Floats
    deviations: Floats


def joint_error(point: Linearisation) -> JointError | None:
    """Return the error of the joint of which it is most probable, given that one errs; None where no joint moves.

    Parameters
    ----------
    point : Linearisation
    """
    evidence, robot = point.evidence, point.fit.posterior.model.robot
    if JOINT not in evidence.causes:
        return None
    form = point.most_probable_form(JOINT, (JOINT,)).name
    index = next(k for k, joint in enumerate(robot.joints) if form == f"{JOINT}, {joint.name}")
    visited = joint_positions(point.fit)[:, index]
    positions = np.linspace(visited.min(), visited.max(), POINTS)
    cosines = -joint_series(visited).derivatives(positions)[0]  # the links are displaced by the negative error
    posterior = AmplitudePosterior.of(evidence, (JOINT,))
    deviations = np.sqrt(np.einsum("nk,kl,nl->n", cosines, posterior.covariance, cosines))
    joint = robot.joints[index]
    return JointError(joint.name, joint.unit, positions, cosines @ posterior.mean, deviations)
