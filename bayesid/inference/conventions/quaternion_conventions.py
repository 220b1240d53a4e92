"""Attitudes with the scalar first, inverse, or relative to other axes than those of the orbit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from bayesid._math.arrays import Floats
from bayesid.inference.conventions.mistake import Mistake, MistakeFamily
from bayesid.inference.conventions.readings_on_grid import ReadingsOnGrid
from bayesid.recording.recorded_as import in_axes_of_orbit
from bayesid.simulation.model import Model

__all__ = ["QuaternionConventions", "StatedAttitude", "conjugate", "scalar_last"]


def scalar_last(quaternions: Floats) -> Floats:
    """Return quaternions w, x, y, z (..., 4) in the order x, y, z, w."""
    return quaternions[..., [1, 2, 3, 0]]


def conjugate(quaternions: Floats) -> Floats:
    """Return the inverse of unit quaternions x, y, z, w (..., 4)."""
    return quaternions * np.array([-1.0, -1.0, -1.0, 1.0])


ORDER, INVERSE = 'order = "wxyz"', "inverse = true"
FIRST = "Attitudes have the scalar first, w, x, y, z"
OTHER_WAY = "Attitudes are inverse, from orbit to base axes"

# share of other fixed axes: the chance that axes of any direction agree as well as is asked of the first attitude,
# the volume of such rotations over that of all, 4/3 pi 0.1^3 / (8 pi^2)
ANY_AXES = 5e-5
READINGS = ("attitude", "turning", "start")  # parts of the balance that hold them
RANK = {"order": 0, "conjugate": 1}
READ: tuple[tuple[str, str, str, Callable[[Floats], Floats]], ...] = (
    ("order", ORDER, FIRST, scalar_last),
    ("conjugate", INVERSE, OTHER_WAY, conjugate),
)


@MistakeFamily.register
class QuaternionConventions(MistakeFamily):
    """Readings of the star sensor."""

    title = "orders, directions and axes of quaternions"

    def members(self, model: Model, readings: ReadingsOnGrid) -> Iterator[Mistake]:
        """Yield order, inverse, and the axes to which they refer."""
        if not len(readings.attitude_time):
            return
        for name, line, text, change in READ:
            yield _read_as(name, line, text, change)
        yield _relative_to("inertial", "fixed axes other than those of the orbit at time 0", ANY_AXES)
        if readings.orbit_rate:
            yield _relative_to("rotating", "axes that turn with the orbit", 0.2)


def _read_as(name: str, line: str, text: str, change: Callable[[Floats], Floats]) -> Mistake:
    return Mistake(
        f"convention:{name}:attitude",
        "attitude",
        f"attitude:{name}",
        RANK[name],
        lambda seen: replace(seen, attitude=change(seen.attitude)),
        lambda seen: f"[sensors.attitude]\n{line}",
        lambda seen: f"{text}.",
        0.3,
        READINGS,
    )


def _relative_to(frame: str, words: str, share: float) -> Mistake:
    return Mistake(
        "convention:frame:attitude",
        "attitude",
        "attitude:frame",
        2,
        lambda seen: _in_orbit_axes(seen, frame),
        lambda seen: f'[sensors.attitude]\nframe = "{frame}"',
        lambda seen: f"Attitudes are relative to {words}.",
        share,
        READINGS,
    )


def _in_orbit_axes(readings: ReadingsOnGrid, frame: str) -> ReadingsOnGrid:
    seen = readings.attitude_time, readings.attitude
    return replace(readings, attitude=in_axes_of_orbit(*seen, frame, readings.start, readings.orbit_rate))


@MistakeFamily.register
class StatedAttitude(MistakeFamily):
    """The attitude at time 0 that the study states, beside readings of a star sensor."""

    title = "orders and directions of stated attitudes"

    def members(self, model: Model, readings: ReadingsOnGrid) -> Iterator[Mistake]:
        """Yield order and inverse."""
        if not len(readings.attitude_time):
            return
        for name, _, text, change in READ:
            yield _stated_as(name, text, change)


def _stated_as(name: str, text: str, change: Callable[[Floats], Floats]) -> Mistake:
    return Mistake(
        f"convention:{name}:attitude",
        "recordings.attitude",
        f"stated:{name}",
        RANK[name],
        lambda seen: replace(seen, start=change(seen.start), stated=change(seen.stated)),
        lambda seen: "\n".join(map(_stated, change(seen.stated))),
        lambda seen: f"The attitude that the study states: {text[0].lower()}{text[1:]}.",
        0.5,
        ("start",),
    )


def _stated(quaternion: Floats) -> str:
    return f"[[recordings]]\nattitude = [{', '.join(f'{value:.12g}' for value in quaternion)}]"
