"""Robots read from URDF files by the simulators themselves, and a URDF written with another base body."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from studies.truth.bodies import Body
from studies.truth.numerics import Array

__all__ = ["BRANCHED", "ROBOTS", "SERVICER3", "SERVICER4", "attribute", "child_link", "link_bodies", "link_body"]
__all__ += ["moved_links", "moving", "moving_joints", "numbers", "parent_link", "part", "read_body", "root_link"]
__all__ += ["rotation_from_rpy", "write_urdf"]

ROBOTS = Path(__file__).resolve().parent / "robots"
SERVICER3, SERVICER4, BRANCHED = (ROBOTS / f"{name}.urdf" for name in ("servicer3", "servicer4", "branched"))

ELEMENTS = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
"""Names of the inertia's elements in a URDF, and where they stand in the matrix."""


def part(element: ElementTree.Element, tag: str) -> ElementTree.Element:
    """Part of an element that must be there."""
    inner = element.find(tag)
    if inner is None:
        raise ValueError(f"<{element.tag} name={element.get('name')!r}> has no <{tag}>; add one")
    return inner


def attribute(element: ElementTree.Element, name: str) -> str:
    """Attribute of an element that must be there."""
    text = element.get(name)
    if text is None:
        raise ValueError(f"<{element.tag}> has no attribute {name}; add it")
    return text


def numbers(element: ElementTree.Element | None, name: str, default: str = "0 0 0") -> Array:
    """Numbers of an attribute, with a default where the element or the attribute is left out."""
    text = default if element is None else element.get(name, default)
    return np.array([float(word) for word in text.split()])


def rotation_from_rpy(rpy: Sequence[float] | Array) -> Array:
    """Rotation matrix of URDF's roll, pitch, yaw about fixed axes."""
    return np.asarray(Rotation.from_euler("xyz", rpy).as_matrix())


def read_body(link: ElementTree.Element) -> Body | None:
    """Inertial parameters of a URDF link, in link axes; None where it has none."""
    inertial = link.find("inertial")
    if inertial is None:
        return None
    origin, inertia = inertial.find("origin"), part(inertial, "inertia")
    rotation, tensor = rotation_from_rpy(numbers(origin, "rpy")), np.zeros((3, 3))
    for name, (row, column) in ELEMENTS.items():
        tensor[row, column] = tensor[column, row] = float(attribute(inertia, name))
    mass = float(attribute(part(inertial, "mass"), "value"))
    return Body(mass, numbers(origin, "xyz"), rotation @ tensor @ rotation.T)


def link_bodies(urdf: ElementTree.Element) -> dict[str, Body]:
    """Inertial parameters of the links that have any, by name."""
    bodies = {attribute(link, "name"): read_body(link) for link in urdf.iterfind("link")}
    return {name: body for name, body in bodies.items() if body is not None}


def link_body(urdf: str | Path, name: str) -> Body:
    """Inertial parameters of a link as its URDF has them."""
    return link_bodies(ElementTree.parse(urdf).getroot())[name]


def parent_link(joint: ElementTree.Element) -> str:
    """Name of the link that carries a joint."""
    return attribute(part(joint, "parent"), "link")


def child_link(joint: ElementTree.Element) -> str:
    """Name of the link that hangs on a joint."""
    return attribute(part(joint, "child"), "link")


def root_link(urdf: ElementTree.Element) -> str:
    """Name of the link that hangs on no joint, the base."""
    children = {child_link(joint) for joint in urdf.iterfind("joint")}
    return next(name for link in urdf.iterfind("link") if (name := attribute(link, "name")) not in children)


def moving(urdf: ElementTree.Element) -> list[ElementTree.Element]:
    """Joints that are not fixed, in the order of the URDF."""
    return [joint for joint in urdf.iterfind("joint") if joint.get("type") != "fixed"]


def moving_joints(urdf: str | Path) -> tuple[str, ...]:
    """Names of the joints that are not fixed, in the order of the URDF: the order of all joint vectors here."""
    return tuple(attribute(joint, "name") for joint in moving(ElementTree.parse(urdf).getroot()))


def moved_links(urdf: ElementTree.Element) -> list[str]:
    """Links that hang on a moving joint; what is fixed on them is left out."""
    return [child_link(joint) for joint in moving(urdf)]


def write_urdf(source: str | Path, target: str | Path, base: Body) -> None:
    """Copy a URDF with another base body."""
    tree = ElementTree.parse(source)
    urdf = tree.getroot()
    name = root_link(urdf)
    root = next(link for link in urdf.iterfind("link") if link.get("name") == name)
    root.remove(part(root, "inertial"))
    inertial = ElementTree.SubElement(root, "inertial")
    ElementTree.SubElement(inertial, "origin", xyz=" ".join(f"{x:.15g}" for x in base.com), rpy="0 0 0")
    ElementTree.SubElement(inertial, "mass", value=f"{base.mass:.15g}")
    ElementTree.SubElement(inertial, "inertia", {key: f"{base.inertia[at]:.15g}" for key, at in ELEMENTS.items()})
    tree.write(target, xml_declaration=True, encoding="utf-8")
