"""Random robots: trees of links on revolute, continuous, prismatic and fixed joints, with loads."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.robot import Load, Robot

BODY = '<inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
LIMIT = '<limit lower="-3" upper="3" effort="1" velocity="1"/>'


def random_body(rng: np.random.Generator) -> InertialParameters:
    """A physical body: a cloud of equal points."""
    points, mass = 0.2 * rng.normal(size=(8, 3)) + 0.3 * rng.normal(size=3), rng.uniform(1.0, 10.0)
    com = points.mean(axis=0)
    second = mass * np.cov(points.T, bias=True)
    return InertialParameters(mass, com, np.trace(second) * np.eye(3) - second)


def random_tree(kinds: Sequence[str], rng: np.random.Generator, *, loads: int = 0, chain: bool = False) -> Robot:
    """A robot with one joint of each kind in turn, on random earlier links (or always the last), and loads likewise."""
    parts = [f'<link name="body">{BODY}</link>']
    for index, kind in enumerate(kinds):
        parent = index if chain else int(rng.integers(index + 1))
        axis, place, turn = (" ".join(f"{value:.17g}" for value in rng.normal(size=3)) for _ in range(3))
        parts.append(
            f'<link name="link{index + 1}">{BODY}</link><joint name="joint{index + 1}" type="{kind}">'
            f'<parent link="{"body" if parent == 0 else f"link{parent}"}"/><child link="link{index + 1}"/>'
            f'<origin xyz="{place}" rpy="{turn}"/><axis xyz="{axis}"/>{LIMIT}</joint>'
        )
    robot = Robot.from_string(f'<robot name="tree">{"".join(parts)}</robot>')
    links = list(robot.links)
    for name in links:
        robot = robot.with_inertial(name, random_body(rng))
    for index in range(loads):
        robot = robot.with_load(Load(f"load{index + 1}", str(rng.choice(links)), random_body(rng)))
    return robot
