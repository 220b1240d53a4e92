"""Robots in MuJoCo's format MJCF, compiled by MuJoCo itself and rewritten as URDF.

MuJoCo's own compiler decides what a file means: angles, sequences of angles, defaults, frames, replicas, included
files, inertias from geometry, total mass. Masses, places, axes and limits are those of its compiled model. Actuators,
contacts and damping have no part in a measured motion; armature, the inertia of spinning rotors, is left out too.
"""

from __future__ import annotations

import warnings
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.urdf_tree import BOUNDLESS, write_inertial

__all__ = ["urdf_of_mjcf"]


def urdf_of_mjcf(file: Path) -> str:
    """Return the URDF of a robot in MJCF.

    The only tree of bodies in the world is the robot, and its first body the base, whether it has a free joint or not.

    Raises
    ------
    InputError
        If MuJoCo cannot read the file, or it holds several robots, a closed loop or a joint that is neither a hinge
        nor a slide.
    """
    import mujoco

    try:
        with _quiet(mujoco):
            spec = mujoco.MjSpec.from_file(str(file))
            _drop_visuals(spec, mujoco)
            model = spec.compile()
    except (ValueError, RuntimeError) as error:
        problem = f"MuJoCo cannot read the robot: {' '.join(str(error).split()).removeprefix('Error: ')}"
        raise InputError(problem, file=file, remedy="Correct the MJCF or convert it to URDF") from error
    _refuse_loops(model, mujoco, file)
    links = _names(model.body, model.nbody, "body")
    joints = _names(model.joint, model.njnt, "joint")
    base = _base(model, mujoco, links, file)
    robot = ET.Element("robot", name=model.names[: model.names.index(b"\0")].decode() or "robot")
    for body in range(1, model.nbody):
        if model.body_rootid[body] != base:
            continue
        if body != base:
            _add_joints(robot, model, mujoco, body, links, joints, file)
        rotation = _rotation(model.body_iquat[body])
        inertia = rotation @ np.diag(model.body_inertia[body]) @ rotation.T
        link = ET.SubElement(robot, "link", name=links[body])
        mass = float(model.body_mass[body])
        try:
            write_inertial(link, InertialParameters(mass, model.body_ipos[body], 0.5 * (inertia + inertia.T)))
        except InputError as error:
            raise error.within(file=file, place=f"body {links[body]}") from None
    ET.indent(robot)
    return ET.tostring(robot, encoding="unicode") + "\n"


@contextmanager
def _quiet(mujoco: Any) -> Iterator[None]:
    """Let MuJoCo keep its warnings of attributes that it will drop: it would also write them to a file of its own."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda text: None)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        mujoco.set_mju_user_warning(before)


def _drop_visuals(spec: Any, mujoco: Any) -> None:
    """Remove what has no mass, so that its files need not be there: meshes of bodies with an inertia of their own."""
    spec.compiler.fusestatic = False
    for kind in ("keys", "textures", "materials", "skins", "sensors", "actuators", "excludes", "pairs"):
        for element in list(getattr(spec, kind)):
            spec.delete(element)
    always = spec.compiler.inertiafromgeom == 1
    for element in (*spec.geoms, *spec.sites, *spec.tendons):
        element.material = ""
    for geom in list(spec.geoms):
        shapeless = geom.type in (mujoco.mjtGeom.mjGEOM_HFIELD, mujoco.mjtGeom.mjGEOM_PLANE)
        if (geom.parent.explicitinertial and not always) or geom.parent is spec.worldbody or shapeless:
            spec.delete(geom)
    used = {geom.meshname for geom in spec.geoms}
    for mesh in list(spec.meshes):
        if mesh.name not in used:
            spec.delete(mesh)


def _names(access: Any, count: int, kind: str) -> list[str]:
    """Return a name for each body or joint, those that the file leaves without one by their number."""
    return [access(index).name or f"{kind}{index}" for index in range(count)]


def _refuse_loops(model: Any, mujoco: Any, file: Path) -> None:
    """Refuse constraints that close a loop of bodies. Coupled joints are no matter, since each is recorded."""
    for index in range(model.neq):
        kind = mujoco.mjtEq(model.eq_type[index])
        if kind in (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD):
            problem = f"the constraint <{_word(kind)}> is not supported"
            raise InputError(problem, file=file, place="equality", remedy="Reduce the model to a tree of bodies")
    if model.nflex:
        raise InputError(
            "a flexible body is not supported", file=file, remedy="Reduce the model to a tree of rigid bodies"
        )


def _word(kind: Any) -> str:
    """Return the word of the format for a member of one of MuJoCo's enumerations."""
    return str(kind.name.rpartition("_")[2].lower())


