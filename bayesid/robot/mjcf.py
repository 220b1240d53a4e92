"""Robots in MuJoCo's format MJCF, read by Pinocchio and rewritten as URDF.

What Pinocchio is known to read otherwise than MuJoCo, or to leave out without a word, is refused. Masses, places and
axes are those of the file. Actuators, contacts and damping have no part in a measured motion; armature, the inertia of
spinning rotors, is left out too.
"""

from __future__ import annotations

import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pinocchio as pin

from bayesid._io.errors import InputError
from bayesid.robot.mjcf_limits import refuse_unread

__all__ = ["urdf_of_mjcf"]

BOUNDLESS = 1e9
"""Limit of what has none, since URDF demands a number for a prismatic joint."""

LIGHTEST = 1e-9
"""Mass below which a body has none: it is the rounding of a difference [kg]."""

SAME_PLACE = 1e-12
"""Difference of two poses that is rounding [m, 1]."""

AXES = {"RX": (1, 0, 0), "RY": (0, 1, 0), "RZ": (0, 0, 1), "PX": (1, 0, 0), "PY": (0, 1, 0), "PZ": (0, 0, 1)}
"""Axes of Pinocchio's joints along an axis of their frame, by the end of their names."""

UNALIGNED = {"RevoluteUnaligned": "R", "PrismaticUnaligned": "P"}
"""Letters of Pinocchio's joints along any axis."""


def urdf_of_mjcf(root: ET.Element, file: Path) -> str:
    """Return the URDF of a robot whose MJCF has been parsed.

    The first body of the world is the base, whether it has a free joint or not.

    Parameters
    ----------
    root : Element
        Element ``<mujoco>`` of the file.
    file : Path
        The file, which Pinocchio reads again.

    Raises
    ------
    InputError
        If the file holds what Pinocchio does not read, or a joint that is neither a hinge nor a slide.
    """
    refuse_unread(root, file)
    try:
        model = pin.buildModelFromMJCF(str(file))
    except Exception as error:
        message = str(error).rpartition("message:")[2].strip()  # after the place in Pinocchio's own source
        raise InputError(
            f"Pinocchio cannot read the robot: {message}", file=file, remedy="Correct the MJCF or convert it to URDF"
        ) from error
    robot = ET.Element("robot", name=root.get("model", "robot"))
    scale = _slide_scale(root)
    free = model.njoints > 1 and model.joints[1].shortname() == "JointModelFreeFlyer"
    base = 1 if free else 0
    links = {base: _add_bodies(robot, model, base, file)}
    for joint in range(base + 1, model.njoints):
        links[joint] = _add_bodies(robot, model, joint, file)
        _add_joint(robot, model, joint, links, scale, file)
    ET.indent(robot)
    return ET.tostring(robot, encoding="unicode") + "\n"


def _slide_scale(root: ET.Element) -> float:
    """Return the factor that makes the limits of slides right.

    Pinocchio 4.1 takes the range of a slide for an angle where the file's angles are in degrees. A slide of which the
    range is known tells whether it does.
    """
    compiler = root.find("compiler")
    angle = "degree" if compiler is None else compiler.get("angle", "degree")
    body = '<body name="a"><joint type="slide" range="0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>'
    with tempfile.TemporaryDirectory() as folder:
        probe = Path(folder) / "slide.xml"
        probe.write_text(f'<mujoco><compiler angle="{angle}"/><worldbody>{body}</worldbody></mujoco>', encoding="utf-8")
        return 1.0 / float(pin.buildModelFromMJCF(str(probe)).upperPositionLimit[0])


