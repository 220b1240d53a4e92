"""The robot: a tree of rigid links on a free-flying base, read from and written to URDF through Pinocchio."""

from __future__ import annotations

import os
import sys
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pinocchio as pin

from bayesid._io.errors import InputError
from bayesid._io.files import write_text
from bayesid._io.short_form import ShortForm, Summary
from bayesid._math.arrays import Floats
from bayesid.robot.body_prior import draw_inertial
from bayesid.robot.inertial_parameters import InertialParameters
from bayesid.robot.mjcf import urdf_of_mjcf
from bayesid.robot.urdf_tree import BOUNDLESS, prepared_urdf, write_inertial, xml_root
from bayesid.robot.wheel import Wheel

__all__ = ["Joint", "Link", "Load", "Robot"]


@dataclass(frozen=True)
class Joint:
    """A moving joint with its limits of position [rad, m] and of speed [rad/s, m/s]."""

    name: str
    kind: str
    lower: float
    upper: float
    velocity: float

    @property
    def unit(self) -> str:
        """Unit of the joint's position."""
        return "m" if self.kind == "prismatic" else "rad"


@dataclass(frozen=True)
class Link:
    """A rigid body: its inertial parameters in the link's axes, and the placement of these axes.

    Parameters
    ----------
    inertial : InertialParameters
    joint : int
        Index into `Robot.joints` of the last moving joint between the base and the link; -1 for the base.
    placement : (4, 4) array
        Pose of the link's axes in that joint's axes.
    """

    inertial: InertialParameters
    joint: int
    placement: Floats


@dataclass(frozen=True)
class Load:
    """A rigid body fixed to a link and not part of the URDF; its parameters are in the link's axes."""

    name: str
    link: str
    inertial: InertialParameters


