"""The tree of a URDF as people write it, checked and brought to the form that Pinocchio reads as it is meant.

What a file means is kept: a root link without inertia (the convention of ROS) takes the inertia of the first body
rigidly joined to it, a link ``world`` goes, limits that an exporter left at zero count as not given, and inertias that
are physical within the digits given become so. What would be read wrongly is refused: unexpanded xacro, axes of length
zero, loops, joints that are neither revolute nor prismatic.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterator, Mapping
from decimal import Decimal, InvalidOperation
from pathlib import Path

import numpy as np
import pinocchio as pin

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.robot.inertial_parameters import InertialParameters, nearest_physical

__all__ = ["BOUNDLESS", "MOVING", "prepared_urdf", "write_inertial", "xml_root"]

MOVING = ("revolute", "continuous", "prismatic")
"""Joint types of a URDF that move."""

BOUNDLESS = 1e9
"""Limit of a joint that has none [rad, m, rad/s, m/s], since a URDF demands a number."""

SOME = 0.01  # largest correction of an inertia, relative to its largest entry, that its digits may excuse
# places of a URDF's products and moments of inertia in the tensor
ENTRIES = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}


def xml_root(data: str | bytes, file: Path | None) -> ET.Element:
    """Parse XML, in the encoding that it declares, and drop the namespaces of its elements.

    Parameters
    ----------
    data : str or bytes
    file : Path or None
        Named in errors.

    Raises
    ------
    InputError
        If it is not well-formed, or an unexpanded xacro.
    """
    try:
        root = ET.fromstring(data.encode() if isinstance(data, str) else data)
    except (ET.ParseError, LookupError, ValueError) as error:
        raise InputError(f"not well-formed XML: {error}", file=file, remedy="Correct the file") from error
    for element in root.iter():
        if isinstance(element.tag, str):
            _refuse_xacro(element, file)
            element.tag = element.tag.rpartition("}")[2]
    return root


def _refuse_xacro(element: ET.Element, file: Path | None) -> None:
    """Refuse macros and expressions of xacro, of which Pinocchio would leave out the bodies without a word."""
    space, _, plain = element.tag.rpartition("}")
    used = f"<xacro:{plain}>" if "xacro" in space else None
    used = used or next((f'{key}="{text}"' for key, text in element.items() if "${" in text or "$(" in text), None)
    if used:
        source = file.name if file else "FILE"
        problem = f"this is an unexpanded xacro: it contains {used}"
        raise InputError(problem, file=file, remedy=f"Expand it first: xacro {source} > robot.urdf")


def prepared_urdf(
    root: ET.Element, file: Path | None, *, take_nearest: bool = False
) -> tuple[dict[str, InertialParameters], list[str]]:
    """Check the tree of a URDF and change it in place to what it means.

    Parameters
    ----------
    root : Element
        Element ``<robot>``, without namespaces (`xml_root`).
    file : Path or None
        Named in errors.
    take_nearest : bool
        Whether links that are no physical bodies take the nearest physical inertia.

    Returns
    -------
    inertials : dict of str to InertialParameters
        Of every link, in its axes; zero mass for those without.
    remarks : list of str
        What was changed, a sentence each.

    Raises
    ------
    InputError
        If the file holds something else than a tree of physical links on supported joints.
    """
    remarks: list[str] = []
    _check_joints(root, file)
    _without_world(root, file, remarks)
    base = _tree_root(root, file)
    _open_limits(root, remarks)
    inertials = _physical_inertials(root, file, take_nearest, remarks)
    if inertials[base].mass <= 0.0:
        _take_inertia_of_rigid_body(root, base, inertials, file, remarks)
    _remark_on_massless_bodies(root, inertials, remarks)
    for link in root.findall("link"):
        write_inertial(link, inertials[link.get("name", "")])
    return inertials, remarks


def _joints(root: ET.Element) -> Iterator[tuple[ET.Element, str, str]]:
    """Yield every joint with the names of its parent and child links."""
    for joint in root.findall("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        yield (
            joint,
            "" if parent is None else parent.get("link", ""),
            "" if child is None else child.get("link", ""),
        )


def _check_joints(root: ET.Element, file: Path | None) -> None:
    names = {link.get("name", "") for link in root.findall("link")}
    for joint, *ends in _joints(root):
        place, kind = f"joint {joint.get('name', '')}", joint.get("type", "")
        for end, link in zip(("parent", "child"), ends, strict=True):
            if link not in names:
                problem = f"its {end}, the link {link!r}, is not in the file" if link else f"it has no {end}"
                raise InputError(problem, file=file, place=place, remedy="Correct the name of the link")
        if kind not in (*MOVING, "fixed", "floating"):
            remedy = f"Use one of {', '.join(MOVING)} or fixed"
            raise InputError(f"joint type {kind!r} is not supported", file=file, place=place, remedy=remedy)
        if joint.find("mimic") is not None:
            remedy = "Remove its <mimic> and record it, or make it fixed"
            raise InputError("mimic joints are not supported", file=file, place=place, remedy=remedy)
        axis = joint.find("axis")
        if kind in MOVING and axis is not None:
            direction = _triple(axis, "xyz", "1 0 0", file, place)
            if not np.linalg.norm(direction) > 1e-9:
                raise InputError(
                    f'its axis has no direction: xyz="{axis.get("xyz", "")}"',
                    file=file,
                    place=place,
                    remedy="Give the axis of rotation or translation, in the joint's frame",
                )
        _pose(joint, file, place)


def _without_world(root: ET.Element, file: Path | None, remarks: list[str]) -> None:
    """Remove links without mass that only hold the robot: ``world``, or the parent of a floating joint."""
    while True:
        children = [child for _, _, child in _joints(root)]
        tops = [link for link in root.findall("link") if link.get("name", "") not in children]
        hung = [joint for joint, parent, _ in _joints(root) if tops and parent == tops[0].get("name", "")]
        if len(tops) != 1 or len(hung) != 1 or tops[0].find("inertial") is not None:
            break
        kind, name = hung[0].get("type"), tops[0].get("name", "")
        if kind != "floating" and not (kind == "fixed" and name == "world"):
            break
        root.remove(tops[0])
        root.remove(hung[0])
        remarks.append(f"The link {name} and its {kind} joint are omitted, because the robot flies freely.")
    for joint, _, child in _joints(root):
        if joint.get("type") == "floating":
            problem = f"joint type 'floating' is supported only below a root link without mass; its child is {child!r}"
            remedy = f"Use one of {', '.join(MOVING)} or fixed; the base needs no joint, since it flies freely"
            raise InputError(problem, file=file, place=f"joint {joint.get('name', '')}", remedy=remedy)


def _tree_root(root: ET.Element, file: Path | None) -> str:
    """Return the name of the root link, and refuse what is not a tree."""
    names = [link.get("name", "") for link in root.findall("link")]
    for kind, given in (("links", names), ("joints", [joint.get("name", "") for joint in root.findall("joint")])):
        doubled = [name for name, count in Counter(given).items() if count > 1]
        if doubled:
            problem = f"several {kind} share one name: {', '.join(map(repr, doubled))}"
            raise InputError(problem, file=file, remedy="Give each a unique name")
    holders: dict[str, list[str]] = {}
    for joint, parent, child in _joints(root):
        holders.setdefault(child, []).append(f"{parent} (joint {joint.get('name', '')})")
    for child, held_by in holders.items():
        if len(held_by) > 1:
            raise InputError(
                f"it has {len(held_by)} parents, {' and '.join(held_by)}, which closes a loop",
                file=file,
                place=f"link {child}",
                remedy="Closed chains are not supported: cut the loop by omitting one of the joints",
            )
    tops = [name for name in names if name not in holders]
    if not names or not tops:
        problem = "the links form a loop without a root" if names else "it contains no link"
        raise InputError(problem, file=file, remedy="Give a tree of links, whose root is the base body")
    if len(tops) > 1:
        remedy = "Give one tree of links, whose root is the base body: join the others to it or remove them"
        raise InputError(f"{len(tops)} links have no parent: {', '.join(tops)}", file=file, remedy=remedy)
    reached, front = {tops[0]}, [tops[0]]
    while front:
        front = [child for _, parent, child in _joints(root) if parent in front]
        reached.update(front)
    if len(reached) < len(names):
        apart = ", ".join(name for name in names if name not in reached)
        raise InputError(f"links form a loop: {apart}", file=file, remedy="Closed chains are not supported")
    return tops[0]


def _open_limits(root: ET.Element, remarks: list[str]) -> None:
    """Replace limits that are zero, as exporters write what nobody entered, or absent, by none."""
    opened = []
    for joint in root.findall("joint"):
        if joint.get("type") not in MOVING:
            continue
        limit = joint.find("limit")
        if limit is None:
            limit = ET.SubElement(joint, "limit")
        if joint.get("type") != "continuous" and _zero(limit, "lower") and _zero(limit, "upper"):
            if limit.get("lower") or limit.get("upper"):
                opened.append(f"{joint.get('name')}: range 0 to 0")
            limit.set("lower", f"{-BOUNDLESS:g}")
            limit.set("upper", f"{BOUNDLESS:g}")
        if _zero(limit, "velocity"):
            if limit.get("velocity"):
                opened.append(f"{joint.get('name')}: velocity 0")
            limit.set("velocity", f"{BOUNDLESS:g}")
        limit.set("effort", limit.get("effort") or f"{BOUNDLESS:g}")
    if opened:
        remarks.append(f"Limits of zero are treated as not given ({'; '.join(opened)}).")


def _zero(limit: ET.Element, key: str) -> bool:
    try:
        return float(limit.get(key) or 0.0) == 0.0
    except ValueError:
        return False


def _physical_inertials(
    root: ET.Element, file: Path | None, take_nearest: bool, remarks: list[str]
) -> dict[str, InertialParameters]:
    inertials: dict[str, InertialParameters] = {}
    refused = []
    for link in root.findall("link"):
        name = link.get("name", "")
        place = f"link {name}"
        mass, com, tensor, digits = _given_inertial(link, file, place)
        try:
            inertials[name] = InertialParameters(mass, com, tensor)
            continue
        except InputError as error:
            problem = error
        if not (mass >= 0.0 and np.isfinite([mass, *com, *tensor.flat]).all()):
            raise problem.within(file=file, place=place)
        if mass == 0.0:
            inertials[name] = InertialParameters(0.0, np.zeros(3), np.zeros((3, 3)))
            refused.append((f"{place}: {problem.problem}", "no inertia"))
            continue
        rounded = nearest_physical(tensor)
        if np.abs(rounded - tensor).max() <= digits:
            inertials[name] = InertialParameters(mass, com, rounded)
            continue
        nearest = nearest_physical(tensor, margin=1e-3)
        entries = " ".join(f'{key}="{nearest[index]:.5g}"' for key, index in ENTRIES.items())
        inertials[name] = InertialParameters(mass, com, nearest)
        refused.append((f"{place}: {problem.problem}", entries))
    if refused and take_nearest:
        remarks += [
            f"{text[0].upper()}{text[1:]}. The nearest physical inertia is used: {entries}."
            for text, entries in refused
        ]
    elif refused:
        raise InputError(
            "; ".join(f"{text} (nearest physical inertia in the link's axes: {entries})" for text, entries in refused),
            file=file,
            remedy="Correct the inertias, or use the nearest physical ones: nearest_physical = true in [robot] of the "
            "study, or bayesid init --nearest-physical",
        )
    return inertials


def _given_inertial(link: ET.Element, file: Path | None, place: str) -> tuple[float, Floats, Floats, float]:
    """Return mass, centre of mass, inertia about it in the link's axes, and how far its digits leave that open."""
    element = link.find("inertial")
    if element is None:
        return 0.0, np.zeros(3), np.zeros((3, 3)), 0.0
    mass, tensor = element.find("mass"), element.find("inertia")
    if mass is None or tensor is None:
        problem = "<inertial> lacks its <mass> or <inertia>"
        raise InputError(problem, file=file, place=place, remedy="Give both, or omit <inertial>")
    rotation, com = _pose(element, file, place)
    matrix, halves = np.zeros((3, 3)), np.zeros((3, 3))
    try:
        weight = float(mass.get("value", "nan"))
        for key, (row, column) in ENTRIES.items():
            text = tensor.get(key, "0").strip()
            matrix[row, column] = matrix[column, row] = float(text)
            halves[row, column] = halves[column, row] = _half_unit(text)
    except (ValueError, InvalidOperation) as error:
        remedy = "Give mass and inertia as numbers"
        raise InputError(f"unreadable <inertial>: {error}", file=file, place=place, remedy=remedy) from None
    # Rounding moves the second moments tr(I) / 2 - I by at most this Frobenius norm, and the projection onto physical
    # bodies, which is no expansion, moves them back by no more: no entry of the inertia by more than root two of it.
    moved = np.sqrt(3.0 * (np.trace(halves) / 2.0) ** 2 + (halves**2).sum() - (np.diag(halves) ** 2).sum())
    left_open = min(float(np.sqrt(2.0) * moved), SOME * float(np.abs(matrix).max()))
    return weight, com, rotation @ matrix @ rotation.T, left_open


