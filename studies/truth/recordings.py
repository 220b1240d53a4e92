"""What simulators read, and studies as they write them: noise, gaps, recorded thrust, the CSV and the TOML file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from studies.truth.numerics import Array
from studies.truth.orbit import Orbit


class Truth(NamedTuple):
    """Noise-free motion at n times; base axes unless said otherwise."""

    times: Array  # (n,)
    # (n, joints): motion and torque of the driven joints, in the order of the URDF
    position: Array
    speed: Array
    acceleration: Array
    torque: Array
    rate: Array  # (n, 3)
    attitude: Array  # (n, 4): quaternion x, y, z, w, base axes to orbit axes
    accel: Array  # (n, 3)
    # (n, 3): thrust at the base origin [N, N m]
    force: Array
    external_torque: Array

    def at(self, times: Array) -> Truth:
        """Rows at some of the times."""
        rows = np.searchsorted(self.times, times)
        return Truth(*(values[rows] for values in self))

    def between(self, times: Array) -> Truth:
        """Rows at any times within, by cubic splines, for motions that are smooth from one time to the next."""
        attitude = CubicSpline(self.times, self.attitude)(times)
        found = Truth(*(CubicSpline(self.times, values)(times) for values in self))
        return found._replace(times=times, attitude=attitude / np.linalg.norm(attitude, axis=1, keepdims=True))


Table = dict[str, Array]  # columns of a recording by channel; NaN where a sensor takes no sample

# changes the noise-free columns in place, given with the truth at their times
Distortion = Callable[[Table, Truth], None]

# changes the noisy columns in place, given with their times
Spoiling = Callable[[Table, Array, np.random.Generator], None]


@dataclass(frozen=True)
class Sensors:
    """White noise per sample and sampling of the recordings; a period of None leaves the sensor out.

    With a positive delay the sample stamped t shows the past. With a jitter samples are taken, and stamped, earlier or
    later than evenly by up to that share of their period, alike for sensors of one period.
    """

    rate_sigma: float = 1e-5
    accel_sigma: float = 1e-5
    attitude_sigma: float = 1e-5
    encoder_sigma: float = 1e-6
    rate_period: float | None = 0.5
    accel_period: float | None = 0.5
    attitude_period: float | None = None
    encoder_period: float = 0.5
    accel_position: tuple[float, float, float] = (0.1, -0.15, 0.3)
    rate_delay: float = 0.0
    accel_delay: float = 0.0
    encoder_delay: float = 0.0
    jitter: float = 0.0


def by_axis(family: str, names: Iterable[str], values: Array) -> Table:
    """Columns of a family of channels from an array with one column for each name."""
    return {f"{family}.{name}": column.copy() for name, column in zip(names, values.T, strict=True)}


def stacked(table: Table, family: str, names: Iterable[str] = "xyz") -> Array:
    """Array with one column for each channel of a family."""
    return np.stack([table[f"{family}.{name}"] for name in names], axis=1)


def sample_times(duration: float, sensors: Sensors) -> dict[str, Array]:
    """Instants at which each sensor samples [s], by sensor."""
    periods = {"position": sensors.encoder_period, "rate": sensors.rate_period, "accel": sensors.accel_period}
    periods["attitude"] = sensors.attitude_period
    return {
        name: np.round(_instants(int(duration / period + 1e-9) + 1, sensors.jitter) * period, 9)
        for name, period in periods.items()
        if period is not None
    }


def _instants(count: int, jitter: float) -> Array:
    """Instants in periods, of which the first and the last are on time."""
    instants = np.arange(count, dtype=float)
    instants[1:-1] += jitter * np.random.default_rng(count).uniform(-1.0, 1.0, max(count - 2, 0))
    return instants


def delayed(times: Array, sensors: Sensors) -> dict[str, Array]:
    """Instants at which the samples stamped with these times were really taken [s], by sensor."""
    delays = {"rate": sensors.rate_delay, "accel": sensors.accel_delay, "position": sensors.encoder_delay}
    return {name: np.round(times - delay, 9) for name, delay in delays.items()} | {"attitude": times}


def columns(joints: Sequence[str], truths: Mapping[str, Truth], samples: Mapping[str, Array], times: Array) -> Table:
    """Noise-free columns of a recording; NaN where a sensor takes no sample."""
    table: Table = {}
    names: dict[str, Sequence[str]] = {"rate": "xyz", "accel": "xyz", "attitude": "xyzw", "position": joints}
    for sensor, taken_at in samples.items():
        taken, values = np.isin(times, taken_at), getattr(truths[sensor], sensor)
        table |= by_axis(sensor, names[sensor], np.where(taken[:, None], values, np.nan))
    return table


def add_noise(table: Table, sensors: Sensors, generator: np.random.Generator) -> None:
    """Add white noise to every column; that of the attitude is a small rotation about random axes of the base."""
    sigmas = {"position": sensors.encoder_sigma, "rate": sensors.rate_sigma, "accel": sensors.accel_sigma}
    for name, column in table.items():
        sigma = sigmas.get(name.split(".")[0])
        if sigma is not None:
            column += sigma * generator.standard_normal(column.shape)
    if "attitude.x" in table:
        true = stacked(table, "attitude", "xyzw")
        turn, taken = sensors.attitude_sigma * generator.standard_normal((len(true), 3)), ~np.isnan(true[:, 0])
        noisy = Rotation.from_quat(true[taken]) * Rotation.from_rotvec(turn[taken])
        true[taken] = noisy.as_quat()
        table |= by_axis("attitude", "xyzw", true)


def cut_gaps(table: Table, times: Array, gaps: Mapping[str, Sequence[tuple[float, float]]]) -> None:
    """Empty the cells of channels ("accel", "position.joint2") within intervals (start, stop) [s]."""
    for channel, intervals in gaps.items():
        names = [name for name in table if name == channel or name.startswith(channel + ".")]
        if not names:
            raise ValueError(f"no channel {channel} to cut a gap in; there are {', '.join(table)}")
        for name in names:
            for start, stop in intervals:
                table[name][(times >= start) & (times < stop)] = np.nan


def add_thrusts(table: Table, truth: Truth, edges: AbstractSet[float]) -> None:
    """Add the true force and torque of thrusts that start and stop at these times [s]."""
    if not edges <= set(truth.times.tolist()):
        raise ValueError(f"thrusts start and stop at {sorted(edges)} s, which must all be sample times")
    for name, values in (("base_force", truth.force), ("base_torque", truth.external_torque)):
        table |= by_axis(name, "xyz", values)


def write_csv(file: Path, times: Array, table: Mapping[str, Array]) -> None:
    """Write the columns with their times; a cell without a sample is left empty."""
    rows = [",".join(["time", *table])]
    for index, time in enumerate(times):
        cells = ["" if np.isnan(column[index]) else f"{column[index]:.12g}" for column in table.values()]
        rows.append(",".join([f"{time:.12g}", *cells]))
    file.write_text("\n".join(rows) + "\n")


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
    title, base : str; title of the study, and name of the base link
    sensors : Sensors; noise and mounting as the study states them
    attitudes : sequence of (4,) array; initial quaternion of each recording, x, y, z, w
    orbits : sequence of Orbit or None, optional; orbit of each recording; they differ in the argument of latitude only
    effects : sequence of str, optional
        Effects of the study's model; the study says nothing of its model where left out.
    link_spread, initial_rate : settings of the study of the same names
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
