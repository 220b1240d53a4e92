"""Data of a likelihood: the samples of all recordings, their time grids and the whitening of their noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from bayesid._io.errors import InputError
from bayesid._math.arrays import Floats, Integers
from bayesid._math.on_device import on_device
from bayesid.inference import whitening
from bayesid.inference.compiled import Arrays, Averaging
from bayesid.inference.encoder_noise import SampledMotion, joint_sensitivity, wheel_sensitivity
from bayesid.inference.wheel_noise import wheel_errors
from bayesid.inference.whitening import MotionErrors, NoiseChannel, SampleNoise, Whitening, Window
from bayesid.recording.actions import Actions
from bayesid.recording.blocks import Blocks
from bayesid.recording.full_rate import spikes
from bayesid.recording.joint_motion import MeasuredMotion, Motion
from bayesid.recording.lattice import lattice_step, mean_deviation
from bayesid.recording.recording import Recording
from bayesid.recording.shocks import ShakenSensor, Shock, outside, shocks
from bayesid.recording.wheel_motion import WheelMotion, check_wheels
from bayesid.robot.robot import Robot
from bayesid.simulation.dynamics import Grid, TimeTables
from bayesid.simulation.effects.joint_friction import STANDSTILL, JointFriction
from bayesid.simulation.instant import Readings
from bayesid.simulation.joint_torques import TorqueSensor
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Filter, Sensor, SensorKind
from bayesid.simulation.time_grid import build_grid, lengthened, pad_grids, rounded

__all__ = ["Data", "RecordedSamples", "Series", "attitudes_of", "first_rate", "grids_of", "stacked", "with_whitenings"]


@dataclass(frozen=True)
class Data:
    """Samples of R recordings with the noise that is assumed for them; immutable.

    Parameters
    ----------
    model : Model
        Model whose sensors made the recordings.
    manoeuvres : (R,) tuple of Manoeuvre
        Recorded manoeuvres.
    recorded : (R,) tuple of RecordedSamples
        Samples of each recording.
    whitenings : (R,) tuple of Whitening
        Whitening of each recording.
    left_out : (R,) tuple of (O, C) arrays of bool
        Masks of the whitened scalars that the likelihood leaves out.
    step : float
        Longest integration step [s].
    arrays : Arrays
        The same data in the form that compiled code takes.
    """

    model: Model
    manoeuvres: tuple[Manoeuvre, ...]
    recorded: tuple[RecordedSamples, ...]
    whitenings: tuple[Whitening, ...]
    left_out: tuple[NDArray[np.bool_], ...]
    step: float
    arrays: Arrays

    @property
    def samples(self) -> int:
        """Number of scalar samples that the likelihood uses."""
        return sum(of_recording.samples for of_recording in self.whitenings)

    @property
    def residual_shape(self) -> tuple[int, int, int]:
        """Shape (R, O, C) of the whitened residual."""
        return (len(self.manoeuvres), self.arrays.start.shape[1], self.arrays.weights.shape[2])

    def times(self, index: int) -> Floats:
        """Return the times at which any sensor of a recording was sampled, or means of blocks, shape (T,) [s]."""
        return self.recorded[index].time

    def measured(self, index: int, kind: SensorKind) -> Series:
        """Return the recorded times and values of one sensor in one recording, means where it is reduced to blocks.

        Parameters
        ----------
        index : int
            Number of the recording.
        kind : SensorKind
        """
        return self.recorded[index].series[kind]

    def torques(self, index: int) -> Series:
        """Return the recorded times (n,) and joint torques (n, joints) of one recording."""
        return self.recorded[index].torque

    def sigma(self, index: int, kind: SensorKind) -> Floats:
        """Return the standard deviations of the white noise in `measured` of one sensor in one recording, (size,).

        Parameters
        ----------
        index : int
            Number of the recording.
        kind : SensorKind
        """
        return self.recorded[index].sigma(kind)

    def sigma_per_sample(self, index: int, kind: SensorKind) -> Floats:
        """Return the standard deviations of the white noise of the samples of one sensor in one recording, (size,).

        Parameters
        ----------
        index : int
            Number of the recording.
        kind : SensorKind
        """
        return self.recorded[index].sigma_per_sample(kind)

    def samples_of(self, index: int, kind: SensorKind) -> Series:
        """Return times and values of all samples of one sensor in one recording, before any average.

        Parameters
        ----------
        index : int
            Number of the recording.
        kind : SensorKind
        """
        return self.manoeuvres[index].recording.vector(kind.value, kind.axes)

    def spikes(self, kind: SensorKind) -> Floats:
        """Return how far each spike of one sensor that no mean holds departs [standard deviations], all recordings.

        Parameters
        ----------
        kind : SensorKind
        """
        return np.concatenate([recording.spikes.get(kind.value, np.zeros(0)) for recording in self.recorded])

    def left_out_times(self, index: int) -> dict[SensorKind, Floats]:
        """Return, for each sensor, the stamps of the samples that the likelihood leaves out of one recording [s]."""
        mask, rows, recorded = self.left_out[index], self.whitenings[index].rows, self.recorded[index]
        result = {}
        for kind in self.model.channels.kinds:
            gone = mask[:, self.model.channels.of(kind)].any(axis=1)
            if gone.any():
                blocks = recorded.blocks[kind.value]
                result[kind] = blocks.stamps[blocks.samples_of(np.searchsorted(blocks.time, recorded.time[rows[gone]]))]
        return result


def grids_of(
    model: Model, manoeuvres: Sequence[Manoeuvre], recorded: Sequence[RecordedSamples], step: float
) -> list[Grid]:
    """Return the grid of integration nodes and samples of every recording, for an integration step [s].

    Parameters
    ----------
    model : Model
    manoeuvres : sequence of Manoeuvre
    recorded : (R,) sequence of RecordedSamples
    step : float
        Integration step [s].
    """
    grids = []
    for index, (manoeuvre, samples) in enumerate(zip(manoeuvres, recorded, strict=True)):
        effects = [effect.in_recording(index) for effect in model.effects]
        grid = build_grid(
            model.robot,
            tuple(prior.name for prior in model.priors),
            manoeuvre.motion,
            samples.nodes,
            step,
            orbit=model.orbit,
            argument_of_latitude=manoeuvre.argument_of_latitude,
            actions=Actions.from_recording(manoeuvre.recording, model.robot.wheels, manoeuvre.blocks_per_second),
            effects=effects,
            torques=model.torque is not None,
            speed_errors=model.has_speed_errors,
            jumps=[instant for effect in effects for instant in effect.jumps(float(samples.nodes[-1]))],
        )
        grids.append(_numbered(grid, index))
    return grids


def _numbered(grid: Grid, index: int) -> Grid:
    """Return the grid of a recording with the recording's number in its environment."""

    def numbered(tables: TimeTables) -> TimeTables:
        number = np.full(np.shape(tables.environment.time), float(index))
        return tables._replace(environment=tables.environment._replace(recording=number))

    return grid._replace(node=numbered(grid.node), sample=numbered(grid.sample))


