"""The report of a check: the recordings as they were read, before anything is identified."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bayesid._io.words import counted
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import sensor_fits
from bayesid.inference.recording_check import RecordingCheck
from bayesid.recording.convention import Convention
from bayesid.recording.recording import WHEEL_SPEED, Recording
from bayesid.report import figures
from bayesid.report.convention_report import add_conventions
from bayesid.report.document import Document
from bayesid.report.numbers import format_fixed, format_number, format_unit

__all__ = ["check_report"]

DRAWN = 12  # most recordings that are shown in full


def check_report(
    posterior: Posterior,
    checks: Sequence[RecordingCheck],
    title: str,
    file: Path,
    *,
    conventions: Sequence[Convention] = (),
    origin: str = "",
) -> None:
    """Write the report of a check as PDF, whole or not at all.

    Parameters
    ----------
    posterior : Posterior
    checks : sequence of RecordingCheck
        Check of each recording.
    title : str
        Title of the study.
    file : path
    conventions : sequence of Convention, optional
        Wrong ones.
    origin : str, optional
        Where the report comes from: files with their hashes, version, seed and command.
    """
    document = Document(title, "Check of the study and its recordings")
    document.foot(origin)
    document.section("Summary")
    document.paragraph(
        f"The study has {counted(len(checks), 'recording')} with {posterior.samples} scalar samples, and "
        f"{counted(posterior.size, 'unknown')}. The integration step is {posterior.step:g} s. No identification was "
        "run: simulated values are those of the robot as given."
    )
    remarks = [f"{check.name}: {warning}" for check in checks for warning in check.warnings]
    if remarks or not conventions:
        document.items(remarks or ["No irregularities were detected."])
    if conventions:
        add_conventions(document, conventions)
        document.section("Robot")
    robot = posterior.model.robot
    time = posterior.manoeuvres[0].recording.time
    if robot.joints:
        poses = np.linspace(time[0], time[-1], 5)[:-1]
        document.figure(
            figures.robot_pose(robot, posterior.manoeuvres[0].motion, poses), "The robot during the first recording."
        )
    document.figure(
        figures.plot_robot(robot),
        "The robot as described by its file; a link without a shape is drawn as a homogeneous box with the same mass, "
        "centre of mass and inertia.",
    )
    fits = sensor_fits(posterior, posterior.starting_point())
    drawn = drawn_recordings(checks)
    if len(drawn) < len(checks):
        document.paragraph(
            f"The {counted(len(drawn), 'recording')} with the most remarks are presented in full; check.json contains "
            "the values of all recordings."
        )
    for index in drawn:
        check = checks[index]
        _add_recording(document, posterior, index, check)
        document.figure(
            figures.measured_against_simulated(fits[index]),
            "Measured readings, and readings simulated with the robot as given; below, the residual in σ. It is large "
            "until the unknown bodies are identified.",
        )
    document.write(file)


def drawn_recordings(checks: Sequence[RecordingCheck]) -> list[int]:
    """Return the recordings that a report shows in full: those with the most remarks, in their order."""
    ranked = sorted(range(len(checks)), key=lambda index: (-len(checks[index].warnings), index))
    return sorted(ranked[:DRAWN])


def _add_recording(document: Document, posterior: Posterior, index: int, check: RecordingCheck) -> None:
    document.section(f"Recording {check.name}")
    document.table(
        ["channel", "samples:", "interval [s]:", "longest gap [s]:"],
        [
            [c.name, str(c.samples), format_number(c.interval, 4), format_number(c.longest_gap, 4)]
            for c in check.channels
        ],
        "Channels of the recording.",
    )
    averaged = [spectrum for spectrum in check.spectra if spectrum.reduced]
    if averaged:
        document.table(
            ["channel", "samples:", "blocks:", "sigma above the block rate:", "declared:", "tones [Hz]", "spikes:"],
            [
                [
                    spectrum.name,
                    str(spectrum.samples),
                    str(spectrum.blocks),
                    format_number(spectrum.sigma, 3),
                    format_number(spectrum.declared, 3),
                    ", ".join(format_number(line.frequency, 4) for line in spectrum.tones) or "none",
                    str(spectrum.spikes),
                ]
                for spectrum in averaged
            ],
            "Channels that are averaged over blocks before the fit, and their content above the block rate.",
        )
    if check.spectra:
        last = max(float(spectrum.frequency[-1]) for spectrum in check.spectra)
        rotations = [each for each in _rotations(posterior.manoeuvres[index].recording) if each[0] < last]
        shaded = " The frequencies at which the recorded wheels rotate are shaded." if rotations else ""
        document.figure(
            figures.channel_spectra(check.spectra, rotations),
            "Amplitude spectral density of each channel, in its unit per root hertz. If samples are averaged over "
            f"blocks, the solid line marks the block rate; dotted lines mark tones above it.{shaded}",
        )
    document.table(
        ["sensor", "unit", "declared sigma:", "sigma in quiet periods:", "delay relative to the joints [s]:"],
        [
            [
                sensor.kind.value,
                format_unit(sensor.kind.unit),
                _by_axis(sensor.sigma),
                "not evaluated" if sensor.measured_sigma is None else _by_axis(sensor.measured_sigma),
                "not evaluated"
                if sensor.delay is None
                else " ± ".join(format_fixed(value, 3) for value in sensor.delay),
            ]
            for sensor in check.sensors
        ],
        "Noise and clocks. The noise is estimated from third differences in periods of a nearly constant signal; the "
        "delay is fitted with the robot as given and depends on its errors.",
    )
    if check.joints:
        document.table(
            [
                "joint",
                "range:",
                "largest speed:",
                "encoder sigma:",
                "chi-square per sample:",
                "sd of velocity:",
                "sd of acceleration:",
            ],
            [
                [
                    joint.name,
                    f"{format_fixed(joint.lowest, 3)} to {format_fixed(joint.highest, 3)} {joint.unit}",
                    f"{format_number(joint.speed)} {joint.unit}/s",
                    format_number(joint.sigma, 2) + ("" if joint.declared else " (estimated)"),
                    format_fixed(joint.chi2_per_sample, 2),
                    format_number(joint.velocity_sd, 2),
                    format_number(joint.acceleration_sd, 2),
                ]
                for joint in check.joints
            ],
            "Joint motion after smoothing; the last two columns are the standard deviations after smoothing [joint "
            "unit per s, per s²].",
        )
        document.figure(figures.plot_manoeuvre(posterior, index), "Motion of the joints.")


def _rotations(recording: Recording) -> list[tuple[float, float]]:
    """Return the lowest and the highest frequency of rotation of each wheel [Hz]."""
    speeds = [np.abs(recording.series(f"{WHEEL_SPEED}.{name}")[1]) for name in recording.wheels]
    return [(float(each.min()) / math.tau, float(each.max()) / math.tau) for each in speeds]


def _by_axis(values: Sequence[float] | np.ndarray) -> str:
    return ", ".join(format_number(float(value), 2) for value in values)