def _add_bodies(robot: ET.Element, model: pin.Model, joint: int, file: Path) -> str:
    """Add the bodies that a joint carries, and return the link whose axes are those of the joint."""
    own, fixed = None, []
    rest = model.inertias[joint].toDynamicParameters()
    for frame in model.frames:
        if frame.type != pin.FrameType.BODY or frame.parentJoint != joint:
            continue
        holder = model.frames[frame.parentFrame]
        if holder.type == pin.FrameType.FIXED_JOINT and holder.name != "universe":
            fixed.append((frame, holder.inertia))
            rest = rest - frame.placement.act(holder.inertia).toDynamicParameters()
        else:
            own = frame
    if own is None:
        raise InputError("the joint carries no body", file=file, place=model.names[joint], remedy="Give it a body")
    inertia = pin.Inertia.Zero()
    if rest[0] > LIGHTEST:
        inertia = own.placement.actInv(pin.Inertia.FromDynamicParameters(rest))
    carrier = own.name
    if own.placement.isIdentity(SAME_PLACE):
        _add_link(robot, own.name, inertia)
    else:
        # the axes of a link of a URDF are those of its joint, so that the body is fixed on a link without mass
        carrier = f"{model.names[joint]}_axes"
        _add_link(robot, carrier, pin.Inertia.Zero())
        _add_fixed(robot, own, carrier, inertia)
    for frame, body in fixed:
        _add_fixed(robot, frame, carrier, body)
    return carrier


def _add_link(robot: ET.Element, name: str, inertia: pin.Inertia) -> None:
    link = ET.SubElement(robot, "link", name=name)
    if inertia.mass <= 0.0:
        return
    element = ET.SubElement(link, "inertial")
    ET.SubElement(element, "origin", xyz=_text(inertia.lever), rpy="0 0 0")
    ET.SubElement(element, "mass", value=f"{inertia.mass:.17g}")
    entries = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    ET.SubElement(element, "inertia", {key: f"{inertia.inertia[index]:.17g}" for key, index in entries.items()})


def _add_fixed(robot: ET.Element, frame: pin.Frame, carrier: str, inertia: pin.Inertia) -> None:
    _add_link(robot, frame.name, inertia)
    joint = ET.SubElement(robot, "joint", name=f"{frame.name}_mount", type="fixed")
    _place(joint, frame.placement, carrier, frame.name)


def _add_joint(
    robot: ET.Element, model: pin.Model, index: int, links: dict[int, str], scale: float, file: Path
) -> None:
    name, kind = model.names[index], model.joints[index].shortname().removeprefix("JointModel")
    if kind in UNALIGNED:
        axis, letter = np.array(model.joints[index].extract().axis), UNALIGNED[kind]
    elif kind in AXES:
        axis, letter = np.array(AXES[kind], dtype=float), kind[0]
    else:
        raise InputError(
            f"joint type {kind!r} is not supported",
            file=file,
            place=f"joint {name}",
            remedy="Give every body at most one joint, a hinge or a slide, and only the base a free joint",
        )
    position = model.joints[index].idx_q
    bounds = np.array([model.lowerPositionLimit[position], model.upperPositionLimit[position]])
    bounded = bool(np.isfinite(bounds).all())
    if letter == "P":
        bounds = scale * bounds if bounded else np.array([-BOUNDLESS, BOUNDLESS])
    kinds = {"P": "prismatic", "R": "revolute" if bounded else "continuous"}
    joint = ET.SubElement(robot, "joint", name=name, type=kinds[letter])
    _place(joint, model.jointPlacements[index], links[model.parents[index]], links[index])
    ET.SubElement(joint, "axis", xyz=_text(axis))
    if kinds[letter] != "continuous":
        lower, upper = (f"{value:.17g}" for value in bounds)
        ET.SubElement(joint, "limit", lower=lower, upper=upper, effort=f"{BOUNDLESS}", velocity=f"{BOUNDLESS}")


def _place(joint: ET.Element, placement: pin.SE3, parent: str, child: str) -> None:
    ET.SubElement(joint, "origin", xyz=_text(placement.translation), rpy=_text(pin.rpy.matrixToRpy(placement.rotation)))
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)


def _text(values: np.ndarray) -> str:
    return " ".join(f"{value:.17g}" for value in values)
