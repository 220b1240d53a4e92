"""The robot as Basilisk takes it: a base and a serial arm of revolute joints, read from a URDF."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from studies.truth.basilisk.parts import BasiliskHidden
from studies.truth.bodies import Body, join
from studies.truth.numerics import Array
from studies.truth.urdf import (
    SERVICER4,
    attribute,
    child_link,
    link_bodies,
    numbers,
    parent_link,
    part,
    root_link,
    rotation_from_rpy,
)

__all__ = ["Link", "Robot", "joint_inertias", "read_robot", "true_base"]

_NOTHING = BasiliskHidden()


class Link(NamedTuple):
    """A link of the arm and the joint that carries it; offset and rotation place the joint in its parent's axes."""

    joint: str
    body: Body
    offset: Array
    rotation: Array
    axis: Array


class Robot(NamedTuple):
    """Name of the base link, the base body, the arm from the base outwards."""

    name: str
    base: Body
    arm: list[Link]


def read_robot(urdf: str | Path) -> Robot:
    """Read a serial arm of revolute joints on a base; a fixed massless tip is left out."""
    tree = ElementTree.parse(urdf).getroot()
    bodies, joints = link_bodies(tree), {parent_link(joint): joint for joint in tree.iterfind("joint")}
    root = root_link(tree)
    parent, arm = root, []
    while parent in joints and child_link(joints[parent]) in bodies:
        joint = joints[parent]
        parent, name, kind = child_link(joint), attribute(joint, "name"), attribute(joint, "type")
        if kind not in ("revolute", "continuous"):
            raise ValueError(f"joint {name} is {kind}; only revolute joints are simulated")
        origin, axis = joint.find("origin"), numbers(part(joint, "axis"), "xyz")
        rotation = rotation_from_rpy(numbers(origin, "rpy"))
        arm.append(Link(name, bodies[parent], numbers(origin, "xyz"), rotation, axis / np.linalg.norm(axis)))
    return Robot(root, bodies[root], arm)


def true_base(hidden: BasiliskHidden = _NOTHING, urdf: str | Path = SERVICER4) -> Body:
    """Inertial parameters of the base with all that is fixed on it when nothing moves, the goal of identification."""
    extra = [hidden_part.body for hidden_part in (hidden.panel, hidden.slosh) if hidden_part is not None]
    return join(read_robot(urdf).base, *extra)


def joint_inertias(arm: Sequence[Link], position: Array) -> Array:
    """Inertia of all that a joint carries about its axis [kg m2], (joints,)."""
    rotation, origin = np.eye(3), np.zeros(3)
    axes, origins, bodies = [], [], []
    for link, angle in zip(arm, position, strict=True):
        origin = origin + rotation @ link.offset
        # the arm is mirrored, every joint turned the other way; it sets the stiffness of the servos and nothing else
        rotation = rotation @ link.rotation @ Rotation.from_rotvec(-angle * link.axis).as_matrix()
        axes.append(rotation @ link.axis)
        origins.append(origin)
        tensor = rotation @ link.body.inertia @ rotation.T
        bodies.append(Body(link.body.mass, origin + rotation @ link.body.com, tensor))
    carried = [join(*bodies[index:]) for index in range(len(bodies))]
    return np.array(
        [axis @ body.inertia_about(point) @ axis for axis, point, body in zip(axes, origins, carried, strict=True)]
    )
