"""Wrong conventions of recordings as hypotheses: other axes, signs, orders, units and zeros than declared.

A family of mistakes is one class in one file, made known by `MistakeFamily.register`. Each of its members says what the
readings would be without the mistake; `find_conventions` weighs all of them by the balance of momentum.
"""

from bayesid.inference.conventions import (  # the families register themselves
    exchanged_joints,
    gravity_in_readings,
    joint_counting,
    quaternion_conventions,
    reading_units,
    sensor_axes,
    shifted_channels,
)
from bayesid.inference.conventions.convention_search import find_conventions, refuse_conventions
from bayesid.inference.conventions.mistake import Mistake, MistakeFamily, convention_families

__all__ = [
    "Mistake",
    "MistakeFamily",
    "convention_families",
    "exchanged_joints",
    "find_conventions",
    "gravity_in_readings",
    "joint_counting",
    "quaternion_conventions",
    "reading_units",
    "refuse_conventions",
    "sensor_axes",
    "shifted_channels",
]