def attitudes_of(manoeuvres: Sequence[Manoeuvre]) -> Floats:
    """Return the attitudes of the base at time 0 as quaternions x, y, z, w, shape (R, 4)."""
    return np.stack([np.asarray(manoeuvre.attitude, dtype=float) for manoeuvre in manoeuvres])


def stacked(
    model: Model,
    manoeuvres: Sequence[Manoeuvre],
    recorded: Sequence[RecordedSamples],
    grids: Sequence[Grid],
    whitenings: Sequence[Whitening],
) -> Arrays:
    """Stack all recordings, padded coarsely so that recordings of about the same length share compiled code.

    Parameters
    ----------
    model : Model
    manoeuvres : sequence of Manoeuvre
    recorded : (R,) sequence of RecordedSamples
    grids : (R,) sequence of Grid
    whitenings : (R,) sequence of Whitening
    """
    steps, samples = max(len(grid.step) for grid in grids), max(len(grid.step_of) for grid in grids)
    grid = pad_grids(grids, rounded(steps), rounded(samples))
    count = grid.step_of.shape[1]

    def padded(values: Sequence[Floats]) -> jnp.ndarray:
        return on_device(np.stack([lengthened(series, count) for series in values]))

    measured = Readings(
        padded([recording.nodes for recording in recorded]),
        {kind.value: padded([recording.gridded(kind) for recording in recorded]) for kind in model.channels.kinds},
        padded([recording.gridded_torque for recording in recorded]),
        on_device(np.arange(float(len(recorded)))),
    )
    offset = on_device(np.zeros((len(recorded), count, model.channels.count)))
    none = on_device(np.zeros(0))
    attitudes, averaging = on_device(attitudes_of(manoeuvres)), _averaging(model, recorded)
    return with_whitenings(Arrays(grid, attitudes, measured, offset, none, none, averaging), whitenings)


