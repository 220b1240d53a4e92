"""Data that show the scale of the masses: the rank of the equations, with and without actions that are known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesid import Load, Robot
from bayesid._math.arrays import Floats
from bayesid.identifiability import (
    BaseParameters,
    Determined,
    base_parameters,
    consistent_accelerations,
    determined,
    rates_at_rest,
)
from bayesid.identifiability.stacked_regressor import massive_bodies, random_motion
from bayesid.robot.composite_tables import link_table
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.kinematics import Kinematics
from bayesid.robot.regressors import gradient_regressor, torque_regressor
from studies.base_parameters.structure import standard_parameters

__all__ = ["ScaleCase", "scale_cases"]

STATES = 90
"""Number of random states, many more than the parameters need."""

GRADIENT = 1.0
"""Gravity gradient mu / R^3, in units of time in which the random states turn at about the mean motion."""

ACTION = 1.0e3
"""Size of known forces, torques and momenta in the same units, as large as those of the arm's motion."""


@dataclass(frozen=True)
class ScaleCase:
    """Base parameters that some data determine.

    Attributes
    ----------
    data : str
        Description of what is measured and known.
    determined : Determined
        Number of determined base parameters, and singular values on both sides of the rank.
    open_scale : bool
        Whether the data allow any common factor of all base parameters.
    """

    data: str
    determined: Determined
    open_scale: bool


def scale_cases(robot: Robot, rng: np.random.Generator) -> tuple[ScaleCase, ...]:
    """Return what motion alone determines, and what it determines together with further knowledge."""
    world = _World(robot, rng)
    wheel, thrust, torque = np.zeros((3, STATES, 6))
    momentum = ACTION * np.array([0.5, -0.8, 0.3])
    wheel[:, 3:] = -np.cross(world.rate, momentum)
    wheel[::10, 3:] -= momentum  # spun up at times
    thrust[:: STATES // 3, 0] = ACTION
    torque[:: STATES // 3, 5] = ACTION
    at_rest = rates_at_rest(robot, world.motion)
    alone, bodies = world.equations(), world.bodies
    masses = [f"{body}.mass" for body in bodies]
    total = np.array([[name in masses for name in world.base.standard]], dtype=float)
    load = Load("load", bodies[-1], InertialParameters(10.0, [0.1, 0.1, 0.1], 10.0 * np.eye(3)))
    loaded = _World(robot.with_load(load), rng)
    return (
        world.case("motion, tumbling", alone),
        world.case("motion, from rest", world.equations(rate=at_rest)),
        world.case("motion in the gravity gradient, tumbling", world.equations(gradient=True)),
        world.case("motion in the gravity gradient, from rest", world.equations(rate=at_rest, gradient=True)),
        world.case("motion and joint torques", world.equations(joints=True)),
        world.case("motion, known wheel spun up at times", world.equations(wheel)),
        world.case("motion, known thrust on the base at times", world.equations(thrust)),
        world.case("motion, known torque on the base at times", world.equations(torque)),
        *(world.case(f"motion, {body} known", alone, world.known(body)) for body in bodies),
        world.case("motion, mass of the whole robot known", alone, total),
        world.case(f"motion, mass of {bodies[0]} known", alone, world.known(bodies[0])[:1]),
        loaded.case(
            f"motion, {bodies[-1]} with a load fixed on it, load known", loaded.equations(), loaded.known("load")
        ),
    )


class _World:
    """Random states of a robot."""

    def __init__(self, robot: Robot, rng: np.random.Generator) -> None:
        self.robot, self.bodies = robot, massive_bodies(robot)
        self.base: BaseParameters = base_parameters(robot)
        self.motion: Kinematics = random_motion(robot, STATES, rng)
        self.tables = np.concatenate([link_table(robot, body, self.motion) for body in self.bodies], axis=2)
        self.rate = rng.normal(size=(STATES, 3))
        up = rng.normal(size=(STATES, 3))
        self.zenith = up / np.linalg.norm(up, axis=1)[:, None]

    def equations(
        self, wrench: Floats | None = None, *, rate: Floats | None = None, joints: bool = False, gradient: bool = False
    ) -> Floats:
        """Return the left side of the equations in states that a known wrench causes; with the joints' if measured."""
        rate = self.rate if rate is None else rate
        wrench = np.zeros((STATES, 6)) if wrench is None else wrench
        zenith = self.zenith if gradient else None
        change, lift = consistent_accelerations(self.robot, self.motion, rate, wrench, zenith, GRADIENT)
        left = torque_regressor(self.robot, self.bodies, self.motion, rate, change, lift)
        left = left if joints else left[:, :6]
        if zenith is not None:
            left[:, :6] -= gradient_regressor(self.tables, zenith, GRADIENT)
        return left.reshape(-1, left.shape[-1])

    def known(self, body: str) -> Floats:
        """Return the equations that state the ten parameters of a body."""
        return np.eye(10 * len(self.bodies))[10 * self.bodies.index(body) :][:10]

    def case(self, data: str, left: Floats, known: Floats | None = None) -> ScaleCase:
        """Return what equations determine; known parameters weigh as much as one equation of motion."""
        if known is not None:
            weight = np.linalg.norm(known * np.linalg.norm(left, axis=0), axis=1, keepdims=True)
            left = np.concatenate([left, weight * known])
        result = determined(self.base, left)
        return ScaleCase(data, result, result.leaves_open(self.base.project(standard_parameters(self.robot))))
