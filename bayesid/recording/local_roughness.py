"""Roughness of a joint's motion that changes along the recording.

A robot moves from point to point and rests between. A process of one intensity is then too rough for the rests and too
smooth for the instants where a move begins, and where the samples show too little of such an instant for a jump of its
own (`bayesid.recording.jumps`), the errors there are many times what is stated. Here every step has a factor on the
variance of its increments. The factor maximises the evidence of the samples together with a prior of one degree of
freedom, so that where the samples say little it stays near one (MacKay 1992, `Bayesian interpolation`, equation 4.15,
for each step by itself); increments whose factors have such a prior are those of a Student-t process. A step is judged
with its neighbours, over as many of them as have one degree of freedom in the samples together.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from bayesid._math.arrays import Floats
from bayesid.recording.smoothing import SmoothedJoint

__all__ = ["roughened"]

# Degrees of freedom of the prior of each factor. With four, errors where a move begins reach six stated deviations;
# with one, four to five, which is what the largest of some thousand samples is.
PRIOR = 1.0
# most updates of the factors; each is half a step in their logarithms at first, so that they do not overshoot
ROUNDS = 8
SETTLED = 0.3  # change of the logarithm of a factor below which it counts as settled: its uncertainty is some two
FEWEST = 1.0  # degrees of freedom of all steps below which the samples say nothing of the roughness


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
        wanted = (PRIOR + _about(energy * factors, width)) / (PRIOR + _about(freedom, width))
        moved = wanted if number % 2 else np.sqrt(factors * wanted)
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