def _averaging(model: Model, recorded: Sequence[RecordedSamples]) -> Averaging | None:
    """Return the means that are the rows of the residual; None where no sensor is reduced to blocks."""
    if not any(recording.reduced for recording in recorded):
        return None
    sizes = [(name, columns.stop - columns.start) for name, columns in model.channels.groups()]
    length = rounded(max(len(recording.time) for recording in recorded))

    def stacked(part: int) -> Floats:
        each = [
            np.concatenate([np.repeat(of[name][part][:, :, None], size, axis=2) for name, size in sizes], axis=2)
            for of in ({name: recording.average(name) for name, _ in sizes} for recording in recorded)
        ]
        return np.stack([lengthened(rows, length) for rows in each])

    return Averaging(on_device(stacked(0).astype(np.int32)), on_device(stacked(1)))


def with_whitenings(arrays: Arrays, whitenings: Sequence[Whitening]) -> Arrays:
    """Return the arrays with another whitening.

    Parameters
    ----------
    arrays : Arrays
    whitenings : (R,) sequence of Whitening
    """
    outputs = rounded(max(len(of_recording.start) for of_recording in whitenings))
    width = max(of_recording.weights.shape[2] for of_recording in whitenings)
    channels = whitenings[0].weights.shape[1]
    weights = np.zeros((len(whitenings), outputs, channels, width, channels))
    start = np.zeros((len(whitenings), outputs), dtype=np.int32)
    for row, of_recording in enumerate(whitenings):
        weights[row, : len(of_recording.start), :, : of_recording.weights.shape[2]] = of_recording.weights
        start[row, : len(of_recording.start)] = of_recording.start
    return arrays._replace(weights=on_device(weights), start=on_device(start))


FEWEST = 4
"""Smallest number of samples that a declared sensor must have in a recording."""

Series = tuple[Floats, Floats]
"""Times (n,) and values (n, axes) of one sensor."""


