"""Where within its steps a jump of the joints' motion lies.

A jump is found with a variance in each step in which it may lie, so that the states at the nodes between these are
free. The samples know better: the states before and after, and the positions between, leave one instant that explains
them. The likelihood of the increments of the steps follows from their posterior with the free jump, and each part of a
step is weighed by it as the place of the jump, of all joints that jump there together. Joints jump at one instant.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice, permutations

import numpy as np
import scipy.linalg as sla

from bayesid._math.arrays import Floats
from bayesid.recording.integrated_process import IntegratedProcess, Jump, covariances_by_distance, jump_moments
from bayesid.recording.smoothing import SmoothedJoint

__all__ = ["placed_jumps"]

PARTS = 10  # parts of a step, of which each may hold the jump
BESIDE = 1  # steps on either side of those found that may hold the jump, too
SWEEPS = 3  # times that every jump is placed beside the others
NARROW = 2  # most steps of a place that is widened where another jump shares a node with it
MOST_STEPS = 8  # steps above which a jump stays where it was found: the samples show too little of it to say more
UNLIKELY = 1e-4  # probability of a part relative to the likeliest below which the jump is not there
ROUNDING = 1e-14  # variance of an increment relative to its prior below which it is rounding
UNSEEN = 1e-9  # information on an increment relative to its prior below which it is none


def placed_jumps(joints: Sequence[SmoothedJoint]) -> list[SmoothedJoint]:
    """Return the joints smoothed anew with every jump in the parts of its steps that the samples allow.

    Jumps near each other are placed in turns, each beside what is known of the others by then.
    """
    joints = [_freed(joint) for joint in joints]
    together: dict[tuple[bytes, int, int, int], list[tuple[int, int]]] = {}
    for index, joint in enumerate(joints):
        for number, jump in enumerate(joint.jumps):
            key = (joint.nodes.tobytes(), jump.first, len(jump.variances), jump.derivative)
            together.setdefault(key, []).append((index, number))
    placed = [list(joint.jumps) for joint in joints]
    near = {index: _NearNodes(joint) for index, joint in enumerate(joints) if joint.jumps}
    for sweep in range(SWEEPS):
        for members in together.values():
            index, number = members[0]
            steps = _beside(joints[index], joints[index].jumps[number])
            alone = not any(_close(joints[index].jumps, number) for index, number in members)
            if len(steps) > MOST_STEPS or (sweep and alone):
                continue
            try:
                each = [near[index].log_evidence(number, steps, placed[index]) for index, number in members]
            except np.linalg.LinAlgError:  # rounding has spoilt a covariance: the jump stays where it was found
                continue
            log_p = np.sum(each, axis=0)
            probability = np.exp(log_p - log_p.max())
            probability[probability < UNLIKELY] = 0.0
            likely = np.flatnonzero(probability.sum(axis=1))
            kept = probability[likely[0] : likely[-1] + 1] / probability.sum()
            for index, number in members:
                jump = joints[index].jumps[number]
                variances = tuple(tuple(row) for row in (jump.variance * kept).tolist())
                placed[index][number] = Jump(steps[likely[0]], jump.derivative, variances)
    return [_smoothed(joint, _apart(joint, of_joint)) for joint, of_joint in zip(joints, placed, strict=True)]


def _smoothed(joint: SmoothedJoint, jumps: list[Jump]) -> SmoothedJoint:
    """Return the joint smoothed anew with other jumps, or as it was where rounding leaves that without a solution."""
    if jumps == list(joint.jumps):
        return joint
    changed = joint.with_jumps(jumps, (joint.order,))
    return changed if np.isfinite(changed.chi2) else joint


def _overlap(some: range, others: range) -> bool:
    return some.start < others.stop and others.start < some.stop


def _close(jumps: Sequence[Jump], number: int) -> bool:
    """Return whether another jump may lie in the steps in which one is sought."""
    steps = jumps[number].steps
    wider = range(steps.start - BESIDE, steps.stop + BESIDE)
    return any(_overlap(jump.steps, wider) for place, jump in enumerate(jumps) if place != number)


def _apart(joint: SmoothedJoint, placed: Sequence[Jump]) -> list[Jump]:
    """Return the jumps as placed, but free about both places where two share a node.

    The samples between cannot tell one from the other.
    """
    wider = [range(jump.steps.start, jump.steps.stop + 1) for jump in placed]
    shared = {i for i, j in permutations(range(len(placed)), 2) if _overlap(wider[i], wider[j])}
    return [
        _even(jump, joint.jumps[number].steps, _about(joint, jump)) if number in shared else jump
        for number, jump in enumerate(placed)
    ]


def _freed(joint: SmoothedJoint) -> SmoothedJoint:
    """Return the joint with jumps that were placed before free within their steps and those beside them."""
    return _smoothed(joint, [_free(joint, jump) for jump in joint.jumps])


def _free(joint: SmoothedJoint, jump: Jump) -> Jump:
    unplaced = all(len(parts) == 1 for parts in jump.variances)
    return jump if unplaced else _even(jump, _beside(joint, jump))


def _even(jump: Jump, *steps: range) -> Jump:
    """Return a jump as likely in every step of some ranges and between them."""
    first = min(span.start for span in steps)
    count = max(span.stop for span in steps) - first
    return Jump(first, jump.derivative, ((jump.variance / count,),) * count)


def _about(joint: SmoothedJoint, jump: Jump) -> range:
    return _beside(joint, jump) if len(jump.steps) <= NARROW else jump.steps


def _beside(joint: SmoothedJoint, jump: Jump) -> range:
    """Return the steps of a jump and those beside them."""
    return range(max(jump.steps.start - BESIDE, 0), min(jump.steps.stop + BESIDE, len(joint.nodes) - 1))


class _NearNodes:
    """Joint with the covariances of its states at nodes near each other."""

    def __init__(self, joint: SmoothedJoint) -> None:
        self.joint = joint
        self.blocks = list(islice(covariances_by_distance(joint.factor, joint.order), MOST_STEPS + 1))
        self.process = joint.process(joint.jumps)
        self._seen: dict[int, tuple[Floats, Floats]] = {}

    def log_evidence(self, number: int, steps: range, jumps: Sequence[Jump]) -> Floats:
        """Return the log evidence of the samples with one of the jumps in each part of each step, (steps, PARTS).

        It is relative to a constant, which does not depend on the place.

        Parameters
        ----------
        number : int
            Number of the jump.
        steps : range
            Steps in which it may be.
        jumps : sequence of Jump
            All jumps as far as they are placed.
        """
        joint, order = self.joint, self.joint.order
        jump = joint.jumps[number]
        if number not in self._seen:
            self._seen[number] = self._observed(steps)
        weight, seen = self._seen[number]
        lengths = np.diff(joint.nodes[steps.start : steps.stop + 1] / joint.scale)
        others = [
            other.within(steps) for place, other in enumerate(jumps) if place != number and _overlap(other.steps, steps)
        ]
        roughness = None if joint.roughness is None else joint.roughness[steps.start : steps.stop]
        process = IntegratedProcess(lengths, order, others, roughness)
        rest = sla.block_diag(*(process.covariance(joint.scaled_intensity, row) for row in range(len(steps))))
        known = np.eye(len(seen)) + weight @ rest @ weight.T
        evidence = np.empty((len(steps), PARTS))
        for row, length in enumerate(lengths):
            columns = weight[:, row * order : (row + 1) * order]
            moments = jump_moments(jump.derivative, order, np.full(PARTS, length), np.eye(PARTS))
            factor = np.linalg.cholesky(known + jump.variance * columns @ moments @ columns.T)
            left = np.linalg.solve(factor, np.broadcast_to(seen[:, None], (PARTS, len(seen), 1)))[..., 0]
            log_det = np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(axis=1)
            evidence[row] = -0.5 * (left**2).sum(axis=1) - log_det + np.log(length)
        return evidence

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
        values = np.clip(values, ROUNDING, 1.0)
        informed = 1.0 - values > UNSEEN
        values, vectors = values[informed], vectors[:, informed]
        weight = np.sqrt(1.0 / values - 1.0)[:, None] * (vectors.T @ whiten)
        mean = vectors.T @ (change @ joint.states[nodes.start : nodes.stop].ravel())
        return weight, mean / np.sqrt(values * (1.0 - values))


def _whitener(covariance: Floats) -> Floats:
    """Return the inverse of the Cholesky factor of a covariance whose entries differ by orders of magnitude."""
    deviation = np.sqrt(np.diag(covariance))
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance / np.outer(deviation, deviation))) / deviation)
