"""Instants at which the acceleration or the jerk of the joints jumps, and the roughness of their motion, from samples.

Profiles of speed are smooth but for the instants where they begin and end. A process of one intensity would be far too
sure of itself there. The smoothed increments of the process show such instants (the auxiliary residuals of Harvey and
Koopman 1992 and of de Jong and Penzer 1998), and the joints of a robot often begin and end together, so that a jump is
sought in each joint and in all of them. What is found is an unknown of the process. The plain jumps come first; then
the roughness is found that changes along the motion, and with it the other jumps. Smooth moves with rests between are
uneven without a jump, and would else be taken for dozens of them.

A robot moves from point to point and rests between. A process of one intensity is then too rough for the rests and too
smooth for the instants where a move begins, and where the samples show too little of such an instant for a jump of its
own, the errors there are many times what is stated. Every step therefore has a factor on the variance of its
increments. The factor maximises the evidence of the samples together with a prior of one degree of freedom, so that
where the samples say little it stays near one (MacKay 1992, `Bayesian interpolation`, equation 4.15, for each step by
itself); increments whose factors have such a prior are those of a Student-t process. A step is judged with its
neighbours, over as many of them as have one degree of freedom in the samples together.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from bayesid._math.arrays import Floats
from bayesid._math.chi_square import log_tail
from bayesid.recording.integrated_process import Jump
from bayesid.recording.jump_placing import placed_jumps
from bayesid.recording.smoothing import ORDERS, JointSamples, SmoothedJoint, smooth

__all__ = ["roughened", "smooth_joints"]

DERIVATIVES = (2, 3)  # derivatives of the position that may jump: acceleration and jerk
# p-value below which a jump is an unknown. Each step is tested, so that a rough joint without a jump gets one or two: a
# jump too many widens the errors near one instant, a jump missed makes errors of ten times what is stated.
LEVEL = 1e-3
# p-value below which a jump counts while the roughness is even. With 1e-3, smooth moves with rests between hold 20 to
# 30 jumps where there is none, and errors reach 12 stated deviations; with 1e-8, single jumps are taken for roughness.
STRONG = 1e-5
# most rounds of the search: what has jumped less is seen once the larger jumps no longer count as roughness
MOST_ROUNDS = 20
# most times that jumps are sought and placed: a small one next to a large one is seen once that has its place
CYCLES = 4
ROUNDS_OF_ORDERS = 2  # rounds in which the order of the process is chosen anew: the largest jumps decide on it
# Steps between two jumps that are found in one round, as the smaller one may be the shadow of the larger. With 10, the
# begin of a move just after the end of another is missed more often, and errors there reach 14 stated deviations.
APART = 5
UNLIKELY = 0.05  # probability of a step relative to the likeliest below which the jump is not placed there
# Prior standard deviation of a jump over its estimate, with which the data decide on its size. With 10, errors where
# the samples do not show the instant are a fifth smaller than is stated; with 2, some are many times larger.
FREE = 5.0
# log likelihood that a jump may cost a joint: twice that of a jump of two derivatives of which it shows nothing, ``2
# log(FREE)``
MOST_LOST = 10.0
# Degrees of freedom of the prior of each factor. With four, errors where a move begins reach six stated deviations;
# with one, four to five, which is what the largest of some thousand samples is.
PRIOR = 1.0
# most updates of the factors; each is half a step in their logarithms at first, so that they do not overshoot
ROUNDS = 8
SETTLED = 0.3  # change of the logarithm of a factor below which it counts as settled: its uncertainty is some two
FEWEST = 1.0  # degrees of freedom of all steps below which the samples say nothing of the roughness


class _Scores(NamedTuple):
    """Scores and information of the jumps of one joint, (n - 1, 2) each; both are zero where there is none."""

    score: Floats
    information: Floats

    @property
    def statistic(self) -> Floats:
        """Square of a jump over its variance."""
        known = self.information > 0.0
        return np.divide(self.score**2, self.information, out=np.zeros_like(self.score), where=known)


class _Group(NamedTuple):
    """Joints sampled at the same times, with the statistic of a jump of all of them and its p-value, (n - 1, 2)."""

    members: list[int]
    nodes: Floats
    statistic: Floats
    log_p: Floats

    @classmethod
    def of(cls, members: list[int], joints: Sequence[SmoothedJoint], scores: Sequence[_Scores]) -> _Group:
        """Sum the statistics of some joints."""
        statistic = np.sum([scores[index].statistic for index in members], axis=0)
        degrees = np.sum([scores[index].information > 0.0 for index in members], axis=0)
        return cls(members, joints[members[0]].nodes, statistic, log_tail(statistic, np.maximum(degrees, 1)))

    def leave_out(self, begin: float, end: float) -> None:
        """Look for no jump between two times."""
        self.log_p[np.searchsorted(self.nodes, begin, side="right") - 1 : np.searchsorted(self.nodes, end)] = 0.0


def smooth_joints(
    samples: Sequence[list[JointSamples]], starts: Sequence[float | None] | None = None
) -> tuple[SmoothedJoint, ...]:
    """Smooth the joints of one recording, with the jumps of acceleration and jerk that their samples show.

    Parameters
    ----------
    samples : sequence of list of JointSamples
        Series of samples of each joint.
    starts : sequence, optional
        Exact position at time 0 of each joint that is recorded by its speed only, else None.
    """
    starts = [None] * len(samples) if starts is None else starts
    joints = [smooth(series, start) for series, start in zip(samples, starts, strict=True)]
    moving = _with_all_jumps([joint for joint in joints if not joint.is_constant], STRONG)
    moved = iter(_with_all_jumps([roughened(joint) for joint in moving], LEVEL))
    return tuple(joint if joint.is_constant else next(moved) for joint in joints)


def _with_all_jumps(joints: list[SmoothedJoint], level: float) -> list[SmoothedJoint]:
    """Return the joints with all jumps that their samples show at a level, each in its place."""
    for _ in range(CYCLES):
        searched = _searched(joints, level)
        if _same(searched, joints):
            break
        placed = placed_jumps(searched)
        joints = [joint if joint.roughness is None else roughened(joint) for joint in placed]
    return joints


def _searched(joints: list[SmoothedJoint], level: float) -> list[SmoothedJoint]:
    """Return the joints with all jumps that their samples show at a level, wherever they are."""
    for number in range(MOST_ROUNDS):
        new_jumps = _new_jumps(joints, level) if joints else []
        if not any(new_jumps):
            break
        any_order = number < ROUNDS_OF_ORDERS
        before, joints = (
            joints,
            [_extended(joint, added, any_order) for joint, added in zip(joints, new_jumps, strict=True)],
        )
        if _same(joints, before):
            break
    return joints


def _same(joints: Sequence[SmoothedJoint], others: Sequence[SmoothedJoint]) -> bool:
    return all(one.jumps == other.jumps for one, other in zip(joints, others, strict=True))


def _extended(joint: SmoothedJoint, jumps: list[Jump], any_order: bool) -> SmoothedJoint:
    """Return the joint with further jumps, or as it was where rounding spoils its likelihood with them.

    A jump that wins other joints may cost this one something, but once only: where it is known already, a wider one has
    to gain.
    """
    if not jumps:
        return joint
    extended = joint.with_jumps((*joint.jumps, *jumps), ORDERS if any_order else (joint.order,))
    known = {(other.derivative, step) for other in joint.jumps for step in other.steps}
    most_lost = MOST_LOST * sum((jump.derivative, jump.first) not in known for jump in jumps)
    return extended if extended.log_likelihood > joint.log_likelihood - most_lost else joint


def _new_jumps(joints: Sequence[SmoothedJoint], level: float) -> list[list[Jump]]:
    """Return the significant jumps that each joint's process does not have yet."""
    scores = [_scores(joint) for joint in joints]
    alone = [[index] for index in range(len(joints))]
    groups = [_Group.of(members, joints, scores) for members in alone + _together(joints)]
    new_jumps: list[list[Jump]] = [[] for _ in joints]
    while True:
        best = min(groups, key=lambda group: float(group.log_p.min()))
        step, column = np.unravel_index(np.argmin(best.log_p), best.log_p.shape)
        if best.log_p[step, column] > np.log(level):
            return new_jumps
        first, probability = _place(best.statistic[:, column], int(step))
        for index in best.members:
            score, information = scores[index].score[step, column], scores[index].information[step, column]
            if information > 0.0:
                variance = FREE**2 * ((score / information) ** 2 + 1.0 / information)
                new_jumps[index].append(
                    Jump(first, DERIVATIVES[column], tuple((part,) for part in variance * probability))
                )
        last = first + len(probability)
        for group in groups:
            group.leave_out(best.nodes[max(0, first - APART)], best.nodes[min(last + APART, len(best.nodes) - 1)])