@dataclass(frozen=True)
class RecordedSamples:
    """Sensor samples of one recording on one grid of all times at which any sensor was sampled.

    Samples of a sensor that is faster than the blocks of its manoeuvre are means over these.

    Parameters
    ----------
    motion : Motion
        Motion of the joints.
    sensors : tuple of Sensor
    torque_sensor : TorqueSensor or None
    time : (T,) array
        Times of the grid [s].
    nodes : (N,) array
        Instants that are simulated [s]: those times, or what means over blocks are predicted from.
    blocks : mapping of str to Blocks
        Samples that each reading is the mean of, by the family of the channels.
    steps : mapping of str to tuple
        Step of the lattice on which the samples of each column lie, None where on none or where nothing is reduced.
    spikes : mapping of str to array
        How far each sample departs that no mean over a block holds, since it is a spike [standard deviations].
    shocks : tuple of Shock
        Times within which all inertial sensors are shaken, whose samples are left out.
    series : mapping of SensorKind to Series
        Recorded times and readings of each sensor.
    torque : Series
        Recorded times and torques of the joints that have a torque sensor.
    torque_rows : tuple of integer arrays
        Rows of the grid whose torque is used, for each of those joints; a joint with dry friction is left out while it
        stands still, when its friction is undetermined.
    wheels : WheelMotion
        Motion of the wheels.
    """

    motion: Motion
    sensors: tuple[Sensor, ...]
    torque_sensor: TorqueSensor | None
    time: Floats
    nodes: Floats
    blocks: Mapping[str, Blocks]
    steps: Mapping[str, tuple[float | None, ...]]
    spikes: Mapping[str, Floats]
    shocks: tuple[Shock, ...]
    series: Mapping[SensorKind, Series]
    torque: Series
    torque_rows: tuple[Integers, ...]
    wheels: WheelMotion

    @classmethod
    def of(cls, model: Model, manoeuvre: Manoeuvre, index: int = 0) -> RecordedSamples:
        """Return the samples of the sensors of a model in one recording.

        Parameters
        ----------
        model : Model
        manoeuvre : Manoeuvre
        index : int
            Number of the recording, for effects that differ between recordings.

        Raises
        ------
        InputError
            If the recording lacks a declared sensor, has too few samples of it, or ends earlier for a joint.
        """
        recording, per_second = manoeuvre.recording, manoeuvre.blocks_per_second
        check_wheels(recording, model.robot.wheels)
        effects = [effect.in_recording(index) for effect in model.effects]
        jumps = [instant for effect in effects for instant in effect.jumps(float(recording.time[-1]))]
        recorded = {sensor.kind: _series(recording, sensor.kind.value, sensor.kind.axes) for sensor in model.sensors}
        shaken = shocks_of(model.sensors, recorded, per_second)
        middles = [shock.middle for shock in shaken]
        breaks = np.concatenate([Actions.from_recording(recording, (), per_second).changes, jumps, middles])
        blocks: dict[str, Blocks] = {}
        steps: dict[str, tuple[float | None, ...]] = {}
        departures: dict[str, Floats] = {}
        series: dict[SensorKind, Series] = {}
        for sensor in model.sensors:
            kind = sensor.kind
            stamps, values = recorded[kind]
            quiet = outside(shaken, stamps)
            stamps, values = stamps[quiet], values[quiet]
            if kind.is_difference and Blocks.of(stamps, per_second).reduced:
                sigma = sensor.noise.sigma(float(np.median(np.diff(stamps))))
                each = [spikes(column, float(level)) for column, level in zip(values.T, sigma, strict=True)]
                departures[kind.value] = np.concatenate([part for _, part in each])
                kept = ~np.any([gone for gone, _ in each], axis=0)
                stamps, values = stamps[kept], values[kept]
            blocks[kind.value] = one = Blocks.of(stamps, per_second, breaks)
            series[kind] = one.time, kind.mean(values, one.weight_of_samples, one.first) if one.reduced else values
            steps[kind.value] = _steps(one, values) if kind.is_difference else (None,) * kind.size
        torque: Series = (np.zeros(0), np.zeros((0, 0)))
        if model.torque is not None:
            stamps, values = _series(recording, "torque", model.torque.joints)
            blocks["torque"] = one = Blocks.of(stamps, per_second, breaks)
            torque, steps["torque"] = (one.time, one.mean(values)), _steps(one, values)
        time = np.unique(np.concatenate([one.time for one in blocks.values()]))
        nodes = np.unique(np.concatenate([one.node.ravel() for one in blocks.values()]))
        if isinstance(manoeuvre.motion, MeasuredMotion):
            manoeuvre.motion.check_extent(float(nodes[-1]), recording.file or recording.name)
        rows = np.searchsorted(time, torque[0])
        used = tuple(rows[moving] for moving in _moving(model, manoeuvre.motion, torque[0]))
        wheels = WheelMotion.from_recording(recording, model.robot.wheels, per_second)
        return cls(
            manoeuvre.motion,
            model.sensors,
            model.torque,
            time,
            nodes,
            blocks,
            steps,
            departures,
            tuple(shaken),
            series,
            torque,
            used,
            wheels,
        )

    @property
    def reduced(self) -> bool:
        """Whether any sensor's samples are means over blocks."""
        return any(one.reduced for one in self.blocks.values())

    def average(self, family: str) -> tuple[Integers, Floats]:
        """Return the nodes and weights (T, 2) of each row's mean of a family of channels.

        Rows at which it was not sampled have those of a sensor that was.

        Parameters
        ----------
        family : str
        """
        node, weight = np.zeros((len(self.time), 2), dtype=int), np.zeros((len(self.time), 2))
        for one in (*self.blocks.values(), self.blocks[family]):
            rows = np.searchsorted(self.time, one.time)
            node[rows], weight[rows] = np.searchsorted(self.nodes, one.node), one.weight
        return node, weight

    def averaged(self, values: Floats, family: str | None = None, kind: SensorKind | None = None) -> Floats:
        """Return the means of predictions at the nodes, (N, ...) -> (T, ...).

        Parameters
        ----------
        values : (N, ...) array
        family : str, optional
            Family of channels whose blocks they are averaged over, by default that of the first sensor.
        kind : SensorKind, optional
            Whose readings they are, by default a quantity that may be added.
        """
        if not self.reduced:
            return values
        node, weight = self.average(family or next(iter(self.blocks)))
        if kind is None:
            return np.einsum("tk,tk...->t...", weight, values[node])
        return kind.mean(values[node.ravel()], weight.ravel(), np.arange(0, weight.size, 2))

    def with_sensors(self, sensors: Sequence[Sensor], torque: TorqueSensor | None) -> RecordedSamples:
        """Return the same samples with other noise of the sensors.

        Parameters
        ----------
        sensors : sequence of Sensor
        torque : TorqueSensor or None
        """
        return replace(self, sensors=tuple(sensors), torque_sensor=torque)

    def rows(self, kind: SensorKind) -> Integers:
        """Return the rows of the grid at which a sensor was sampled."""
        return np.searchsorted(self.time, self.series[kind][0])

    def gridded(self, kind: SensorKind) -> Floats:
        """Return the readings of a sensor at the nodes, (N, axes), its reading at rest where it was not sampled."""
        values = np.tile(np.array(kind.rest), (len(self.nodes), 1))
        for side in self.blocks[kind.value].node.T:
            values[np.searchsorted(self.nodes, side)] = self.series[kind][1]
        return values

    @property
    def gridded_torque(self) -> Floats:
        """Torques at the nodes, shape (N, n), zero where they were not sampled."""
        values = np.zeros((len(self.nodes), self.torque[1].shape[1]))
        for side in self.blocks["torque"].node.T if "torque" in self.blocks else ():
            values[np.searchsorted(self.nodes, side)] = self.torque[1]
        return values

    @property
    def first_rate(self) -> Floats:
        """Rate of the base at the start from the first samples, base axes [rad/s]; zero if no rate is measured."""
        for sensor in self.sensors:
            if sensor.kind == SensorKind.RATE:
                return first_rate(sensor, self.series[SensorKind.RATE][1])
        return np.zeros(3)

    def sigma(self, kind: SensorKind) -> Floats:
        """Return the standard deviations of the white noise of a reading of a sensor, shape (size,)."""
        return self.sigma_per_sample(kind) / np.sqrt(self.blocks[kind.value].typical)

    def sigma_per_sample(self, kind: SensorKind) -> Floats:
        """Return the standard deviations of the white noise of a sample of a sensor, shape (size,)."""
        sensor = next(sensor for sensor in self.sensors if sensor.kind == kind)
        return sensor.noise.sigma(self.blocks[kind.value].interval)

    def noise_model(self, robot: Robot, seen: SampledMotion, window: Window | None = None) -> SampleNoise:
        """Return the second moments of the errors.

        Parameters
        ----------
        robot : Robot
            Robot whose dynamics carries the encoders' noise to the sensors.
        seen : SampledMotion
            Motion of the base on the grid.
        window : Window, optional
            Earlier blocks that samples are conditioned on, where they are known.
        """
        torque_sigma = () if self.torque_sensor is None else self.torque_sensor.sigma
        channels = [channel for sensor in self.sensors for channel in self._noise_channels(sensor)]
        for column, (sigma, rows) in enumerate(zip(torque_sigma, self.torque_rows, strict=True)):
            one = self.blocks["torque"]
            relative = mean_deviation(one, self.torque[1][:, column], sigma, self.steps["torque"][column])
            used = np.searchsorted(one.time, self.time[rows])
            channels.append(NoiseChannel(sigma * relative[used], rows, Filter()))
        state = self.motion.evaluate(self.time)
        torques = () if self.torque_sensor is None else self.torque_sensor.columns(robot)
        alone = window is not None and window.longest == 0 and all(sensor.filter == Filter() for sensor in self.sensors)
        lags = 0 if alone else min(max(whitening.WINDOWS), len(self.time) - 1)
        errors = []
        if isinstance(self.motion, MeasuredMotion) and robot.joints:
            sensitivity = joint_sensitivity(robot, state, seen, self.sensors, torques)
            errors.append(MotionErrors(sensitivity, self.motion_covariance(self.motion, lags)))
        if self.wheels.is_uncertain:
            slopes = wheel_sensitivity(robot, state, seen, self.sensors, torques)
            errors.append(wheel_errors(self.wheels, self.time, seen.rate, slopes, lags))
        return SampleNoise(self.time, channels, errors)

    def motion_covariance(self, motion: MeasuredMotion, lags: int) -> Floats:
        """Return the covariances of `MeasuredMotion.lag_covariance` for the means over the blocks.

        Where an acceleration may jump, what is known of it differs by orders of magnitude within a block, so that the
        covariance at the middle is not that of the mean.

        Parameters
        ----------
        motion : MeasuredMotion
        lags : int
            Largest distance in rows.
        """
        node, weight = self.average(next(iter(self.blocks)))
        instants = self.nodes[node].ravel()
        if not self.reduced or (np.diff(instants) < 0.0).any():  # blocks of several sensors overlap
            return motion.lag_covariance(self.time, lags)
        between = motion.lag_covariance(instants, 2 * lags + 1)
        mean = np.zeros((len(between), lags + 1, len(node), *between.shape[3:]))
        for lag, one, other in product(range(lags + 1), range(2), range(2)):
            shares = (weight[lag:, one] * weight[: len(weight) - lag, other])[:, None, None]
            places = 2 * lag + one - other
            if places >= 0:
                mean[:, lag, lag:] += shares * between[:, places, 2 * lag + one :: 2]
            else:  # the second node of a block is later than its first
                mean[:, lag, lag:] += shares * np.swapaxes(between[:, 1, 1::2], -1, -2)
        return mean

    def _noise_channels(self, sensor: Sensor) -> list[NoiseChannel]:
        """Return the noise of every axis of a sensor."""
        one, rows = self.blocks[sensor.kind.value], self.rows(sensor.kind)
        noise, filtered = sensor.coloured, _filter_of_blocks(sensor.filter, one)
        levels = (0.0,) * sensor.kind.size if noise is None else noise.sigma
        memory, values = 1.0 if noise is None else noise.time, self.series[sensor.kind][1]
        channels = []
        for axis, (sigma, level) in enumerate(zip(self.sigma_per_sample(sensor.kind), levels, strict=True)):
            relative = mean_deviation(one, values[:, axis], float(sigma), self.steps[sensor.kind.value][axis])
            channels.append(NoiseChannel(sigma * relative, rows, filtered, (level, memory), one.count, one.interval))
        return channels


