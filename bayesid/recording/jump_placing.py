"""Where within its steps a jump of the joints' motion lies.

A jump is found with a variance in each step in which it may lie, so that the states at the nodes between these are
free. The samples know better: the states before and after, and the positions between, leave one instant that explains
them. The likelihood of the increments of the steps follows from their posterior with the free jump, and each part of a
step is weighed by it as the place of the jump, of all joints that jump there together. Joints jump at one instant.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, islice

import numpy as np
import scipy.linalg as sla

from bayesid._math.arrays import Floats
from bayesid.recording.band_covariance import covariances_by_distance
from bayesid.recording.integrated_process import Jump, jump_moments
from bayesid.recording.smoothing import SmoothedJoint

__all__ = ["placed_jumps"]

PARTS = 10
"""Parts of a step, of which each may hold the jump."""

BESIDE = 1
"""Steps on either side of those found that may hold the jump, too."""

MOST_STEPS = 8
"""Steps above which a jump stays where it was found: the samples show too little of it to say more."""

UNLIKELY = 1e-4
"""Probability of a part relative to the likeliest below which the jump is not there."""

UNSEEN = 1e-9
"""Information on an increment relative to its prior below which it is none."""


def placed_jumps(joints: Sequence[SmoothedJoint]) -> list[SmoothedJoint]:
    """Return the joints smoothed anew with every jump in the parts of its steps that the samples allow."""
    together: dict[tuple[bytes, int, int, int], list[tuple[int, int]]] = {}
    for index, joint in enumerate(joints):
        for number, jump in enumerate(joint.jumps):
            key = (joint.nodes.tobytes(), jump.first, len(jump.variances), jump.derivative)
            together.setdefault(key, []).append((index, number))
    placed = [list(joint.jumps) for joint in joints]
    near = [_NearNodes(joint) if joint.jumps else None for joint in joints]
    for members in together.values():
        index, number = members[0]
        steps = _searched(joints[index], joints[index].jumps[number])
        if len(steps) > MOST_STEPS:
            continue
        log_p = np.zeros((len(steps), PARTS))
        for index, number in members:
            own = near[index]
            assert own is not None
            log_p += own.log_evidence(number, steps)
        probability = np.exp(log_p - log_p.max())
        probability[probability < UNLIKELY] = 0.0
        likely = np.flatnonzero(probability.sum(axis=1))
        kept = probability[likely[0] : likely[-1] + 1] / probability.sum()
        for index, number in members:
            jump = joints[index].jumps[number]
            variances = tuple(tuple(row) for row in (jump.variance * kept).tolist())
            placed[index][number] = Jump(steps[likely[0]], jump.derivative, variances)
    return [
        joint.with_jumps(_apart(joint, own), (joint.order,)) if own else joint
        for joint, own in zip(joints, placed, strict=True)
    ]


def _apart(joint: SmoothedJoint, jumps: list[Jump]) -> list[Jump]:
    """Return the jumps with those free that share a node: the samples between cannot tell one from the other."""
    shared = {
        number
        for (first, one), (second, other) in combinations(enumerate(jumps), 2)
        if one.steps.start <= other.steps.stop and other.steps.start <= one.steps.stop
        for number in (first, second)
    }
    return [_free(joint, jump) if number in shared else jump for number, jump in enumerate(jumps)]


def _free(joint: SmoothedJoint, jump: Jump) -> Jump:
    """Return a jump as likely in each of its steps and in those beside them."""
    steps = _searched(joint, jump)
    return Jump(steps.start, jump.derivative, ((jump.variance / len(steps),),) * len(steps))


def _searched(joint: SmoothedJoint, jump: Jump) -> range:
    return range(max(jump.steps.start - BESIDE, 0), min(jump.steps.stop + BESIDE, len(joint.nodes) - 1))


class _NearNodes:
    """Joint with the covariances of its states at nodes near each other."""

    def __init__(self, joint: SmoothedJoint) -> None:
        self.joint = joint
        self.blocks = list(islice(covariances_by_distance(joint.factor, joint.order), MOST_STEPS + 1))
        self.process = joint.process(joint.jumps)

    def log_evidence(self, number: int, steps: range) -> Floats:
        """Return the log evidence of the samples with one of the jumps in each part of each step, (steps, PARTS).

        It is relative to a constant, which does not depend on the place.
        """
        joint, order = self.joint, self.joint.order
        jump = joint.jumps[number]
        weight, seen = self._observed(steps)
        rest = sla.block_diag(*(self.process.covariance(joint.scaled_intensity, step, number) for step in steps))
        known = np.eye(len(seen)) + weight @ rest @ weight.T
        lengths = np.diff(joint.nodes / joint.scale)
        found = np.empty((len(steps), PARTS))
        for row, step in enumerate(steps):
            columns = weight[:, row * order : (row + 1) * order]
            moments = jump_moments(jump.derivative, order, np.full(PARTS, lengths[step]), np.eye(PARTS))
            factor = np.linalg.cholesky(known + jump.variance * columns @ moments @ columns.T)
            left = np.linalg.solve(factor, np.broadcast_to(seen[:, None], (PARTS, len(seen), 1)))[..., 0]
            log_det = np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(axis=1)
            found[row] = -0.5 * (left**2).sum(axis=1) - log_det + np.log(lengths[step])
        return found

    def _observed(self, steps: range) -> tuple[Floats, Floats]:
        """Return what the samples say of the increments of some steps: observations of unit noise.

        The posterior of the increments ``e`` over their prior ``N(0, L L')`` is a likelihood. In the eigenvectors of
        the posterior covariance in units of the prior, whose eigenvalues are ``v``, it has the information
        ``1 / v - 1``.

        Returns
        -------
        weight : (r, n) array
            Observations are ``weight @ e`` and noise.
        seen : (r,) array
        """
        joint, order = self.joint, self.joint.order
        nodes = range(steps.start, steps.stop + 1)
        covariance = np.zeros((len(nodes), order, len(nodes), order))
        for row, first in enumerate(nodes):
            for column, second in enumerate(nodes[row:], start=row):
                block = self.blocks[second - first][first]
                covariance[row, :, column], covariance[column, :, row] = block, block.T
        change = np.zeros((len(steps) * order, len(nodes) * order))
        for row, step in enumerate(steps):
            place = slice(row * order, (row + 1) * order)
            change[place, place] = -self.process.transition[step]
            change[place, (row + 1) * order : (row + 2) * order] = np.eye(order)
        whiten = sla.block_diag(*(_whitener(self.process.covariance(joint.scaled_intensity, step)) for step in steps))
        change = whiten @ change
        values, vectors = np.linalg.eigh(change @ covariance.reshape(change.shape[1], -1) @ change.T)
        values = np.clip(values, np.finfo(float).tiny, 1.0)
        informed = 1.0 - values > UNSEEN
        values, vectors = values[informed], vectors[:, informed]
        weight = np.sqrt(1.0 / values - 1.0)[:, None] * (vectors.T @ whiten)
        mean = vectors.T @ (change @ joint.states[nodes.start : nodes.stop].ravel())
        return weight, mean / np.sqrt(values * (1.0 - values))


def _whitener(covariance: Floats) -> Floats:
    """Return the inverse of the Cholesky factor of a covariance whose entries differ by orders of magnitude."""
    deviation = np.sqrt(np.diag(covariance))
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance / np.outer(deviation, deviation))) / deviation)


def _root(covariance: Floats) -> Floats:
    """Return the Cholesky factor of a covariance whose entries differ by many orders of magnitude."""
    deviation = np.sqrt(np.diag(covariance))
    return np.asarray(deviation[:, None] * np.linalg.cholesky(covariance / np.outer(deviation, deviation)))
