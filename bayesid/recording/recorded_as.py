"""How the columns of a file were recorded, where that differs from the format, and their conversion.

Whatever is wrong with a recording stays in its file and is stated in the study (`Convention.remedy`): units, signs,
zeros, exchanged columns, the order of quaternions, gravity, values that stand for missing readings, readings repeated
at a higher rate, and stamps that are late.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bayesid._math.arrays import Floats

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

__all__ = ["JointRecordedAs", "RecordedAs", "SensorRecordedAs", "in_axes_of_orbit"]

MOVED = ("position", "velocity", "acceleration", "torque")  # families of a joint, the power of its scale
QUATERNION = ("attitude.x", "attitude.y", "attitude.z", "attitude.w")


@dataclass(frozen=True)
class JointRecordedAs:
    """Convention of one joint: its position is ``sign * scale * reading + offset``.

    Attributes
    ----------
    sign, offset, scale : float
        Offset in rad or m.
    column : str
        Joint whose columns hold its readings; empty for its own.
    latency : float
        Time by which its stamps are late [s].
    """

    sign: float = 1.0
    offset: float = 0.0
    scale: float = 1.0
    column: str = ""
    latency: float = 0.0


@dataclass(frozen=True)
class SensorRecordedAs:
    """Convention of the readings of one family of columns, applied in the order of the attributes.

    Attributes
    ----------
    missing : tuple of float
        Values that stand for missing readings.
    native_rate : float
        Rate at which new readings come [Hz]; 0 where every row holds one.
    unit : float
        Factor to the unit of the format.
    gravity : tuple of float
        Gravity in the readings at the first of them, sensor axes [m/s2]; empty without.
    in_space : bool
        Whether gravity is constant in space and not in the sensor's axes.
    reflected : bool
        Whether the axes of the sensor are left-handed, all three counted the other way.
    latency : float
        Time by which the stamps are late [s].
    """

    missing: tuple[float, ...] = ()
    native_rate: float = 0.0
    unit: float = 1.0
    gravity: tuple[float, ...] = ()
    in_space: bool = False
    reflected: bool = False
    latency: float = 0.0


@dataclass(frozen=True)
class RecordedAs:
    """Conventions of one recording.

    Attributes
    ----------
    time_unit : float
        Unit of the times [s]; 0 where nothing is stated.
    joints : mapping of str to JointRecordedAs
        By joint.
    sensors : mapping of str to SensorRecordedAs
        By family of columns; ``position`` stands for all that encoders read.
    mountings : mapping of str to (3, 3) array
        Rotations from sensor to base axes, by family.
    scalar_first, inverse : bool
        Of quaternions.
    frame : str
        ``orbit``, ``inertial`` or ``rotating``: axes to which attitudes are relative.
    start : (4,) array
        Attitude at time 0 as the study states it.
    orbit_rate : float
        [rad/s]
    """

    time_unit: float = 0.0
    joints: Mapping[str, JointRecordedAs] = field(default_factory=dict)
    sensors: Mapping[str, SensorRecordedAs] = field(default_factory=dict)
    mountings: Mapping[str, Floats] = field(default_factory=dict)
    scalar_first: bool = False
    inverse: bool = False
    frame: str = "orbit"
    start: Floats = field(default_factory=lambda: np.array([0.0, 0.0, 0.0, 1.0]))
    orbit_rate: float = 0.0

    def joint(self, name: str) -> JointRecordedAs:
        """Return the convention of one joint."""
        return self.joints.get(name, JointRecordedAs())

    def sensor(self, family: str) -> SensorRecordedAs:
        """Return the convention of one family."""
        return self.sensors.get(family, SensorRecordedAs())

    def with_sensor(self, family: str, convention: SensorRecordedAs) -> RecordedAs:
        """Return the conventions with another one of a family."""
        return replace(self, sensors={**self.sensors, family: convention})

    def later(self, channel: str, latency: float) -> RecordedAs:
        """Return the conventions with stamps that are later still.

        Parameters
        ----------
        channel : str
            A family, or ``position.JOINT``.
        latency : float
            [s]
        """
        family, _, joint = channel.partition(".")
        stated = self.sensor(family)
        if not joint:
            return self.with_sensor(family, replace(stated, latency=stated.latency + latency))
        before = self.joint(joint)
        changed = replace(before, latency=(before.latency or stated.latency) + latency)
        return replace(self, joints={**self.joints, joint: changed})

    def converted(self, columns: Mapping[str, Floats]) -> dict[str, Floats]:
        """Return columns as the format has them.

        Parameters
        ----------
        columns : mapping of str to (T,) array
            With ``time``; NaN where there is no reading.
        """
        columns = dict(columns)
        if self.time_unit:
            time = columns["time"]
            late = time[0] > time[-1] - time[0]  # counted since 1970, or since a clock was set
            columns["time"] = (time - (time[0] if late else 0.0)) * self.time_unit
        for family, convention in self.sensors.items():
            groups = _groups(columns, family)
            for names in groups:
                _thin(columns, names, convention)
            for name in (name for names in groups for name in names):
                columns[name] = columns[name] * (-convention.unit if convention.reflected else convention.unit)
        self._take_gravity(columns)
        self._turn_attitudes(columns)
        columns = self._joints(columns)
        base = tuple(family for family in self.sensors if family != "position")
        late = {joint: convention.latency for joint, convention in self.joints.items() if convention.latency}
        for joint, latency in late.items():
            columns = _earlier(columns, [f"{family}.{joint}" for family in MOVED], latency, base)
        for family, convention in self.sensors.items():
            if convention.latency:
                names = [name for group in _groups(columns, family) for name in group]
                names = [name for name in names if name.partition(".")[2] not in late]
                columns = _earlier(columns, names, convention.latency, base)
        return columns

    def _joints(self, columns: Mapping[str, Floats]) -> dict[str, Floats]:
        result = dict(columns)
        for joint, convention in self.joints.items():
            for family in MOVED:
                source = f"{family}.{convention.column or joint}"
                if source not in columns:
                    continue
                factor = convention.sign * (1.0 if family == "torque" else convention.scale)
                offset = convention.offset if family == "position" else 0.0
                result[f"{family}.{joint}"] = factor * columns[source] + offset
        return result

    def _turn_attitudes(self, columns: dict[str, Floats]) -> None:
        if not set(QUATERNION) <= set(columns):
            return
        values = np.stack([columns[name] for name in QUATERNION], axis=1)
        present = np.isfinite(values).all(axis=1)
        quaternion = values[present]
        if self.scalar_first:
            quaternion = quaternion[:, [1, 2, 3, 0]]
        if self.inverse:
            quaternion = quaternion * np.array([-1.0, -1.0, -1.0, 1.0])
        if self.frame != "orbit":
            time = columns["time"][present]
            quaternion = in_axes_of_orbit(time, quaternion, self.frame, self.start, self.orbit_rate)
        values[present] = quaternion
        columns |= dict(zip(QUATERNION, values.T, strict=True))

    def _take_gravity(self, columns: dict[str, Floats]) -> None:
        convention, names = self.sensors.get("accel"), [f"accel.{axis}" for axis in "xyz"]
        if convention is None or not convention.gravity or not set(names) <= set(columns):
            return
        present = np.isfinite(columns[names[0]])
        sign = -1.0 if convention.reflected else 1.0  # the readings are reflected by now
        gravity = np.tile(sign * np.array(convention.gravity), (int(present.sum()), 1))
        if convention.in_space:
            from scipy.spatial.transform import Rotation  # here, as sensors import this module

            turned = self._turned(columns, columns["time"][present])
            mounting = Rotation.from_matrix(self.mountings.get("accel", np.eye(3)))
            gravity = (mounting.inv() * turned.inv() * mounting).apply(gravity)
        for axis, name in enumerate(names):
            columns[name] = columns[name].copy()
            columns[name][present] -= gravity[:, axis]

    def _turned(self, columns: Mapping[str, Floats], at: Floats) -> Rotation:
        """Return the rotations from base axes to those at the first time, by the rates or else by the attitudes."""
        from scipy.spatial.transform import Rotation, Slerp

        if "rate.x" in columns:
            rate = np.stack([columns[f"rate.{axis}"] for axis in "xyz"], axis=1)
            present = np.isfinite(rate).all(axis=1)
            time, rate = columns["time"][present], rate[present] @ self.mountings.get("rate", np.eye(3)).T
            steps = Rotation.from_rotvec(0.5 * (rate[1:] + rate[:-1]) * np.diff(time)[:, None])
            course = [Rotation.identity()]
            for step in steps:
                course.append(course[-1] * step)
            attitude = Rotation.concatenate(course)
        elif "attitude.x" in columns:
            values = np.stack([columns[name] for name in QUATERNION], axis=1)
            present = np.isfinite(values).all(axis=1)
            time, attitude = columns["time"][present], Rotation.from_quat(values[present])
        else:
            return Rotation.identity(len(at))
        seen = Slerp(time, attitude)(np.clip(at, time[0], time[-1]))
        return seen[0].inv() * seen


def in_axes_of_orbit(time: Floats, quaternion: Floats, frame: str, start: Floats, orbit_rate: float) -> Floats:
    """Return attitudes that are relative to other axes in those of the orbit at time 0, (m, 4).

    Parameters
    ----------
    time : (m,) array
        Times of the attitudes [s].
    quaternion : (m, 4) array
    frame : {"inertial", "rotating"}
        Fixed axes, so that the first attitude is the one that the study states; or axes that turn with the orbit.
    start : (4,) array
        Attitude at time 0 as the study states it.
    orbit_rate : float
        [rad/s]
    """
    from scipy.spatial.transform import Rotation

    attitude = Rotation.from_quat(quaternion)
    if frame == "rotating":
        return np.asarray((Rotation.from_rotvec(np.outer(time, [0.0, 0.0, orbit_rate])) * attitude).as_quat())
    return np.asarray((Rotation.from_quat(start) * attitude[0].inv() * attitude).as_quat())


def _groups(columns: Mapping[str, Floats], family: str) -> list[list[str]]:
    """Return the columns that are sampled together: the axes of a sensor, or each joint's."""
    families = MOVED[:3] if family == "position" else (family,)
    names = [name for name in columns if name.partition(".")[0] in families]
    return [[name] for name in names] if family == "position" or family == "torque" else [names] if names else []