def shocks_of(sensors: Sequence[Sensor], recorded: Mapping[SensorKind, Series], per_second: float) -> list[Shock]:
    """Return the times within which all inertial sensors of a recording are shaken.

    Parameters
    ----------
    sensors : sequence of Sensor
    recorded : mapping of SensorKind to Series
        All samples of each of them.
    per_second : float
        Rate of the blocks that they are averaged over [1/s].
    """
    samples = []
    for sensor in sensors:
        if sensor.kind in (SensorKind.RATE, SensorKind.ACCEL):
            time, values = recorded[sensor.kind]
            samples.append(ShakenSensor(time, values, sensor.noise.sigma(float(np.median(np.diff(time))))))
    return shocks(samples, per_second)


def _steps(blocks: Blocks, values: Floats) -> tuple[float | None, ...]:
    return tuple(lattice_step(column) if blocks.reduced else None for column in values.T)


def _filter_of_blocks(given: Filter, blocks: Blocks) -> Filter:
    """Return the filter of samples as one of means over blocks, which leave nothing of what is faster than they."""
    if not blocks.reduced:
        return given
    rate = 1.0 / float(np.median(np.diff(blocks.time)))
    low_pass = given.low_pass if given.low_pass is not None and given.low_pass < 0.5 * rate else None
    return Filter(low_pass, max(1, round(given.decimate / blocks.typical)))


