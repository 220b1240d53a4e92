"""Command ``bayesid simulate``, which computes the readings of a study's sensors at the given values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

import typer

from bayesid._io.errors import InputError
from bayesid.app.options import Output, Seed, StudyFile

__all__ = ["run"]


def run(
    file: StudyFile,
    output: Output,
    seed: Seed = 0,
    noise: Annotated[bool, typer.Option(help="Add the declared noise of the sensors.")] = True,
) -> Iterator[str]:
    """Simulate the sensor readings of a study with its given values: recordings, simulation.json, report.pdf."""
    from bayesid.app.schema import Study

    study = Study.load(file)

    from bayesid._io.files import complete_folder, write_json
    from bayesid.app.functions.simulate_study import simulate
    from bayesid.app.report_origin import report_origin
    from bayesid.report import simulation_report

    for section in study.recordings:
        if output.resolve() == section.file.resolve().parent:
            problem = "the folder contains the recordings of the study, which the simulated ones would replace"
            raise InputError(problem, file=output, remedy="Choose another output folder")
    result = simulate(study, seed, noise=noise)
    with complete_folder(output) as folder:
        for recording in result.recordings:
            recording.write(folder / f"{recording.name}.csv")
        write_json(folder / "simulation.json", result.to_dict())
        origin, shown = report_origin(study, "simulate", seed, output=output, noise=noise), folder / "report.pdf"
        simulation_report(
            result.posterior, result.recordings, study.title, shown, planned=result.planned, origin=origin
        )
    yield str(result)
    names = [f"{recording.name}.csv" for recording in result.recordings]
    yield f"Wrote {', '.join(str(output / name) for name in (*names, 'report.pdf'))}."
