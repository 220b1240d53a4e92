"""Command ``bayesid predict``, which predicts the trajectories of base and end-effector in planned manoeuvres."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

from bayesid._io.progress import Progress
from bayesid.app.options import Output, Seed, StudyFile

__all__ = ["run"]


def run(
    file: StudyFile,
    output: Output,
    progress: Progress,
    seed: Seed = 0,
    draws: Annotated[int, typer.Option(min=2, help="Number of draws of the robot's parameters.")] = 500,
    posterior: Annotated[
        Path | None, typer.Option(help="posterior.nc of an earlier study, which replaces the study's prior.")
    ] = None,
) -> Iterator[str]:
    """Predict the motion of base and end-effector for planned joint motions: prediction.json and report.pdf."""
    from bayesid.app.schema import Study

    study = Study.load(file)

    from bayesid._io.files import complete_folder, write_json
    from bayesid.app.functions.predict_study import predict
    from bayesid.app.report_origin import report_origin
    from bayesid.report import prediction_report

    result = predict(study, seed=seed, draws=draws, posterior=posterior, progress=progress)
    with complete_folder(output) as folder:
        write_json(folder / "prediction.json", result.to_dict())
        origin = report_origin(study, "predict", seed, output=output, draws=draws, posterior=posterior)
        drawn = (result.posterior, result.manoeuvres, result.recordings)
        prediction_report(*drawn, study.title, folder / "report.pdf", origin=origin)
    yield from result.summary().sentences
    yield f"Wrote {output / 'report.pdf'}."