def first_rate(sensor: Sensor, values: Floats) -> Floats:
    """Return the mean of the first three samples (n, 3) of a rate sensor, base axes, as the rate at the start.

    Parameters
    ----------
    sensor : Sensor
    values : (n, 3) array
        Its readings [rad/s].
    """
    return np.asarray(sensor.rotation @ values[:3].mean(axis=0))


def _moving(model: Model, motion: Motion, time: Floats) -> list[NDArray[np.bool_]]:
    """Return a mask of the samples of each torque sensor that are used, which leaves out dry friction at standstill."""
    if model.torque is None:
        return []
    state = motion.evaluate(time)
    rubbing = {effect.place for effect in model.effects if isinstance(effect, JointFriction)}
    speed = np.abs(state.velocity[:, model.torque.columns(model.robot)])
    return [
        speed[:, column] > (STANDSTILL if joint in rubbing else -1.0)
        for column, joint in enumerate(model.torque.joints)
    ]


def _series(recording: Recording, family: str, axes: Sequence[str]) -> Series:
    """Return the samples of a declared sensor, and raise an error if columns or samples are missing."""
    if absent := [axis for axis in axes if f"{family}.{axis}" not in recording.channels]:
        raise InputError(
            f"no column {family}.{'|'.join(absent)}, but the study declares the sensor",
            file=recording.file or recording.name,
            remedy="Record the sensor or remove it from [sensors]",
        )
    time, values = recording.vector(family, tuple(axes))
    if len(time) < FEWEST:
        raise InputError(
            f"only {len(time)} samples of {family}",
            file=recording.file or recording.name,
            remedy=f"Record at least {FEWEST}, or remove the sensor from [sensors]",
        )
    return time, values
