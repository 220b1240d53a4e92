"""Starts of a search: random motions within the limits, exchanges between motions, repairs of those outside."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import jax
import numpy as np
from scipy.linalg import eigh
from scipy.optimize import minimize

from bayesid._math.arrays import Floats, Integers
from bayesid.design.design_problem import Problem
from bayesid.design.trajectories import PaperExcitation, TrajectoryFamily
from bayesid.robot.composite_tables import ENTRIES, composite_rows
from bayesid.robot.joint_state import JointState
from bayesid.robot.kinematics import kinematics
from bayesid.robot.robot import Robot

__all__ = [
    "SLACK",
    "adapted_to_family",
    "base_rates",
    "exchanged",
    "random_start",
    "reacting_swing",
    "repaired",
    "within_limits",
]

# fractions of the tightest limit, or of the largest swing, between which a start lies, so that it begins inside them
FILLED = (0.3, 0.95)
SHRUNK = 12  # largest number of times that a random start is shrunk
LIKE_THE_PAPER = 0.25  # fraction of the random starts that swing three joints as the paper's (27) does
FROM_ANOTHER = 0.5  # probability that an exchange takes courses from another of the motions, else from a random start
EXCHANGED = 3  # of so many groups of parameters, such as joints, one is exchanged at most
MANOEUVRES = 16  # number of random manoeuvres that are taken for a family

SLACK = 1e-6
"""Fraction of a limit by which the optimiser may exceed it, since the smooth maximum lies above the true one."""

POSTURES, BEST = 400, 5  # number of postures that are drawn, and of the best of them from which one is taken
SPREAD = 0.4  # standard deviation of the postures about that at the start, as a fraction of half of each joint's range
SLOWEST = 1e-6  # largest speed that counts for a joint whose URDF allows none [rad/s or m/s]
# swing that remains where a posture leaves less room [rad or m]; what breaks a limit is repaired by the descent
LEAST = 0.3
PERIODS = 3  # largest number of periods


def random_start(problem: Problem, rng: np.random.Generator) -> Floats:
    """Draw parameters and shrink them towards the centre until they fill a random fraction of the tightest limit.

    Only limits that a smaller motion helps to keep are considered.

    Parameters
    ----------
    problem : Problem
    rng : numpy.random.Generator
        Source of direction and size.
    """
    family = problem.plan.family
    direction = family.scale * rng.normal(size=family.size)
    if family.imitates and rng.random() < LIKE_THE_PAPER:
        direction = _like_the_paper(family, rng) - family.centre
    filled, size = rng.uniform(*FILLED), 1.0
    helped = problem.shrinkable
    for _ in range(SHRUNK):
        largest = problem.fractions(family.centre + size * direction)[0][helped].max()
        if largest <= filled:
            break
        size *= np.clip(0.97 * filled / largest, 0.1, 0.9)
    return family.centre + size * direction


def exchanged(problem: Problem, motions: Sequence[Floats], rng: np.random.Generator) -> Floats:
    """Return one of the motions with the courses of one or few joints taken from another one or from a random start.

    Parameters
    ----------
    problem : Problem
    motions : sequence of (n,) arrays
        Parameters of the motions.
    rng : numpy.random.Generator
    """
    chosen = motions[int(rng.integers(len(motions)))]
    other = motions[int(rng.integers(len(motions)))] if rng.random() < FROM_ANOTHER else random_start(problem, rng)
    groups = problem.plan.family.groups
    count = int(groups.max()) + 1
    taken = rng.choice(count, rng.integers(1, max(count // EXCHANGED, 1) + 1), replace=False)
    return np.where(np.isin(groups, taken), other, chosen)


def _like_the_paper(family: TrajectoryFamily, rng: np.random.Generator) -> Floats:
    """Return the parameters closest to an oscillation (27) of three random joints about the start."""
    moving = family.moving_joints
    joints = rng.choice(moving, min(3, len(moving)), replace=False).tolist()
    paper = PaperExcitation(family.posture_at_rest, family.duration, joints, int(rng.integers(1, 4)))
    return family.nearest(paper.motion(paper.centre + paper.scale * rng.normal(size=paper.size)))


def within_limits(problem: Problem, parameters: Floats, bound: float = 1.0) -> bool:
    """Return whether parameters keep all limits times a factor, on the grid of the search.

    Parameters
    ----------
    problem : Problem
    parameters : (n,) array
        Motion in its family.
    bound : float
        Factor on the limits.
    """
    return bool(problem.fractions(parameters)[0].max() <= bound + SLACK)


def repaired(problem: Problem, parameters: Floats, bound: float = 1.0 - 1e-3) -> Floats:
    """Return parameters that keep the limits, by descent from given ones; the same parameters where none is broken.

    Parameters
    ----------
    problem : Problem
    parameters : (n,) array
        Motion in its family.
    bound : float
        Fraction of the limits to keep.
    """
    family = problem.plan.family

    def excess(x: Floats) -> tuple[float, Floats]:
        value, slope = problem.fractions(family.centre + family.scale * x)
        over = np.maximum(value - bound, 0.0)
        return float(0.5 * over @ over), (over @ slope) * family.scale

    x = (parameters - family.centre) / family.scale
    if excess(x)[0] == 0.0:
        return parameters
    # a slightly lower bound, so that the result lies inside the limits
    bound -= 2e-3
    options: Any = {"ftol": 1e-12, "gtol": 1e-7, "maxiter": 60}
    kept = family.centre + family.scale * minimize(excess, x, jac=True, method="L-BFGS-B", options=options).x
    for _ in range(SHRUNK):
        largest = problem.fractions(kept)[0][problem.shrinkable].max()
        if largest <= bound + 2e-3:
            break
        kept = family.centre + np.clip(0.97 * bound / largest, 0.1, 0.9) * (kept - family.centre)
    return kept


def adapted_to_family(problem: Problem, rng: np.random.Generator) -> Problem:
    """Return the problem whose criteria are adapted to what manoeuvres of its family can show.

    Parameters
    ----------
    problem : Problem
        The same problem is returned where no criterion is still to be adapted.
    rng : numpy.random.Generator
        Source of the random manoeuvres that are taken for the family.
    """
    if not any(criterion.adaptable for criterion in problem.criteria):
        return problem
    starts = [random_start(problem, rng) for _ in range(MANOEUVRES)]
    sums = jax.tree.map(lambda *parts: np.sum(parts, axis=0), *map(problem.shown, starts))
    criteria = [one.adapted(problem.plan, sums[one.name], rng) if one.adaptable else one for one in problem.criteria]
    return problem.judged_by(criteria)


UNLIMITED = np.pi  # half of the range of a joint that has no limits [rad or m], and its largest speed [rad/s or m/s]


def reacting_swing(problem: Problem, rng: np.random.Generator) -> Floats:
    """Return parameters of a swing as the paper's (27), of all joints that move, about a posture drawn at random.

    A joint that turns against another one of parallel axis, with the tip on the axis of the first, moves the tip little
    and the base much. On ETS-VII the best manoeuvres known do that, and descents from random motions hardly ever find
    it.

    Of many postures those few are kept where the largest rate of the base is greatest: that over all joint speeds v
    with ``v' (J' J + D) v = 1``, where J is the Jacobian of the tip over its limits and D the inverse squares of the
    joints' largest speeds. The joints swing along that v.

    Parameters
    ----------
    problem : Problem
        Problem whose family imitates other motions.
    rng : numpy.random.Generator
        Source of posture, number of periods and size.
    """
    family, robot = problem.plan.family, problem.plan.model.robot
    start, moving = family.posture_at_rest, family.moving_joints
    posture, speed = _chosen(problem, start, moving, rng)
    paper = PaperExcitation(start, family.duration, moving.tolist(), int(rng.integers(1, PERIODS + 1)))
    swing = rng.uniform(*FILLED) * speed / paper.frequency
    size = np.linalg.norm(swing)
    lower, upper = _ranges(robot)
    clearance = np.min(np.minimum(upper - posture, posture - lower)[moving] / np.maximum(np.abs(swing) / size, 1e-3))
    swing *= min(1.0, max(clearance, LEAST) / size)
    return family.nearest(paper.motion(np.stack([posture[moving], swing], axis=1).ravel()))


def _ranges(robot: Robot) -> tuple[Floats, Floats]:
    """Return the lower and upper limits of all joints, (joints,) each [rad or m]."""
    lower, upper = (np.array([getattr(joint, end) for joint in robot.joints]) for end in ("lower", "upper"))
    return lower, upper


def _chosen(problem: Problem, start: Floats, moving: Integers, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Draw one of the best postures, (joints,), with the speeds of the moving joints that turn the base most there."""
    lower, upper = _ranges(problem.plan.model.robot)
    half = 0.5 * (upper - lower)
    drawn = start + SPREAD * np.where(np.isfinite(half), half, UNLIMITED) * rng.normal(size=(POSTURES, len(start)))
    postures = np.tile(start, (POSTURES, 1))
    postures[:, moving] = np.clip(drawn, lower, upper)[:, moving]
    rates, speeds = _largest(problem, postures, moving)
    taken = rng.choice(np.argsort(-rates)[:BEST])
    return postures[taken], speeds[taken]


