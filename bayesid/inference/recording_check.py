"""Check of a study's recordings before the sampler runs, which shows their sampling, noise and likely mistakes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from bayesid._io.progress import Progress, silent
from bayesid._math.arrays import Floats
from bayesid._math.threads import each_in_threads
from bayesid.inference.data import Data
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import PredictedReadings, readings_at_start
from bayesid.recording.blocks import Blocks
from bayesid.recording.full_rate import ChannelSpectrum, channel_spectrum, spikes
from bayesid.recording.joint_motion import MeasuredMotion
from bayesid.recording.plausibility import whirling_rate
from bayesid.recording.recording import JOINT_FAMILIES, WHEEL_SPEED, Recording
from bayesid.recording.shocks import Shock, outside
from bayesid.recording.suspect_readings import SuspectReadings, suspect_readings
from bayesid.robot.robot import Robot
from bayesid.simulation.model import Manoeuvre, Model
from bayesid.simulation.sensors import Sensor, SensorKind

__all__ = ["ChannelSampling", "JointCheck", "RecordingCheck", "SensorCheck", "check_recording", "check_recordings"]


STILL = 1e-3
"""Range of a joint's motion below which it hardly excites the base [rad or m]."""


@dataclass(frozen=True)
class ChannelSampling:
    """Sampling of one sensor or joint.

    Attributes
    ----------
    name : str
        Name of the sensor or channel.
    samples : int
        Number of samples.
    interval, longest_gap : float
        Median and longest time between samples [s].
    """

    name: str
    samples: int
    interval: float
    longest_gap: float


@dataclass(frozen=True)
class JointCheck:
    """Motion of one joint and the quality of its smoothing.

    Attributes
    ----------
    name, unit : str
        Name of the joint and unit of its position.
    lowest, highest : float
        Range of its positions [rad or m].
    speed : float
        Largest speed [rad/s or m/s].
    sigma : float
        Standard deviation of the encoder noise that the smoothing uses [rad or m].
    declared : bool
        Whether this noise is declared and not estimated.
    chi2_per_sample : float
        Chi-square per sample of the smoothing spline.
    velocity_sd, acceleration_sd : float
        Medians over time of the standard deviations of the smoothed velocity and acceleration.
    """

    name: str
    unit: str
    lowest: float
    highest: float
    speed: float
    sigma: float
    declared: bool
    chi2_per_sample: float
    velocity_sd: float
    acceleration_sd: float

    @property
    def still(self) -> bool:
        """Whether the joint hardly moves."""
        return self.highest - self.lowest < STILL


@dataclass(frozen=True)
class SensorCheck:
    """Noise and delay of one sensor.

    Attributes
    ----------
    kind : SensorKind
    sigma : (3,) array
        Declared standard deviation of the white noise.
    measured_sigma : (3,) array or None
        Standard deviation estimated from quiet periods; None if there are too few quiet samples.
    sigma_error : float
        Relative standard error of ``measured_sigma``.
    delay : pair of float or None
        Delay of the samples behind the joints' motion and its standard deviation [s]; None if the motion is too weak
        to determine it.
    """

    kind: SensorKind
    sigma: Floats
    measured_sigma: Floats | None
    sigma_error: float
    delay: tuple[float, float] | None