def _thin(columns: dict[str, Floats], names: Sequence[str], convention: SensorRecordedAs) -> None:
    """Empty the cells of missing and of repeated readings."""
    values = np.stack([columns[name] for name in names])
    gone: NDArray[np.bool_] = np.asarray(np.isin(values, convention.missing).any(axis=0))
    if convention.native_rate:
        time = columns["time"]
        present = np.isfinite(values).all(axis=0)
        share = np.floor((time - time[present][0]) * convention.native_rate + 1e-6)
        use = np.flatnonzero(present)
        repeated = use[np.concatenate([[False], np.diff(share[use]) == 0.0])]
        gone[repeated] = True
    if gone.any():
        for name in names:
            columns[name] = np.where(gone, np.nan, columns[name])


def _earlier(
    columns: Mapping[str, Floats], names: Sequence[str], latency: float, base: Sequence[str]
) -> dict[str, Floats]:
    """Return columns with the readings of some of them at other times; rows are added where there are none.

    Where they are of joints, what the sensors of the base read before the first or after the last of them is left out,
    and the joints are taken to rest until their first.
    """
    time, names = columns["time"], [name for name in names if name in columns]
    if not names:
        return dict(columns)
    moved = time - latency
    nearest = np.searchsorted(time, moved)
    step = float(np.median(np.diff(time)))
    for side in (nearest - 1, nearest):
        near = np.clip(side, 0, len(time) - 1)
        moved = np.where(np.abs(time[near] - moved) < 1e-6 * step, time[near], moved)
    present = np.isfinite(np.stack([columns[name] for name in names])).any(axis=0) & (moved >= 0.0)
    whole = np.union1d(time, moved[present])
    result = {"time": whole}
    for name, values in columns.items():
        if name != "time":
            result[name] = np.full(len(whole), np.nan)
            rows = np.searchsorted(whole, moved[present] if name in names else time)
            result[name][rows] = values[present] if name in names else values
    if names[0].partition(".")[0] in MOVED:
        inside = (whole >= moved[present][0]) & (whole <= moved[present][-1])
        for name, values in result.items():
            if name in names and not inside[0]:
                values[0] = values[inside][np.isfinite(values[inside])][0] if name.startswith("position.") else 0.0
            elif name.partition(".")[0] in base:
                values[~inside] = np.nan
    return result
