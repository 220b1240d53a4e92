"""Command ``bayesid simulate``, which computes the readings of a study's sensors at the given values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

import typer

from bayesid.app.options import Output, Seed, StudyFile

__all__ = ["run"]


def run(
    file: StudyFile,
    output: Output,
    seed: Seed = 0,
    noise: Annotated[bool, typer.Option(help="Add the declared noise of the sensors.")] = True,
) -> Iterator[str]:
    """Simulate the sensors of a study's recordings at the given values: recordings, simulation.json and report.pdf."""
    from bayesid.app.schema import Study

    study = Study.load(file)

    import numpy as np

    from bayesid._io.files import complete_folder, write_json
    from bayesid.app.report_origin import report_origin
    from bayesid.app.study_to_linearisation import lacking_sensors, planned_manoeuvres
    from bayesid.app.study_to_model import load_manoeuvres, load_model
    from bayesid.inference.posterior import Posterior
    from bayesid.inference.predicted_readings import integration_error_at, simulate_recordings
    from bayesid.inference.wrong_units import refuse_wrong_units
    from bayesid.report import simulation_report

    model = load_model(study)
    manoeuvres = load_manoeuvres(study, model.robot)
    planned = bool(lacking_sensors(model, manoeuvres))
    if planned:
        manoeuvres, _ = planned_manoeuvres(study, model, manoeuvres)
    posterior = Posterior.of(model, manoeuvres)
    if not planned:
        refuse_wrong_units(posterior)
    recordings = simulate_recordings(posterior, np.random.default_rng(seed) if noise else None)
    error = integration_error_at(posterior, posterior.starting_point())
    with complete_folder(output) as folder:
        for recording in recordings:
            recording.write(folder / f"{recording.name}.csv")
        content = {
            "recordings": [
                {
                    "file": f"{recording.name}.csv",
                    "largest": {
                        kind.value: [
                            float(np.nanmax(np.abs(recording.channels[f"{kind.value}.{axis}"]))) for axis in "xyz"
                        ]
                        for kind in (sensor.kind for sensor in posterior.model.sensors)
                        if kind.mounted
                    },
                }
                for recording in recordings
            ],
            "noise": noise,
            "integration": {"step": posterior.step, "error_in_sigma": error},
        }
        write_json(folder / "simulation.json", content)
        origin = report_origin(study, "simulate", seed, output=output, noise=noise)
        simulation_report(posterior, recordings, study.title, folder / "report.pdf", planned=planned, origin=origin)
    yield f"Simulated {len(recordings)} recordings; integration step {posterior.step:g} s, error {error:.2g} sigma."
    yield f"Wrote {output / 'report.pdf'}."
