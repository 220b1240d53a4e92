"""What the planner knows, plans and flies, over true ships drawn from what it holds possible."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root
from scipy.spatial.transform import Rotation

from bayesid import Manoeuvre, Model, Recording, Robot
from bayesid._math.arrays import Floats
from bayesid.design.base_prediction import BasePredictor
from bayesid.design.pose_trajectory import Pose
from bayesid.inference.posterior import Posterior
from bayesid.report.verdict_record import Share
from bayesid.robot.body_prior import coordinates_of, draw_inertial
from bayesid.robot.joint_state import JointState
from studies.common import mission
from studies.common.ets7 import BASE, TIP
from studies.common.flight import Flown, flown_along, prescribed, true_robot
from studies.common.monte_carlo import Workers, run_trials
from studies.common.quantities import squared_distances
from studies.common.repeated_fits import Reference
from studies.truth.numerics import quintic_step

# position (3,) [m] and quaternion x, y, z, w to orbit axes, counted in orbit axes from where the base started
FlownPose = tuple[Floats, Floats]

# excursion of the joints in the first plan [rad], whose end is the target if the ship is as it was published
EXCURSION = np.array([1.3, -1.5, 0.6, 0.5, -0.7, 0.6])

SPREAD = 0.15  # relative width of the planner's prior of the base: its mass is then known to 30 %


@dataclass(frozen=True)
class Swing:
    """A path in joint space on which each joint goes from rest to rest on a quintic."""

    # (6,): joint positions before and after [rad]
    start: Floats
    goal: Floats
    duration: float = mission.DURATION  # duration of the path [s]

    def evaluate(self, time: Floats) -> JointState:
        """Return the joint state at the times, shape (T,)."""
        steps = [quintic_step(instant / self.duration) for instant in np.asarray(time, dtype=float)]
        value, slope, bend = np.array(steps).T[:, :, None] * (self.goal - self.start)
        return JointState(self.start + value, slope / self.duration, bend / self.duration**2)


def planners_model(arm_spread: float) -> Model:
    """Return what the planner holds possible: the ship as published, its base to `SPREAD`, the arm to a width."""
    return mission.base_unknown(arm_spread, base_spread=SPREAD)


def true_ship(rng: np.random.Generator, arm_spread: float) -> Robot:
    """Draw the true ship from what the planner holds possible."""
    robot = mission.true_arm(mission.published_robot(), rng, arm_spread)
    return robot.with_inertial(BASE, draw_inertial(robot.link(BASE).inertial, SPREAD, rng))


def fly(robot: Robot, swing: Swing) -> dict[str, FlownPose]:
    """Fly a path from rest and return the final poses of ``base`` and ``tip``."""
    model, end = true_robot(robot), [swing.duration]
    truth = model.run(prescribed(swing, end, mission.TRUTH_STEP), end, step=mission.TRUTH_STEP)
    body = model.data.body(TIP)
    tip = Rotation.from_matrix(np.array(body.xmat).reshape(3, 3)).as_quat()
    return {"base": (np.array(model.data.qpos[:3]), truth.attitude[-1]), "tip": (np.array(body.xpos), tip)}


ARM = 2.0  # length that makes a rotation error comparable with a position error [m/rad]


@dataclass(frozen=True)
class Planner:
    """Planner with a model of the ship; what it knows is points of the bodies' coordinates in that model."""

    model: Model  # model whose priors are what the planner knows at first

    @cached_property
    def first(self) -> Swing:
        """The path that ends at the target if the ship is as it was published."""
        return Swing(mission.start(), mission.start() + EXCURSION)

    @cached_property
    def target(self) -> FlownPose:
        """Pose of the end-effector that is wanted."""
        pose = self.poses(self.first, np.zeros((1, self._count)))["tip"]
        return pose.position[0], pose.attitude[0]

    def poses(self, swing: Swing, bodies: Floats) -> dict[str, Pose]:
        """Return the final poses of ``base`` and ``tip`` on a path, for points (n, b) of the bodies' coordinates."""
        predictor = self._predictor(swing, self._resting)
        z = np.tile(predictor.centre, (len(bodies), 1))
        z[:, : self._count] = bodies
        base, tip = predictor.courses(z)
        return {"base": base.pose(), "tip": tip.pose()}

    def prior(self, draws: int, rng: np.random.Generator) -> Floats:
        """Draw points of the bodies' coordinates from the prior, shape (draws, b)."""
        return rng.normal(size=(draws, self._count))

    def plan(self, bodies: Floats) -> Swing:
        """Return the path that ends at the target if the bodies' coordinates (b,) are right.

        Raises
        ------
        RuntimeError
            If none is found.
        """
        position, attitude = self.target

        def miss(goal: Floats) -> Floats:
            pose = self.poses(Swing(self.first.start, goal), bodies[None])["tip"]
            turn = Rotation.from_quat(pose.attitude[0]) * Rotation.from_quat(attitude).inv()
            return np.concatenate([pose.position[0] - position, ARM * turn.as_rotvec()])

        solution = root(miss, self.first.goal, tol=1e-9)
        if not solution.success:
            raise RuntimeError(f"the search for a path to the target failed: {solution.message}")
        return Swing(self.first.start, solution.x)

    @property
    def _count(self) -> int:
        return 10 * len(self.model.priors)

    @cached_property
    def _resting(self) -> BasePredictor:
        """Predictor whose compiled simulation serves all paths."""
        return self._predictor(Swing(self.first.start, self.first.start), None)

    def _predictor(self, swing: Swing, compiled: BasePredictor | None) -> BasePredictor:
        path = Manoeuvre(Recording("path", None, np.linspace(0.0, swing.duration, 9), {}), swing)
        return BasePredictor(self.model, path, TIP, *([] if compiled is None else [compiled]))