@dataclass(frozen=True)
class RecordingCheck:
    """Result of `check_recording`.

    Attributes
    ----------
    name : str
        Name of the recording.
    duration : float
        Duration of the recording [s].
    channels : tuple of ChannelSampling
        Sampling of every sensor and joint.
    joints : tuple of JointCheck
        Motion of every joint.
    sensors : tuple of SensorCheck
        Noise and delay of every sensor.
    rate_is_differenced : bool
        Whether the rate is the difference of the attitude and no independent measurement.
    stuck : tuple of str
        Columns of sensors that hold one number alone, while others of their sensor change.
    unused : tuple of str
        Sensors that are recorded and not declared.
    spectra : tuple of ChannelSpectrum
        Spectrum of every channel of sensors and joints, and what is above the rate of the blocks.
    suspects : tuple of SuspectReadings
        Readings that no sensor gives.
    whirling : pair of str and float or None
        Column of the base's rate and its median size [rad/s] where that is unusually fast.
    shocks : tuple of Shock
        Times within which all inertial sensors are shaken, whose readings are omitted.
    """

    name: str
    duration: float
    channels: tuple[ChannelSampling, ...]
    joints: tuple[JointCheck, ...]
    sensors: tuple[SensorCheck, ...]
    rate_is_differenced: bool
    stuck: tuple[str, ...] = ()
    unused: tuple[str, ...] = ()
    suspects: tuple[SuspectReadings, ...] = ()
    spectra: tuple[ChannelSpectrum, ...] = ()
    whirling: tuple[str, float] | None = None
    shocks: tuple[Shock, ...] = ()

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on properties of the recording that need attention."""
        sentences = [f"{suspect}" for suspect in self.suspects]
        if self.whirling is not None:
            column, speed = self.whirling
            sentences.append(
                f"Half of the readings of {column} exceed {speed:.3g} rad/s, which is unusual: are they in rad/s?"
            )
        sentences += [
            f"From {shock.begin:.6g} to {shock.end:.6g} s all inertial sensors are shaken, as by a mass that moves "
            "inside the base: these readings are omitted."
            for shock in self.shocks
        ]
        sentences += [remark for spectrum in self.spectra for remark in spectrum.remarks]
        sentences += [
            f"Joint {joint.name} moves by only {joint.highest - joint.lowest:.2g} {joint.unit}."
            for joint in self.joints
            if joint.still
        ]
        sentences += [
            f"The spline does not follow joint {joint.name}: chi-square per sample {joint.chi2_per_sample:.2f}."
            for joint in self.joints
            if joint.chi2_per_sample > 1.5
        ]
        for sensor in self.sensors:
            if sensor.measured_sigma is not None:
                off = np.abs(sensor.measured_sigma / sensor.sigma - 1.0)
                if (off > max(0.3, 4.0 * sensor.sigma_error)).any():
                    sentences.append(
                        f"The noise of {sensor.kind.value} in quiet periods is "
                        f"{', '.join(f'{value:.2g}' for value in sensor.measured_sigma)} {sensor.kind.unit}; declared: "
                        f"{', '.join(f'{value:.2g}' for value in sensor.sigma)}."
                    )
            if sensor.delay is not None and abs(sensor.delay[0]) > 4.0 * sensor.delay[1]:
                side = "late" if sensor.delay[0] > 0.0 else "early"
                sentences.append(
                    f"The samples of {sensor.kind.value} appear {abs(sensor.delay[0]):.3g} ± {sensor.delay[1]:.2g} s "
                    f"{side} relative to the joints; alternatively, the robot or the model is wrong."
                )
        sentences += [f"Column {column} never changes: it is stuck." for column in self.stuck]
        sentences += [
            f"{family} is recorded, but not declared under [sensors]: it is not used." for family in self.unused
        ]
        if self.rate_is_differenced:
            sentences.append(
                "The rate is differenced from the attitude, not an independent sensor: declare one of them."
            )
        for channel in self.channels:
            if channel.longest_gap > 5.0 * channel.interval:
                sentences.append(f"{channel.name} has a gap of {channel.longest_gap:.3g} s.")
        return tuple(sentences)


def check_recordings(posterior: Posterior, progress: Progress = silent) -> list[RecordingCheck]:
    """Check all recordings of a posterior against the readings that the prior's centre predicts.

    Parameters
    ----------
    posterior : Posterior
    progress : Progress, optional
        Receiver of messages and of the share that is done.
    """
    predicted = readings_at_start(posterior)
    checks: list[RecordingCheck] = []
    for check in each_in_threads(lambda index: _check(posterior, index, predicted[index]), range(len(predicted))):
        checks.append(check)
        progress(len(checks) / len(predicted), f"{check.name} checked")
    return checks


def check_recording(posterior: Posterior, index: int) -> RecordingCheck:
    """Check one recording of a posterior against the readings that the prior's centre predicts.

    Parameters
    ----------
    posterior : Posterior
    index : int
        Number of the recording.
    """
    return _check(posterior, index, readings_at_start(posterior)[index])


def _check(posterior: Posterior, index: int, predicted: PredictedReadings) -> RecordingCheck:
    manoeuvre, model = posterior.manoeuvres[index], posterior.model
    recording = manoeuvre.recording
    return RecordingCheck(
        name=recording.name,
        duration=float(recording.time[-1] - recording.time[0]),
        channels=_channels(recording, model),
        joints=_joints(manoeuvre, model.robot),
        sensors=tuple(_sensor(sensor, posterior.data, index, predicted) for sensor in model.sensors),
        rate_is_differenced=_is_differenced(manoeuvre, model),
        stuck=_stuck(recording, model),
        unused=_unused(recording, model),
        suspects=tuple(suspect_readings(recording)),
        spectra=_spectra(posterior, index),
        whirling=whirling_rate(recording),
        shocks=posterior.data.recorded[index].shocks,
    )


def _spectra(posterior: Posterior, index: int) -> tuple[ChannelSpectrum, ...]:
    """Return the spectra of the sensors' readings and of the joints' positions and speeds."""
    data, spectra = posterior.data, []
    for kind in posterior.model.channels.kinds:
        if kind.is_difference:
            (time, values), blocks = data.samples_of(index, kind), len(data.measured(index, kind)[0])
            quiet = outside(data.recorded[index].shocks, time)
            time, values = time[quiet], values[quiet]
            levels = data.sigma_per_sample(index, kind)
            for name, column, level in zip(kind.components, values.T, levels, strict=True):
                gone, _ = spikes(column, float(level))
                gone = gone if blocks < len(time) else np.zeros_like(gone)
                spectrum = channel_spectrum(name, time[~gone], column[~gone], blocks, float(level), int(gone.sum()))
                spectra.append(spectrum)
    motion = posterior.manoeuvres[index].motion
    for name, joint in zip(motion.names, motion.joints, strict=True) if isinstance(motion, MeasuredMotion) else ():
        for series, sigma in zip(joint.series, joint.sigmas, strict=True):
            family, every = JOINT_FAMILIES[series.derivative], series.every_sample
            column = f"{family}.{name}"
            spectra.append(channel_spectrum(column, every.time, every.value, len(series.time), sigma))
    return tuple(spectra)


def _stuck(recording: Recording, model: Model) -> tuple[str, ...]:
    """Return the columns of the sensors that never change, where another column of the sensor does."""
    stuck: list[str] = []
    for sensor in model.sensors:
        columns = sensor.kind.columns
        still = [column for column in columns if np.ptp(recording.series(column)[1]) == 0.0]
        stuck += still if len(still) < len(columns) else []
    return tuple(stuck)


def _unused(recording: Recording, model: Model) -> tuple[str, ...]:
    """Return the sensors that a recording holds and the model does not have."""
    recorded = {column.partition(".")[0] for column in recording.channels}
    read = {sensor.kind.value for sensor in model.sensors} | ({"torque"} if model.torque is not None else set())
    known = [SensorKind.RATE.value, SensorKind.ACCEL.value, SensorKind.ATTITUDE.value, "torque"]
    return tuple(family for family in known if family in recorded - read)


def _channels(recording: Recording, model: Model) -> tuple[ChannelSampling, ...]:
    series = [(sensor.kind.value, recording.series(sensor.kind.columns[0])[0]) for sensor in model.sensors]
    joints = [f"{family}.{joint.name}" for joint in model.robot.joints for family in JOINT_FAMILIES]
    joints += [f"{WHEEL_SPEED}.{wheel.name}" for wheel in model.robot.wheels]
    series += [(name, recording.series(name)[0]) for name in joints if name in recording.channels]
    return tuple(
        ChannelSampling(name, len(time), float(np.median(np.diff(time))), float(np.diff(time).max()))
        for name, time in series
    )


def _joints(manoeuvre: Manoeuvre, robot: Robot) -> tuple[JointCheck, ...]:
    motion = manoeuvre.motion
    time = Blocks.of(manoeuvre.recording.time, manoeuvre.blocks_per_second).time
    state = motion.evaluate(time)
    checks = []
    for index, joint in enumerate(robot.joints):
        fit = motion.joints[index] if isinstance(motion, MeasuredMotion) else None
        sd = np.zeros((3, 1)) if fit is None else fit.standard_deviation(time)
        checks.append(
            JointCheck(
                name=joint.name,
                unit=joint.unit,
                lowest=float(state.position[:, index].min()),
                highest=float(state.position[:, index].max()),
                speed=float(np.abs(state.velocity[:, index]).max()),
                sigma=0.0 if fit is None else fit.sigmas[0],
                declared=True if fit is None else fit.declared[0],
                chi2_per_sample=0.0 if fit is None else fit.chi2 / fit.samples,
                velocity_sd=float(np.median(sd[1])) if fit is not None else 0.0,
                acceleration_sd=float(np.median(sd[2])) if fit is not None else 0.0,
            )
        )
    return tuple(checks)


def _sensor(sensor: Sensor, data: Data, index: int, predicted: PredictedReadings) -> SensorCheck:
    sigma = data.sigma_per_sample(index, sensor.kind)
    if not sensor.kind.mounted:
        return SensorCheck(sensor.kind, sigma, None, 0.0, None)
    time, measured = data.measured(index, sensor.kind)
    expected = predicted.channels[sensor.kind][np.searchsorted(predicted.time, time)]
    stamps, samples = data.samples_of(index, sensor.kind)
    between = np.stack([np.interp(stamps, time, column) for column in expected.T], axis=1)
    measured_sigma, sigma_error = _quiet_sigma(between, samples)
    return SensorCheck(
        kind=sensor.kind,
        sigma=sigma,
        measured_sigma=measured_sigma,
        sigma_error=sigma_error,
        delay=_delay(time, expected, measured),
    )


def _is_differenced(manoeuvre: Manoeuvre, model: Model) -> bool:
    """Return whether the rate repeats the noise of the attitude, by a backward, forward or central difference."""
    sensors = {sensor.kind: sensor for sensor in model.sensors}
    if not {SensorKind.RATE, SensorKind.ATTITUDE} <= set(sensors):
        return False
    time, quaternion = manoeuvre.recording.vector("attitude", ("x", "y", "z", "w"))
    rate_time, rate = manoeuvre.recording.vector("rate")
    common, here, there = np.intersect1d(time, rate_time, return_indices=True)
    if len(common) < 10:
        return False
    turned = Rotation.from_quat(quaternion[here])
    step = np.diff(common)[:, None]
    difference = (turned[:-1].inv() * turned[1:]).as_rotvec() / step
    in_base = rate[there] @ sensors[SensorKind.RATE].rotation.T
    central = 0.5 * (difference[1:] + difference[:-1])
    candidates = (in_base[:-1] - difference, in_base[1:] - difference, in_base[1:-1] - central)
    noise = np.sqrt(2.0) * sensors[SensorKind.ATTITUDE].noise.sigma(1.0).max() / float(np.median(step))
    return min(float(np.sqrt((miss**2).mean())) for miss in candidates) < 0.3 * noise


def _quiet_sigma(expected: Floats, measured: Floats) -> tuple[Floats | None, float]:
    """Return the noise and its relative error, from third differences where the expected signal hardly changes."""
    rough = np.abs(np.diff(expected, n=3, axis=0)).max(axis=1)
    difference = np.diff(measured, n=3, axis=0)
    quiet = rough < 0.2 * np.median(np.abs(difference))
    if quiet.sum() < 30:
        return None, 0.0
    # third differences of white noise have 20 times its variance and are correlated over three samples
    return np.sqrt((difference[quiet] ** 2).mean(axis=0) / 20.0), float(np.sqrt(2.31 / (2.0 * quiet.sum())))


def _delay(time: Floats, expected: Floats, measured: Floats) -> tuple[float, float] | None:
    """Return the delay of the measured against the expected signal [s], with gain and trend fitted axis by axis."""
    estimates = []
    for axis in range(3):
        slope = np.gradient(expected[:, axis], time)
        basis = np.column_stack(
            [expected[:, axis], slope, np.vander((time - time.mean()) / (np.ptp(time) + 1e-300), 3)]
        )
        scale = np.abs(basis).max(axis=0) + 1e-300
        solution, *_ = np.linalg.lstsq(basis / scale, measured[:, axis], rcond=None)
        residual = measured[:, axis] - basis / scale @ solution
        covariance = np.linalg.pinv((basis / scale).T @ (basis / scale)) * residual.var()
        gain, delay = solution[0] / scale[0], -solution[1] / scale[1]
        sd = np.sqrt(covariance[1, 1]) / scale[1]
        if np.corrcoef(expected[:, axis], measured[:, axis])[0, 1] ** 2 > 0.9 and gain != 0.0:
            estimates.append((delay / gain, sd / abs(gain)))
    if not estimates:
        return None
    weight = np.array([1.0 / sd**2 for _, sd in estimates])
    values = np.array([value for value, _ in estimates])
    mean = float((weight * values).sum() / weight.sum())
    # errors of the robot also shift the estimates, which then differ between the axes
    scatter = float(np.sqrt((weight * (values - mean) ** 2).sum() / weight.sum()))
    return mean, float(np.hypot(weight.sum() ** -0.5, scatter))