def _scores(joint: SmoothedJoint) -> _Scores:
    score, information = joint.jump_scores()
    which = [derivative for derivative in DERIVATIVES if derivative < joint.order]
    whole = np.zeros((2, len(score), len(DERIVATIVES)))
    whole[0, :, : len(which)], whole[1, :, : len(which)] = score[:, which], information[:, which]
    return _Scores(whole[0], whole[1])


def _together(joints: Sequence[SmoothedJoint]) -> list[list[int]]:
    """Return the groups of two and more joints that are sampled at the same times."""
    groups: dict[bytes, list[int]] = {}
    for index, joint in enumerate(joints):
        groups.setdefault(joint.nodes.tobytes(), []).append(index)
    return [group for group in groups.values() if len(group) > 1]


def _place(statistic: Floats, peak: int) -> tuple[int, Floats]:
    """Return the first of the steps around a peak in which the jump may lie, and their probabilities.

    A jump just beside a node fits the samples in either of the steps next to it, but not the state at that node.
    """
    relative = np.exp(np.minimum(0.5 * (statistic - statistic[peak]), 0.0))
    unlikely = np.flatnonzero(relative < UNLIKELY)
    first = max(int(unlikely[unlikely < peak].max(initial=-1)), 0)
    last = min(int(unlikely[unlikely > peak].min(initial=len(statistic))), len(statistic) - 1)
    likely = np.maximum(relative[first : last + 1], UNLIKELY)
    return first, likely / likely.sum()


