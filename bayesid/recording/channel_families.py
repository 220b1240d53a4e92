"""Families of columns that a recording may hold, one column per joint or one per axis."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from bayesid._io.errors import InputError

__all__ = ["JOINT_FAMILIES", "VECTOR_FAMILIES", "declare_family"]

JOINT_FAMILIES = ("position", "velocity", "acceleration", "torque")
"""Families with one column per joint, such as ``position.<joint>`` [rad, m]; torques are in N m, forces in N."""

_VECTOR_FAMILIES = {
    "rate": ("x", "y", "z"),
    "accel": ("x", "y", "z"),
    "attitude": ("x", "y", "z", "w"),
    "base_force": ("x", "y", "z"),
    "base_torque": ("x", "y", "z"),
    "wheel_momentum": ("x", "y", "z"),
}
VECTOR_FAMILIES: Mapping[str, tuple[str, ...]] = MappingProxyType(_VECTOR_FAMILIES)
"""Families with one column per axis, all of them or none: [rad/s], [m/s2], [1], [N], [N m], [N m s]."""


def declare_family(name: str, axes: tuple[str, ...]) -> None:
    """Make columns ``name.axis`` known to recordings, for a sensor that the package lacks.

    Raises
    ------
    InputError
        If the name is taken by columns with other axes.
    """
    if name in JOINT_FAMILIES or _VECTOR_FAMILIES.get(name, axes) != axes:
        raise InputError(f"columns {name!r} exist with another meaning", remedy="Give the sensor another name")
    _VECTOR_FAMILIES[name] = axes
