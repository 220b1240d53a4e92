"""The report of a simulation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from bayesid.inference.noise_changes import with_manoeuvres
from bayesid.inference.posterior import Posterior
from bayesid.inference.predicted_readings import integration_error_at, sensor_fits
from bayesid.recording.recording import Recording
from bayesid.report import figures
from bayesid.report.document import Document
from bayesid.report.model_assumptions import model_sentences
from bayesid.report.numbers import format_number, format_unit

__all__ = ["simulation_report"]


def simulation_report(
    posterior: Posterior,
    recordings: Sequence[Recording],
    title: str,
    file: Path,
    *,
    planned: bool = False,
    origin: str = "",
) -> None:
    """Write the report of simulated recordings as PDF, whole or not at all.

    Parameters
    ----------
    posterior : Posterior
        Posterior whose manoeuvres were simulated at its initial point.
    recordings : sequence of Recording
        Simulated recordings.
    title : str
        Title of the study.
    file : path
    planned : bool
        Whether the manoeuvres were planned, so that there are no readings to compare with the simulated ones.
    origin : str, optional
        Where the report comes from: files with their hashes, version, seed and command.
    """
    document = Document(title, "Simulation")
    document.foot(origin)
    document.section("Result")
    rows = []
    for recording in recordings:
        for sensor in posterior.model.sensors:
            if sensor.kind.mounted:
                _, values = recording.vector(sensor.kind.value)
                largest = np.abs(values).max(axis=0)
                readings = [format_number(float(value), 4) for value in largest]
                rows.append([recording.name, sensor.kind.value, format_unit(sensor.kind.unit), *readings])
    document.table(
        ["recording", "sensor", "unit", "x:", "y:", "z:"],
        rows,
        "Largest simulated readings per sensor axis, with the robot as given.",
    )
    z = posterior.starting_point()
    beside = "Readings simulated with the robot as given, and those of the study's recording; below, the residual in σ."
    if planned:
        pairs = zip(posterior.manoeuvres, recordings, strict=True)
        posterior = with_manoeuvres(posterior, [replace(flown, recording=recording) for flown, recording in pairs])
        beside = (
            "Readings simulated with the robot as given: without noise, and as written to the file (drawn as "
            "measured); below, their difference in σ."
        )
    fits = sensor_fits(posterior, z)
    for index, recording in enumerate(recordings):
        document.section(f"Recording {recording.name}")
        if posterior.model.robot.joints:
            document.figure(figures.plot_manoeuvre(posterior, index), "Motion of the joints.")
        document.figure(figures.measured_against_simulated(fits[index]), beside)
    document.section("Assumptions")
    document.items(model_sentences(posterior, integration_error_at(posterior, z)))
    document.write(file)