@dataclass(frozen=True, repr=False)
class Robot(ShortForm):
    """A free-flying robot.

    Build one with `Robot.from_urdf`; every change returns a new robot.
    """

    name: str
    file: Path | None
    urdf: str
    links: Mapping[str, Link]  #: bodies that may have mass, loads included, with the base first
    joints: tuple[Joint, ...]  #: moving joints in Pinocchio's order
    loads: tuple[str, ...]
    #: Kinematic tree with a free-flyer base and no gravity. Its inertias are those of the URDF; the present parameters
    #: are those in `links`.
    model: pin.Model
    remarks: tuple[str, ...] = ()  #: what the file left open or got wrong, and how it was read
    wheels: tuple[Wheel, ...] = ()  #: reaction wheels whose speed is recorded; at rest they are part of the base

    def summary(self) -> Summary:
        """Return base, joints and mass."""
        joints = ", ".join(joint.name for joint in self.joints) or "none"
        return Summary([f"{self.name}: base {self.base}, joints {joints}, {self.mass:.6g} kg.", *self.remarks])

    def __getstate__(self) -> dict[str, Any]:
        """Return the content for another process, to which a read-only mapping cannot be sent."""
        return {**self.__dict__, "links": dict(self.links)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Take the content over."""
        self.__dict__.update(state, links=MappingProxyType(state["links"]))

    @classmethod
    def from_urdf(cls, file: str | Path, *, nearest_physical: bool = False) -> Robot:
        """Read a robot from a URDF, or from an MJCF, which MuJoCo compiles; the root link is the base body.

        Parameters
        ----------
        file : path
        nearest_physical : bool
            Whether an unphysical link inertia is replaced by the nearest physical one, with a remark.

        Raises
        ------
        InputError
            If the file cannot be read or has another format, a joint type is not supported or a link is not a physical
            body.
        """
        path = Path(file)
        if not path.is_file():
            raise InputError("no such file", file=path, remedy="Correct the path of the URDF")
        text: str | bytes = path.read_bytes()
        root = xml_root(text, path)
        if root.tag == "sdf":
            problem = "this is SDF, which the installed Pinocchio does not read"
            raise InputError(problem, file=path, remedy="Convert it to URDF or MJCF")
        if root.tag == "mujoco":
            text = urdf_of_mjcf(path)
        elif root.tag == "mujocoinclude":
            raise InputError("this is a part of an MJCF", file=path, remedy="Give the file that includes it")
        elif root.tag != "robot":
            remedy = "Give a URDF, whose root is <robot>, or an MJCF, whose root is <mujoco>"
            raise InputError(f"the root element is <{root.tag}>", file=path, remedy=remedy)
        return cls.from_string(text, file=path, nearest_physical=nearest_physical)

    @classmethod
    def shipped(cls, name: str) -> Robot:
        """Return a built-in robot by its name, ``"ets7"`` or ``"planar"``."""
        folder = files("bayesid.robot") / "models"
        known = sorted(Path(str(entry)).stem for entry in folder.iterdir() if str(entry).endswith(".urdf"))
        if name not in known:
            raise InputError(f"no built-in robot {name!r}", remedy=f"Choose one of {', '.join(known)}")
        return cls.from_urdf(Path(str(folder / f"{name}.urdf")))

    @classmethod
    def from_string(cls, urdf: str | bytes, file: Path | None = None, *, nearest_physical: bool = False) -> Robot:
        """Read a robot from the text of a URDF.

        Parameters
        ----------
        urdf : str or bytes
        file : Path, optional
            File that error messages name.
        nearest_physical : bool
            As in `from_urdf`.
        """
        root = xml_root(urdf, file)
        inertials, remarks = prepared_urdf(root, file, take_nearest=nearest_physical)
        text = ET.tostring(root, encoding="unicode")
        model = _built(text, root, file)
        model.gravity.setZero()
        links = {}
        for frame in model.frames:
            if frame.type == pin.FrameType.BODY:
                links[frame.name] = Link(inertials[frame.name], frame.parentJoint - 2, frame.placement.homogeneous)
        return cls(
            name=root.get("name", "robot"),
            file=file,
            urdf=text,
            links=MappingProxyType(links),
            joints=tuple(_joint(model, index, root) for index in range(2, model.njoints)),
            loads=(),
            model=model,
            remarks=tuple(remarks),
        )

    @property
    def base(self) -> str:
        """Name of the base body."""
        return next(iter(self.links))

    @property
    def mass(self) -> float:
        """Mass of the whole system [kg]."""
        return sum(link.inertial.mass for link in self.links.values())

    def link(self, name: str) -> Link:
        """Return a link or load by name.

        Raises
        ------
        InputError
            If the robot has no link or load of that name.
        """
        if name not in self.links:
            raise InputError(
                f"no link or load named {name!r}", file=self.file, remedy=f"Choose one of {', '.join(self.links)}"
            )
        return self.links[name]

    def chain(self, joint: int) -> list[int]:
        """Return a joint and those between it and the base, outermost first; none for the base itself (-1)."""
        chain = []
        while joint >= 0:
            chain.append(joint)
            joint = self.model.parents[joint + 2] - 2
        return chain

    def with_inertial(self, name: str, inertial: InertialParameters) -> Robot:
        """Return the robot with other inertial parameters of one link or load.

        Parameters
        ----------
        name : str
            Link or load.
        inertial : InertialParameters
        """
        links = dict(self.links)
        links[name] = replace(self.link(name), inertial=inertial)
        return replace(self, links=MappingProxyType(links))

    def with_load(self, load: Load) -> Robot:
        """Return the robot with a rigid body fixed to a link."""
        if load.name in self.links:
            raise InputError(
                f"the name {load.name!r} is already used by a link", file=self.file, remedy="Give the load another name"
            )
        carrier = self.link(load.link)
        links = {**self.links, load.name: Link(load.inertial, carrier.joint, carrier.placement)}
        return replace(self, links=MappingProxyType(links), loads=(*self.loads, load.name))

    def with_wheel(self, wheel: Wheel) -> Robot:
        """Return the robot with a reaction wheel, whose rotor at rest is part of the base already."""
        if wheel.name in [other.name for other in self.wheels]:
            raise InputError(f"two wheels are named {wheel.name!r}", remedy="Give each wheel a unique name")
        return replace(self, wheels=(*self.wheels, wheel))

    def wheel_index(self, name: str) -> int:
        """Return the index of a wheel in `wheels`."""
        names = [wheel.name for wheel in self.wheels]
        if name not in names:
            raise InputError(
                f"no wheel named {name!r}",
                remedy=f"Choose one of {', '.join(names)}" if names else "Describe the wheels under [[robot.wheels]]",
            )
        return names.index(name)

    def perturbed(self, name: str, relative: float, rng: np.random.Generator) -> Robot:
        """Return the robot with one link drawn from its log-Cholesky prior of the given relative width.

        Parameters
        ----------
        name : str
            Link or load.
        relative : float
            Standard deviation of the log-Cholesky coordinates.
        rng : numpy.random.Generator
        """
        return self.with_inertial(name, draw_inertial(self.link(name).inertial, relative, rng))

    def joint_index(self, name: str) -> int:
        """Return the index of a joint in `joints`."""
        names = [joint.name for joint in self.joints]
        if name not in names:
            raise InputError(
                f"no moving joint named {name!r}", file=self.file, remedy=f"Choose one of {', '.join(names)}"
            )
        return names.index(name)

    def to_urdf(self) -> str:
        """Return the URDF with the present inertial parameters, which every simulator can load.

        Loads become links on fixed joints, and inertial frames take the axes of their links.
        """
        root = ET.fromstring(self.urdf)
        for name, link in self.links.items():
            if name in self.loads:
                element = ET.SubElement(root, "link", name=name)
                joint = ET.SubElement(root, "joint", name=f"{name}_mount", type="fixed")
                ET.SubElement(joint, "parent", link=self._carrier(name))
                ET.SubElement(joint, "child", link=name)
            else:
                element = next(candidate for candidate in root.findall("link") if candidate.get("name") == name)
            write_inertial(element, link.inertial)
        ET.indent(root)
        return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"

    def write_urdf(self, file: str | Path) -> None:
        """Write the URDF with the present inertial parameters to a file, whole or not at all."""
        write_text(file, self.to_urdf())

    def _carrier(self, load: str) -> str:
        link = self.links[load]
        return next(
            name
            for name, other in self.links.items()
            if name not in self.loads and other.joint == link.joint and np.array_equal(other.placement, link.placement)
        )


def _built(urdf: str, root: ET.Element, file: Path | None) -> pin.Model:
    """Return Pinocchio's model; its parser says on the error stream alone what is wrong, which the error repeats.

    The free-flyer gets a name that no joint has: Pinocchio would hang a joint of the same name on the base.
    """
    taken, flyer = {joint.get("name") for joint in root.findall("joint")}, "free_flyer"
    while flyer in taken:
        flyer += "_"
    with tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") as said:
        sys.stderr.flush()
        stream = os.dup(2)
        os.dup2(said.fileno(), 2)
        try:
            return pin.buildModelFromXML(urdf, pin.JointModelFreeFlyer(), flyer)
        except Exception as error:
            said.seek(0)
            lines = [line.removeprefix("Error:").strip() for line in said if line.startswith("Error:")]
            problem = f"Pinocchio cannot read the robot: {lines[0] if lines else error}"
            raise InputError(problem, file=file, remedy="Correct the URDF") from error
        finally:
            os.dup2(stream, 2)
            os.close(stream)


def _joint(model: pin.Model, index: int, root: ET.Element) -> Joint:
    name = model.names[index]
    element = next(candidate for candidate in root.findall("joint") if candidate.get("name") == name)
    limit = element.find("limit")
    kind = element.get("type", "")

    def bound(key: str, sign: float) -> float:
        text = None if limit is None else limit.get(key)
        value = sign * BOUNDLESS if text is None else float(text)
        return value if abs(value) < BOUNDLESS else sign * np.inf

    bounded = kind != "continuous"
    return Joint(
        name=name,
        kind=kind,
        lower=bound("lower", -1.0) if bounded else -np.inf,
        upper=bound("upper", 1.0) if bounded else np.inf,
        velocity=bound("velocity", 1.0),
    )
