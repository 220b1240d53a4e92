"""True ships drawn from what the planner holds possible: predicted, flown, identified, planned for again and flown."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesid import Robot
from bayesid._math.arrays import Floats
from bayesid.design.pose_region import Pose
from bayesid.inference.posterior import Posterior
from bayesid.report.verdict_record import Share
from bayesid.robot.body_prior import coordinates_of
from studies.common import mission
from studies.common.monte_carlo import Workers, run_trials
from studies.common.quantities import squared_distances
from studies.common.repeated_fits import Reference
from studies.planning.planner import Planner, miss_of
from studies.planning.world import FlownPose, fly, planners_model, true_ship

__all__ = ["BODIES", "KINDS", "STAGES", "Row", "Trip", "fitted", "row_of", "trip_of"]

STAGES = ("published ship", "identified ship")  # what the planner takes the ship for, before and after identification

# what is predicted: poses of base and end-effector, each with a region of position and one of rotation
BODIES, KINDS = ("base", "tip"), ("position", "rotation")

DRAWS = 400  # number of draws of each prediction

# largest number of Gauss-Newton steps, and change of every coordinate below which they end [prior deviations]
STEPS, SMALL = 20, 1e-4


@dataclass(frozen=True)
class _Task:
    """One drawn ship."""

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
    held: NDArray[np.bool_]  # (N, 2 stages, 2 bodies, 2 kinds): whether the 95 % regions held the flown poses
    size: Floats  # (N, 2 stages, 2 bodies, 2 kinds): longest semi-axes of these regions [mm, degrees]
    # (N,): squared distances of the true base from the identified one; chi-square with ten degrees of freedom if the
    # posterior is right
    distance: Floats

    def share(self, stage: int, body: int, kind: int) -> Share:
        """Return how many regions held."""
        return Share(int(self.held[:, stage, body, kind].sum()), len(self.held))


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
    parameters : (n,) array
        Parameters of the identifying manoeuvre, `studies.common.mission.splines`.
    arm_spread : float
        Relative width of the links' priors.
    count : int
        Number of ships.
    seed, store, workers, progress
        See `studies.common.monte_carlo.run_trials`.
    """
    task = _Task(tuple(map(float, parameters)), arm_spread)
    outcomes = run_trials(outcome, [task] * count, store, seed=seed, workers=workers, progress=progress).complete()
    miss, held, size = (np.array([[trip[key] for trip in item["trips"]] for item in outcomes]) for key in _KEYS)
    return Row(miss, held, size, np.array([item["distance"] for item in outcomes]))


_KEYS = ("miss", "held", "size")


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
    own = covariance[:count, :count]
    draws = z[:count] + rng.normal(size=(DRAWS, count)) @ np.linalg.cholesky(own).T
    again = trip(z[:count], draws)
    error = z[:10] - _coordinates(planner, robot)
    return (first, again), float(squared_distances(error, own[:10, :10]))


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
    raise RuntimeError(f"the fit still moves by {np.abs(step).max():.2g} prior deviations after {STEPS} steps")


def _descended(posterior: Posterior, z: Floats, step: Floats, residual: Floats) -> tuple[Floats, Floats]:
    """Return the point after a step, made smaller until the sum of squares falls, and the residuals there."""
    size, before = 1.0, residual @ residual
    while size > SMALL:
        after = posterior.least_squares(z - size * step)
        if after @ after < before:  # false where it is not a number
            return z - size * step, after
        size *= 0.5
    raise RuntimeError("the fit ends where no step leads to a smaller sum of squares")


def _coordinates(planner: Planner, robot: Robot) -> Floats:
    """Return the coordinates (10,) of the true base in the planner's model."""
    prior = planner.model.priors[0]
    return coordinates_of(prior, robot.link(prior.name).inertial)


@cache
def _planner(arm_spread: float) -> Planner:
    return Planner(planners_model(arm_spread))


@cache
def _reference(parameters: tuple[float, ...], arm_spread: float) -> Reference:
    motion = mission.splines(len(parameters) // 6).motion(np.array(parameters))
    return Reference.of(planners_model(arm_spread), motion)
