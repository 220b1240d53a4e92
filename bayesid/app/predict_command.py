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
        Path | None, typer.Option(help="posterior.nc of an earlier study, in place of the study's prior.")
    ] = None,
) -> Iterator[str]:
    """Predict where planned joint motions take base and end-effector: prediction.json and report.pdf."""
    from bayesid.app.schema import Study

    study = Study.load(file)
    if posterior is not None:
        study = study.with_posterior(posterior)

    import numpy as np

    from bayesid._io.files import complete_folder, write_json
    from bayesid.app.report_origin import report_origin
    from bayesid.app.study_to_model import load_manoeuvres, load_model
    from bayesid.design.base_prediction import BasePredictor
    from bayesid.recording.plausibility import refuse_impossible_motion
    from bayesid.report import format_quantity, prediction_report

    model = load_model(study)
    manoeuvres = load_manoeuvres(study, model.robot)
    for manoeuvre in manoeuvres:
        refuse_impossible_motion(manoeuvre.recording, model.robot)
    tip = None if study.design is None else study.design.tip_frame
    streams, predictors, predictions = np.random.SeedSequence(seed).spawn(len(manoeuvres)), [], []
    for index, (manoeuvre, stream) in enumerate(zip(manoeuvres, streams, strict=True)):
        progress(index / len(manoeuvres), f"predicting {manoeuvre.recording.name}")
        predictors.append(BasePredictor(model, manoeuvre, tip))
        predictions.append(predictors[-1].predict(draws, np.random.default_rng(stream)))
    with complete_folder(output) as folder:
        write_json(folder / "prediction.json", {"recordings": [prediction.to_dict() for prediction in predictions]})
        origin = report_origin(study, "predict", seed, output=output, draws=draws, posterior=posterior)
        first = predictors[0].posterior
        prediction_report(first, manoeuvres, predictions, study.title, folder / "report.pdf", origin=origin)
    for prediction in predictions:
        final = prediction.tip.pose().millimetres
        place = ", ".join(format_quantity(float(m), float(s)) for m, s in zip(final.mean, final.sd, strict=True))
        yield f"{prediction.name}: {prediction.tip_frame} ends at ({place}) mm from where the base started."
    yield f"Wrote {output / 'report.pdf'}."
