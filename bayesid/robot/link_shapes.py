"""Shapes of the links for pictures: the URDF's meshes where they are there, its primitives, else equivalent boxes."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import coal
import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from bayesid._math.arrays import Floats, Integers
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.robot import Robot

__all__ = ["LinkShape", "equivalent_box", "link_shapes"]

MOST = 4000  # largest number of triangles of a mesh; a finer one is drawn as its convex hull
ROUND = 24  # number of corners of a circle

CORNERS = np.array(np.meshgrid([-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0])).reshape(3, -1).T


@dataclass(frozen=True)
class LinkShape:
    """Surface of a part of a link.

    Attributes
    ----------
    link : str
        Name of the link or load.
    source : str
        ``"mesh"``, ``"primitive"`` of the URDF, or ``"box"`` of the same mass, centre of mass and inertia.
    triangles : (T, 3, 3) array
        Corners of the triangles in the axes of the link [m].
    """

    link: str
    source: str
    triangles: Floats


def equivalent_box(body: InertialParameters) -> Floats:
    """Return the corners, shape (8, 3), of the homogeneous box with the body's mass, centre of mass and inertia."""
    moment = 0.5 * np.trace(body.inertia) * np.eye(3) - body.inertia
    variances, axes = np.linalg.eigh(moment / body.mass)
    half = np.sqrt(3.0 * np.maximum(variances, 0.0))
    return body.com + (CORNERS * half) @ axes.T


def link_shapes(robot: Robot) -> list[LinkShape]:
    """Return the shapes of all links: visual ones, else those of collisions, else the box of the same inertia."""
    root = ET.fromstring(robot.urdf)
    elements = {element.get("name", ""): element for element in root.findall("link")}
    shapes = []
    for name, link in robot.links.items():
        drawn: list[LinkShape] = []
        for tag in ("visual", "collision"):
            for element in elements[name].findall(tag) if name in elements and not drawn else ():
                drawn += _of_element(element, name, robot.file)
        if not drawn and link.inertial.mass > 0.0:
            drawn = [LinkShape(name, "box", _hull(equivalent_box(link.inertial)))]
        shapes += drawn
    return shapes


def _of_element(element: ET.Element, name: str, file: Path | None) -> Iterator[LinkShape]:
    """Yield the shape of one ``<visual>`` or ``<collision>``, unless its mesh is not there."""
    origin, geometry = element.find("origin"), element.find("geometry")
    xyz, rpy = (_numbers(None if origin is None else origin.get(key), 3) for key in ("xyz", "rpy"))
    for shape in () if geometry is None else geometry:
        source = "mesh" if shape.tag == "mesh" else "primitive"
        triangles = _mesh(shape, file) if source == "mesh" else _primitive(shape)
        if triangles is not None:
            yield LinkShape(name, source, triangles @ Rotation.from_euler("xyz", rpy).as_matrix().T + xyz)


def _numbers(text: str | None, count: int, default: float = 0.0) -> Floats:
    values = np.array([float(word) for word in (text or "").split()])
    return values if values.size == count else np.full(count, default)


def _primitive(shape: ET.Element) -> Floats | None:
    radius, length = (float(shape.get(key, "0")) for key in ("radius", "length"))
    angle = np.linspace(0.0, 2.0 * np.pi, ROUND, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    match shape.tag:
        case "box":
            return _hull(0.5 * CORNERS * _numbers(shape.get("size"), 3, 1.0))
        case "cylinder":
            return _hull(np.concatenate([radius * circle + [0.0, 0.0, end] for end in (-0.5 * length, 0.5 * length)]))
        case "sphere":
            up = np.linspace(-1.0, 1.0, ROUND // 2)
            rings = [np.sqrt(1.0 - height**2) * circle + [0.0, 0.0, height] for height in up[1:-1]]
            return _hull(radius * np.concatenate([*rings, [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]]))
        case _:
            return None


def _mesh(shape: ET.Element, file: Path | None) -> Floats | None:
    path = _path(shape.get("filename", ""), file)
    if path is None:
        return None
    try:
        loaded = coal.MeshLoader().load(str(path), _numbers(shape.get("scale"), 3, 1.0))
    except (RuntimeError, ValueError):  # a format that the library does not read
        return None
    vertices = np.asarray(loaded.vertices())
    if loaded.num_tris > MOST:
        return _hull(vertices)
    corners = [loaded.tri_indices(index) for index in range(loaded.num_tris)]
    return vertices[np.array([[corner[0], corner[1], corner[2]] for corner in corners], dtype=int)]


def _path(name: str, file: Path | None) -> Path | None:
    """Return the file of a mesh; a ROS package is looked for above the URDF and in ROS_PACKAGE_PATH."""
    folder = Path() if file is None else file.resolve().parent
    scheme, _, rest = name.rpartition("://")
    places = [folder / rest]
    if scheme in ("package", "model"):
        known = [Path(entry) for entry in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if entry]
        places = [above / rest for above in (folder, *folder.parents, *known)]
        places += [above / rest.partition("/")[2] for above in (folder, *folder.parents)]
    return next((place for place in places if place.is_file()), None)


def _hull(points: Floats) -> Floats:
    """Return the triangles of the convex hull of points; none of flat ones."""
    if np.linalg.matrix_rank(points - points.mean(axis=0), tol=1e-12) < 3:
        return np.zeros((0, 3, 3))
    corners: Integers = ConvexHull(points, qhull_options="QJ").simplices
    return points[corners]
