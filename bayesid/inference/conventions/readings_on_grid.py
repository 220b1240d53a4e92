"""Readings of one recording on a coarse even grid, as the balance of momentum compares them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats
from bayesid.recording.actions import Actions
from bayesid.recording.joint_motion import Motion
from bayesid.recording.recorded_as import JointRecordedAs, RecordedAs
from bayesid.recording.recording import Recording
from bayesid.robot.joint_state import JointState
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import SensorKind

__all__ = ["GridSensor", "GridSource", "ReadingsOnGrid"]

MOST = 160  # number of instants, enough for the motion of a manoeuvre
GAP = 8.0  # intervals of samples above which nobody knows how the base turned meanwhile
FEWEST = 4  # number of instants below which there is no motion to speak of
SPREAD = 2.0  # intervals of the grid from the nearest sample beyond which an instant has no reading


@dataclass(frozen=True)
class GridSensor:
    """Readings of a sensor whose reading is a vector.

    Attributes
    ----------
    values : (n, 3) array
        Averages of its readings about the instants, sensor axes.
    present : (n,) array of bool
        Instants near which there are samples.
    sigma : float
        Declared noise of these averages.
    axes : (3, 3) array
        Rotation from sensor to base axes as declared.
    position : (3,) array
        Mounting point in the base [m].
    unit : float
        Factor by which a hypothesis has multiplied the readings.
    """

    values: Floats
    present: NDArray[np.bool_]
    sigma: float
    axes: Floats
    position: Floats
    unit: float = 1.0

    @property
    def in_base(self) -> Floats:
        """Readings in base axes, shape (n, 3)."""
        return self.values @ self.axes.T


@dataclass(frozen=True)
class GridSource:
    """What was recorded at all times, for readings with other stamps.

    Attributes
    ----------
    time : (m,) array
        The whole grid [s].
    motion : Motion
        Of the joints.
    series : mapping of SensorKind to tuple of arrays
        Times (k,) and samples of each sensor.
    intervals : mapping of str to float
        Time between samples of each channel [s].
    use : slice
        Instants of the grid that are used.
    """

    time: Floats
    motion: Motion
    series: Mapping[SensorKind, tuple[Floats, Floats]]
    intervals: Mapping[str, float]
    use: slice = field(default_factory=lambda: slice(None))


@dataclass(frozen=True)
class ReadingsOnGrid:
    """Readings of one recording, as recorded or as a hypothesis has them.

    Attributes
    ----------
    time : (n,) array
        Instants [s].
    joints : JointState
        Motion of the joints at these instants.
    sensors : mapping of SensorKind to GridSensor
        Rate sensor and accelerometer, where the study has them.
    attitude_time, attitude : (m,) and (m, 4) arrays
        Samples of the star sensor; empty without one.
    attitude_sigma : float
        Its declared noise [rad].
    start : (4,) array
        Attitude at time 0 as the study states it.
    start_sigma : float
        Standard deviation of that attitude [rad].
    wheels, wheel_torque : (n, 3) arrays
        Momentum of the wheels and its derivative, base axes [N m s, N m].
    force, torque : (n, 3) arrays
        Recorded actions on the base, base axes [N, N m].
    source : GridSource
        What was recorded at all times.
    stated : (r, 4) array
        Attitudes at time 0 that the study states of all its recordings.
    orbit_rate : float
        Rate of the orbit, 0 without one [rad/s].
    names : tuple of str
        Joints.
    recorded_as : RecordedAs
        Conventions that the study states, and those of a hypothesis in their place.
    """

    time: Floats
    joints: JointState
    sensors: Mapping[SensorKind, GridSensor]
    attitude_time: Floats
    attitude: Floats
    attitude_sigma: float
    start: Floats
    start_sigma: float
    wheels: Floats
    wheel_torque: Floats
    force: Floats
    torque: Floats
    source: GridSource
    stated: Floats
    orbit_rate: float = 0.0
    names: tuple[str, ...] = ()
    recorded_as: RecordedAs = field(default_factory=RecordedAs)

    @classmethod
    def of(cls, model: Model, manoeuvre: Manoeuvre, stated: Floats | None = None) -> ReadingsOnGrid:
        """Return the readings of one recording as declared.

        Parameters
        ----------
        model : Model
        manoeuvre : Manoeuvre
        stated : (r, 4) array, optional
            Attitudes that the study states.
        """
        recording = manoeuvre.recording
        series = {
            sensor.kind: recording.vector(sensor.kind.value, sensor.kind.axes)
            for sensor in model.sensors
            if sensor.kind in (SensorKind.RATE, SensorKind.ACCEL, SensorKind.ATTITUDE)
        }
        joints = [recording.series(f"position.{name}")[0] for name in _positions(recording)]
        first, last = _longest_stretch([*joints, *(times for times, _ in series.values())])
        fastest = min((float(np.median(np.diff(times))) for times, _ in series.values()), default=1.0)
        every = max(1, int(np.ceil((last - first) / fastest / MOST)))
        time = np.arange(first + 0.5 * (every - 1) * fastest, last + 0.1 * fastest, every * fastest)
        if len(time) < FEWEST:
            problem = f"only {len(time)} instants contain readings of all sensors"
            raise InputError(problem, file=recording.file or recording.name, remedy="Record for longer")
        sensors = {}
        for sensor in model.sensors:
            if sensor.kind in (SensorKind.RATE, SensorKind.ACCEL):
                times, values = series[sensor.kind]
                averaged, present, count = _averages(times, values, time)
                noise = float(sensor.noise.sigma(float(np.median(np.diff(times)))).max()) / np.sqrt(count)
                place = np.asarray(sensor.position, dtype=float)
                sensors[sensor.kind] = GridSensor(averaged, present, noise, sensor.rotation, place)
        times, attitude = series.get(SensorKind.ATTITUDE, (np.zeros(0), np.zeros((0, 4))))
        inside = (times >= min(first, time[0])) & (times <= last)
        times, attitude = times[inside], attitude[inside]
        star = model.sensor(SensorKind.ATTITUDE)
        apart = every if len(times) == 0 else max(1, len(times) // MOST)
        sigma = (
            0.0 if star is None or len(times) < 2 else float(star.noise.sigma(float(np.median(np.diff(times)))).max())
        )
        actions = Actions.from_recording(recording, model.robot.wheels)
        wrench = actions.zero_order_hold(time)
        wheels, wheel_torque = actions.wheels(time)
        return cls(
            time,
            manoeuvre.motion.evaluate(time),
            sensors,
            times[::apart],
            attitude[::apart],
            sigma,
            np.asarray(manoeuvre.attitude, dtype=float),
            manoeuvre.attitude_sigma,
            wheels,
            wheel_torque,
            wrench[:, :3],
            wrench[:, 3:],
            GridSource(time, manoeuvre.motion, series, _intervals(recording, series)),
            np.zeros((0, 4)) if stated is None else stated,
            0.0 if model.orbit is None else model.orbit.mean_motion,
            tuple(joint.name for joint in model.robot.joints),
            recording.recorded_as,
        )

    def with_sensor(self, kind: SensorKind, values: Floats, unit: float = 1.0) -> ReadingsOnGrid:
        """Return the readings with other values of one sensor.

        Parameters
        ----------
        kind : SensorKind
        values : (n, 3) array
            Sensor axes.
        unit : float
            Factor by which they are larger than recorded.
        """
        before = self.sensors[kind]
        changed = replace(before, values=values, unit=unit * before.unit, sigma=unit * before.sigma)
        stated = self.recorded_as.sensor(kind.value)
        recorded_as = self.recorded_as.with_sensor(kind.value, replace(stated, unit=unit * stated.unit))
        return replace(self, sensors={**self.sensors, kind: changed}, recorded_as=recorded_as)

    def with_joints(self, joints: JointState, changes: Mapping[str, JointRecordedAs]) -> ReadingsOnGrid:
        """Return the readings with another motion of the joints.

        Parameters
        ----------
        joints : JointState
        changes : mapping of str to JointRecordedAs
            Conventions of joints that make it.
        """
        recorded_as = replace(self.recorded_as, joints={**self.recorded_as.joints, **changes})
        return replace(self, joints=joints, recorded_as=recorded_as)

    def thinned(self, most: int) -> ReadingsOnGrid:
        """Return the readings at fewer instants, for a first selection."""
        use = slice(None, None, max(1, len(self.time) // most))
        stars = slice(None, None, max(1, len(self.attitude_time) // most))
        sensors = {
            kind: replace(sensor, values=sensor.values[use], present=sensor.present[use])
            for kind, sensor in self.sensors.items()
        }
        return replace(
            self,
            time=self.time[use],
            joints=JointState(*(values[use] for values in self.joints)),
            sensors=sensors,
            attitude_time=self.attitude_time[stars],
            attitude=self.attitude[stars],
            wheels=self.wheels[use],
            wheel_torque=self.wheel_torque[use],
            force=self.force[use],
            torque=self.torque[use],
            source=replace(self.source, use=use),
        )

    @cached_property
    def turns(self) -> tuple[Floats, Floats]:
        """Times (m - 1, 2) between attitudes, and the mean rate of the base between them, (m - 1, 3) [rad/s]."""
        if len(self.attitude_time) < 2:
            return np.zeros((0, 2)), np.zeros((0, 3))
        attitude = Rotation.from_quat(self.attitude)
        change = (attitude[:-1].inv() * attitude[1:]).as_rotvec()
        pairs = np.column_stack([self.attitude_time[:-1], self.attitude_time[1:]])
        return pairs, change / np.diff(pairs, axis=1)

    def stamped(self, channel: str, latency: float) -> ReadingsOnGrid:
        """Return the readings with one channel earlier than its stamps say.

        Parameters
        ----------
        channel : str
            A sensor, ``position`` for all joints, or ``position.JOINT``.
        latency : float
            [s]
        """
        family, _, joint = channel.partition(".")
        source = self.source
        if family == "position":
            columns = [self.names.index(joint)] if joint else list(range(len(self.names)))
            other = [values[source.use] for values in source.motion.evaluate(source.time + latency)]
            moved = JointState(*(np.array(values) for values in self.joints))
            for values, late in zip(moved, other, strict=True):
                values[:, columns] = late[:, columns]
            return replace(self, joints=moved, recorded_as=self.recorded_as.later(channel, latency))
        kind = SensorKind.of(family)
        if kind == SensorKind.ATTITUDE:
            time = self.attitude_time - latency
            use = (time >= self.time[0]) & (time <= self.time[-1])
            recorded_as = self.recorded_as.later(family, latency)
            return replace(self, attitude_time=time[use], attitude=self.attitude[use], recorded_as=recorded_as)
        times, values = source.series[kind]
        averaged, present, _ = _averages(times - latency, values, source.time)
        changed = replace(self.sensors[kind], values=averaged[source.use], present=present[source.use])
        return replace(
            self, sensors={**self.sensors, kind: changed}, recorded_as=self.recorded_as.later(family, latency)
        )

    @property
    def begins(self) -> bool:
        """Whether the first attitude was measured at about time 0, for which the study states one."""
        times = self.attitude_time
        return len(times) > 1 and bool(times[0] <= 2.0 * np.median(np.diff(times)))

    @cached_property
    def turned(self) -> Floats:
        """Rotation from base axes to those at the first instant, by the rates or else by the attitudes, (n, 3, 3)."""
        if (gyro := self.sensors.get(SensorKind.RATE)) is not None:
            rate = gyro.in_base
            steps = Rotation.from_rotvec(0.5 * (rate[1:] + rate[:-1]) * np.diff(self.time)[:, None]).as_matrix()
            turned = np.empty((len(self.time), 3, 3))
            turned[0] = np.eye(3)
            for index, step in enumerate(steps):
                turned[index + 1] = turned[index] @ step
            return turned
        if len(self.attitude_time) > 1:
            inside = np.clip(self.time, self.attitude_time[0], self.attitude_time[-1])
            course = Slerp(self.attitude_time, Rotation.from_quat(self.attitude))(inside)
            return np.asarray((course[0].inv() * course).as_matrix())
        return np.broadcast_to(np.eye(3), (len(self.time), 3, 3))


def _positions(recording: Recording) -> list[str]:
    return [joint for joint in recording.joints if f"position.{joint}" in recording.channels]


def _intervals(recording: Recording, series: Mapping[SensorKind, tuple[Floats, Floats]]) -> dict[str, float]:
    """Return the median time between samples of each channel [s]."""
    times = {kind.value: sampled for kind, (sampled, _) in series.items()}
    times |= {f"position.{name}": recording.series(f"position.{name}")[0] for name in _positions(recording)}
    intervals = {channel: float(np.median(np.diff(sampled))) for channel, sampled in times.items() if len(sampled) > 1}
    joints = [interval for channel, interval in intervals.items() if channel.startswith("position.")]
    return intervals | ({"position": float(np.median(joints))} if joints else {})


def _longest_stretch(series: list[Floats]) -> tuple[float, float]:
    """Return first and last time of the longest stretch in which no series (n,) of sample times has a gap."""
    first, last = max(times[0] for times in series), min(times[-1] for times in series)
    ends = [(first, first), (last, last)]
    for times in series:
        steps = np.diff(times)
        ends += [(times[k], times[k + 1]) for k in np.flatnonzero(steps > GAP * np.median(steps))]
    ends.sort()
    reached, best = ends[0][1], (first, first)
    for begin, end in ends[1:]:
        if begin - reached > best[1] - best[0]:
            best = (reached, begin)
        reached = max(reached, end)
    return float(best[0]), float(best[1])


def _averages(times: Floats, values: Floats, grid: Floats) -> tuple[Floats, NDArray[np.bool_], float]:
    """Return the averages of samples about the instants of a grid, where there are samples, and how many on average."""
    width = float(grid[1] - grid[0])
    cell = np.floor((times - grid[0]) / width + 0.5 + 1e-9).astype(int)
    inside = (cell >= 0) & (cell < len(grid))
    cell, times, values = cell[inside], times[inside], values[inside]
    counts = np.bincount(cell, minlength=len(grid))
    filled = counts > 0

    def mean(samples: Floats) -> Floats:
        return np.bincount(cell, samples, len(grid))[filled] / counts[filled]

    at = mean(times)
    averaged = np.stack([np.interp(grid, at, mean(samples)) for samples in values.T], axis=1)
    nearest = np.abs(at[np.clip(np.searchsorted(at, grid), 0, len(at) - 1)] - grid)
    before = np.abs(at[np.clip(np.searchsorted(at, grid) - 1, 0, len(at) - 1)] - grid)
    close: NDArray[np.bool_] = np.asarray(np.minimum(nearest, before) <= SPREAD * width)
    return averaged, close, float(counts[filled].mean())
