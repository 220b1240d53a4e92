"""Parts of a robot as bodies, joints and springs of a MuJoCo model."""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree import ElementTree

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from studies.truth.bodies import Body
from studies.truth.mujoco.parts import Appendage, Flexibility, Mover, Rotor
from studies.truth.numerics import Array
from studies.truth.urdf import attribute, child_link, link_bodies, numbers, parent_link, rotation_from_rpy

__all__ = ["add_appendage", "add_links", "add_mover", "add_rotor", "set_inertial"]

ARMATURE = 1.0
"""Inertia of a flexible joint's motor about its axis [kg m2]; the motor is driven, so that nothing else feels it."""

JOINT_TYPES = {
    "revolute": mujoco.mjtJoint.mjJNT_HINGE,
    "continuous": mujoco.mjtJoint.mjJNT_HINGE,
    "prismatic": mujoco.mjtJoint.mjJNT_SLIDE,
}
"""MuJoCo's joint for each moving joint of a URDF."""


def _quaternion(rotation: Array) -> Array:
    """MuJoCo's quaternion (w, x, y, z) of a rotation matrix."""
    return np.asarray(Rotation.from_matrix(rotation).as_quat(scalar_first=True))


def set_inertial(spec_body: mujoco.MjsBody, body: Body) -> None:
    """Give a body of the model its inertial parameters."""
    moments, axes = np.linalg.eigh(body.inertia)
    axes[:, 2] *= np.linalg.det(axes)
    spec_body.explicitinertial = True
    spec_body.mass, spec_body.ipos = body.mass, body.com
    spec_body.inertia, spec_body.iquat = moments, _quaternion(axes)


def add_links(
    spec_body: mujoco.MjsBody,
    name: str,
    urdf: ElementTree.Element,
    changed: Mapping[str, Body],
    flexible: Mapping[str, Flexibility],
) -> None:
    """Add everything that hangs on link `name`."""
    bodies = link_bodies(urdf) | dict(changed)
    for joint in urdf.iterfind("joint"):
        if parent_link(joint) != name:
            continue
        child, origin = child_link(joint), joint.find("origin")
        quaternion = _quaternion(rotation_from_rpy(numbers(origin, "rpy")))
        added = spec_body.add_body(name=child, pos=numbers(origin, "xyz"), quat=quaternion)
        if child in bodies:
            set_inertial(added, bodies[child])
        kind, joint_name = attribute(joint, "type"), attribute(joint, "name")
        if kind != "fixed":
            axis = numbers(joint.find("axis"), "xyz", "1 0 0")
            motor = added.add_joint(name=joint_name, type=JOINT_TYPES[kind], axis=axis)
            if joint_name in flexible:
                # two coaxial joints on one body: the motor needs some inertia to keep the matrix regular
                motor.armature = ARMATURE
                added.add_joint(name=f"{joint_name} spring", type=JOINT_TYPES[kind], axis=axis)
        add_links(added, child, urdf, changed, flexible)


def add_rotor(base: mujoco.MjsBody, rotor: Rotor) -> None:
    """Add a wheel that turns about its axis."""
    added = base.add_body(name="rotor")
    set_inertial(added, rotor.body)
    added.add_joint(name="rotor", type=mujoco.mjtJoint.mjJNT_HINGE, axis=rotor.axis, pos=rotor.position)


def add_mover(base: mujoco.MjsBody, name: str, mover: Mover) -> None:
    """Add a body that slides along its direction."""
    added = base.add_body(name=name)
    set_inertial(added, mover.body)
    added.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=mover.direction)


def add_appendage(base: mujoco.MjsBody, name: str, appendage: Appendage) -> None:
    """Add the body with springs of the wanted frequency: stiffness = inertia about the axis x omega^2."""
    body, omega = appendage.body, 2.0 * np.pi * appendage.frequency
    added = base.add_body(name=name)
    set_inertial(added, body)
    about_anchor = body.inertia_about(np.array(appendage.anchor))
    kinds = [(mujoco.mjtJoint.mjJNT_HINGE, a) for a in appendage.hinges]
    kinds += [(mujoco.mjtJoint.mjJNT_SLIDE, a) for a in appendage.slides]
    for index, (kind, direction) in enumerate(kinds):
        axis = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
        inertia = axis @ about_anchor @ axis if kind == mujoco.mjtJoint.mjJNT_HINGE else body.mass
        spring = added.add_joint(name=f"{name}_{index}", type=kind, axis=axis, pos=appendage.anchor)
        # MuJoCo 4 takes polynomials; the first coefficient is the linear one
        spring.stiffness = [inertia * omega**2, 0.0, 0.0]
        spring.damping = [2.0 * appendage.damping * inertia * omega, 0.0, 0.0]