def base_rates(robot: Robot, postures: Floats) -> Floats:
    """Return the angular rate of a base that floats at rest for a unit speed of each joint, base axes.

    With both momenta zero the composite body turns against the arm's angular momentum about the centre of mass
    (Umetani and Yoshida, IEEE Transactions on Robotics and Automation 5, 1989).

    Parameters
    ----------
    robot : Robot
    postures : (P, joints) array
        Positions of the joints [rad or m].

    Returns
    -------
    (P, 3, joints) array
        [rad/s per rad/s or m/s]
    """
    count = len(robot.joints)
    rows = composite_rows(robot, kinematics(robot, _unit_speeds(postures)))
    part = {name: rows[:, columns] for name, columns in ENTRIES.items()}
    mass, first, flow = part["mass"], part["first"], part["first_rate"]
    xx, yy, zz, xy, xz, yz = part["second"].T
    second = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], axis=1).reshape(-1, 3, 3)
    second = second - first[:, :, None] * first[:, None, :] / mass[:, :, None]  # about the centre of mass
    inertia = np.trace(second, axis1=1, axis2=2)[:, None, None] * np.eye(3) - second
    spin = part["spin"] - np.cross(first, flow) / mass
    rates = -np.linalg.solve(inertia, spin[:, :, None])[:, :, 0]
    return rates.reshape(len(postures), count, 3).swapaxes(1, 2)


