"""The report of a check: what was read, before anything is identified."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bayesid.inference.posterior import Posterior
from bayesid.inference.recording_check import RecordingCheck
from bayesid.report import figures
from bayesid.report.document import Document

__all__ = ["check_report"]

CURVE_POINTS = 600


def check_report(posterior: Posterior, checks: Sequence[RecordingCheck], title: str, file: Path) -> None:
    """Write the report of a check as PDF.

    Parameters
    ----------
    posterior : Posterior
    checks : sequence of RecordingCheck
        One per recording.
    title : str
    file : path
    """
    document = Document(title, "Check of the study and its recordings")
    document.section("Summary")
    document.paragraph(
        f"{len(checks)} recordings, {posterior.samples} scalar samples, {posterior.size} unknowns. The integration "
        f"step is {posterior.step:g} s. Nothing was identified; simulated values are those of the robot as given."
    )
    remarks = [f"{check.name}: {warning}" for check in checks for warning in check.warnings]
    document.items(remarks or ["Nothing conspicuous."])
    robot = posterior.model.robot
    time = posterior.manoeuvres[0].recording.time
    if robot.joints:
        poses = np.linspace(time[0], time[-1], 5)[:-1]
        document.figure(
            figures.robot_pose(robot, posterior.manoeuvres[0].motion, poses), "The robot during the first recording."
        )
    for index, check in enumerate(checks):
        _add_recording(document, posterior, index, check)
    document.write(file)


def _add_recording(document: Document, posterior: Posterior, index: int, check: RecordingCheck) -> None:
    document.section(f"Recording {check.name}")
    document.table(
        ["channel", "samples", "interval [s]", "longest gap [s]"],
        [[c.name, str(c.samples), f"{c.interval:.4g}", f"{c.longest_gap:.4g}"] for c in check.channels],
        "What was recorded.",
        ["left", "right", "right", "right"],
    )
    document.table(
        ["sensor", "unit", "declared sigma", "sigma in quiet stretches", "delay against the joints [s]"],
        [
            [
                sensor.kind.value,
                sensor.kind.unit,
                _triple(sensor.sigma),
                "not evaluated" if sensor.measured_sigma is None else _triple(sensor.measured_sigma),
                "not evaluated" if sensor.delay is None else f"{sensor.delay[0]:.3f} ± {sensor.delay[1]:.3f}",
            ]
            for sensor in check.sensors
        ],
        "Noise and clocks. The noise is that of third differences where the signal hardly changes; the delay is fitted "
        "against the robot as given and shifts with its errors.",
        ["left", "left", "right", "right", "right"],
    )
    if check.joints:
        document.table(
            [
                "joint",
                "range",
                "largest speed",
                "encoder sigma",
                "chi-square per sample",
                "sd of velocity",
                "sd of acceleration",
            ],
            [
                [
                    joint.name,
                    f"{joint.lowest:.3f} to {joint.highest:.3f} {joint.unit}",
                    f"{joint.speed:.3g} {joint.unit}/s",
                    f"{joint.sigma:.2g}" + ("" if joint.declared else " (estimated)"),
                    f"{joint.chi2_per_sample:.2f}",
                    f"{joint.velocity_sd:.2g}",
                    f"{joint.acceleration_sd:.2g}",
                ]
                for joint in check.joints
            ],
            "Joint motion after smoothing; the last columns are what the smoothing leaves uncertain "
            "[joint unit per s, per s²].",
            ["left"] + ["right"] * 6,
        )
        manoeuvre = posterior.manoeuvres[index]
        time = np.linspace(manoeuvre.recording.time[0], manoeuvre.recording.time[-1], CURVE_POINTS)
        document.figure(figures.manoeuvre(manoeuvre.motion, posterior.model.robot, time), "Motion of the joints.")
    document.figure(
        figures.measured_against_simulated(posterior, posterior.starting_point(), index),
        "Measured, and simulated with the robot as given; beneath, the residual in σ. It is large until the unknown "
        "bodies are identified.",
    )


def _triple(values: Sequence[float] | np.ndarray) -> str:
    return ", ".join(f"{value:.2g}" for value in values)
