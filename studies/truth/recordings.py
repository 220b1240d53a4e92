"""Recordings as a study has them: when each sensor samples, its noise, gaps, recorded thrust, and the CSV file."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from studies.truth.numerics import Array
from studies.truth.readings import Truth

__all__ = [
    "Distortion",
    "Sensors",
    "Spoiling",
    "Table",
    "add_noise",
    "add_thrusts",
    "by_axis",
    "columns",
    "cut_gaps",
    "delayed",
]
__all__ += ["sample_times", "write_csv"]

Table = dict[str, Array]
"""Columns of a recording by channel; NaN where a sensor takes no sample."""


Distortion = Callable[[Table, Truth], None]
"""Changes the noise-free columns in place, given with the truth at their times."""

Spoiling = Callable[[Table, Array, np.random.Generator], None]
"""Changes the noisy columns in place, given with their times."""


@dataclass(frozen=True)
class Sensors:
    """White noise per sample and sampling of the recordings; a period of None leaves the sensor out.

    With a positive delay the sample stamped t shows the past.
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


def by_axis(family: str, names: Iterable[str], values: Array) -> Table:
    """Columns of a family of channels from an array with one column for each name."""
    return {f"{family}.{name}": column.copy() for name, column in zip(names, values.T, strict=True)}


def sample_times(duration: float, sensors: Sensors) -> dict[str, Array]:
    """Instants at which each sensor samples [s], by sensor."""
    periods = {
        "position": sensors.encoder_period,
        "rate": sensors.rate_period,
        "accel": sensors.accel_period,
        "attitude": sensors.attitude_period,
    }
    return {
        name: np.round(np.arange(int(duration / period + 1e-9) + 1) * period, 9)
        for name, period in periods.items()
        if period is not None
    }


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
        true = np.stack([table[f"attitude.{axis}"] for axis in "xyzw"], axis=1)
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
