"""Refusal of what an MJCF may hold and Pinocchio reads otherwise than MuJoCo, or leaves out without a word."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from pathlib import Path

from bayesid._io.errors import InputError

__all__ = ["refuse_unread"]

FLATTEN = "Let MuJoCo write the model without it: mujoco.mj_saveLastXML after loading"

UNREAD = ("include", "frame", "replicate", "attach", "composite", "flexcomp")
"""Elements by which a file adds bodies that Pinocchio does not see."""

LOOPS = ("connect", "weld")
"""Constraints that close a loop of bodies. Coupled joints are no matter, since each is recorded."""


def refuse_unread(root: ET.Element, file: Path) -> None:
    """Refuse a file that Pinocchio does not read as MuJoCo does.

    Raises
    ------
    InputError
        If it includes or generates bodies, holds several trees of them or a loop, counts a joint from ``ref``, or gives
        a joint a class that does not inherit from that of its body.
    """
    for tag in UNREAD:
        if next(root.iter(tag), None) is not None:
            raise InputError(f"Pinocchio does not read <{tag}>", file=file, remedy=FLATTEN)
    trees = [body.get("name", "without a name") for body in root.iterfind("worldbody/body")]
    if len(trees) != 1:
        shown = f": {', '.join(trees)}" if trees else ""
        raise InputError(
            f"the world holds {len(trees)} bodies{shown}",
            file=file,
            place="worldbody",
            remedy="Leave one, the base of the robot",
        )
    for constraint in root.iterfind("equality/*"):
        if constraint.tag in LOOPS:
            raise InputError(
                f"the constraint <{constraint.tag}> is not supported",
                file=file,
                place="equality",
                remedy="Leave a tree of bodies",
            )
    for joint in root.iter("joint"):
        if joint.get("ref", "0").strip(" 0."):
            raise InputError(
                f"ref = {joint.get('ref')} is not supported",
                file=file,
                place=f"joint {joint.get('name', joint.get('class', ''))}".rstrip(),
                remedy="Count the joint's position from the pose in which the bodies are written",
            )
    for body in root.iterfind("worldbody/body"):
        _refuse_mixed_classes(body, body.get("childclass"), _lineages(root.findall("default")), file)


def _lineages(defaults: Sequence[ET.Element], above: tuple[str, ...] = ()) -> dict[str, tuple[str, ...]]:
    """Return the names of every class of defaults and of those that it inherits from."""
    found: dict[str, tuple[str, ...]] = {}
    for default in defaults:
        lineage = (default.get("class", "main"), *above)
        found |= {lineage[0]: lineage, **_lineages(default.findall("default"), lineage)}
    return found


def _refuse_mixed_classes(
    body: ET.Element, childclass: str | None, lineages: Mapping[str, tuple[str, ...]], file: Path
) -> None:
    """Refuse joints whose class does not inherit from that of the bodies: Pinocchio takes both, MuJoCo the first."""
    for joint in body.iterfind("joint"):
        own = joint.get("class")
        if own is not None and childclass is not None and childclass not in lineages.get(own, ()):
            raise InputError(
                f"the class {own!r} does not inherit from the childclass {childclass!r} of its body",
                file=file,
                place=f"joint {joint.get('name', '')}".rstrip(),
                remedy=FLATTEN,
            )
    for child in body.iterfind("body"):
        _refuse_mixed_classes(child, child.get("childclass", childclass), lineages, file)
