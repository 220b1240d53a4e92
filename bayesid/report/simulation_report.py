"""The report of a simulation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import integration_error_at
from bayesid.recording.recording import Recording
from bayesid.report import figures
from bayesid.report.assumptions import model_sentences
from bayesid.report.document import Document

__all__ = ["simulation_report"]

CURVE_POINTS = 600


def simulation_report(posterior: Posterior, recordings: Sequence[Recording], title: str, file: Path) -> None:
    """Write the report of simulated recordings as PDF.

    Parameters
    ----------
    posterior : Posterior
        Whose manoeuvres were simulated at its initial point.
    recordings : sequence of Recording
        As simulated.
    title : str
    file : path
    """
    document = Document(title, "Simulation")
    document.section("Result")
    rows = []
    for recording in recordings:
        for sensor in posterior.model.sensors:
            if sensor.kind.mounted:
                _, values = recording.vector(sensor.kind.value)
                largest = np.abs(values).max(axis=0)
                rows.append(
                    [recording.name, sensor.kind.value, sensor.kind.unit, *(f"{value:.4g}" for value in largest)]
                )
    document.table(
        ["recording", "sensor", "unit", "x", "y", "z"],
        rows,
        "Largest simulated readings per sensor axis, with the robot as given.",
        ["left", "left", "left", "right", "right", "right"],
    )
    z = posterior.starting_point()
    for index, recording in enumerate(recordings):
        manoeuvre = posterior.manoeuvres[index]
        document.section(f"Recording {recording.name}")
        if posterior.model.robot.joints:
            time = np.linspace(recording.time[0], recording.time[-1], CURVE_POINTS)
            document.figure(figures.manoeuvre(manoeuvre.motion, posterior.model.robot, time), "Motion of the joints.")
        document.figure(
            figures.measured_against_simulated(posterior, z, index),
            "Simulated with the robot as given, beside what the study's recording holds; beneath, the residual in σ.",
        )
    document.section("What was assumed")
    document.items(model_sentences(posterior, integration_error_at(posterior, z)))
    document.write(file)
