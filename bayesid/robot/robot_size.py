"""Size of a robot: how far its bodies extend, how much area they show, and what hangs on each joint.

A URDF states no surfaces. Every body is therefore taken as the uniform box of its mass and inertia, with no edge
shorter than that of a cube of steel of its mass. Solar panels weigh too little to show in the box; their area follows
from the power that a spacecraft of this mass needs. The numbers serve to bound what can act on the robot; they are no
drawing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.robot import Robot

__all__ = ["BeyondJoint", "RobotSize", "beyond_joint", "half_edges", "link_radius"]

STEEL = 7800.0  # density of steel [kg/m3], above which no body of a spacecraft lies as a whole
# Area of solar panels per mass of the spacecraft [m2/kg], for 4 W per kilogram and 200 W per square metre. It is
# assumed and by no source, and generous on purpose: it makes most of the area of a compact robot.
PANEL_AREA = 0.02


@dataclass(frozen=True)
class RobotSize:
    """Size of a whole robot and of its base.

    Parameters
    ----------
    mass : float
        Mass of the whole robot, loads included [kg].
    base_mass : float
        Mass of the base [kg].
    area : float
        Largest area that can face one direction: the largest faces of all bodies and the solar panels [m2].
    area_moment : float
        The same areas, each times the largest distance of its body from the base origin in any posture [m3]. A pressure
        times this is the largest torque about the base origin.
    length : float
        Longest edge of the base's box [m].
    radius : float
        Largest distance of the base's matter, and of the frames that hang on it, from the base origin [m].
    inertia : float
        Largest principal moment of the base about its centre of mass [kg m2].
    """

    mass: float
    base_mass: float
    area: float
    area_moment: float
    length: float
    radius: float
    inertia: float

    @classmethod
    def of(cls, robot: Robot) -> RobotSize:
        """Return the size of a robot with its present inertial parameters."""
        base = robot.link(robot.base).inertial
        first, second, _ = half_edges(base)
        radius, panels = link_radius(robot, robot.base), PANEL_AREA * robot.mass
        areas = {name: 4.0 * float(np.prod(half_edges(link.inertial)[:2])) for name, link in robot.links.items()}
        moments = [area * _outer_distance(robot, name) for name, area in areas.items()]
        return cls(
            mass=robot.mass,
            base_mass=base.mass,
            area=sum(areas.values()) + panels,
            area_moment=sum(moments) + panels * radius,
            length=2.0 * float(first),
            radius=radius,
            inertia=base.mass / 3.0 * float(first**2 + second**2),
        )


class BeyondJoint(NamedTuple):
    """Bodies that a joint carries."""

    mass: float  #: their mass [kg]
    inertia: float  #: their largest moment of inertia about the joint in any posture [kg m2]


def beyond_joint(robot: Robot, joint: int) -> BeyondJoint:
    """Return what the joint of an index into `Robot.joints` carries.

    A joint that carries no mass is said to carry a gram within a centimetre, so that bounds stay above zero.

    Parameters
    ----------
    robot : Robot
    joint : int
        Index into `Robot.joints`.
    """
    carried = {name: link for name, link in robot.links.items() if joint in robot.chain(link.joint)}
    mass = sum(link.inertial.mass for link in carried.values())
    inertia = sum(link.inertial.mass * _outer_distance(robot, name, joint) ** 2 for name, link in carried.items())
    return BeyondJoint(max(mass, 1e-3), max(inertia, 1e-7))


def half_edges(inertial: InertialParameters) -> Floats:
    """Return half the edges of a body's uniform box, the longest first, shape (3,) [m].

    A uniform box of half edges h has second moments m h^2 / 3 about its centre. Without mass all three are zero.
    """
    if inertial.mass == 0.0:
        return np.zeros(3)
    moments = np.linalg.eigvalsh(inertial.inertia)
    second = np.clip(0.5 * moments.sum() - moments, 0.0, None)
    smallest = 0.5 * np.cbrt(inertial.mass / STEEL)
    return np.maximum(np.sqrt(3.0 * second / inertial.mass), smallest)


def link_radius(robot: Robot, name: str) -> float:
    """Return the largest distance of a link's matter, and of the frames that hang on it, from its origin [m].

    Parameters
    ----------
    robot : Robot
    name : str
        Link.
    """
    link = robot.link(name)
    inverse = np.linalg.inv(link.placement)
    frames = [other.placement for other in robot.links.values() if other.joint == link.joint]
    frames += [
        robot.model.jointPlacements[index + 2].homogeneous
        for index in range(len(robot.joints))
        if robot.model.parents[index + 2] - 2 == link.joint
    ]
    distances = [float(np.linalg.norm((inverse @ frame)[:3, 3])) for frame in frames]
    box = half_edges(link.inertial)
    return max(float(np.linalg.norm(link.inertial.com) + np.linalg.norm(box)), *distances)


def _outer_distance(robot: Robot, name: str, origin: int = -1) -> float:
    """Return the largest distance of a body's matter from the frame of a joint (-1: base) in any posture [m].

    The joints between are stretched, and slides extended to their limits where they have any.
    """
    link = robot.link(name)
    com = link.placement @ np.array([*link.inertial.com, 1.0])
    distance = float(np.linalg.norm(com[:3]) + np.linalg.norm(half_edges(link.inertial)))
    for joint in robot.chain(link.joint):
        if joint == origin:
            break
        distance += float(np.linalg.norm(robot.model.jointPlacements[joint + 2].translation))
        limits = robot.joints[joint].lower, robot.joints[joint].upper
        if robot.joints[joint].kind == "prismatic" and np.isfinite(limits).all():
            distance += max(abs(limit) for limit in limits)
    return distance