def _largest(problem: Problem, postures: Floats, moving: Integers) -> tuple[Floats, Floats]:
    """Return the largest rate of the base at each posture, (P,) [rad/s], and the joint speeds there, (P, moving)."""
    robot, limits = problem.plan.model.robot, problem.limits
    pose, flow = problem.plan.tip.motion(robot, _unit_speeds(postures))
    turning = flow[:, :3, :3] @ pose[:, :3, :3].swapaxes(1, 2)
    rate = np.stack([turning[:, 2, 1], turning[:, 0, 2], turning[:, 1, 0]], axis=1)
    speeds = np.array([joint.velocity for joint in robot.joints])
    speeds = np.minimum(np.where(np.isfinite(speeds), speeds, UNLIMITED), limits.joint_speed or np.inf)
    cost = np.tile(np.diag(np.maximum(speeds, SLOWEST) ** -2.0), (len(postures), 1, 1))
    for bound, change in ((limits.tip_speed, flow[:, :3, 3]), (limits.tip_rate, rate)):
        if bound is not None:
            jacobian = change.reshape(len(postures), len(speeds), 3) / bound
            cost += jacobian @ jacobian.swapaxes(1, 2)
    turned = base_rates(robot, postures)
    gain = turned.swapaxes(1, 2) @ turned
    inner = np.ix_(moving, moving)
    pairs = [eigh(g[inner], c[inner]) for g, c in zip(gain, cost, strict=True)]
    squares = np.array([values[-1] for values, _ in pairs])
    return np.sqrt(np.maximum(squares, 0.0)), np.array([vectors[:, -1] for _, vectors in pairs])


def _unit_speeds(postures: Floats) -> JointState:
    """Return every posture with a unit speed of each joint in turn, (P joints, joints)."""
    count = postures.shape[1]
    position = np.repeat(postures, count, axis=0)
    return JointState(position, np.tile(np.eye(count), (len(postures), 1)), np.zeros_like(position))