def _base(model: Any, mujoco: Any, links: list[str], file: Path) -> int:
    """Return the root of the only tree that has joints or mass."""
    trees = [
        int(body)
        for body in np.unique(model.body_rootid[1:])
        if model.body_subtreemass[body] > 0.0 and not model.body_mocapid[body] >= 0
    ]
    if len(trees) != 1:
        shown = f": {', '.join(links[body] for body in trees)}" if trees else ""
        problem = f"the world contains {len(trees)} bodies{shown}"
        raise InputError(problem, file=file, place="worldbody", remedy="Reduce it to one body, the base of the robot")
    (base,) = trees
    first = model.body_jntadr[base]
    kinds = [mujoco.mjtJoint(kind) for kind in model.jnt_type[first : first + model.body_jntnum[base]]]
    if kinds and kinds != [mujoco.mjtJoint.mjJNT_FREE]:
        problem = f"a {_word(kinds[0])} connects it to the world, where only a free joint is allowed"
        remedy = "The base flies freely: give it a free joint or none"
        raise InputError(problem, file=file, place=f"body {links[base]}", remedy=remedy)
    return base


def _add_joints(
    robot: ET.Element, model: Any, mujoco: Any, body: int, links: list[str], joints: list[str], file: Path
) -> None:
    """Join a body to its parent by its joints, one after the other, or rigidly.

    MuJoCo turns or shifts the body about each joint's anchor by its position less ``ref``. A link of a URDF has its
    axes at its joint, so that a body whose anchor is elsewhere is fixed on a link without mass there.
    """
    pose = pin.SE3(_rotation(model.body_quat[body]), model.body_pos[body])
    above, first = links[model.body_parentid[body]], model.body_jntadr[body]
    for index in range(first, first + model.body_jntnum[body]):
        kind = mujoco.mjtJoint(model.jnt_type[index])
        turns = kind == mujoco.mjtJoint.mjJNT_HINGE
        if not turns and kind != mujoco.mjtJoint.mjJNT_SLIDE:
            problem = f"joint type {_word(kind)!r} is not supported"
            remedy = "Use hinges or prismatic joints, and a free joint for the base only"
            raise InputError(problem, file=file, place=f"joint {joints[index]}", remedy=remedy)
        axis, anchor = model.jnt_axis[index], pin.SE3(np.eye(3), model.jnt_pos[index])
        back = -float(model.qpos0[model.jnt_qposadr[index]])
        start = pin.SE3(pin.exp3(back * axis), np.zeros(3)) if turns else pin.SE3(np.eye(3), back * axis)
        last = index == first + model.body_jntnum[body] - 1
        moved = links[body] if last and not np.any(anchor.translation) else f"{joints[index]}_axes"
        limited = bool(model.jnt_limited[index])
        kinds = ("revolute" if limited else "continuous") if turns else "prismatic"
        element = _place(robot, joints[index], kinds, pose * anchor * start, above, moved)
        ET.SubElement(element, "axis", xyz=_text(axis))
        lower, upper = model.jnt_range[index] if limited else (-BOUNDLESS, BOUNDLESS)
        limits = {"lower": f"{lower:.17g}", "upper": f"{upper:.17g}"} if kinds != "continuous" else {}
        ET.SubElement(element, "limit", limits, effort=f"{BOUNDLESS:g}", velocity=f"{BOUNDLESS:g}")
        pose, above = anchor.inverse(), moved
        if moved != links[body]:
            ET.SubElement(robot, "link", name=moved)
    if above != links[body]:
        _place(robot, f"{links[body]}_mount", "fixed", pose, above, links[body])


def _place(robot: ET.Element, name: str, kind: str, pose: pin.SE3, parent: str, child: str) -> ET.Element:
    joint = ET.SubElement(robot, "joint", name=name, type=kind)
    ET.SubElement(joint, "origin", xyz=_text(pose.translation), rpy=_text(pin.rpy.matrixToRpy(pose.rotation)))
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    return joint


def _rotation(quaternion: Floats) -> Floats:
    """Return the rotation matrix, (3, 3), of a quaternion in MuJoCo's order w, x, y, z."""
    w, x, y, z = quaternion
    return np.asarray(pin.Quaternion(w, x, y, z).matrix())


def _text(values: Floats) -> str:
    return " ".join(f"{value:.17g}" for value in values)
