"""The file study.toml that describes a simulated study."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from studies.truth.numerics import Array
from studies.truth.orbit import Orbit
from studies.truth.recordings import Sensors

__all__ = ["study_toml"]


def study_toml(
    title: str,
    base: str,
    sensors: Sensors,
    attitudes: Sequence[Array],
    *,
    orbits: Sequence[Orbit | None] | None = None,
    effects: Sequence[str] | None = None,
    link_spread: float = 0.0,
    initial_rate: str | None = None,
) -> str:
    """Text of study.toml beside robot.urdf and manoeuvre-1.csv, manoeuvre-2.csv and so on, with the base unknown.

    Parameters
    ----------
    title, base : str
        Title of the study, and name of the base link.
    sensors : Sensors
        Noise and mounting as the study states them.
    attitudes : sequence of (4,) array
        Initial quaternion of each recording, x, y, z, w.
    orbits : sequence of Orbit or None, optional
        Orbit of each recording; they differ in the argument of latitude only.
    effects : sequence of str, optional
        Effects of the study's model; the study says nothing of its model where left out.
    link_spread, initial_rate
        Settings of the study of the same names.
    """
    places = [None] * len(attitudes) if orbits is None else list(orbits)
    lines = [f'title = "{title}"', "[robot]", 'urdf = "robot.urdf"']
    if link_spread:
        lines += [f"link_spread = {link_spread!r}"]
    lines += _orbit_lines(places[0])
    if sensors.rate_period is not None:
        lines += ["[sensors.rate]", f"sigma = {sensors.rate_sigma!r}"]
    if sensors.accel_period is not None:
        lines += ["[sensors.accel]", f"sigma = {sensors.accel_sigma!r}"]
        lines += [f"position = {_list(sensors.accel_position)}"]
    if sensors.attitude_period is not None:
        lines += ["[sensors.attitude]", f"sigma = {sensors.attitude_sigma!r}"]
    lines += ["[sensors.encoder]", f"sigma = {sensors.encoder_sigma!r}"]
    for index, (attitude, place) in enumerate(zip(attitudes, places, strict=True), start=1):
        lines += ["[[recordings]]", f'file = "manoeuvre-{index}.csv"', f"attitude = {_list(attitude)}"]
        if place is not None:
            lines += [f"argument_of_latitude = {place.argument_of_latitude!r}"]
    lines += ["[unknowns]", f'bodies = ["{base}"]']
    if effects is not None:
        names = ", ".join(f'"{effect}"' for effect in effects)
        lines += ["[model]", f"effects = [{names}]"]
        if initial_rate is not None:
            lines += [f'initial_rate = "{initial_rate}"']
    return "\n".join(lines) + "\n"


def _orbit_lines(orbit: Orbit | None) -> list[str]:
    """Lines of the orbit's section."""
    if orbit is None:
        return []
    lines = ["[orbit]", f"radius = {orbit.radius!r}"]
    if orbit.eccentricity:
        lines += [f"eccentricity = {orbit.eccentricity!r}", f"argument_of_perigee = {orbit.argument_of_perigee!r}"]
    if orbit.inclination is not None:
        lines += [f"inclination = {orbit.inclination!r}"]
    if orbit.sun is not None:
        lines += [f"sun = {_list(orbit.sun)}"]
    return lines


def _list(values: ArrayLike) -> str:
    return "[" + ", ".join(repr(float(value)) for value in np.asarray(values)) + "]"
