"""Rigid bodies, and robots read from URDF files by the simulators themselves, without the package."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from studies.truth.numerics import Array


class Body(NamedTuple):
    """Inertial parameters: mass [kg], centre of mass [m], inertia about it [kg m2], in the link's axes."""

    mass: float
    com: Array
    inertia: Array

    @property
    def quantities(self) -> Array:
        """Mass, centre of mass, inertia about it as xx, yy, zz, xy, xz, yz; shape (10,)."""
        tensor = self.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        return np.concatenate([[self.mass], self.com, tensor])

    def inertia_about(self, point: Array) -> Array:
        """Inertia about a point [kg m2], in the same axes."""
        d = self.com - point
        return self.inertia + self.mass * (d @ d * np.eye(3) - np.outer(d, d))


def join(*bodies: Body) -> Body:
    """Rigid union of bodies that are given in the same axes."""
    mass = sum(body.mass for body in bodies)
    com = np.sum([body.mass * body.com for body in bodies], axis=0) / mass
    return Body(mass, com, np.sum([body.inertia_about(com) for body in bodies], axis=0))


def wrong_guess(body: Body, generator: np.random.Generator, spread: float = 0.1) -> Body:
    """Physical body that is wrong by about twice `spread` in mass and moments, never near the given one."""
    change = generator.choice([-1.0, 1.0], (4, 4)) * generator.uniform(0.5, 1.5, (4, 4)) * spread
    return _with_factor_changed(body, expm(np.triu(change)))


def nearby(body: Body, generator: np.random.Generator, spread: float) -> Body:
    """Physical body from the log-Cholesky prior of relative width `spread` about the given one."""
    scale, *diagonal = np.exp(spread * generator.standard_normal(4))
    upper = np.diag([*diagonal, 1.0]) + np.triu(spread * generator.standard_normal((4, 4)), 1)
    return _with_factor_changed(body, scale * upper)


def _with_factor_changed(body: Body, change: Array) -> Body:
    """Multiply the upper Cholesky factor of the body's pseudo-inertia by an upper triangular matrix."""
    second = 0.5 * np.trace(body.inertia) * np.eye(3) - body.inertia + body.mass * np.outer(body.com, body.com)
    first = body.mass * body.com
    pseudo = np.block([[second, first[:, None]], [first[None], np.array([[body.mass]])]])
    factor = np.linalg.cholesky(pseudo[::-1, ::-1])[::-1, ::-1] @ change
    pseudo = factor @ factor.T
    mass, com = pseudo[3, 3], pseudo[:3, 3] / pseudo[3, 3]
    second = pseudo[:3, :3] - mass * np.outer(com, com)
    return Body(mass, com, np.trace(second) * np.eye(3) - second)


ROBOTS = Path(__file__).resolve().parent / "robots"
SERVICER3, SERVICER4, BRANCHED = (ROBOTS / f"{name}.urdf" for name in ("servicer3", "servicer4", "branched"))

# names of the inertia's elements in a URDF, and where they stand in the matrix
ELEMENTS = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}


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


class Joint(NamedTuple):
    """A joint of a URDF, with its place (offset [m] and rotation) and its axis in the frame of the link before it."""

    name: str
    kind: str
    parent: str
    child: str
    offset: Array
    rotation: Array
    axis: Array


class Description(NamedTuple):
    """A robot as its URDF has it: base, links, inertial parameters of those that have any, joints in their order."""

    base: str
    links: tuple[str, ...]
    bodies: dict[str, Body]
    joints: tuple[Joint, ...]

    @property
    def moving(self) -> list[Joint]:
        """Joints that are not fixed, in the order of the URDF: the order of all joint vectors here."""
        return [joint for joint in self.joints if joint.kind != "fixed"]


def read_urdf(urdf: str | Path) -> Description:
    """Read a robot; its base is the link that hangs on no joint."""
    tree = ElementTree.parse(urdf).getroot()
    bodies = {attribute(link, "name"): read_body(link) for link in tree.iterfind("link")}
    joints = tuple(_joint(element) for element in tree.iterfind("joint"))
    base = next(name for name in bodies if name not in {joint.child for joint in joints})
    return Description(base, tuple(bodies), {n: body for n, body in bodies.items() if body is not None}, joints)


def _joint(element: ElementTree.Element) -> Joint:
    origin = element.find("origin")
    return Joint(
        attribute(element, "name"),
        attribute(element, "type"),
        attribute(part(element, "parent"), "link"),
        attribute(part(element, "child"), "link"),
        numbers(origin, "xyz"),
        rotation_from_rpy(numbers(origin, "rpy")),
        numbers(element.find("axis"), "xyz", "1 0 0"),
    )


def link_body(urdf: str | Path, name: str) -> Body:
    """Inertial parameters of a link as its URDF has them."""
    return read_urdf(urdf).bodies[name]


def moving_joints(urdf: str | Path) -> tuple[str, ...]:
    """Names of the joints that are not fixed, in the order of the URDF."""
    return tuple(joint.name for joint in read_urdf(urdf).moving)


def write_urdf(source: str | Path, target: str | Path, base: Body) -> None:
    """Copy a URDF with another base body."""
    tree, name = ElementTree.parse(source), read_urdf(source).base
    root = next(link for link in tree.getroot().iterfind("link") if link.get("name") == name)
    root.remove(part(root, "inertial"))
    inertial = ElementTree.SubElement(root, "inertial")
    ElementTree.SubElement(inertial, "origin", xyz=" ".join(f"{x:.15g}" for x in base.com), rpy="0 0 0")
    ElementTree.SubElement(inertial, "mass", value=f"{base.mass:.15g}")
    ElementTree.SubElement(inertial, "inertia", {key: f"{base.inertia[at]:.15g}" for key, at in ELEMENTS.items()})
    tree.write(target, xml_declaration=True, encoding="utf-8")
