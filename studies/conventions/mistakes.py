"""Mistakes that people make with telemetry, made in the files of a right study."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from bayesid._math.arrays import Integers
from studies.truth.numerics import Array

Columns = dict[str, Array]
GRAVITY = 9.80665


class Blunder(NamedTuple):
    """A mistake: how it is made in a study, the conventions that name it, and the relative error of its remedy."""

    make: Callable[[Path], None]
    names: tuple[str, ...]
    error: float = 1e-6


def edited(change: Callable[[Columns], Columns]) -> Callable[[Path], None]:
    """Return the mistake that changes the columns of all recordings beside a study file."""

    def make(file: Path) -> None:
        for recording in sorted(file.parent.glob("*.csv")):
            with recording.open(newline="") as stream:
                header, *rows = csv.reader(stream)
            values = np.array([[float(cell) if cell else np.nan for cell in row] for row in rows]).T
            columns = change(dict(zip(header, values, strict=True)))
            with recording.open("w", newline="") as stream:
                writer = csv.writer(stream)
                writer.writerow(columns)
                for row in zip(*columns.values(), strict=True):
                    writer.writerow(["" if np.isnan(value) else f"{value:.15g}" for value in row])

    return make


def _in_axes(family: str, matrix: Array) -> Callable[[Columns], Columns]:
    def change(columns: Columns) -> Columns:
        names = [f"{family}.{axis}" for axis in "xyz"]
        return columns | dict(zip(names, matrix @ np.stack([columns[name] for name in names]), strict=True))

    return change


def _times(prefix: str, factor: float, offset: float = 0.0) -> Callable[[Columns], Columns]:
    return lambda columns: {
        name: factor * values + offset if name.startswith(prefix) else values for name, values in columns.items()
    }


def _exchanged(first: str, second: str) -> Callable[[Columns], Columns]:
    def change(columns: Columns) -> Columns:
        names = {name: name for name in columns}
        for name in columns:
            family, _, joint = name.partition(".")
            if joint in (first, second):
                names[name] = f"{family}.{second if joint == first else first}"
        return {name: columns[names[name]] for name in columns}

    return change


def _with_gravity(sign: float) -> Callable[[Columns], Columns]:
    return lambda columns: columns | {"accel.z": columns["accel.z"] + sign * GRAVITY}


def _quaternions(change: Callable[[Array], Array]) -> Callable[[Columns], Columns]:
    def changed(columns: Columns) -> Columns:
        names = [f"attitude.{axis}" for axis in "xyzw"]
        return columns | dict(zip(names, change(np.stack([columns[name] for name in names])), strict=True))

    return changed


def _in_other_axes(quaternion: Array) -> Array:
    present = np.isfinite(quaternion).all(axis=0)
    other = Rotation.from_rotvec([0.4, -1.1, 0.7])
    quaternion = quaternion.copy()
    quaternion[:, present] = (other * Rotation.from_quat(quaternion[:, present].T)).as_quat().T
    return quaternion


def _both(*changes: Callable[[Columns], Columns]) -> Callable[[Columns], Columns]:
    def change(columns: Columns) -> Columns:
        for part in changes:
            columns = part(columns)
        return columns

    return change


def _sparse(family: str, every: int, fill: Callable[[Integers, Array], Array]) -> Callable[[Columns], Columns]:
    """Return the change that repeats every n-th sample of a family, or draws lines between them."""

    def change(columns: Columns) -> Columns:
        result = dict(columns)
        for name, values in columns.items():
            if name.startswith(f"{family}."):
                present = np.flatnonzero(np.isfinite(values))
                result[name] = values.copy()
                result[name][present] = fill(np.arange(len(present), dtype=int), values[present][::every])
        return result

    return change


def _late(prefix: str, samples: int) -> Callable[[Columns], Columns]:
    """Return the change that moves channels by samples to later stamps, or earlier ones where they are negative."""

    def change(columns: Columns) -> Columns:
        result = dict(columns)
        for name, values in columns.items():
            if name.startswith(prefix):
                present = np.flatnonzero(np.isfinite(values))
                use, place = (
                    (present[:-samples], present[samples:]) if samples > 0 else (present[-samples:], present[:samples])
                )
                result[name] = np.full(len(values), np.nan)
                result[name][place] = values[use]
        return result

    return change


def _filled(family: str, value: float) -> Callable[[Columns], Columns]:
    def change(columns: Columns) -> Columns:
        result = dict(columns)
        for name, values in columns.items():
            if name.startswith(f"{family}."):
                present = np.flatnonzero(np.isfinite(values))
                result[name] = values.copy()
                result[name][present[np.arange(len(present)) % 17 == 5]] = value
        return result

    return change


DOWN, LEFT = np.diag([1.0, -1.0, -1.0]), np.diag([1.0, 1.0, -1.0])
CYCLE = np.roll(np.eye(3), 1, axis=0)

MISTAKES: dict[str, Blunder] = {
    "gyro forward-right-down": Blunder(edited(_in_axes("rate", DOWN)), ("convention:axes:rate",)),
    "gyro axes permuted": Blunder(edited(_in_axes("rate", CYCLE)), ("convention:axes:rate",)),
    "gyro left-handed": Blunder(edited(_in_axes("rate", LEFT)), ("convention:axes:rate",)),
    "accelerometer forward-right-down": Blunder(edited(_in_axes("accel", DOWN)), ("convention:axes:accel",)),
    "accelerometer axes permuted": Blunder(edited(_in_axes("accel", CYCLE)), ("convention:axes:accel",)),
    "accelerometer axes reversed": Blunder(edited(_in_axes("accel", -np.eye(3))), ("convention:axes:accel",)),
    "both forward-right-down": Blunder(
        edited(_both(_in_axes("rate", DOWN), _in_axes("accel", DOWN))),
        ("convention:axes:rate", "convention:axes:accel"),
    ),
    "sign of joint1": Blunder(edited(_both(_times("position.joint1", -1.0))), ("convention:sign:joint1",)),
    "sign of joint2": Blunder(edited(_times("position.joint2", -1.0)), ("convention:sign:joint2",)),
    "zero of joint2 off by 90 degrees": Blunder(
        edited(_times("position.joint2", 1.0, -np.pi / 2)), ("convention:zero:joint2",), 0.2
    ),
    "joint1 and joint2 exchanged": Blunder(
        edited(_exchanged("joint1", "joint2")), ("convention:exchanged:joint1,joint2",)
    ),
    "rates in degrees": Blunder(edited(_times("rate.", 180.0 / np.pi)), ("convention:unit:rate",)),
    "accelerations in g": Blunder(edited(_times("accel.", 1.0 / GRAVITY)), ("convention:unit:accel",)),
    "accelerations in milli-g": Blunder(edited(_times("accel.", 1e3 / GRAVITY)), ("convention:unit:accel",)),
    "accelerations with gravity": Blunder(edited(_with_gravity(1.0)), ("convention:gravity:accel",)),
    "accelerations with gravity, other sign": Blunder(edited(_with_gravity(-1.0)), ("convention:gravity:accel",)),
    "attitudes with the scalar first": Blunder(
        edited(_quaternions(lambda q: q[[3, 0, 1, 2]])), ("convention:order:attitude",)
    ),
    "attitudes inverted": Blunder(
        edited(_quaternions(lambda q: q * np.array([-1.0, -1.0, -1.0, 1.0])[:, None])),
        ("convention:conjugate:attitude",),
    ),
    "attitudes relative to another frame": Blunder(
        edited(_quaternions(_in_other_axes)), ("convention:frame:attitude",), 0.1
    ),
    "times in milliseconds": Blunder(edited(_times("time", 1e3)), ("convention:unit:time",)),
    "times in nanoseconds since 1970": Blunder(edited(_times("time", 1e9, 1.7e18)), ("convention:unit:time",), 1e-3),
    "rates repeated between samples": Blunder(
        edited(_sparse("rate", 4, lambda rows, seen: seen[rows // 4])), ("convention:held:rate",)
    ),
    "rates with fill values": Blunder(edited(_filled("rate", 999.0)), ("convention:fill:rate",)),
    "rates three samples late": Blunder(edited(_late("rate.", 3)), ("convention:shift:rate",)),
    "accelerations two samples late": Blunder(edited(_late("accel.", 2)), ("convention:shift:accel",)),
    "joint commands instead of readings, two samples early": Blunder(
        edited(_late("position.", -2)),
        ("convention:shift:position",),
        0.05,  # they are taken to rest before
    ),
    "rates in counts": Blunder(edited(_times("rate.", 9000.0)), ("convention:unit:rate",), 1.0),
    "sign of joint2 and unit of accelerations": Blunder(
        edited(_both(_times("position.joint2", -1.0), _times("accel.", 1e3 / GRAVITY))),
        ("convention:unit:accel", "convention:sign:joint2"),
    ),
}
"""Mistakes by what is wrong, in robots whose joints are joint1, joint2, ..."""