def _half_unit(text: str) -> float:
    """Return half a unit of the last digit of a number; none of a zero, which exporters write without digits."""
    number = Decimal(text)
    exponent = number.as_tuple().exponent
    return 0.5 * 10.0**exponent if isinstance(exponent, int) and number != 0 else 0.0


def _triple(element: ET.Element, key: str, default: str, file: Path | None, place: str) -> Floats:
    text = element.get(key, default)
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        values = np.zeros(0)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise InputError(f'{key}="{text}" is not three numbers', file=file, place=place, remedy="Correct it")
    return values


def _pose(element: ET.Element, file: Path | None, place: str) -> tuple[Floats, Floats]:
    """Return rotation (3, 3) and translation (3,) of an element's ``<origin>``."""
    origin = element.find("origin")
    if origin is None:
        return np.eye(3), np.zeros(3)
    angles = _triple(origin, "rpy", "0 0 0", file, place)
    return pin.rpy.rpyToMatrix(angles), _triple(origin, "xyz", "0 0 0", file, place)


def _take_inertia_of_rigid_body(
    root: ET.Element,
    base: str,
    inertials: dict[str, InertialParameters],
    file: Path | None,
    remarks: list[str],
) -> None:
    """Give a base without mass the inertia of the first body rigidly joined to it, in the base's axes."""
    front = [(base, np.eye(3), np.zeros(3))]
    while front:
        name, rotation, position = front.pop(0)
        body = inertials[name]
        if body.mass > 0.0:
            inertials[base] = InertialParameters(
                body.mass, rotation @ body.com + position, rotation @ body.inertia @ rotation.T
            )
            inertials[name] = InertialParameters(0.0, np.zeros(3), np.zeros((3, 3)))
            remarks.append(
                f"The root link {base} has no inertia; that of {name}, which is rigidly attached to it, is used."
            )
            return
        for joint, parent, child in _joints(root):
            if parent == name and joint.get("type") == "fixed":
                turn, shift = _pose(joint, file, "")
                front.append((child, rotation @ turn, rotation @ shift + position))
    problem = "mass > 0 fails: neither the root link nor a link fixed to it has a mass"
    remedy = "The root link is the base body: give it its <inertial>"
    raise InputError(problem, file=file, place=f"link {base}", remedy=remedy)