def miss_of(flown: FlownPose, target: FlownPose) -> tuple[float, float]:
    """Return distance [mm] and angle [degrees] of a pose from its target."""
    turn = Rotation.from_quat(flown[1]) * Rotation.from_quat(target[1]).inv()
    return float(1e3 * np.linalg.norm(flown[0] - target[0])), float(np.degrees(turn.magnitude()))


# what the planner takes the spacecraft for, before and after identification
STAGES = ("published spacecraft", "identified spacecraft")

# what is predicted: poses of base and end-effector, each with a region of position and one of rotation
BODIES, KINDS = ("base", "tip"), ("position", "rotation")

DRAWS = 400  # number of draws of each prediction

# largest number of Gauss-Newton steps, and change of every coordinate below which they end [prior deviations]
STEPS, SMALL = 20, 1e-4


@dataclass(frozen=True)
class _Task:
    parameters: tuple[float, ...]
    arm_spread: float


@dataclass(frozen=True)
class Trip:
    """A planned path: predicted final poses and flown ones, ``base`` and ``tip``, and the miss."""

    predicted: Mapping[str, Pose]
    flown: Mapping[str, FlownPose]
    miss: tuple[float, float]  # distance [mm] and angle [degrees] of the end-effector from its target

    def to_dict(self) -> dict[str, Any]:
        """Return what the store keeps: the miss, and by body whether the regions hold and how large they are."""
        return {
            "miss": self.miss,
            "held": [self.predicted[body].holds(*self.flown[body]) for body in BODIES],
            "size": [
                [float(region.semi_axes[0]) for region in (pose.millimetres, pose.degrees)]
                for pose in (self.predicted[body] for body in BODIES)
            ],
        }


@dataclass(frozen=True)
class Row:
    """Outcome over N drawn ships with one knowledge of the arm; stages are those of `STAGES`."""

    miss: Floats  # (N, 2 stages, 2): distance [mm] and angle [degrees] of the end-effector from its target
    inside: NDArray[np.bool_]  # (N, 2 stages, 2 bodies, 2 kinds): whether the 95 % regions held the flown poses
    size: Floats  # (N, 2 stages, 2 bodies, 2 kinds): longest semi-axes of these regions [mm, degrees]
    # (N,): squared distances of the true base from the identified one; chi-square with ten degrees of freedom if the
    # posterior is right
    distance: Floats

    def share(self, stage: int, body: int, kind: int) -> Share:
        """Return how many regions held."""
        return Share(int(self.inside[:, stage, body, kind].sum()), len(self.inside))


def row_of(
    parameters: Floats,
    arm_spread: float,
    count: int,
    *,
    seed: int,
    store: Path | None = None,
    workers: Workers = 1,
    progress: Callable[[str], None] = lambda text: None,
) -> Row:
    """Draw ships and plan, predict, fly and identify with each.

    Parameters
    ----------
    parameters : (n,) array; parameters of the identifying manoeuvre, `studies.common.mission.splines`
    arm_spread : float; relative width of the links' priors
    count : int; number of ships
    seed, store, workers, progress
        See `studies.common.monte_carlo.run_trials`.
    """
    task = _Task(tuple(map(float, parameters)), arm_spread)
    outcomes = run_trials(outcome, [task] * count, store, seed=seed, workers=workers, progress=progress).complete()
    miss, inside, size = (
        np.array([[trip[key] for trip in trial["trips"]] for trial in outcomes]) for key in ("miss", "held", "size")
    )
    return Row(miss, inside, size, np.array([trial["distance"] for trial in outcomes]))


def outcome(task: _Task, rng: np.random.Generator) -> dict[str, Any]:
    """Return what the store keeps of one ship."""
    trips, distance = trip_of(task.parameters, task.arm_spread, rng)
    return {"trips": [trip.to_dict() for trip in trips], "distance": distance}


