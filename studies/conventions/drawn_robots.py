"""Robots drawn at random: a base and an arm of two to seven joints, written as URDF files."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from studies.truth.bodies import ELEMENTS
from studies.truth.numerics import Array

__all__ = ["JOINTS", "write_robot"]

JOINTS = (2, 7)  # fewest and most joints
LIGHTEST, HEAVIEST = 150.0, 2000.0  # bases [kg]
ARM = (0.03, 0.25)  # mass of the arm relative to that of the base


def write_robot(file: Path, seed: int) -> Path:
    """Write a robot drawn from a seed; its joints are named joint1, joint2, ..., and all revolute."""
    draw = np.random.default_rng(seed)
    robot = ElementTree.Element("robot", name=f"drawn{seed}")
    base = float(np.exp(draw.uniform(np.log(LIGHTEST), np.log(HEAVIEST))))
    side = (base / 300.0) ** (1 / 3)  # edge of a cube as dense as a satellite
    _add_link(robot, "base_link", base, np.full(3, side), 0.15 * side, draw)
    count = int(draw.integers(JOINTS[0], JOINTS[1] + 1))
    masses = base * draw.uniform(*ARM) * draw.dirichlet(np.full(count, 4.0))
    parent, place = "base_link", 0.5 * side * draw.uniform(-1.0, 1.0, 3)
    for number, mass in enumerate(masses, 1):
        child, length = f"link{number}", float(side * draw.uniform(0.25, 0.6))
        joint = ElementTree.SubElement(robot, "joint", name=f"joint{number}", type="revolute")
        ElementTree.SubElement(joint, "parent", link=parent)
        ElementTree.SubElement(joint, "child", link=child)
        ElementTree.SubElement(joint, "origin", xyz=_text(place), rpy=_text(draw.uniform(-np.pi, np.pi, 3)))
        ElementTree.SubElement(joint, "axis", xyz="0 0 1")
        ElementTree.SubElement(joint, "limit", lower="-6.3", upper="6.3", effort="200", velocity="2")
        _add_link(robot, child, float(mass), length * np.array([1.0, 0.2, 0.2]), 0.4 * length, draw)
        parent, place = child, np.array([length, 0.0, 0.0])
    ElementTree.indent(robot)
    ElementTree.ElementTree(robot).write(file, xml_declaration=True, encoding="utf-8")
    return file


def _add_link(
    robot: ElementTree.Element, name: str, mass: float, edges: Array, offset: float, draw: np.random.Generator
) -> None:
    """Add a box, turned and with its centre of mass anywhere within an offset of each axis."""
    moments = mass / 12.0 * (np.sum(edges**2) - edges**2) * draw.uniform(0.9, 1.1)
    turn = Rotation.from_rotvec(0.3 * draw.standard_normal(3)).as_matrix()
    inertia = turn @ np.diag(moments) @ turn.T
    inertial = ElementTree.SubElement(ElementTree.SubElement(robot, "link", name=name), "inertial")
    ElementTree.SubElement(inertial, "origin", xyz=_text(offset * draw.uniform(-1.0, 1.0, 3)), rpy="0 0 0")
    ElementTree.SubElement(inertial, "mass", value=f"{mass:.9g}")
    ElementTree.SubElement(inertial, "inertia", {key: f"{inertia[at]:.9g}" for key, at in ELEMENTS.items()})


def _text(vector: Array) -> str:
    return " ".join(f"{x:.9g}" for x in vector)