def _remark_on_massless_bodies(
    root: ET.Element, inertials: Mapping[str, InertialParameters], remarks: list[str]
) -> None:
    """Say which joints move a body without mass: all links that are rigidly joined are one body."""
    fixed = [(parent, child) for joint, parent, child in _joints(root) if joint.get("type") == "fixed"]
    for joint, _, moved in _joints(root):
        if joint.get("type") in MOVING:
            body = [moved]
            for name in body:
                body += [child for parent, child in fixed if parent == name]
            if not any(inertials[name].mass > 0.0 for name in body):
                links = ", ".join(body)
                remarks.append(
                    f"Joint {joint.get('name', '')} moves a body without mass, since no <inertial> is given: {links}."
                )


def write_inertial(link: ET.Element, inertial: InertialParameters) -> None:
    """Write the inertia of a link, in the link's axes; a link without mass has none.

    Parameters
    ----------
    link : Element
        Element ``<link>``, changed in place.
    inertial : InertialParameters
    """
    present = link.find("inertial")
    if present is not None:
        link.remove(present)
    if inertial.mass == 0.0:
        return
    element = ET.SubElement(link, "inertial")
    ET.SubElement(element, "origin", xyz=" ".join(f"{value:.17g}" for value in inertial.com), rpy="0 0 0")
    ET.SubElement(element, "mass", value=f"{inertial.mass:.17g}")
    ET.SubElement(element, "inertia", {key: f"{inertial.inertia[index]:.17g}" for key, index in ENTRIES.items()})