def trip_of(
    parameters: tuple[float, ...], arm_spread: float, rng: np.random.Generator
) -> tuple[tuple[Trip, ...], float]:
    """Return the paths of one drawn ship by stage, and the squared distance of its base from the identified one."""
    planner, reference = _planner(arm_spread), _reference(parameters, arm_spread)
    robot = true_ship(rng, arm_spread)

    def trip(bodies: Floats, draws: Floats) -> Trip:
        swing = planner.plan(bodies) if bodies.any() else planner.first
        flown = fly(robot, swing)
        return Trip(planner.poses(swing, draws), flown, miss_of(flown["tip"], planner.target))

    before = planner.prior(DRAWS, rng)
    first = trip(np.zeros(before.shape[1]), before)
    motion = mission.splines(len(parameters) // 6).motion(np.array(parameters))
    z, covariance = fitted(reference.given(mission.recorded(mission.fly(motion, robot), rng)))
    count = before.shape[1]
    of_bodies = covariance[:count, :count]
    draws = z[:count] + rng.normal(size=(DRAWS, count)) @ np.linalg.cholesky(of_bodies).T
    again = trip(z[:count], draws)
    prior = planner.model.priors[0]
    error = z[:10] - coordinates_of(prior, robot.link(prior.name).inertial)
    return (first, again), float(squared_distances(error, of_bodies[:10, :10]))


def fitted(posterior: Posterior) -> tuple[Floats, Floats]:
    """Return the mode of a posterior and the covariance of the normal distribution about it, by Gauss-Newton steps.

    Raises
    ------
    RuntimeError
        If they do not end.
    """
    z: Floats = np.zeros(posterior.size)
    residual = posterior.least_squares(z)
    for _ in range(STEPS):
        jacobian = posterior.jacobian(z)
        covariance = np.linalg.inv(jacobian.T @ jacobian)
        step = covariance @ (jacobian.T @ residual)
        if np.abs(step).max() < SMALL:
            return z - step, covariance
        z, residual = _descended(posterior, z, step, residual)
    raise RuntimeError(f"the fit still changes by {np.abs(step).max():.2g} prior deviations after {STEPS} steps")


def _descended(posterior: Posterior, z: Floats, step: Floats, residual: Floats) -> tuple[Floats, Floats]:
    """Return the point after a step, made smaller until the sum of squares falls, and the residuals there."""
    size, before = 1.0, residual @ residual
    while size > SMALL:
        after = posterior.least_squares(z - size * step)
        if after @ after < before:  # false where it is not a number
            return z - size * step, after
        size *= 0.5
    raise RuntimeError("the fit stopped: no step reduces the sum of squares")


@cache
def _planner(arm_spread: float) -> Planner:
    return Planner(planners_model(arm_spread))


@cache
def _reference(parameters: tuple[float, ...], arm_spread: float) -> Reference:
    motion = mission.splines(len(parameters) // 6).motion(np.array(parameters))
    return Reference.of(planners_model(arm_spread), motion)


SHIPS, FEW = 200, 20  # number of drawn ships of each row in a full and in a quick run


@dataclass(frozen=True)
class Result:
    """Outcome of the study."""

    rows: Mapping[str, Row]  # drawn ships by what is known of the arm, see `studies.common.mission.ROWS`
    example: tuple[Trip, ...]  # paths of one more ship by stage, arm as in the headline
    course: Flown  # course of the first path with the published ship in MuJoCo
    full: bool


def run(
    parameters: Floats,
    *,
    full: bool = False,
    seed: int = 1,
    ships: int | None = None,
    trials: Path | None = None,
    workers: Workers = 1,
    progress: Callable[[str], None] = lambda text: None,
) -> Result:
    """Run the study; arguments that are not described are options of the command.

    Parameters
    ----------
    parameters : (n,) array; parameters of the identifying manoeuvre, `studies.common.mission.splines`
    """
    ships = (SHIPS if full else FEW) if ships is None else ships
    rows = {
        row: row_of(
            parameters,
            spread,
            ships,
            seed=1000 * seed + number,
            store=None if trials is None else trials / f"{number}.jsonl",
            workers=workers,
            progress=lambda text, row=row: progress(f"{row}: {text}"),  # type: ignore[misc]
        )
        for number, (row, spread) in enumerate(mission.ROWS.items())
    }
    spread = next(iter(mission.ROWS.values()))
    example, _ = trip_of(tuple(map(float, parameters)), spread, np.random.default_rng(seed))
    course = flown_along(mission.published_robot(), Planner(planners_model(spread)).first, mission.DURATION)
    return Result(rows, example, course, full and ships >= SHIPS)