def roughened(joint: SmoothedJoint) -> SmoothedJoint:
    """Return the joint smoothed with a roughness of each step that its samples show; steps with a jump keep theirs."""
    factors = np.ones(len(joint.nodes) - 1) if joint.roughness is None else joint.roughness
    free = np.ones(len(factors), dtype=bool)
    for jump in joint.jumps:
        free[jump.steps.start : jump.steps.stop] = False
    width = 0.0
    for number in range(ROUNDS):
        energy, freedom = (np.where(free, part, 0.0) for part in joint.increment_energies())
        if not width:
            if freedom.sum() < FEWEST:
                return joint
            width = max(free.sum() / freedom.sum(), 1.0)
        estimate = (PRIOR + _about(energy * factors, width)) / (PRIOR + _about(freedom, width))
        moved = estimate if number % 2 else np.sqrt(factors * estimate)
        changed = joint.with_roughness(moved)
        if not np.isfinite(changed.chi2):  # rounding leaves no solution
            return joint
        largest = np.abs(np.log(moved / factors)).max()
        joint, factors = changed, moved
        if largest < SETTLED:
            break
    return joint


def _about(values: Floats, width: float) -> Floats:
    """Return sums over the neighbourhood of each step, weighted by a normal curve of a height of one."""
    return np.asarray(width * np.sqrt(2.0 * np.pi) * gaussian_filter1d(values, width, mode="nearest"))
